"""Jahrmann & Wimmer 2013: a blade as a quad bent along two splines. Arrays are float64, of blades (n,) or (n, 3)."""

import numpy as np

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
