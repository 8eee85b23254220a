"""Quads bent along two splines by the tessellation stages, outlined by textures."""

from collections import ChainMap
from collections.abc import Mapping
from typing import Any, ClassVar, get_args

import moderngl
import numpy as np
import numpy.typing as npt
from pydantic import BaseModel

from greensward.culling import CHUNK, BladeCulling, DrawList, distance_defines
from greensward.gpu.buffers import BufferRange, at_least, clear, read_back, release_all, zeros
from greensward.gpu.device import STORAGE_WRITTEN, Device
from greensward.gpu.kernels import Bindings, Draw, Kernel
from greensward.gpu.layouts import WORD, BlockBuffer
from greensward.gpu.view import View
from greensward.motion import motion_defines
from greensward.scene import InputError, Scene
from greensward.sowing import sward_defines
from greensward.sowing.identity import Ids
from greensward.techniques.blades.leaf import LEAF_BLOCK
from greensward.techniques.technique import Needs
from greensward.techniques.tessellated_quads.instances import FADING, Instances
from greensward.techniques.tessellated_quads.patches import PatchGrid, areas_in_patches
from greensward.techniques.tessellated_quads.pictures import coloured, picture_array, slender
from greensward.techniques.tessellated_quads.settings import QuadSettings
from greensward.world import FrameTime, World

_FOLDER = "techniques/tessellated_quads"
_DRAWN_PARTS = 1024
_STAGES = [f"{_FOLDER}/blade.{stage}" for stage in ("vert", "tesc", "tese", "frag")]


class TessellatedQuads:
    """A blade is a patch of one vertex: outlined in the vertex stage, culled and cut in the next, then bent."""

    name: ClassVar[str] = "tessellated-quads"
    source: ClassVar[str] = "Jahrmann & Wimmer 2013, Interactive Grass Rendering Using Real-Time Tessellation"
    Settings: ClassVar[type[BaseModel]] = QuadSettings

    def __init__(self, device: Device, world: World, settings: QuadSettings) -> None:
        self._device, self._world, self._settings = device, world, settings
        scene = world.scene
        self._instances: Instances | None = None
        if settings.mode == "instanced":
            self._instances = Instances(device, world, settings, world.field.tallest_m + self._slack_m())
        self._grid = PatchGrid(device, settings)
        self._block, culled_by = (BlockBuffer(device.ctx, LEAF_BLOCK) for _ in range(2))
        values = {**settings.block_values(), "slack_m": self._slack_m()}
        self._block.set(**values)
        # what leans at random is seen edge-on elsewhere than the pose that culling knows
        culled_by.set(**(values | {"orientation_limit": 2.0} if settings.quads == "random" else values))
        self._culled_by = culled_by
        self._pictures = picture_array(device.ctx, scene)
        bindings = world.bindings
        bindings |= {"Leaf": self._block, "blade_images": self._pictures, **self._grid.bindings}
        self._drawn = zeros(device, _DRAWN_PARTS * WORD)
        self._stored = self._draws_of(bindings, {}) if not self._instances or _bears_grass(scene) else {}
        self._instanced = (
            self._draws_of(bindings, {"INSTANCED": 1, **motion_defines(scene)}) if self._instances else {}
        )
        occlusion = world.depth_pyramid is not None
        own: Bindings = {"Leaf": culled_by}
        culled = ChainMap(own, bindings)
        self._culling = BladeCulling(device, culled, scene.culling, f"{_FOLDER}/width.glsl", occlusion)
        self._list = Kernel(device, f"{_FOLDER}/list.comp", {}, bindings)
        self._listed = device.ctx.buffer(reserve=WORD)
        self._parts: dict[View, list[tuple[DrawList, BufferRange, int]]] = {}

    @staticmethod
    def check(scene: Scene, settings: QuadSettings) -> None:
        """Refuse a grid of too many patches, and blades of other heights than those that grow."""
        areas_in_patches(settings)
        if not scene.growth:
            return
        if settings.mode == "instanced":
            raise InputError('technique.mode: must be "basic" with [growth], as instanced blades are full-grown')
        if settings.quads == "random":
            raise InputError('technique.quads: must be "sown" with [growth], as random quads are full-grown')
        if any(each.height_m for each in settings.patch):
            raise InputError(
                "technique.patch: height_m must be left out with [growth], as such blades are full-grown"
            )

    @staticmethod
    def needs(settings: QuadSettings) -> Needs:
        """Stored blades, and those of its densest patches; instanced it brings its own for the ground."""
        return Needs(
            on_ground=settings.mode == "basic",
            density=settings.most_density,
            thinning=settings.thinning,
            shrinking=settings.shrinking,
        )

    def _draws_of(self, bindings: Bindings, defines: dict[str, object]) -> dict[str, Draw]:
        """Programs that draw stored or instanced blades, by the purpose of a view."""
        draws = {
            purpose: Draw(self._device, *_STAGES, defines={**self._defines(purpose), **defines}, bindings=bindings)
            for purpose in ("picture", "shadow")
        }
        for draw in draws.values():
            draw.set(**self._uniforms(), **(self._uniforms_of_instances() if defines else {}))
        return draws

    def _defines(self, purpose: str) -> dict[str, object]:
        scene, settings = self._world.scene, self._settings
        asked = {
            "FRUSTUM": scene.culling.frustum,
            "RANDOM_QUADS": settings.quads == "random",
            "SHADED_ALONE": settings.shading == "blade",
            "HASHED": settings.alpha == "hashed",
            "SHADOW": purpose == "shadow",
        }
        defines = {name: 1 for name, holds in asked.items() if holds}
        return {"FADING": FADING, **distance_defines(scene.culling), **sward_defines(scene), **defines}

    def _slack_m(self) -> float:
        """Reach of a blade from its root: its own offset, and what moves it added to that."""
        settings = self._settings
        heights = [1.5 * float(each.height_m[1]) for each in settings.patch if each.height_m]
        tallest = max(self._world.field.tallest_m, *heights, 0.0)
        if settings.quads == "sown":
            return 1.25 * tallest
        return 3.75 * tallest + 2.0 * max(
            settings.bending_m, *(each.bending_m or 0.0 for each in settings.patch), 0.0
        )

    def _uniforms(self) -> dict[str, object]:
        settings = self._settings
        return {
            **{name: getattr(settings, name) for name in ("patch_m", "thinning", "shrinking", "px_per_quad")},
            "measure": _numbered("level", settings),
            "own_colours": coloured(self._world.scene),
            "slender": slender(self._world.scene),
        }

    def _uniforms_of_instances(self) -> dict[str, object]:
        assert self._instances
        return {
            "blades_stored": self._instances.stored,
            "variation": _numbered("variation", self._settings),
            "tallest_m": self._instances.tallest_m,
        }

    def update(self, frame: FrameTime) -> None:
        """Find the places of the patch, or make room for a list of the blades that some view may show."""
        self._frame = frame
        if self._instances:
            self._instances.place(frame.views)
        self._parts.clear()
        self._used = self._commands = 0
        shown = [each for view in frame.views for each in self._world.visible.of(view)]
        self._listed = at_least(self._device, self._listed, sum(map(_room, shown)))
        self._culling.make_room(len(shown), max((each.blades.count for each in shown), default=0))

    def draw(self, view: View) -> None:
        """Draw every blade that the view shows."""
        self._device.ctx.patch_vertices = 1
        if view.purpose == "picture":
            clear(self._device, self._drawn, self._drawn.size)
        place = self._grid.counted_from(view.anchor_ws)
        self._draw_stored(view, place)
        if self._instances:
            self._draw_instances(self._instances, view, place)

    def _draw_instances(self, instances: Instances, view: View, place: Mapping[str, Any]) -> None:
        for group in instances.groups.get(view, ()):
            self._instanced[view.purpose].run(
                moderngl.PATCHES,
                CHUNK,
                group.count * group.chunks,
                Drawn=self._drawn,
                **instances.bindings,
                **place,
                time_s=self._frame.time_s,
                previous_time_s=self._frame.previous_time_s,
                previous_from_now=np.eye(4),
                first_blade_number=instances.first_number,
                first_place=group.first,
                chunks_per_patch=group.chunks,
                blades_per_patch=group.blades,
            )

    def _draw_stored(self, view: View, place: Mapping[str, Any]) -> None:
        if view not in self._parts:
            self._parts[view] = [self._list_blades(shown, view) for shown in self._world.visible.of(view)]
        commands = self._culling.commands
        for shown, listed, command in self._parts[view]:
            page = shown.page
            self._stored[view.purpose].run_indirect(
                moderngl.PATCHES,
                commands,
                command,
                **page.bindings,
                **place,
                Drawn=self._drawn,
                Listed=listed,
                Commands=commands,
                command=command,
                on_ground=page.object_index is None,
                first_blade_number=page.first_number,
                previous_from_now=view.relative(page.previous_from_now),
            )

    def _list_blades(self, shown: DrawList, view: View) -> tuple[DrawList, BufferRange, int]:
        """Test the blades of a page; returns the list of the survivors, and the command that draws them."""
        part = shown, BufferRange(self._listed, self._used, _room(shown)), self._commands
        self._used += _room(shown)
        self._commands += 1
        chunks = self._world.visible.chunks
        self._culling.cull(shown.page, shown.blades, chunks, view, part[2])
        self._list.run(
            shown.blades.groups,
            **self._culling.compacted,
            Chunks=chunks.buffer,
            Listed=part[1],
            first_chunk=shown.blades.first,
            chunk_count=shown.blades.count,
        )
        self._device.ctx.memory_barrier(STORAGE_WRITTEN)
        return part

    def identify(self, numbers: npt.NDArray[np.uint32]) -> Ids:
        """Find the permanent ids of stored blades, or of those of the patch at its places, by their numbers."""
        ids = self._world.field.identify(numbers)
        if self._instances and (mine := numbers >= self._instances.first_number).any():
            ids[mine] = self._instances.identify(numbers[mine])
        return ids

    def considered(self, view: View) -> int:
        """Count the blades of this view that were handed to its tests in the last frame."""
        groups = self._instances.groups.get(view, ()) if self._instances else ()
        return self._world.visible.considered(view) + sum(group.count * group.blades for group in groups)

    def drawn(self, view: View) -> int:  # noqa: ARG002
        """Count the blades of the picture that were cut into at least one quad in the last frame."""
        return int(np.frombuffer(read_back(self._device, self._drawn), np.uint32).sum())

    def release(self) -> None:
        """Free programs, blocks, textures and buffers."""
        if self._instances:
            self._instances.release()
        release_all(*self._stored.values(), *self._instanced.values(), self._culling, self._list, self._grid)
        release_all(self._block, self._culled_by, self._pictures, self._drawn, self._listed)


def _bears_grass(scene: Scene) -> bool:
    return any(each.grass and each.grass.density_per_m2 > 0 for each in scene.object)


def _numbered(name: str, settings: QuadSettings) -> int:
    """Number of the chosen one of a setting's alternatives."""
    alternatives = get_args(QuadSettings.model_fields[name].annotation)
    return alternatives.index(getattr(settings, name))


def _room(shown: DrawList) -> int:
    """Bytes for a list of all its blades, as long as bindings must be aligned."""
    return -(-shown.blades.items // 64) * 64 * WORD
