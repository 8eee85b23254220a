"""Flower and seed heads at the tips of blades that carry one: small meshes, sorted by level of detail on the GPU."""

from collections.abc import Iterable

import moderngl
import numpy as np

from greensward.culling import distance_defines
from greensward.culling.compaction import DRAW_COMMAND, Compaction
from greensward.culling.visible import DrawList
from greensward.gpu.buffers import at_least, release_all, zeros
from greensward.gpu.device import COMMANDS_WRITTEN, STORAGE_WRITTEN, Device
from greensward.gpu.kernels import Bindings, Draw, Kernel, grid
from greensward.gpu.layouts import WORD, struct
from greensward.gpu.view import View
from greensward.passes.heads.meshes import FAR_PAINT, LEVELS, OUTLINES, head_meshes
from greensward.sowing import Page
from greensward.world import World

_FOLDER = "passes/heads"
_VERTEX = struct("HeadVertex", ("place", "vec4"), ("normal", "vec4"))
_LEVEL_PX = 28.0, 6.0
"""Size on the screen down to which a head has full, and simple, detail; below, it is a triangle."""
_FAR = len(_LEVEL_PX)
_MOST_HEADS = {"picture": 12, "shadow": 2}
"""Heads as which one may be drawn for those that distance leaves out."""


class Heads:
    """Draws the heads of the field's blades, in full near the camera and simply beyond."""

    def __init__(self, device: Device, world: World) -> None:
        self._device, self._world = device, world
        scene = world.scene
        shared: dict[str, object] = dict(distance_defines(scene.culling))
        if growth := scene.growth:
            # a head is as large as its blade's height is near to what it comes to in the end
            shared["FULL_HEIGHT"] = float(growth.height[-1][1] or 1.0)
        if scene.culling.frustum:
            shared["FRUSTUM"] = 1
        stages = f"{_FOLDER}/head.vert", f"{_FOLDER}/head.frag"
        self._sort: dict[str, Kernel] = {}
        self._draws: dict[str, Draw] = {}
        for purpose, defines in (("picture", shared), ("shadow", {**shared, "SHADOW": 1})):
            self._sort[purpose] = Kernel(device, f"{_FOLDER}/sort.comp", defines, world.bindings)
            self._draws[purpose] = Draw(
                device, *stages, defines=defines, bindings=world.bindings, generated={f"{_FOLDER}/tables": _tables()}
            )
        self._list = Kernel(device, f"{_FOLDER}/list.comp", {}, world.bindings)
        self._compaction = Compaction(device)
        self._listed = zeros(device, WORD)
        self._commands = zeros(device, (2 + _FAR) * DRAW_COMMAND.dtype.itemsize)
        meshes = head_meshes()
        assert meshes.shape[-1] * meshes.itemsize == _VERTEX.dtype.itemsize
        self._meshes = device.ctx.buffer(meshes.tobytes())
        self._broadest_m = max((grass.head_size_m[1] for grass in scene.grass), default=0.0)

    def draw(self, view: View) -> None:
        """Draw every head that the view may show."""
        # in shadow maps a head is always a triangle
        levels = range(_FAR if view.purpose == "shadow" else 0, _FAR + 1)
        for shown in self._world.visible.of(view):
            page = shown.page
            if not isinstance(page, Page) or not shown.heads.count:
                continue
            values = dict(page.bindings)
            if page.sown is not None:
                values["Sown"] = page.sown
            # on an object the places of neighbours are unknown
            each = [1] * (1 + _FAR) if page.object_index is not None else self._heads_each(view)
            self._fill(shown, page, values, view, each)
            for level in levels:
                self._draws[view.purpose].run_indirect(
                    moderngl.TRIANGLES,
                    self._commands,
                    1 + level,
                    **values,
                    Listed=self._listed,
                    Meshes=self._meshes,
                    level=level,
                    room=shown.heads.items,
                    heads_each=each[level],
                    first_blade_number=page.first_number,
                    previous_from_now=view.relative(page.previous_from_now),
                )

    def _heads_each(self, view: View) -> list[int]:
        """Find as how many heads one may be drawn at each level of detail: as many as where the level ends."""
        scene = self._world.scene
        sizes_px = np.array([*_LEVEL_PX, 1e-9])
        ends_m = (self._broadest_m / sizes_px - view.pixel_m[1]) / max(view.pixel_m[0], 1e-9)
        if view.purpose == "shadow" or view.pixel_m[0] <= 0.0:
            ends_m = np.full(_FAR + 1, scene.sowing.blades_m)
        full_m = scene.sowing.full_density_m if scene.culling.distance else np.inf
        each = np.maximum(ends_m / full_m, 1.0) ** 2 / max(view.density, 1e-6)
        least: list[int] = np.ceil(np.minimum(each, _MOST_HEADS[view.purpose])).astype(int).tolist()
        return least

    def _fill(self, shown: DrawList, page: Page, values: Bindings, view: View, each: list[int]) -> None:
        """List the heads of a page that the view shows by level, with a draw command for each."""
        device, heads, words = self._device, shown.heads, (_FAR + 1) * shown.heads.count
        # heads of an object stand against the sky, where one sees what carries them
        far_stems = int(page.object_index is not None and view.purpose == "picture")
        self._listed = at_least(device, self._listed, (_FAR + 1) * heads.items * WORD)
        self._compaction.make_room(words)
        chunked = {
            "Chunks": self._world.visible.chunks.buffer,
            "first_chunk": heads.first,
            "chunk_count": heads.count,
            "Heads": page.heads,
        }
        device.ctx.memory_barrier(STORAGE_WRITTEN)
        self._sort[view.purpose].run(
            heads.groups,
            **values,
            **chunked,
            Masks=self._compaction.masks,
            heads_each=each,
            level_px=_LEVEL_PX,
        )
        self._compaction.sum_up(words, self._commands, 0)
        self._list.run(
            grid(words),
            **chunked,
            **self._compaction.bindings,
            Listed=self._listed,
            Commands=self._commands,
            room=heads.items,
            vertices=[*(vertices for _, vertices in LEVELS), 3 * (each[_FAR] + far_stems)],
            instances=[*each[:_FAR], 1],
        )
        device.ctx.memory_barrier(STORAGE_WRITTEN | COMMANDS_WRITTEN)

    def release(self) -> None:
        """Free the GPU resources."""
        release_all(*self._sort.values(), *self._draws.values(), self._list, self._compaction)
        release_all(self._listed, self._commands, self._meshes)


def _tables() -> str:
    """Levels and kinds of heads in GLSL."""
    return f"""
const ivec2 levels[] = ivec2[]({_vectors("ivec2", LEVELS)});  // first vertex and vertices of each, the finest first
const int VERTICES = levels[{_FAR - 1}].x + levels[{_FAR - 1}].y;
const vec2 outlines[] = vec2[]({_vectors("vec2", OUTLINES.values())});  // areas from the side and along the axis
const vec2 far_paint[] = vec2[]({_vectors("vec2", FAR_PAINT.values())});  // heart and stem, parts of the colour
"""


def _vectors(kind: str, pairs: Iterable[tuple[float, float]]) -> str:
    return ", ".join(f"{kind}({first}, {second})" for first, second in pairs)
