"""Water: planar reflection, refraction, and its surface in the G-buffer."""

import moderngl

from greensward.gpu.depth import ReversedDepth
from greensward.gpu.device import IMAGES_WRITTEN, Device, Stage
from greensward.gpu.full_screen import FullScreenPass
from greensward.gpu.kernels import Bindings, Draw, Kernel
from greensward.gpu.layouts import BlockBuffer, block
from greensward.gpu.view import View
from greensward.passes.gbuffer import GBuffer
from greensward.passes.lighting import Lighting
from greensward.scene import Scene, Water
from greensward.scene.base import linear

WATER_BLOCK = block(
    "Water",
    ("colour", "vec4"),
    ("level_m", "float"),
    ("clarity_m", "float"),
    ("ripple", "float"),
    ("ripple_m", "float"),
    ("time_s", "float"),
    ("farthest_m", "float"),
    ("reflects", "int"),
)
_FOLDER = "passes/water"


class WaterPass:
    """Draws `[water]` over a lit picture.

    The mirrored scene is drawn by the renderer into `gbuffer`, seen by `mirror`, and lit by `lighting`.
    """

    def __init__(
        self,
        device: Device,
        bindings: Bindings,
        scene: Scene,
        water: Water,
        size: tuple[int, int],
        depth: ReversedDepth,
        stage: Stage,
    ) -> None:
        self._device, self._ctx, self._shared = device, device.ctx, bindings
        self._scene, self._water, self._depth, self._stage = scene, water, depth, stage
        self._block = BlockBuffer(device.ctx, WATER_BLOCK)
        bindings["Water"] = self._block
        self._pass = FullScreenPass(device, f"{_FOLDER}/water.glsl", ["f2", "f4"], stage=stage, bindings=bindings)
        self._surface: Kernel | Draw
        if stage == "compute":
            self._surface = Kernel(device, f"{_FOLDER}/surface.comp", {}, bindings)
        else:
            self._surface = Draw(device, "shaders/screen.vert", f"{_FOLDER}/surface.frag", bindings=bindings)
        names = "level_m", "clarity_m", "ripple", "ripple_m"
        self._block.set(
            colour=(*linear(water.colour), 0.0),
            reflects=int(water.reflections),
            farthest_m=scene.camera.far_m,
            **{name: getattr(water, name) for name in names},
        )
        self.gbuffer: GBuffer | None = None
        """G-buffer of the mirrored scene; None where water mirrors the sky alone."""
        self.lighting: Lighting | None = None
        """Light of the mirrored scene."""
        self._allocate(size)

    def _allocate(self, size: tuple[int, int]) -> None:
        self._radiance = self._ctx.texture(size, 4, dtype="f2")
        self._radiance.repeat_x = self._radiance.repeat_y = False
        self._found = self._ctx.texture(size, 4, dtype="f4")
        if not self._water.reflections:
            return
        scaled = self.mirrored_size(size)
        self.gbuffer = GBuffer(self._device, scaled, self._depth, self._stage)
        if self.lighting:
            self.lighting.resize(scaled)
        else:
            self.lighting = Lighting(self._device, self._shared, self._scene, scaled, self._stage)

    def relight(self, scene: Scene) -> None:
        """Mirror under the sun and the air of another scene from now on."""
        self._scene = scene
        if self.lighting:
            self.lighting.relight(scene)

    def mirrored_size(self, size: tuple[int, int]) -> tuple[int, int]:
        """Pixels of the mirrored picture for a picture of this size."""
        scale = self._water.reflection_scale
        return max(1, round(size[0] * scale)), max(1, round(size[1] * scale))

    def mirror(self, view: View) -> View | None:
        """The view of the mirrored scene. Raises `InputError` for a camera that is not above the water."""
        self._water.refuse_below(float(view.camera_ws[1]))
        return (
            view.mirrored(self._water.level_m, self.mirrored_size(view.size_px)) if self._water.reflections else None
        )

    def cover(
        self, radiance: moderngl.Texture, mirrored: moderngl.Texture | None, gbuffer: GBuffer, time_s: float
    ) -> moderngl.Texture:
        """Put water over a lit picture and into its G-buffer; returns the picture, which stays until the next.

        `mirrored` is the light of the mirrored scene.
        """
        self._block.set(time_s=time_s)
        self._pass.run(
            self._radiance,
            self._found,
            radiance=radiance,
            mirrored=mirrored or radiance,
            mirrored_surface=(self.gbuffer or gbuffer).surface,
        )
        if isinstance(self._surface, Kernel):
            self._surface.run_over(gbuffer.size, found=self._found)
            self._ctx.memory_barrier(IMAGES_WRITTEN)
        else:
            gbuffer.framebuffer.use()
            self._ctx.enable_only(moderngl.NOTHING)
            self._surface.run(moderngl.TRIANGLES, 3, found=self._found)
        return self._radiance

    def resize(self, size: tuple[int, int]) -> None:
        """Cover pictures of another size from now on."""
        self._free()
        self._allocate(size)

    def _free(self) -> None:
        for part in (self._radiance, self._found, self.gbuffer):
            if part:
                part.release()

    def release(self) -> None:
        """Free the GPU resources."""
        self._free()
        for part in (self._pass, self._block, self._surface, self.lighting):
            if part:
                part.release()
