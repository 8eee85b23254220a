"""Derstroff 2024, "Real-time grass rendering". Arrays are float64, of n tiles or blades: (n,), (n, 2) or (n, 3)."""

import numpy as np

Array = np.ndarray


def _unit(vector: Array) -> Array:
    return vector / np.linalg.norm(vector, axis=1, keepdims=True)


def planes(v1: Array, v2: Array, v3: Array, v4: Array) -> tuple[Array, Array]:
    """Section 1.1: A, B, C, D of the planes of a tile's two triangles, (n, 4) each."""
    n1 = np.cross(_unit(v2 - v1), _unit(v3 - v1))
    n2 = np.cross(_unit(v3 - v4), _unit(v2 - v4))
    d1, d2 = -np.einsum("ij,ij->i", n1, v1), -np.einsum("ij,ij->i", n2, v4)
    return np.column_stack([n1, d1]), np.column_stack([n2, d2])


def height_on(plane: Array, xz: Array) -> Array:
    """y of Ax + By + Cz + D = 0."""
    return -(plane[:, 0] * xz[:, 0] + plane[:, 2] * xz[:, 1] + plane[:, 3]) / plane[:, 1]


def shifted(place: Array, r: Array) -> Array:
    """Section 2.5: the pattern's root at a tile."""
    return np.mod(place + r[:, None], 1.0)


def texture_of(r: Array, alpha: Array, beta: Array) -> Array:
    """Section 2.5: textureID, counted from 0."""
    return np.where(r < alpha, 0, np.where(r < beta, 1, 2))


def bent(p: Array, f: Array, h: Array) -> Array:
    """Section 2.2: a point of the billboard at the height h; f along x and z."""
    return p + np.column_stack([f[:, 0] * h**2, -np.hypot(f[:, 0], f[:, 1]) * h, f[:, 1] * h**2])


def tube_offset(u: Array) -> Array:
    """Section 4.2: height of a half circle over the billboard, in radii."""
    return np.sin(np.arccos(2.0 * u - 1.0))


def tube_normal(side: Array, to_viewer: Array, u: Array) -> Array:
    """Section 4.2: from the middle of the tube to that point; unit vectors."""
    angle = np.arccos(2.0 * u - 1.0)[:, None]
    return np.cos(angle) * side + np.sin(angle) * to_viewer
