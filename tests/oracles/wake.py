"""The wind field behind movers (greensward/motion/wake.py), cell by cell: Derstroff, section 2.3."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

Cells = dict[tuple[int, int], tuple[float, float]]
"""Velocities by the numbers of cells along x and z."""


def stepped(
    cells: Cells, camera_xz, movers: Sequence[Sequence[float]], wake: Mapping[str, float], dt: float
) -> Cells:
    """One step: v = damping * v + a' * dt, in the square of cells around the camera's.

    A mover is x, z, its height above the ground, and its velocity along x and z.
    """
    half, size = int(wake["cells"]) // 2, wake["cell_m"]
    middle_i, middle_j = (math.floor(at / size) for at in camera_xz)
    result: Cells = {}
    for i in range(middle_i - half, middle_i + half + 1):
        for j in range(middle_j - half, middle_j + half + 1):
            vx, vz = (wake["damping"] ** dt * v for v in cells.get((i, j), (0.0, 0.0)))
            for x, z, above, ax, az in movers:
                dx = ((i + 0.5) * size - x) / wake["reach_m"]
                dz = ((j + 0.5) * size - z) / wake["reach_m"]
                dy = above / wake["reach_m"]
                falls = math.exp(-(dx**2 + dz**2 + dy**2))
                kx, kz = dx * falls, dz * falls
                k, speed = math.hypot(kx, kz), math.hypot(ax, az)
                if k == 0.0:
                    continue
                along = (kx * ax + kz * az) / speed if speed > 0 else 0.0
                a = min(max(along, 0.0), 1.0) * wake["strength"] * speed
                a += wake.get("downwash_mps2", 0.0) * math.sqrt(2.0 * math.e) * k
                vx, vz = vx + a * kx / k * dt, vz + a * kz / k * dt
            result[i, j] = vx, vz
    return result


def looked_up(velocities: np.ndarray, origin, cell_m: float, x: float, z: float) -> np.ndarray:
    """Bilinear between the centres of the four cells around a point; velocities (z, x, 2), zero beyond them."""
    u, v = x / cell_m - 0.5, z / cell_m - 0.5
    i, j = math.floor(u), math.floor(v)
    total = np.zeros(2)
    for column, row, weight in (
        (i, j, (1 - (u - i)) * (1 - (v - j))),
        (i + 1, j, (u - i) * (1 - (v - j))),
        (i, j + 1, (1 - (u - i)) * (v - j)),
        (i + 1, j + 1, (u - i) * (v - j)),
    ):
        column, row = column - origin[0], row - origin[1]
        if 0 <= row < len(velocities) and 0 <= column < len(velocities):
            total += weight * velocities[row, column]
    return total
