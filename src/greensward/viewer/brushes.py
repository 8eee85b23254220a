"""Brushes: strokes over the ground that change the density map, or lay a track that presses grass down."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
import numpy.typing as npt
from PIL import Image

from greensward.io.rasters import read_rgba
from greensward.scene import Scene, Tracks

Spot = tuple[float, float]
Tool = Literal["look", "sow", "thin", "mow", "press", "move"]
MOWN = 0.3
"""Part of its height that mown grass keeps."""
_RED, _GREEN, _BLUE = range(3)
_FINEST_M, _MOST_TEXELS, _FEWEST_TEXELS = 0.1, 4096, 256
_MOST_POINTS = 256
_SEEN_TEXELS = 1.8


@dataclass(frozen=True)
class Brush:
    """How wide and how strong a stroke is."""

    radius_m: float = 0.8
    strength: float = 1.0


def handy(scene: Scene) -> Brush:
    """A brush to begin with, whose strokes show in the map of ground as large as this."""
    return Brush(radius_m=max(Brush.radius_m, round(_SEEN_TEXELS * _texel_m(scene), 1)))


def _texel_m(scene: Scene) -> float:
    return max(_FINEST_M, max(scene.ground.size_m) / _MOST_TEXELS)


def canvas_of(scene: Scene) -> npt.NDArray[np.uint8]:
    """The density map of a scene as fine as it can be painted, (rows, columns, 3); white where it has none."""
    size_x, size_z = scene.ground.size_m
    texel_m = _texel_m(scene)
    columns, rows = (min(max(round(side / texel_m), _FEWEST_TEXELS), _MOST_TEXELS) for side in (size_x, size_z))
    file = scene.sowing.density_map
    if file is None:
        return np.full((rows, columns, 3), 255, np.uint8)
    there = read_rgba(scene.resolve(file))[..., :3]
    if there.shape[0] >= rows and there.shape[1] >= columns:
        return there.copy()
    return np.array(Image.fromarray(there).resize((columns, rows), Image.Resampling.BILINEAR))


def paint(
    canvas: npt.NDArray[np.uint8], size_m: tuple[float, float], path: Sequence[Spot], tool: Tool, brush: Brush
) -> bool:
    """Change a density map along a path; returns whether anything changed. What lies off the ground is left out."""
    rows, columns = canvas.shape[:2]
    per_m = columns / size_m[0], rows / size_m[1]
    points = np.array([((x + 0.5 * size_m[0]) * per_m[0], (z + 0.5 * size_m[1]) * per_m[1]) for x, z in path])
    reach = brush.radius_m * np.array(per_m) + 1.0
    low = np.clip(np.floor(points.min(axis=0) - reach), 0, (columns, rows)).astype(int)
    high = np.clip(np.ceil(points.max(axis=0) + reach), 0, (columns, rows)).astype(int)
    if (low >= high).any():
        return False
    part = canvas[low[1] : high[1], low[0] : high[0]]
    x = (np.arange(low[0], high[0]) + 0.5)[None, :]
    z = (np.arange(low[1], high[1]) + 0.5)[:, None]
    away_m = np.full(part.shape[:2], np.inf)
    ends = list(pairwise(points)) or [(points[0], points[0])]
    for a, b in ends:
        way = (b - a) / per_m
        dx, dz = (x - a[0]) / per_m[0], (z - a[1]) / per_m[1]
        t = np.clip((dx * way[0] + dz * way[1]) / max(float(way @ way), 1e-12), 0.0, 1.0)
        away_m = np.minimum(away_m, np.hypot(dx - t * way[0], dz - t * way[1]))
    # an edge a texel wide for the mower, a soft one for seeds
    soft_m = max(1.0 / min(per_m), (0.15 if tool == "mow" else 0.6) * brush.radius_m)
    inside = np.clip((brush.radius_m - away_m) / soft_m + (0.5 if tool == "mow" else 0.0), 0.0, 1.0)
    weight = (brush.strength * inside)[..., None]
    before = part.copy()
    which, towards = {
        "sow": ([_RED, _GREEN, _BLUE], 255.0),
        "thin": ([_RED, _GREEN], 0.0),
        "mow": ([_BLUE], 255.0 * MOWN),
    }[tool]
    mixed = part[..., which] * (1.0 - weight) + towards * weight
    if tool == "mow":
        mixed = np.minimum(mixed, part[..., which])
    part[..., which] = np.round(mixed).astype(np.uint8)
    return bool((part != before).any())


def track(path: Sequence[Spot], brush: Brush) -> Tracks:
    """What presses the grass down along a stroke."""
    spots = thinned(path, 0.25 * brush.radius_m)
    if len(spots) == 1:
        spots = [spots[0], (spots[0][0] + 0.1, spots[0][1])]
    return Tracks(
        kind="tracks",
        path=tuple((round(x, 3), round(z, 3)) for x, z in spots),
        gauge_m=0.0,
        tyre_m=round(2.0 * brush.radius_m, 3),
        impact_m=round(0.5 * brush.radius_m, 3),
        pressure=brush.strength,
    )


def thinned(path: Sequence[Spot], apart_m: float) -> list[Spot]:
    """Points of a path at least so far apart, its ends kept, and never more than a table may hold."""
    kept = [path[0]]
    for point in path[1:]:
        if math.dist(point, kept[-1]) >= apart_m:
            kept.append(point)
    if len(path) > 1 and math.dist(path[-1], kept[-1]) > 1e-3:
        kept.append(path[-1])
    if len(kept) > _MOST_POINTS:
        step = (len(kept) - 1) / (_MOST_POINTS - 1)
        kept = [kept[round(i * step)] for i in range(_MOST_POINTS)]
    return kept
