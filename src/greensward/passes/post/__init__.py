"""From radiance to the picture: exposure and tone, averaged over samples, encoded; or into a caller's framebuffer."""

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.pixel_pass import PixelPass, Shell
from greensward.gpu.program import build
from greensward.passes.gbuffer import GBuffer
from greensward.scene import Camera


class Post:
    """Tone mapping, accumulation and encoding. Reads the `Light` block that lighting bound."""

    def __init__(self, ctx: moderngl.Context, size: tuple[int, int], shell: Shell | None, *, averaged: bool) -> None:
        self._ctx = ctx
        defines = {"AVERAGED": int(averaged)}
        self._tone = PixelPass(ctx, "passes/post/tone.glsl", ["f4"], shell=shell, defines=defines)
        self._encode = PixelPass(ctx, "passes/post/encode.glsl", ["f1"], shell=shell)
        program = build(ctx, "shaders/screen.vert", "passes/post/blit.frag")
        self._blit = ctx.vertex_array(program, [])
        self._allocate(size)

    def _allocate(self, size: tuple[int, int]) -> None:
        self._average = [self._ctx.texture(size, 4, dtype="f4") for _ in range(2)]
        self._picture = self._ctx.texture(size, 4, dtype="f1")

    def accumulate(self, radiance: moderngl.Texture, sample: int) -> moderngl.Texture:
        """Tone one sample; the average with those before it, or where samples are not `averaged`, it alone."""
        sofar, target = self._average[(sample + 1) % 2], self._average[sample % 2]
        radiance.use(10)
        sofar.use(11)
        self._tone.run(target)
        return target

    def encode(self, picture: moderngl.Texture) -> None:
        """Write a toned picture as sRGB."""
        picture.use(10)
        self._encode.run(self._picture)

    def read(self) -> npt.NDArray[np.uint8]:
        """The picture, (height, width, 3), top row first."""
        width, height = self._picture.size
        pixels = np.frombuffer(self._picture.read(), np.uint8).reshape(height, width, 4)
        return pixels[::-1, :, :3].copy()

    def blit(self, target: moderngl.Framebuffer, gbuffer: GBuffer, camera: Camera) -> None:
        """Draw the picture into a framebuffer with its depth, behind what is there already."""
        self._picture.use(10)
        gbuffer.depth.use(14)
        near, far = camera.near_m, camera.far_m
        # a depth d along the axis lands at (scale + offset / d) in the caller's 0..1 depth buffer
        self._blit.program["depthScale"] = (0.5 * (far + near) / (far - near) + 0.5, -far * near / (far - near))
        target.use()
        target.depth_mask = True
        self._ctx.enable_only(moderngl.DEPTH_TEST)
        self._ctx.depth_func = "<="
        self._blit.render(moderngl.TRIANGLES, vertices=3)
        self._ctx.depth_func = "<"

    def resize(self, size: tuple[int, int]) -> None:
        """Make pictures of another size from now on."""
        self._free()
        self._allocate(size)

    def _free(self) -> None:
        for texture in (*self._average, self._picture):
            texture.release()

    def release(self) -> None:
        """Free the GPU resources."""
        self._free()
        self._tone.release()
        self._encode.release()
        self._blit.program.release()
        self._blit.release()
