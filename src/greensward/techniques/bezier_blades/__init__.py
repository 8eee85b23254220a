"""Quadratic Bézier blades as tessellated quads."""

from typing import ClassVar

import moderngl
from pydantic import BaseModel, Field

from greensward.gpu.blocks import BlockBuffer, declare
from greensward.gpu.program import build
from greensward.gpu.view import View
from greensward.scene.base import Count, Model, Number
from greensward.world import BLADES, CHUNKS, POSTURES, Instant, World

_FOLDER = "techniques/bezier_blades"
_PATCHES = 32  # per instance: one draw of N patches is five times slower on llvmpipe

BLADES_BLOCK = declare(
    "BezierBlades", 4, ("error_px", "float"), ("max_level", "float"), ("min_width_px", "float"), ("roundness", "float")
)


class Settings(Model):
    """How finely blades are cut, and how thin they may become."""

    error_px: Number = Field(0.3, gt=0, le=100)
    """A blade gets as many segments as keep it this close to its true curve on the screen."""
    max_level: Count = Field(12, ge=1, le=64)
    """Never more segments than this."""
    min_width_px: Number = Field(1.0, ge=0, le=16)
    """Blades are widened to this, so that they neither break up nor vanish edge-on."""
    roundness: Number = Field(0.55, ge=0, le=1)
    """How far the shading normal turns across a blade: 0 is flat."""


class BezierBlades:
    """One patch per blade: culled, levelled and widened in the control stage, curved in the evaluation stage."""

    name: ClassVar[str] = "bezier-blades"
    source: ClassVar[str] = (
        "Jahrmann & Wimmer 2017, Responsive Real-Time Grass Rendering for General 3D Scenes; "
        "Yan, Wu & Wang 2024, Enhanced Real-Time Grass Rendering"
    )
    Settings: ClassVar[type[BaseModel]] = Settings

    def __init__(self, ctx: moderngl.Context, world: World, settings: BaseModel) -> None:
        assert isinstance(settings, Settings)
        self._ctx, self._world = ctx, world
        self._block = BlockBuffer(ctx, BLADES_BLOCK)
        self._block.set(**settings.model_dump())
        stages = [f"{_FOLDER}/blade.{stage}" for stage in ("vert", "tesc", "tese", "frag")]
        self._arrays = {
            "picture": ctx.vertex_array(build(ctx, *stages), []),
            "shadow": ctx.vertex_array(build(ctx, *stages, defines={"SHADOW": 1}), []),
        }

    def update(self, instant: Instant) -> None:
        """Nothing to do: postures are taken by the world."""

    def draw(self, view: View) -> None:
        """Draw every blade that the view may show."""
        self._block.bind()
        self._ctx.patch_vertices = 1
        array = self._arrays[view.purpose]
        program = array.program
        for page, chunks in self._world.chunks(view):
            page.blades.bind_to_storage_buffer(BLADES)
            page.postures.bind_to_storage_buffer(POSTURES)
            chunks.bind(CHUNKS)
            if "firstId" in program:
                program["firstId"] = page.first_id
            array.render(moderngl.PATCHES, vertices=_PATCHES, instances=chunks.count)

    def release(self) -> None:
        """Free programs and blocks."""
        self._block.release()
        for array in self._arrays.values():
            array.program.release()
            array.release()
