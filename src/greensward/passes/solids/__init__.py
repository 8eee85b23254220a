"""Objects of the scene: one instanced draw for all in view that share a shape, whatever their sizes."""

from collections.abc import Hashable
from itertools import product

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import release_all, upload
from greensward.gpu.device import Device
from greensward.gpu.kernels import Draw, Mesh
from greensward.gpu.layouts import WORD, struct
from greensward.gpu.memory import available_bytes
from greensward.gpu.view import View, anchored, boxes_in_view
from greensward.io.meshes import TriMesh
from greensward.objects.meshes import SIDES, mesh_of
from greensward.passes.solids.pictures import picture_array, picture_bytes, surfaces
from greensward.scene import Box, Capsule, InputError
from greensward.scene import Mesh as MeshObject
from greensward.scene.base import linear
from greensward.scene.objects import PLAIN_COLOUR, Object
from greensward.world import World

_FOLDER = "passes/solids"
_THING = struct(
    "Thing",
    ("paint", "vec4"),  # linear colour and roughness
    ("size", "vec3"),  # of the shape of unit size
    ("stretch_m", "float"),  # by which what is above 1.5 m in the shape is lifted
    ("weathered", "float"),
)
_WHERE = struct("Where", ("now", "vec4", 3), ("before", "vec4", 3))  # rows of matrices from own space
_CORNER = np.dtype(
    [("corner", "f4", 3), ("normal", "f4", 3), ("tint", "f4", 4), ("texel", "f4", 2), ("surface", "f4", 4)]
)
_CORNER_FORMAT = "3f4 3f4 4f4 2f4 4f4"
_SIDES = np.array([SIDES, 64, 48, 32, 24, 16, 12, 8])
"""Sides of what is round, by level of detail."""
_OFF_PX = 0.1
"""Pixels by which the silhouette of a level may be off, radius * (1 - cos(pi / sides))."""
Floats = npt.NDArray[np.float64]


class _Level:
    """A mesh of unit size that objects share."""

    def __init__(self, device: Device, mesh: TriMesh, painted: bool) -> None:
        corners = np.zeros(len(mesh.positions), _CORNER)
        corners["corner"], corners["normal"] = mesh.positions, mesh.normals
        if painted:
            corners["tint"], corners["surface"] = surfaces(mesh)
        if mesh.uv is not None:
            corners["texel"] = mesh.uv
        self.pictures = picture_array(device.ctx, mesh)
        self._corners = device.ctx.buffer(corners.tobytes())
        self._triangles = device.ctx.buffer(mesh.triangles.astype(np.uint32).tobytes())
        self.mesh = Mesh(((self._corners, _CORNER_FORMAT, *(_CORNER.names or ())),), self._triangles)

    def release(self) -> None:
        """Free the GPU memory."""
        release_all(self._corners, self._triangles, *([self.pictures] if self.pictures else []))


class Solids:
    """Draws the scene's `[[object]]` tables, and the helicopters of its winds."""

    def __init__(self, device: Device, world: World) -> None:
        self._device, self._world = device, world
        objects = world.objects
        alike: dict[Hashable, list[int]] = {}
        for i, each in enumerate(objects):
            if each.drawn:
                alike.setdefault(_shape_of(each), []).append(i)
        self._levels: list[_Level] = []
        things = np.zeros(max(len(objects), 1), _THING.dtype)
        things["weathered"][: len(objects)] = [each.weathered for each in objects]
        for thing, each in zip(things, objects, strict=False):
            thing["paint"] = *linear(each.colour or PLAIN_COLOUR), each.roughness
            thing["size"], thing["stretch_m"] = _size_of(each)
        # by object: its first level, -1 where it is not drawn, the last, and the box around it in its own space
        self._first, self._last = np.full((2, len(objects)), -1)
        self._middle, self._half = np.ones((len(objects), 4)), np.zeros((len(objects), 3))
        for indices in alike.values():
            self._first[indices] = len(self._levels)
            low, high = self._add_levels(device, indices[0])
            self._last[indices] = len(self._levels) - 1
            low, high = (end * things["size"][indices] for end in (low, high))
            high[:, 1] += things["stretch_m"][indices]
            self._middle[indices, :3], self._half[indices] = 0.5 * (low + high), 0.5 * (high - low)
        self._buffers = {
            "Things": device.ctx.buffer(things.tobytes()),
            "Wheres": device.ctx.buffer(reserve=len(things) * _WHERE.dtype.itemsize),
            "Seen": device.ctx.buffer(reserve=len(things) * WORD),
        }
        stages = f"{_FOLDER}/solid.vert", f"{_FOLDER}/solid.frag"
        weathered = {"WEATHERED": 1} if things["weathered"].any() else {}
        meshes = [level.mesh for level in self._levels]
        self._draws = {
            (purpose, pictured): Draw(
                device,
                *stages,
                defines={
                    **({"SHADOW": 1} if purpose == "shadow" else weathered),
                    **({"PICTURES": 1} if pictured else {}),
                },
                bindings=world.bindings,
                meshes=meshes,
            )
            for purpose, pictured in product(
                ("picture", "shadow"), sorted({level.pictures is not None for level in self._levels})
            )
        }
        self._drawn_at: tuple[Floats, ...] | None = None

    def _add_levels(self, device: Device, index: int) -> Floats:
        """Add the levels of the shape of an object; returns its bounds, (2, 3)."""
        solid, resolve = _of_unit_size(self._world.objects[index]), self._world.scene.resolve
        painted = solid.colour is None
        levels = _SIDES[:1] if isinstance(solid, Box | MeshObject) else _SIDES
        # the finest last, as its bounds are those of all
        for sides in levels[::-1].tolist():
            mesh = mesh_of(solid, resolve, sides=sides, rings=sides // 2, painted=painted)
            _refuse_too_large(device, mesh, index)
            self._levels.append(_Level(device, mesh, painted))
        return mesh.bounds

    def draw(self, view: View) -> None:
        """Draw every object in view where it is."""
        if not self._levels:
            return
        places = tuple(
            anchored(placed, view.anchor_ws) for placed in (self._world.placed, self._world.previously_placed)
        )
        if self._drawn_at is None or not all(map(np.array_equal, places, self._drawn_at)):
            self._drawn_at = places
            rows = np.zeros(len(self._first), _WHERE.dtype)
            rows["now"], rows["before"] = (each[:, :3] for each in places)
            upload(self._device, self._buffers["Wheres"], rows)
        seen, level = self._seen(view)
        upload(self._device, self._buffers["Seen"], seen.astype(np.uint32))
        counts = np.bincount(level, minlength=len(self._levels))
        for number in np.flatnonzero(counts):
            shape = self._levels[number]
            resources = {**self._buffers, **({"object_pictures": shape.pictures} if shape.pictures else {})}
            draw = self._draws[view.purpose, shape.pictures is not None]
            first = int(counts[:number].sum())
            draw.run(moderngl.TRIANGLES, -1, int(counts[number]), int(number), first=first, **resources)

    def _seen(self, view: View) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Objects whose boxes are in view, by the level that each needs, and that level."""
        placed = self._world.placed
        middle = np.einsum("nij,nj->ni", placed[:, :3], self._middle)
        half = np.einsum("nij,nj->ni", np.abs(placed[:, :3, :3]), self._half)
        seen = np.flatnonzero(boxes_in_view(view.planes_ws(), middle, half)[0] & (self._first >= 0))
        radius = self._half[seen].max(axis=1)
        depth = middle[seen] @ view.axis_ws[:3] + view.axis_ws[3] - np.linalg.norm(self._half[seen], axis=1)
        pixels = radius / np.maximum(view.pixel_m[0] * np.maximum(depth, 0.0) + view.pixel_m[1], 1e-12)
        coarser = np.searchsorted(-_OFF_PX / (1.0 - np.cos(np.pi / _SIDES[1:])), -pixels)
        level = np.maximum(self._last[seen] - coarser, self._first[seen])
        order = np.argsort(level, kind="stable")
        return seen[order], level[order]

    def release(self) -> None:
        """Free the GPU resources."""
        release_all(*self._draws.values(), *self._levels, *self._buffers.values())


def _refuse_too_large(device: Device, mesh: TriMesh, index: int) -> None:
    """Refuse a mesh that the device has no room for."""
    needed = len(mesh.positions) * _CORNER.itemsize + mesh.triangles.size * WORD + picture_bytes(mesh)
    free = available_bytes(device)
    if needed > free:
        raise InputError(
            f"object[{index}].file: {len(mesh.triangles) / 1e6:,.1f} million triangles and their pictures need "
            f"{needed / 2**30:,.1f} GiB, and this device can give {free / 2**30:,.1f} GiB; simplify it, "
            "or have fewer meshes"
        )


def _shape_of(solid: Object) -> Hashable:
    if isinstance(solid, MeshObject):
        return solid.kind, solid.file, solid.up, solid.colour is None
    return solid.kind


def _of_unit_size(solid: Object) -> Object:
    match solid:
        case MeshObject():
            return solid.model_copy(update={"scale": 1.0})
        case Capsule():
            return solid.model_copy(update={"radius_m": 1.0, "length_m": 3.0})
        case _:
            return solid.model_copy(update={"size_m": (1.0, 1.0, 1.0)})


def _size_of(solid: Object) -> tuple[tuple[float, float, float], float]:
    """Factors to the size of an object along its axes, and then what the upper end of a capsule is lifted by."""
    match solid:
        case MeshObject():
            return (solid.scale, solid.scale, solid.scale), 0.0
        case Capsule():
            return (solid.radius_m, solid.radius_m, solid.radius_m), solid.length_m - 3.0 * solid.radius_m
        case _:
            return solid.size_m, 0.0
