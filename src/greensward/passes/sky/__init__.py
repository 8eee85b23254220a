"""Sky as a table of radiance by direction, its light as a whole, and scattering by the air."""

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import read_back
from greensward.gpu.device import Device, Stage
from greensward.gpu.full_screen import FullScreenPass
from greensward.gpu.kernels import Bindings, Kernel
from greensward.gpu.layouts import BlockBuffer, WrittenBlock, block, struct

_SIZE = 256, 128
_MEMBERS = (
    ("sh", "vec4", 9),  # spherical harmonics of the sky's radiance
    ("mean", "vec4"),  # radiance of a uniform sky that lights level ground alike
    ("exposure", "float"),
)
SKY_LIGHT_BLOCK = block("SkyLight", *_MEMBERS)
HARMONICS = struct("Harmonics", *_MEMBERS)


class Sky:
    """Radiance of the clear sky for every direction, and its light as a whole; drawn once per sun and air."""

    def __init__(self, device: Device, light: BlockBuffer, stage: Stage | None = None) -> None:
        self._device, self._ctx = device, device.ctx
        self._pass = FullScreenPass(device, "passes/sky/table.glsl", ["f4"], stage=stage, bindings={"Light": light})
        self._ambient = Kernel(device, "passes/sky/ambient.comp", {}, {"Light": light})
        self._table = device.ctx.texture(_SIZE, 4, dtype="f4")
        self._table.filter = moderngl.LINEAR, moderngl.LINEAR
        self._table.repeat_x, self._table.repeat_y = True, False
        self._light = WrittenBlock(device.ctx, SKY_LIGHT_BLOCK)
        self.bindings: Bindings = {"sky_table": self._table, "SkyLight": self._light}
        """Table and light, by their names in shaders."""

    def fill(self) -> None:
        """Draw the table by the light, and sum it up, without waiting for either."""
        self._pass.run(self._table)
        self._ambient.run(1, sky_table=self._table, Ambient=self._light.buffer)
        self._ctx.memory_barrier(moderngl.UNIFORM_BARRIER_BIT | moderngl.BUFFER_UPDATE_BARRIER_BIT)

    def read(self) -> np.void:
        """Read back the light of the sky, by the names of its members. Waits for the GPU."""
        values: np.void = np.frombuffer(read_back(self._device, self._light.buffer), SKY_LIGHT_BLOCK.dtype)[0]
        return values

    def release(self) -> None:
        """Free the GPU resources."""
        self._table.release()
        self._light.release()
        self._ambient.release()
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


def irradiance(harmonics: npt.NDArray[np.float64], normals: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Irradiance (n, 3) by a sky, (9, 3), on surfaces with these normals, (n, 3) (equation 7 there)."""
    bands = np.array([np.pi, *[2.0 * np.pi / 3.0] * 3, *[np.pi / 4.0] * 5])
    result: npt.NDArray[np.float64] = np.maximum((bands * sh_basis(normals)) @ harmonics, 0.0)
    return result
