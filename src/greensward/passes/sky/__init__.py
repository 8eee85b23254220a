"""Sky as a table of radiance by direction, and scattering by the air."""

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.device import Device, Stage
from greensward.gpu.full_screen import FullScreenPass
from greensward.gpu.layouts import BlockBuffer

_SIZE = 256, 128


class SkyTable:
    """Radiance of the clear sky for every direction; drawn once per sun and air."""

    def __init__(self, device: Device, light: BlockBuffer, stage: Stage | None = None) -> None:
        self._pass = FullScreenPass(device, "passes/sky/table.glsl", ["f4"], stage=stage, bindings={"Light": light})
        self.texture = device.ctx.texture(_SIZE, 4, dtype="f4")
        self.texture.filter = moderngl.LINEAR, moderngl.LINEAR
        self.texture.repeat_x, self.texture.repeat_y = True, False

    def fill(self) -> npt.NDArray[np.float64]:
        """Draw the table by the light; returns nine spherical-harmonic coefficients of the sky's light, (9, 3)."""
        self._pass.run(self.texture)
        width, height = _SIZE
        table = np.frombuffer(self.texture.read(), np.float32).reshape(height, width, 4)[..., :3]
        v = (np.arange(height) + 0.5) / height * 2.0 - 1.0
        elevation = np.sign(v) * v * v * np.pi / 2.0  # as table.glsl
        azimuth = (np.arange(width) + 0.5) / width * 2.0 * np.pi
        y = np.sin(elevation)[:, None] * np.ones_like(azimuth)
        x = np.cos(elevation)[:, None] * np.cos(azimuth)
        z = np.cos(elevation)[:, None] * np.sin(azimuth)
        solid = (np.cos(elevation) * np.abs(v) * np.pi * (2.0 / height) * (2.0 * np.pi / width))[:, None, None]
        basis = sh_basis(np.stack([x, y, z], -1))
        result: npt.NDArray[np.float64] = np.einsum("hwk,hwc->kc", basis, table * solid)
        return result

    def release(self) -> None:
        """Free the GPU resources."""
        self.texture.release()
        self._pass.release()


def sh_basis(direction: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Real spherical harmonics up to order 2 of unit vectors: (..., 3) to (..., 9) (Ramamoorthi & Hanrahan 2001)."""
    x, y, z = np.moveaxis(direction, -1, 0)
    one = np.ones_like(x)
    return np.stack(
        [
            0.282095 * one,
            0.488603 * y,
            0.488603 * z,
            0.488603 * x,
            1.092548 * x * y,
            1.092548 * y * z,
            0.315392 * (3.0 * z * z - 1.0),
            1.092548 * x * z,
            0.546274 * (x * x - y * y),
        ],
        -1,
    )
