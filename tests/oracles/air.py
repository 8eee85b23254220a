"""The clear atmosphere (passes/sky/air.glsl; coefficients of Hillaire 2020)."""

import numpy as np

EARTH_KM, AIR_KM = 6360.0, 6460.0
RAYLEIGH, OZONE = np.array([5.802e-3, 13.558e-3, 33.1e-3]), np.array([0.650e-3, 1.881e-3, 0.085e-3])
MIE_SCATTER, MIE_EXTINCTION = 3.996e-3, 3.996e-3 * 1.11


def rayleigh_phase(mu: np.ndarray) -> np.ndarray:
    return 3.0 / (16.0 * np.pi) * (1.0 + mu**2)


def mie_phase(mu: np.ndarray, g: float = 0.76) -> np.ndarray:
    """Cornette & Shanks 1992."""
    return 3.0 / (8.0 * np.pi) * (1 - g**2) * (1 + mu**2) / ((2 + g**2) * (1 + g**2 - 2 * g * mu) ** 1.5)


def transmittance(height_km: float, sine: float, haze: float, steps: int = 20_000) -> np.ndarray:
    """Part (3,) of the sun's light that reaches a height, for the sine of the sun's elevation, finely summed."""
    p, d = np.array([0.0, EARTH_KM + height_km]), np.array([np.sqrt(1 - sine**2), sine])
    b = p @ d
    span = -b + np.sqrt(b * b - p @ p + AIR_KM**2)
    # denser near the start, where the air is
    t = span * ((np.arange(steps) + 0.5) / steps) ** 2
    dt = span * 2 * (np.arange(steps) + 0.5) / steps**2
    h = np.linalg.norm(p + t[:, None] * d, axis=1) - EARTH_KM
    amounts = np.array(
        [
            (np.exp(-h / 8.0) * dt).sum(),
            (np.exp(-h / 1.2) * dt).sum(),
            (np.maximum(0.0, 1 - np.abs(h - 25) / 15) * dt).sum(),
        ]
    )
    return np.exp(-(RAYLEIGH * amounts[0] + MIE_EXTINCTION * haze * amounts[1] + OZONE * amounts[2]))


def overcast_radiance(sine: np.ndarray, sun_sine: float, outside: np.ndarray) -> np.ndarray:
    """Luminance of the overcast sky by the sine of its elevation, under an irradiance (3,) outside the air.

    Moon & Spencer 1942; the ground has 0.3 + 21 sin γ kilolux of 133.8 outside (Krochmann 1963).
    """
    ground = (0.3 + 21.0 * sun_sine) / 133.8 * (outside @ np.array([0.2126, 0.7152, 0.0722]))
    return ground * 9.0 / (7.0 * np.pi) * (1.0 + 2.0 * sine) / 3.0
