"""Objects of the scene: one instanced draw for all that share a shape, whatever their sizes."""

from collections.abc import Hashable

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import release_all
from greensward.gpu.device import Device
from greensward.gpu.kernels import Draw, Mesh
from greensward.gpu.view import View, anchored
from greensward.io.meshes import TriMesh
from greensward.objects.meshes import mesh_of
from greensward.passes.solids.pictures import picture_array, surfaces
from greensward.scene import Capsule
from greensward.scene import Mesh as MeshObject
from greensward.scene.base import linear
from greensward.scene.objects import PLAIN_COLOUR, Object
from greensward.world import World

_FOLDER = "passes/solids"
_INSTANCE = np.dtype(
    [
        ("now", "f4", (3, 4)),
        ("before", "f4", (3, 4)),
        ("paint", "f4", 4),
        ("size_and_number", "f4", 4),
        ("weathered", "f4"),
    ]
)
_FORMATS = "4f4 4f4 4f4 4f4 4f4 4f4 4f4 4f4 1f4/i"
_NAMES = ("now0", "now1", "now2", "before0", "before1", "before2", "paint", "size_and_number", "weathered")
_CORNER = np.dtype(
    [("corner", "f4", 3), ("normal", "f4", 3), ("tint", "f4", 4), ("texel", "f4", 2), ("surface", "f4", 4)]
)
_CORNER_FORMAT = "3f4 3f4 4f4 2f4 4f4"


class _Shape:
    """Objects that share a mesh of unit size: place now and a frame ago, colour, roughness, wear and size of each."""

    def __init__(self, device: Device, mesh: TriMesh, indices: list[int], objects: list[Object]) -> None:
        self.indices = np.array(indices)
        self.instances = np.zeros(len(indices), _INSTANCE)
        for instance, index, each in zip(self.instances, indices, objects, strict=True):
            instance["paint"] = *linear(each.colour or PLAIN_COLOUR), each.roughness
            instance["size_and_number"] = *_size_of(each), index + 1
            instance["weathered"] = each.weathered
        corners = np.zeros(len(mesh.positions), _CORNER)
        corners["corner"], corners["normal"] = mesh.positions, mesh.normals
        if objects[0].colour is None:
            corners["tint"], corners["surface"] = surfaces(mesh)
        if mesh.uv is not None:
            corners["texel"] = mesh.uv
        self.pictures = picture_array(device.ctx, mesh)
        self.corners = device.ctx.buffer(corners.tobytes())
        self.triangles = device.ctx.buffer(mesh.triangles.astype(np.uint32).tobytes())
        self.buffer = device.ctx.buffer(reserve=self.instances.nbytes)
        content = (self.corners, _CORNER_FORMAT, *(_CORNER.names or ())), (self.buffer, _FORMATS, *_NAMES)
        self.mesh = Mesh(content, self.triangles)

    def place(self, placed: npt.NDArray[np.float64], before: npt.NDArray[np.float64]) -> None:
        """Upload where the objects are, and were a frame ago: (objects, 4, 4) each."""
        self.instances["now"] = placed[self.indices, :3]
        self.instances["before"] = before[self.indices, :3]
        self.buffer.write(self.instances)

    def release(self) -> None:
        """Free the GPU memory."""
        release_all(self.corners, self.triangles, self.buffer)
        if self.pictures:
            self.pictures.release()


class Solids:
    """Draws the scene's `[[object]]` tables, and the helicopters of its winds."""

    def __init__(self, device: Device, world: World) -> None:
        self._world = world
        alike: dict[Hashable, list[int]] = {}
        for i, each in enumerate(world.objects):
            if each.drawn:
                alike.setdefault(_shape_of(each), []).append(i)
        self._shapes = []
        for indices in alike.values():
            objects = [world.objects[i] for i in indices]
            mesh = mesh_of(_of_unit_size(objects[0]), world.scene.resolve, painted=objects[0].colour is None)
            self._shapes.append(_Shape(device, mesh, indices, objects))
        stages = f"{_FOLDER}/solid.vert", f"{_FOLDER}/solid.frag"
        meshes = [shape.mesh for shape in self._shapes]
        self._draws = {
            (purpose, pictured): Draw(
                device,
                *stages,
                defines={**({"SHADOW": 1} if purpose == "shadow" else {}), **({"PICTURES": 1} if pictured else {})},
                bindings=world.bindings,
                meshes=meshes,
            )
            for purpose in ("picture", "shadow")
            for pictured in sorted({shape.pictures is not None for shape in self._shapes})
        }
        self._drawn_at: tuple[npt.NDArray[np.float64], ...] | None = None

    def draw(self, view: View) -> None:
        """Draw every object where it is."""
        places = tuple(
            anchored(placed, view.anchor_ws) for placed in (self._world.placed, self._world.previously_placed)
        )
        if self._drawn_at is None or not all(map(np.array_equal, places, self._drawn_at)):
            self._drawn_at = places
            for shape in self._shapes:
                shape.place(*places)
        for number, shape in enumerate(self._shapes):
            resources = {"object_pictures": shape.pictures} if shape.pictures else {}
            draw = self._draws[view.purpose, shape.pictures is not None]
            draw.run(moderngl.TRIANGLES, -1, len(shape.indices), number, **resources)

    def release(self) -> None:
        """Free the GPU resources."""
        release_all(*self._draws.values(), *self._shapes)


def _shape_of(solid: Object) -> Hashable:
    match solid:
        case MeshObject():
            return solid.kind, solid.file, solid.up, solid.colour is None
        case Capsule():
            return solid.kind, solid.radius_m, solid.length_m
        case _:
            return solid.kind


def _of_unit_size(solid: Object) -> Object:
    match solid:
        case MeshObject():
            return solid.model_copy(update={"scale": 1.0})
        case Capsule():
            return solid
        case _:
            return solid.model_copy(update={"size_m": (1.0, 1.0, 1.0)})


def _size_of(solid: Object) -> tuple[float, float, float]:
    match solid:
        case MeshObject():
            return solid.scale, solid.scale, solid.scale
        case Capsule():
            return 1.0, 1.0, 1.0
        case _:
            return solid.size_m
