"""The Field: blades on the GPU, in tiles that grow with distance, 64 bytes a blade."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.blocks import BlockBuffer
from greensward.gpu.memory import available_bytes
from greensward.gpu.program import build_compute
from greensward.ground.ground_gpu import GroundGpu
from greensward.scene import InputError, Scene
from greensward.sowing.species import SWARD_BLOCK, leaf_edge_m, sward_values

BLADE_BYTES, POSTURE_BYTES = 64, 24
_MARK_BYTES = 16  # of 32 candidates
MOST_BLADES = (1 << 27) - 2  # an id has 27 bits
_TILE = np.dtype([("x", "i4"), ("z", "i4"), ("level", "i4"), ("candidates", "u4")])
_COUNT = np.dtype([("up_to", "u4", 8), ("heads", "u4"), ("start", "u4"), ("head_start", "u4"), ("first_word", "u4")])
Floats = npt.NDArray[np.float64]
Table = npt.NDArray[np.void]


@dataclass(frozen=True)
class Tiles:
    """Squares of ground, one row each: bounds in metres, where their blades lie, how many by rank."""

    low: Floats  # (n, 3)
    high: Floats  # (n, 3)
    kept: Floats  # (n,) part of the blades that was sown
    start: npt.NDArray[np.int64]  # (n,) first blade within the page
    up_to: npt.NDArray[np.int64]  # (n, 8) blades whose rank is in the first 1/8, 2/8, … of `kept`
    head_start: npt.NDArray[np.int64]
    heads: npt.NDArray[np.int64]

    @cached_property
    def centre(self) -> Floats:
        """Middle of each box, (n, 3)."""
        return 0.5 * (self.low + self.high)

    @cached_property
    def half(self) -> Floats:
        """Half the extent of each box, (n, 3)."""
        return 0.5 * (self.high - self.low)


class Page:
    """Blades that fit into one storage block of the driver, with their tiles."""

    def __init__(self, ctx: moderngl.Context, tiles: Tiles, first_id: int) -> None:
        self.tiles = tiles
        self.first_id = first_id
        self.count = int(tiles.up_to[:, 7].sum())
        self.head_count = int(tiles.heads.sum())
        self.blades = ctx.buffer(reserve=self.count * BLADE_BYTES)
        self.postures = ctx.buffer(reserve=self.count * POSTURE_BYTES)
        self.heads = ctx.buffer(reserve=max(self.head_count, 1) * 4)

    def release(self) -> None:
        """Free the GPU memory."""
        for buffer in (self.blades, self.postures, self.heads):
            buffer.release()


class Field:
    """All blades within reach of a focus, thinned with distance from it; any prefix of a tile is a fair sample."""

    def __init__(self, ctx: moderngl.Context, scene: Scene, ground: GroundGpu) -> None:
        self._ctx = ctx
        self._scene = scene
        self._ground = ground
        self.pages: list[Page] = []
        self.count = 0
        values = sward_values(scene)
        self._species_count = values["count"]
        self.canopy_m = float(values["canopy_m"])  # type: ignore[arg-type]
        self.tallest_m = max((grass.height_m[1] for grass in scene.grass), default=0.0) * 1.7
        self.block = BlockBuffer(ctx, SWARD_BLOCK)
        self.block.set(**values)  # type: ignore[arg-type]
        # a technique may keep records of its own for each blade, up to twice as large
        self._page_blades = min(ctx.info["GL_MAX_SHADER_STORAGE_BLOCK_SIZE"], 1 << 30) // (2 * BLADE_BYTES)
        self._marker = build_compute(ctx, "sowing/sow.comp")
        self._tally = build_compute(ctx, "sowing/tally.comp")
        self._placer = build_compute(ctx, "sowing/sow.comp", {"PLACE": 1})

    def sow(self, focus_ws: npt.ArrayLike, slack_m: float) -> None:
        """Sow anew around a focus, good for cameras up to `slack_m` from it.

        Raises `InputError` where the device's memory cannot hold the blades.
        """
        focus = np.asarray(focus_ws, np.float64)
        self._forget()
        tiles = self._tiles(focus, slack_m)
        if not len(tiles):
            return
        self._refuse_too_many(int(tiles["candidates"].sum()))
        self._ground.bind()
        self.block.bind()
        counts, marks = self._count(tiles, focus, slack_m)
        grown = np.flatnonzero(counts["up_to"][:, 7])
        tiles, counts = tiles[grown], counts[grown]
        page_of = _pages(counts["up_to"][:, 7].astype(np.int64), self._page_blades)
        for page in range(int(page_of.max(initial=-1)) + 1):
            here = page_of == page
            self._place(tiles[here], counts[here], marks, focus, slack_m)
        marks.release()

    def _tiles(self, focus: Floats, slack_m: float) -> Table:
        """Tiles that touch the reach: small ones near the focus, each level twice the size of the last."""
        scene, sowing = self._scene, self._scene.sowing
        density, reach = sowing.density_per_m2, sowing.reach_m + slack_m
        if density <= 0 or not self._species_count:
            return np.zeros(0, _TILE)
        leaf = leaf_edge_m(density)
        level = max(0, int(np.ceil(np.log2(2.0 * reach / leaf))))
        size = leaf * 2.0**level
        corner = np.floor((focus[[0, 2]] - reach) / size)
        xz = np.stack(np.meshgrid(*(corner[i] + np.arange(2) for i in (0, 1)), indexing="ij"), -1)
        xz = xz.reshape(-1, 2).astype(np.int64)
        found = []
        while True:
            low = xz * size
            beside = np.maximum(np.maximum(low - focus[[0, 2]], focus[[0, 2]] - low - size), 0.0)
            away = np.maximum(np.hypot(beside[:, 0], beside[:, 1]) - slack_m, 0.0)
            keep = away <= sowing.reach_m
            if scene.ground.beyond == "bare":
                half = 0.5 * np.array(scene.ground.size_m)
                keep &= np.all((low < half) & (low + size > -half), axis=1)
            xz, away = xz[keep], away[keep]
            kept = np.minimum(1.0, (sowing.full_density_m / np.maximum(away, 1e-3)) ** 2)
            split = ((away < 3.0 * size) | (density * size * size * kept > self._page_blades)) & (level > 0)
            whole = ~split
            kept = kept[whole]
            tiles = np.zeros(int(whole.sum()), _TILE)
            tiles["x"], tiles["z"], tiles["level"] = xz[whole, 0], xz[whole, 1], level
            tiles["candidates"] = np.minimum(np.ceil(density * size * size * kept), 0xFFFFFFFF)
            found.append(tiles)
            if not split.any():
                return np.concatenate(found)
            quarter = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
            xz = (2 * xz[split][:, None, :] + quarter).reshape(-1, 2)
            level -= 1
            size *= 0.5

    def _refuse_too_many(self, candidates: int) -> None:
        blades = candidates * self._ground.mean_density
        needed, free = blades * (BLADE_BYTES + POSTURE_BYTES), available_bytes(self._ctx)
        cure = "lower sowing.density_per_m2, sowing.full_density_m or sowing.reach_m"
        if needed > free:
            raise InputError(
                f"sowing: about {blades / 1e6:,.0f} million blades need {needed / 2**30:,.1f} GiB, "
                f"and this device can give {free / 2**30:,.1f} GiB; {cure}"
            )
        if blades > MOST_BLADES:
            raise InputError(
                f"sowing: must be at most {MOST_BLADES / 1e6:,.0f} million blades "
                f"(got about {blades / 1e6:,.0f} million); {cure}"
            )

    def _count(self, tiles: Table, focus: Floats, slack_m: float) -> tuple[Table, moderngl.Buffer]:
        """What grows of each tile, and the marks of the candidates that do."""
        words = -(-tiles["candidates"].astype(np.int64) // 32)
        counts = np.zeros(len(tiles), _COUNT)
        counts["first_word"] = _starts(words)
        marks = self._ctx.buffer(reserve=int(words.sum()) * _MARK_BYTES)
        marks.clear()
        tile_buffer, count_buffer = self._bind(tiles, counts, marks)
        self._run(self._marker, len(tiles), focus, slack_m)
        self._tally["tileCount"] = len(tiles)
        self._tally.run(-(-len(tiles) // 64))
        self._ctx.memory_barrier()
        counts = np.frombuffer(count_buffer.read(), _COUNT).copy()
        counts["up_to"] = np.maximum.accumulate(counts["up_to"], axis=1)
        tile_buffer.release()
        count_buffer.release()
        return counts, marks

    def _place(self, tiles: Table, counts: Table, marks: moderngl.Buffer, focus: Floats, slack_m: float) -> None:
        counts["start"] = _starts(counts["up_to"][:, 7])
        counts["head_start"] = _starts(counts["heads"])
        page = Page(self._ctx, self._bounds(tiles, counts), self.count + 1)
        self.pages.append(page)
        self.count += page.count
        tile_buffer, count_buffer = self._bind(tiles, counts, marks)
        page.blades.bind_to_storage_buffer(3)
        page.heads.bind_to_storage_buffer(4)
        self._run(self._placer, len(tiles), focus, slack_m)
        tile_buffer.release()
        count_buffer.release()

    def _bind(self, tiles: Table, counts: Table, marks: moderngl.Buffer) -> tuple[moderngl.Buffer, moderngl.Buffer]:
        buffers = self._ctx.buffer(tiles.tobytes()), self._ctx.buffer(counts.tobytes())
        for binding, buffer in enumerate((*buffers, marks)):
            buffer.bind_to_storage_buffer(binding)
        return buffers

    def _run(self, shader: moderngl.ComputeShader, tiles: int, focus: Floats, slack_m: float) -> None:
        shader["focus"] = (*focus, slack_m)
        for first in range(0, tiles, 32768):
            shader["firstTile"] = first
            shader.run(min(32768, tiles - first))
        self._ctx.memory_barrier()

    def _bounds(self, tiles: Table, counts: Table) -> Tiles:
        sowing = self._scene.sowing
        size = leaf_edge_m(sowing.density_per_m2) * 2.0 ** tiles["level"]
        x0, z0 = tiles["x"] * size, tiles["z"] * size
        low, high = np.empty((len(tiles), 3)), np.empty((len(tiles), 3))
        for level in np.unique(tiles["level"]):
            at = tiles["level"] == level
            low[at, 1], high[at, 1] = self._ground.heights.height_range(x0[at], z0[at], float(size[at][0]))
        # clumps pull roots, and blades lean, across the edge of a tile
        margin = self.tallest_m + 0.5 * sowing.clump_m
        low[:, 0], high[:, 0] = x0 - margin, x0 + size + margin
        low[:, 2], high[:, 2] = z0 - margin, z0 + size + margin
        low[:, 1] -= self.tallest_m
        high[:, 1] += self.tallest_m
        return Tiles(
            low,
            high,
            tiles["candidates"] / (sowing.density_per_m2 * size * size),
            counts["start"].astype(np.int64),
            counts["up_to"].astype(np.int64),
            counts["head_start"].astype(np.int64),
            counts["heads"].astype(np.int64),
        )

    @property
    def nbytes(self) -> int:
        """GPU memory of the blades and their postures in bytes."""
        return sum(p.blades.size + p.postures.size + p.heads.size for p in self.pages)

    def _forget(self) -> None:
        for page in self.pages:
            page.release()
        self.pages, self.count = [], 0

    def release(self) -> None:
        """Free the GPU memory."""
        self._forget()
        self.block.release()
        self._marker.release()
        self._tally.release()
        self._placer.release()


def _starts(counts: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
    starts: npt.NDArray[np.int64] = np.cumsum(counts, dtype=np.int64) - counts
    return starts


def _pages(counts: npt.NDArray[np.int64], limit: int) -> npt.NDArray[np.int64]:
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
