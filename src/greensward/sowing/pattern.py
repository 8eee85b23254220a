"""One stored pattern of roots that is drawn at many places, and the visible patches of the grid of those.

The grid is culled through a hierarchy that is not stored. Every two patches make a larger one, these again, up to
one that holds all (Jahrmann & Wimmer 2013, section 6.1). The larger ones are tested first, all of a level at once,
and then only the contents of those that may be visible. As a node follows from its place in the grid, memory does not
grow with the field, and time grows with the logarithm of its edge.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from greensward.gpu.layouts import struct
from greensward.gpu.view import View, boxes_in_view, distance_to_boxes, planes_of
from greensward.ground import HeightField

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


# of a patch of edge 1
PATTERN_ROOT = struct("PatternRoot", ("x", "float"), ("z", "float"), ("random", "float", 8))


@dataclass(frozen=True)
class Grid:
    """Patches of one size. Patch (i, j) reaches from (i, j) to (i + 1, j + 1) times its edge along x and z."""

    patch_m: float
    low: tuple[int, int]
    """First column and row."""
    high: tuple[int, int]
    """One behind the last."""
    height_m: tuple[float, float]
    """Lowest and highest point of anything in it."""
    margin_m: float
    """Distance that blades lean out of their patch."""
    ground: HeightField | None = None
    """Heights of the ground under each patch, for a bounding box of its own."""


def patches_in_view(
    grid: Grid, views: Sequence[View], camera_ws: Floats, reach_m: float
) -> tuple[Indices, npt.NDArray[np.bool_], Floats]:
    """The patches that some view may show: columns and rows (n, 2), by which views (views, n), how far away (n,).

    Distance is from the camera to the nearest point of the patch, in metres, and at most `reach_m`.
    """
    planes = planes_of(views)
    edges = np.array(
        [1 << max(int(high - low - 1).bit_length(), 0) for low, high in zip(grid.low, grid.high, strict=True)]
    )
    nodes = np.array([grid.low], np.int64)
    while True:
        low = np.maximum(nodes, grid.low) * grid.patch_m - grid.margin_m
        high = np.minimum(nodes + edges, grid.high) * grid.patch_m + grid.margin_m
        centre, half = _boxes(grid, low, high, edges)
        shown, away = boxes_in_view(planes, centre, half), distance_to_boxes(camera_ws, centre, half)
        keep = shown.any(axis=0) & (away <= reach_m) & (nodes < grid.high).all(axis=1)
        nodes, shown, away = nodes[keep], shown[:, keep], away[keep]
        if edges.max() == 1:
            return nodes, shown, away
        axis = int(np.argmax(edges))
        edges[axis] //= 2
        beside = nodes.copy()
        beside[:, axis] += edges[axis]
        nodes = np.concatenate([nodes, beside])


def _boxes(grid: Grid, low: Floats, high: Floats, edges: Indices) -> tuple[Floats, Floats]:
    bottom, top = (np.full(len(low), height) for height in grid.height_m)
    if grid.ground and edges.max() == 1 and grid.ground.highest_m > grid.ground.lowest_m:
        size = np.full(len(low), grid.patch_m + 2.0 * grid.margin_m)
        lowest, highest = grid.ground.height_range(low[:, 0], low[:, 1], size)
        bottom, top = bottom + lowest - grid.ground.lowest_m, top + highest - grid.ground.highest_m
    centre, half = np.empty((len(low), 3)), np.empty((len(low), 3))
    centre[:, [0, 2]], half[:, [0, 2]] = 0.5 * (low + high), 0.5 * (high - low)
    centre[:, 1], half[:, 1] = 0.5 * (bottom + top), 0.5 * (top - bottom)
    return centre, half


def pattern_of(count: int, seed: int) -> npt.NDArray[np.void]:
    """Roots of a patch of edge 1, even in any prefix, with eight random values each: (count,), never empty."""
    random = np.random.default_rng([seed, 2013])
    # as in sowing/ground_blade.glsl: an additive recurrence, jittered by the spacing of the points so far
    index = np.arange(count)[:, None]
    even = index * np.array([0.7548776662466927, 0.5698402909980532]) + random.random(2)
    jitter = (random.random((count, 2)) - 0.5) * 1.4 / np.sqrt(index + 1.0)
    roots = np.zeros(max(count, 1), PATTERN_ROOT.dtype)
    place = (even + jitter) % 1.0
    roots["x"][:count], roots["z"][:count] = place.T
    roots["random"][:count] = random.random((count, 8))
    return roots
