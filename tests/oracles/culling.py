"""Tests of blades, and the pyramid of farthest depths (src/greensward/culling)."""

import numpy as np


def pyramid(depth: np.ndarray, levels: int) -> list[np.ndarray]:
    """Maxima over squares of 2, 4, 8, … pixels, each from the picture itself; the last ones cover what is left."""
    result = []
    for size in 2 ** np.arange(1, levels + 1):
        rows, columns = (np.arange(0, n, size) for n in depth.shape)
        result.append(np.maximum.reduceat(np.maximum.reduceat(depth, rows, axis=0), columns, axis=1))
    return result


def hull_samples(v0: np.ndarray, v1: np.ndarray, v2: np.ndarray, width_m: float, count: int, seed: int) -> np.ndarray:
    """Points of the curves, moved by up to half a width to any side: (count, n, 3)."""
    random = np.random.default_rng(seed)
    t = random.uniform(0, 1, (count, 1, 1))
    curve = (1 - t) ** 2 * v0 + 2 * t * (1 - t) * v1 + t**2 * v2
    side = random.normal(size=(count, len(v0), 3))
    return curve + 0.5 * width_m * side / np.linalg.norm(side, axis=2, keepdims=True)


def clip(points: np.ndarray, clip_from_world: np.ndarray) -> np.ndarray:
    return points @ clip_from_world[:, :3].T + clip_from_world[:, 3]


def share_of_width(to_viewer: np.ndarray, side: np.ndarray, limit: float) -> np.ndarray:
    """Jahrmann & Wimmer 2017: nothing where |view · side| is at least the limit; all of it 0.15 before."""
    alignment = np.abs(np.einsum("ij,ij->i", to_viewer, side))
    t = np.clip((alignment - (limit - 0.15)) / 0.15, 0.0, 1.0)
    return 1.0 - t * t * (3.0 - 2.0 * t)


def presence(rank: np.ndarray, distance: np.ndarray, full_m: float, reach_m: float, density: float) -> np.ndarray:
    """1 where a blade is fully there, 0 where distance leaves it out; it grows in by its rank."""
    risen = (full_m / np.maximum(distance, 1e-3)) ** 2 * density
    t = np.clip((distance / reach_m - 0.82) / 0.18, 0.0, 1.0)
    there = (1.0 - t * t * (3.0 - 2.0 * t)) * np.clip((risen - rank) / (0.2 * risen), 0.0, 1.0)
    return np.where(rank > density, 0.0, there)


def area_there(distance: np.ndarray, full_m: float, reach_m: float, density: float) -> np.ndarray:
    """Area of the blades that are there as a part of that of all; those growing in are shorter, at first narrower."""
    rank = (np.arange(20_000)[:, None] + 0.5) / 20_000
    here = presence(rank, distance, full_m, reach_m, density)
    return (here * np.minimum(1.0, 2.0 * here)).mean(axis=0)


def layers(crowding: float, slant: np.ndarray, width_m: np.ndarray) -> np.ndarray:
    """Blades that a ray passes where all are there: metres of blade on a square metre, of this mean width."""
    return crowding * 0.5 * width_m * np.hypot(0.9 * np.sqrt(1.0 - slant**2), 0.4 * slant) / slant


def share_of_area(
    layers: np.ndarray, there: np.ndarray, width_m: np.ndarray, least_m: np.ndarray, length_m: float
) -> np.ndarray:
    """Of the area of all blades, what closes the sward six times, but at least what those kept have
    unwidened; none is broader than 0.12 of its length or 3 times the least."""
    asked = np.clip(6.0 / layers, there, 1.0)
    return np.minimum(asked, there * np.maximum(1.0, np.maximum(0.12 * length_m, 3.0 * least_m) / width_m))
