"""The surface of every kind of object in its own space: metres, y up, the origin at the centre of its base."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from greensward.io.meshes import TriMesh, read_mesh
from greensward.scene import Box, Capsule, Cylinder, Mesh, Sphere

Floats = npt.NDArray[np.float64]
Shape = Box | Sphere | Cylinder | Capsule | Mesh
_NOWHERE = (0.0, 0.0, 0.0)
SIDES, _RINGS = 96, 48
"""Sides and rings of what is round: fine enough that no silhouette shows its corners."""


def mesh_of(
    shape: Shape, resolve: Callable[[str], Path], *, sides: int = SIDES, rings: int = _RINGS, painted: bool = False
) -> TriMesh:
    """The surface of an object before it is turned and placed; the centre of its base is the origin.

    `resolve` finds the files that the scene names; what is round has so many `sides`, and a ball so
    many `rings`, an even number; with `painted` meshes tell their materials too. Raises `InputError` for a mesh that
    cannot be read.
    """
    match shape:
        case Box():
            return _box(np.array(shape.size_m))
        case Sphere():
            return _revolved(_ball(0.5, 1.0, rings), np.array(shape.size_m), sides)
        case Cylinder():
            return _revolved(_LIDDED, np.array(shape.size_m), sides)
        case Capsule():
            return _revolved(_ball(shape.radius_m, shape.length_m, rings), np.ones(3), sides)
        case Mesh():
            mesh = _upright(read_mesh(resolve(shape.file), painted), shape.up)
            low, high = mesh.bounds
            base = np.array([0.5 * (low[0] + high[0]), low[1], 0.5 * (low[2] + high[2])])
            return replace(mesh, positions=(mesh.positions - base) * shape.scale)


def unit_shape(solid: Shape) -> tuple[Shape, float]:
    """The solid without its place and look, a metre long, or a mesh as its file has it; and the factor to its size.

    Objects that are alike in shape have equal ones.
    """
    match solid:
        case Capsule():
            size = solid.length_m
            # not validated, as it may be thinner than an object of a scene
            return Capsule.model_construct(position_m=_NOWHERE, radius_m=solid.radius_m / size, length_m=1.0), size
        case Mesh():
            return Mesh(position_m=_NOWHERE, file=solid.file, up=solid.up), solid.scale
        case _:
            size = max(solid.size_m)
            x, y, z = (edge / size for edge in solid.size_m)
            return type(solid).model_construct(position_m=_NOWHERE, size_m=(x, y, z)), size


def _upright(mesh: TriMesh, up: Literal["y", "z"]) -> TriMesh:
    """The mesh with the axis of its file that is up as y."""
    if up == "y":
        return mesh
    positions, normals = (each[:, [0, 2, 1]] * [1.0, 1.0, -1.0] for each in (mesh.positions, mesh.normals))
    return replace(mesh, positions=positions, normals=normals)


def _box(size_m: Floats) -> TriMesh:
    """Six faces, each with a whole picture's texture coordinates."""
    square = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    positions, normals = np.zeros((6, 4, 3)), np.zeros((6, 4, 3))
    for face in range(6):
        axis, sign = face // 2, 1.0 if face % 2 else -1.0
        positions[face, :, axis], normals[face, :, axis] = 0.5 * sign, sign
        # the other two axes in the order that turns counter-clockwise about the normal
        first, second = (axis + 1) % 3, (axis + 2) % 3
        positions[face][:, [first, second] if sign > 0 else [second, first]] = square
    positions[..., 1] += 0.5
    triangles = 4 * np.arange(6)[:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])
    uv = np.broadcast_to(square + 0.5, (6, 4, 2)).reshape(-1, 2).astype(np.float32)
    return TriMesh(positions.reshape(-1, 3) * size_m, triangles.reshape(-1, 3), normals.reshape(-1, 3), uv=uv)


# Profiles, from the base to the top: radius, height, and the normal's parts outward and up
_LIDDED = np.array(
    [[0, 0, 0, -1], [0.5, 0, 0, -1], [0.5, 0, 1, 0], [0.5, 1, 1, 0], [0.5, 1, 0, 1], [0, 1, 0, 1]], np.float64
)


def _ball(radius: float, length: float, rings: int) -> Floats:
    """Half a circle, its halves drawn apart until it is this long."""
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, rings + 1)
    outward, up = np.cos(angle), np.sin(angle)
    outward[[0, -1]] = 0.0
    arc = np.stack([radius * outward, radius * (1.0 + up), outward, up], -1)
    low, high = arc[: rings // 2 + 1], arc[rings // 2 :].copy()
    high[:, 1] += length - 2.0 * radius
    return np.concatenate([low, high if length > 2.0 * radius else high[1:]])


def _revolved(profile: Floats, scale: Floats, sides: int) -> TriMesh:
    """A profile turned about y and scaled; u goes round it, v along the profile."""
    turn = np.linspace(0.0, 2.0 * np.pi, sides + 1)
    turn[-1] = 0.0  # so that the seam is closed
    ring = np.stack([np.cos(turn), np.ones_like(turn), np.sin(turn)], -1)
    positions, normals = (profile[:, [k, k + 1, k]][:, None, :] * ring * by for k, by in ((0, scale), (2, 1 / scale)))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(profile[:, :2], axis=0).T))])
    uv = np.stack(np.meshgrid(1.0 - np.linspace(0, 1, sides + 1), along / along[-1]), -1)
    corner = np.arange(len(profile) * (sides + 1)).reshape(len(profile), -1)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    radius, height = profile[:, 0], profile[:, 1]
    apart = (np.diff(radius) != 0.0) | (np.diff(height) != 0.0)
    triangles = [
        np.stack([a, b, c], -1)[apart & (radius[1:] > 0.0)],
        np.stack([a, c, d], -1)[apart & (radius[:-1] > 0.0)],
    ]
    return TriMesh(
        positions.reshape(-1, 3),
        np.concatenate([each.reshape(-1, 3) for each in triangles]),
        normals.reshape(-1, 3),
        uv=uv.reshape(-1, 2).astype(np.float32),
    )
