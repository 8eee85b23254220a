"""Age of a blade, what its age makes of it, and how an object carries it (sowing/growth.glsl, sowing/carry.comp)."""

import numpy as np

from oracles.hashing import hashes, unit


def lateness(roots: np.ndarray) -> np.ndarray:
    """0 for the first, towards 1 for the last, from the bits of the roots as float32 (n, 3)."""
    return unit(hashes(np.ascontiguousarray(roots, np.float32).view(np.uint32)))[:, 0]


def age(roots: np.ndarray, field_age: float, time_s: float, full_after_s: float, spread: float) -> np.ndarray:
    """The field's age runs from seeds at 0 to the last blade's full growth; each blade lags by its lateness."""
    phase = np.clip(field_age * (1.0 + spread) + time_s / full_after_s, 0.0, 1.0 + spread)
    return np.clip(phase - spread * lateness(roots), 0.0, 1.0)


def factor(curve: tuple[tuple[float, float], ...], ages: np.ndarray) -> np.ndarray:
    """Straight between the keys, level outside."""
    keys = np.array(curve)
    return np.interp(ages, keys[:, 0], keys[:, 1])


def front(up: np.ndarray, facing: np.ndarray) -> np.ndarray:
    """Where blades lean that face this angle about up, (n, 3)."""
    helper = np.where(np.abs(up[:, :1]) < 0.9, [1.0, 0, 0], [0, 0, 1.0])
    east = np.cross(helper, up)
    east /= np.linalg.norm(east, axis=1, keepdims=True)
    return np.cos(facing)[:, None] * east + np.sin(facing)[:, None] * np.cross(up, east)


def moved(points: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Points (n, 3) by a matrix (4, 4)."""
    return points @ matrix[:3, :3].T + matrix[:3, 3]
