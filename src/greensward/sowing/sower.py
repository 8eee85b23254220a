"""Marks the candidates of tiles that grow, counts them, and places their blades."""

from collections.abc import Mapping
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import release_all, zeros
from greensward.gpu.device import Device
from greensward.gpu.kernels import Kernel, Resource
from greensward.gpu.layouts import struct
from greensward.sowing.pages import Floats, Page, Tiles, page_numbers, starts

# a square of ground, or a group of an object's triangles, in which so many blades are tried
TILE = struct("Tile", ("x", "int"), ("z", "int"), ("level", "int"), ("candidates", "uint"))
_COUNT = struct(
    "TileCount",
    ("up_to", "uint", 8),
    ("heads", "uint"),
    ("start", "uint"),
    ("head_start", "uint"),
    ("first_word", "uint"),
)
# of 32 candidates; starts within the tile
_MARK = struct("Mark", ("grows", "uint"), ("heads", "uint"), ("start", "uint"), ("head_start", "uint"))
Table = npt.NDArray[np.void]


class Sower:
    """Sows tiles with one shader's `grow`."""

    def __init__(
        self,
        device: Device,
        shader: str,
        page_blades: int,
        bindings: Mapping[str, Resource],
        defines: Mapping[str, object] = {},
    ) -> None:
        self._device = device
        self.page_blades = page_blades
        self._marker = Kernel(device, shader, defines, bindings)
        self._prefix_sum = Kernel(device, "sowing/prefix_sum.comp")
        self._placer = Kernel(device, shader, {**defines, "PLACE": 1}, bindings)

    def sow(
        self,
        tiles: Table,
        bounds: tuple[Floats, Floats, Floats],
        values: dict[str, Any],
        first_id: int,
        object_index: int,
    ) -> list[Page]:
        """Blades of an object's tiles, on as many pages as they need; `values` are what else the shader names.

        `bounds` are the lowest and the highest corner of each tile, (n, 3), and the part of its blades, (n,), that
        the tile's candidates are.
        """
        counts, marks = self.count(tiles, values)
        grown = np.flatnonzero(counts["up_to"][:, 7])
        page_of = page_numbers(counts["up_to"][grown, 7].astype(np.int64), self.page_blades)
        pages: list[Page] = []
        for number in range(int(page_of.max(initial=-1)) + 1):
            here = grown[page_of == number]
            counted = counts[here]
            counted["start"], counted["head_start"] = starts(counted["up_to"][:, 7]), starts(counted["heads"])
            start, up_to, head_start, head_count = (
                counted[name].astype(np.int64) for name in ("start", "up_to", "head_start", "heads")
            )
            blades, heads = int(up_to[:, 7].sum()), int(head_count.sum())
            page = Page(self._device, blades, heads, first_id, object_index, transformed=True)
            serial = -(first_id + np.arange(len(here)))  # each has a blade at least
            low, high, coverage = (each[here] for each in bounds)
            page.hold(Tiles(low, high, coverage, start, up_to, head_start, head_count, serial))
            first_id += blades
            pages.append(page)
            self.place(tiles[here], counted, marks, page, values)
            assert page.sown
            self._device.ctx.copy_buffer(page.blades, page.sown)
        marks.release()
        return pages

    def count(self, tiles: Table, values: Mapping[str, Any] = {}) -> tuple[Table, moderngl.Buffer]:
        """Count what grows of each tile, and mark the candidates that do."""
        words = -(-tiles["candidates"].astype(np.int64) // 32)
        counts = np.zeros(len(tiles), _COUNT.dtype)
        counts["first_word"] = starts(words)
        marks = zeros(self._device, max(int(words.sum()), 1) * _MARK.dtype.itemsize)
        tile_buffer, count_buffer = (
            self._device.ctx.buffer(tiles.tobytes()),
            self._device.ctx.buffer(counts.tobytes()),
        )
        buffers = {"Tiles": tile_buffer, "Counts": count_buffer, "Marks": marks}
        self._run(self._marker, len(tiles), {**values, **buffers})
        self._prefix_sum.run_over(len(tiles), tile_count=len(tiles), **buffers)
        self._device.ctx.memory_barrier()
        counts = np.frombuffer(count_buffer.read(), _COUNT.dtype).copy()
        counts["up_to"] = np.maximum.accumulate(counts["up_to"], axis=1)
        tile_buffer.release()
        count_buffer.release()
        return counts, marks

    def place(
        self, tiles: Table, counts: Table, marks: moderngl.Buffer, page: Page, values: Mapping[str, Any] = {}
    ) -> None:
        """Write the blades of counted tiles to where the counts say that they start."""
        tile_buffer, count_buffer = (
            self._device.ctx.buffer(tiles.tobytes()),
            self._device.ctx.buffer(counts.tobytes()),
        )
        target = page.blades if page.sown is None else page.sown
        buffers = {
            "Tiles": tile_buffer,
            "Counts": count_buffer,
            "Marks": marks,
            "Blades": target,
            "Heads": page.heads,
        }
        self._run(self._placer, len(tiles), {**values, **buffers})
        tile_buffer.release()
        count_buffer.release()

    def _run(self, kernel: Kernel, tiles: int, values: dict[str, Any]) -> None:
        for first in range(0, tiles, 32768):
            kernel.run(min(32768, tiles - first), first_tile=first, **values)
        self._device.ctx.memory_barrier()

    def release(self) -> None:
        """Free the programs."""
        release_all(self._marker, self._prefix_sum, self._placer)
