"""Culling leaves out nothing that shows, and hands every blade that is kept to one instance."""

import numpy as np
import pytest

from greensward.culling import ChunkTable, coverage_needed, distance_to, in_view
from greensward.culling import tiles as tiles_module
from greensward.scene import SurfaceClass
from greensward.sowing.field import Tiles
from greensward.viewpoint import camera_view
from small_scenes import BREEZE, GRASS, NOISE, small_scene

_CAMERAS = {
    "ahead": {},
    "down": {"position_m": [0.3, 4.0, 0.0], "target_m": [0.0, 0.0, 0.05]},
    "up": {"position_m": [0.0, 0.2, 0.0], "target_m": [0.0, 2.0, -3.0]},
    "behind": {"position_m": [0.0, 0.6, 0.0], "target_m": [3.0, 0.0, 9.0]},
    "telescope": {"position_m": [0.0, 1.0, 5.0], "target_m": [0.5, 0.2, -3.0], "fov_y_deg": 4.0},
    "sideways telescope": {"position_m": [5.0, 1.0, 0.0], "target_m": [-3.0, 0.2, 0.5], "fov_y_deg": 4.0},
    "wide": {"position_m": [0.0, 0.9, 2.0], "target_m": [0.0, 0.4, -1.0], "fov_y_deg": 130.0},
    "far clip": {"position_m": [0.0, 1.2, 4.0], "target_m": [0.0, 0.3, -3.0], "far_m": 6.0},
}


def _tiles(low: np.ndarray, high: np.ndarray) -> Tiles:
    none = np.zeros(len(low), np.int64)
    return Tiles(low, high, np.ones(len(low)), none, np.zeros((len(low), 8), np.int64), none, none, none)


@pytest.mark.parametrize("camera", _CAMERAS)
def test_a_box_with_a_visible_point_is_visible(renderer, camera):
    scene = small_scene(camera=_CAMERAS[camera])
    view = camera_view(scene.camera, renderer(scene)._world.ground.heights, (160, 90))
    random = np.random.default_rng(2)
    low = random.uniform(-15, 15, (9000, 3))
    boxes = _tiles(low, low + random.uniform(0.1, 4, (9000, 3)))
    inside = random.uniform(0, 1, (100, 1, 3)) * (boxes.high - boxes.low) + boxes.low
    clip = inside @ view.clip_from_world[:, :3].T + view.clip_from_world[:, 3]
    shows = (np.abs(clip[..., :3]) <= clip[..., 3:]).all(axis=2).any(axis=0)
    seen = in_view(boxes, [view])[0]
    assert shows.sum() > 10
    assert seen[shows].all()
    assert (~seen).sum() > 500, "culls nothing"


def test_distance_to_a_box():
    boxes = _tiles(np.array([[0.0, 0, 0]] * 3), np.array([[1.0, 1, 1]] * 3))
    for point, expected in (((0.5, 0.5, 0.5), 0.0), ((2, 0.5, 0.5), 1.0), ((-3, 0.5, 5), 5.0)):
        assert distance_to(boxes, np.array(point)) == pytest.approx(expected)


def test_coverage_needed_falls_with_distance_and_is_none_where_unseen(renderer):
    scene = small_scene()
    view = camera_view(scene.camera, renderer(scene)._world.ground.heights, (160, 90))
    z = np.array([3.0, 0.0, -6.0, -7.0, -20.0, 30.0])
    boxes = _tiles(np.stack([0 * z, 0 * z, z], 1), np.stack([0 * z + 0.1, 0 * z + 0.1, z + 0.1], 1))
    halved = camera_view(scene.camera, renderer(scene)._world.ground.heights, (160, 90))
    object.__setattr__(halved, "density", 0.5)
    away = distance_to(boxes, view.camera_ws)
    share, half = coverage_needed(boxes, [view, halved], away, full_density_m=5.0, reach_m=15.0)
    assert share[1] == 1.0
    assert 0.2 < share[3] < share[2] < 1.0
    assert (share[4:] == 0).all()
    assert np.allclose(half, 0.5 * share)


@pytest.mark.slow
@pytest.mark.parametrize("ground", ["flat", "hills"])
@pytest.mark.parametrize("camera", _CAMERAS)
def test_the_picture_is_that_of_all_blades(renderer, monkeypatch, camera, ground):
    """Brute force: every tile handed over in full. Tall grass, a storm and heads reach out of their tiles."""
    grass = [{**GRASS, "height_m": [0.4, 1.2], "tilt_deg": [0.0, 80.0], "head": "daisy", "head_size_m": [0.05, 0.1]}]
    scene = small_scene(
        camera=_CAMERAS[camera],
        grass=grass,
        ground=NOISE if ground == "hills" else {"kind": "flat"},
        wind=[{**BREEZE, "speed_mps": 25.0}],
        sowing={"clumping": 1.0, "clump_m": 1.5, "drift": 1.0},
    )
    aovs = ("class", "depth", "blade_id")
    culled = renderer(scene, size=(120, 68)).render(1.0, aovs=aovs)
    monkeypatch.setattr(tiles_module, "in_view", lambda tiles, views: np.ones((len(views), len(tiles.low)), bool))
    monkeypatch.setattr(
        "greensward.culling.visible.coverage_needed", lambda tiles, views, *_: np.ones((len(views), len(tiles.low)))
    )
    every = renderer(scene, size=(120, 68)).render(1.0, aovs=aovs)
    assert (culled.truth["class"] == SurfaceClass.GRASS).sum() > 100
    for name in ("class", "depth", "blade_id"):
        assert np.array_equal(culled.truth[name], every.truth[name]), name
    assert np.array_equal(culled.image, every.image)


@pytest.mark.slow
@pytest.mark.parametrize("camera", ["ahead", "telescope", "sideways telescope"])
def test_a_wider_picture_shows_the_same_in_its_middle(renderer, camera):
    """Blades at the border are not dropped by the tests on the GPU either."""
    scene = small_scene(
        camera=_CAMERAS[camera],
        grass=[{**GRASS, "width_m": [0.05, 0.08], "height_m": [0.3, 1.0]}],
        sowing={"density_per_m2": 25.0},
    )
    narrow, wide = (
        renderer(scene, size=(width, 180)).render(aovs=("blade_id",)).truth["blade_id"] for width in (120, 320)
    )
    assert (narrow > 0).sum() > 5000
    assert (narrow != wide[:, 100:220]).mean() < 0.0002


def _rows(table: ChunkTable) -> np.ndarray:
    if not table.count:
        return np.zeros((0, 2), np.uint32)
    return np.frombuffer(table.buffer.read(table.count * 8), np.uint32).reshape(-1, 2)


def _items(rows: np.ndarray) -> list[int]:
    return [first + i for first, count in rows.tolist() for i in range(count)]


_RUNS = [
    ([], []),
    ([0], [0]),
    ([5], [1]),
    ([0, 100, 200], [0, 0, 0]),
    ([0, 32, 64], [32, 31, 33]),
    ([10, 1000, 500, 70], [90, 3, 0, 64]),
]


@pytest.mark.parametrize("size", [1, 7, 32])
@pytest.mark.parametrize(("start", "length"), _RUNS)
def test_chunks_cover_the_runs_exactly(device, size, start, length):
    table = ChunkTable(device)
    span = table.add(np.array(start, np.int64), np.array(length, np.int64), size)
    table.cut()
    rows = _rows(table)
    assert (span.first, span.count, span.items) == (0, len(rows), sum(length))
    assert ((rows[:, 1] >= 1) & (rows[:, 1] <= size)).all()
    assert _items(rows) == [s + i for s, n in zip(start, length, strict=True) for i in range(n)]
    table.release()


def test_each_span_finds_its_own_chunks(device):
    table = ChunkTable(device)
    for _ in range(2):  # and again after it was cleared
        spans = [table.add(*(np.array(part, np.int64) for part in runs), size) for runs in _RUNS for size in (32, 1)]
        table.cut()
        rows = _rows(table)
        for span, ((start, length), _) in zip(
            spans, [(runs, size) for runs in _RUNS for size in (32, 1)], strict=True
        ):
            mine = rows[span.first : span.first + span.count]
            assert _items(mine) == [s + i for s, n in zip(start, length, strict=True) for i in range(n)]
        assert sum(span.count for span in spans) == table.count == len(rows)
        table.clear()
    table.release()


def test_chunks_of_many_runs(device):
    random = np.random.default_rng(4)
    length = random.integers(0, 200, 3000)
    start = np.cumsum(length) - length
    table = ChunkTable(device)
    table.add(start, length)
    table.cut()
    assert _items(_rows(table)) == list(range(int(length.sum())))
    table.release()
