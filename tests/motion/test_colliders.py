"""Lists of colliders: equal shapes are made once, and a cell lists what reaches into it, and nothing else."""

from pathlib import Path

import numpy as np
import pytest

from greensward.gpu.buffers import read_back
from greensward.motion import colliders
from greensward.objects import packing
from greensward.scene import Box
from small_scenes import small_scene


def _renderer(renderer, objects, **tables):
    tables = {"sowing": {"density_per_m2": 5.0, "reach_m": 9.0}, "simulation": {"settle_s": 0.0}, **tables}
    drawn = renderer(small_scene(object=objects, shadows={"enabled": False}, **tables), size=(16, 16))
    drawn.render(0.0)
    return drawn


def _box(x, y=0.0, z=0.0, **keys):
    return {"kind": "box", "position_m": [x, y, z], "size_m": [0.5, 0.5, 0.5], **keys}


def _cells(drawn):
    """For every cell that lists any its corners, and the objects and balls that it lists."""
    device, listed = drawn._world.device, drawn._world._colliders
    device.ctx.finish()
    block = np.frombuffer(listed._block.uploaded().read(), colliders.COLLIDERS_BLOCK.dtype)[0]
    words = np.frombuffer(read_back(device, listed._buffers["Cells"]), np.uint32).reshape(-1, 2)
    side = int(block["side"])
    for cell in np.flatnonzero(words[: side * side, 1]):
        low = block["low"] + np.array([cell % side, cell // side]) / block["cells_per_m"]
        first, count = words[cell].tolist()
        yield (low, low + 1.0 / block["cells_per_m"]), words[first : first + count]


def test_equal_shapes_are_packed_once_whatever_their_size_and_look(renderer, monkeypatch):
    made = []
    monkeypatch.setattr(colliders, "packed", lambda mesh: made.append(mesh) or np.array([[0.0, 0.5, 0.0, 0.5]]))
    sizes = [[0.5, 0.5, 0.5], [1.0, 1.0, 1.0], [0.25, 0.5, 0.25]]
    boxes = [_box(0.3 * k - 6.0, size_m=sizes[k % 3], yaw_deg=3.0 * k, colour="#112233") for k in range(60)]
    listed = _renderer(renderer, boxes)._world._colliders
    assert len(made) == 2  # cubes and a column
    assert listed.count == 60
    assert len(np.unique(listed._solids["first"])) == 3
    assert listed._buffers["Balls"].size == 3 * 32


def test_many_shapes_that_are_almost_alike_share_packings(monkeypatch):
    packed = []
    monkeypatch.setattr(colliders, "packed", lambda mesh: packed.append(mesh) or real(mesh))
    real, random = packing.packed, np.random.default_rng(3)
    boxes = [Box(position_m=(0.0, 0.0, 0.0), size_m=size) for size in random.uniform(0.7, 1.4, (70, 3)).tolist()]
    balls, solids = colliders._shared_balls(boxes, Path)
    assert len(packed) < 45
    for box, solid in zip(boxes, solids, strict=True):
        mine = balls[solid["first"] : solid["first"] + solid["count"]]
        low, high = (mine[:, :3] - mine[:, 6:]).min(axis=0), (mine[:, :3] + mine[:, 6:]).max(axis=0)
        x, y, z = box.size_m
        np.testing.assert_allclose([low, high], [(-x / 2, 0.0, -z / 2), (x / 2, y, z / 2)], atol=0.06)


def test_a_cell_lists_what_reaches_into_it_and_nothing_else(renderer):
    turned = {"yaw_deg": 20.0, "pitch_deg": 15.0}
    solids = [_box(1.5 * (k % 8) - 6.0, 0.0, -1.5 * (k // 8), **turned) for k in range(32)]
    solids[3] = {"kind": "capsule", "position_m": [-1.5, 0.0, 0.0], "length_m": 1.5, "roll_deg": 80.0}
    drawn = _renderer(renderer, solids)
    world = drawn._world
    listed, margin_m = world._colliders, world.field.tallest_m + 0.011
    balls = np.frombuffer(read_back(world.device, listed._buffers["Balls"]), np.float32).reshape(-1, 2, 4)
    placed = world.placed[:, :3]
    # of each ball of each object: its ends from above, (objects, balls, 2, 2)
    ends = (np.einsum("nij,bej->nbei", placed[:, :, :3], balls[..., :3]) + placed[:, None, None, :, 3])[..., [0, 2]]
    first, last, reach = ends.min(axis=2), ends.max(axis=2), balls[:, 0, 3, None]
    cells = np.zeros(ends.shape[:2], np.int64)
    for (low, high), entries in _cells(drawn):
        assert len(entries) < 0.2 * listed.count
        at = tuple(entries.T)
        wide = reach[at[1]] + margin_m
        assert (first[at] - wide < high + 1e-3).all()
        assert (last[at] + wide > low - 1e-3).all()
        np.add.at(cells, at, 1)
        cell_m = high - low
    assert (cells > 0).sum() == listed.count  # all are in reach
    # a ball is in as many cells as its square covers
    covered = last - first + 2.0 * (reach + margin_m - 0.002)
    assert (cells >= np.prod(np.floor(covered / cell_m) - 1, axis=-1))[cells > 0].all()


@pytest.mark.parametrize("place", [(0.0, 50.0, 0.0), (0.0, -50.0, 0.0), (80.0, 0.0, 0.0)])
def test_what_is_far_from_all_grass_is_in_no_list(renderer, place):
    drawn = _renderer(renderer, [_box(*place), _box(0.0)])
    assert {thing for _, entries in _cells(drawn) for thing in entries[:, 0].tolist()} == {1}


def test_lists_stay_small_where_all_objects_reach_everywhere(renderer, monkeypatch):
    monkeypatch.setattr(colliders, "_MOST_ENTRIES", 5000)
    drawn = _renderer(renderer, [_box(0.0, -0.1, 0.0, size_m=[40.0, 0.5, 40.0], clears=False) for _ in range(20)])
    listed = drawn._world._colliders
    assert listed._buffers["Cells"].size <= 8 * 1.25 * (5000 + 128 * 128 + 1)
    assert {thing for _, entries in _cells(drawn) for thing in entries[:, 0].tolist()} == set(range(20))
