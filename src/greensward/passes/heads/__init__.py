"""Flower and seed heads at the tips of blades that carry one: small meshes, one instance a head."""

import moderngl

from greensward.culling import distance_defines
from greensward.culling.visible import HEAD_PX
from greensward.gpu.buffers import release_all
from greensward.gpu.device import Device
from greensward.gpu.kernels import Draw
from greensward.gpu.layouts import struct
from greensward.gpu.view import View
from greensward.passes.heads.meshes import LEVELS, head_meshes
from greensward.sowing import Page
from greensward.world import World

_FOLDER = "passes/heads"
_VERTEX = struct("HeadVertex", ("place", "vec4"), ("normal", "vec4"))


class Heads:
    """Draws the heads of the field's blades, in full near the camera and simply beyond."""

    def __init__(self, device: Device, world: World) -> None:
        self._world = world
        levels = ", ".join(f"ivec2({first}, {vertices})" for first, vertices in LEVELS)
        shared: dict[str, object] = {"LEVELS": levels, **distance_defines(world.scene.culling)}
        if growth := world.scene.growth:
            # a head is as large as its blade's height is near to what it comes to in the end
            shared["FULL_HEIGHT"] = float(growth.height[-1][1] or 1.0)
        stages = f"{_FOLDER}/head.vert", f"{_FOLDER}/head.frag"
        self._draws = {
            purpose: Draw(device, *stages, defines={**defines, **shared}, bindings=world.bindings)
            for purpose, defines in (("picture", {}), ("shadow", {"SHADOW": 1}))
        }
        meshes = head_meshes()
        assert meshes.shape[-1] * meshes.itemsize == _VERTEX.dtype.itemsize
        self._meshes = device.ctx.buffer(meshes.tobytes())

    def draw(self, view: View) -> None:
        """Draw every head that the view may show."""
        draw = self._draws[view.purpose]
        chunks = self._world.visible.chunks.buffer
        for each in self._world.visible.of(view):
            page = each.page
            if not isinstance(page, Page) or not each.heads:
                continue
            values = {**page.bindings, "Chunks": chunks, "Heads": page.heads, "Meshes": self._meshes}
            if page.sown is not None:
                values["Sown"] = page.sown
            for level, (heads, (_, vertices)) in enumerate(zip(each.heads, LEVELS, strict=True)):
                if heads.count:
                    draw.run(
                        moderngl.TRIANGLES,
                        vertices,
                        heads.count,
                        **values,
                        level_px=HEAD_PX,
                        finest_level=level,
                        first_chunk=heads.first,
                        first_blade_number=page.first_number,
                        previous_from_now=view.relative(page.previous_from_now),
                    )

    def release(self) -> None:
        """Free the GPU resources."""
        release_all(*self._draws.values())
        self._meshes.release()
