"""Roots of the field in textures, one array of them for each page: written where tiles are new or have changed."""

import math
from dataclasses import dataclass, field

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import at_least, clear, release_all, upload
from greensward.gpu.device import IMAGES_WRITTEN, STORAGE_WRITTEN, Device
from greensward.gpu.kernels import Kernel, grid
from greensward.gpu.layouts import WORD, constants, struct
from greensward.gpu.memory import available_bytes
from greensward.scene import InputError
from greensward.sowing import Page
from greensward.sowing.pages import Tiles, starts
from greensward.world import FrameTime, World

_CELLS = 64
_NO_ROOT = 0xFFFFFFFF
constants("RootCells", {"ROOT_CELLS": _CELLS})
_RUN = struct(
    "RootRun",
    ("before", "uint"),  # roots of the runs before it
    ("first", "uint"),
    ("dropped", "uint"),  # axis of the shortest edge of its box
    ("corner_x", "float"),  # of its box, along the two other axes
    ("corner_y", "float"),
    ("cells_per_m", "float"),
)
_FOLDER = "techniques/expanded_roots"
_VALUES = 4  # layers of a root's values, 16 bytes each; its neighbours are one more
_TEXEL = 16


@dataclass
class _Filled:
    """The array of a page, and the serial numbers of the tiles that it holds."""

    texture: moderngl.TextureArray
    tiles: Tiles | None = None
    serials: npt.NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    time_s: float = math.nan
    anchor_ws: npt.NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))


def size_of(roots: int, most_px: int) -> tuple[int, int]:
    """Columns and rows of textures that hold so many roots, none beyond the driver's limit. Raises `InputError`."""
    if roots > most_px * most_px:
        raise InputError(
            f'technique.storage: must be "vertex-buffer" for more than {most_px * most_px:,} roots, as textures of '
            f"{most_px:,} pixels a side hold no more (got {roots:,}); or lower sowing.density_per_m2"
        )
    columns = min(max(roots, 1), most_px)
    return columns, -(-max(roots, 1) // columns)


class RootTextures:
    """Arrays of textures with the roots of every page of the field, by the number of a root in its page."""

    def __init__(self, device: Device, world: World, neighbours: bool) -> None:
        self._device, self._world = device, world
        self._layers = _VALUES + neighbours
        self._fill = Kernel(device, f"{_FOLDER}/fill.comp", {"NEIGHBOURS": 1} if neighbours else {})
        self._find = Kernel(device, f"{_FOLDER}/cells.comp") if neighbours else None
        self._runs = device.ctx.buffer(reserve=_RUN.dtype.itemsize)
        self._cells = device.ctx.buffer(reserve=WORD)
        self._filled: dict[Page, _Filled] = {}

    def of(self, page: Page) -> moderngl.TextureArray:
        """The array of a page."""
        return self._filled[page].texture

    def update(self, frame: FrameTime) -> None:
        """Write the tiles that have come since the last frame, and those that grow or move with an object."""
        pages = self._world.field.pages
        for page in [each for each in self._filled if each not in pages]:
            self._filled.pop(page).texture.release()
        wrote = False
        for page in pages:
            if page not in self._filled:
                self._filled[page] = _Filled(self._array(page))
            wrote |= self._write(page, self._filled[page], frame.time_s, frame.views[0].anchor_ws)
        if wrote:
            self._device.ctx.memory_barrier(IMAGES_WRITTEN)

    def _array(self, page: Page) -> moderngl.TextureArray:
        columns, rows = size_of(page.capacity, self._device.limits.texture_px)
        needed, free = columns * rows * self._layers * _TEXEL, available_bytes(self._device)
        if needed > free:
            raise InputError(
                f'technique.storage: must be "vertex-buffer" here: the textures of {page.capacity / 1e6:,.1f} '
                f"million roots need {needed / 2**30:,.1f} GiB, and this device can give {free / 2**30:,.1f} GiB"
            )
        texture = self._device.ctx.texture_array((columns, rows, self._layers), 4, dtype="u4")
        texture.filter = moderngl.NEAREST, moderngl.NEAREST
        return texture

    def _changes(self, page: Page) -> bool:
        index = page.object_index
        moves = index is not None and self._world.placing.moving[index]
        return self._world.scene.growth is not None or bool(moves)

    def _write(self, page: Page, filled: _Filled, time_s: float, anchor_ws: npt.NDArray[np.float64]) -> bool:
        tiles = page.tiles
        stays = np.isin(tiles.serial, filled.serials)
        moved = not np.array_equal(anchor_ws, filled.anchor_ws)
        if moved or (self._changes(page) and filled.time_s != time_s):
            stays[:] = False
        elif tiles is filled.tiles:
            return False
        filled.tiles, filled.serials, filled.time_s, filled.anchor_ws = tiles, tiles.serial, time_s, anchor_ws
        new = tiles.where(~stays & (tiles.up_to[:, 7] > 0))
        if not len(new.start):
            return False
        runs, total = _runs_of(new, anchor_ws), int(new.up_to[:, 7].sum())
        self._runs = at_least(self._device, self._runs, runs.nbytes)
        upload(self._device, self._runs, runs)
        groups = grid(-(-total // self._fill.group[0]))
        roots = {"Blades": page.blades, "Runs": self._runs, "run_count": len(runs), "root_count": total}
        if self._find:
            self._cells = at_least(self._device, self._cells, len(runs) * _CELLS**2 * WORD)
            self._device.ctx.memory_barrier(moderngl.BUFFER_UPDATE_BARRIER_BIT)
            clear(self._device, self._cells, self._cells.size, _NO_ROOT)
            self._find.run(groups, **roots, Cells=self._cells)
            self._device.ctx.memory_barrier(STORAGE_WRITTEN)
            roots["Cells"] = self._cells
        self._fill.run(groups, **roots, roots_image=filled.texture, texture_width=filled.texture.width)
        return True

    def release(self) -> None:
        """Free textures, buffers and programs."""
        if self._find:
            self._find.release()
        release_all(self._fill, self._runs, self._cells, *(each.texture for each in self._filled.values()))
        self._filled.clear()


def _runs_of(tiles: Tiles, anchor_ws: npt.NDArray[np.float64]) -> npt.NDArray[np.void]:
    """Roots of each tile, and the grid over the two longer edges of its box."""
    runs = np.empty(len(tiles.start), _RUN.dtype)
    edges = tiles.high - tiles.low
    dropped = np.argmin(edges, axis=1)
    kept = np.array([[1, 2], [0, 2], [0, 1]])[dropped]
    corner = np.take_along_axis(tiles.low - anchor_ws, kept, axis=1)
    runs["before"], runs["first"], runs["dropped"] = starts(tiles.up_to[:, 7]), tiles.start, dropped
    runs["corner_x"], runs["corner_y"] = corner.T
    runs["cells_per_m"] = _CELLS / np.maximum(np.take_along_axis(edges, kept, axis=1).max(axis=1), 1e-6)
    return runs
