"""The G-buffer: what is seen at each pixel, unlit, in formats that raster and compute can both write."""

import ctypes

import moderngl
import numpy as np

from greensward.culling import at_least
from greensward.gpu.context import gl_function
from greensward.gpu.depth import ReversedDepth
from greensward.gpu.pixel_pass import IMAGES_WRITTEN, Shell, pixel_groups
from greensward.gpu.program import build_compute

FIRST_UNIT = 10
_COLOUR, _DEPTH = 0x1800, 0x1801
_ID, _LINEAR_DEPTH = 3, 4


class GBuffer:
    """Colour and transmittance, normal, occlusion and roughness, motion, class and id, linear depth.

    Where the class is sky, the first three hold what an earlier frame left.
    """

    def __init__(self, ctx: moderngl.Context, size: tuple[int, int], depth: ReversedDepth, shell: Shell) -> None:
        self._ctx = ctx
        self.colour = ctx.texture(size, 4, dtype="f1")
        self.normal = ctx.texture(size, 4, dtype="f2")
        self.motion = ctx.texture(size, 2, dtype="f4")
        self.id = ctx.texture(size, 1, dtype="u4")
        self.depth = ctx.texture(size, 1, dtype="f4")
        self._textures = (self.colour, self.normal, self.motion, self.id, self.depth)
        for texture in self._textures:
            texture.filter = moderngl.NEAREST, moderngl.NEAREST
        self._z = depth.renderbuffer(size)
        self.framebuffer = ctx.framebuffer(self._textures, self._z)
        arguments = ctypes.c_uint, ctypes.c_int, ctypes.c_void_p
        self._clear_float = gl_function(ctx, "glClearBufferfv", None, *arguments)
        self._clear_uint = gl_function(ctx, "glClearBufferuiv", None, *arguments)
        self._sky = (ctypes.c_uint * 4)()
        self._far = (ctypes.c_float * 4)(float("inf"))
        self._z_clear = (ctypes.c_float * 1)(depth.cleared)
        self._empty = build_compute(ctx, "passes/clear.comp") if shell == "compute" else None

    def clear(self, rastered: bool) -> None:
        """Empty it: sky, infinitely far. Its depth buffer only where something is to be `rastered`."""
        if rastered or not self._empty:
            # moderngl's own clear cannot set targets of different types apart
            self.framebuffer.use()
            self._clear_float(_DEPTH, 0, self._z_clear)
        if self._empty:
            self.bind_images()
            self._empty.run(*pixel_groups(self.id.size))
            self._ctx.memory_barrier(IMAGES_WRITTEN)
        else:
            self._clear_uint(_COLOUR, _ID, self._sky)
            self._clear_float(_COLOUR, _LINEAR_DEPTH, self._far)

    def bind(self) -> None:
        """Bind for reading at texture units 10 to 14."""
        for unit, texture in enumerate(self._textures, start=FIRST_UNIT):
            texture.use(unit)

    def bind_images(self) -> None:
        """Bind for writing at image units 0 to 4, as shaders/emit.glsl wants it in compute shaders."""
        for unit, texture in enumerate(self._textures):
            texture.bind_to_image(unit, read=False, write=True)

    def release(self) -> None:
        """Free the GPU memory."""
        if self._empty:
            self._empty.release()
        self.framebuffer.release()
        self._z.release()
        for texture in self._textures:
            texture.release()


class BladePixels:
    """Counts the pixels that show a blade, on the GPU."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._shader = build_compute(ctx, "passes/gbuffer.comp", {"TARGETS": 1})
        self._squares = 0
        self._counts = ctx.buffer(reserve=4)

    def count(self, gbuffer: GBuffer) -> None:
        """Count them as they are now; `read` tells how many."""
        columns, rows = pixel_groups(gbuffer.id.size)
        self._squares = columns * rows
        self._counts = at_least(self._ctx, self._counts, 4 * self._squares)
        self._counts.bind_to_storage_buffer(0)
        gbuffer.id.use(FIRST_UNIT + _ID)
        self._shader.run(*pixel_groups((columns, rows)))

    def read(self) -> int:
        """How many there were when they were counted last. Waits for the GPU."""
        self._ctx.memory_barrier(moderngl.BUFFER_UPDATE_BARRIER_BIT)
        return int(np.frombuffer(self._counts.read(4 * self._squares), np.uint32).sum())

    def release(self) -> None:
        """Free the GPU resources."""
        self._shader.release()
        self._counts.release()
