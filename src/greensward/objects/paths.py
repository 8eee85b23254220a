"""Lines on the ground through the points of a path."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from greensward.scene.force import curve

_PER_CURVE = 8
"""Straight parts of a curve between two points."""
Floats = npt.NDArray[np.float64]


def line_of(path: Sequence[tuple[float, float]], smooth: bool) -> Floats:
    """Points along a path, x and z, (n, 2): its own, and where it is smooth, those of the curve between them."""
    points = np.array([point for i, point in enumerate(path) if not i or point != path[i - 1]], np.float64)
    if not smooth or len(points) < 3:
        return points
    t = np.linspace(0.0, 1.0, _PER_CURVE, endpoint=False)[:, None]
    parts = [
        (1.0 - t) ** 3 * a + 3.0 * t * (1.0 - t) ** 2 * b + 3.0 * t * t * (1.0 - t) * c + t**3 * d
        for a, b, c, d in (np.array(each) for each in curve(path))
    ]
    return np.concatenate([*parts, points[-1:]])
