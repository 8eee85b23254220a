"""Preview quality: a scene with fewer blades, for interactive frame rates."""

import math
from typing import Any

from greensward.scene import Scene

QUALITIES = (1.0, 0.5, 0.25, 0.125, 0.0625)
"""Fractions of the blades of a scene that may be drawn, largest first."""
_COARSEST_SHADOWS_PX = 512
_LONGEST_STEP_S = 1.0 / 30.0


def preview(scene: Scene, quality: float) -> Scene:
    """Return the scene with this fraction of the blades near the camera, each wider, and cheaper settings.

    Flower heads become fewer as well, but not larger; shadows become coarser, steps of simulation longer and its
    reach shorter.
    """
    if quality == 1.0:
        return scene
    halvings = round(-math.log2(quality))
    shadows, nearer = scene.shadows, math.sqrt(quality)
    reduced: dict[str, Any] = {
        "sowing": scene.sowing.model_copy(update={"full_density_m": scene.sowing.full_density_m * nearer}),
        "grass": tuple(
            grass.model_copy(update={"head_share": grass.head_share * quality ** (1.0 / 3.0)})
            for grass in scene.grass
        ),
        "shadows": shadows.model_copy(
            update={
                "density": shadows.density * quality,
                "cascades": max(min(shadows.cascades, 4 - halvings), 1),
                "size_px": min(shadows.size_px, _COARSEST_SHADOWS_PX),
            }
        ),
    }
    if simulation := scene.simulation:
        steps = {"within_m": simulation.within_m * nearer, "step_s": max(simulation.step_s, _LONGEST_STEP_S)}
        reduced["simulation"] = simulation.model_copy(update=steps)
    return scene.model_copy(update=reduced).in_folder(scene.folder)
