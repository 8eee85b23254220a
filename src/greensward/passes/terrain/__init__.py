"""The ground's surface: nested square grids around the camera, each level twice as coarse, out to the horizon."""

import math

import moderngl
import numpy as np

from greensward.gpu.pixel_pass import IMAGES_WRITTEN, PixelPass, Shell, pixel_groups
from greensward.gpu.program import build, build_compute
from greensward.gpu.view import View
from greensward.ground import HeightField
from greensward.ground.rays import GroundRays
from greensward.passes.gbuffer import GBuffer
from greensward.world import World

_CELLS = 96  # per side of a level
_FOLDER = "passes/terrain"


class Terrain:
    """Draws the ground with the colour of soil, maps, and of the sward where blades end.

    `after_all`: in pictures all that needs the depth buffer is drawn before it, so that rays can find the ground.
    """

    def __init__(self, ctx: moderngl.Context, world: World, shell: Shell, after_all: bool) -> None:
        self._there = world.ground.heights.there
        marches = after_all and shell == "compute" and self._there
        self._march = _March(ctx, world.ground.heights) if marches else None
        cell = min(world.ground.heights.cell_m())
        self._spacing = min(max(2.0 ** math.floor(math.log2(cell)), 0.25), 1.0)
        far = world.scene.camera.far_m
        self._levels = max(1, math.ceil(math.log2(max(2.0 * far / (_CELLS * self._spacing), 1.0))) + 1)
        if world.ground.heights.lowest_m == world.ground.heights.highest_m:
            # a plane needs no nested grids, only one that reaches the horizon
            self._spacing, self._levels = 2.0 * far / _CELLS, 1
        vertices, indices, ring = _grid()
        self._corners = ctx.buffer(vertices.tobytes())
        self._full, self._ring = ctx.buffer(indices.tobytes()), ctx.buffer(ring.tobytes())
        defines = {"TILES": 1} if world.scene.ground.tile else {}
        self._material = PixelPass(ctx, f"{_FOLDER}/material.glsl", ["f1", "f2"], shell=shell, defines=defines)
        self._arrays = {}
        for purpose, defines in (("picture", {}), ("shadow", {"SHADOW": 1})):
            program = build(ctx, f"{_FOLDER}/terrain.vert", f"{_FOLDER}/terrain.frag", defines=defines)
            program["finest"] = self._spacing
            content = [(self._corners, "2f4", "corner")]
            self._arrays[purpose] = (
                ctx.vertex_array(program, content, self._full),
                ctx.vertex_array(program, content, self._ring),
            )

    def draw(self, view: View) -> None:
        """Draw the surface: depth and ids; its colour and normal come later, where it is seen."""
        if not self._there:
            return
        if self._march and view.purpose == "picture":
            self._march.run(view)
            return
        full, rings = self._arrays[view.purpose]
        full.program["firstLevel"] = 0
        full.render(moderngl.TRIANGLES)
        if self._levels > 1:
            full.program["firstLevel"] = 1
            rings.render(moderngl.TRIANGLES, instances=self._levels - 1)

    def paint(self, gbuffer: GBuffer) -> None:
        """Fill in colour and normal of the pixels that show ground."""
        if not self._there:
            return
        gbuffer.bind()
        self._material.run(gbuffer.colour, gbuffer.normal)

    def release(self) -> None:
        """Free the GPU resources."""
        self._material.release()
        if self._march:
            self._march.release()
        for arrays in self._arrays.values():
            arrays[0].program.release()
            for array in arrays:
                array.release()
        for buffer in (self._corners, self._full, self._ring):
            buffer.release()


class _March:
    """The ground by rays in a compute shader, which writes the G-buffer's images where it is nearest."""

    def __init__(self, ctx: moderngl.Context, heights: HeightField) -> None:
        self._ctx = ctx
        self._shader = build_compute(ctx, f"{_FOLDER}/march.comp", {"TARGETS": 1})
        self._rays = GroundRays(ctx, heights)
        self._rays.prepare(self._shader)

    def run(self, view: View) -> None:
        self._rays.bind(self._shader, view.near_and_far_m)
        self._shader.run(*pixel_groups(view.size_px))
        self._ctx.memory_barrier(IMAGES_WRITTEN)

    def release(self) -> None:
        self._shader.release()
        self._rays.release()


def _grid() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners in cells from the middle, triangles of the whole square, and of it with the middle left out."""
    side = np.arange(_CELLS + 1, dtype=np.float32) - _CELLS // 2
    corners = np.stack(np.meshgrid(side, side, indexing="xy"), -1).reshape(-1, 2)
    j, i = np.meshgrid(np.arange(_CELLS), np.arange(_CELLS), indexing="xy")
    a = i * (_CELLS + 1) + j
    quads = np.stack([a, a + _CELLS + 1, a + 1, a + 1, a + _CELLS + 1, a + _CELLS + 2], -1)
    # two coarse cells lie under the edge of the finer level, so that no crack shows the sky
    hole = _CELLS // 4 - 2
    middle = (np.abs(j - _CELLS // 2 + 0.5) < hole) & (np.abs(i - _CELLS // 2 + 0.5) < hole)
    return corners, quads.astype(np.uint32).ravel(), quads[~middle].astype(np.uint32).ravel()
