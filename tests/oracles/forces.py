"""Forces of the two papers on a blade's tip, and the state after them (motion/forces.glsl); arrays of points (n, 3).

Points are relative to the root. `c` stands for a column (n,) that multiplies vectors.
"""

import numpy as np

from oracles.bezier import keep_length


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (a * b).sum(-1)


def gravity_2024(g: float, forward: float, pull: np.ndarray, front: np.ndarray) -> np.ndarray:
    """Yan et al. 2024: gE + gF, gF = 0.25 |gE| * front."""
    return g * pull + forward * g * front


def gravity_2017(g: float, forward: float, pull, front, height, bend) -> np.ndarray:
    """Jahrmann & Wimmer 2017: (g^ |g| + front * height * |g| * 0.25) * height * bend."""
    h, b = height[:, None], bend[:, None]
    return (g * pull + front * h * g * forward) * h * b


def wind_force(wind: np.ndarray, blast: np.ndarray, tip: np.ndarray, up: np.ndarray, height) -> np.ndarray:
    """Both: w * (1 - |w^ . normalize(v2 - v0)|) * |(v2 - v0) . up| / height; a blast lacks the first factor."""
    w_hat = wind / np.maximum(np.linalg.norm(wind, axis=1), 1e-12)[:, None]
    along = _dot(w_hat, tip / np.linalg.norm(tip, axis=1)[:, None])
    ratio = np.abs(_dot(tip, up)) / height
    return (wind * (1 - np.abs(along))[:, None] + blast) * ratio[:, None]


def relaxed(tip, idle, force, rate, dt: float) -> np.ndarray:
    """d tip / dt = force + rate (idle - tip), solved exactly for a force that holds still."""
    rate = rate[:, None]
    rest = idle + force / rate
    return rest + (tip - rest) * np.exp(-rate * dt)


def correct(up: np.ndarray, height: np.ndarray, tip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Control point and tip: above the ground, v1 from the projection's length, both scaled to the length."""
    tip = tip - up * np.minimum(_dot(up, tip), 0)[:, None]
    l_proj = np.linalg.norm(tip - up * _dot(tip, up)[:, None], axis=1) / height
    control = up * (height * np.maximum(1 - l_proj, 0.05 * np.maximum(l_proj, 1)))[:, None]
    return keep_length(np.zeros_like(tip), control, tip, height)


def swing(tip, target, velocity, height, stiffness, random, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """A spring of damping 0.35 about the target, by 4000 small steps."""
    pace = (2.2 + 2.6 * np.mod(7.31 * random, 1.0)) / np.sqrt(np.maximum(height, 0.02))
    w = (1.8 * pace * (0.7 + 0.6 * stiffness))[:, None]
    x, v = tip - target, velocity.copy()
    h = dt / 4000
    for _ in range(4000):
        v_half = v + 0.5 * h * (-w * w * x - 0.7 * w * v)
        x = x + h * v_half
        v = v_half + 0.5 * h * (-w * w * x - 0.7 * w * v_half)
    return target + x, v
