"""Flower and seed heads at the tips of blades that carry one: small geometry, one instance a head."""

import moderngl
import numpy as np

from greensward.culling import Chunks
from greensward.culling.tiles import distance_to
from greensward.gpu.program import build
from greensward.gpu.view import View
from greensward.passes.heads.meshes import FAR_VERTICES, NEAR_VERTICES, head_meshes
from greensward.sowing import Page
from greensward.world import BLADES, CHUNKS, HEADS, POSTURES, World

_MESH = 4
_FOLDER = "passes/heads"
_NEAR_PX = 9.0  # heads smaller than this on the screen are drawn simply


class Heads:
    """Draws the heads of the field's blades, in full near the camera and simply beyond."""

    def __init__(self, ctx: moderngl.Context, world: World) -> None:
        self._ctx, self._world = ctx, world
        self._largest_m = max(
            (grass.head_size_m[1] for grass in world.scene.grass if grass.head != "none"), default=0.0
        )
        self._arrays = {
            purpose: ctx.vertex_array(
                build(ctx, f"{_FOLDER}/head.vert", f"{_FOLDER}/head.frag", defines=defines), []
            )
            for purpose, defines in (("picture", {}), ("shadow", {"SHADOW": 1}))
        }
        self._meshes = ctx.buffer(head_meshes().tobytes())
        self._drawn: dict[View, list[tuple[Page, Chunks, bool]]] = {}
        self._drawn_for: tuple[View, ...] = ()
        self._pool: list[Chunks] = []

    def draw(self, view: View) -> None:
        """Draw every head that the view may show."""
        if not self._largest_m:
            return
        array = self._arrays[view.purpose]
        program = array.program
        for page, heads, near in self._select(view):
            page.blades.bind_to_storage_buffer(BLADES)
            page.postures.bind_to_storage_buffer(POSTURES)
            heads.bind(CHUNKS)
            page.heads.bind_to_storage_buffer(HEADS)
            self._meshes.bind_to_storage_buffer(_MESH)
            program["near"] = near
            if "firstId" in program:
                program["firstId"] = page.first_id
            array.render(
                moderngl.TRIANGLES, vertices=NEAR_VERTICES if near else FAR_VERTICES, instances=heads.count
            )

    def _select(self, view: View) -> list[tuple[Page, Chunks, bool]]:
        """Heads by page, the near ones apart; selected anew only when the world culls anew."""
        if self._drawn_for is not self._world.views:
            self._drawn_for = self._world.views
            self._drawn.clear()
        if view in self._drawn:
            return self._drawn[view]
        found: list[tuple[Page, Chunks, bool]] = []
        reach = self._largest_m / (view.pixel_m[0] * _NEAR_PX) if view.pixel_m[0] else 0.0
        for page, tiles in self._world.seen_tiles(view):
            away = distance_to(page.tiles, view.camera_ws)[tiles]
            for near in (True, False):
                some = tiles[(away < reach) == near]
                some = some[page.tiles.heads[some] > 0]
                if len(some):
                    taken = sum(map(len, self._drawn.values())) + len(found)
                    while len(self._pool) <= taken:
                        self._pool.append(Chunks(self._ctx, 1))
                    self._pool[taken].set(page.tiles.head_start[some], page.tiles.heads[some])
                    found.append((page, self._pool[taken], near))
        self._drawn[view] = found
        return found

    def release(self) -> None:
        """Free the GPU resources."""
        for array in self._arrays.values():
            array.program.release()
            array.release()
        for chunks in self._pool:
            chunks.release()
        self._meshes.release()
