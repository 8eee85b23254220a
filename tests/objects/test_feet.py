"""Feet of objects: what of them lies near the ground, whatever their kind, turn and lean."""

import numpy as np
import pytest
import trimesh

from greensward.ground import HeightField
from greensward.objects import feet
from greensward.objects.feet import feet_of, trapezoids
from greensward.objects.placing import Placing
from greensward.sowing.clearings import Pieces
from oracles.clearings import open_at
from small_scenes import NOISE, small_scene

HIGH_M = 0.3
AXIS = np.arange(-2.5, 2.5, 0.05) + 0.0137
POINTS = np.stack(np.meshgrid(AXIS, AXIS), -1).reshape(-1, 2)


def _covered(table, folder=".", **tables):
    """Which of the points lie on the foot of an object."""
    scene = small_scene(object=[{"position_m": [0.0, 0.0, 0.0], **table}], **tables).in_folder(folder)
    heights = HeightField.of(scene)
    feet = feet_of(scene.object, Placing(scene.object, heights), heights, scene.resolve, HIGH_M)
    if not feet:
        return np.zeros(len(POINTS), np.bool_)
    ((corners, radius_m),) = feet
    return open_at(POINTS, Pieces.of(corners, radius_m, 0.0)) < 0.5


def _turned(degrees):
    """The points in the own frame of an object with this yaw."""
    yaw = np.radians(degrees)
    x, z = POINTS.T
    return x * np.cos(yaw) - z * np.sin(yaw), x * np.sin(yaw) + z * np.cos(yaw)


def _agree(found, expected, share=0.01):
    assert expected.any()
    assert (found != expected).mean() < share


def test_a_turned_box_covers_its_base_and_a_leaning_one_what_is_low():
    x, z = _turned(30.0)
    _agree(_covered({"kind": "box", "size_m": [3.0, 0.1, 1.0], "yaw_deg": 30.0}), (abs(x) < 1.5) & (abs(z) < 0.5))
    # a long board that leans nearly flat is near the ground at one end only
    board = {"kind": "box", "size_m": [0.1, 4.0, 1.0], "yaw_deg": 30.0, "roll_deg": 80.0}
    reach = HIGH_M / np.tan(np.radians(10.0))
    _agree(_covered(board), (x > -0.1) & (x < reach) & (abs(z) < 0.5), 0.02)


@pytest.mark.parametrize(
    ("table", "radius"),
    [
        ({"kind": "cylinder", "size_m": [2.0, 3.0, 2.0]}, 1.0),
        ({"kind": "sphere", "size_m": [4.0, 4.0, 4.0]}, np.sqrt(4.0 - (2.0 - HIGH_M) ** 2)),
        ({"kind": "capsule", "radius_m": 1.0, "length_m": 3.0}, np.sqrt(1.0 - (1.0 - HIGH_M) ** 2)),
        ({"kind": "sphere", "size_m": [4.0, 4.0, 4.0], "position_m": [0.0, -2.0, 0.0]}, 2.0),
    ],
)
def test_what_is_round_covers_a_disc(table, radius):
    _agree(_covered(table), np.hypot(*POINTS.T) < radius, 0.015)


def test_an_ellipse_stays_one():
    x, z = _turned(-20.0)
    covered = _covered({"kind": "cylinder", "size_m": [4.0, 1.0, 2.0], "yaw_deg": -20.0})
    _agree(covered, (x / 2.0) ** 2 + z**2 < 1.0, 0.015)


def test_what_is_above_the_grass_or_below_the_ground_covers_nothing():
    for y in (0.5, -3.0):
        assert not _covered({"kind": "box", "size_m": [2.0, 1.0, 2.0], "position_m": [0.0, y, 0.0]}).any()
    assert _covered({"kind": "box", "size_m": [2.0, 5.0, 2.0], "position_m": [0.0, -3.0, 0.0]}).any()


def test_on_a_slope_the_part_in_the_ground_counts():
    table = {"kind": "box", "size_m": [4.0, 1.0, 4.0], "position_m": [0.0, -0.7, 0.0]}
    covered = _covered(table, ground={**NOISE, "height_m": 12.0})
    assert 0.05 < covered.mean() < 0.64 - 0.02


@pytest.fixture(scope="module")
def meshes(tmp_path_factory):
    """A frame of four walls around a yard; a table on four legs; a post with a wide top."""
    folder = tmp_path_factory.mktemp("meshes")

    def box(x, y, z, *size):
        return trimesh.creation.box(size, trimesh.transformations.translation_matrix([x, y + size[1] / 2, z]))

    walls = [box(0, 0, s * 1.8, 4, 1, 0.4) for s in (-1, 1)] + [box(s * 1.8, 0, 0, 0.4, 1, 3.2) for s in (-1, 1)]
    legs = [box(sx * 1.5, 0, sz * 0.8, 0.3, 0.7, 0.3) for sx in (-1, 1) for sz in (-1, 1)]
    for name, parts in {"yard": walls, "table": [*legs, box(0, 0.7, 0, 3.6, 0.1, 2.0)]}.items():
        trimesh.util.concatenate(parts).export(folder / f"{name}.glb")
    return folder


def test_a_yard_keeps_its_grass_and_its_walls_have_none(meshes):
    x, z = _turned(25.0)
    covered = _covered({"kind": "mesh", "file": "yard.glb", "yaw_deg": 25.0}, meshes)
    outer, inner = (np.maximum(abs(x), abs(z)) < half for half in (2.0, 1.6))
    _agree(covered, outer & ~inner, 0.05)
    assert not (covered & (np.maximum(abs(x), abs(z)) < 1.5)).any()


def test_a_table_stands_on_its_legs(meshes):
    x, z = POINTS.T
    covered = _covered({"kind": "mesh", "file": "table.glb"}, meshes)
    _agree(covered, (abs(abs(x) - 1.5) < 0.15) & (abs(abs(z) - 0.8) < 0.15), 0.02)


def test_trapezoids_make_up_any_polygon():
    outline = np.array([[-2, -2], [2, -1], [0.5, 0], [2, 2], [0, 0.5], [-1, 2], [-2.2, 1], [-0.5, 0.3]], np.float64)
    pieces = Pieces.of(trapezoids(outline), 0.0, 0.0)
    a, b = outline, np.roll(outline, -1, axis=0)
    x, z = POINTS[:, :1], POINTS[:, 1:]
    crosses = (a[:, 1] < z) != (b[:, 1] < z)
    at = a[:, 0] + (z - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    _agree(open_at(POINTS, pieces) < 0.5, (crosses & (at < x)).sum(axis=1) % 2 == 1, 1e-3)


def test_a_fine_mesh_has_a_whole_foot_of_few_pieces(tmp_path):
    trimesh.creation.icosphere(5, 2.0).export(tmp_path / "ball.glb")
    scene = small_scene(object=[{"kind": "mesh", "file": "ball.glb", "position_m": [0.0, -1.0, 0.0]}])
    scene, heights = scene.in_folder(tmp_path), HeightField.of(scene)
    ((corners, _),) = feet_of(scene.object, Placing(scene.object, heights), heights, scene.resolve, HIGH_M)
    _agree(open_at(POINTS, Pieces.of(corners, 0.0, 0.0)) < 0.5, np.hypot(*POINTS.T) < np.sqrt(4.0 - 0.7**2), 0.02)
    assert len(corners) < 40


def test_meshes_that_stand_alike_have_one_foot_turned_as_they_are(tmp_path, monkeypatch):
    trimesh.creation.box((0.6, 0.2, 0.3)).export(tmp_path / "slab.ply")
    made, raster = [], feet._raster
    monkeypatch.setattr(feet, "_raster", lambda *given: made.append(given) or raster(*given))
    slab = {"kind": "mesh", "file": "slab.ply"}
    things = [{**slab, "position_m": [1.0 * k, 0.0, 2.0], "yaw_deg": 10.0 * k, "name": f"{k}"} for k in range(20)]
    counts = []
    for ground in ({"kind": "flat"}, NOISE):
        scene = small_scene(object=things, ground=ground).in_folder(tmp_path)
        heights = HeightField.of(scene)
        placing = Placing(scene.object, heights)
        made.clear()
        found = feet_of(scene.object, placing, heights, scene.resolve, HIGH_M)
        counts.append(len(made))
    assert counts == [1, 20]
    level = small_scene(object=things).in_folder(tmp_path)
    flat = HeightField.of(level)
    found = feet_of(level.object, Placing(level.object, flat), flat, level.resolve, HIGH_M)
    for k, (corners, _) in enumerate(found):
        yaw = np.radians(10.0 * k)
        own = (corners.reshape(-1, 2) - [1.0 * k, 2.0]) @ [[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]]
        np.testing.assert_allclose(np.abs(own).max(axis=0), [0.3, 0.15], atol=0.01)
