"""Unit vectors in two numbers (Cigolle et al. 2014), the y axis in the middle of the square."""

import numpy as np


def encode(n: np.ndarray) -> np.ndarray:
    """(n, 3) to (n, 2) in -1..1."""
    flat = n / np.abs(n).sum(axis=1, keepdims=True)
    x, z = flat[:, 0], flat[:, 2]
    # the lower half folds outward over the edges of the diamond
    folded = np.stack([(1 - np.abs(z)) * np.where(x >= 0, 1, -1), (1 - np.abs(x)) * np.where(z >= 0, 1, -1)], 1)
    return np.where(flat[:, 1:2] >= 0, flat[:, [0, 2]], folded)


def decode(e: np.ndarray) -> np.ndarray:
    """(n, 2) to unit vectors (n, 3)."""
    y = 1 - np.abs(e).sum(axis=1)
    unfolded = (1 - np.abs(e[:, ::-1])) * np.where(e >= 0, 1, -1)
    xz = np.where(y[:, None] >= 0, e, unfolded)
    n = np.stack([xz[:, 0], y, xz[:, 1]], 1)
    return n / np.linalg.norm(n, axis=1, keepdims=True)
