"""Sphere packing: spheres that approximate an object, from which grass bends away."""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from greensward.io.meshes import TriMesh

Floats = npt.NDArray[np.float64]
Singles = npt.NDArray[np.float32]
_SAMPLES, _TOUCHED, _ROWS = 4096, 1024, 32
_CLOSE_ENOUGH = 0.01  # of the object's size


def packed(mesh: TriMesh, most: int = 64) -> Floats:
    """Spheres inside a closed surface that approximate it, at most `most`: (k, 4) of centre and radius.

    Candidates are the largest balls that touch the surface at samples of it (Ma, Bae & Choi 2012, "3D medial axis
    point approximation using nearest neighbors and the normal field"; of all samples at once, the ball that their
    iteration shrinks to is a minimum). Each choice takes the one that brings the samples closest to a sphere.
    An open sheet has no inside, and may get none. The same mesh always gives the same spheres.
    """
    points, normals = _sampled(mesh)
    size = float(np.ptp(mesh.bounds, axis=0).max())
    touched = slice(None, None, max(len(points) // _TOUCHED, 1))
    radii = np.minimum(
        _radii(points[touched], normals[touched], points), _room(points[touched], normals[touched], mesh.bounds)
    )
    centres = points[touched] - radii[:, None] * normals[touched]
    solid = radii > 1e-3 * size
    centres, radii = centres[solid], radii[solid]
    if not len(radii):
        return np.zeros((0, 4))
    return np.column_stack([centres, radii])[_chosen(centres, radii, points, size, most)]


def _sampled(mesh: TriMesh) -> tuple[Floats, Floats]:
    """Points spread evenly over the surface and the outward normals of their facets, (n, 3) each."""
    random = np.random.default_rng(0)
    share = np.cumsum(mesh.areas) / mesh.areas.sum()
    at = np.minimum(
        np.searchsorted(share, (np.arange(_SAMPLES) + random.random(_SAMPLES)) / _SAMPLES), len(share) - 1
    )
    u, v = random.random((2, _SAMPLES))
    u, v = np.where(u + v > 1.0, (1.0 - u, 1.0 - v), (u, v))
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles[at]], 1, 0)
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    corners = mesh.positions[mesh.triangles] - mesh.bounds.mean(axis=0)
    inside_out = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) < 0.0
    return a + u[:, None] * (b - a) + v[:, None] * (c - a), -normals if inside_out else normals


def _radii(touched: Floats, normals: Floats, points: Floats) -> Floats:
    """Radius of the largest ball under each touched point that holds no other: |p − q|² / (2 n · (p − q))."""
    least = 1e-9 * float(np.ptp(points, axis=0).max())
    radii = np.empty(len(touched))
    for rows in _runs(len(touched)):
        p, n = touched[rows], normals[rows]
        below = np.sum(p * n, axis=1)[:, None] - n @ points.T
        close = np.maximum(_squares(p, points), 0.0) / (2.0 * np.maximum(below, least))
        radii[rows] = np.where(below > least, close, np.inf).min(axis=1)
    return radii


def _runs(count: int) -> Iterator[slice]:
    """Parts of so many rows, each few enough that a table of rows and samples stays in the processor's cache."""
    return (slice(first, first + _ROWS) for first in range(0, count, _ROWS))


def _squares(p: Floats, q: Floats) -> Floats:
    """Squared distance of each p to each q, (p, q)."""
    result: Floats = np.sum(p**2, axis=1)[:, None] + np.sum(q**2, axis=1) - 2.0 * p @ q.T
    return result


def _room(touched: Floats, normals: Floats, bounds: Floats) -> Floats:
    """Radius of the largest such ball that stays within the bounds, which an open surface leaves open."""
    with np.errstate(divide="ignore", invalid="ignore"):
        low = np.where(normals > -1.0, (touched - bounds[0]) / (1.0 + normals), np.inf)
        high = np.where(normals < 1.0, (bounds[1] - touched) / (1.0 - normals), np.inf)
    result: Floats = np.maximum(np.minimum(low, high).min(axis=1), 0.0)
    return result


def _chosen(centres: Floats, radii: Floats, points: Floats, size: float, most: int) -> list[int]:
    """Select balls greedily: each lessens the squares of the samples' distances to the nearest ball the most."""
    away = np.empty((len(centres), len(points)), np.float32)
    for rows in _runs(len(centres)):
        reach = np.sqrt(np.maximum(_squares(centres[rows], points), 0.0)) - radii[rows, None]
        away[rows] = (np.maximum(reach, 0.0) / size).astype(np.float32) ** 2
    gap = np.ones(len(points), np.float32)
    gains = np.full(len(centres), np.inf)
    chosen: list[int] = []
    while len(chosen) < most and gap.any():
        best = _best(gains, away, gap)
        if best in chosen:
            break
        chosen.append(best)
        gap = np.minimum(gap, away[best])
        gap[gap <= _CLOSE_ENOUGH**2] = 0.0
    return chosen


def _best(gains: Floats, away: Singles, gap: Singles) -> int:
    """The ball that gains most; `gains` are those of an earlier choice, and are brought up to date where needed.

    What a ball gains only falls from choice to choice, so that those whose old gain is less need no look
    (Minoux 1978, "Accelerated greedy algorithms for maximizing submodular set functions").
    """
    order = np.argsort(-gains, kind="stable")
    for rows in _runs(len(order)):
        some = order[rows]
        gains[some] = np.maximum(gap - away[some], 0.0).sum(axis=1, dtype=np.float64)
        best = int(np.argmax(gains[order[: rows.stop]]))
        if rows.stop >= len(order) or gains[order[best]] >= gains[order[rows.stop]]:
            break
    return int(order[best])
