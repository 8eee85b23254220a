"""Depth pyramid (Hi-Z): the farthest depth of a picture at ever coarser pixels (Greene, Kass & Miller 1993)."""

from collections.abc import Mapping, Sequence

import moderngl

from greensward.gpu.buffers import at_least
from greensward.gpu.device import STORAGE_WRITTEN, Device
from greensward.gpu.kernels import Kernel, Resource
from greensward.gpu.layouts import WORD


def level_sizes(size: tuple[int, int]) -> list[tuple[int, int]]:
    """Width and height of levels 1 and up, rounded up, until one texel is left; in whole steps of three levels."""
    sizes: list[tuple[int, int]] = []
    while not sizes or len(sizes) % 3 or size != (1, 1):
        size = -(-size[0] // 2), -(-size[1] // 2)
        sizes.append(size)
    return sizes


class DepthPyramid:
    """Maxima of a picture's linear depth over squares of 2, 4, 8, … pixels, for tests of what lies behind it.

    `base` is the path of GLSL with `ivec2 pictureSize()` and `float baseDepth(ivec2 pixel)`: metres, inf for sky.
    """

    def __init__(
        self,
        device: Device,
        bindings: Mapping[str, Resource],
        base: str = "culling/gbuffer_depth.glsl",
        defines: Mapping[str, object] = {},
        extensions: Sequence[str] = (),
    ) -> None:
        self._device = device
        include = {"culling/base_depth": f'#include "{base}"'}
        path = "culling/depth_pyramid.comp"
        self._kernel = Kernel(device, path, defines, bindings, generated=include, extensions=extensions)
        self.buffer: moderngl.Buffer = device.ctx.buffer(reserve=WORD)
        """Levels 1 and up as float32, one after the other, rows from the bottom; bound as `DepthPyramid`."""

    def build(self, size: tuple[int, int], **values: Resource) -> None:
        """Build it from a picture of this size in pixels; `values` are what its base names."""
        sizes = level_sizes(size)
        texels = sum(x * y for x, y in sizes)
        self.buffer = at_least(self._device, self.buffer, texels * WORD)
        for below in range(0, len(sizes), 3):
            self._kernel.run_over(sizes[below + 2], DepthPyramid=self.buffer, below=below, **values)
            self._device.ctx.memory_barrier(STORAGE_WRITTEN)

    def release(self) -> None:
        """Free the GPU resources."""
        self.buffer.release()
        self._kernel.release()
