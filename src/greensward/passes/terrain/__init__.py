"""Terrain: a ray for each pixel of a picture; in shadow maps geometry clipmaps, nested grids around the camera."""

import math
from typing import Any

import moderngl
import numpy as np

from greensward.gpu.buffers import release_all
from greensward.gpu.device import IMAGES_WRITTEN, Device, Stage
from greensward.gpu.full_screen import FullScreenPass
from greensward.gpu.kernels import Draw, Kernel, Mesh
from greensward.gpu.view import View
from greensward.ground.rays import MaximumMipmap
from greensward.passes.gbuffer import GBuffer
from greensward.sowing import sward_defines
from greensward.world import World

_CELLS = 96  # per side of a level
_FOLDER = "passes/terrain"


class Terrain:
    """Draws the ground with the colour of soil, maps, and of the sward where blades end.

    `after_all`: in pictures all that needs the depth buffer is drawn before it, so that a compute shader may draw it.
    `left_out`: parts of the number and of the height of blades that are left out at `sowing.reach_m`.
    """

    def __init__(
        self, device: Device, world: World, stage: Stage, after_all: bool, left_out: tuple[float, float]
    ) -> None:
        ctx = device.ctx
        self._exists = world.ground.heights.exists
        self._rays = _Rays(device, world, stage, after_all)
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
        tiles = {"TILES": 1} if world.scene.ground.tile else {}
        self._material = FullScreenPass(
            device,
            f"{_FOLDER}/material.glsl",
            ["f1", "f2"],
            stage=stage,
            defines={**tiles, **sward_defines(world.scene)},
            bindings=world.bindings,
        )
        self._left_out = left_out
        corners = (self._corners, "2f4", "corner")
        meshes = Mesh((corners,), self._full), Mesh((corners,), self._ring)
        stages = f"{_FOLDER}/terrain.vert", f"{_FOLDER}/terrain.frag"
        self._triangles = Draw(device, *stages, bindings=world.bindings, meshes=meshes)

    def draw(self, view: View) -> None:
        """Draw the surface: depth and ids; its colour and normal come later, where it is seen."""
        if not self._exists:
            return
        if view.purpose == "picture":
            self._rays.run(view)
            return
        self._triangles.run(moderngl.TRIANGLES, finest=self._spacing, first_level=0)
        if self._levels > 1:
            self._triangles.run(moderngl.TRIANGLES, -1, self._levels - 1, 1, finest=self._spacing, first_level=1)

    def paint(self, gbuffer: GBuffer) -> None:
        """Fill in colour and normal of the pixels that show ground."""
        if not self._exists:
            return
        self._material.run(gbuffer.colour, gbuffer.normal, left_out=self._left_out)

    def release(self) -> None:
        """Free the GPU resources."""
        release_all(self._material, self._rays, self._triangles, self._corners, self._full, self._ring)


class _Rays:
    """The ground by rays where it is nearest: of a compute shader that writes images, or among triangles.

    Where passes run in compute shaders, so do the rays; among triangles, fragments look their depth up.
    """

    def __init__(self, device: Device, world: World, stage: Stage, after_all: bool) -> None:
        self._ctx = device.ctx
        self._mipmap = MaximumMipmap(device, world.ground.heights)
        self._images: Kernel | None = None
        self._depth: FullScreenPass | None = None
        self._fragments: Draw | None = None
        self._depths: dict[tuple[int, int], moderngl.Texture] = {}
        """Depth of the ground in pictures of each size."""
        if after_all and stage == "compute":
            self._images = Kernel(device, f"{_FOLDER}/march.comp", {}, world.bindings)
            self._mipmap.describe(self._images)
            return
        defines = {"MARCHED": 1} if stage == "compute" else {}
        stages = "shaders/screen.vert", f"{_FOLDER}/march.frag"
        self._fragments = Draw(device, *stages, defines=defines, bindings=world.bindings)
        self._fragments.set(reversed_depth=device.features.clip_control)
        if stage == "compute":
            path = f"{_FOLDER}/depth.glsl"
            self._depth = FullScreenPass(device, path, ["f4"], stage=stage, bindings=world.bindings)
        self._mipmap.describe(self._depth.shader if self._depth else self._fragments)

    def run(self, view: View) -> None:
        """Follow a ray through every pixel."""
        values: dict[str, Any] = {"Highest": self._mipmap.buffer, "range_m": view.near_and_far_m}
        if self._images:
            self._images.run_over(view.size_px, **values)
            self._ctx.memory_barrier(IMAGES_WRITTEN)
        if self._depth:
            depth = self._depth_of(view.size_px)
            self._depth.run(depth, **values)
            values = {"ground_depth": depth, "range_m": view.near_and_far_m}
        if self._fragments:
            self._fragments.run(moderngl.TRIANGLES, 3, **values)

    def _depth_of(self, size_px: tuple[int, int]) -> moderngl.Texture:
        if size_px not in self._depths:
            if len(self._depths) == 2:  # of the picture and of what water mirrors
                self._depths.pop(next(iter(self._depths))).release()
            self._depths[size_px] = self._ctx.texture(size_px, 4, dtype="f4")
        return self._depths[size_px]

    def release(self) -> None:
        """Free the GPU resources."""
        for part in (self._images, self._depth, self._fragments, self._mipmap, *self._depths.values()):
            if part:
                part.release()


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
