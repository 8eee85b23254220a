"""Equation 1 of Jahrmann & Wimmer 2013: the terrain map over the tile's texture by its alpha."""

import numpy as np


def ground_colour(tile: np.ndarray, terrain_map: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    return terrain_map * alpha + tile * (1.0 - alpha)
