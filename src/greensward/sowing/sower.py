"""Marks the candidates of tiles that grow, counts them, and places their blades."""

from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import filled
from greensward.gpu.program import build_compute
from greensward.sowing.pages import Floats, Page, Tiles, page_numbers, starts

TILE = np.dtype([("x", "i4"), ("z", "i4"), ("level", "i4"), ("candidates", "u4")])
_COUNT = np.dtype([("up_to", "u4", 8), ("heads", "u4"), ("start", "u4"), ("head_start", "u4"), ("first_word", "u4")])
_MARK_BYTES = 16  # of 32 candidates
Table = npt.NDArray[np.void]


class Sower:
    """Sows tiles with one shader's `grow`."""

    def __init__(self, ctx: moderngl.Context, shader: str, page_blades: int) -> None:
        self._ctx = ctx
        self._page_blades = page_blades
        self._marker = build_compute(ctx, shader)
        self._tally = build_compute(ctx, "sowing/tally.comp")
        self._placer = build_compute(ctx, shader, {"PLACE": 1})

    def sow(
        self,
        tiles: Table,
        boxes: tuple[Floats, Floats],
        kept: Floats,
        uniforms: dict[str, Any],
        first_id: int,
        thing: int | None = None,
        carried: bool = False,
    ) -> list[Page]:
        """The blades of the tiles on as many pages as they need; what else the shader reads is bound.

        `boxes` are the lowest and the highest corner of each tile, (n, 3), and `kept` the part of its blades, (n,),
        that the tile's candidates are.
        """
        counts, marks = self._count(tiles, uniforms)
        grown = np.flatnonzero(counts["up_to"][:, 7])
        page_of = page_numbers(counts["up_to"][grown, 7].astype(np.int64), self._page_blades)
        pages: list[Page] = []
        for number in range(int(page_of.max(initial=-1)) + 1):
            here = grown[page_of == number]
            counted = counts[here]
            counted["start"], counted["head_start"] = starts(counted["up_to"][:, 7]), starts(counted["heads"])
            lying = (counted[name].astype(np.int64) for name in ("start", "up_to", "head_start", "heads"))
            page = Page(
                self._ctx, Tiles(boxes[0][here], boxes[1][here], kept[here], *lying), first_id, thing, carried
            )
            first_id += page.count
            pages.append(page)
            self._place(tiles[here], counted, marks, page, uniforms)
        marks.release()
        return pages

    def _count(self, tiles: Table, uniforms: dict[str, Any]) -> tuple[Table, moderngl.Buffer]:
        """What grows of each tile, and the marks of the candidates that do."""
        words = -(-tiles["candidates"].astype(np.int64) // 32)
        counts = np.zeros(len(tiles), _COUNT)
        counts["first_word"] = starts(words)
        marks = filled(self._ctx, max(int(words.sum()), 1) * _MARK_BYTES)
        tile_buffer, count_buffer = self._bind(tiles, counts, marks)
        self._run(self._marker, len(tiles), uniforms)
        self._tally["tileCount"] = len(tiles)
        self._tally.run(-(-len(tiles) // 64))
        self._ctx.memory_barrier()
        counts = np.frombuffer(count_buffer.read(), _COUNT).copy()
        counts["up_to"] = np.maximum.accumulate(counts["up_to"], axis=1)
        tile_buffer.release()
        count_buffer.release()
        return counts, marks

    def _place(
        self, tiles: Table, counts: Table, marks: moderngl.Buffer, page: Page, uniforms: dict[str, Any]
    ) -> None:
        tile_buffer, count_buffer = self._bind(tiles, counts, marks)
        (page.blades if page.sown is None else page.sown).bind_to_storage_buffer(3)
        page.heads.bind_to_storage_buffer(4)
        self._run(self._placer, len(tiles), uniforms)
        if page.sown is not None:
            self._ctx.copy_buffer(page.blades, page.sown)
        tile_buffer.release()
        count_buffer.release()

    def _bind(self, tiles: Table, counts: Table, marks: moderngl.Buffer) -> tuple[moderngl.Buffer, moderngl.Buffer]:
        buffers = self._ctx.buffer(tiles.tobytes()), self._ctx.buffer(counts.tobytes())
        for binding, buffer in enumerate((*buffers, marks)):
            buffer.bind_to_storage_buffer(binding)
        return buffers

    def _run(self, shader: moderngl.ComputeShader, tiles: int, uniforms: dict[str, Any]) -> None:
        for name, value in uniforms.items():
            shader[name] = value
        for first in range(0, tiles, 32768):
            shader["firstTile"] = first
            shader.run(min(32768, tiles - first))
        self._ctx.memory_barrier()

    def release(self) -> None:
        """Free the programs."""
        for shader in (self._marker, self._tally, self._placer):
            shader.release()
