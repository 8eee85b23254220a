"""Phong's reflection model, and ambient light below leaves, in float64."""

import numpy as np


def reflected(colour, n, v, light, sun, sky, left, coefficients, shininess):
    """Radiance (m, 3): Ia ka A + Ip (kd (n . l) + ks (r . v)^s), of unit vectors (m, 3); `left` is A, (m,)."""
    ambient, diffuse, specular = coefficients
    facing = (n * light).sum(-1, keepdims=True)
    mirrored = 2.0 * facing * n - light
    highlight = np.maximum((mirrored * v).sum(-1, keepdims=True), 0.0) ** shininess
    shine = np.where(facing > 0.0, diffuse * facing * colour + specular * highlight, 0.0)
    return ambient * left[:, None] * sky * colour + sun / np.pi * shine


def ambient_left(leaf_area, depth, extinction):
    """Part of the light that leaves of this area index let through (Monsi & Saeki 1953)."""
    return np.exp(-extinction * leaf_area * depth)


def depth_below_tips(open_):
    """Depth, 0 at the tips to 1 at the roots, of occlusion 0.2 + 0.8 (1 - depth^2)."""
    return np.sqrt(np.clip((1.0 - open_) / 0.8, 0.0, 1.0))
