"""The blur of Jahrmann & Wimmer 2013, section 6.4, in float64."""

import numpy as np


def depth_value(depth_m: np.ndarray, near_m: float, far_m: float) -> np.ndarray:
    """1 at the near plane, 0 at the far one and beyond."""
    with np.errstate(invalid="ignore"):
        value = near_m * (far_m - depth_m) / (depth_m * (far_m - near_m))
    return np.where(np.isinf(depth_m), 0.0, np.clip(value, 0.0, 1.0))


def row(colours: np.ndarray, depth_m: np.ndarray, near_m: float, far_m: float, gaussian: bool) -> np.ndarray:
    """Blur a picture (rows, columns, 3) along its rows; the last pixels go on beyond its edge."""
    if gaussian:
        kernel = np.exp(-(np.arange(4.0) ** 2) / (2 * 1.8**2))
        kernel /= kernel[0] + 2 * kernel[1:].sum()
    else:
        kernel = np.full(4, 1 / 7)
    middle = np.maximum(depth_value(depth_m, near_m, far_m), kernel[0])
    others = (1 - middle) / (1 - kernel[0])
    wide = np.pad(colours, ((0, 0), (3, 3), (0, 0)), "edge")
    deep = np.pad(depth_m, ((0, 0), (3, 3)), "edge")
    columns = colours.shape[1]
    at = lambda a, step: a[:, 3 + step : 3 + step + columns]  # noqa: E731
    total, weight = middle[..., None] * colours, middle.copy()
    for side in (-1, 1):
        # pixels 1 and 2 are one look-up: both go if either is much nearer
        for steps in ((1, 2), (3,)):
            keep = np.min([at(deep, side * step) for step in steps], axis=0) >= 0.5 * depth_m
            for step in steps:
                w = keep * others * kernel[step]
                total += w[..., None] * at(wide, side * step)
                weight += w
    return total / weight[..., None]
