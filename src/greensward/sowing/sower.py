"""Marks the candidates of tiles that grow, counts them, and places their blades."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import at_least, clear, release_all, upload
from greensward.gpu.device import Device
from greensward.gpu.kernels import Kernel, Resource
from greensward.gpu.layouts import WORD, struct
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
    ("page", "uint"),
)
# of 32 candidates; starts within the tile
_MARK = struct("Mark", ("grows", "uint"), ("heads", "uint"), ("start", "uint"), ("head_start", "uint"))
NOWHERE = 0xFFFFFFFF
"""Number of no page: nothing of the tile is placed."""
_SLICE, _MOST_SLICES, _MOST_TILES = 256, 1024, 32768
"""Candidates of a tile that one workgroup tries; workgroups that share a tile, and tiles of a dispatch, at most."""
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
        self._buffers = {name: device.ctx.buffer(reserve=WORD) for name in ("Tiles", "Counts", "Marks")}
        self._slices, self._counting = 1, 0

    def sow(
        self,
        tiles: Table,
        bounds: tuple[Floats, Floats, Floats],
        values: dict[str, Any],
        first_number: int,
        object_index: int,
    ) -> list[Page]:
        """Blades of an object's tiles, on as many pages as they need; `values` are what else the shader names.

        `bounds` are the lowest and the highest corner of each tile, (n, 3), and the part of its blades, (n,), that
        the tile's candidates are.
        """
        self.count(tiles, values)
        counts = self.counted()
        grown = np.flatnonzero(counts["up_to"][:, 7])
        page_of = page_numbers(counts["up_to"][grown, 7].astype(np.int64), self.page_blades)
        counts["page"] = NOWHERE
        counts["page"][grown] = page_of
        pages: list[Page] = []
        for number in range(int(page_of.max(initial=-1)) + 1):
            here = grown[page_of == number]
            counts["start"][here] = starts(counts["up_to"][here, 7])
            counts["head_start"][here] = starts(counts["heads"][here])
            start, up_to, head_start, head_count = (
                counts[name][here].astype(np.int64) for name in ("start", "up_to", "head_start", "heads")
            )
            blades, heads = int(up_to[:, 7].sum()), int(head_count.sum())
            page = Page(self._device, blades, heads, first_number, object_index, transformed=True)
            serial = -(first_number + np.arange(len(here)))  # each has a blade at least
            low, high, coverage = (each[here] for each in bounds)
            page.hold(Tiles(low, high, coverage, start, up_to, head_start, head_count, serial))
            first_number += blades
            pages.append(page)
        self.place(counts, pages, values)
        for page in pages:
            assert page.sown
            self._device.ctx.copy_buffer(page.blades, page.sown)
        return pages

    def count(self, tiles: Table, values: Mapping[str, Any] = {}) -> None:
        """Begin to count what grows of each tile, and to mark the candidates that do, for `place`."""
        words = -(-tiles["candidates"].astype(np.int64) // 32)
        counts = np.zeros(len(tiles), _COUNT.dtype)
        counts["first_word"] = starts(words)
        self._slices = int(min(-(-tiles["candidates"].max(initial=1).astype(np.int64) // _SLICE), _MOST_SLICES))
        nbytes = max(int(words.sum()), 1) * _MARK.dtype.itemsize
        for name, needed in (("Tiles", tiles.nbytes), ("Counts", counts.nbytes), ("Marks", nbytes)):
            self._buffers[name] = at_least(self._device, self._buffers[name], needed)
        upload(self._device, self._buffers["Tiles"], tiles)
        upload(self._device, self._buffers["Counts"], counts)
        clear(self._device, self._buffers["Marks"], nbytes)
        self._run(self._marker, range(len(tiles)), values)
        self._prefix_sum.run_over(len(tiles), tile_count=len(tiles), **self._buffers)
        self._counting = len(tiles)

    def counted(self) -> Table:
        """Wait for what was counted last."""
        self._device.ctx.memory_barrier()
        counted = self._buffers["Counts"].read(self._counting * _COUNT.dtype.itemsize)
        counts = np.frombuffer(counted, _COUNT.dtype).copy()
        counts["up_to"] = np.maximum.accumulate(counts["up_to"], axis=1)
        return counts

    def place(self, counts: Table, pages: Sequence[Page], values: Mapping[str, Any] = {}) -> None:
        """Write the blades of the tiles that were counted last to where the counts say that they start."""
        upload(self._device, self._buffers["Counts"], counts)
        for number in np.unique(counts["page"][counts["page"] != NOWHERE]).tolist():
            page, here = pages[number], np.flatnonzero(counts["page"] == number)
            target: dict[str, Any] = {"Blades": page.sown or page.blades, "Heads": page.heads, "page": number}
            if page.ids:
                target["Ids"] = page.ids
            self._run(self._placer, range(int(here[0]), int(here[-1]) + 1), {**values, **target})

    def _run(self, kernel: Kernel, tiles: range, values: Mapping[str, Any]) -> None:
        for first in tiles[::_MOST_TILES]:
            count = min(_MOST_TILES, tiles.stop - first)
            kernel.run((count, self._slices), first_tile=first, **self._buffers, **values)
        self._device.ctx.memory_barrier()

    def release(self) -> None:
        """Free programs and buffers."""
        release_all(self._marker, self._prefix_sum, self._placer, *self._buffers.values())
