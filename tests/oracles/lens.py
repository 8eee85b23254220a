"""Lens models, point by point: Brown & Conrady's distortion as OpenCV documents it, and the equidistant fisheye."""

import math

import numpy as np


def pinhole(point, fx, fy, cx, cy, distortion=()):
    """Pixel of a point (3,), x right, y down, z forward."""
    k1, k2, p1, p2, k3 = (*distortion, *(0.0,) * (5 - len(distortion)))
    x, y = point[0] / point[2], point[1] / point[2]
    r2 = x**2 + y**2
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2)
    yd = y * radial + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y
    return np.array([fx * xd + cx, fy * yd + cy])


def fisheye(point, fx, fy, cx, cy):
    """Pixel of a point (3,) whose distance from the middle is the angle from the axis."""
    r = math.hypot(point[0], point[1])
    theta = math.atan2(r, point[2])
    scale = theta / r if r > 0 else 0.0
    return np.array([fx * point[0] * scale + cx, fy * point[1] * scale + cy])
