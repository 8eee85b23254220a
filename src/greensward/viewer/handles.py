"""What can be dragged over the ground: objects, and the centres of winds and forces."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from greensward.ground import HeightField
from greensward.scene import Helicopter, Scene
from greensward.scene.base import kind_of
from greensward.viewer.fields import Path

Floats = npt.NDArray[np.float64]
_FURTHEST_M = 60.0


@dataclass(frozen=True, eq=False)
class Handle:
    """Something at a place that the scene names."""

    path: Path
    name: str
    at_ws: Floats
    live: bool
    """Whether what it holds moves without sowing anew."""

    def moved(self, to_ws: Floats, heights: HeightField) -> "Handle":
        """The same over another spot of the ground, as high above it."""
        above = self.at_ws[1] - heights.height(self.at_ws[0], self.at_ws[2])
        return replace(self, at_ws=np.array([to_ws[0], float(heights.height(to_ws[0], to_ws[2])) + above, to_ws[2]]))

    def value(self, before: tuple[float, ...]) -> tuple[float, ...]:
        """What the scene's key is then."""
        x, z = round(float(self.at_ws[0]), 3), round(float(self.at_ws[2]), 3)
        return (x, z) if len(before) == 2 else (x, before[1], z)


def handles_of(scene: Scene, heights: HeightField, eye_ws: Floats) -> list[Handle]:
    """Those near someone."""
    found = []
    for list_name in ("object", "wind", "force"):
        for i, item in enumerate(getattr(scene, list_name)):
            key = "position_m" if list_name == "object" else "centre_m"
            if (at := getattr(item, key, None)) is None:
                continue
            x, y, z = at if len(at) == 3 else (at[0], 0.2, at[1])
            spot = np.array([x, float(heights.height(x, z)) + max(y, 0.2), z])
            if np.linalg.norm(spot - eye_ws) > _FURTHEST_M:
                continue
            name = getattr(item, "name", "") or f"{list_name} {i + 1}, {kind_of(type(item))}"
            live = list_name != "object" and not isinstance(item, Helicopter)
            found.append(Handle((list_name, i, key), name, spot, live))
    return found
