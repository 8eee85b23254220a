"""How far away the farthest of what is drawn lies, at ever coarser pixels (Greene, Kass & Miller 1993)."""

from collections.abc import Mapping, Sequence

import moderngl

from greensward.culling.chunks import at_least
from greensward.gpu.pixel_pass import pixel_groups
from greensward.gpu.program import build_compute

FARTHEST = 12
"""Shader-storage binding of the pyramid."""


def level_sizes(size: tuple[int, int]) -> list[tuple[int, int]]:
    """Width and height of levels 1 and up, rounded up, until one texel is left; in whole steps of three levels."""
    sizes: list[tuple[int, int]] = []
    while not sizes or len(sizes) % 3 or size != (1, 1):
        size = -(-size[0] // 2), -(-size[1] // 2)
        sizes.append(size)
    return sizes


class Pyramid:
    """Maxima of a picture's linear depth over squares of 2, 4, 8, … pixels, for tests of what lies behind it.

    `surface` is the path of GLSL with `ivec2 pictureSize()` and `float depthOf(ivec2 pixel)`: metres, inf for sky.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        surface: str = "culling/picture.glsl",
        defines: Mapping[str, object] = {},
        extensions: Sequence[str] = (),
    ) -> None:
        self._ctx = ctx
        include = {"culling/surface": f'#include "{surface}"'}
        self._shader = build_compute(ctx, "culling/pyramid.comp", defines, include, extensions)
        self.farthest = ctx.buffer(reserve=4)
        """Levels 1 and up as float32, one after the other, rows from the bottom."""

    def build(self, size: tuple[int, int]) -> None:
        """Build it from what is bound for its surface, of this size in pixels, and bind it."""
        sizes = level_sizes(size)
        self.farthest = at_least(self._ctx, self.farthest, sum(x * y for x, y in sizes) * 4)
        self.farthest.bind_to_storage_buffer(FARTHEST)
        for below in range(0, len(sizes), 3):
            self._shader["below"] = below
            self._shader.run(*pixel_groups(sizes[below + 2]))
            self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def release(self) -> None:
        """Free the GPU resources."""
        self.farthest.release()
        self._shader.release()
