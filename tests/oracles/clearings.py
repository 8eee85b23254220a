"""The part of the blades that clearings leave, by the distance to every piece."""

import numpy as np


def open_at(points: np.ndarray, pieces, footprint_m: float = 0.0) -> np.ndarray:
    """Part that may grow at points (n, 2): float64 (n,)."""
    found = np.ones(len(points))
    for corners, radius_m, edge_m, width_m in zip(*vars(pieces).values(), strict=True):
        past = _distance(points, corners) - radius_m + min(0.5 * footprint_m, radius_m)
        cleared = 1.0 - np.clip(past / max(edge_m + footprint_m, 1e-4), 0.0, 1.0)
        found = np.minimum(found, 1.0 - cleared * min(1.0, width_m / max(footprint_m, 1e-4)))
    return found


def _distance(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """To a convex polygon (k, 2); 0 inside."""
    ahead = np.roll(corners, -1, axis=0)
    along, off = ahead - corners, points[:, None] - corners
    t = np.clip((off * along).sum(-1) / np.maximum((along * along).sum(-1), 1e-300), 0.0, 1.0)
    outside = np.linalg.norm(off - t[..., None] * along, axis=-1).min(axis=1)
    side = along[:, 0] * off[..., 1] - along[:, 1] * off[..., 0]
    return np.where((side >= 0.0).all(axis=1) & (side.sum(axis=1) > 0.0), 0.0, outside)
