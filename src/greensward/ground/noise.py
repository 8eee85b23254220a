"""Simplex noise in NumPy: the twin of `shaders/noise.glsl`, bit for bit in its hash."""

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
_BLOCK = 1 << 14
_F, _G = (np.sqrt(3.0) - 1.0) / 2.0, (3.0 - np.sqrt(3.0)) / 6.0


def hash3(
    x: npt.NDArray[np.uint32], y: npt.NDArray[np.uint32], z: npt.NDArray[np.uint32] | np.uint32
) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32], npt.NDArray[np.uint32]]:
    """pcg3d of Jarzynski & Olano 2020, listing 2; arrays of uint32."""
    step, add, shift = np.uint32(1664525), np.uint32(1013904223), np.uint32(16)
    with np.errstate(over="ignore"):
        a, b, c = (np.asarray(v, np.uint32) * step + add for v in (x, y, z))
        a = a + b * c
        b = b + c * a
        c = c + a * b
        a, b, c = a ^ (a >> shift), b ^ (b >> shift), c ^ (c >> shift)
        a = a + b * c
        b = b + c * a
        c = c + a * b
    return a, b, c


def _corner(dx: Array, dy: Array, i: npt.NDArray[np.int64], j: npt.NDArray[np.int64], seed: int) -> Array:
    bits = hash3(i.astype(np.uint32), j.astype(np.uint32), np.uint32(seed & 0xFFFFFFFF))
    gx, gy = ((b >> np.uint32(8)) / 8388608.0 - 1.0 for b in bits[:2])
    t = np.maximum(0.5 - dx * dx - dy * dy, 0.0) ** 2
    result: Array = t * t * (gx * dx + gy * dy)
    return result


def simplex(x: npt.ArrayLike, y: npt.ArrayLike, seed: int = 0) -> Array:
    """Simplex noise at the points (x, y), about −1 to 1; float64 of the broadcast shape (Gustavson 2005)."""
    px, py = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
    skew = (px + py) * _F
    cx, cy = np.floor(px + skew), np.floor(py + skew)
    unskew = (cx + cy) * _G
    dx, dy = px - cx + unskew, py - cy + unskew
    i, j = cx.astype(np.int64), cy.astype(np.int64)
    right = (dx > dy).astype(np.int64)
    total: Array = (
        _corner(dx, dy, i, j, seed)
        + _corner(dx - right + _G, dy - (1 - right) + _G, i + right, j + 1 - right, seed)
        + _corner(dx - 1.0 + 2.0 * _G, dy - 1.0 + 2.0 * _G, i + 1, j + 1, seed)
    )
    return 118.0 * total


def octaves(x: npt.ArrayLike, y: npt.ArrayLike, seed: int, count: int, gain: float, lacunarity: float) -> Array:
    """Octaves of simplex noise with different seeds, turned against each other, about −1 to 1."""
    px, py = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
    if px.size <= _BLOCK or len(px) < 2:
        return _octaves(px, py, seed, count, gain, lacunarity)
    # rows that fit into a processor's cache, on all processors: NumPy lets others run
    parts = min(-(-px.size // _BLOCK), len(px))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        done = pool.map(
            lambda px, py: _octaves(px, py, seed, count, gain, lacunarity),
            np.array_split(px, parts),
            np.array_split(py, parts),
        )
        return np.concatenate([*done])


def _octaves(px: Array, py: Array, seed: int, count: int, gain: float, lacunarity: float) -> Array:
    total = np.zeros(px.shape)
    weight = weights = 1.0
    for i in range(count):
        total += weight * simplex(px, py, seed + 101 * i)
        px, py = lacunarity * (0.8 * px - 0.6 * py), lacunarity * (0.6 * px + 0.8 * py)
        weight *= gain
        weights += weight
    return total / (weights - weight)
