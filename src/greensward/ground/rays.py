"""Maximum mipmap of the height map, for the ray marching of ground/march.glsl."""

import numpy as np
import numpy.typing as npt

from greensward.gpu.device import Device
from greensward.gpu.kernels import Draw, Kernel
from greensward.ground.height_field import HeightField

_MOST_LEVELS = 16  # of march.glsl


class MaximumMipmap:
    """Highest heights of ever larger parts of the height map (Tevs, Ihrke & Seidel 2008)."""

    def __init__(self, device: Device, heights: HeightField) -> None:
        self._heights = heights
        highest, self._starts = highest_heights(heights.heights)
        self.buffer = device.ctx.buffer(highest)
        """Bound as `Highest`."""

    def describe(self, shader: Kernel | Draw) -> None:
        """Set, once, where its levels start in a shader."""
        shader.set(
            starts=(self._starts + [0] * _MOST_LEVELS)[:_MOST_LEVELS],
            top_level=len(self._starts) - 1,
            relief_m=(self._heights.lowest_m, self._heights.highest_m),
        )

    def release(self) -> None:
        """Free the GPU memory."""
        self.buffer.release()


def highest_heights(heights: npt.NDArray[np.float32]) -> tuple[npt.NDArray[np.float32], list[int]]:
    """Maxima of the height map over 2 × 2, 4 × 4, … cells, one level after the other, and where each level starts.

    Level 0, single cells, is left out; the last has one entry. Never empty.
    """
    cells = np.maximum(np.maximum(heights[:-1, :-1], heights[1:, :-1]), np.maximum(heights[:-1, 1:], heights[1:, 1:]))
    levels, starts, count = [np.zeros(0, np.float32)], [0], 0
    while cells.size > 1:
        rows, columns = (-(-edge // 2) for edge in cells.shape)
        even = np.pad(cells, ((0, 2 * rows - cells.shape[0]), (0, 2 * columns - cells.shape[1])), "edge")
        cells = even.reshape(rows, 2, columns, 2).max((1, 3))
        starts.append(count)
        count += cells.size
        levels.append(cells.ravel())
    return np.concatenate([*levels, np.zeros(int(count == 0), np.float32)]), starts
