"""Blades that share one storage block of the driver, and the tiles they lie in."""

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import release_all, zeros
from greensward.gpu.device import Device
from greensward.gpu.kernels import Resource
from greensward.gpu.layouts import WORD, struct
from greensward.sowing.blade import BLADE, POSE

ID_BYTES = 2 * WORD
_UNSTORED_TILE = struct("UnstoredTile", ("x", "int"), ("z", "int"), ("level", "int"), ("first_candidate", "uint"))
Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Tiles:
    """Blades that lie near each other, one row each: bounds in metres, where they begin, how many by rank."""

    low: Floats  # (n, 3)
    high: Floats  # (n, 3)
    coverage: Floats  # (n,) part of the blades that was sown, by level of detail
    start: Indices  # (n,) first blade within the page
    up_to: Indices  # (n, 8) blades whose rank is in the first 1/8, 2/8, … of `coverage`
    head_start: Indices
    heads: Indices
    serial: Indices
    """Number that no other tile of the field has or had, (n,)."""

    def where(self, which: npt.NDArray[np.bool_] | Indices) -> "Tiles":
        """Take some of the rows."""
        return Tiles(*(getattr(self, each.name)[which] for each in fields(self)))

    def followed_by(self, other: "Tiles") -> "Tiles":
        """Take the rows of both."""
        names = [each.name for each in fields(self)]
        return Tiles(*(np.concatenate([getattr(self, name), getattr(other, name)]) for name in names))

    def rows(self) -> Indices:
        """Index within the page of every blade, tile by tile."""
        lengths = self.up_to[:, 7]
        return np.repeat(self.start - starts(lengths), lengths) + np.arange(int(lengths.sum()))

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

    Blades that move with an object or grow are stored as they were sown beside how they are now.
    """

    def __init__(
        self,
        device: Device,
        capacity: int,
        head_capacity: int,
        first_number: int,
        object_index: int | None = None,
        transformed: bool = False,
    ) -> None:
        self.count = self.head_count = 0
        self.capacity = capacity
        """Number of blades that it has room for, each with an id from `first_number` on."""
        self.first_number = first_number
        self.object_index = object_index
        """Index of the scene's object that the blades grow on; None on the ground."""
        self.previous_from_now: Floats = np.eye(4)
        """Matrix (4, 4): from where a point of the object is to where it was a frame ago."""
        blade_bytes = capacity * BLADE.dtype.itemsize
        self.blades = device.ctx.buffer(reserve=blade_bytes)
        self.poses = zeros(device, capacity * POSE.dtype.itemsize)
        self.heads = device.ctx.buffer(reserve=max(head_capacity, 1) * WORD)
        self.sown = device.ctx.buffer(reserve=blade_bytes) if transformed else None
        self.ids = device.ctx.buffer(reserve=capacity * ID_BYTES) if object_index is None else None
        """Permanent ids of the blades of the ground."""
        self.bindings: dict[str, Resource] = {"Blades": self.blades, "Poses": self.poses}
        """Buffers that culling/blades.glsl reads."""

    def hold(self, tiles: Tiles) -> None:
        """Hold these tiles from now on, whose blades are in its buffers."""
        self.tiles = self.tiles_as_sown = tiles
        self.count = int(tiles.up_to[:, 7].sum())
        self.head_count = int(tiles.heads.sum())

    @property
    def nbytes(self) -> int:
        """GPU memory in bytes."""
        return sum(buffer.size for buffer in self._buffers())

    def _buffers(self) -> list[moderngl.Buffer]:
        return [each for each in (self.blades, self.poses, self.heads, self.sown, self.ids) if each is not None]

    def release(self) -> None:
        """Free the GPU memory."""
        release_all(*self._buffers())


class UnstoredPage:
    """Blades of the ground that shaders grow from the seed whenever they look at them: tiles of candidates.

    A candidate's index is its number in its tile, after those of the tiles before, each in whole words of 32.
    """

    object_index = None
    previous_from_now: Floats = np.eye(4)

    def __init__(self, device: Device, tiles: Tiles, lying: npt.NDArray[np.int32], first_number: int) -> None:
        """`lying` are x, z and level of each tile, (n, 3)."""
        self.tiles = tiles
        self.first_number = first_number
        words = -(-tiles.up_to[:, 7] // 32)
        self.count = self.capacity = 32 * int(words.sum())
        rows = np.zeros(len(words), _UNSTORED_TILE.dtype)
        rows["x"], rows["z"], rows["level"], rows["first_candidate"] = *lying.T, tiles.start
        self._tiles = device.ctx.buffer(rows)
        self._tile_of = device.ctx.buffer(np.repeat(np.arange(len(words), dtype=np.uint32), words))
        self.bindings: dict[str, Resource] = {"Tiles": self._tiles, "TileOf": self._tile_of}
        """Buffers that motion/unstored_blades.glsl reads."""

    @property
    def nbytes(self) -> int:
        """GPU memory in bytes."""
        return self._tiles.size + self._tile_of.size

    def release(self) -> None:
        """Free the GPU memory."""
        self._tiles.release()
        self._tile_of.release()


def starts(counts: npt.NDArray[Any]) -> Indices:
    """Start of each run when runs of these lengths follow each other."""
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
