"""Samples of a height map as a file holds them, and their heights in metres, without holes."""

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from greensward.scene.errors import InputError

LARGEST_HEIGHT_M = 100_000.0
_PICTURE_SPAN_M = (0.0, 10.0)

Array: TypeAlias = npt.NDArray[Any]
Floats: TypeAlias = npt.NDArray[np.floating[Any]]
Mask: TypeAlias = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Samples:
    """Values of a raster, (rows, columns), row 0 north; a height is a value times `scale` plus `offset`."""

    values: Array
    white: float | None = None
    """Value of white in a picture; None where values are measured ones."""
    known: Mask | None = None
    """Mask of those that were measured, as far as the file says."""
    scale: float = 1.0
    offset: float = 0.0

    def heights(
        self, label: object, height_m: tuple[float, float] | None, height_scale: float, no_data: float | None
    ) -> npt.NDArray[np.float32]:
        """Heights in metres, float32 (rows, columns), holes filled; `read_heights` tells the rest.

        Raises `InputError` that begins with `label`.
        """
        values, known = _measured(label, self, no_data)
        # In place: the largest map takes a gigabyte.
        if self.white is not None or height_m is not None:
            low, high = (0.0, self.white) if self.white is not None else (float(values.min()), float(values.max()))
            bottom_m, top_m = height_m or _PICTURE_SPAN_M
            values -= low
            values *= (top_m - bottom_m) / ((high - low) or 1.0)
            values += bottom_m
        else:
            values *= self.scale
            values += self.offset
        values *= height_scale
        lowest, highest = float(values.min()), float(values.max())
        if not max(-lowest, highest) <= LARGEST_HEIGHT_M:
            raise InputError(
                f"{label}: heights must lie within ±{LARGEST_HEIGHT_M:,.0f} m (got {lowest:g} to {highest:g} m); "
                "if one of these values means 'not measured', name it as no_data"
            )
        return _filled(values.astype(np.float32, copy=False), known)


def _measured(label: object, samples: Samples, no_data: float | None) -> tuple[Floats, Mask]:
    """A copy of the values as floating point, and which were measured; the others have a value of those."""
    raw = samples.values
    if min(raw.shape) < 2:
        raise InputError(f"{label}: must be at least 2 × 2 (got {raw.shape[1]} × {raw.shape[0]})")
    values = raw.astype(np.result_type(raw.dtype, np.float32))
    known = np.isfinite(values)
    if samples.known is not None:
        known &= samples.known
    if no_data is not None:
        with np.errstate(over="ignore"):
            known &= values != values.dtype.type(no_data)
    share = 1.0 - np.count_nonzero(known) / known.size
    if share == 1.0:
        raise InputError(f"{label}: holds no height: every value is NaN, infinite or no_data")
    if share > 0.9:
        raise InputError(f"{label}: at most 90 % of its values may be missing (got {100 * share:.1f} %)")
    if share > 0:
        values[~known] = values[np.unravel_index(known.argmax(), known.shape)]
    return values, known


def _filled(values: npt.NDArray[np.float32], known: Mask) -> npt.NDArray[np.float32]:
    """Fill holes from their surroundings by a pyramid (push-pull): halve until none is left, then refine, smoothing
    only inside the holes."""
    if known.all():
        return values
    rows, columns = values.shape
    padding = ((0, rows % 2), (0, columns % 2))
    blocks = ((rows + 1) // 2, 2, (columns + 1) // 2, 2)
    weight = np.pad(known, padding).reshape(blocks).sum(axis=(1, 3), dtype=np.float32)
    total = np.pad(np.where(known, values, 0), padding).reshape(blocks).sum(axis=(1, 3), dtype=np.float32)
    coarse = _filled(total / np.maximum(weight, 1), weight > 0)
    row, column = np.nonzero(~known)
    filled = values.copy()
    filled[row, column] = coarse[row // 2, column // 2]
    above, below = np.maximum(row - 1, 0), np.minimum(row + 1, rows - 1)
    left, right = np.maximum(column - 1, 0), np.minimum(column + 1, columns - 1)
    for _ in range(6):
        filled[row, column] = 0.25 * (
            filled[above, column] + filled[below, column] + filled[row, left] + filled[row, right]
        )
    return filled
