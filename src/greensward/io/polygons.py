"""Polygons cut into triangles: fans where they are convex, ear clipping where they are not."""

from pathlib import Path

import numpy as np
import numpy.typing as npt

from greensward.io.parts import Floats, Indices
from greensward.scene.errors import InputError

_BENT_IN = -1e-9  # sine of the turn at a corner, from which on it counts as turning the other way


def triangulated(path: Path, positions: Floats, corners: Indices, sizes: Indices) -> Indices:
    """Triangles (m, 3), numbers into `corners`, of polygons that take so many of them, one after the other.

    `corners` are indices of positions. Raises `InputError` where a polygon is not convex and the extra is missing.
    """
    starts = np.cumsum(sizes) - sizes
    found = []
    for size in np.unique(sizes[sizes >= 3]):
        numbers = starts[sizes == size][:, None] + np.arange(size)
        hollow = _is_hollow(positions[corners[numbers]]) if size > 3 else np.zeros(len(numbers), np.bool_)
        fans, second = numbers[~hollow], np.arange(1, size - 1)
        first = np.broadcast_to(fans[:, :1], (len(fans), size - 2))
        found.append(np.stack([first, fans[:, second], fans[:, second + 1]], -1))
        found += [numbers[k][_ears(path, positions[corners[numbers[k]]])] for k in np.flatnonzero(hollow)]
    return np.concatenate([each.reshape(-1, 3) for each in found] or [np.zeros((0, 3), np.int64)]).astype(np.int64)


def _normals(outlines: Floats) -> Floats:
    """Normal of each polygon (k, n, 3), as long as twice its area (Newell)."""
    apart = outlines - outlines[:, :1]
    normals: Floats = np.cross(apart, np.roll(apart, -1, axis=1)).sum(axis=1)
    return normals


def _is_hollow(outlines: Floats) -> npt.NDArray[np.bool_]:
    """Return which polygons (k, n, 3) turn inwards at a corner."""
    edges = np.roll(outlines, -1, axis=1) - outlines
    edges /= np.maximum(np.linalg.norm(edges, axis=-1, keepdims=True), 1e-300)
    normals = _normals(outlines)
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-300)
    turns = np.einsum("knj,kj->kn", np.cross(np.roll(edges, 1, axis=1), edges), normals)
    hollow: npt.NDArray[np.bool_] = (turns < _BENT_IN).any(axis=1)
    return hollow


def _ears(path: Path, outline: Floats) -> Indices:
    """Triangles (m, 3) of a polygon (n, 3) that is not convex."""
    try:
        import mapbox_earcut
    except ImportError:
        raise InputError(
            f"{path}: a face is not convex, and mapbox_earcut, which cuts it, is not installed: "
            'pip install "greensward[mesh]"'
        ) from None
    normal = _normals(outline[None])[0]
    away = int(np.argmax(np.abs(normal)))
    first, second = (away + 1) % 3, (away + 2) % 3
    flat = outline[:, [first, second] if normal[away] > 0.0 else [second, first]]
    found = mapbox_earcut.triangulate_float64(flat, np.array([len(flat)], np.uint32))
    triangles: Indices = found.reshape(-1, 3).astype(np.int64)
    a, b, c = (flat[triangles[:, k]] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    triangles[area < 0.0] = triangles[area < 0.0, ::-1]
    return triangles
