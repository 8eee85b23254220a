"""Reading of triangle meshes: glTF, OBJ, PLY and STL, joined, checked and with normals."""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from greensward.io.gltf import read_gltf
from greensward.io.obj import read_obj
from greensward.io.parts import MOST_TRIANGLES, Content, Floats, Indices, Material, Part, Singles
from greensward.io.ply import read_ply
from greensward.io.rasters import decoding
from greensward.io.stl import read_stl
from greensward.scene.errors import InputError
from greensward.scene.files import check_memory, read_file

FURTHEST = 1e9
ENDINGS = (".glb", ".gltf", ".obj", ".ply", ".stl")
_MOST_BYTES = 4 * 2**30
_MEMORY = {".glb": 4, ".gltf": 4, ".obj": 30, ".ply": 16, ".stl": 16}
"""Memory that reading takes, in sizes of the file: words of text become objects."""
_SHARPEST = np.cos(np.radians(40.0))  # an edge between facets that turn further from the mean normal stays an edge
_THINNEST = 1e-14  # area of a triangle, relative to the square of the mesh's extent


@dataclass(frozen=True)
class TriMesh:
    """Triangles with unit normals and, where there are any, colours and texture coordinates at their corners."""

    positions: Floats
    """(n, 3)."""
    triangles: Indices
    """(m, 3), indices of corners, counter-clockwise seen from outside."""
    normals: Floats
    """(n, 3), of unit length."""
    colours: Singles | None = None
    """(n, 4), linear, 0 to 1; what the file holds is taken as linear."""
    uv: Singles | None = None
    """(n, 2); v rises from the bottom of a picture to its top."""
    material: Indices | None = None
    """(n,), numbers of materials, -1 for none."""
    materials: tuple[Material, ...] = ()
    """Materials by number; none unless they were asked for."""

    @cached_property
    def areas(self) -> Floats:
        """Area of each triangle, (m,)."""
        area: Floats = 0.5 * np.linalg.norm(_cross(self.positions[self.triangles]), axis=1)
        return area

    @cached_property
    def bounds(self) -> Floats:
        """Lowest and highest corner of the box around it, (2, 3)."""
        return np.stack([self.positions.min(axis=0), self.positions.max(axis=0)])


def read_mesh(path: Path, painted: bool = False) -> TriMesh:
    """The triangles of a glTF, OBJ, PLY or STL file as it places them, all of its parts joined.

    Triangles without area are left out. Normals that the file lacks are smooth, but for sharp edges. Where only
    some parts have colours, the others are white. With `painted`, materials of glTF and OBJ are read too. Otherwise
    what was read last is cached until the file changes.

    Raises `InputError` for a file that cannot be read or holds no surface.
    """
    try:
        stamp = path.stat()
    except OSError:
        return _read(path, painted)
    return _read(path, painted) if painted else _cached(path, stamp.st_mtime_ns, stamp.st_size)


@lru_cache(maxsize=4)
def _cached(path: Path, _changed_ns: int, _bytes: int) -> TriMesh:
    return _read(path, False)


def _read(path: Path, painted: bool) -> TriMesh:
    content = _content(path, painted)
    parts = [part for part in content.parts if len(part.triangles)]
    count = sum(len(part.triangles) for part in parts)
    if not count:
        raise InputError(f"{path}: holds no triangles")
    if count > MOST_TRIANGLES:
        raise InputError(
            f"{path}: must hold at most {MOST_TRIANGLES // 10**6} million triangles "
            f"(got {count / 1e6:,.1f} million); simplify it"
        )
    joined = _joined([_placed(path, part) for part in parts])
    return replace(_solid(path, joined), materials=tuple(content.materials))


def _content(path: Path, painted: bool) -> Content:
    """Parts and materials, read as the file's ending says."""
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        got = f"got {path.suffix}" if path.suffix else "it has none"
        raise InputError(f"{path}: a mesh's name must end in one of {', '.join(ENDINGS)} ({got})")
    data = read_file(path, _MOST_BYTES, "a mesh")
    check_memory(path, _MEMORY[ending] * len(data), "simplify it, or save it as .glb")
    kind = "glTF" if ending in (".glb", ".gltf") else ending[1:].upper()
    with decoding(path, f"a mesh of {kind}"):
        match kind:
            case "glTF":
                return read_gltf(path, data, painted)
            case "OBJ":
                return read_obj(path, data, painted)
            case "PLY":
                return read_ply(path, data)
            case _:
                return read_stl(data)


# Parts ------------------------------------------------------------------------------------------------------


def _placed(path: Path, part: Part) -> TriMesh:
    """One part of the file where its matrix places it."""
    positions, triangles, matrix = part.positions, part.triangles, part.matrix
    _check_corners(path, part)
    positions = positions @ matrix[:3, :3].T + matrix[:3, 3]
    if not np.abs(positions).max() <= FURTHEST:
        raise InputError(
            f"{path}: coordinates must lie within ±{FURTHEST:g} (got {np.abs(positions).max():g}); scale it down"
        )
    if np.linalg.det(matrix[:3, :3]) < 0.0:
        triangles = triangles[:, ::-1]
    mesh = TriMesh(positions, triangles, np.zeros_like(positions), part.colours, _finite(part.uv), part.material)
    if part.normals is not None:
        normals = part.normals @ np.linalg.pinv(matrix[:3, :3])
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        if np.isfinite(length).all() and (length > 1e-6).all():
            return replace(mesh, normals=normals / length)
    return _with_normals(mesh)


def _check_corners(path: Path, part: Part) -> None:
    """Raise `InputError` where triangles name corners that are not there, or corners are no places."""
    lowest, highest = int(part.triangles.min()), int(part.triangles.max())
    if lowest < 0 or highest >= len(part.positions):
        wrong = lowest if lowest < 0 else highest
        raise InputError(
            f"{path}: a triangle names vertex {wrong}, but there are {len(part.positions)}, counted from 0"
        )
    if not np.isfinite(part.positions).all():
        raise InputError(f"{path}: holds a vertex that is NaN or infinite")


def _finite(uv: Singles | None) -> Singles | None:
    return None if uv is None else np.nan_to_num(uv, posinf=0.0, neginf=0.0)


def _with_normals(mesh: TriMesh) -> TriMesh:
    """The same with smooth normals, weighted by angle (Thürmer & Wüthrich 1998), but for sharp edges."""
    corners: Floats = mesh.positions[mesh.triangles]
    flat = _unit(_cross(corners))
    leaving = _unit(corners[:, [1, 2, 0]] - corners)
    arriving = leaving[:, [2, 0, 1]]
    angle = np.arccos(np.clip(-np.einsum("mij,mij->mi", leaving, arriving), -1.0, 1.0))
    # corners at the same place share a normal, whether or not the file lets them share a vertex
    place = _places(mesh.positions)[mesh.triangles]
    weighted = (angle[..., None] * flat[:, None]).reshape(-1, 3)
    total = np.stack([np.bincount(place.ravel(), weighted[:, axis]).astype(np.float64) for axis in range(3)], -1)
    smooth = _unit(total)[place]
    sharp = np.einsum("mij,mj->mi", smooth, flat) < _SHARPEST
    normals = np.zeros_like(mesh.positions)
    normals[:, 1] = 1.0
    normals[mesh.triangles] = smooth
    triangles = mesh.triangles.copy()
    split = triangles[sharp]
    triangles[sharp] = len(normals) + np.arange(len(split))
    edges = np.broadcast_to(flat[:, None], smooth.shape)[sharp]
    edges = np.where(np.any(edges != 0.0, axis=1, keepdims=True), edges, [0.0, 1.0, 0.0])
    return TriMesh(
        np.concatenate([mesh.positions, mesh.positions[split]]),
        triangles,
        np.concatenate([normals, edges]),
        None if mesh.colours is None else np.concatenate([mesh.colours, mesh.colours[split]]),
        None if mesh.uv is None else np.concatenate([mesh.uv, mesh.uv[split]]),
        None if mesh.material is None else np.concatenate([mesh.material, mesh.material[split]]),
    )


def _places(positions: Floats) -> Indices:
    """A number for each position, equal where they are, (n,)."""
    order = np.lexsort(positions.T)
    differs = np.any(np.diff(positions[order], axis=0) != 0.0, axis=1)
    place = np.empty(len(positions), np.int64)
    place[order] = np.concatenate([[0], np.cumsum(differs)])
    return place


# All of it --------------------------------------------------------------------------------------------------


def _joined(parts: list[TriMesh]) -> TriMesh:
    counts = [len(part.positions) for part in parts]
    first = np.cumsum([0, *counts[:-1]])

    def filled(name: str, fill: npt.NDArray[Any]) -> Any:
        found = [getattr(part, name) for part in parts]
        if all(each is None for each in found):
            return None
        return np.concatenate(
            [
                np.repeat(fill[None], count, axis=0) if each is None else each
                for each, count in zip(found, counts, strict=True)
            ]
        )

    return TriMesh(
        np.concatenate([part.positions for part in parts]),
        np.concatenate([part.triangles + start for part, start in zip(parts, first, strict=True)]),
        np.concatenate([part.normals for part in parts]),
        filled("colours", np.ones(4, np.float32)),
        filled("uv", np.zeros(2, np.float32)),
        filled("material", np.array(-1)),
    )


def _solid(path: Path, mesh: TriMesh) -> TriMesh:
    """The same without triangles that have no area and without vertices that none uses."""
    extent = float(np.ptp(mesh.positions[mesh.triangles.ravel()], axis=0).max())
    triangles = mesh.triangles[mesh.areas > _THINNEST * extent * extent]
    if not len(triangles):
        raise InputError(f"{path}: holds no surface: none of its {len(mesh.triangles)} triangles has an area")
    used = np.zeros(len(mesh.positions), np.bool_)
    used[triangles] = True
    number = np.cumsum(used) - 1
    return TriMesh(
        mesh.positions[used],
        number[triangles],
        mesh.normals[used],
        None if mesh.colours is None else mesh.colours[used],
        None if mesh.uv is None else mesh.uv[used],
        None if mesh.material is None else mesh.material[used],
    )


def _cross(corners: Floats) -> Floats:
    result: Floats = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return result


def _unit(vectors: Floats) -> Floats:
    """Normalise vectors; zero stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    result: Floats = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0)
    return result
