"""Grass that moves along with what it grows on, and grass that grows: blades and heads alike."""

import numpy as np
import pytest

from blades import numbers_of
from greensward.scene import SurfaceClass
from greensward.techniques import TECHNIQUES
from reprojection import world_points
from small_scenes import GRASS, small_scene, with_pictures

NAMES = [each.name for each in TECHNIQUES if each.needs(each.Settings()).stored]
pytestmark = pytest.mark.parametrize("technique", NAMES)
_FUR = {"density_per_m2": 80.0}
_FLOWERS = {**GRASS, "height_m": [0.15, 0.3], "head": "daisy", "head_size_m": [0.06, 0.09]}


@pytest.mark.slow
@pytest.mark.parametrize("way", ["turns", "slides", "both", "tumbles"])
def test_grass_moves_as_its_object_does(renderer, technique, way):
    path = {
        "times_s": [0.0, 1.0],
        "positions_m": [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0] if way == "turns" else [0.9, 0.3, 0.6]],
        "yaws_deg": [10.0, 10.0 if way == "slides" else 80.0],
        "smooth": False,
    }
    box = {
        "kind": "box",
        "name": "box",
        "position_m": [0.0, 0.0, 0.0],
        "size_m": [1.6, 0.6, 1.0],
        "grass": _FUR,
        "path": path,
    }
    scripts = {}
    if way == "tumbles":
        del box["path"]
        axis = np.array([0.6, 0.0, 0.8])
        scripts["box"] = lambda time_s: _tumbled(axis, time_s)
    # no weight, or blades would sag anew as the object turns over
    scene = small_scene(
        technique={"name": technique},
        grass=[{**_FLOWERS, "stiffness": [1.0, 1.0]}],
        object=[box],
        sowing={"density_per_m2": 5.0},
    )
    drawn = renderer(scene, size=(200, 120), scripts=scripts)
    drawn.render(0.5)
    truth = drawn.render(0.55, aovs=("motion", "depth", "class", "blade_id")).truth
    page = next(page for page in drawn._world.field.pages if page.object_index is not None)
    numbers = numbers_of(drawn._world.field, truth["blade_id"]) - page.first_number
    mine = (truth["blade_id"] > 0) & (numbers >= 0) & (numbers < page.count)
    now, then = (drawn._world.placing.at(time_s)[0] for time_s in (0.55, 0.5))
    before = world_points(drawn, scene.camera, truth["depth"])[mine] @ (then @ np.linalg.inv(now))[:3, :3].T
    before += (then @ np.linalg.inv(now))[:3, 3]
    view_from_world, clip_from_view = drawn.camera_matrices()
    clip = np.concatenate([before, np.ones((len(before), 1))], 1) @ (clip_from_view @ view_from_world).T
    height, width = mine.shape
    was = clip[:, :2] / clip[:, 3:] * [0.5 * width, -0.5 * height] + [0.5 * width, 0.5 * height]
    rows, columns = np.nonzero(mine)
    expected = np.stack([columns + 0.5, rows + 0.5], 1) - was
    error = np.abs(truth["motion"][mine] - expected).max(axis=1)
    kind = truth["class"][mine]
    assert np.linalg.norm(expected, axis=1).max() > 1.0
    for each in ("grass", "flower"):
        assert (kind == SurfaceClass[each.upper()]).sum() > 100, each
        allowed = 0.5 if way == "tumbles" else 0.02
        assert np.quantile(error[kind == SurfaceClass[each.upper()]], 0.95) < allowed, each


def _tumbled(axis: np.ndarray, time_s: float) -> np.ndarray:
    angle, matrix = 0.5 * time_s, np.eye(4)
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    matrix[:3, :3] += np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
    matrix[:3, 3] = 0.5 * time_s, 0.3, 0.0
    return matrix


def test_the_map_of_the_ground_does_not_colour_grass_on_objects(renderer, technique, tmp_path):
    red = np.zeros((4, 4, 4), np.uint8)
    red[...] = 255, 0, 0, 255
    scene = with_pictures(
        tmp_path,
        {"red.png": red},
        technique={"name": technique},
        sowing={"vegetation_map": "red.png"},
        object=[{"kind": "box", "position_m": [0.0, 0.0, 0.0], "size_m": [1.6, 0.6, 1.0], "grass": _FUR}],
    )
    drawn = renderer(scene)
    truth = drawn.render(aovs=("albedo", "blade_id")).truth
    page = next(page for page in drawn._world.field.pages if page.object_index is not None)
    numbers = numbers_of(drawn._world.field, truth["blade_id"])
    on_object = (numbers >= page.first_number) & (numbers < page.first_number + page.count)
    on_ground = (numbers > 0) & ~on_object
    red_of, green_of = truth["albedo"][..., 0], truth["albedo"][..., 1]
    assert on_object.sum() > 300
    assert on_ground.sum() > 300
    assert (red_of > green_of)[on_ground].all()
    assert (red_of < green_of)[on_object].all()


@pytest.mark.slow
def test_heads_come_as_a_blade_nears_its_height(renderer, technique):
    def flowers(age: float | None) -> int:
        growth = {} if age is None else {"growth": {"age": age, "time_s": 1e9, "spread": 0.0}}
        scene = small_scene(technique={"name": technique}, grass=[_FLOWERS], **growth)
        return int((renderer(scene).render(aovs=("class",)).truth["class"] == SurfaceClass.FLOWER).sum())

    counts = [flowers(age) for age in (0.1, 0.3, 0.7, 0.85, 1.0)]
    assert counts[:2] == [0, 0]
    assert 0 < counts[2] < counts[3] < counts[4] == flowers(None)
