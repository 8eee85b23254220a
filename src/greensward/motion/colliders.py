"""Objects that press blades down, as spheres and capsules listed by cells of a grid on the GPU."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.blocks import BlockBuffer, declare
from greensward.gpu.buffers import rewrite
from greensward.gpu.program import build_compute
from greensward.ground import HeightField
from greensward.objects import mesh_of, packed
from greensward.objects.placing import Placing, Script
from greensward.scene import Capsule, Sphere
from greensward.scene.objects import Object

COLLIDERS_BLOCK = declare(
    "Colliders",
    8,
    ("low", "vec2"),
    ("cells_per_m", "vec2"),
    ("count", "int"),
    ("instants", "int"),
)
_SIDE, _WORDS = 32, 32
GRID = {"SIDE": _SIDE, "WORDS": _WORDS}
"""What to define for shaders of `motion/colliders.glsl`: cells a side, and words a cell."""
MOST_INSTANTS = 16
BALLS, CELLS = 4, 5
"""Shader-storage bindings while blades are simulated."""
Floats = npt.NDArray[np.float64]


class _Resolve(Protocol):
    def __call__(self, file: str) -> Path: ...


def balls_of(thing: Object, resolve: _Resolve) -> Floats:
    """An object as balls in its own space: (n, 7) one end, the other end, radius, all in metres."""
    if isinstance(thing, Capsule):
        reach = thing.radius_m
        return np.array([[0.0, reach, 0.0, 0.0, thing.length_m - reach, 0.0, reach]])
    if isinstance(thing, Sphere) and len(set(thing.size_m)) == 1:
        radius = 0.5 * thing.size_m[0]
        return np.array([[0.0, radius, 0.0, 0.0, radius, 0.0, radius]])
    spheres = packed(mesh_of(thing, resolve))
    return np.concatenate([spheres[:, :3], spheres], axis=1)


class Colliders:
    """All balls of the scene's objects, where the objects are."""

    def __init__(
        self,
        ctx: moderngl.Context,
        things: Sequence[Object],
        heights: HeightField,
        scripts: Mapping[str, Script],
        resolve: _Resolve,
    ) -> None:
        self._ctx = ctx
        hard = [thing for thing in things if thing.collides]
        self._placing = Placing(
            hard, heights, {thing.name: scripts[thing.name] for thing in hard if thing.name in scripts}
        )
        found = [balls_of(thing, resolve) for thing in hard]
        self._balls = np.concatenate(found) if found else np.zeros((0, 7))
        self._owner = np.repeat(np.arange(len(found)), [len(balls) for balls in found])
        self.count = len(self._balls)
        self.moving = any(self._placing.moving)
        self._placed: Floats | None = None
        self._block = BlockBuffer(ctx, COLLIDERS_BLOCK)
        self._buffer = ctx.buffer(reserve=max(self.count, 1) * MOST_INSTANTS * 32)
        self._reaches = ctx.buffer(reserve=max(self.count, 1) * 16)
        self._cells = ctx.buffer(reserve=_SIDE * _SIDE * _WORDS * 4 if self.count else 4)
        self._shader = build_compute(ctx, "motion/colliders.comp", GRID)

    def place(self, times_s: Sequence[float], tallest_m: float) -> None:
        """Take up the objects' places at up to `MOST_INSTANTS` instants; `tallest_m` is of the grass.

        Lists what reaches into each cell at any of them.
        """
        if not self.count or (self._placed is not None and not self.moving):
            return
        placed = np.stack([self._placing.at(time_s) for time_s in (times_s if self.moving else times_s[-1:])])
        self._placed = placed
        owned = placed[:, self._owner]
        turn, shift = owned[..., :3, :3], owned[..., :3, 3]
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
        rewrite(self._buffer, rows)
        rewrite(self._reaches, reaches.astype(np.float32))
        self._block.bind()
        self._reaches.bind_to_storage_buffer(BALLS)
        self._cells.bind_to_storage_buffer(CELLS)
        self._shader.run(-(-_SIDE * _SIDE // 64))
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def bind(self) -> None:
        """Bind block, balls and cells."""
        self._block.bind()
        self._buffer.bind_to_storage_buffer(BALLS)
        self._cells.bind_to_storage_buffer(CELLS)

    def release(self) -> None:
        """Free the GPU resources."""
        for part in (self._block, self._buffer, self._reaches, self._cells, self._shader):
            part.release()
