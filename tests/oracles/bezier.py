"""Quadratic Bézier curves; arrays of points are (n, 3)."""

from itertools import pairwise

import numpy as np


def point(v0: np.ndarray, v1: np.ndarray, v2: np.ndarray, t: np.ndarray) -> np.ndarray:
    """By the Bernstein polynomials."""
    t = np.asarray(t)[..., None]
    return (1 - t) ** 2 * v0 + 2 * t * (1 - t) * v1 + t**2 * v2


def tangent(v0: np.ndarray, v1: np.ndarray, v2: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Half the derivative."""
    t = np.asarray(t)[..., None]
    return (1 - t) * (v1 - v0) + t * (v2 - v1)


def true_length(v0: np.ndarray, v1: np.ndarray, v2: np.ndarray, steps: int = 400) -> np.ndarray:
    """Arc length by many chords; each is the derivative in the middle of its step, times the step."""
    a, b = v1 - v0, v2 - 2.0 * v1 + v0
    t = (np.arange(steps) + 0.5) / steps
    squares = np.stack([(a * a).sum(-1), 2.0 * (a * b).sum(-1), (b * b).sum(-1)], -1) @ np.stack([t**0, t, t * t])
    return 2.0 * np.sqrt(np.maximum(squares, 0.0)).mean(-1)


def approximate_length(v0: np.ndarray, v1: np.ndarray, v2: np.ndarray) -> np.ndarray:
    """(2 L0 + (n - 1) L1) / (n + 1), n = 2 (Jahrmann & Wimmer 2017, after Gravesen 1997)."""
    chord = np.linalg.norm(v2 - v0, axis=-1)
    legs = np.linalg.norm(v1 - v0, axis=-1) + np.linalg.norm(v2 - v1, axis=-1)
    return (2.0 * chord + legs) / 3.0


def keep_length(v0: np.ndarray, v1: np.ndarray, v2: np.ndarray, length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Control point and tip with both legs scaled to the length (Jahrmann & Wimmer 2017)."""
    ratio = (length / true_length(v0, v1, v2))[:, None]
    control = v0 + ratio * (v1 - v0)
    return control, control + ratio * (v2 - v1)


def farthest_from_chords(v0: np.ndarray, v1: np.ndarray, v2: np.ndarray, segments: int) -> float:
    """Greatest distance of one curve, points (3,), from the polyline of this many equal steps."""
    knots = np.linspace(0.0, 1.0, segments + 1)
    worst = 0.0
    for a, b in pairwise(knots):
        p, q = (point(v0, v1, v2, np.array(t)) for t in (a, b))
        on_curve = point(v0, v1, v2, np.linspace(a, b, 21))
        along = np.clip((on_curve - p) @ (q - p) / max((q - p) @ (q - p), 1e-12), 0.0, 1.0)
        worst = max(worst, float(np.linalg.norm(on_curve - (p + along[:, None] * (q - p)), axis=1).max()))
    return worst
