"""Forces that press grass down (motion/force_map.glsl, motion/outlines.py)."""

import numpy as np


def press_left(age: np.ndarray, fades: float | None, always: bool) -> np.ndarray:
    """A smooth step of 0.15 s from the press on, times (e^(-3 age / fades) - e^-3) / (1 - e^-3), which is left."""
    x = np.clip(age / 0.15, 0, 1)
    come = np.ones_like(age) if always else x * x * (3 - 2 * x)
    if fades is None:
        return come
    part = np.clip(age / fades, 0, 1)
    return come * (np.exp(-3 * part) - np.exp(-3)) / (1 - np.exp(-3))


def around(distance: np.ndarray, normal: np.ndarray, rim: float, impact: float) -> np.ndarray:
    """Jahrmann & Wimmer 2013, section 5.2: down inside, outwards at the border, and ever shorter around it."""
    angle = np.pi / 2 * np.clip(1 + distance / rim, 0, 1)
    length = np.where(distance < 0, 1.0, np.clip(1 - distance / impact, 0, 1) ** 2)
    aside = length * np.sin(angle)
    return np.stack([aside * normal[:, 0], -np.cos(angle), aside * normal[:, 1]], 1)


def distances(mask: np.ndarray) -> np.ndarray:
    """Of every cell to the nearest that is set, by trying all."""
    rows, columns = np.nonzero(mask)
    at = np.indices(mask.shape)
    return np.sqrt((at[0][..., None] - rows) ** 2 + (at[1][..., None] - columns) ** 2).min(-1)
