"""Where candidates of a tile lie, and how many are kept (sowing/sow.comp, sowing/sward.glsl)."""

import numpy as np

from oracles.hashing import hash3, unit

_MASK = 0xFFFFFFFF


def leaf_of(x: int, z: int, level: int, j: int, seed: int) -> tuple[int, int, int]:
    """Leaf (x, z) and index within it of candidate j of a tile: base-4 digits, scrambled per node."""
    while level:
        turn = hash3(x & _MASK, z & _MASK, (level + (seed << 5)) & _MASK)[0] >> 30
        child = (j & 3) ^ turn
        x, z, j, level = 2 * x + (child & 1), 2 * z + (child >> 1), j >> 2, level - 1
    return x, z, j


def clump_centres(xz: np.ndarray, clump_m: float, seed: int) -> np.ndarray:
    """The nearest clump centre of each point, (n, 2), among 5 x 5 jittered cells."""
    cells = np.floor(xz / clump_m).astype(np.int64)
    near = np.array([(i, j) for i in range(-2, 3) for j in range(-2, 3)])
    wanted = np.unique((cells[:, None] + near).reshape(-1, 2), axis=0)
    centre = {
        (int(x), int(z)): (
            np.array([x, z]) + unit(np.array(hash3(int(x) & _MASK, int(z) & _MASK, seed ^ 0x51ED270B)))[:2]
        )
        * clump_m
        for x, z in wanted
    }
    found = np.array([[centre[int(a), int(b)] for a, b in cell + near] for cell in cells])
    nearest = np.argmin(np.linalg.norm(found - xz[:, None], axis=2), axis=1)
    return found[np.arange(len(xz)), nearest]


def pull_into_clump(
    xz: np.ndarray, chance: np.ndarray, clump_m: float, clumping: float, blade_m: float, seed: int
) -> np.ndarray:
    """Roots (n, 2) after their clumps pulled: at most 0.35 of the way, and no farther than blades reach over gaps."""
    most = 0.35 * clumping * min(blade_m / clump_m, 1.0)
    return xz + (most * chance)[:, None] * (clump_centres(xz, clump_m, seed) - xz)


def kept_share(distance_m: np.ndarray, full_density_m: float) -> np.ndarray:
    """All up to the full-density distance; beyond it, as many per solid angle."""
    return np.minimum(1.0, (full_density_m / np.maximum(distance_m, 1e-3)) ** 2)


def slope_share(normal_y: np.ndarray, max_slope_deg: float) -> np.ndarray:
    """None on the steepest slope that is allowed, all from 0.04 of cosine below it."""
    return np.clip((normal_y - np.cos(np.radians(max_slope_deg))) / 0.04, 0.0, 1.0)
