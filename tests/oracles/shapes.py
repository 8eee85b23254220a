"""Outlines of a blade: how far from the left edge to the right one, at (u, v) (Jahrmann & Wimmer 2017)."""

import numpy as np


def parameter(shape: str, u: np.ndarray, v: np.ndarray, width_px: np.ndarray) -> np.ndarray:
    """The spec's formulas."""
    if shape == "quad":
        return u
    if shape == "triangle":
        return u + 0.5 * v * (1 - 2 * u)
    if shape in ("quadratic", "quadratic-3d"):
        return u - v**2 * u
    if shape == "minimum-width":
        # k rises from 0 to 1 as the blade's projected width falls from 3 to 1 pixels
        k = np.interp(width_px, [1.0, 3.0], [1.0, 0.0])
        return np.maximum(u - v**2 * u, k * u)
    if shape == "triangle-tip":
        taper = np.where(v <= 0.5, 0.0, 2.0 * v - 1.0)
        return u * (1.0 - taper) + 0.5 * taper
    raise ValueError(shape)


def fold(shape: str, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """How far the middle stands out, in widths."""
    return (0.5 - np.abs(u - 0.5)) * (1 - v) if shape == "quadratic-3d" else np.zeros_like(u * v)
