"""Objects that press blades down, as spheres and capsules listed by cells of a grid on the GPU."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import release_all, upload
from greensward.gpu.device import STORAGE_WRITTEN, Device
from greensward.gpu.kernels import Bindings, Kernel
from greensward.gpu.layouts import WORD, BlockBuffer, block, struct
from greensward.ground import HeightField
from greensward.objects.meshes import Shape, mesh_of, unit_shape
from greensward.objects.packing import packed
from greensward.objects.placing import Placing, Script
from greensward.scene import Box, Capsule, Cylinder, Sphere
from greensward.scene.objects import Object

COLLIDERS_BLOCK = block(
    "Colliders",
    ("low", "vec2"),
    ("cells_per_m", "vec2"),
    ("side", "int"),  # cells of the grid
    ("objects", "int"),
    ("instants", "int"),
    ("margin_m", "float"),  # height of the tallest grass, as far as a ball's reach exceeds its radius
)
# a sphere or capsule: one end and the radius, the other end
_BALL = struct("Ball", ("end", "vec4"), ("other_end", "vec4"))
# rows of the matrix of an object: world, from the anchor, from own space
_PLACE = struct("Place", ("x", "vec4"), ("y", "vec4"), ("z", "vec4"))
# balls of an object, and where what they reach is: low x and z, high x and z
_SOLID = struct("Solid", ("first", "uint"), ("count", "uint"), ("reach", "uint"))
_REACH = struct("Reach", ("low", "vec2"), ("high", "vec2"))
# first of the objects near a cell, and first entry of the room for the balls of all of them
_HEAD = struct("CellHead", ("first", "uint"), ("entry", "uint"))
# an object and one of its balls
_ENTRY = struct("CellEntry", ("object", "uint"), ("ball", "uint"))
_SIDE = 128
"""Cells of the grid along x and z, at most."""
_MOST_ENTRIES = 1 << 22
"""Balls in all cells for which there is room; where there are more, cells are larger."""
MOST_INSTANTS = 16
_MOST_PACKED = 64
_ALIKE = 0.2
"""Shapes that are packed one by one, at some 0.05 s each; of more, step of proportions that share a packing."""
_MOST_ROUNDS = 60_000
"""Rounds of loops in an invocation: llvmpipe ends all loops after 65,535 together."""
_SLACK_M = 0.01
"""Distance by which rounding may move a blade or a ball, with room."""
Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


class _Resolve(Protocol):
    def __call__(self, file: str) -> Path: ...


def balls_of(solid: Object, resolve: _Resolve) -> Floats:
    """Pack an object with balls in its own space: (n, 7) one end, the other end, radius, all in metres."""
    if isinstance(solid, Capsule):
        reach = solid.radius_m
        return np.array([[0.0, reach, 0.0, 0.0, solid.length_m - reach, 0.0, reach]])
    if isinstance(solid, Sphere) and len(set(solid.size_m)) == 1:
        radius = 0.5 * solid.size_m[0]
        return np.array([[0.0, radius, 0.0, 0.0, radius, 0.0, radius]])
    spheres = packed(mesh_of(solid, resolve))
    return np.concatenate([spheres[:, :3], spheres], axis=1)


class Colliders:
    """Balls of the scene's objects, once for all of the same shape, and where the objects are."""

    def __init__(
        self,
        device: Device,
        objects: Sequence[Object],
        heights: HeightField,
        scripts: Mapping[str, Script],
        resolve: _Resolve,
    ) -> None:
        self._device, ctx = device, device.ctx
        hard = [each for each in objects if each.collides]
        self._placing = Placing(
            hard, heights, {each.name: scripts[each.name] for each in hard if each.name in scripts}
        )
        balls, self._solids = _shared_balls(hard, resolve)
        self._middle, self._radius = _bounds(balls, self._solids)
        self.count = int(self._solids["count"].sum())
        self.moving = any(self._placing.moving)
        self.most_steps = _MOST_ROUNDS
        """Steps that one dispatch may take through the longest list of a cell."""
        self._placed_for: tuple[Floats, ...] = ()
        self._block = BlockBuffer(ctx, COLLIDERS_BLOCK)
        rows = np.zeros(max(len(balls), 1), _BALL.dtype)
        rows["end"][: len(balls)], rows["other_end"][: len(balls), :3] = balls[:, [0, 1, 2, 6]], balls[:, 3:6]
        places = max(len(hard), 1) * (MOST_INSTANTS if self.moving else 1)
        self._buffers = {
            "Balls": ctx.buffer(rows.tobytes()),
            "Places": ctx.buffer(reserve=places * _PLACE.dtype.itemsize),
            "Cells": ctx.buffer(reserve=_ENTRY.dtype.itemsize),
        }
        self._lists = {
            "Solids": ctx.buffer(self._solids.tobytes() or bytes(_SOLID.dtype.itemsize)),
            "Reaches": ctx.buffer(reserve=max(self.count, 1) * _REACH.dtype.itemsize),
            "Heads": ctx.buffer(reserve=(_SIDE * _SIDE + 1) * _HEAD.dtype.itemsize),
            "Near": ctx.buffer(reserve=WORD),
        }
        self.bindings: Bindings = {"Colliders": self._block, **self._buffers}
        """Block, balls, places of objects and cells, by their names in shaders."""
        self._reach, self._list = (
            Kernel(device, "motion/colliders.comp", defines, {**self.bindings, **self._lists})
            for defines in ({"REACH": 1}, {})
        )

    def place(
        self, times_s: Sequence[float], tallest_m: float, anchor_ws: Floats, within: tuple[Floats, Floats]
    ) -> None:
        """Take up the objects' places at up to `MOST_INSTANTS` instants; `tallest_m` is of the grass.

        Lists what reaches into each cell at any of them, of a grid over the objects that reach between two corners
        `within`, (3,), which hold all blades that are simulated. Shaders count from the anchor, (3,).
        """
        here = anchor_ws, *within
        if not self.count or (
            self._placed_for and not self.moving and all(map(np.array_equal, here, self._placed_for))
        ):
            return
        self._placed_for = here
        placed = np.stack([self._placing.at(time_s) for time_s in (times_s if self.moving else times_s[-1:])])
        placed[..., :3, 3] -= anchor_ws
        margin_m = tallest_m + _SLACK_M
        centre = np.einsum("snij,nj->sni", placed[..., :3, :], self._middle)
        reach = (self._radius + margin_m)[:, None]
        grid = _listed(
            centre.min(axis=0) - reach,
            centre.max(axis=0) + reach,
            self._solids["count"].astype(np.int64),
            *(corner - anchor_ws for corner in within),
        )
        self._block.set(
            low=grid.low,
            cells_per_m=grid.cells_per_m,
            side=grid.side,
            objects=len(self._solids),
            instants=len(placed),
            margin_m=margin_m,
        )
        upload(self._device, self._buffers["Places"], placed[..., :3, :].astype(np.float32))
        upload(self._device, self._lists["Heads"], grid.heads)
        for buffer, nbytes in (
            (self._lists["Near"], grid.near.nbytes),
            (self._buffers["Cells"], (len(grid.heads) + int(grid.heads["entry"][-1])) * _ENTRY.dtype.itemsize),
        ):
            if buffer.size < nbytes:
                # with some room to grow
                buffer.orphan(-(-nbytes * 5 // 4 // _ENTRY.dtype.itemsize) * _ENTRY.dtype.itemsize)
        upload(self._device, self._lists["Near"], grid.near)
        for kernel, count in ((self._reach, len(self._solids)), (self._list, grid.side**2)):
            kernel.run_over(count)
            self._device.ctx.memory_barrier(STORAGE_WRITTEN)
        # blades are pressed twice in a step
        self.most_steps = max(_MOST_ROUNDS // (2 * max(int(np.diff(grid.heads["entry"]).max()), 1)), 1)

    def release(self) -> None:
        """Free the GPU resources."""
        release_all(self._block, *self._buffers.values(), *self._lists.values(), self._reach, self._list)


def _shared_balls(hard: Sequence[Object], resolve: _Resolve) -> tuple[Floats, npt.NDArray[np.void]]:
    """Balls of all shapes, (n, 7), and which of them each object has: those of its shape and size."""
    packings = _packings({unit_shape(each)[0] for each in hard}, resolve)
    solids = np.zeros(len(hard), _SOLID.dtype)
    first: dict[tuple[Shape, float], tuple[int, int]] = {}
    parts, count = [np.zeros((0, 7))], 0
    for row, each in zip(solids, hard, strict=True):
        key = shape, size = unit_shape(each)
        if key not in first:
            parts.append(packings[shape] * size)
            first[key] = count, len(parts[-1])
            count += len(parts[-1])
        row["first"], row["count"] = first[key]
    solids["reach"] = np.cumsum(solids["count"]) - solids["count"]
    return np.concatenate(parts), solids


def _packings(shapes: Collection[Shape], resolve: _Resolve) -> dict[Shape, Floats]:
    """Balls of each shape; where shapes are many, those that are almost alike share a packing, stretched to each."""
    parts = _ALIKE if len(shapes) > _MOST_PACKED else 0.0
    made: dict[Shape, Floats] = {}
    packings: dict[Shape, Floats] = {}
    for shape in shapes:
        alike, stretch = shape, np.ones(3)
        if parts and isinstance(shape, Box | Sphere | Cylinder):
            size = np.array(shape.size_m)
            rounded = np.exp(parts * np.round(np.log(size) / parts))
            alike, stretch = (
                type(shape).model_construct(**dict(shape) | {"size_m": tuple(rounded.tolist())}),
                size / rounded,
            )
        if alike not in made:
            made[alike] = balls_of(alike, resolve)
        packings[shape] = made[alike] * [*stretch, *stretch, np.cbrt(stretch.prod())]
    return packings


def _bounds(balls: Floats, solids: npt.NDArray[np.void]) -> tuple[Floats, Floats]:
    """A sphere around the balls of each object in its own space: middle and a 1, (n, 4), and radius, (n,)."""
    first, of = np.unique(solids[["first", "count"]], return_inverse=True)
    middle, radius = np.ones((len(first), 4)), np.zeros(len(first))
    for i, (start, count) in enumerate(first.tolist()):
        ends, around = balls[start : start + count, :6].reshape(-1, 2, 3), balls[start : start + count, 6, None]
        if count:
            middle[i, :3] = 0.5 * ((ends.min(axis=1) - around).min(axis=0) + (ends.max(axis=1) + around).max(axis=0))
            radius[i] = (np.linalg.norm(ends - middle[i, :3], axis=2) + around).max()
    return middle[of], radius[of]


@dataclass(frozen=True)
class _Grid:
    low: Floats
    cells_per_m: Floats
    side: int
    heads: npt.NDArray[np.void]
    near: npt.NDArray[np.uint32]


def _listed(low: Floats, high: Floats, balls: Indices, first: Floats, last: Floats) -> _Grid:
    """Grid between two corners, no larger than the objects' bounds (n, 3), and the objects near each of its cells.

    An object has so many `balls`. The grid has fewer cells where objects are many and large.
    """
    here = np.flatnonzero(((high >= first) & (low <= last)).all(axis=1) & (balls > 0))
    low, high, balls = low[here][:, [0, 2]], high[here][:, [0, 2]], balls[here]
    first, last = first[[0, 2]], last[[0, 2]]
    corner = np.maximum(low.min(axis=0, initial=np.inf), first) if len(here) else first
    edge_m = np.maximum(np.minimum(high.max(axis=0), last) - corner, 1e-3) if len(here) else np.ones(2)
    side = _SIDE
    while True:
        cells = [np.clip((at - corner) * (side / edge_m), 0, side - 1).astype(np.int64) for at in (low, high)]
        columns, rows = (cells[1] - cells[0] + 1).T
        if side == 1 or int((columns * rows * balls).sum()) <= _MOST_ENTRIES:
            break
        side //= 2
    each = np.repeat(np.arange(len(here)), columns * rows)
    number = np.arange(len(each)) - np.repeat(np.cumsum(columns * rows) - columns * rows, columns * rows)
    cell = (cells[0][each, 1] + number // columns[each]) * side + cells[0][each, 0] + number % columns[each]
    order = np.argsort(cell, kind="stable")
    heads = np.zeros(side * side + 1, _HEAD.dtype)
    heads["first"][1:] = np.cumsum(np.bincount(cell, minlength=side * side))
    heads["entry"][1:] = np.cumsum(np.bincount(cell, balls[each], minlength=side * side))
    return _Grid(corner, side / edge_m, side, heads, here[each[order]].astype(np.uint32))
