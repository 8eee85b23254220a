"""Tiles around the camera: rings of cells, and the lists of those that a view shows."""

import math
from dataclasses import dataclass

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.culling import DRAW_COMMAND, Compaction, distance_defines
from greensward.gpu.buffers import read_back, release_all, zeros
from greensward.gpu.device import COMMANDS_WRITTEN, Device
from greensward.gpu.kernels import Kernel, grid
from greensward.gpu.layouts import struct
from greensward.gpu.view import View
from greensward.scene import InputError, Scene
from greensward.sowing.identity import BladeKind, Ids, blade_ids
from greensward.techniques.geometry_billboards.settings import BillboardSettings
from greensward.world import World

_FOLDER = "techniques/geometry_billboards"
TILE = struct(
    "BillboardTile",
    ("x", "int"),  # column and row in the world, in cells of its ring
    ("z", "int"),
    ("left_m", "float"),  # its corner in relative space
    ("near_m", "float"),
    ("edge_m", "float"),
    ("number", "uint"),  # of its first root, less 1
    ("first", "float", 4),  # planes of its two triangles, x and z from the corner, y in relative space
    ("second", "float", 4),
)
LEVELS = 4
"""Three of blades, the finest first, and that of flat tiles: numbers of the draw commands."""
_WRITTEN = COMMANDS_WRITTEN | moderngl.VERTEX_ATTRIB_ARRAY_BARRIER_BIT
_SIDE = 8  # cells of a patch
_PATCH = _SIDE * _SIDE
_FINENESS = 0.02  # edge of a ring's flat cells, as a part of the distance where they begin


@dataclass(frozen=True)
class Ring:
    """Square cells in a distance from the camera."""

    edge_m: float
    from_m: float
    to_m: float

    @property
    def patches(self) -> int:
        """Patches along each side of the square that holds it, wherever in its patch the camera is."""
        return 2 * math.ceil(self.to_m / (_SIDE * self.edge_m)) + 1

    def first_patch(self, camera_ws: np.ndarray) -> np.ndarray:
        """Column and row in the world of its first patch, int64 (2,)."""
        here: np.ndarray = np.floor(camera_ws[[0, 2]] / (_SIDE * self.edge_m)).astype(np.int64)
        return here - self.patches // 2


def tile_edge_m(scene: Scene, settings: BillboardSettings) -> float:
    """Edge of a tile whose roots are as dense as the scene asks for."""
    return math.sqrt(settings.roots / scene.sowing.density_per_m2)


def levels_of(scene: Scene, settings: BillboardSettings) -> tuple[float, float, float]:
    """Distances at which the levels end, none beyond the reach of blades."""
    if not scene.culling.distance:
        return (scene.sowing.blades_m,) * 3
    first, second, last = (min(each, scene.sowing.blades_m) for each in settings.levels_m)
    return first, second, last


def rings_of(scene: Scene, settings: BillboardSettings) -> list[Ring]:
    """The ring of tiles with blades, then those of flat ones, which double in size and reach."""
    edge, reach, last = tile_edge_m(scene, settings), scene.sowing.blades_m, levels_of(scene, settings)[2]
    rings = [Ring(edge, 0.0, max(last, edge))]
    begin, to = (1.0 - settings.fade) * last, last
    cell = edge * 2.0 ** max(0, round(math.log2(max(_FINENESS * last, edge) / edge)))
    while to < reach:
        begin, to = (begin if len(rings) == 1 else to), min(max(2.0 * to, cell / _FINENESS), reach)
        rings.append(Ring(cell, begin, to))
        cell *= 2.0
    return rings


class Tiles:
    """Cells that a view shows, in order and by level, found on the GPU; nothing is read back or grows."""

    def __init__(self, device: Device, world: World, settings: BillboardSettings) -> None:
        scene = world.scene
        self._device, self._rings, self._roots = device, rings_of(scene, settings), settings.roots
        counts = [ring.patches**2 for ring in self._rings]
        self._starts = np.cumsum([0, *counts])
        self._patches = int(self._starts[-1])
        self._words = 2 * LEVELS * self._patches
        self.considered = _PATCH * (counts[0] * settings.roots + self._patches - counts[0])
        """Roots of all tiles around the camera, and flat cells."""
        nbytes = _PATCH * self._patches * TILE.dtype.itemsize
        _refuse_too_many(self.considered, world.field.most_blades, nbytes, device)
        self.buffer = device.ctx.buffer(reserve=nbytes)
        self.commands = zeros(device, (LEVELS + 1) * DRAW_COMMAND.dtype.itemsize)
        self._compaction = Compaction(device)
        self._compaction.make_room(self._words)
        defines = {**distance_defines(scene.culling), "RINGS": len(self._rings)}
        frustum = {"FRUSTUM": 1} if scene.culling.frustum else {}
        self._mark = {
            purpose: Kernel(device, f"{_FOLDER}/mark.comp", {**defines, **frustum, **more}, world.bindings)
            for purpose, more in (("picture", {}), ("shadow", {"SHADOW": 1}))
        }
        self._place = Kernel(device, f"{_FOLDER}/place.comp", defines, world.bindings)
        uniforms = self._uniforms(world, settings, counts[0])
        for kernel in (*self._mark.values(), self._place):
            kernel.set(**{name: value for name, value in uniforms.items() if name in kernel})
        self.view: View | None = None
        """View that was listed last."""

    def _uniforms(self, world: World, settings: BillboardSettings, first_flat: int) -> dict[str, object]:
        scene, heights = world.scene, world.ground.heights
        blades = [math.ceil(settings.roots * percent / 100.0) for percent in settings.blades]
        uniforms: dict[str, object] = {
            "ring_reach": [(ring.edge_m, ring.from_m, ring.to_m, 0.0) for ring in self._rings],
            "levels_m": levels_of(scene, settings),
            "tallest_m": world.field.tallest_m,
            "widest_m": max((grass.width_m[1] for grass in scene.grass), default=0.0),
            "min_width_px": settings.min_width_px,
            "patches": self._patches,
            "blades": (*blades, 0),
            "roots": settings.roots,
            "first_flat": first_flat,
            "heights_m": (heights.lowest_m, heights.highest_m),
        }
        return uniforms

    def list_for(self, view: View) -> None:
        """List what a view shows, unless it was the last."""
        if view is self.view:
            return
        self.view = view
        places, cells, corners = [], [], []
        origin = view.origin_ws[[0, 2]]
        for start, ring in zip(self._starts, self._rings, strict=False):
            first = ring.first_patch(view.camera_ws)
            places.append((int(start), ring.patches, *first))
            cells.append(np.floor(origin / ring.edge_m).astype(np.int64))
            corners.append(cells[-1] * ring.edge_m - origin)
        here = {"ring_patches": places, "ring_here": cells, "ring_corner_m": corners}
        mark, groups = self._mark[view.purpose], grid(self._patches)
        self._device.ctx.memory_barrier(_WRITTEN)  # behind the draws of the list before
        mark.run(groups, Masks=self._compaction.masks, **here)
        self._compaction.sum_up(self._words, self.commands, LEVELS)
        self._place.run(groups, **self._compaction.bindings, Commands=self.commands, Tiles=self.buffer, **here)
        self._device.ctx.memory_barrier(_WRITTEN)

    def identify(self, numbers: npt.NDArray[np.uint32]) -> Ids:
        """Find the permanent ids of roots and flat tiles of the view that was listed last, uint64 (n,)."""
        assert self.view
        number, first_flat = numbers.astype(np.int64) - 1, int(self._starts[1]) * _PATCH
        flat = number >= first_flat * self._roots
        cell = np.where(flat, number - first_flat * (self._roots - 1), number // self._roots)
        patch, lane = np.divmod(cell, _PATCH)
        ring = np.searchsorted(self._starts, patch, side="right") - 1
        sides = np.array([each.patches for each in self._rings])[ring]
        first = np.array([each.first_patch(self.view.camera_ws) for each in self._rings])[ring]
        row, column = np.divmod(patch - self._starts[ring], sides)
        x, z = _SIDE * (first[:, 0] + column) + lane % _SIDE, _SIDE * (first[:, 1] + row) + lane // _SIDE
        return np.where(
            flat,
            blade_ids(BladeKind.FLAT_TILE, x, z, ring),
            blade_ids(BladeKind.BILLBOARD, x, z, number % self._roots),
        )

    def drawn(self) -> int:
        """Count the roots and flat tiles that were listed last. Waits for the GPU."""
        commands = np.frombuffer(read_back(self._device, self.commands), DRAW_COMMAND.dtype)[:LEVELS]
        return int((commands["instances"] * np.where(np.arange(LEVELS) < LEVELS - 1, commands["vertices"], 1)).sum())

    def release(self) -> None:
        """Free the GPU resources."""
        release_all(self.buffer, self.commands, self._compaction, *self._mark.values(), self._place)


def _refuse_too_many(roots: int, most: int, nbytes: int, device: Device) -> None:
    limit = device.limits.storage_block_bytes
    if roots > most:
        raise InputError(
            f"technique.levels_m: must leave at most {most / 1e6:,.0f} million roots around the camera "
            f"(got {roots / 1e6:,.0f} million); lower it or sowing.density_per_m2"
        )
    if nbytes > limit:
        raise InputError(
            f"technique.levels_m: must leave at most {limit / 2**20:,.0f} MiB of tiles around the camera on this "
            f"driver (got {nbytes / 2**20:,.0f} MiB); lower it or sowing.density_per_m2, or raise technique.roots"
        )
