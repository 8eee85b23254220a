"""Plants that are pictures: placed, swayed and drawn without anything stored."""

import math

import moderngl

from greensward.culling import at_least
from greensward.gpu.program import build, build_compute, put
from greensward.gpu.view import View
from greensward.motion import motion_defines
from greensward.passes.flowers.pictures import flower_array
from greensward.world import Instant, World

_FOLDER = "passes/flowers"
_FLOWERS, _PICTURES_UNIT = 0, 20
_FLOWER_BYTES = 80


class BillboardFlowers:
    """Draws the scene's `[[flowers]]` tables."""

    def __init__(self, ctx: moderngl.Context, world: World) -> None:
        self._ctx, self._world = ctx, world
        self._tables = world.scene.flowers
        if not self._tables:
            return
        self._pictures, self._aspects = flower_array(ctx, world.scene)
        self._grow = build_compute(ctx, f"{_FOLDER}/grow.comp", motion_defines(world.scene))
        stages = f"{_FOLDER}/flower.vert", f"{_FOLDER}/flower.frag"
        self._arrays = {
            purpose: ctx.vertex_array(build(ctx, *stages, defines=defines), [])
            for purpose, defines in (("picture", {}), ("shadow", {"SHADOW": 1}))
        }
        self._cells_m = [1.0 / math.sqrt(table.density_per_m2) for table in self._tables]
        edges = [
            2 * math.ceil(table.reach_m / cell) + 1 for table, cell in zip(self._tables, self._cells_m, strict=True)
        ]
        self._edges = edges
        self._firsts = [sum(edge * edge for edge in edges[:i]) for i in range(len(edges))]
        self._flowers = at_least(ctx, ctx.buffer(reserve=20), _FLOWER_BYTES * sum(edge * edge for edge in edges))

    def update(self, instant: Instant) -> None:
        """Let them grow around the camera and sway, for every view of this instant."""
        if not self._tables:
            return
        focus = instant.views[0].camera_ws
        self._flowers.bind_to_storage_buffer(_FLOWERS)
        shared = {"focus_ws": tuple(focus), "timeNow": instant.time_s, "timePrevious": instant.previous_time_s}
        for i, (table, cell, edge) in enumerate(zip(self._tables, self._cells_m, self._edges, strict=True)):
            put(
                self._grow,
                **shared,
                firstCell=tuple(math.floor(focus[axis] / cell) - edge // 2 for axis in (0, 2)),
                cells=(edge, edge),
                firstFlower=self._firsts[i],
                cell_m=cell,
                salt=9001 + 577 * i,
                height_m=table.height_m,
                aspect=self._aspects[i],
                patchiness=table.patchiness,
                stiffness=table.stiffness,
                reach_m=table.reach_m,
            )
            self._grow.run(-(-edge * edge // 64))
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def draw(self, view: View) -> None:
        """Draw every plant; a shadow map that is too coarse to show one has none."""
        if not self._tables:
            return
        array = self._arrays[view.purpose]
        self._flowers.bind_to_storage_buffer(_FLOWERS)
        self._pictures.use(_PICTURES_UNIT)
        for i, (table, edge) in enumerate(zip(self._tables, self._edges, strict=True)):
            if view.purpose == "shadow" and view.pixel_m[1] > 0.5 * table.height_m[1] * self._aspects[i]:
                continue
            put(array.program, firstFlower=self._firsts[i], layer=i)
            array.render(moderngl.TRIANGLE_STRIP, vertices=6, instances=edge * edge)

    def release(self) -> None:
        """Free the GPU resources."""
        if not self._tables:
            return
        for array in self._arrays.values():
            array.program.release()
            array.release()
        for part in (self._grow, self._pictures, self._flowers):
            part.release()
