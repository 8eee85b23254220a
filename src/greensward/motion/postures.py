"""Postures: all of a blade's motion that a frame needs, computed once and shared by every view and sample."""

from typing import get_args

import moderngl

from greensward.culling import Span
from greensward.gpu.blocks import BlockBuffer, declare
from greensward.gpu.program import build_compute, put
from greensward.motion.force_map import absent_forces
from greensward.motion.winds import absent_kinds
from greensward.scene import Scene, Simulation
from greensward.sowing import Page

MOTION_BLOCK = declare(
    "Motion",
    7,
    ("centre", "vec4"),  # of gravity; how much of it pulls there rather than down
    ("gravity_mps2", "float"),
    ("forward", "float"),
    ("recovery_hz", "float"),
    ("rise_s", "float"),
    ("step_s", "float"),
    ("within_m", "float"),
    ("form", "int"),
)
FORMS: tuple[str, ...] = get_args(Simulation.model_fields["form"].annotation)


def motion_values(settings: Simulation | None) -> dict[str, object]:
    """Members of the `Motion` block."""
    settings = settings or Simulation()
    kept = ("gravity_mps2", "forward", "recovery_hz", "rise_s", "step_s", "within_m")
    centre = settings.gravity_centre_m
    return {
        **{name: getattr(settings, name) for name in kept},
        "centre": (*centre, settings.gravity_towards) if centre else (0.0, 0.0, 0.0, 0.0),
        "form": FORMS.index(settings.form),
    }


def motion_defines(scene: Scene) -> dict[str, object]:
    """What to define for shaders of motion, so that they hold what the scene needs and no more."""
    form = scene.simulation.form if scene.simulation else FORMS[0]
    return {"FORM": FORMS.index(form), **absent_kinds(scene.wind), **absent_forces(scene)}


class Postures:
    """The closed-form motion of the field in the scene's winds, which must be bound."""

    def __init__(self, ctx: moderngl.Context, scene: Scene) -> None:
        self._ctx = ctx
        self._block = BlockBuffer(ctx, MOTION_BLOCK)
        self._block.set(**motion_values(scene.simulation))  # type: ignore[arg-type]
        self._shader = build_compute(ctx, "motion/postures.comp", motion_defines(scene))

    def bind(self) -> None:
        """Bind what every shader of motion reads besides the winds."""
        self._block.bind()

    def take(self, page: Page, span: Span, time_s: float, previous_time_s: float) -> None:
        """Write the postures of these chunks of a page at two instants. The chunk table is bound to 2."""
        if not span.count:
            return
        page.blades.bind_to_storage_buffer(0)
        page.postures.bind_to_storage_buffer(1)
        put(
            self._shader,
            firstChunk=span.first,
            chunkCount=span.count,
            timeNow=time_s,
            timePrevious=previous_time_s,
        )
        self._shader.run(*span.groups)
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def release(self) -> None:
        """Free the GPU resources."""
        self._block.release()
        self._shader.release()
