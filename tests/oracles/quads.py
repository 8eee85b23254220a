"""Jahrmann & Wimmer 2013: a blade as a quad bent along two splines. Arrays are float64, of blades (n,) or (n, 3)."""

import numpy as np

from oracles.hashing import hashes, unit

Array = np.ndarray
_UP = np.array([0.0, 1.0, 0.0])


def corners(centre: Array, side: Array, width: Array, height: Array) -> Array:
    """Equation 2, turned so that the paper's x is `side`: lower left and right, upper right and left, (n, 4, 3)."""
    half, tall = 0.5 * width[:, None] * side, height[:, None] * _UP
    return np.stack([centre - half, centre + half, centre + half + tall, centre - half + tall], 1)


def offset(bending: Array, r1: Array, r2: Array) -> Array:
    """Equation 3, (n, 3)."""
    return np.stack([bending * (2 * r1 - 1), np.zeros_like(bending), bending * (2 * r2 - 1)], 1)


def level_by_distance(smoothness: Array, distance: Array, farthest: Array) -> Array:
    """Equation 4, not below 0."""
    return np.maximum(np.ceil(smoothness * (1 - distance / farthest)), 0)


def level_by_size(smoothness: Array, upper: Array, lower: Array, height_px: Array, px_per_quad: Array) -> Array:
    """Equation 5; at 0 and below, the blade is culled."""
    return np.minimum(((upper * 0.5 + 0.5) - (lower * 0.5 + 0.5)) * height_px / px_per_quad, smoothness)


def control(lower: Array, upper: Array, r1: Array, r2: Array) -> Array:
    """Equation 6."""
    r = np.stack([r1, r2, r1], 1)
    return lower * r + upper * (1 - r)


def spline(bottom: Array, h: Array, top: Array, v: Array) -> tuple[Array, Array]:
    """Equation 7: the point, and the tangent of unit length."""
    v = v[:, None]
    a, b = bottom + v * (h - bottom), h + v * (top - h)
    return a + v * (b - a), (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)


def point(left: Array, tangent_left: Array, right: Array, tangent_right: Array, u: Array) -> tuple[Array, ...]:
    """Equation 8: position, bitangent, tangent, normal."""
    u = u[:, None]
    unit = lambda vector: vector / np.linalg.norm(vector, axis=1, keepdims=True)  # noqa: E731
    bitangent, tangent = unit(right - left), unit(tangent_left * (1 - u) + tangent_right * u)
    return left * (1 - u) + right * u, bitangent, tangent, unit(np.cross(tangent, bitangent))


def varied_by_ratio(random: Array, p: Array, q: Array) -> Array:
    """Equation 10."""
    return np.mod(random * p / q, 1.0)


def varied_by_share(random: Array, p: Array, dimension: Array) -> Array:
    """Equation 11."""
    return random * p / dimension


def varied_by_sine(random: Array, p: Array, c: float) -> Array:
    """Equation 12."""
    return random * np.sin(c * p)


# What is drawn --------------------------------------------------------------------------------------------------


def stored_randoms(random: Array, flags: Array, facing: Array) -> Array:
    """The eight random values of stored blades (n, 8): the angle they have, and hashes of what is their own."""
    bits = facing.astype(np.float32).view(np.uint32)
    rows = [hashes(np.column_stack([random, flags, bits]).astype(np.uint32))]
    rows += [hashes(rows[0])]
    rows += [hashes(rows[1])]
    return np.column_stack([np.mod(facing.astype(np.float64) / (2 * np.pi), 1), unit(np.hstack(rows))[:, :7]])


def instanced_randoms(stored: Array, index: Array, place: Array, how: str, xz: Array, share: Array) -> Array:
    """The same of instances, of values as stored (n, 8): by hash or by equations 10 to 12, along x and z in turn."""
    if how == "hash":
        words = [np.column_stack([place[:, 0], place[:, 1], index * 8 + k]).astype(np.uint32) for k in range(8)]
        return np.mod(stored + np.column_stack([unit(hashes(each)[:, 0]) for each in words]), 1)
    p, q = np.tile(xz, 4), np.tile(xz[:, ::-1], 4)
    if how == "ratio":
        return varied_by_ratio(stored, p, q)
    value = varied_by_share(stored, np.tile(share, 4), 1.0) if how == "share" else varied_by_sine(stored, p, 12.9898)
    return np.mod(value, 1)


def outlines(root: Array, random: Array, width: Array, height: Array, bending: Array) -> Array:
    """Equations 2 and 3 on level ground, (n, 4, 3): ranges (n, 2) in which sizes lie evenly, largest offsets (n,)."""
    angle = 2 * np.pi * random[:, 0]
    side = np.stack([np.cos(angle), np.zeros(len(angle)), -np.sin(angle)], 1)
    wide, tall = (ends[:, 0] + random[:, k] * (ends[:, 1] - ends[:, 0]) for k, ends in ((3, width), (4, height)))
    result = corners(root, side, wide, tall)
    result[:, 2:] += offset(bending, random[:, 1], random[:, 2])[:, None]
    return result


def control_of(outline: Array, random: Array) -> tuple[Array, Array]:
    """Equation 6 for the left and the right edge, with the ranges of R1 and R2 exchanged."""
    r1, r2 = 0.75 + 0.5 * random[:, 5], -0.25 + 0.5 * random[:, 6]
    return control(outline[:, 0], outline[:, 3], r1, r2), control(outline[:, 1], outline[:, 2], r1, r2)


def edge(bottom: Array, h: Array, top: Array, quads: int) -> Array:
    """Points of one edge where a blade of so many quads is cut, (quads + 1, 3); of one blade."""
    v = np.arange(quads + 1) / quads
    return spline(*(np.broadcast_to(each, (len(v), 3)) for each in (bottom, h, top)), v)[0]


def on_quads(points: Array, left: Array, right: Array) -> tuple[Array, Array, Array]:
    """Distances of points (m, 3) from the quads between two edges (k + 1, 3), and u and v of the nearest place."""
    side, best = right[0] - left[0], np.full(len(points), np.inf)
    u, v = np.zeros(len(points)), np.zeros(len(points))
    for i in range(len(left) - 1):
        along = left[i + 1] - left[i]
        frame = np.stack([side, along], 1)
        at = np.clip(np.linalg.lstsq(frame, (points - left[i]).T, rcond=None)[0].T, 0, 1)
        away = np.linalg.norm(points - left[i] - at @ frame.T, axis=1)
        nearer = away < best
        best[nearer], u[nearer], v[nearer] = away[nearer], at[nearer, 0], (i + at[nearer, 1]) / (len(left) - 1)
    return best, u, v
