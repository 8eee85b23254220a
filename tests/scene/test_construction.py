"""Scenes built in Python: mistakes are the sentences of a file, and NumPy's arrays count as lists."""

import copy
import pickle

import numpy as np
import pytest

import greensward as gs
from greensward import colours, forces, grounds, objects, winds

_AT = (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("build", "expected"),
    [
        (lambda: gs.Camera(fov_y_deg=400), ["Camera: fov_y_deg: must be at most 360 (got 400)"]),
        (lambda: gs.Camera(_AT), ["Camera: takes values by key only, such as Camera(position_m=…)"]),
        (lambda: winds.Strong(direction_dog=3), ["Strong: direction_dog: unknown key; did you mean direction_deg?"]),
        (lambda: gs.Grass(color=3, share=-1), 2),
        (lambda: gs.Scene(grass=[{"height_m": (2, 1)}]), ["Scene: grass[0].height_m: must be [low, high] with low"]),
        (lambda: gs.Scene(ground="flat"), ['Scene: ground: must be a table (got "flat")']),
        (lambda: gs.Scene(object=[winds.Gusts()]), ["object[0].kind: must be one of box, sphere, cylinder, capsule"]),
        (lambda: gs.Scene(wind=winds.Gusts()), ["Scene: wind: must be a list, so put the Gusts into brackets"]),
        (lambda: objects.Box(position_m=_AT, kind="sphere"), ['Box: kind: must be one of box (got "sphere")']),
        (lambda: colours.ChannelNoise(weight=0.0), ["ChannelNoise: weight: must be at least 0.001 (got 0.0)"]),
        (lambda: forces.Tracks(path=np.zeros((1, 2))), ["Tracks: path: must hold at least 2 values (got 1)"]),
        (lambda: grounds.HeightMapGround(), ["HeightMapGround: file: is missing and has no default"]),
        (
            lambda: gs.CameraKey(time_s=0, position_m="here", target_m=_AT),
            ['position_m: must be a list (got "here")'],
        ),
        (
            lambda: gs.Camera(position_m=np.array([0, 1, np.nan])),
            ["position_m[2]: must be a finite number"],
        ),
        (lambda: gs.Camera(fov_y_deg=np.bool_(True)), ["Camera: fov_y_deg: must be a number (got true)"]),
        (lambda: gs.Camera(fov_y_deg=np.str_("40")), ['Camera: fov_y_deg: must be a number (got "40")']),
        (lambda: gs.Scene(seed=np.float64(3)), ["Scene: seed: must be a whole number (got 3.0)"]),
        (lambda: gs.Sun().model_copy(update={"azimuth_deg": "east", "up": 1}), 2),
        (
            lambda: gs.Camera().model_copy(update={"target_m": gs.Camera().position_m}),
            ["Camera: target_m must differ"],
        ),
        (lambda: setattr(gs.Sun(), "strength", 2.0), ["Sun: strength: cannot change", 'update={"strength": …}']),
    ],
)
def test_a_mistake_in_python_is_a_sentence(build, expected):
    with pytest.raises(gs.SceneError) as caught:
        build()
    if isinstance(expected, int):
        assert len(caught.value.problems) == expected
    else:
        (problem,) = caught.value.problems
        assert all(part in problem for part in expected)


def test_arrays_and_their_scalars_are_numbers_pairs_and_points():
    points = np.array([[0.0, 0.0], [1.0, 2.5]], np.float32)
    camera = gs.Camera(position_m=np.arange(3), target_m=[np.float32(0.5), np.int16(2), 0], fov_y_deg=np.float32(40))
    assert (camera.position_m, camera.target_m, camera.fov_y_deg) == ((0, 1, 2), (0.5, 2, 0), 40)
    assert all(type(value) is float for value in (*camera.position_m, *camera.target_m, camera.fov_y_deg))
    scene = gs.Scene(
        seed=np.uint32(7), force=[{"kind": "tracks", "path": points}], shadows={"enabled": np.bool_(False)}
    )
    assert (scene.seed, scene.force[0].path, scene.shadows.enabled) == (7, ((0, 0), (1, 2.5)), False)
    assert gs.Grass(height_m=points[1] + 1).height_m == (2.0, 3.5)


def test_a_copy_keeps_what_it_does_not_change(tmp_path):
    scene = gs.load("meadow", technique="bezier-blades").in_folder(tmp_path)
    other = scene.model_copy(update={"seed": np.int64(9), "water": {"level_m": -3}})
    assert (other.seed, other.water) == (9, gs.Water(level_m=-3))
    assert (other.folder, other.grass, other.object) == (tmp_path, scene.grass, scene.object)
    choice = gs.TechniqueChoice(name="bezier-blades", max_level=4)
    assert choice.model_copy(update={"max_level": 2}).model_extra == {"max_level": 2}
    assert pickle.loads(pickle.dumps(other)) == copy.deepcopy(other) == other
