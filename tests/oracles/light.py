"""Irradiance and gloss by integration, where the shaders use formulas."""

import numpy as np

from oracles.harmonics import basis


def sphere(rows: int = 200, columns: int = 400) -> tuple[np.ndarray, np.ndarray]:
    """Directions (n, 3) over the sphere and the solid angle of each."""
    y = (np.arange(rows) + 0.5) / rows * 2 - 1
    turn = (np.arange(columns) + 0.5) / columns * 2 * np.pi
    flat = np.sqrt(1 - y**2)[:, None]
    d = np.stack([flat * np.cos(turn), np.broadcast_to(y[:, None], (rows, columns)), flat * np.sin(turn)], -1)
    return d.reshape(-1, 3), np.full(rows * columns, 4 * np.pi / (rows * columns))


def irradiance(coefficients: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Of the light that nine coefficients (9, 3) describe, on surfaces with these normals: (n, 3)."""
    directions, solid = sphere()
    radiance = basis(directions) @ coefficients
    cosine = np.maximum(normals @ directions.T, 0.0)
    return np.maximum((cosine * solid) @ radiance, 0.0)


def ggx(n: np.ndarray, v: np.ndarray, light: np.ndarray, roughness: np.ndarray) -> np.ndarray:
    """Trowbridge-Reitz highlights times the cosine: Schlick's Fresnel of 0.04, Hammon's joint Smith visibility."""
    h = (v + light) / np.linalg.norm(v + light, axis=1, keepdims=True)
    nl, nh = ((n * x).sum(1).clip(0) for x in (light, h))
    nv, vh = np.abs((n * v).sum(1)) + 1e-4, (v * h).sum(1).clip(0)
    a = roughness**2
    distribution = a**2 / (np.pi * (nh**2 * (a**2 - 1) + 1) ** 2)
    visibility = 0.5 / (2 * nl * nv * (1 - a) + (nl + nv) * a)
    fresnel = 0.04 + 0.96 * (1 - vh) ** 5
    return np.minimum(distribution * visibility * fresnel, 8.0) * nl


def exposure(sun: np.ndarray, sky_up: np.ndarray, elevation_deg: float) -> float:
    """Scale to the tone curve: a grey card comes out as a fifth by 3.85 of light; other light adapts by 0.8."""
    luminance = np.array([0.2126, 0.7152, 0.0722])
    light = sun @ luminance * (0.27 + 0.23 * np.sin(np.radians(elevation_deg))) + sky_up @ luminance
    return np.pi / (3.85 * (max(light, 1e-4) / 3.85) ** 0.8)
