"""Brushes: strokes over the ground that paint the density map, or lay a track that presses grass down."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
import numpy.typing as npt
from PIL import Image

from greensward.ground import ground_size_m
from greensward.io.rasters import read_rgba
from greensward.scene import Scene, Tracks

Point = tuple[float, float]
"""Point of the ground: x and z in metres."""
Tool = Literal["look", "sow", "thin", "mow", "press", "move"]
MOWN = 0.3
"""Fraction of its height that mown grass keeps."""
_RED, _GREEN, _BLUE = range(3)
_FINEST_M, _MOST_TEXELS, _FEWEST_TEXELS = 0.1, 4096, 256
_MOST_POINTS = 256
_VISIBLE_TEXELS = 1.8


@dataclass(frozen=True)
class Brush:
    """Width and strength of a stroke."""

    radius_m: float = 0.8
    strength: float = 1.0


def initial_brush(scene: Scene) -> Brush:
    """Return a brush wide enough for its strokes to show in the density map of the scene."""
    return Brush(radius_m=max(Brush.radius_m, round(_VISIBLE_TEXELS * _texel_m(scene), 1)))


def _texel_m(scene: Scene) -> float:
    return max(_FINEST_M, max(ground_size_m(scene)) / _MOST_TEXELS)


def paintable_map(scene: Scene) -> npt.NDArray[np.uint8]:
    """Return the density map of a scene at paintable resolution, (rows, columns, 3); white if it has none."""
    size_x, size_z = ground_size_m(scene)
    texel_m = _texel_m(scene)
    columns, rows = (min(max(round(side / texel_m), _FEWEST_TEXELS), _MOST_TEXELS) for side in (size_x, size_z))
    file = scene.sowing.density_map
    if file is None:
        return np.full((rows, columns, 3), 255, np.uint8)
    image = read_rgba(scene.resolve(file))[..., :3]
    if image.shape[0] >= rows and image.shape[1] >= columns:
        return image.copy()
    return np.array(Image.fromarray(image).resize((columns, rows), Image.Resampling.BILINEAR))


def paint(
    density_map: npt.NDArray[np.uint8], size_m: tuple[float, float], path: Sequence[Point], tool: Tool, brush: Brush
) -> bool:
    """Paint a density map along a path; return True if it changed. Parts of the path off the ground are ignored."""
    rows, columns = density_map.shape[:2]
    per_m = columns / size_m[0], rows / size_m[1]
    points = np.array([((x + 0.5 * size_m[0]) * per_m[0], (z + 0.5 * size_m[1]) * per_m[1]) for x, z in path])
    reach = brush.radius_m * np.array(per_m) + 1.0
    low = np.clip(np.floor(points.min(axis=0) - reach), 0, (columns, rows)).astype(int)
    high = np.clip(np.ceil(points.max(axis=0) + reach), 0, (columns, rows)).astype(int)
    if (low >= high).any():
        return False
    part = density_map[low[1] : high[1], low[0] : high[0]]
    x = (np.arange(low[0], high[0]) + 0.5)[None, :]
    z = (np.arange(low[1], high[1]) + 0.5)[:, None]
    distance_m = np.full(part.shape[:2], np.inf)
    segments = list(pairwise(points)) or [(points[0], points[0])]
    for a, b in segments:
        segment = (b - a) / per_m
        dx, dz = (x - a[0]) / per_m[0], (z - a[1]) / per_m[1]
        t = np.clip((dx * segment[0] + dz * segment[1]) / max(float(segment @ segment), 1e-12), 0.0, 1.0)
        distance_m = np.minimum(distance_m, np.hypot(dx - t * segment[0], dz - t * segment[1]))
    # an edge one texel wide for the mower, a soft one for seeds
    soft_m = max(1.0 / min(per_m), (0.15 if tool == "mow" else 0.6) * brush.radius_m)
    inside = np.clip((brush.radius_m - distance_m) / soft_m + (0.5 if tool == "mow" else 0.0), 0.0, 1.0)
    weight = (brush.strength * inside)[..., None]
    before = part.copy()
    channels, target = {
        "sow": ([_RED, _GREEN, _BLUE], 255.0),
        "thin": ([_RED, _GREEN], 0.0),
        "mow": ([_BLUE], 255.0 * MOWN),
    }[tool]
    mixed = part[..., channels] * (1.0 - weight) + target * weight
    if tool == "mow":
        mixed = np.minimum(mixed, part[..., channels])
    part[..., channels] = np.round(mixed).astype(np.uint8)
    return bool((part != before).any())


def track(path: Sequence[Point], brush: Brush) -> Tracks:
    """Return the force that presses the grass down along a stroke."""
    points = simplified(path, 0.25 * brush.radius_m)
    if len(points) == 1:
        points = [points[0], (points[0][0] + 0.1, points[0][1])]
    return Tracks(
        kind="tracks",
        path=tuple((round(x, 3), round(z, 3)) for x, z in points),
        gauge_m=0.0,
        tyre_m=round(2.0 * brush.radius_m, 3),
        impact_m=round(0.5 * brush.radius_m, 3),
        pressure=brush.strength,
    )


def simplified(path: Sequence[Point], spacing_m: float) -> list[Point]:
    """Return points of a path at least this far apart, with its ends, and no more than a table may hold."""
    kept = [path[0]]
    for point in path[1:]:
        if math.dist(point, kept[-1]) >= spacing_m:
            kept.append(point)
    if len(path) > 1 and math.dist(path[-1], kept[-1]) > 1e-3:
        kept.append(path[-1])
    if len(kept) > _MOST_POINTS:
        step = (len(kept) - 1) / (_MOST_POINTS - 1)
        kept = [kept[round(i * step)] for i in range(_MOST_POINTS)]
    return kept
