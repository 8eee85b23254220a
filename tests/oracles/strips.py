"""Blades as strips of quads on the screen, filled pixel by pixel in float64 (techniques/visibility_buffer)."""

from itertools import pairwise

import numpy as np

from oracles import bezier


def corners(
    root: np.ndarray, control: np.ndarray, tip: np.ndarray, side: np.ndarray, width: np.ndarray, segments: int
) -> np.ndarray:
    """Left and right edge of quadratic outlines at every level, metres: (blades, levels, 2, 3)."""
    result = []
    for v in np.linspace(0.0, 1.0, segments + 1):
        centre = bezier.point(root, control, tip, np.full(len(root), v))
        edges = np.array([-0.5, 0.5 - v * v])
        result.append(centre[:, None] + edges[:, None] * (width[:, None] * side)[:, None])
    return np.stack(result, 1)


def on_screen(points: np.ndarray, clip_from_world: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """x and y in pixels from the lower left corner, and the inverse depth: (..., 3)."""
    clip = points @ clip_from_world[:, :3].T + clip_from_world[:, 3]
    pixels = (0.5 + 0.5 * clip[..., :2] / clip[..., 3:]) * np.array(size)
    return np.concatenate([pixels, 1.0 / clip[..., 3:]], -1)


def fill(quads: np.ndarray, size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What is nearest at each pixel's centre: blade + 1 or 0, inverse depth, pixels to the nearest edge of a quad.

    `quads` are (blades, levels, 2, 3) as `on_screen` gives them. Rows from the bottom, each (height, width).
    """
    width, height = size
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    owner, nearness, margin = (
        np.zeros((height, width), int),
        np.zeros((height, width)),
        np.full((height, width), np.inf),
    )
    for blade, levels in enumerate(quads, start=1):
        for (a0, a1), (b0, b1) in pairwise(levels):
            polygon = [a0, a1, b1, b0]
            low, high = (f([p[:2] for p in polygon], axis=0) for f in (np.min, np.max))
            if np.any(high < -1.0) or np.any(low > np.array(size) + 1.0):
                continue
            inside, near_edge = _inside(polygon, x, y)
            margin = np.minimum(margin, near_edge)
            slope = np.linalg.lstsq(
                np.array([p[:2] - a0[:2] for p in polygon]), np.array([p[2] - a0[2] for p in polygon]), rcond=None
            )[0]
            here = a0[2] + slope[0] * (x - a0[0]) + slope[1] * (y - a0[1])
            won = inside & (here > nearness)
            owner[won], nearness[won] = blade, here[won]
    return owner, nearness, margin


def _inside(polygon: list[np.ndarray], x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whether points lie in a convex polygon, either way round, and how far they are from its outline."""
    sides, away = [], np.full(x.shape, np.inf)
    for p, q in zip(polygon, [*polygon[1:], polygon[0]], strict=True):
        d = q[:2] - p[:2]
        length = np.hypot(*d)
        if length < 1e-9:
            continue
        sides.append(d[0] * (y - p[1]) - d[1] * (x - p[0]))
        along = np.clip(((x - p[0]) * d[0] + (y - p[1]) * d[1]) / length**2, 0.0, 1.0)
        away = np.minimum(away, np.hypot(x - p[0] - along * d[0], y - p[1] - along * d[1]))
    stacked = np.array(sides)
    return (stacked > 0).all(0) | (stacked < 0).all(0), away
