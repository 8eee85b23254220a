"""Flower and seed heads at the tips of blades that carry one: small geometry, one instance a head."""

import moderngl

from greensward.culling import distance_defines
from greensward.gpu.program import build
from greensward.gpu.view import View
from greensward.passes.heads.meshes import LEVELS, head_meshes
from greensward.sowing import Page
from greensward.world import CHUNKS, HEAD_PX, HEADS, MESHES, SOWN, World

_FOLDER = "passes/heads"


class Heads:
    """Draws the heads of the field's blades, in full near the camera and simply beyond."""

    def __init__(self, ctx: moderngl.Context, world: World) -> None:
        self._ctx, self._world = ctx, world
        levels = ", ".join(f"ivec2({first}, {vertices})" for first, vertices in LEVELS)
        shared: dict[str, object] = {"LEVELS": levels, **distance_defines(world.scene.culling)}
        if growth := world.scene.growth:
            # a head is as large as its blade's height is near to what it comes to in the end
            shared["FULL_HEIGHT"] = float(growth.height[-1][1] or 1.0)
        self._arrays = {
            purpose: ctx.vertex_array(
                build(ctx, f"{_FOLDER}/head.vert", f"{_FOLDER}/head.frag", defines={**defines, **shared}), []
            )
            for purpose, defines in (("picture", {}), ("shadow", {"SHADOW": 1}))
        }
        for array in self._arrays.values():
            array.program["levelPx"] = HEAD_PX
        self._meshes = ctx.buffer(head_meshes().tobytes())

    def draw(self, view: View) -> None:
        """Draw every head that the view may show."""
        array = self._arrays[view.purpose]
        program = array.program
        for seen in self._world.seen(view):
            page = seen.page
            if not isinstance(page, Page):
                continue
            for level, (heads, (_, vertices)) in enumerate(zip(seen.heads, LEVELS, strict=True)):
                if not heads.count:
                    continue
                page.bind()
                self._world.chunks.bind(CHUNKS)
                page.heads.bind_to_storage_buffer(HEADS)
                self._meshes.bind_to_storage_buffer(MESHES)
                program["finestLevel"] = level
                program["firstChunk"] = heads.first
                if page.sown is not None:
                    page.sown.bind_to_storage_buffer(SOWN)
                if view.purpose == "picture":
                    program["firstId"] = page.first_id
                    program["previousFromNow"] = tuple(view.relative(page.previous_from_now).T.ravel())
                array.render(moderngl.TRIANGLES, vertices=vertices, instances=heads.count)

    def release(self) -> None:
        """Free the GPU resources."""
        for array in self._arrays.values():
            array.program.release()
            array.release()
        self._meshes.release()
