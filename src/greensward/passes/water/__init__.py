"""Water: what it mirrors, what shows through it, and its surface in the G-buffer."""

import moderngl

from greensward.gpu.blocks import BlockBuffer, declare
from greensward.gpu.depth import ReversedDepth
from greensward.gpu.pixel_pass import IMAGES_WRITTEN, PixelPass, Shell, pixel_groups
from greensward.gpu.program import build, build_compute
from greensward.gpu.view import View
from greensward.passes.gbuffer import GBuffer
from greensward.passes.lighting import Lighting
from greensward.scene import InputError, Scene, Water
from greensward.scene.base import linear

WATER_BLOCK = declare(
    "Water",
    11,
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
_MIRRORED, _MIRRORED_DEPTH, _RADIANCE = 17, 18, 19


class WaterPass:
    """Draws `[water]` over a lit picture.

    The mirrored scene is drawn by the renderer into `gbuffer`, seen by `mirror`, and lit by `lighting`.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        scene: Scene,
        water: Water,
        size: tuple[int, int],
        depth: ReversedDepth,
        shell: Shell,
    ) -> None:
        self._ctx, self._scene, self._water, self._depth, self._shell = ctx, scene, water, depth, shell
        self._pass = PixelPass(ctx, f"{_FOLDER}/water.glsl", ["f2", "f4"], shell=shell)
        self._compute: moderngl.ComputeShader | None = None
        self._triangle: moderngl.VertexArray | None = None
        if shell == "compute":
            self._compute = build_compute(ctx, f"{_FOLDER}/surface.comp")
        else:
            program = build(ctx, "shaders/screen.vert", f"{_FOLDER}/surface.frag")
            self._triangle = ctx.vertex_array(program, [])
        self._block = BlockBuffer(ctx, WATER_BLOCK)
        names = "level_m", "clarity_m", "ripple", "ripple_m"
        self._block.set(
            colour=(*linear(water.colour), 0.0),
            reflects=int(water.reflections),
            farthest_m=scene.camera.far_m,
            **{name: getattr(water, name) for name in names},
        )
        self.gbuffer: GBuffer | None = None
        """Of the mirrored scene; None where water mirrors the sky alone."""
        self.lighting: Lighting | None = None
        """And its light."""
        self._allocate(size)

    def _allocate(self, size: tuple[int, int]) -> None:
        self._radiance = self._ctx.texture(size, 4, dtype="f2")
        self._radiance.repeat_x = self._radiance.repeat_y = False
        self._found = self._ctx.texture(size, 4, dtype="f4")
        if not self._water.reflections:
            return
        scaled = self.mirrored_size(size)
        self.gbuffer = GBuffer(self._ctx, scaled, self._depth, self._shell)
        if self.lighting:
            self.lighting.resize(scaled)
        else:
            self.lighting = Lighting(self._ctx, self._scene, scaled, self._shell)

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
        level = self._water.level_m
        if view.camera_ws[1] <= level:
            raise InputError(
                f"camera.position_m: must be above the water, whose level is {level:g} m "
                f"(got {view.camera_ws[1]:.2f} m); raise y or lower water.level_m"
            )
        return view.mirrored(level, self.mirrored_size(view.size_px)) if self._water.reflections else None

    def cover(
        self, radiance: moderngl.Texture, mirrored: moderngl.Texture | None, gbuffer: GBuffer, time_s: float
    ) -> moderngl.Texture:
        """Put water over a lit picture and into its G-buffer; returns the picture, which is kept until the next.

        `mirrored` is the light of the mirrored scene. The block of the view and that of the light must be bound.
        """
        self._block.set(time_s=time_s)
        self._block.bind()
        radiance.use(_RADIANCE)
        (mirrored or radiance).use(_MIRRORED)
        (self.gbuffer or gbuffer).depth.use(_MIRRORED_DEPTH)
        gbuffer.bind()
        self._pass.run(self._radiance, self._found)
        self._found.use(_MIRRORED)
        if self._compute:
            gbuffer.bind_images()
            self._compute.run(*pixel_groups(gbuffer.id.size))
            self._ctx.memory_barrier(IMAGES_WRITTEN)
        elif self._triangle:
            gbuffer.framebuffer.use()
            self._ctx.enable_only(moderngl.NOTHING)
            self._triangle.render(moderngl.TRIANGLES, vertices=3)
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
        for part in (self._pass, self._block, self._compute, self.lighting):
            if part:
                part.release()
        if self._triangle:
            self._triangle.program.release()
            self._triangle.release()
