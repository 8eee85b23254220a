"""Frustum culling and level of detail of tiles, vectorised."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from greensward.gpu.view import View, boxes_in_view, distance_to_boxes, planes_of
from greensward.sowing.field import Tiles

Floats = npt.NDArray[np.float64]


def in_view(tiles: Tiles, views: Sequence[View]) -> npt.NDArray[np.bool_]:
    """Test tiles' boxes against each view's frustum: bool (views, tiles). A box outside one plane is out."""
    return boxes_in_view(planes_of(views), tiles.centre, tiles.half)


def distance_to(tiles: Tiles, point: Floats) -> Floats:
    """Metres from a point to the nearest of each tile's box: float64 (tiles,)."""
    return distance_to_boxes(point, tiles.centre, tiles.half)


def coverage_needed(
    tiles: Tiles, views: Sequence[View], away: Floats, full_density_m: float, reach_m: float
) -> Floats:
    """Part of each tile's sown blades that each view may need: float64 (views, tiles), 0 where unseen.

    `away` is each tile's distance from the camera.
    """
    coverage = np.minimum(1.0, (full_density_m / np.maximum(away, 1e-3)) ** 2) * (away <= reach_m) / tiles.coverage
    density = np.array([view.density for view in views])
    result: Floats = np.minimum(in_view(tiles, views) * density[:, None] * coverage, 1.0)
    return result
