"""Objects that press blades down, as spheres and capsules listed by cells of a grid on the GPU."""

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.blocks import BlockBuffer, declare
from greensward.gpu.program import build_compute
from greensward.objects import mesh_of, packed
from greensward.scene import Capsule, Sphere
from greensward.scene.objects import Object

COLLIDERS_BLOCK = declare(
    "Colliders",
    8,
    ("low", "vec2"),
    ("cells_per_m", "vec2"),
    ("tallest_m", "float"),
    ("count", "int"),
    ("instants", "int"),
)
_CELLS, _WORDS = 64, 32
MOST_INSTANTS = 16
BALLS, CELLS = 4, 5
"""Shader-storage bindings while blades are simulated."""
Floats = npt.NDArray[np.float64]


class _Resolve(Protocol):
    def __call__(self, file: str) -> Path: ...


def balls_of(thing: Object, resolve: _Resolve) -> Floats:
    """An object as balls in its own space: (n, 7) one end, the other end, radius, all in metres."""
    if isinstance(thing, Capsule):
        reach = min(thing.radius_m, 0.5 * thing.length_m)
        return np.array([[0.0, reach, 0.0, 0.0, thing.length_m - reach, 0.0, reach]])
    if isinstance(thing, Sphere) and len(set(thing.size_m)) == 1:
        radius = 0.5 * thing.size_m[0]
        return np.array([[0.0, radius, 0.0, 0.0, radius, 0.0, radius]])
    spheres = packed(mesh_of(thing, resolve))
    return np.concatenate([spheres[:, :3], spheres], axis=1)


class Colliders:
    """All balls of the scene's objects, where the objects are."""

    def __init__(
        self, ctx: moderngl.Context, things: Sequence[Object], moving: Sequence[bool], resolve: _Resolve
    ) -> None:
        self._ctx = ctx
        found = [(i, balls_of(thing, resolve)) for i, thing in enumerate(things) if thing.collides]
        self._balls = np.concatenate([balls for _, balls in found]) if found else np.zeros((0, 7))
        self._owner = np.repeat([i for i, _ in found], [len(balls) for _, balls in found]).astype(np.int64)
        self.count = len(self._balls)
        self.moving = any(moving[i] for i, _ in found)
        self._placed: Floats | None = None
        self._block = BlockBuffer(ctx, COLLIDERS_BLOCK)
        self._buffer = ctx.buffer(reserve=max(self.count, 1) * MOST_INSTANTS * 32)
        self._cells = ctx.buffer(reserve=_CELLS * _CELLS * _WORDS * 4 if self.count else 4)
        self._shader = build_compute(ctx, "motion/colliders.comp")

    def place(self, placed: Floats, tallest_m: float) -> None:
        """Take up the objects' places at up to `MOST_INSTANTS` instants, matrices (instants, objects, 4, 4).

        Lists what reaches into each cell at any of them.
        """
        if not self.count or (self._placed is not None and np.array_equal(placed, self._placed)):
            return
        self._placed = placed
        owned = placed[:, self._owner]
        turn, shift = owned[..., :3, :3], owned[..., :3, 3]
        rows = np.zeros((len(placed), self.count, 2, 4), np.float32)
        for end in (0, 1):
            rows[:, :, end, :3] = np.einsum("snij,nj->sni", turn, self._balls[:, 3 * end : 3 * end + 3]) + shift
        rows[:, :, 0, 3] = self._balls[:, 6]
        places, reach = rows[..., [0, 2]].reshape(-1, 2), float(self._balls[:, 6].max()) + tallest_m
        low, high = places.min(axis=0) - reach, places.max(axis=0) + reach
        self._block.set(
            low=low,
            cells_per_m=_CELLS / np.maximum(high - low, 1e-3),
            tallest_m=tallest_m,
            count=self.count,
            instants=len(placed),
        )
        self._buffer.write(rows)
        self.bind()
        self._shader.run(_CELLS * _CELLS // 64)
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def bind(self) -> None:
        """Bind block, balls and cells."""
        self._block.bind()
        self._buffer.bind_to_storage_buffer(BALLS)
        self._cells.bind_to_storage_buffer(CELLS)

    def release(self) -> None:
        """Free the GPU resources."""
        for part in (self._block, self._buffer, self._cells, self._shader):
            part.release()
