"""Colour of the grass by place, in float64: octaves of noise, and the green of a picture."""

import numpy as np

from greensward.ground.noise import octaves


def light(srgb: np.ndarray) -> np.ndarray:
    """Linear light of 8-bit sRGB values (IEC 61966-2-1)."""
    c = np.asarray(srgb, np.float64) / 255.0
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def noise_colour(noises: list[dict], low: np.ndarray, high: np.ndarray, seed: int, xz: np.ndarray) -> np.ndarray:
    """Linear colour (n, 3): each channel the weighted mean of its noises, midway where it is 0."""
    colour = np.empty((len(xz), 3))
    for channel, name in enumerate(("red", "green", "blue")):
        sum_, weights = np.zeros(len(xz)), 0.0
        for i, n in enumerate(noises):
            if n["channel"] in (name, "all"):
                at = xz / n["wavelength_m"]
                sum_ += n["weight"] * octaves(*at.T, seed + 7001 + 331 * i, n["octaves"], n["gain"], n["lacunarity"])
                weights += n["weight"]
        part = np.clip(0.5 + (sum_ / weights if weights else 0.0), 0.0, 1.0)
        colour[:, channel] = low[channel] + part * (high[channel] - low[channel])
    return colour


def green_of(picture: np.ndarray, greenness: float, neighbours: int, repeats: bool) -> tuple[np.ndarray, np.ndarray]:
    """Linear colours (rows, columns, 3) and where grass grows, texel by texel, looking farther and farther around."""
    rows, columns, _ = picture.shape
    srgb = picture[..., :3].astype(np.float64)
    index = (2 * srgb[..., 1] - srgb[..., 0] - srgb[..., 2]) / np.maximum(srgb.sum(-1), 1e-9)
    green, linear = index >= greenness, light(srgb)
    colours, grows = np.full((rows, columns, 3), linear[green].mean(axis=0)), green.copy()
    for i in range(rows):
        for j in range(columns):
            for reach in range(neighbours + 1):
                around = [
                    ((i + a) % rows, (j + b) % columns)
                    for a in range(-reach, reach + 1)
                    for b in range(-reach, reach + 1)
                    if repeats or (0 <= i + a < rows and 0 <= j + b < columns)
                ]
                found = [linear[place] for place in around if green[place]]
                if found:
                    colours[i, j], grows[i, j] = np.mean(found, axis=0), True
                    break
    return colours, grows
