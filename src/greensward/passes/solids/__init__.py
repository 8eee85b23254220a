"""The scene's objects: one instanced draw for all that share a shape."""

from collections.abc import Hashable

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.program import build
from greensward.gpu.view import View
from greensward.objects import TriMesh, mesh_of
from greensward.scene import Capsule, Mesh
from greensward.scene.base import linear
from greensward.scene.objects import Object
from greensward.world import World

_FOLDER = "passes/solids"
_FORMATS = "4f4 4f4 4f4 4f4 4f4 4f4 4f4/i"
_NAMES = ("now0", "now1", "now2", "before0", "before1", "before2", "paint")


class _Shape:
    """Objects that share their triangles: rows of place now, place a frame ago, colour and roughness."""

    def __init__(self, ctx: moderngl.Context, mesh: TriMesh, indices: list[int], things: list[Object]) -> None:
        self.indices = np.array(indices)
        self.rows = np.zeros((len(indices), 28), np.float32)
        for row, thing in zip(self.rows, things, strict=True):
            row[24:] = *linear(thing.colour), thing.roughness
        corners = np.zeros((len(mesh.positions), 10), np.float32)
        corners[:, :3], corners[:, 3:6] = mesh.positions, mesh.normals
        if mesh.colours is not None:
            corners[:, 6:9], corners[:, 9] = mesh.colours[:, :3], 1.0
        self.corners = ctx.buffer(corners.tobytes())
        self.triangles = ctx.buffer(mesh.triangles.astype(np.uint32).tobytes())
        self.buffer = ctx.buffer(reserve=self.rows.nbytes)
        self.arrays: dict[str, moderngl.VertexArray] = {}

    def place(self, placed: npt.NDArray[np.float64], before: npt.NDArray[np.float64]) -> None:
        self.rows[:, :12] = placed[self.indices, :3].reshape(-1, 12)
        self.rows[:, 12:24] = before[self.indices, :3].reshape(-1, 12)
        self.buffer.write(self.rows)

    def release(self) -> None:
        for array in self.arrays.values():
            array.release()
        for buffer in (self.corners, self.triangles, self.buffer):
            buffer.release()


class Solids:
    """Draws the scene's `[[object]]` tables, and the helicopters of its winds."""

    def __init__(self, ctx: moderngl.Context, world: World) -> None:
        self._world = world
        self._programs = {
            "picture": build(ctx, f"{_FOLDER}/solid.vert", f"{_FOLDER}/solid.frag"),
            "shadow": build(ctx, f"{_FOLDER}/solid.vert", f"{_FOLDER}/solid.frag", defines={"SHADOW": 1}),
        }
        alike: dict[Hashable, list[int]] = {}
        for i, thing in enumerate(world.objects):
            if thing.drawn:
                alike.setdefault(_shape_of(thing), []).append(i)
        self._shapes = []
        for indices in alike.values():
            things = [world.objects[i] for i in indices]
            shape = _Shape(ctx, mesh_of(things[0], world.scene.resolve), indices, things)
            self._shapes.append(shape)
            for purpose, program in self._programs.items():
                content = [
                    _present(program, shape.corners, "3f4 3f4 4f4", ("corner", "normal", "tint")),
                    _present(program, shape.buffer, _FORMATS, _NAMES),
                ]
                shape.arrays[purpose] = ctx.vertex_array(program, content, shape.triangles)
        self._drawn_at: tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]] | None = None

    def draw(self, view: View) -> None:
        """Draw every object where it is."""
        places = self._world.placed, self._world.previously_placed
        if self._drawn_at is None or not all(map(np.array_equal, places, self._drawn_at)):
            self._drawn_at = places
            for shape in self._shapes:
                shape.place(*places)
        for shape in self._shapes:
            shape.arrays[view.purpose].render(moderngl.TRIANGLES, instances=len(shape.indices))

    def release(self) -> None:
        """Free the GPU resources."""
        for shape in self._shapes:
            shape.release()
        for program in self._programs.values():
            program.release()


def _shape_of(thing: Object) -> Hashable:
    match thing:
        case Mesh():
            return thing.kind, thing.file, thing.scale
        case Capsule():
            return thing.kind, thing.radius_m, thing.length_m
        case _:
            return thing.kind, thing.size_m


def _present(
    program: moderngl.Program, buffer: moderngl.Buffer, formats: str, names: tuple[str, ...]
) -> tuple[moderngl.Buffer, str, *tuple[str, ...]]:
    """The buffer's layout with attributes that the compiler dropped skipped as padding."""
    parts, rate = (formats.removesuffix("/i").split(), "/i" if formats.endswith("/i") else "")
    kept = [name for name in names if name in program]
    layout = [part if name in program else f"{int(part[0]) * 4}x" for part, name in zip(parts, names, strict=True)]
    return (buffer, " ".join(layout) + rate, *kept)
