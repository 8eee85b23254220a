"""Tillman 2013, bachelor thesis, section 2.1.2: blades from a particle's trajectory, and extra blades of a root.

Arrays are float64, of n blades: (n,) or (n, 2).
"""

import numpy as np

Array = np.ndarray


def particle(speed: Array, angle: Array, gravity: Array, time: Array) -> Array:
    """Place of the particle at a time after the launch, (n, 2): along the ground, and up."""
    launched = speed[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    return launched * time[:, None] - 0.5 * gravity[:, None] * time[:, None] ** 2 * [0.0, 1.0]


def flight_length(speed: Array, angle: Array, gravity: Array, interval: Array, intervals: int) -> Array:
    """Length of the chords between its points at even intervals."""
    points = [particle(speed, angle, gravity, i * interval) for i in range(intervals + 1)]
    return np.linalg.norm(np.diff(points, axis=0), axis=2).sum(axis=0)


def width(point: Array, last: int, root: Array, top: Array) -> Array:
    """Interpolated between the root, at point 0, and the top, at the last point below the tip."""
    return root + (top - root) * point / last


def offset(k: Array, extra: Array, spacing: Array, turn: Array) -> Array:
    """Offset of extra blade k, from 1 on, (n, 2): a sunflower spiral (Vogel 1979) over the area of a root."""
    radius = spacing * np.sqrt((k + 0.5) / (extra + 1) / np.pi)
    golden = np.pi * (3.0 - np.sqrt(5.0))
    phase = np.exp(1j * (2.0 * np.pi * turn + golden * k))
    return radius[:, None] * np.column_stack([phase.real, phase.imag])


def parts(place: Array, a: Array, b: Array) -> Array:
    """Barycentric coordinates of a and b, at least 0, and scaled to a sum of 1 at most, (n, 2)."""
    found = np.maximum(np.linalg.solve(np.stack([a, b], -1), place[:, :, None])[..., 0], 0.0)
    return found / np.maximum(found.sum(axis=1, keepdims=True), 1.0)


def height(place: Array, neighbour: Array, above: Array, slope: Array) -> Array:
    """Mean of a neighbour's height and of its plane's at a place, (n,); `slope` is (n, 2)."""
    plane = above + np.einsum("ij,ij->i", slope, place - neighbour)
    return 0.5 * (above + plane)
