"""A scene with fewer blades, for a window that must keep up."""

import math
from typing import Any

from greensward.scene import Scene

_COARSEST_SHADOWS_PX = 512
_LONGEST_STEP_S = 1.0 / 30.0


def drafted(scene: Scene, detail: float) -> Scene:
    """The scene with this part of the blades near the camera, wider ones in their stead, and less of what costs.

    Heads become fewer too, though none is larger for it; shadows plainer, steps of simulation longer and its reach
    shorter.
    """
    if detail == 1.0:
        return scene
    halvings = round(-math.log2(detail))
    shadows, nearer = scene.shadows, math.sqrt(detail)
    less: dict[str, Any] = {
        "sowing": scene.sowing.model_copy(update={"full_density_m": scene.sowing.full_density_m * nearer}),
        "grass": tuple(
            grass.model_copy(update={"head_share": grass.head_share * detail ** (1.0 / 3.0)}) for grass in scene.grass
        ),
        "shadows": shadows.model_copy(
            update={
                "density": shadows.density * detail,
                "cascades": max(min(shadows.cascades, 4 - halvings), 1),
                "size_px": min(shadows.size_px, _COARSEST_SHADOWS_PX),
            }
        ),
    }
    if simulation := scene.simulation:
        steps = {"within_m": simulation.within_m * nearer, "step_s": max(simulation.step_s, _LONGEST_STEP_S)}
        less["simulation"] = simulation.model_copy(update=steps)
    return scene.model_copy(update=less).in_folder(scene.resolve("."))
