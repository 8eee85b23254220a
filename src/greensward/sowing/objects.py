"""Grass on objects: their triangles, cut and grouped into tiles of blades that lie near each other."""

from collections.abc import Hashable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import release_all
from greensward.gpu.device import Device
from greensward.gpu.layouts import struct
from greensward.io.masks import read_mask
from greensward.io.meshes import TriMesh
from greensward.objects.meshes import mesh_of, unit_shape
from greensward.scene import Fur, InputError, Scene
from greensward.sowing.pages import Floats, Indices, Page, page_numbers
from greensward.sowing.sower import TILE, Sower, Table

_TILE_BLADES, _TILE_TRIANGLES = 4096, 1 << 17  # at most
_CORNER = struct(
    "ObjectCorner", *((name, "float") for name in ("x", "y", "z", "density", "nx", "ny", "nz", "u", "v"))
)
# end: part of the tile's area up to and with this triangle
_TRIANGLE = struct("ObjectTriangle", ("a", "uint"), ("b", "uint"), ("c", "uint"), ("end", "float"))


@dataclass(frozen=True)
class GrassyObject:
    """Triangles of an object that bears grass, in its own space."""

    index: int
    """Index of the object in the scene."""
    corners: Floats
    """(n, 9): position, density from 0 to 1, normal, texture coordinates."""
    triangles: Indices
    """(m, 3)."""
    density_per_m2: float
    picture: npt.NDArray[np.uint8]
    """Density laid out by the texture coordinates, (rows, columns, 4)."""

    @property
    def areas(self) -> Floats:
        """Area of each triangle, (m,)."""
        a, b, c = (self.corners[self.triangles[:, k], :3] for k in range(3))
        area: Floats = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        return area

    def blades(self) -> float:
        """Estimate of the blades that grow on it."""
        areas = self.areas
        dense = (self.corners[self.triangles, 3].mean(axis=1) * areas).sum() / max(areas.sum(), 1e-300)
        # where hardly any grows, trying still takes memory
        return float(areas.sum() * self.density_per_m2 * max(dense * self.picture[..., 0].mean() / 255.0, 1 / 16))


def grassy_objects(scene: Scene) -> list[GrassyObject]:
    """Surfaces of the scene's objects that bear grass. Raises `InputError` for what cannot be read or used."""
    if not any(grass.share > 0 for grass in scene.grass):
        return []
    shared: dict[Hashable, GrassyObject] = {}
    found = []
    for number, each in enumerate(scene.object):
        if each.grass and each.grass.density_per_m2 > 0:
            key = unit_shape(each), each.grass
            if key not in shared:
                shared[key] = _grassy(scene, number, mesh_of(each, scene.resolve), each.grass)
            found.append(replace(shared[key], index=number))
    return found


def _grassy(scene: Scene, number: int, mesh: TriMesh, fur: Fur) -> GrassyObject:
    place = f"object[{number}].grass"
    corners = np.zeros((len(mesh.positions), 9))
    corners[:, :3], corners[:, 3], corners[:, 4:7] = mesh.positions, 1.0, mesh.normals
    picture = np.full((1, 1, 4), 255, np.uint8)
    if fur.density_from == "colours":
        if mesh.colours is None:
            raise InputError(f'{place}.density_from: the object has no vertex colours; use "everywhere"')
        corners[:, 3] = mesh.colours[:, 0]
    if fur.density_map:
        if mesh.uv is None:
            raise InputError(f"{place}.density_map: the mesh has no texture coordinates to lay the picture out by")
        picture = read_mask(scene.resolve(fur.density_map), with_heights=False)
    if mesh.uv is not None:
        corners[:, 7:] = mesh.uv
    return GrassyObject(number, corners, mesh.triangles, fur.density_per_m2, picture)


def sow_object(
    device: Device, sower: Sower, surface: GrassyObject, most: int, margin_m: float, first_number: int
) -> list[Page]:
    """Blades of an object, at most `most` a tile; none stands out of its surface by more than `margin_m`."""
    share = min(most, _TILE_BLADES) // 2 / surface.density_per_m2
    surface = _grouped(_cut(surface, share))
    tiles, ends = _tiles(surface, share)
    # a triangle may have three corners of its own
    room = max(device.limits.storage_block_bytes // (3 * _CORNER.dtype.itemsize), _TILE_TRIANGLES)
    run_of = page_numbers(tiles["z"].astype(np.int64), room)
    picture = device.ctx.texture(surface.picture.shape[1::-1], 4, surface.picture.tobytes())
    pages: list[Page] = []
    for run in range(int(run_of.max(initial=-1)) + 1):
        here = tiles[run_of == run]
        part = slice(int(here["x"][0]), int(here["x"][-1] + here["z"][-1]))
        here["x"] -= part.start
        used, at = np.unique(surface.triangles[part], return_inverse=True)
        rows = np.zeros(len(at.reshape(-1, 3)), _TRIANGLE.dtype)
        rows["a"], rows["b"], rows["c"], rows["end"] = *at.reshape(-1, 3).T, ends[part]
        buffers = {
            "Corners": device.ctx.buffer(surface.corners[used].astype(np.float32).tobytes()),
            "Triangles": device.ctx.buffer(rows.tobytes()),
        }
        places = surface.corners[surface.triangles[part], :3]
        low = np.minimum.reduceat(places.min(axis=1), here["x"]) - margin_m
        high = np.maximum.reduceat(places.max(axis=1), here["x"]) + margin_m
        pages += sower.sow(
            here,
            (low, high, np.ones(len(here))),
            {
                "salt": surface.index + (run << 10),
                "density_per_m2": surface.density_per_m2,
                "object_density_map": picture,
                **buffers,
            },
            pages[-1].first_number + pages[-1].capacity if pages else first_number,
            surface.index,
        )
        release_all(*buffers.values())
    picture.release()
    return pages


def _cut(surface: GrassyObject, area: float) -> GrassyObject:
    """Cut triangles to most this area each, halved across their longest edge until they are."""
    corners, triangles, done = [surface.corners], surface.triangles, []
    count = len(surface.corners)
    while len(triangles):
        every = np.concatenate(corners)
        corners = [every]
        large = replace(surface, corners=every, triangles=triangles).areas > area
        done.append(triangles[~large])
        triangles = triangles[large]
        places = every[triangles, :3]
        longest = np.argmax(np.linalg.norm(np.roll(places, -1, axis=1) - places, axis=2), axis=1)
        a, b, c = (np.take_along_axis(triangles, (longest[:, None] + k) % 3, axis=1)[:, 0] for k in range(3))
        corners.append(0.5 * (every[a] + every[b]))
        middle = count + np.arange(len(triangles))
        count += len(triangles)
        triangles = np.concatenate([np.stack([a, middle, c], -1), np.stack([middle, b, c], -1)])
    return replace(surface, corners=np.concatenate(corners), triangles=np.concatenate(done))


def _grouped(surface: GrassyObject) -> GrassyObject:
    """Sort the triangles along a curve that fills space (Morton 1966), so that runs lie together."""
    centres = surface.corners[surface.triangles, :3].mean(axis=1)
    low = centres.min(axis=0)
    cell = ((centres - low) * (1023.0 / max(float((centres - low).max()), 1e-300))).astype(np.int64)
    code = np.zeros(len(cell), np.int64)
    for bit in range(10):
        for axis in range(3):
            code |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    return replace(surface, triangles=surface.triangles[np.argsort(code, kind="stable")])


def _tiles(surface: GrassyObject, area: float) -> tuple[Table, Floats]:
    """Runs of triangles of about this area together, and of each triangle the part of its run that it ends."""
    areas = surface.areas
    total = np.cumsum(areas)
    number = ((total - 0.5 * areas) / area).astype(np.int64) + np.arange(len(areas)) // _TILE_TRIANGLES
    first = np.flatnonzero(np.diff(number, prepend=-1))
    last = np.append(first[1:], len(areas)) - 1
    tiles = np.zeros(len(first), TILE.dtype)
    tiles["x"], tiles["z"] = first, last - first + 1
    # rounded so that all together are as many as asked for
    tiles["candidates"] = np.diff(np.round(total[last] * surface.density_per_m2), prepend=0.0)
    before = np.repeat(total[first] - areas[first], tiles["z"])
    ends = (total - before) / np.repeat(total[last] - total[first] + areas[first], tiles["z"])
    ends[last] = 1.0
    return tiles, ends
