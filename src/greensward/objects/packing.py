"""Sphere packing: spheres that approximate an object, from which grass bends away."""

import numpy as np
import numpy.typing as npt

from greensward.io.meshes import TriMesh

Floats = npt.NDArray[np.float64]
_SAMPLES, _TOUCHED = 4096, 1024
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
    apart = np.sum(touched**2, axis=1)[:, None] + np.sum(points**2, axis=1) - 2.0 * touched @ points.T
    below = np.sum(touched * normals, axis=1)[:, None] - normals @ points.T
    least = 1e-9 * float(np.ptp(points, axis=0).max())
    radii = np.where(below > least, np.maximum(apart, 0.0) / (2.0 * np.maximum(below, least)), np.inf)
    result: Floats = radii.min(axis=1)
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
    reach = np.sum(centres**2, axis=1)[:, None] + np.sum(points**2, axis=1) - 2.0 * centres @ points.T
    away = (np.maximum(np.sqrt(np.maximum(reach, 0.0)) - radii[:, None], 0.0) / size).astype(np.float32) ** 2
    gap = np.ones(len(points), np.float32)
    chosen: list[int] = []
    while len(chosen) < most and len(gap) and gap.max() > _CLOSE_ENOUGH**2:
        best = int(np.argmin(np.minimum(away, gap).sum(axis=1)))
        if best in chosen:
            break
        chosen.append(best)
        gap = np.minimum(gap, away[best])
        open_still = gap > _CLOSE_ENOUGH**2
        gap, away = gap[open_still], away[:, open_still]
    return chosen
