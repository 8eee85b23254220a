"""Bloom: bright pixels spread over the picture, as in a lens."""

import moderngl

from greensward.gpu.buffers import release_all
from greensward.gpu.device import Device, Stage
from greensward.gpu.full_screen import FullScreenPass
from greensward.gpu.kernels import Bindings

_PATH = "passes/bloom/bloom.glsl"
_BLOCK = 4
"""Pixels of the picture along an edge of a texel that is spread."""
_LEAST_SIGMA_PX = 0.5


class Bloom:
    """Adds the bloom of lit pictures; it is spread at a quarter of their resolution."""

    def __init__(
        self, device: Device, bindings: Bindings, size: tuple[int, int], size_part: float, stage: Stage
    ) -> None:
        self._ctx, self._size_part = device.ctx, size_part

        def step(name: str, dtype: str, along: str = "0, 0") -> FullScreenPass:
            defines = {name: 1, "BLOCK": _BLOCK, "ALONG": along}
            return FullScreenPass(device, _PATH, [dtype], stage=stage, defines=defines, bindings=bindings)

        self._bright, self._add = step("BRIGHT", "f2"), step("ADD", "f2")
        self._spread = [step("SPREAD", "f2", along) for along in ("1, 0", "0, 1")]
        self._allocate(size)

    def _allocate(self, size: tuple[int, int]) -> None:
        few = -(-size[0] // _BLOCK), -(-size[1] // _BLOCK)
        self._small = [self._ctx.texture(few, 4, dtype="f2") for _ in range(2)]
        self._result = self._ctx.texture(size, 4, dtype="f2")
        for texture in (*self._small, self._result):
            texture.repeat_x = texture.repeat_y = False
        self._sigma_px = max(self._size_part * size[1] / _BLOCK, _LEAST_SIGMA_PX)

    def run(self, radiance: moderngl.Texture) -> moderngl.Texture:
        """Return a picture with its bloom; it stays until the next."""
        first, second = self._small
        self._bright.run(first, radiance=radiance)
        self._spread[0].run(second, radiance=first, sigma_px=self._sigma_px)
        self._spread[1].run(first, radiance=second, sigma_px=self._sigma_px)
        self._add.run(self._result, radiance=radiance, spread=first)
        return self._result

    def resize(self, size: tuple[int, int]) -> None:
        """Take pictures of another size from now on."""
        self._free()
        self._allocate(size)

    def _free(self) -> None:
        release_all(*self._small, self._result)

    def release(self) -> None:
        """Free the GPU resources."""
        self._free()
        release_all(self._bright, self._add, *self._spread)
