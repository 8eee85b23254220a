"""The other winds (motion/strong.glsl and its neighbours): velocities (n, 3) at points (n, 3)."""

import numpy as np

from oracles.hashing import hashes, unit


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def towards(direction_deg: float) -> np.ndarray:
    """Where a wind blows to that comes from this compass direction."""
    angle = np.radians(direction_deg)
    return np.array([-np.sin(angle), 0.0, np.cos(angle)])


def strong(p: np.ndarray, t: float, direction_deg, power, speed, interval, steadiness) -> np.ndarray:
    """Yan et al. 2024: windDir * power * cos((v0 . windDir - speed * t) / interval)."""
    d = towards(direction_deg)
    wave = np.cos((p @ d - speed * t) / interval)
    return (power * ((1 - steadiness) * wave + steadiness))[:, None] * d


def helicopter_as_published(p: np.ndarray, t: float, centre, radius, period, power, speed, interval, steadiness):
    """Yan et al. 2024: direction normalize(-1, 0, 1) + v0 from the circling centre, times the wave along it."""
    angle = 2 * np.pi * t / period
    v0 = p - [centre[0] + radius * np.cos(angle), 0.0, centre[1] + radius * np.sin(angle)]
    v0[:, 1] = 0.0
    direction = np.array([-1.0, 0.0, 1.0]) / np.sqrt(2) + v0
    wave = np.cos(((v0 * direction).sum(1) - speed * t) / interval)
    return (power * ((1 - steadiness) * wave + steadiness))[:, None] * direction


def helicopter(
    p: np.ndarray, t: float, centre, radius, period, rotor, power, speed, interval, steadiness
) -> np.ndarray:
    """Yan et al. 2024 about a circling centre: direction normalize(-1, 0, 1) * 0.05 rotor + v0, normalised."""
    angle = 2 * np.pi * t / period
    offset = p[:, [0, 2]] - np.array(centre) - radius * np.array([np.cos(angle), np.sin(angle)])
    outward = _unit(np.array([-1.0, 1.0]) / np.sqrt(2) * 0.05 * rotor + offset)
    away = np.linalg.norm(offset, axis=1)
    rims = 2 * away / rotor
    wave = np.cos((away - speed * t) / interval)
    strength = power * ((1 - steadiness) * wave + steadiness) * 2 * rims / (1 + rims**2)
    return np.stack([outward[:, 0] * strength, np.zeros(len(p)), outward[:, 1] * strength], 1)


def random(p: np.ndarray, t: float, seed: int, power, period) -> np.ndarray:
    """Yan et al. 2024: random3(v0) * 3 * sin(t)."""
    cell = np.floor(p.astype(np.float32) * np.float32(100)).astype(np.int64).astype(np.uint32)
    bits = hashes(cell ^ np.uint32(seed))
    direction = 2.0 * (bits >> np.uint32(8)) / 2**24 - 1.0
    return direction * power * np.sin(2 * np.pi * t / period)


def phase(random: np.ndarray, facing: np.ndarray) -> np.ndarray:
    """Phase of a blade of the ground in turns: a hash of its random number (16 bits) and of the bits of its angle."""
    bits = facing.astype(np.float32).view(np.uint32)
    return unit(hashes(np.column_stack([random, bits, np.ones(len(bits))]).astype(np.uint32))[:, 0])


def idle(phase: np.ndarray, t: float, direction_deg, speed, period) -> np.ndarray:
    """Derstroff, section 2.6: (1, 0, 1) * sin(phi + mod(t, f) / f * 2 pi) * s."""
    turned = np.sin(2 * np.pi * phase + np.mod(t, period) / period * 2 * np.pi)
    return (speed * turned)[:, None] * towards(direction_deg)


def waves(p: np.ndarray, t: float, direction_deg, speed, rate) -> np.ndarray:
    """Jahrmann & Wimmer 2017: (1 - max(c, 0))^2, c a third of

    cos(0.75 (x + z) + f) + sin(0.5 (x + y) + f) + sin(0.25 (y + z) + f).
    """
    x, y, z = p.T
    f = 2 * np.pi * rate * t
    crest = (np.cos(0.75 * (x + z) + f) + np.sin(0.5 * (x + y) + f) + np.sin(0.25 * (y + z) + f)) / 3
    return (speed * (1 - np.maximum(crest, 0)) ** 2)[:, None] * towards(direction_deg)


def _attenuation(scaled: np.ndarray) -> np.ndarray:
    return np.maximum(1 - np.log2(scaled + 1) / 4, 0)


def blast(p: np.ndarray, t: float, centre, power, rate) -> np.ndarray:
    """Jahrmann & Wimmer 2017: attenuation max(1 - log2(0.2 d + 1) / 4, 0), ring 1 - max(sin(0.4 d - 4 t), 0)."""
    outward = p - np.array(centre)
    d = np.linalg.norm(outward, axis=1)
    ring = 1 - np.maximum(np.sin(0.4 * d - rate * t), 0)
    return _unit(outward) * (power * _attenuation(0.2 * d) * ring)[:, None]


def whirl(p: np.ndarray, t: float, centre, power, swirl, rate) -> np.ndarray:
    """Jahrmann & Wimmer 2017: outwards, and around by 10 (1 - attenuation^2), in phase sin^3(0.1 d - 1.5 t)."""
    outward = p - np.array(centre)
    d = np.linalg.norm(outward, axis=1)
    outward = _unit(outward)
    around = np.stack([outward[:, 2], np.zeros(len(p)), -outward[:, 0]], 1)
    a = _attenuation(0.5 * d)
    both = power * outward + (swirl * 10 * (1 - a**2))[:, None] * around
    return both * (a * np.sin(0.1 * d - rate * t) ** 3)[:, None]


def ripples(p: np.ndarray, t: float, direction_deg, speed, wave, swell, front, epsilon, rate) -> np.ndarray:
    """Jahrmann & Wimmer 2013, Eq. 9: sin(c1 a) cos(c3 a), a = pi px + t + pi / 4 / (|cos(c2 pi pz)| + eps).

    With px against the wind, pz to its left seen from there, and c1 t a turn for every crest.
    """
    c1, c2, c3 = 2 / wave, 1 / front, 2 / swell
    d = towards(direction_deg)
    px, pz = -(p @ d), p @ np.array([d[2], 0.0, -d[0]])
    a = np.pi * px + 2 * np.pi * rate * t / c1 + np.pi / 4 / (np.abs(np.cos(c2 * np.pi * pz)) + epsilon)
    return (speed * np.sin(c1 * a) * np.cos(c3 * a))[:, None] * d
