"""Reading of triangle meshes: glTF, OBJ, PLY and STL, joined, checked and with normals."""

import contextlib
import logging
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from greensward.io.rasters import decoding, open_file
from greensward.scene.errors import InputError

MOST_TRIANGLES = 20_000_000
FURTHEST = 1e9
ENDINGS = (".glb", ".gltf", ".obj", ".ply", ".stl")
_SHARPEST = np.cos(np.radians(40.0))  # an edge between facets that turn further from the mean normal stays an edge
_THINNEST = 1e-14  # area of a triangle, relative to the square of the mesh's extent

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]
Singles = npt.NDArray[np.float32]


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

    @cached_property
    def areas(self) -> Floats:
        """Area of each triangle, (m,)."""
        area: Floats = 0.5 * np.linalg.norm(_cross(self.positions[self.triangles]), axis=1)
        return area

    @cached_property
    def bounds(self) -> Floats:
        """Lowest and highest corner of the box around it, (2, 3)."""
        return np.stack([self.positions.min(axis=0), self.positions.max(axis=0)])


def read_mesh(path: Path) -> TriMesh:
    """The triangles of a glTF, OBJ, PLY or STL file as it places them, all of its parts joined.

    Triangles without area are left out. Normals that the file lacks are smooth, but for sharp edges. Where only
    some parts have colours, the others are white. Images that the file names are ignored. What was read last is
    cached until the file changes.

    Raises `InputError` for a file that cannot be read or holds no surface, and where trimesh is not installed.
    """
    try:
        stamp = path.stat()
    except OSError:
        return _read(path)
    return _cached(path, stamp.st_mtime_ns, stamp.st_size)


@lru_cache(maxsize=4)
def _cached(path: Path, _changed_ns: int, _bytes: int) -> TriMesh:
    return _read(path)


def _read(path: Path) -> TriMesh:
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        got = f"got {path.suffix}" if path.suffix else "it has none"
        raise InputError(f"{path}: a mesh's name must end in one of {', '.join(ENDINGS)} ({got})")
    try:
        import trimesh  # type: ignore[import-not-found, unused-ignore]
    except ImportError:
        raise InputError(
            f'{path}: a mesh is read by trimesh, which is not installed: pip install "greensward[mesh]"'
        ) from None
    # glTF's texture coordinates come with its materials only
    options: dict[str, Any] = {"skip_materials": True} if ending == ".obj" else {}
    with open_file(path) as stream, decoding(path, "a mesh of glTF, OBJ, PLY or STL"), _silence():
        scene: Any = trimesh.load_scene(
            stream,
            file_type=ending[1:],
            resolver=trimesh.resolvers.FilePathResolver(str(path)),
            process=False,
            **options,
        )
        placed = [(scene.geometry[name], matrix) for matrix, name in map(scene.graph.get, scene.graph.nodes_geometry)]
        placed = [(part, matrix) for part, matrix in placed if len(getattr(part, "faces", ()))]
        count = sum(len(part.faces) for part, _ in placed)
        if not count:
            raise InputError(f"{path}: holds no triangles")
        if count > MOST_TRIANGLES:
            raise InputError(
                f"{path}: must hold at most {MOST_TRIANGLES // 10**6} million triangles "
                f"(got {count / 1e6:,.1f} million); simplify it"
            )
        return _solid(path, _joined([_part(path, part, np.asarray(matrix)) for part, matrix in placed]))


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Silence trimesh, whose log is for its developers."""
    log = logging.getLogger("trimesh")
    before, log.disabled = log.disabled, True
    try:
        yield
    finally:
        log.disabled = before


# Parts ------------------------------------------------------------------------------------------------------


def _part(path: Path, part: Any, matrix: Floats) -> TriMesh:
    """One geometry of the file where its scene places it."""
    positions, triangles = np.array(part.vertices, np.float64), np.array(part.faces, np.int64)
    if not np.isfinite(positions).all():
        raise InputError(f"{path}: holds a vertex that is NaN or infinite")
    if triangles.min() < 0 or triangles.max() >= len(positions):
        wrong = int(triangles.min() if triangles.min() < 0 else triangles.max())
        raise InputError(f"{path}: a triangle names vertex {wrong}, but there are {len(positions)}, counted from 0")
    positions = positions @ matrix[:3, :3].T + matrix[:3, 3]
    if not np.abs(positions).max() <= FURTHEST:
        raise InputError(
            f"{path}: coordinates must lie within ±{FURTHEST:g} (got {np.abs(positions).max():g}); scale it down"
        )
    if np.linalg.det(matrix[:3, :3]) < 0.0:
        triangles = triangles[:, ::-1]
    # asked of its cache, because what trimesh would compute instead takes a loop per triangle
    known = part._cache["vertex_normals"]
    mesh = TriMesh(positions, triangles, np.zeros_like(positions), _colours(part), _uv(part))
    if known is not None:
        normals = np.asarray(known, np.float64) @ np.linalg.pinv(matrix[:3, :3])
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        if np.isfinite(length).all() and (length > 1e-6).all():
            return replace(mesh, normals=normals / length)
    return _with_normals(mesh)


def _colours(part: Any) -> Singles | None:
    """The colours at the vertices, float32 (n, 4) in 0..1, wherever trimesh stores them."""
    if part.visual.kind == "vertex":
        found = part.visual.vertex_colors
    else:
        stored = (getattr(part.visual, "vertex_attributes", {}), part.vertex_attributes)
        found = next((each["color"] for each in stored if "color" in each), None)
    values = np.asarray(found)
    if found is None or values.ndim != 2 or len(values) != len(part.vertices) or values.shape[1] not in (3, 4):
        return None
    colours = np.ones((len(values), 4), np.float32)
    full = np.iinfo(values.dtype).max if values.dtype.kind in "iu" else 1.0
    colours[:, : values.shape[1]] = np.clip(np.nan_to_num(values / full), 0.0, 1.0)
    return colours


def _uv(part: Any) -> Singles | None:
    """The texture coordinates at the vertices, float32 (n, 2)."""
    found = getattr(part.visual, "uv", None)
    if found is None or np.shape(found) != (len(part.vertices), 2):
        return None
    with np.errstate(over="ignore"):
        return np.nan_to_num(np.asarray(found).astype(np.float32), posinf=0.0, neginf=0.0)


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

    def zeros(name: str, width: int, fill: float) -> Singles | None:
        found = [getattr(part, name) for part in parts]
        if all(each is None for each in found):
            return None
        return np.concatenate(
            [
                np.full((count, width), fill, np.float32) if each is None else each
                for each, count in zip(found, counts, strict=True)
            ]
        )

    return TriMesh(
        np.concatenate([part.positions for part in parts]),
        np.concatenate([part.triangles + start for part, start in zip(parts, first, strict=True)]),
        np.concatenate([part.normals for part in parts]),
        zeros("colours", 4, 1.0),
        zeros("uv", 2, 0.0),
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
    )


def _cross(corners: Floats) -> Floats:
    result: Floats = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return result


def _unit(vectors: Floats) -> Floats:
    """Normalise vectors; zero stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    result: Floats = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0)
    return result
