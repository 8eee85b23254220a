"""Runs of blades cut into chunks on the GPU: an instance of a draw, or a workgroup, takes one chunk."""

from dataclasses import dataclass

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import rewrite
from greensward.gpu.program import build_compute

CHUNK = 32
Indices = npt.NDArray[np.int64]


def at_least(ctx: moderngl.Context, buffer: moderngl.Buffer, nbytes: int) -> moderngl.Buffer:
    """The buffer, or in its place a larger one that holds nothing yet."""
    if buffer.size >= nbytes:
        return buffer
    buffer.release()
    # whole commands of 20 bytes, and some room to grow
    return ctx.buffer(reserve=-(-nbytes * 5 // 4 // 20) * 20)


@dataclass(frozen=True)
class Span:
    """Consecutive chunks of the table."""

    first: int
    count: int
    items: int

    @property
    def groups(self) -> tuple[int, int]:
        """Columns and rows of a dispatch with a workgroup per chunk: drivers allow 65,535 a side."""
        columns = min(self.count, 32768)
        return columns, -(-self.count // columns)

    def split(self, part: float) -> tuple["Span", "Span"]:
        """The first part of the chunks, and the others; how many items each has is an estimate."""
        first = round(self.count * part)
        items = round(self.items * part)
        return Span(self.first, first, items), Span(self.first + first, self.count - first, self.items - items)


class ChunkTable:
    """Collects runs, then cuts all of them in one dispatch; the table holds (first item, items) per chunk."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._shader = build_compute(ctx, "culling/chunks.comp")
        self._runs, self._table = ctx.buffer(reserve=16), ctx.buffer(reserve=8)
        self.clear()

    def clear(self) -> None:
        """Start anew."""
        self._collected: list[npt.NDArray[np.uint32]] = []
        self.count = 0

    def add(self, start: Indices, length: Indices, size: int = CHUNK) -> Span:
        """Add runs of items, to be cut into chunks of `size` items at most; a run may be empty."""
        chunks = -(-length // size)
        ends = np.cumsum(chunks)
        total = int(ends[-1]) if len(ends) else 0
        runs = np.empty((len(start), 4), np.uint32)
        runs[:, 0], runs[:, 1], runs[:, 2], runs[:, 3] = self.count + ends - chunks, start, length, size
        self._collected.append(runs[chunks > 0])
        span = Span(self.count, total, int(length.sum()))
        self.count += total
        return span

    def cut(self) -> None:
        """Write the table for everything added."""
        runs = np.concatenate(self._collected) if self._collected else np.empty((0, 4), np.uint32)
        if not self.count:
            return
        self._runs = at_least(self._ctx, self._runs, runs.nbytes)
        self._table = at_least(self._ctx, self._table, self.count * 8)
        rewrite(self._runs, runs)
        self._runs.bind_to_storage_buffer(0)
        self._table.bind_to_storage_buffer(1)
        self._shader["runCount"] = len(runs)
        self._shader["chunkCount"] = self.count
        self._shader.run(-(-self.count // 64))
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def bind(self, binding: int) -> None:
        """Bind the table to a shader-storage binding."""
        self._table.bind_to_storage_buffer(binding)

    def release(self) -> None:
        """Free the GPU resources."""
        self._runs.release()
        self._table.release()
        self._shader.release()
