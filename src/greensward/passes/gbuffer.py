"""G-buffer: what is seen at each pixel, unlit, in formats that raster and compute can both write."""

import ctypes

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import at_least, read_back, release_all
from greensward.gpu.depth import ReversedDepth
from greensward.gpu.device import IMAGES_WRITTEN, Device, Stage
from greensward.gpu.kernels import Bindings, Kernel
from greensward.gpu.layouts import WORD
from greensward.scene.classes import BLADE_NUMBER_BITS

_COLOUR, _DEPTH = 0x1800, 0x1801
_SURFACE = 3
_NEAREST = moderngl.NEAREST, moderngl.NEAREST


class GBuffer:
    """Colour and transmittance, normal, occlusion and roughness, motion, and the surface: class and id, linear depth.

    Where the class is sky, the first three hold what an earlier frame left.
    """

    def __init__(self, device: Device, size: tuple[int, int], depth: ReversedDepth, stage: Stage) -> None:
        ctx = self._ctx = device.ctx
        self.colour = ctx.texture(size, 4, dtype="f1")
        self.normal = ctx.texture(size, 4, dtype="f2")
        self.motion = ctx.texture(size, 2, dtype="f4")
        self.surface = ctx.texture(size, 2, dtype="u4")
        self._textures = (self.colour, self.normal, self.motion, self.surface)
        for texture in self._textures:
            texture.filter = _NEAREST
        self.bindings: Bindings = {}
        """Textures to read and images to write, by their names in shaders."""
        for name, texture in zip(("colour", "normal", "motion", "surface"), self._textures, strict=True):
            self.bindings |= {f"gbuffer_{name}": texture, f"{name}_image": texture}
        self._z = depth.renderbuffer(size)
        self.framebuffer = ctx.framebuffer(self._textures, self._z)
        arguments = ctypes.c_uint, ctypes.c_int, ctypes.c_void_p
        self._clear_float = device.function("glClearBufferfv", None, *arguments)
        self._clear_uint = device.function("glClearBufferuiv", None, *arguments)
        far = np.array(np.inf, np.float32).view(np.uint32)
        self._empty_surface = (ctypes.c_uint * 4)(0, int(far))
        self._z_clear = (ctypes.c_float * 1)(depth.cleared)
        self._clear = Kernel(device, "passes/clear.comp", {}, self.bindings) if stage == "compute" else None

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        size: tuple[int, int] = self.surface.size
        return size

    def clear(self, rastered: bool) -> None:
        """Empty it: sky, infinitely far. Its depth buffer only where something is to be `rastered`."""
        if rastered or not self._clear:
            # moderngl's own clear cannot set targets of different types apart
            self.framebuffer.use()
            self._clear_float(_DEPTH, 0, self._z_clear)
        if self._clear:
            self._clear.run_over(self.size)
            self._ctx.memory_barrier(IMAGES_WRITTEN)
        else:
            self._clear_uint(_COLOUR, _SURFACE, self._empty_surface)

    def read_surface(self) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.uint32], npt.NDArray[np.float32]]:
        """Read back class, number of the blade, and linear depth in metres: (height, width) each, top row first.

        The number is 0 where no blade shows, and the depth inf for sky.
        """
        width, height = self.size
        words = np.frombuffer(self.surface.read(), np.uint32).reshape(height, width, 2)[::-1]
        kinds = (words[..., 0] >> BLADE_NUMBER_BITS).astype(np.uint8)
        return kinds, words[..., 0] & np.uint32((1 << BLADE_NUMBER_BITS) - 1), words[..., 1].copy().view(np.float32)

    def release(self) -> None:
        """Free the GPU memory."""
        if self._clear:
            self._clear.release()
        self.framebuffer.release()
        self._z.release()
        release_all(*self._textures)


class BladePixels:
    """Counts the pixels that show a blade, on the GPU."""

    def __init__(self, device: Device, bindings: Bindings) -> None:
        self._device = device
        self._kernel = Kernel(device, "passes/gbuffer.comp", {}, bindings)
        self._squares = 0
        self._counts = device.ctx.buffer(reserve=WORD)

    def count(self, gbuffer: GBuffer) -> None:
        """Count them as they are now; `read` tells how many."""
        columns, rows = (-(-edge // 8) for edge in gbuffer.size)
        self._squares = columns * rows
        self._counts = at_least(self._device, self._counts, WORD * self._squares)
        self._kernel.run_over((columns, rows), Counts=self._counts)

    def read(self) -> int:
        """Number of them when they were counted last. Waits for the GPU."""
        return int(np.frombuffer(read_back(self._device, self._counts, WORD * self._squares), np.uint32).sum())

    def release(self) -> None:
        """Free the GPU resources."""
        self._kernel.release()
        self._counts.release()
