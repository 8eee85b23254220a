"""Deferred lighting: light for every pixel of the G-buffer, once, the same for every technique."""

from collections.abc import Sequence

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import release_all
from greensward.gpu.device import Device, Stage
from greensward.gpu.full_screen import FullScreenPass
from greensward.gpu.kernels import Bindings
from greensward.gpu.layouts import BlockBuffer
from greensward.gpu.view import View
from greensward.passes.gbuffer import GBuffer
from greensward.passes.light import LIGHT_BLOCK, light_values
from greensward.passes.shadows import ShadowMaps, shadow_from_world
from greensward.passes.sky import Sky
from greensward.scene import Scene
from greensward.sowing import sward_defines


class Lighting:
    """Sun, sky, shadows and air over a G-buffer, into linear radiance."""

    def __init__(
        self, device: Device, bindings: Bindings, scene: Scene, size: tuple[int, int], stage: Stage | None
    ) -> None:
        self._ctx = device.ctx
        defines = {"PHONG": 1, **sward_defines(scene)} if scene.phong else {}
        self._pass = FullScreenPass(
            device, "passes/lighting/lighting.glsl", ["f2"], stage=stage, defines=defines, bindings=bindings
        )
        self._block = BlockBuffer(device.ctx, LIGHT_BLOCK)
        self._sky = Sky(device, self._block, stage)
        self._bindings: Bindings = {"Light": self._block, **self._sky.bindings}
        """Light and sky, by their names in shaders; what the frame shares when this picture is lit."""
        self._shared = bindings
        self.relight(scene)
        self._allocate(size)
        self._shadow_views: Sequence[View] | None = None

    def relight(self, scene: Scene) -> None:
        """Take the sun, the air, the exposure and the numbers of the reflection model of a scene from now on."""
        self._block.set(**light_values(scene))  # type: ignore[arg-type]
        self._sky.fill()

    def sky_light(self) -> np.void:
        """Read back the light of the sky: `sh`, `mean` and `exposure`. Waits for the GPU."""
        return self._sky.read()

    def shade(
        self,
        gbuffer: GBuffer,
        shadows: ShadowMaps,
        shadow_views: Sequence[View],
        sample: int,
        clouds_at: npt.NDArray[np.float64],
    ) -> moderngl.Texture:
        """Light every pixel: radiance, RGBA half floats. Passes after it share its light and sky.

        `clouds_at` is `cloud_origin` of the camera.
        """
        if shadow_views is not self._shadow_views:
            self._shadow_views = shadow_views
            matrices, texels = np.tile(np.eye(4), (4, 1, 1)), np.ones(4)
            for i, shadow_view in enumerate(shadow_views):
                matrices[i], texels[i] = shadow_from_world(shadow_view), shadow_view.pixel_m[1]
            self._block.set(shadow_from_world=matrices, shadow_texel_m=texels, cascades=len(shadow_views))
        self._block.set(sample_index=sample, cloud_origin=clouds_at)
        self._shared.update({**gbuffer.bindings, **shadows.bindings, **self._bindings})
        self._pass.run(self._radiance)
        return self._radiance

    def resize(self, size: tuple[int, int]) -> None:
        """Light pictures of another size from now on."""
        self._radiance.release()
        self._allocate(size)

    def _allocate(self, size: tuple[int, int]) -> None:
        self._radiance = self._ctx.texture(size, 4, dtype="f2")
        self._radiance.repeat_x = self._radiance.repeat_y = False

    def release(self) -> None:
        """Free the GPU resources."""
        release_all(self._pass, self._sky, self._block, self._radiance)
