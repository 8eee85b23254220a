"""Handles that are dragged over the ground: objects, and the centres of winds and forces."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from greensward.ground import HeightField
from greensward.scene import Helicopter, Scene
from greensward.scene.kinds import kind_of
from greensward.viewer.fields import KeyPath

Floats = npt.NDArray[np.float64]
_FURTHEST_M = 60.0


@dataclass(frozen=True, eq=False)
class Handle:
    """Draggable position of the scene."""

    path: KeyPath
    name: str
    position_ws: Floats
    live: bool
    """True if the scene follows the drag; False if it is changed at its end, as it must be sown anew."""

    def moved(self, to_ws: Floats, heights: HeightField) -> "Handle":
        """Return the handle over another point of the ground, at the same height above it."""
        x, y, z = self.position_ws
        height = float(heights.height(to_ws[0], to_ws[2])) + y - heights.height(x, z)
        return replace(self, position_ws=np.array([to_ws[0], height, to_ws[2]]))

    def value(self, before: tuple[float, ...]) -> tuple[float, ...]:
        """Return the value of the key at this position."""
        x, z = round(float(self.position_ws[0]), 3), round(float(self.position_ws[2]), 3)
        return (x, z) if len(before) == 2 else (x, before[1], z)


def handles_of(scene: Scene, heights: HeightField, eye_ws: Floats) -> list[Handle]:
    """Return the handles of a scene within reach of the camera."""
    found = []
    for list_name in ("object", "wind", "force"):
        for i, item in enumerate(getattr(scene, list_name)):
            key = "position_m" if list_name == "object" else "centre_m"
            if (at := getattr(item, key, None)) is None:
                continue
            x, y, z = at if len(at) == 3 else (at[0], 0.2, at[1])
            position = np.array([x, float(heights.height(x, z)) + max(y, 0.2), z])
            if np.linalg.norm(position - eye_ws) > _FURTHEST_M:
                continue
            name = getattr(item, "name", "") or f"{list_name} {i + 1}, {kind_of(type(item))}"
            live = list_name != "object" and not isinstance(item, Helicopter)
            found.append(Handle((list_name, i, key), name, position, live))
    return found
