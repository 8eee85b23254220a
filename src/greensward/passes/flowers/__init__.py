"""Billboard flowers: placed, swayed and drawn without anything stored."""

import math
from dataclasses import dataclass

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import release_all
from greensward.gpu.device import STORAGE_WRITTEN, Device
from greensward.gpu.kernels import Draw, Kernel, grid
from greensward.gpu.layouts import struct
from greensward.gpu.memory import available_bytes
from greensward.gpu.view import View
from greensward.motion import motion_defines
from greensward.passes.flowers.pictures import flower_array
from greensward.scene import InputError
from greensward.sowing import sward_defines
from greensward.sowing.identity import BladeKind, Ids, blade_ids
from greensward.world import FrameTime, World

_FOLDER = "passes/flowers"
_MOST_BYTES = 1 << 30  # of a buffer
# a plant at this instant; without height where none grows
_FLOWER = struct(
    "Flower",
    ("root", "vec4"),  # xyz in the world; height
    ("control", "vec4"),  # of the stem's curve, from the root; width of the picture
    ("tip", "vec4"),  # from the root; random number
    ("control_before", "vec4"),
    ("tip_before", "vec4"),
)


@dataclass(frozen=True)
class _Part:
    """Places of a table, as many as a storage block holds."""

    table: int
    first: int
    places: int
    flowers: moderngl.Buffer


class BillboardFlowers:
    """Draws the scene's `[[flowers]]` tables."""

    def __init__(self, device: Device, world: World) -> None:
        self._ctx = device.ctx
        self._tables = world.scene.flowers
        self.most = 0
        """Places where a plant may grow, each with a number."""
        if not self._tables:
            return
        self._pictures, self._aspects = flower_array(device.ctx, world.scene)
        self._grow = Kernel(
            device,
            f"{_FOLDER}/grow.comp",
            {**motion_defines(world.scene), **sward_defines(world.scene)},
            world.bindings,
        )
        stages = f"{_FOLDER}/flower.vert", f"{_FOLDER}/flower.frag"
        self._draws = {
            purpose: Draw(device, *stages, defines=defines, bindings=world.bindings)
            for purpose, defines in (("picture", {}), ("shadow", {"SHADOW": 1}))
        }
        self._cells_m = [table.cell_m for table in self._tables]
        self._edges = edges = [table.cells for table in self._tables]
        self._firsts = [sum(edge * edge for edge in edges[:i]) for i in range(len(edges))]
        self.most = sum(edge * edge for edge in edges)
        needed, free = _FLOWER.dtype.itemsize * self.most, available_bytes(device)
        if needed > free:
            raise InputError(
                f"flowers: {self.most / 1e6:,.0f} million places for plants need {needed / 2**30:,.1f} GiB, and this "
                f"device can give {free / 2**30:,.1f} GiB; lower density_per_m2 or reach_m"
            )
        room = min(device.limits.storage_block_bytes, _MOST_BYTES) // _FLOWER.dtype.itemsize
        self._parts = [
            _Part(i, first, count, device.ctx.buffer(reserve=_FLOWER.dtype.itemsize * count))
            for i, edge in enumerate(edges)
            for first in range(0, edge * edge, room)
            for count in [min(room, edge * edge - first)]
        ]

    def update(self, frame: FrameTime) -> None:
        """Place them around the camera and sway them, for every view of this frame."""
        if not self._tables:
            return
        focus = frame.views[0].camera_ws
        anchor_ws = frame.views[0].anchor_ws
        shared = {"focus_ws": focus - anchor_ws, "time_s": frame.time_s, "previous_time_s": frame.previous_time_s}
        self._first_cells = [
            tuple(math.floor(focus[axis] / cell) - edge // 2 for axis in (0, 2))
            for cell, edge in zip(self._cells_m, self._edges, strict=True)
        ]
        for part in self._parts:
            i = part.table
            table, cell, edge = self._tables[i], self._cells_m[i], self._edges[i]
            self._grow.run(
                grid(-(-part.places // 64)),
                **shared,
                Flowers=part.flowers,
                first_cell=self._first_cells[i],
                cells=edge,
                first_place=part.first,
                places=part.places,
                cell_m=cell,
                anchor_cell=np.floor(anchor_ws[[0, 2]] / cell).astype(np.int32),
                in_cell=anchor_ws[[0, 2]] / cell % 1.0,
                salt=9001 + 577 * i,
                height_m=table.height_m,
                aspect=self._aspects[i],
                patchiness=table.patchiness,
                stiffness=table.stiffness,
                reach_m=table.reach_m,
            )
        self._ctx.memory_barrier(STORAGE_WRITTEN)

    def draw(self, view: View) -> None:
        """Draw every plant; a shadow map that is too coarse to show one has none."""
        if not self._tables:
            return
        draw = self._draws[view.purpose]
        for part in self._parts:
            i = part.table
            table = self._tables[i]
            if view.purpose == "shadow" and view.pixel_m[1] > 0.5 * table.height_m[1] * self._aspects[i]:
                continue
            draw.run(
                moderngl.TRIANGLE_STRIP,
                6,
                part.places,
                Flowers=part.flowers,
                flower_images=self._pictures,
                first_flower=self._firsts[i] + part.first,
                layer=i,
            )

    def identify(self, numbers: npt.NDArray[np.uint32]) -> Ids:
        """Find the permanent ids of plants by their numbers, counted through all tables: uint64 (n,)."""
        table = np.searchsorted(self._firsts, numbers, side="right") - 1
        edge, first = np.array(self._edges)[table], np.array(self._first_cells)[table]
        row, column = np.divmod(numbers - np.array(self._firsts)[table], edge)
        return blade_ids(BladeKind.FLOWER, table, first[:, 0] + column, first[:, 1] + row)

    def release(self) -> None:
        """Free the GPU resources."""
        if not self._tables:
            return
        release_all(*self._draws.values(), self._grow, self._pictures, *(part.flowers for part in self._parts))
