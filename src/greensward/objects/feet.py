"""Feet of objects: the outline of what of them lies near the ground, as convex quadrilaterals seen from above."""

from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFilter

from greensward.ground import HeightField
from greensward.objects.meshes import mesh_of, unit_shape
from greensward.objects.placing import Placing
from greensward.scene import Capsule, Mesh
from greensward.scene.objects import Object

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Foot = tuple[Floats, float]
"""Quadrilaterals in the world, x and z, (n, 4, 2), turning from x to z, and a radius around them."""
_NONE: Foot = np.zeros((0, 4, 2)), 0.0
_SUNK_M = 0.02
"""Depth below the ground down to which a surface counts."""
_SIDES = 24
_NOWHERE = (0.0, 0.0, 0.0)
_ANGLES = np.linspace(0.0, 2.0 * np.pi, 96, endpoint=False) + 0.01
_DIRECTIONS = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=-1)
_SAME_M = 0.005
"""Distance by which an outline may be simplified."""
_TEXELS = 128
"""Texels along the longer side of the raster of a mesh's foot."""


def feet_of(
    objects: Sequence[Object], placing: Placing, heights: HeightField, resolve: Callable[[str], Path], high_m: float
) -> list[Foot]:
    """Feet of all objects that clear the ground: what of each is below `high_m`. None without ground."""
    placed = placing.at(0.0)
    found = []
    rasters = _Rasters(heights, resolve, high_m)
    for i, each in enumerate(objects if heights.exists else ()):
        if each.clears and each.drawn and not placing.moving[i]:
            if isinstance(each, Mesh):
                foot = rasters.foot(each, placed[i])
            else:
                points, edges = _solid(each)
                foot = _hull(_above_ground(points, placed[i], heights), edges, high_m)
            found += [foot] if len(foot[0]) else []
    return found


def _above_ground(points: Floats, placed: Floats, heights: HeightField) -> Floats:
    """Points of an object in the world, but that y is above the ground."""
    points = points @ placed[:3, :3].T + placed[:3, 3]
    points[:, 1] -= heights.height(points[:, 0], points[:, 2])
    return points


_Surface = tuple[Floats, npt.NDArray[np.int64]]
"""Points and edges."""


def _solid(shape: Object) -> _Surface:
    if isinstance(shape, Capsule):
        return _shared(Capsule(position_m=_NOWHERE, radius_m=shape.radius_m, length_m=shape.length_m))
    assert not isinstance(shape, Mesh)
    points, edges = _shared(type(shape)(position_m=_NOWHERE))  # a metre large
    return points * shape.size_m, edges


@lru_cache(maxsize=256)
def _shared(shape: Object) -> _Surface:
    mesh = mesh_of(shape, Path, sides=_SIDES)
    return mesh.positions, np.concatenate([mesh.triangles[:, pair] for pair in ([0, 1], [1, 2], [2, 0])])


# Solids are convex ------------------------------------------------------------------------------------------


def _hull(points: Floats, edges: npt.NDArray[np.int64], high_m: float) -> Foot:
    """The convex hull of what lies between two heights; a disc where it is round."""
    height = points[:, 1]
    if height.min() >= high_m:
        return _NONE
    near = [points[(height >= -_SUNK_M) & (height <= high_m)]]
    for level in (-_SUNK_M, high_m):
        a, b = points[edges[:, 0]], points[edges[:, 1]]
        through = (a[:, 1] < level) != (b[:, 1] < level)
        a, b = a[through], b[through]
        near.append(a + ((level - a[:, 1]) / (b[:, 1] - a[:, 1]))[:, None] * (b - a))
    outline = _simple(_convex_hull(np.concatenate(near)[:, [0, 2]]))
    if not len(outline):
        return _NONE
    middle = 0.5 * (outline.min(axis=0) + outline.max(axis=0))
    away = np.linalg.norm(outline - middle, axis=1)
    if len(outline) > 8 and np.ptp(away) < 0.03 * away.max():
        return np.tile(middle, (1, 4, 1)), float(away.max())
    fan = (
        [outline[[0, k, k + 1, min(k + 2, len(outline) - 1)]] for k in range(1, max(len(outline) - 1, 2), 2)]
        if len(outline) > 2
        else [outline[[0, 0, -1, -1]]]
    )
    return np.array(fan), 0.0


def _convex_hull(points: Floats) -> Floats:
    """The corners of the convex hull that lie farthest in one of many directions, turning from x to z."""
    if not len(points):
        return points
    farthest = (_DIRECTIONS @ points.T).argmax(axis=1)
    corners: Floats = points[farthest[farthest != np.roll(farthest, 1)]]
    return corners if len(corners) else points[:1]


def _turn(a: Floats, b: Floats, c: Floats) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def _simple(outline: Floats) -> Floats:
    """An outline without corners that lie close to the line between the two beside them."""
    kept = list(outline)
    k = 0
    while len(kept) > 4 and k < len(kept):
        a, b, c = kept[k - 1], kept[k], kept[(k + 1) % len(kept)]
        if abs(_turn(a, b, c)) < _SAME_M * np.hypot(*(c - a)):
            kept.pop(k)
        else:
            k += 1
    return np.array(kept)


# Meshes may have any shape ----------------------------------------------------------------------------------


class _Rasters:
    """Feet of meshes; one for all that stand alike, but for their places and turns, where the ground is level."""

    def __init__(self, heights: HeightField, resolve: Callable[[str], Path], high_m: float) -> None:
        self._heights, self._resolve, self._high_m = heights, resolve, high_m
        self._level = heights.lowest_m == heights.highest_m
        self._known: dict[tuple[object, ...], tuple[Floats, Floats]] = {}

    def foot(self, shape: Mesh, placed: Floats) -> Foot:
        """The foot of a mesh where it stands."""
        yaw = np.radians(shape.yaw_deg)
        own = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        key = unit_shape(shape), shape.pitch_deg, shape.roll_deg, shape.position_m[1]
        if key not in self._known or not self._level:
            mesh = mesh_of(shape, self._resolve)
            points = _above_ground(mesh.positions, placed, self._heights)
            points[:, [0, 2]] = (points[:, [0, 2]] - points[0, [0, 2]]) @ own.T
            self._known = self._known if self._level else {}
            self._known[key] = _raster(points, mesh.triangles, self._high_m), mesh.positions[0]
        corners, first = self._known[key]
        return corners @ own + (placed[:3, :3] @ first + placed[:3, 3])[[0, 2]], 0.0


def _raster(points: Floats, triangles: npt.NDArray[np.int64], high_m: float) -> Floats:
    """Quadrilaterals (n, 4, 2) of the surface between two heights and what it encloses, in rows along x."""
    height = points[:, 1][triangles]
    lowest, highest = (end(end(height[:, 0], height[:, 1]), height[:, 2]) for end in (np.minimum, np.maximum))
    flat = points[triangles[(highest >= -_SUNK_M) & (lowest < high_m)]][..., [0, 2, 1]]
    if not len(flat):
        return np.zeros((0, 4, 2))
    # triangles of a few texels are drawn as points, and the gaps between these closed
    size_m = np.ptp(flat[..., :2], axis=1).max(axis=1)
    small = size_m < 3.0 * np.ptp(flat[..., :2].reshape(-1, 2), axis=0).max() / _TEXELS
    dots = np.concatenate([flat[small], flat[small].mean(axis=1, keepdims=True)], axis=1).reshape(-1, 3)
    dots = dots[(dots[:, 2] >= -_SUNK_M) & (dots[:, 2] <= high_m), :2]
    parts = [part for part in (_clipped(each, high_m) for each in flat[~small]) if len(part)]
    points = np.concatenate([dots, *parts])
    if not len(points):
        return np.zeros((0, 4, 2))
    low, high = points.min(axis=0), points.max(axis=0)
    texel_m = max(float((high - low).max()), 1e-3) / _TEXELS
    columns, rows = np.ceil((high - low) / texel_m).astype(int) + 1
    image = Image.new("L", (int(columns), int(rows)))
    draw = ImageDraw.Draw(image)
    for part in parts:
        draw.polygon(((part - low) / texel_m - 0.5).ravel().tolist(), fill=255, outline=255)
    draw.point(np.floor((dots - low) / texel_m).ravel().tolist(), fill=255)
    if len(dots):
        image = image.filter(ImageFilter.MaxFilter(5)).filter(ImageFilter.MinFilter(5))
    # a point of the solid is on its surface between the heights, or inside it at each of them
    mask = (np.array(image) > 0) | _inside(flat, 0.37 * high_m, low, texel_m, int(rows), int(columns))
    corners: Floats = np.array([*_merged(mask)]) * texel_m + low
    return corners


def _clipped(corners: Floats, high_m: float) -> Floats:
    """Cut a triangle (3, 3) of x, z, height at both heights; the rest is a polygon of x and z."""
    for level, sign in ((-_SUNK_M, 1.0), (high_m, -1.0)):
        above = sign * (corners[:, 2] - level) if len(corners) else np.zeros(0)
        kept = []
        for k in range(len(corners)):
            if above[k - 1] * above[k] < 0.0:
                t = above[k - 1] / (above[k - 1] - above[k])
                kept.append(corners[k - 1] + t * (corners[k] - corners[k - 1]))
            if above[k] >= 0.0:
                kept.append(corners[k])
        corners = np.array(kept).reshape(-1, 3)
    return corners[:, :2]


def _inside(flat: Floats, level: float, low: Floats, texel_m: float, rows: int, columns: int) -> Mask:
    """Texels inside the section of a closed surface at a height, by the even-odd rule; open rows are left out."""
    a, b = flat[:, [0, 1, 2]], flat[:, [1, 2, 0]]
    through = (a[..., 2] < level) != (b[..., 2] < level)
    cut = through.sum(axis=1) == 2
    a, b = a[cut][through[cut]], b[cut][through[cut]]
    ends = (a + ((level - a[:, 2]) / (b[:, 2] - a[:, 2]))[:, None] * (b - a))[:, :2].reshape(-1, 2, 2)
    mask = np.zeros((rows, columns), np.bool_)
    middle = np.arange(columns) + 0.5
    for row in range(rows):
        z = low[1] + (row + 0.5) * texel_m
        here = ends[(ends[:, 0, 1] < z) != (ends[:, 1, 1] < z)]
        t = (z - here[:, 0, 1]) / (here[:, 1, 1] - here[:, 0, 1])
        x = np.sort((here[:, 0, 0] + t * (here[:, 1, 0] - here[:, 0, 0]) - low[0]) / texel_m)
        if len(x) % 2 == 0:
            mask[row] = np.searchsorted(x, middle) % 2 == 1
    return mask


def _merged(mask: Mask) -> Iterator[Floats]:
    """Trapezoids (4, 2) in texels that cover a mask to about one: runs of its rows, joined while their ends align."""
    open_runs: list[list[tuple[int, int]]] = []
    first: list[int] = []
    for row in range(len(mask) + 1):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], mask[row] if row < len(mask) else [], [0]])))
        runs = [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
        still: list[list[tuple[int, int]]] = []
        since: list[int] = []
        for chain, start in zip(open_runs, first, strict=True):
            below = [run for run in runs if run[0] < chain[-1][1] and run[1] > chain[-1][0]]
            if len(below) == 1 and _beside(below[0], open_runs) == 1 and _aligned([*chain, below[0]]):
                still.append([*chain, below[0]])
                since.append(start)
                runs.remove(below[0])
            else:
                yield _trapezoid(chain, start)
        open_runs, first = still + [[run] for run in runs], since + [row] * len(runs)


def _beside(run: tuple[int, int], chains: list[list[tuple[int, int]]]) -> int:
    """Number of chains of the row before that a run continues."""
    return sum(chain[-1][0] < run[1] and chain[-1][1] > run[0] for chain in chains)


def _aligned(chain: list[tuple[int, int]]) -> bool:
    """Return whether both ends of these runs lie within a texel of a line."""
    ends = np.array(chain, np.float64)
    line = np.linspace(ends[0], ends[-1], len(ends))
    return bool(np.abs(ends - line).max() <= 1.0)


def _trapezoid(chain: list[tuple[int, int]], row: int) -> Floats:
    (a, b), (c, d) = chain[0], chain[-1]
    return np.array([[a, row], [b, row], [d, row + len(chain)], [c, row + len(chain)]], np.float64)


def trapezoids(outline: Floats) -> Floats:
    """Trapezoids (n, 4, 2) that make up a polygon (k, 2) whose sides do not cross."""
    a, b = outline, np.roll(outline, -1, axis=0)
    found = []
    for top, bottom in pairwise(np.unique(outline[:, 1])):
        middle = 0.5 * (top + bottom)
        through = (a[:, 1] < middle) != (b[:, 1] < middle)
        start, along = a[through], (b - a)[through]
        x_top, x_bottom = (start[:, 0] + (z - start[:, 1]) / along[:, 1] * along[:, 0] for z in (top, bottom))
        order = np.argsort(x_top + x_bottom)
        for west, east in order.reshape(-1, 2):
            found.append([[x_top[west], top], [x_top[east], top], [x_bottom[east], bottom], [x_bottom[west], bottom]])
    return np.array(found, np.float64).reshape(-1, 4, 2)
