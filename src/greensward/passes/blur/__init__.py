"""Separable blur that grows with distance, against the noise of far grass."""

import moderngl

from greensward.gpu.buffers import release_all
from greensward.gpu.device import Device, Stage
from greensward.gpu.full_screen import FullScreenPass
from greensward.gpu.kernels import Bindings


class Blur:
    """Blurs lit pictures by their depth, rows and then columns."""

    def __init__(self, device: Device, bindings: Bindings, size: tuple[int, int], stage: Stage) -> None:
        self._ctx = device.ctx
        self._passes = [
            FullScreenPass(
                device, "passes/blur/blur.glsl", ["f4"], stage=stage, defines={"ALONG": along}, bindings=bindings
            )
            for along in ("1, 0", "0, 1")
        ]
        self._allocate(size)

    def _allocate(self, size: tuple[int, int]) -> None:
        self._targets = [self._ctx.texture(size, 4, dtype="f4") for _ in self._passes]
        for texture in self._targets:
            texture.repeat_x = texture.repeat_y = False

    def run(self, radiance: moderngl.Texture) -> moderngl.Texture:
        """Blur a picture; the result stays until the next."""
        for step, target in zip(self._passes, self._targets, strict=True):
            step.run(target, radiance=radiance)
            radiance = target
        return radiance

    def resize(self, size: tuple[int, int]) -> None:
        """Blur pictures of another size from now on."""
        self._free()
        self._allocate(size)

    def _free(self) -> None:
        release_all(*self._targets)

    def release(self) -> None:
        """Free the GPU resources."""
        self._free()
        release_all(*self._passes)
