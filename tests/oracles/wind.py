"""Travelling gusts, and how a blade bends in them (motion/gusts.glsl, motion/pose.glsl)."""

import numpy as np

from greensward.ground.noise import simplex
from oracles.bezier import keep_length


def smoothstep(low: float, high: float, x: np.ndarray) -> np.ndarray:
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def gusts(wind: dict[str, float], seed: int, p: np.ndarray, time_s: float | np.ndarray) -> np.ndarray:
    """Velocity at points (n, 3) and the speed of small eddies: (n, 4)."""
    azimuth = np.radians(wind["direction_deg"])
    direction = np.array([-np.sin(azimuth), np.cos(azimuth)])  # x, z, where it blows to
    across = np.array([-direction[1], direction[0]])
    speed, size = wind["speed_mps"], wind["gust_m"]
    x = (p[:, [0, 2]] @ direction - speed * time_s) / size
    y = 0.55 * (p[:, [0, 2]] @ across) / size
    front = simplex(x, y, seed + 17)
    ripple = simplex(2.7 * x - 0.35 * speed * time_s / size, 2.7 * y + 5.3, seed + 29)
    gust = smoothstep(-0.55, 0.85, 0.75 * front + 0.35 * ripple)
    strength = speed * (1 + wind["gustiness"] * (0.25 + 1.6 * gust - 1))
    swerve = 0.35 * wind["turbulence"] * ripple
    velocity = strength[:, None] * (direction + swerve[:, None] * across)
    return np.stack([velocity[:, 0], np.zeros(len(p)), velocity[:, 1], strength * wind["turbulence"]], 1)


def lean(speed_mps: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Radians; half of 1.25 at 7 m/s times 0.45 for the softest to 2.2 for the stiffest."""
    half = 7.0 * (0.45 + (2.2 - 0.45) * stiffness)
    return 1.25 * speed_mps**2 / (speed_mps**2 + half**2)


def sag(root, tip, up, height, stiffness, pull) -> np.ndarray:
    """How far weight moves the tip of a blade that does not grow upwards: (n, 3)."""
    down = (pull * up).sum(1)[:, None]
    h = height[:, None]
    return (1 - 0.6 * stiffness)[:, None] * (
        0.55 * h * (pull - down * up) + 0.6 * np.maximum(down, 0) * (h * up - (tip - root))
    )


def stand(
    root: np.ndarray,
    control: np.ndarray,
    tip: np.ndarray,
    up: np.ndarray,
    height: np.ndarray,
    stiffness: np.ndarray,
    random: np.ndarray,
    wind: np.ndarray,
    time_s: float,
    swing: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Control points and tips (n, 3) of blades in a wind (n, 4) at a time, under gravity that pulls down.

    Each bobs at a pace and from a start of its own, unless `swing` (n,) tells the angle.
    """
    sunk = sag(root, tip, up, height, stiffness, np.broadcast_to([0.0, -1.0, 0.0], root.shape))
    control, tip = control + 0.3 * sunk, tip + sunk
    speed = np.linalg.norm(wind[:, :3], axis=1)
    downwind = wind[:, :3] / np.maximum(speed, 1e-9)[:, None]
    crosswind = np.cross(up, downwind)
    if swing is None:
        pace = (2.2 + 2.6 * np.mod(7.31 * random, 1.0)) / np.sqrt(np.maximum(height, 0.02))
        swing = pace * time_s + 2 * np.pi * random
    flutter = wind[:, 3] * (1 - 0.7 * stiffness)
    bob_middle, bob_tip = flutter * np.sin(swing), flutter * np.sin(swing + 0.9)
    sway_middle, sway_tip = (0.35 * flutter * np.sin(0.73 * swing + phase) for phase in (1.3, 2.2))
    at_tip, at_middle = (lean(np.maximum(speed + bob, 0.0), stiffness) for bob in (bob_tip, bob_middle))
    aside_tip, aside_middle = (sway / (np.abs(sway) + 9.0) for sway in (sway_tip, sway_middle))

    def column(x: np.ndarray) -> np.ndarray:
        return x[:, None]

    v2 = tip + column(height) * (
        column(np.sin(at_tip)) * downwind - 0.8 * column(1 - np.cos(at_tip)) * up + column(aside_tip) * crosswind
    )
    v1 = control + 0.32 * column(height) * (column(np.sin(at_middle)) * downwind + column(aside_middle) * crosswind)
    still = column(speed < 1e-4)
    v1, v2 = np.where(still, control, v1), np.where(still, tip, v2)
    for v in (v1, v2):
        v += up * column(np.maximum(0.06 * height - ((v - root) * up).sum(1), 0.0))
    return keep_length(root, v1, v2, height)
