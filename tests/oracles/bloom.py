"""Bloom (Derstroff, "Realtime grass", section 3.1) in float64; pictures are (rows, columns, 3)."""

import numpy as np

BLOCK, BRIGHTEST = 4, 16.0


def bright(exposed: np.ndarray, threshold: float) -> np.ndarray:
    """Means of the bright light of blocks; those at the edge repeat the last pixels."""
    luminance = exposed @ np.array([0.3, 0.59, 0.11])
    kept = np.where(luminance >= threshold, np.minimum(1.0, BRIGHTEST / np.maximum(luminance, 1e-9)), 0.0)
    light = exposed * kept[..., None]
    rows, columns = (-(-side // BLOCK) * BLOCK for side in luminance.shape)
    wide = np.pad(light, ((0, rows - light.shape[0]), (0, columns - light.shape[1]), (0, 0)), "edge")
    return wide.reshape(rows // BLOCK, BLOCK, columns // BLOCK, BLOCK, 3).mean(axis=(1, 3))


def spread(light: np.ndarray, sigma: float) -> np.ndarray:
    """Filter along both axes by a Gaussian, cut at three standard deviations."""
    reach = int(np.ceil(3.0 * sigma))
    weights = np.exp(-0.5 * np.arange(-reach, reach + 1) ** 2 / sigma**2)
    weights /= weights.sum()
    for axis in (1, 0):
        padding = [(reach, reach) if k == axis else (0, 0) for k in range(3)]
        wide = np.pad(light, padding, "edge")
        light = sum(w * np.take(wide, np.arange(light.shape[axis]) + k, axis) for k, w in enumerate(weights))
    return light


def enlarged(light: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """Interpolate linearly between the middles of blocks."""
    for axis, count in ((0, rows), (1, columns)):
        at = np.clip((np.arange(count) + 0.5) / BLOCK - 0.5, 0.0, light.shape[axis] - 1.0)
        low = np.minimum(np.floor(at).astype(int), light.shape[axis] - 1)
        high = np.minimum(low + 1, light.shape[axis] - 1)
        part = (at - low).reshape([-1 if k == axis else 1 for k in range(3)])
        light = (1.0 - part) * np.take(light, low, axis) + part * np.take(light, high, axis)
    return light
