"""Objects that press blades down, as spheres and capsules listed by cells of a grid on the GPU."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import release_all, upload
from greensward.gpu.device import STORAGE_WRITTEN, Device
from greensward.gpu.kernels import Bindings, Kernel
from greensward.gpu.layouts import WORD, BlockBuffer, block, struct
from greensward.ground import HeightField
from greensward.objects.meshes import mesh_of
from greensward.objects.packing import packed
from greensward.objects.placing import Placing, Script
from greensward.scene import Capsule, Sphere
from greensward.scene.objects import Object

COLLIDERS_BLOCK = block(
    "Colliders",
    ("low", "vec2"),
    ("cells_per_m", "vec2"),
    ("count", "int"),
    ("instants", "int"),
)
# a sphere or capsule: one end and the radius, the other end; and what it reaches: low x and z, high x and z
_BALL = struct("Ball", ("end", "vec4"), ("other_end", "vec4"))
_REACH = struct("Reach", ("low", "vec2"), ("high", "vec2"))
_SIDE, _WORDS = 32, 32
GRID = {"SIDE": _SIDE, "WORDS": _WORDS}
"""Defines of shaders of `motion/colliders.glsl`: cells a side, and words a cell."""
MOST_INSTANTS = 16
Floats = npt.NDArray[np.float64]


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
    """Balls of the scene's objects, where the objects are."""

    def __init__(
        self,
        device: Device,
        objects: Sequence[Object],
        heights: HeightField,
        scripts: Mapping[str, Script],
        resolve: _Resolve,
    ) -> None:
        ctx = self._ctx = device.ctx
        hard = [each for each in objects if each.collides]
        self._placing = Placing(
            hard, heights, {each.name: scripts[each.name] for each in hard if each.name in scripts}
        )
        found = [balls_of(each, resolve) for each in hard]
        self._balls = np.concatenate(found) if found else np.zeros((0, 7))
        self._owner = np.repeat(np.arange(len(found)), [len(balls) for balls in found])
        self.count = len(self._balls)
        self.moving = any(self._placing.moving)
        self._anchor_ws: Floats | None = None
        self._block = BlockBuffer(ctx, COLLIDERS_BLOCK)
        self._buffer = ctx.buffer(reserve=max(self.count, 1) * MOST_INSTANTS * _BALL.dtype.itemsize)
        self._reaches = ctx.buffer(reserve=max(self.count, 1) * _REACH.dtype.itemsize)
        self._cells = ctx.buffer(reserve=_SIDE * _SIDE * _WORDS * WORD if self.count else WORD)
        self._kernel = Kernel(device, "motion/colliders.comp", GRID, {"Colliders": self._block})
        self.bindings: Bindings = {"Colliders": self._block, "Balls": self._buffer, "Cells": self._cells}
        """Block, balls and cells, by their names in shaders."""

    def place(self, times_s: Sequence[float], tallest_m: float, anchor_ws: Floats) -> None:
        """Take up the objects' places at up to `MOST_INSTANTS` instants; `tallest_m` is of the grass.

        Lists what reaches into each cell at any of them. Shaders count from the anchor, (3,).
        """
        same = self._anchor_ws is not None and np.array_equal(anchor_ws, self._anchor_ws)
        if not self.count or (same and not self.moving):
            return
        self._anchor_ws = anchor_ws
        placed = np.stack([self._placing.at(time_s) for time_s in (times_s if self.moving else times_s[-1:])])
        owned = placed[:, self._owner]
        turn, shift = owned[..., :3, :3], owned[..., :3, 3] - anchor_ws
        rows = np.zeros((len(placed), self.count, 2, 4), np.float32)
        for end in (0, 1):
            rows[:, :, end, :3] = np.einsum("snij,nj->sni", turn, self._balls[:, 3 * end : 3 * end + 3]) + shift
        rows[:, :, 0, 3] = self._balls[:, 6]
        places = rows[..., [0, 2]].transpose(1, 0, 2, 3).reshape(self.count, -1, 2)
        reach = (self._balls[:, 6] + tallest_m)[:, None]
        reaches = np.concatenate([places.min(axis=1) - reach, places.max(axis=1) + reach], axis=1)
        low, high = reaches[:, :2].min(axis=0), reaches[:, 2:].max(axis=0)
        self._block.set(
            low=low,
            cells_per_m=_SIDE / np.maximum(high - low, 1e-3),
            count=self.count,
            instants=len(placed),
        )
        upload(self._buffer, rows)
        upload(self._reaches, reaches.astype(np.float32))
        self._kernel.run_over(_SIDE * _SIDE, Reaches=self._reaches, Cells=self._cells)
        self._ctx.memory_barrier(STORAGE_WRITTEN)

    def release(self) -> None:
        """Free the GPU resources."""
        release_all(self._block, self._buffer, self._reaches, self._cells, self._kernel)
