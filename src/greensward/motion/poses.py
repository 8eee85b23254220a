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
from greensward.scene.grass import MOST_SPECIES
from greensward.sowing import Page

MOTION_BLOCK = block(
    "Motion",
    ("centre", "vec4"),  # of gravity; how much of it pulls there rather than down
    ("gravity_mps2", "float"),
    ("forward", "float"),
    ("recovery_hz", "float"),
    ("reference_m", "float"),
    ("rise_s", "float"),
    ("step_s", "float"),
    ("within_m", "float"),
    ("form", "int"),
    # with `[mass]`, in reference masses: the mean blade, and by species one of a square metre, length times width
    ("mean_mass", "float"),
    ("mass_per_m2", "vec4", MOST_SPECIES // 4),
)
FORMS: tuple[str, ...] = get_args(Simulation.model_fields["form"].annotation)
_RECOVERY_HZ = {"natural": 1.0, "yan2024": 45.0, "jahrmann2017": 15.0}
"""Rates with which the default grass stands; 1 is as published."""


def motion_values(settings: Simulation | None, anchor_ws: npt.ArrayLike = (0.0, 0.0, 0.0)) -> dict[str, object]:
    """Members of the `Motion` block; the centre of gravity is counted from the anchor, (3,)."""
    settings = settings or Simulation()
    names = ("gravity_mps2", "forward", "reference_m", "rise_s", "step_s", "within_m")
    centre = settings.gravity_centre_m
    return {
        **{name: getattr(settings, name) for name in names},
        "recovery_hz": settings.recovery_hz or _RECOVERY_HZ[settings.form],
        "centre": (*np.subtract(centre, anchor_ws), settings.gravity_towards) if centre else (0.0, 0.0, 0.0, 0.0),
        "form": FORMS.index(settings.form),
    }


def mass_values(scene: Scene) -> dict[str, object]:
    """Members of the `Motion` block by which winds are forces: masses over the reference mass.

    The outline of a blade is a parabola, whose area is two thirds of its length times its greatest width.
    """
    shares, mass_kg_per_m2, area_m2 = (
        np.array(each)
        for each in zip(
            *((g.share, 2.0 / 3.0 * g.mass_kg_per_m2, sum(g.height_m) * sum(g.width_m) / 4.0) for g in scene.grass),
            strict=True,
        )
    )
    mean_kg = float(shares @ (mass_kg_per_m2 * area_m2) / shares.sum())
    reference_kg = scene.mass.reference_kg if scene.mass and scene.mass.reference_kg else mean_kg
    table = np.zeros(MOST_SPECIES)
    table[: len(shares)] = mass_kg_per_m2 / reference_kg
    return {"mean_mass": mean_kg / reference_kg, "mass_per_m2": table.reshape(-1, 4)}


def motion_defines(scene: Scene) -> dict[str, object]:
    """Defines of shaders of motion, so that they hold what the scene needs and no more."""
    form = scene.simulation.form if scene.simulation else FORMS[0]
    mass = {"MASS": 1} if scene.mass else {}
    return {"FORM": FORMS.index(form), **mass, **absent_kinds(scene.wind), **absent_forces(scene)}


class Poses:
    """Analytic motion of the field in the scene's winds."""

    def __init__(self, device: Device, scene: Scene, bindings: Mapping[str, Resource]) -> None:
        self._ctx, self._settings = device.ctx, scene.simulation
        self._block = BlockBuffer(device.ctx, MOTION_BLOCK)
        self._block.set(**motion_values(scene.simulation))  # type: ignore[arg-type]
        if scene.mass and any(grass.share for grass in scene.grass):
            self._block.set(**mass_values(scene))  # type: ignore[arg-type]
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
