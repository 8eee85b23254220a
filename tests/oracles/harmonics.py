"""Real spherical harmonics up to order 2, from their closed forms with the constants as roots."""

import numpy as np


def basis(d: np.ndarray) -> np.ndarray:
    """(n, 3) to (n, 9), in the order of Ramamoorthi & Hanrahan 2001."""
    x, y, z = d.T
    k0, k1 = np.sqrt(1 / (4 * np.pi)), np.sqrt(3 / (4 * np.pi))
    k2, k3, k4 = np.sqrt(15 / (4 * np.pi)), np.sqrt(5 / (16 * np.pi)), np.sqrt(15 / (16 * np.pi))
    one = np.ones_like(x)
    return np.stack(
        [
            k0 * one,
            k1 * y,
            k1 * z,
            k1 * x,
            k2 * x * y,
            k2 * y * z,
            k3 * (3 * z**2 - 1),
            k2 * x * z,
            k4 * (x**2 - y**2),
        ],
        1,
    )
