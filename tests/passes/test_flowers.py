"""Billboard flowers: where they grow, how they sway, and that nothing depends on the camera that should not."""

import numpy as np
import pytest

from greensward.passes import flowers
from greensward.scene import Camera, InputError, Scene, SceneError, SurfaceClass
from live_objects import live_objects
from small_scenes import BREEZE, NOISE, small_scene, with_pictures

_FLOWER = SurfaceClass.FLOWER
_TABLE = {"density_per_m2": 3.0, "height_m": [0.5, 0.8], "patchiness": 0.0, "reach_m": 20.0}


def _scene(table=None, **tables):
    return small_scene(flowers=[{**_TABLE, **(table or {})}], **{"grass": [], **tables})


def _cover(frame):
    return (frame.truth["class"] == _FLOWER).mean()


def test_flowers_appear_with_every_technique(renderer):
    for technique in ("visibility-buffer", "bezier-blades", "tessellated-quads", "geometry-billboards"):
        frame = renderer(_scene(technique={"name": technique})).render(aovs=["class", "blade_id"])
        assert _cover(frame) > 0.005
        assert np.array_equal(frame.truth["blade_id"] > 0, frame.truth["class"] == _FLOWER)


def test_the_same_flower_stands_at_the_same_place_whatever_the_camera(renderer):
    drawn = renderer(_scene(ground=NOISE))
    found = []
    for x in (0.0, 6.3):
        drawn.render(camera=Camera(position_m=(x, 1.0, 4.0), target_m=(x, 0.0, -3.0)))
        rows = np.frombuffer(drawn._geometry.flowers._parts[0].flowers.read(), np.float32)
        rows = rows[: len(rows) // 20 * 20].reshape(-1, 20)
        roots = rows[rows[:, 3] > 0, :3]
        here = (np.abs(roots[:, 0] - 3.0) < 5.0) & (np.abs(roots[:, 2] - 4.0) < 8.0)
        found.append({tuple(root) for root in roots[here].tolist()})
    assert len(found[0]) > 100
    assert found[0] == found[1]


def test_plants_of_several_buffers_are_those_of_one(renderer, monkeypatch):
    scene, aovs = small_scene(grass=[], flowers=[_TABLE, {**_TABLE, "colour": "#bb2211"}]), ("class", "blade_id")
    whole = renderer(scene)
    assert len(whole._geometry.flowers._parts) == 2
    seen = [whole.render(aovs=aovs)]
    monkeypatch.setattr(flowers, "_MOST_BYTES", 80 * 1000)
    parted = renderer(scene)
    assert len(parted._geometry.flowers._parts) > 8
    seen.append(parted.render(aovs=aovs))
    assert np.array_equal(seen[0].image, seen[1].image)
    assert np.array_equal(seen[0].truth["blade_id"], seen[1].truth["blade_id"])


def test_more_places_than_have_numbers_are_refused():
    with pytest.raises(SceneError, match=r"flowers: must have at most 134 million places .* \(got 400 million\)"):
        Scene(flowers=[{"density_per_m2": 100.0, "reach_m": 1000.0}])


def test_more_grow_where_more_are_asked_for_and_none_beyond_the_reach(renderer):
    few, many, near = (
        renderer(_scene(table)).render(aovs=["class", "depth"])
        for table in ({"density_per_m2": 0.5}, {}, {"reach_m": 5.0})
    )
    assert _cover(few) < 0.6 * _cover(many)
    assert 0 < near.truth["depth"][near.truth["class"] == _FLOWER].max() < 5.0


def test_the_density_map_tells_where(renderer, tmp_path):
    half = np.zeros((8, 8, 3), np.uint8)
    half[:, :4] = 255
    tables = {
        "flowers": [_TABLE],
        "grass": [],
        "ground": {"size_m": [40.0, 40.0]},
        "sowing": {"density_map": "half.png"},
    }
    frame = renderer(with_pictures(tmp_path, {"half.png": half}, **tables)).render(aovs=["class"])
    flower = frame.truth["class"] == _FLOWER
    assert flower[:, :70].mean() > 0.005
    assert flower[:, 95:].mean() < 0.1 * flower[:, :70].mean()


def test_they_sway_and_their_motion_tells_how(renderer):
    drawn = renderer(_scene(wind=[BREEZE]))
    frames = [drawn.render(time_s, aovs=["motion", "class"]) for time_s in (1.0, 1.1)]
    flower = frames[1].truth["class"] == _FLOWER
    assert np.quantile(np.linalg.norm(frames[1].truth["motion"][flower], axis=1), 0.9) > 0.1
    still = renderer(_scene())
    still.render(1.0)
    calm = still.render(1.1, aovs=["motion", "class"])
    assert np.abs(calm.truth["motion"][calm.truth["class"] == _FLOWER]).max() < 0.01
    again = drawn.render(1.1, aovs=["motion", "class"])
    assert np.array_equal(again.image, frames[1].image)


def test_they_cast_shadows(renderer):
    means = []
    for enabled in (True, False):
        drawn = renderer(
            _scene({"density_per_m2": 20.0}, shadows={"enabled": enabled, "size_px": 512, "nearest_m": 5.0})
        )
        frame = drawn.render(aovs=["class"])
        means.append(frame.image[frame.truth["class"] == SurfaceClass.GROUND].mean())
    assert means[0] < means[1] - 2


def test_a_picture_of_ones_own(renderer, tmp_path):
    red = np.zeros((32, 16, 4), np.uint8)
    red[:16] = (220, 20, 20, 255)
    tables = {"flowers": [{**_TABLE, "picture": "red.png"}], "grass": []}
    truth = renderer(with_pictures(tmp_path, {"red.png": red}, **tables)).render(aovs=["class", "albedo"]).truth
    albedo = truth["albedo"][truth["class"] == _FLOWER]
    assert len(albedo) > 50
    assert (albedo[:, 0] > 5 * albedo[:, 1]).mean() > 0.95


def test_a_picture_that_nobody_would_see_is_refused(renderer, tmp_path):
    tables = {"flowers": [{**_TABLE, "picture": "none.png"}]}
    scene = with_pictures(tmp_path, {"none.png": np.zeros((4, 4, 4), np.uint8)}, **tables)
    with pytest.raises(InputError, match=r"none\.png: flowers\.picture: must be opaque somewhere"):
        renderer(scene)


def test_everything_is_released(device, renderer):
    before = live_objects(device)
    for stage in ("fragment", "compute"):
        drawn = renderer(_scene(ground=NOISE, wind=[BREEZE]), stage=stage, samples=2)
        drawn.render(0.5)
        assert live_objects(device) != before
        drawn.release()
        assert live_objects(device) == before


def test_without_flowers_nothing_is_made(renderer):
    scene: Scene = small_scene()
    assert scene.flowers == ()
    assert renderer(scene).render(aovs=["class"]).truth["class"].max() < _FLOWER
