"""Picking: from points of the window to rays into the scene, and back."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from greensward.gpu.view import View
from greensward.scene import Camera, GreenswardError
from greensward.viewer.session import Session
from greensward.viewpoint import camera_view

Floats = npt.NDArray[np.float64]
ScreenPoint = tuple[float, float]
"""Position in the window: x and y in points."""
Area = tuple[int, int, int, int]
"""Area of the window: x, y, width and height in points."""


@dataclass(frozen=True, eq=False)
class Picker:
    """Projection between the window and the scene: viewports of one view, side by side."""

    view: View | None
    """None for a camera at an invalid position."""
    areas: Sequence[Area]

    @classmethod
    def of(cls, camera: Camera, session: Session, areas: Sequence[Area]) -> "Picker":
        """Return the picker of a camera."""
        _, _, width, height = areas[-1]
        try:
            return cls(camera_view(camera, session.heights, (width, height)), areas)
        except GreenswardError:
            return cls(None, areas)

    def ray(self, point: ScreenPoint) -> Floats | None:
        """Return the unit direction of the ray through a point of the window, (3,); None outside the viewports."""
        for x, y, width, height in self.areas:
            if self.view and x <= point[0] < x + width and y <= point[1] < y + height:
                right, up = 2.0 * (point[0] - x) / width - 1.0, 1.0 - 2.0 * (point[1] - y) / height
                direction = self.view.rays_ws[0] + right * self.view.rays_ws[1] + up * self.view.rays_ws[2]
                result: Floats = direction / np.linalg.norm(direction)
                return result
        return None

    def project(self, point_ws: Floats) -> ScreenPoint | None:
        """Return the position of a world point in the last viewport; None outside the view."""
        if self.view is None:
            return None
        clip = self.view.clip_from_world @ np.array([*point_ws, 1.0])
        if clip[3] <= 1e-6 or abs(clip[0]) > clip[3] or abs(clip[1]) > clip[3]:
            return None
        x, y, width, height = self.areas[-1]
        return float(x + (0.5 + 0.5 * clip[0] / clip[3]) * width), float(y + (0.5 - 0.5 * clip[1] / clip[3]) * height)
