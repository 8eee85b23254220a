"""Quadratic Bézier blades as tessellated quads."""

from typing import ClassVar

import moderngl
from pydantic import BaseModel, Field

from greensward.culling import CHUNK
from greensward.gpu.blocks import BlockBuffer, declare
from greensward.gpu.program import build, build_compute
from greensward.gpu.view import View
from greensward.scene.base import Count, Model, Number
from greensward.world import BLADES, CHUNKS, POSTURES, RECORDS, Instant, Seen, World

_FOLDER = "techniques/bezier_blades"
_RECORD_BYTES = 72

BLADES_BLOCK = declare(
    "BezierBlades",
    4,
    ("error_px", "float"),
    ("max_level", "float"),
    ("min_width_px", "float"),
    ("roundness", "float"),
)


class Settings(Model):
    """How finely blades are cut, and how thin they may become."""

    error_px: Number = Field(0.7, gt=0, le=100)
    """A blade gets as many segments as keep it this close to its true curve on the screen."""
    max_level: Count = Field(12, ge=1, le=64)
    """Never more segments than this."""
    min_width_px: Number = Field(1.0, ge=0, le=16)
    """Blades are widened to this, so that they neither break up nor vanish edge-on."""
    roundness: Number = Field(0.55, ge=0, le=1)
    """How far the shading normal turns across a blade: 0 is flat."""


class BezierBlades:
    """One patch per blade: culled, levelled and widened in a compute stage, curved in the evaluation stage."""

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
        self._prepare = {
            "picture": build_compute(ctx, f"{_FOLDER}/prepare.comp"),
            "shadow": build_compute(ctx, f"{_FOLDER}/prepare.comp", {"SHADOW": 1}),
        }
        stages = [f"{_FOLDER}/blade.{stage}" for stage in ("vert", "tesc", "tese", "frag")]
        self._arrays = {
            "picture": ctx.vertex_array(build(ctx, *stages), []),
            "shadow": ctx.vertex_array(build(ctx, *stages, defines={"SHADOW": 1}), []),
        }
        self._records = ctx.buffer(reserve=_RECORD_BYTES)
        self._prepared: dict[View, list[tuple[Seen, int]]] = {}

    def update(self, instant: Instant) -> None:
        """Make room for a record of every blade that some view may show; `draw` fills it once per view."""
        self._prepared.clear()
        slots = sum(seen.blades.count for view in instant.views for seen in self._world.seen(view)) * CHUNK
        if self._records.size < slots * _RECORD_BYTES:
            self._records.release()
            self._records = self._ctx.buffer(reserve=slots * _RECORD_BYTES * 5 // 4)
        self._used = 0

    def draw(self, view: View) -> None:
        """Draw every blade that the view may show."""
        if view not in self._prepared:
            self._prepared[view] = [self._fill(seen, view) for seen in self._world.seen(view)]
        self._block.bind()
        self._ctx.patch_vertices = 1
        array = self._arrays[view.purpose]
        for seen, offset in self._prepared[view]:
            self._bind_records(seen, offset)
            if "firstId" in array.program:
                array.program["firstId"] = seen.page.first_id
            array.render(moderngl.PATCHES, vertices=CHUNK, instances=seen.blades.count)

    def _fill(self, seen: Seen, view: View) -> tuple[Seen, int]:
        """Decide about every blade in a compute shader, which runs on all cores; the stages only look up."""
        offset, blades = self._used, seen.blades
        self._used += blades.count * CHUNK * _RECORD_BYTES
        self._block.bind()
        seen.page.blades.bind_to_storage_buffer(BLADES)
        seen.page.postures.bind_to_storage_buffer(POSTURES)
        self._world.chunks.bind(CHUNKS)
        self._bind_records(seen, offset)
        shader = self._prepare[view.purpose]
        shader["firstChunk"] = blades.first
        shader["chunkCount"] = blades.count
        shader.run(*blades.groups)
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)
        return seen, offset

    def _bind_records(self, seen: Seen, offset: int) -> None:
        size = seen.blades.count * CHUNK * _RECORD_BYTES
        self._records.bind_to_storage_buffer(RECORDS, offset=offset, size=size)

    def release(self) -> None:
        """Free programs, blocks and records."""
        self._block.release()
        self._records.release()
        for shader in self._prepare.values():
            shader.release()
        for array in self._arrays.values():
            array.program.release()
            array.release()
