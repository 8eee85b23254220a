"""The G-buffer: what is seen at each pixel, unlit, in formats that raster and compute can both write."""

import moderngl

from greensward.gpu.depth import ReversedDepth

FIRST_UNIT = 10
CLEAR_DEPTH = float("inf")


class GBuffer:
    """Colour and transmittance, normal, occlusion and roughness, motion, class and id, linear depth."""

    def __init__(self, ctx: moderngl.Context, size: tuple[int, int], depth: ReversedDepth) -> None:
        self._cleared = depth.cleared
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
        # one clear value cannot mean black, no blade and infinitely far at once
        self._depth_only = ctx.framebuffer([self.depth])

    def clear(self) -> None:
        """Empty it: sky, infinitely far."""
        self.framebuffer.clear(depth=self._cleared)
        self._depth_only.clear(CLEAR_DEPTH)

    def bind(self) -> None:
        """Bind for reading at texture units 10 to 14."""
        for unit, texture in enumerate(self._textures, start=FIRST_UNIT):
            texture.use(unit)

    @property
    def nbytes(self) -> int:
        """GPU memory in bytes."""
        return self.colour.width * self.colour.height * (4 + 8 + 8 + 4 + 4 + 4)

    def release(self) -> None:
        """Free the GPU memory."""
        self.framebuffer.release()
        self._depth_only.release()
        self._z.release()
        for texture in self._textures:
            texture.release()
