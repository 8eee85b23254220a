"""Postures of all blades that a frame needs, computed once and shared by every view and sample."""

import moderngl

from greensward.culling import Span
from greensward.gpu.blocks import BlockBuffer
from greensward.gpu.program import build_compute
from greensward.motion.winds import WINDS_BLOCK, wind_values
from greensward.scene import Scene
from greensward.sowing import Page


class Postures:
    """The closed-form motion of the field in the scene's winds."""

    def __init__(self, ctx: moderngl.Context, scene: Scene) -> None:
        self._ctx = ctx
        self._block = BlockBuffer(ctx, WINDS_BLOCK)
        self._block.set(**wind_values(scene.wind, scene.seed))  # type: ignore[arg-type]
        self._shader = build_compute(ctx, "motion/postures.comp")

    def take(self, page: Page, span: Span, time_s: float, previous_time_s: float) -> None:
        """Write the postures of these chunks of a page at two instants. The chunk table is bound to 2."""
        if not span.count:
            return
        self._block.bind()
        page.blades.bind_to_storage_buffer(0)
        page.postures.bind_to_storage_buffer(1)
        self._shader["firstChunk"] = span.first
        self._shader["chunkCount"] = span.count
        self._shader["timeNow"] = time_s
        self._shader["timePrevious"] = previous_time_s
        self._shader.run(*span.groups)
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def release(self) -> None:
        """Free the GPU resources."""
        self._block.release()
        self._shader.release()
