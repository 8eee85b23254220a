"""Regular grid of patches of ground, each with its own parameters of blades (Jahrmann & Wimmer 2013, section 4)."""

from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import release_all
from greensward.gpu.device import Device
from greensward.gpu.kernels import Bindings
from greensward.scene import InputError
from greensward.techniques.tessellated_quads.settings import QuadSettings

_MOST = 16_384
"""Tables, and patches on a side: texels on the side of a texture that every device has with OpenGL 4.5."""
_OWN = -1.0
"""Least and greatest width or height where the species says it."""


class PatchGrid:
    """Numbers of the rows of parameters of the grid's patches; row 0 is of those that no table is for."""

    def __init__(self, device: Device, settings: QuadSettings) -> None:
        rows, (cells, self._first) = patch_rows(settings), patch_cells(settings)
        self._patch_m = settings.patch_m
        self._numbers = device.ctx.texture(cells.shape[::-1], 1, cells.tobytes(), dtype="u2", alignment=2)
        self._rows = device.ctx.texture((2, len(rows)), 4, rows.tobytes(), dtype="f4")
        for texture in (self._numbers, self._rows):
            texture.filter = moderngl.NEAREST, moderngl.NEAREST
        self.bindings: Bindings = {"patch_numbers": self._numbers, "patch_rows": self._rows}
        """The grid and its rows, by their names in shaders."""

    def counted_from(self, anchor_ws: npt.NDArray[np.float64]) -> dict[str, Any]:
        """Uniforms that tell in which patch an anchor (3,) lies, where in it, and where the grid begins."""
        at = anchor_ws[[0, 2]] / self._patch_m
        anchor_patch = np.floor(at).astype(np.int32)
        return {"anchor_patch": anchor_patch, "in_patch": at - np.floor(at), "first_patch": self._first}

    def release(self) -> None:
        """Free the GPU memory."""
        release_all(self._numbers, self._rows)


def patch_rows(settings: QuadSettings) -> npt.NDArray[np.float32]:
    """Density as a part of the greatest, bending, smoothness; width and height: float32 (1 + tables, 2, 4)."""
    rows = np.full((1 + len(settings.patch), 2, 4), _OWN, np.float32)
    rows[0, 0] = 1.0 / settings.most_density, settings.bending_m, settings.smoothness, 0.0
    for row, each in zip(rows[1:], settings.patch, strict=True):
        bending_m = settings.bending_m if each.bending_m is None else each.bending_m
        row[0] = each.density / settings.most_density, bending_m, each.smoothness or settings.smoothness, 0.0
        row[1] = *(each.width_m or (_OWN, _OWN)), *(each.height_m or (_OWN, _OWN))
    return rows


def patch_cells(settings: QuadSettings) -> tuple[npt.NDArray[np.uint16], npt.NDArray[np.int32]]:
    """Row of each patch from the first of any table on, (rows, columns), and that patch's column and row, (2,)."""
    if not settings.patch:
        return np.zeros((1, 1), np.uint16), np.zeros(2, np.int32)
    low, high = areas_in_patches(settings)
    first = low.min(axis=0)
    columns, rows = np.maximum(high.max(axis=0) - first, 1)
    cells = np.zeros((rows, columns), np.uint16)
    for number, ((x0, z0), (x1, z1)) in enumerate(zip(low - first, high - first, strict=True), start=1):
        cells[z0:z1, x0:x1] = number
    return cells, first.astype(np.int32)


def areas_in_patches(settings: QuadSettings) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Column and row of the first patch in the area of each table, and of the first past it: (tables, 2) each.

    Raises `InputError` for too many tables, and for areas that reach over too many patches.
    """
    if len(settings.patch) > _MOST:
        raise InputError(f"technique.patch: must be at most {_MOST:,} tables (got {len(settings.patch):,})")
    # the patches whose centres lie between both corners
    areas = np.array([(each.from_m, each.to_m) for each in settings.patch]).reshape(-1, 2, 2)
    low, high = np.moveaxis(np.ceil(areas / settings.patch_m - 0.5).astype(np.int64), 1, 0)
    if len(areas) and (across := int((high.max(axis=0) - low.min(axis=0)).max())) > _MOST:
        raise InputError(
            f"technique.patch: must reach over at most {_MOST:,} patches on a side (got {across:,}); "
            "raise technique.patch_m"
        )
    return low, high
