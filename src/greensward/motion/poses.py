"""Poses: the bent control points of blades, computed once a frame and shared by every view and sample."""

from collections.abc import Mapping
from typing import get_args

import numpy as np
import numpy.typing as npt

from greensward.culling import ChunkRange, ChunkTable
from greensward.gpu.device import STORAGE_WRITTEN, Device
from greensward.gpu.kernels import Bindings, Kernel, Resource
from greensward.gpu.layouts import BlockBuffer, block
from greensward.motion.force_map import absent_forces
from greensward.motion.winds import absent_kinds
from greensward.scene import Scene, Simulation
from greensward.sowing import Page

MOTION_BLOCK = block(
    "Motion",
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


def motion_values(settings: Simulation | None, anchor_ws: npt.ArrayLike = (0.0, 0.0, 0.0)) -> dict[str, object]:
    """Members of the `Motion` block; the centre of gravity is counted from the anchor, (3,)."""
    settings = settings or Simulation()
    names = ("gravity_mps2", "forward", "recovery_hz", "rise_s", "step_s", "within_m")
    centre = settings.gravity_centre_m
    return {
        **{name: getattr(settings, name) for name in names},
        "centre": (*np.subtract(centre, anchor_ws), settings.gravity_towards) if centre else (0.0, 0.0, 0.0, 0.0),
        "form": FORMS.index(settings.form),
    }


def motion_defines(scene: Scene) -> dict[str, object]:
    """Defines of shaders of motion, so that they hold what the scene needs and no more."""
    form = scene.simulation.form if scene.simulation else FORMS[0]
    return {"FORM": FORMS.index(form), **absent_kinds(scene.wind), **absent_forces(scene)}


class Poses:
    """Analytic motion of the field in the scene's winds."""

    def __init__(self, device: Device, scene: Scene, bindings: Mapping[str, Resource]) -> None:
        self._ctx, self._settings = device.ctx, scene.simulation
        self._block = BlockBuffer(device.ctx, MOTION_BLOCK)
        self._block.set(**motion_values(scene.simulation))  # type: ignore[arg-type]
        self.bindings: Bindings = {"Motion": self._block}
        """Block that every shader of motion reads besides the winds."""
        self._kernel = Kernel(device, "motion/poses.comp", motion_defines(scene), bindings)

    def count_from(self, anchor_ws: npt.NDArray[np.float64]) -> None:
        """Count points of the world from an anchor, (3,)."""
        self._block.set(**motion_values(self._settings, anchor_ws))  # type: ignore[arg-type]

    def write(
        self, page: Page, blades: ChunkRange, chunks: ChunkTable, time_s: float, previous_time_s: float
    ) -> None:
        """Write the poses of these chunks of a page at two instants."""
        if not blades.count:
            return
        self._kernel.run(
            blades.groups,
            **page.bindings,
            Chunks=chunks.buffer,
            first_chunk=blades.first,
            chunk_count=blades.count,
            time_s=time_s,
            previous_time_s=previous_time_s,
        )
        self._ctx.memory_barrier(STORAGE_WRITTEN)

    def release(self) -> None:
        """Free the GPU resources."""
        self._block.release()
        self._kernel.release()
