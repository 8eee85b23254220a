"""Tone mapping: from radiance to the picture, averaged over samples and encoded, or into a host's framebuffer."""

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import release_all
from greensward.gpu.device import Device, Stage
from greensward.gpu.full_screen import FullScreenPass
from greensward.gpu.kernels import Bindings, Draw
from greensward.scene import Camera


class Post:
    """Tone mapping, accumulation and encoding."""

    def __init__(
        self, device: Device, bindings: Bindings, size: tuple[int, int], stage: Stage | None, *, averaged: bool
    ) -> None:
        self._ctx = device.ctx
        defines = {"AVERAGED": int(averaged)}
        self._tone = FullScreenPass(
            device, "passes/post/tone.glsl", ["f4"], stage=stage, defines=defines, bindings=bindings
        )
        self._encode = FullScreenPass(device, "passes/post/encode.glsl", ["f1"], stage=stage)
        self._blit = Draw(device, "shaders/screen.vert", "passes/post/blit.frag", bindings=bindings)
        self._allocate(size)

    def _allocate(self, size: tuple[int, int]) -> None:
        self._average = [self._ctx.texture(size, 4, dtype="f4") for _ in range(2)]
        self._picture = self._ctx.texture(size, 4, dtype="f1")

    def accumulate(self, radiance: moderngl.Texture, sample: int) -> moderngl.Texture:
        """Tone one sample; returns the average with those before it, or it alone if samples are not `averaged`."""
        average, target = self._average[(sample + 1) % 2], self._average[sample % 2]
        self._tone.run(target, radiance=radiance, average=average)
        return target

    def encode(self, picture: moderngl.Texture) -> None:
        """Write a toned picture as sRGB."""
        self._encode.run(self._picture, picture=picture)

    def read(self) -> npt.NDArray[np.uint8]:
        """Read back the picture, (height, width, 3), top row first."""
        width, height = self._picture.size
        pixels = np.frombuffer(self._picture.read(), np.uint8).reshape(height, width, 4)
        return pixels[::-1, :, :3].copy()

    def blit(self, target: moderngl.Framebuffer, camera: Camera) -> None:
        """Draw the picture into a framebuffer with its depth, behind what that holds already."""
        near, far = camera.near_m, camera.far_m
        # a depth d along the axis lands at (scale + offset / d) in the host's 0..1 depth buffer
        depth_scale = (0.5 * (far + near) / (far - near) + 0.5, -far * near / (far - near))
        target.use()
        target.depth_mask = True
        self._ctx.enable_only(moderngl.DEPTH_TEST)
        self._ctx.depth_func = "<="
        self._blit.run(moderngl.TRIANGLES, 3, picture=self._picture, depth_scale=depth_scale)
        self._ctx.depth_func = "<"

    def resize(self, size: tuple[int, int]) -> None:
        """Make pictures of another size from now on."""
        self._free()
        self._allocate(size)

    def _free(self) -> None:
        release_all(*self._average, self._picture)

    def release(self) -> None:
        """Free the GPU resources."""
        self._free()
        self._tone.release()
        self._encode.release()
        self._blit.release()
