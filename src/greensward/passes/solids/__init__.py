"""Plain solids among the grass: boxes, spheres and cylinders, one instanced draw each."""

import math

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.program import build
from greensward.gpu.view import View
from greensward.scene import Box, Cylinder, Sphere
from greensward.scene.base import linear
from greensward.world import World

_FOLDER = "passes/solids"
Array = npt.NDArray[np.float64]


class Solids:
    """Draws the scene's `[[object]]` tables."""

    def __init__(self, ctx: moderngl.Context, world: World) -> None:
        programs = {
            "picture": build(ctx, f"{_FOLDER}/solid.vert", f"{_FOLDER}/solid.frag"),
            "shadow": build(ctx, f"{_FOLDER}/solid.vert", f"{_FOLDER}/solid.frag", defines={"SHADOW": 1}),
        }
        self._programs = programs
        self._buffers: list[moderngl.Buffer] = []
        self._draws: dict[str, list[tuple[moderngl.VertexArray, int]]] = {"picture": [], "shadow": []}
        for kind, mesh in (("box", _box()), ("sphere", _revolved(_circle(12))), ("cylinder", _revolved(_LID))):
            placed = [
                each for each in world.scene.object if isinstance(each, Box | Sphere | Cylinder) and each.kind == kind
            ]
            if not placed:
                continue
            rows = np.zeros((len(placed), 20), np.float32)
            for row, solid in zip(rows, placed, strict=True):
                x, y, z = solid.position_m
                base = np.array([x, y + float(world.ground.heights.height(x, z)), z])
                turn = _turn(solid.yaw_deg, solid.lean_deg)
                centre = base + turn @ np.array([0.0, 0.5 * solid.size_m[1], 0.0])
                affine = np.column_stack([turn * np.array(solid.size_m), centre])
                row[:12] = affine.ravel()
                row[12:16] = *linear(solid.colour), solid.roughness
                row[16:19] = solid.size_m
            mesh_buffer, row_buffer = ctx.buffer(mesh.astype("f4").tobytes()), ctx.buffer(rows.tobytes())
            self._buffers += [mesh_buffer, row_buffer]
            for purpose, program in programs.items():
                formats, names = "4f4 4f4 4f4 4f4 4f4/i", ("row0", "row1", "row2", "paint", "extent")
                content = [
                    _present(program, mesh_buffer, "3f4 3f4", ("corner", "normal")),
                    _present(program, row_buffer, formats, names),
                ]
                self._draws[purpose].append((ctx.vertex_array(program, content), len(placed)))

    def draw(self, view: View) -> None:
        """Draw every solid."""
        for array, count in self._draws[view.purpose]:
            array.render(moderngl.TRIANGLES, instances=count)

    def release(self) -> None:
        """Free the GPU resources."""
        for array, _ in (*self._draws["picture"], *self._draws["shadow"]):
            array.release()
        for buffer in self._buffers:
            buffer.release()
        for program in self._programs.values():
            program.release()


def _present(
    program: moderngl.Program, buffer: moderngl.Buffer, formats: str, names: tuple[str, ...]
) -> tuple[moderngl.Buffer, str, *tuple[str, ...]]:
    """The buffer's layout with attributes that the compiler dropped skipped as padding."""
    parts, rate = (formats.removesuffix("/i").split(), "/i" if formats.endswith("/i") else "")
    kept = [name for name in names if name in program]
    layout = [part if name in program else f"{part[0]}x4" for part, name in zip(parts, names, strict=True)]
    return (buffer, " ".join(layout) + rate, *kept)


def _turn(yaw_deg: float, lean_deg: float) -> Array:
    """Rotation: lean from the vertical towards local x, then turn about the vertical."""
    yaw, lean = math.radians(yaw_deg), math.radians(-lean_deg)
    about_y = np.array([[math.cos(yaw), 0, math.sin(yaw)], [0, 1, 0], [-math.sin(yaw), 0, math.cos(yaw)]])
    about_z = np.array([[math.cos(lean), -math.sin(lean), 0], [math.sin(lean), math.cos(lean), 0], [0, 0, 1]])
    turn: Array = about_y @ about_z
    return turn


def _box() -> Array:
    """Unit box about the origin: rows of position and normal, 36 vertices."""
    faces = []
    quad = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    for axis in range(3):
        for sign in (-1.0, 1.0):
            corner, normal = np.zeros((6, 3)), np.zeros((6, 3))
            corner[:, axis], normal[:, axis] = 0.5 * sign, sign
            corner[:, (axis + 1) % 3], corner[:, (axis + 2) % 3] = quad[:, 0], quad[:, 1]
            faces.append(np.hstack([corner, normal]))
    return np.vstack(faces)


# profiles of radius, height, normal outward and up
_LID = np.array(
    [[0, -0.5, 0, -1], [0.5, -0.5, 0, -1], [0.5, -0.5, 1, 0], [0.5, 0.5, 1, 0], [0.5, 0.5, 0, 1], [0, 0.5, 0, 1]]
)


def _circle(steps: int) -> Array:
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, steps + 1)
    return np.stack([0.5 * np.cos(angle), 0.5 * np.sin(angle), np.cos(angle), np.sin(angle)], -1)


def _revolved(profile: Array, sides: int = 24) -> Array:
    """A profile turned about y: rows of position and normal, two triangles per facet."""
    turn = np.linspace(0.0, 2.0 * np.pi, sides + 1)
    ring = np.stack([np.cos(turn), np.ones_like(turn), np.sin(turn)], -1)
    place, normal = (profile[:, [k, k + 1, k]][:, None, :] * ring[None] for k in (0, 2))
    grid = np.concatenate([place, normal], -1)
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    return np.stack([a, b, c, a, c, d], 2).reshape(-1, 6)
