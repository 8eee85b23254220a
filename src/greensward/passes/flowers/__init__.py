"""Billboard flowers: placed, swayed and drawn without anything stored."""

import math

import moderngl

from greensward.gpu.buffers import release_all
from greensward.gpu.device import STORAGE_WRITTEN, Device
from greensward.gpu.kernels import Draw, Kernel
from greensward.gpu.layouts import struct
from greensward.gpu.view import View
from greensward.motion import motion_defines
from greensward.passes.flowers.pictures import flower_array
from greensward.sowing import colour_defines
from greensward.world import FrameTime, World

_FOLDER = "passes/flowers"
# a plant at this instant; without height where none grows
_FLOWER = struct(
    "Flower",
    ("root", "vec4"),  # xyz in the world; height
    ("control", "vec4"),  # of the stem's curve, from the root; width of the picture
    ("tip", "vec4"),  # from the root; random number
    ("control_before", "vec4"),
    ("tip_before", "vec4"),
)


class BillboardFlowers:
    """Draws the scene's `[[flowers]]` tables."""

    def __init__(self, device: Device, world: World) -> None:
        self._ctx = device.ctx
        self._tables = world.scene.flowers
        if not self._tables:
            return
        self._pictures, self._aspects = flower_array(device.ctx, world.scene)
        self._grow = Kernel(
            device,
            f"{_FOLDER}/grow.comp",
            {**motion_defines(world.scene), **colour_defines(world.scene)},
            world.bindings,
        )
        stages = f"{_FOLDER}/flower.vert", f"{_FOLDER}/flower.frag"
        self._draws = {
            purpose: Draw(device, *stages, defines=defines, bindings=world.bindings)
            for purpose, defines in (("picture", {}), ("shadow", {"SHADOW": 1}))
        }
        self._cells_m = [1.0 / math.sqrt(table.density_per_m2) for table in self._tables]
        edges = [
            2 * math.ceil(table.reach_m / cell) + 1 for table, cell in zip(self._tables, self._cells_m, strict=True)
        ]
        self._edges = edges
        self._firsts = [sum(edge * edge for edge in edges[:i]) for i in range(len(edges))]
        self._flowers = device.ctx.buffer(reserve=_FLOWER.dtype.itemsize * sum(edge * edge for edge in edges))

    def update(self, frame: FrameTime) -> None:
        """Place them around the camera and sway them, for every view of this frame."""
        if not self._tables:
            return
        focus = frame.views[0].camera_ws
        shared = {"focus_ws": focus, "time_s": frame.time_s, "previous_time_s": frame.previous_time_s}
        for i, (table, cell, edge) in enumerate(zip(self._tables, self._cells_m, self._edges, strict=True)):
            self._grow.run_over(
                edge * edge,
                **shared,
                Flowers=self._flowers,
                first_cell=tuple(math.floor(focus[axis] / cell) - edge // 2 for axis in (0, 2)),
                cells=(edge, edge),
                first_flower=self._firsts[i],
                cell_m=cell,
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
        for i, (table, edge) in enumerate(zip(self._tables, self._edges, strict=True)):
            if view.purpose == "shadow" and view.pixel_m[1] > 0.5 * table.height_m[1] * self._aspects[i]:
                continue
            draw.run(
                moderngl.TRIANGLE_STRIP,
                6,
                edge * edge,
                Flowers=self._flowers,
                flower_images=self._pictures,
                first_flower=self._firsts[i],
                layer=i,
            )

    def release(self) -> None:
        """Free the GPU resources."""
        if not self._tables:
            return
        release_all(*self._draws.values(), self._grow, self._pictures, self._flowers)
