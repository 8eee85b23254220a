"""Blades that share one storage block of the driver, and the tiles they lie in."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import filled

BLADE_BYTES, POSTURE_BYTES = 64, 24
Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Tiles:
    """Blades that lie near each other, one row each: bounds in metres, where they begin, how many by rank."""

    low: Floats  # (n, 3)
    high: Floats  # (n, 3)
    kept: Floats  # (n,) part of the blades that was sown
    start: Indices  # (n,) first blade within the page
    up_to: Indices  # (n, 8) blades whose rank is in the first 1/8, 2/8, … of `kept`
    head_start: Indices
    heads: Indices

    @cached_property
    def centre(self) -> Floats:
        """Middle of each box, (n, 3)."""
        return 0.5 * (self.low + self.high)

    @cached_property
    def half(self) -> Floats:
        """Half the extent of each box, (n, 3)."""
        return 0.5 * (self.high - self.low)

    def placed(self, matrix: Floats) -> "Tiles":
        """The same with its boxes moved by a rigid matrix (4, 4), and as large as the turned ones need."""
        centre = self.centre @ matrix[:3, :3].T + matrix[:3, 3]
        half = self.half @ np.abs(matrix[:3, :3]).T
        return replace(self, low=centre - half, high=centre + half)


class Page:
    """Blades that fit into one storage block of the driver, with their tiles.

    Blades that are carried or that grow are kept as they were sown beside how they are now.
    """

    def __init__(
        self, ctx: moderngl.Context, tiles: Tiles, first_id: int, thing: int | None = None, carried: bool = False
    ) -> None:
        self.tiles = self.tiles_as_sown = tiles
        self.first_id = first_id
        self.thing = thing
        """Index of the scene's object that the blades grow on; None on the ground."""
        self.previous_from_now: Floats = np.eye(4)
        """Matrix (4, 4): from where a point of the object is to where it was when it was carried before."""
        self.count = int(tiles.up_to[:, 7].sum())
        self.head_count = int(tiles.heads.sum())
        self.blades = ctx.buffer(reserve=self.count * BLADE_BYTES)
        self.postures = filled(ctx, self.count * POSTURE_BYTES)
        self.heads = ctx.buffer(reserve=max(self.head_count, 1) * 4)
        self.sown = ctx.buffer(reserve=self.count * BLADE_BYTES) if carried else None

    def bind(self) -> None:
        """Bind blades and postures as culling/blades.glsl looks them up."""
        self.blades.bind_to_storage_buffer(0)
        self.postures.bind_to_storage_buffer(1)

    @property
    def nbytes(self) -> int:
        """GPU memory in bytes."""
        return sum(buffer.size for buffer in self._buffers())

    def _buffers(self) -> list[moderngl.Buffer]:
        return [each for each in (self.blades, self.postures, self.heads, self.sown) if each is not None]

    def release(self) -> None:
        """Free the GPU memory."""
        for buffer in self._buffers():
            buffer.release()


class UnstoredPage:
    """Blades of the ground that shaders grow from the seed whenever they look at them: tiles of candidates.

    A candidate's index is its number in its tile, after those of the tiles before, each in whole words of 32.
    """

    thing = None
    previous_from_now: Floats = np.eye(4)

    def __init__(self, ctx: moderngl.Context, tiles: Tiles, lying: npt.NDArray[np.int32], first_id: int) -> None:
        """`lying` are x, z and level of each tile, (n, 3)."""
        self.tiles = tiles
        self.first_id = first_id
        words = -(-tiles.up_to[:, 7] // 32)
        self.count = 32 * int(words.sum())
        self._tiles = ctx.buffer(np.column_stack([lying, tiles.start]).astype(np.int32))
        self._tile_of = ctx.buffer(np.repeat(np.arange(len(words), dtype=np.uint32), words))

    def bind(self) -> None:
        """Bind what culling/blades.glsl looks up where blades are not stored."""
        self._tiles.bind_to_storage_buffer(0)
        self._tile_of.bind_to_storage_buffer(1)

    @property
    def nbytes(self) -> int:
        """GPU memory in bytes."""
        return self._tiles.size + self._tile_of.size

    def release(self) -> None:
        """Free the GPU memory."""
        self._tiles.release()
        self._tile_of.release()


def starts(counts: npt.NDArray[Any]) -> Indices:
    """Where each run begins when runs of these lengths follow each other."""
    result: Indices = np.cumsum(counts, dtype=np.int64) - counts
    return result


def page_numbers(counts: Indices, limit: int) -> Indices:
    """Number the page of each tile, in order, so that no page holds more than `limit` blades."""
    pages = np.zeros(len(counts), np.int64)
    ends = np.cumsum(counts)
    first, page = 0, 0
    while first < len(counts):
        before = ends[first - 1] if first else 0
        last = max(int(np.searchsorted(ends, before + limit, side="right")), first + 1)
        pages[first:last] = page
        first, page = last, page + 1
    return pages
