"""Runs of blades cut into chunks on the GPU: an instance of a draw, or a workgroup, takes one chunk."""

from dataclasses import dataclass

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import at_least, upload
from greensward.gpu.device import STORAGE_WRITTEN, Device
from greensward.gpu.kernels import Kernel, grid
from greensward.gpu.layouts import struct

CHUNK = 32
_CHUNK = struct("Chunk", ("first", "uint"), ("count", "uint"))
_RUN = struct("Run", ("first_chunk", "uint"), ("first", "uint"), ("count", "uint"), ("chunk_size", "uint"))
Indices = npt.NDArray[np.int64]


@dataclass(frozen=True)
class ChunkRange:
    """Consecutive chunks of the table."""

    first: int
    count: int
    items: int

    @property
    def groups(self) -> tuple[int, int]:
        """Columns and rows of a dispatch with a workgroup per chunk."""
        return grid(self.count)

    def split(self, part: float) -> tuple["ChunkRange", "ChunkRange"]:
        """Split off the first part of the chunks; the items of both are estimates."""
        first = round(self.count * part)
        items = round(self.items * part)
        return ChunkRange(self.first, first, items), ChunkRange(
            self.first + first, self.count - first, self.items - items
        )


class ChunkTable:
    """Collects runs, then cuts all of them in one dispatch; the table holds (first item, items) per chunk."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._kernel = Kernel(device, "culling/chunks.comp")
        self._runs = device.ctx.buffer(reserve=_RUN.dtype.itemsize)
        self.buffer: moderngl.Buffer = device.ctx.buffer(reserve=_CHUNK.dtype.itemsize)
        """The table, bound as `Chunks`; another one when it must grow."""
        self.clear()

    def clear(self) -> None:
        """Start anew."""
        self._collected: list[tuple[Indices, Indices, int]] = []
        self.count = 0

    def add(self, start: Indices, length: Indices, size: int = CHUNK) -> ChunkRange:
        """Add runs of items, to be cut into chunks of `size` items at most; a run may be empty."""
        total = int((-(-length // size)).sum())
        if total:
            self._collected.append((start, length, size))
        span = ChunkRange(self.count, total, int(length.sum()))
        self.count += total
        return span

    def cut(self) -> None:
        """Write the table for everything added."""
        if not self.count:
            return
        starts, lengths, sizes = zip(*self._collected, strict=True)
        length, size = np.concatenate(lengths), np.repeat(sizes, [len(each) for each in lengths])
        chunks = -(-length // size)
        some = chunks > 0
        runs = np.empty(np.count_nonzero(some), _RUN.dtype)
        runs["first_chunk"] = (np.cumsum(chunks) - chunks)[some]
        runs["first"], runs["count"], runs["chunk_size"] = np.concatenate(starts)[some], length[some], size[some]
        self._runs = at_least(self._device, self._runs, runs.nbytes)
        self.buffer = at_least(self._device, self.buffer, self.count * _CHUNK.dtype.itemsize)
        upload(self._device, self._runs, runs)
        self._kernel.run_over(
            self.count, Runs=self._runs, Chunks=self.buffer, run_count=len(runs), chunk_count=self.count
        )
        self._device.ctx.memory_barrier(STORAGE_WRITTEN)

    def release(self) -> None:
        """Free the GPU resources."""
        self._runs.release()
        self.buffer.release()
        self._kernel.release()
