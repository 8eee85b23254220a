"""A blur that grows with distance, against the noise of far grass."""

import moderngl

from greensward.gpu.pixel_pass import PixelPass, Shell
from greensward.passes.gbuffer import GBuffer


class Blur:
    """Blurs lit pictures by their depth, rows and then columns. Reads the `Light` block that lighting bound."""

    def __init__(self, ctx: moderngl.Context, size: tuple[int, int], shell: Shell) -> None:
        self._ctx = ctx
        self._passes = [
            PixelPass(ctx, "passes/blur/blur.glsl", ["f4"], shell=shell, defines={"ALONG": along})
            for along in ("1, 0", "0, 1")
        ]
        self._allocate(size)

    def _allocate(self, size: tuple[int, int]) -> None:
        self._targets = [self._ctx.texture(size, 4, dtype="f4") for _ in self._passes]
        for texture in self._targets:
            texture.repeat_x = texture.repeat_y = False

    def run(self, radiance: moderngl.Texture, gbuffer: GBuffer) -> moderngl.Texture:
        """The blurred picture; it is kept until the next."""
        gbuffer.depth.use(14)
        for step, target in zip(self._passes, self._targets, strict=True):
            radiance.use(10)
            step.run(target)
            radiance = target
        return radiance

    def resize(self, size: tuple[int, int]) -> None:
        """Blur pictures of another size from now on."""
        self._free()
        self._allocate(size)

    def _free(self) -> None:
        for texture in self._targets:
            texture.release()

    def release(self) -> None:
        """Free the GPU resources."""
        self._free()
        for step in self._passes:
            step.release()
