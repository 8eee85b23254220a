"""What shaders need to follow rays down to the ground, as ground/march.glsl does."""

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.program import put
from greensward.ground.height_field import HeightField

_HIGHEST = 5  # a shader-storage binding


class GroundRays:
    """The highest heights of ever larger parts of the height map."""

    def __init__(self, ctx: moderngl.Context, heights: HeightField) -> None:
        self._heights = heights
        highest, self._starts = highest_heights(heights.heights)
        self._highest = ctx.buffer(highest)

    def prepare(self, shader: moderngl.Program | moderngl.ComputeShader) -> None:
        """Tell a shader, once, how they lie."""
        put(
            shader,
            starts=(self._starts + [0] * 16)[:16],
            topLevel=len(self._starts) - 1,
            relief_m=(self._heights.lowest_m, self._heights.highest_m),
        )

    def bind(self, shader: moderngl.Program | moderngl.ComputeShader, range_m: tuple[float, float]) -> None:
        """Bind them for rays between two depths in metres."""
        self._highest.bind_to_storage_buffer(_HIGHEST)
        put(shader, range_m=range_m)

    def release(self) -> None:
        """Free the GPU memory."""
        self._highest.release()


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
