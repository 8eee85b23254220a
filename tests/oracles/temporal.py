"""Temporal anti-aliasing: resampling, colour space and clipping."""

import numpy as np


def catmull_rom(f: np.ndarray) -> np.ndarray:
    """Weights (n, 4) of the points −1, 0, 1 and 2 at f in 0..1: the cardinal spline (Catmull & Rom 1974)."""
    hermite = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [-3, 3, -2, -1], [2, -2, 1, 1]])  # values, then slopes
    slopes = np.array([[0, 1, 0, 0], [0, 0, 1, 0], [-0.5, 0, 0.5, 0], [0, -0.5, 0, 0.5]])
    result: np.ndarray = np.power.outer(f, np.arange(4)) @ hermite @ slopes
    return result


def resample(texels: np.ndarray, at_px: np.ndarray) -> np.ndarray:
    """Texels (rows, columns, channels) at points (n, 2), x and y from the first texel's corner, clamped at edges."""
    first = np.floor(at_px - 0.5).astype(int)
    weights = catmull_rom(at_px - 0.5 - first)  # (n, 2, 4)
    rows, columns = (
        np.clip(first[:, axis, None] + np.arange(-1, 3), 0, texels.shape[1 - axis] - 1) for axis in (1, 0)
    )
    taps = texels[rows[:, :, None], columns[:, None, :]]
    result: np.ndarray = np.einsum("nyxc,ny,nx->nc", taps, weights[:, 1], weights[:, 0])
    return result


YCOCG = np.array([[0.25, 0.5, 0.25], [0.5, 0.0, -0.5], [-0.25, 0.5, -0.25]])
"""From RGB (Malvar & Sullivan 2003, with the chroma halved)."""


def clip(c: np.ndarray, mean: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Colours moved towards the mean until they lie within reach of it on every axis (Salvi 2016)."""
    scale = 1.0 / np.maximum(1.0, (np.abs(c - mean) / np.maximum(reach, 1e-4)).max(-1, keepdims=True))
    result: np.ndarray = mean + (c - mean) * scale
    return result
