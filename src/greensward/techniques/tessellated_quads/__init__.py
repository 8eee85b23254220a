"""Quads bent along two splines by the tessellation stages, outlined by textures."""

from typing import ClassVar

import moderngl
import numpy as np
import numpy.typing as npt
from pydantic import BaseModel

from greensward.culling import CHUNK, BladeCulling, DrawList, distance_defines
from greensward.gpu.buffers import BufferRange, at_least, read_back, release_all, upload
from greensward.gpu.device import STORAGE_WRITTEN, Device
from greensward.gpu.kernels import Draw, Kernel
from greensward.gpu.layouts import WORD, BlockBuffer
from greensward.gpu.view import View
from greensward.motion import motion_defines
from greensward.scene import InputError
from greensward.sowing import sward_defines
from greensward.sowing.identity import Ids
from greensward.techniques.blades.leaf import LEAF_BLOCK
from greensward.techniques.technique import Needs
from greensward.techniques.tessellated_quads.instances import FADING, Instances
from greensward.techniques.tessellated_quads.pictures import coloured, picture_array, slender
from greensward.techniques.tessellated_quads.settings import QuadSettings
from greensward.world import FrameTime, World

_FOLDER = "techniques/tessellated_quads"
_DRAWN_PARTS = 1024
_NONE_DRAWN = np.zeros(_DRAWN_PARTS, np.uint32)
_STAGES = [f"{_FOLDER}/blade.{stage}" for stage in ("vert", "tesc", "tese", "frag")]


class TessellatedQuads:
    """A blade is a patch of one vertex: outlined in the vertex stage, culled and cut in the next, then bent."""

    name: ClassVar[str] = "tessellated-quads"
    source: ClassVar[str] = "Jahrmann & Wimmer 2013, Interactive Grass Rendering Using Real-Time Tessellation"
    Settings: ClassVar[type[BaseModel]] = QuadSettings

    def __init__(self, device: Device, world: World, settings: QuadSettings) -> None:
        self._device, self._world, self._settings = device, world, settings
        scene = world.scene
        self._instances = None
        if not self.needs(settings).stored:
            if scene.growth:
                raise InputError('technique.mode: must be "basic" with [growth], as instanced blades are full-grown')
            self._instances = Instances(device, world, settings)
        self._block = BlockBuffer(device.ctx, LEAF_BLOCK)
        self._block.set(**settings.block_values(), slack_m=self._slack_m())
        self._pictures = picture_array(device.ctx, scene)
        bindings = world.bindings
        bindings |= {"Leaf": self._block, "blade_images": self._pictures}
        self._drawn = device.ctx.buffer(_NONE_DRAWN)
        self._draws = {
            purpose: Draw(device, *_STAGES, defines=self._defines(purpose), bindings=bindings)
            for purpose in ("picture", "shadow")
        }
        for draw in self._draws.values():
            draw.set(**self._uniforms(), **self._patches())
        occlusion = world.depth_pyramid is not None
        self._culling = BladeCulling(device, bindings, scene.culling, f"{_FOLDER}/width.glsl", occlusion)
        self._list = Kernel(device, f"{_FOLDER}/list.comp", {}, bindings)
        self._listed = device.ctx.buffer(reserve=WORD)
        self._parts: dict[View, list[tuple[DrawList, BufferRange, int]]] = {}

    @staticmethod
    def needs(settings: QuadSettings) -> Needs:
        """Stored blades, or instanced, none: it brings its own."""
        return Needs(stored=settings.mode == "basic")

    def _defines(self, purpose: str) -> dict[str, object]:
        scene, settings = self._world.scene, self._settings
        defines: dict[str, object] = {"PATCHES": len(settings.patch), "FADING": FADING}
        defines |= {**distance_defines(scene.culling), **sward_defines(scene)}
        if self._instances:
            defines |= {"INSTANCED": 1, **motion_defines(scene)}
        if scene.culling.frustum:
            defines["FRUSTUM"] = 1
        if settings.lean == "random":
            defines["LEANS_AT_RANDOM"] = 1
        if settings.alpha == "hashed":
            defines["HASHED"] = 1
        return {**defines, "SHADOW": 1} if purpose == "shadow" else defines

    def _slack_m(self) -> float:
        """Reach of a blade from its root: its own offset, and what moves it added to that."""
        settings = self._settings
        heights = [1.5 * float(each.height_m[1]) for each in settings.patch if each.height_m]
        tallest = max(self._world.field.tallest_m, *heights, 0.0)
        if settings.lean == "own":
            return 1.25 * tallest
        return 3.75 * tallest + 2.0 * max(
            settings.bending_m, *(each.bending_m or 0.0 for each in settings.patch), 0.0
        )

    def _uniforms(self) -> dict[str, object]:
        settings = self._settings
        uniforms: dict[str, object] = {
            **{name: getattr(settings, name) for name in ("bending_m", "smoothness", "thinning", "shrinking")},
            "by_size": settings.level == "size",
            "px_per_quad": settings.px_per_quad,
            "own_colours": coloured(self._world.scene),
            "slender": slender(self._world.scene),
        }
        if self._instances:
            variations = QuadSettings.model_fields["variation"].annotation.__args__  # type: ignore[union-attr]
            uniforms |= {
                "patch_m": settings.patch_m,
                "blades_stored": self._instances.stored,
                "variation": variations.index(settings.variation),
                "tallest_m": self._world.field.tallest_m + self._slack_m(),
            }
        return uniforms

    def _patches(self) -> dict[str, object]:
        settings, none = self._settings, (-1.0, -1.0)
        if not settings.patch:
            return {}
        bending = [settings.bending_m if each.bending_m is None else each.bending_m for each in settings.patch]
        return {
            "patch_area_m": [(*each.from_m, *each.to_m) for each in settings.patch],
            "patch_size_m": [(*(each.width_m or none), *(each.height_m or none)) for each in settings.patch],
            "patch_own": [
                (each.density, most, each.smoothness or settings.smoothness)
                for each, most in zip(settings.patch, bending, strict=True)
            ],
        }

    def update(self, frame: FrameTime) -> None:
        """Find the places of the patch, or make room for a list of the blades that some view may show."""
        self._frame = frame
        if self._instances:
            self._instances.place(frame.views)
            return
        self._parts.clear()
        self._used = self._commands = 0
        shown = [each for view in frame.views for each in self._world.visible.of(view)]
        self._listed = at_least(self._device, self._listed, sum(map(_room, shown)))
        self._culling.make_room(len(shown), max((each.blades.count for each in shown), default=0))

    def draw(self, view: View) -> None:
        """Draw every blade that the view shows."""
        self._device.ctx.patch_vertices = 1
        if view.purpose == "picture":
            upload(self._drawn, _NONE_DRAWN)
        if self._instances:
            self._draw_instances(self._instances, view)
        else:
            self._draw_field(view)

    def _draw_instances(self, instances: Instances, view: View) -> None:
        for group in instances.groups.get(view, ()):
            self._draws[view.purpose].run(
                moderngl.PATCHES,
                CHUNK,
                group.count * group.chunks,
                Drawn=self._drawn,
                **instances.bindings,
                time_s=self._frame.time_s,
                previous_time_s=self._frame.previous_time_s,
                previous_from_now=np.eye(4),
                first_blade_number=1,
                first_place=group.first,
                **instances.counted_from(view.anchor_ws),
                chunks_per_patch=group.chunks,
                blades_per_patch=group.blades,
            )

    def _draw_field(self, view: View) -> None:
        if view not in self._parts:
            self._parts[view] = [self._list_blades(shown, view) for shown in self._world.visible.of(view)]
        commands = self._culling.commands
        for shown, listed, command in self._parts[view]:
            page = shown.page
            self._draws[view.purpose].run_indirect(
                moderngl.PATCHES,
                commands,
                command,
                **page.bindings,
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
        return self._instances.identify(numbers) if self._instances else self._world.field.identify(numbers)

    def considered(self, view: View) -> int:
        """Count the blades of this view that were handed to its tests in the last frame."""
        if self._instances:
            return sum(group.count * group.blades for group in self._instances.groups.get(view, ()))
        return self._world.visible.considered(view)

    def drawn(self, view: View) -> int:  # noqa: ARG002
        """Count the blades of the picture that were cut into at least one quad in the last frame."""
        return int(np.frombuffer(read_back(self._device, self._drawn), np.uint32).sum())

    def release(self) -> None:
        """Free programs, blocks, textures and buffers."""
        if self._instances:
            self._instances.release()
        release_all(*self._draws.values(), self._culling, self._list, self._block, self._pictures)
        release_all(self._drawn, self._listed)


def _room(shown: DrawList) -> int:
    """Bytes for a list of all its blades, as long as bindings must be aligned."""
    return -(-shown.blades.items // 64) * 64 * WORD
