"""Fog whose density falls with height, and its tint (Derstroff, "Realtime grass", section 3.3), in float64."""

import numpy as np

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def depth(per_m: float, level_m: float, scale_m: float, from_y: float, ray_y: float, distance_m: float) -> float:
    """Extinction along a ray, summed in small steps."""
    along = (np.arange(200_000) + 0.5) / 200_000 * distance_m
    return float((per_m * np.exp((level_m - from_y - ray_y * along) / scale_m)).mean() * distance_m)


def tint(
    away: np.ndarray, towards: np.ndarray, sharpness: float, cosine: np.ndarray, sky: np.ndarray, sun: np.ndarray
) -> np.ndarray:
    """Light (n, 3) of fog in directions at these cosines to the sun, below a sky of this mean and a sun, (3,)."""
    t = np.maximum(cosine, 0.0)[:, None] ** sharpness
    sky, sun = sky @ _LUMINANCE, sun @ _LUMINANCE
    return (1.0 - t) * away * (sky + 0.06 * sun) + t * towards * (sky + 0.15 * sun)
