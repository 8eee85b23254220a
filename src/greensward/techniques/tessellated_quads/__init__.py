"""Quads bent along two splines by the tessellation stages, outlined by textures."""

from typing import ClassVar

import moderngl
import numpy as np
from pydantic import BaseModel

from greensward.culling import CHUNK, Sieve, at_least, distance_defines
from greensward.gpu.blocks import BlockBuffer
from greensward.gpu.buffers import rewrite
from greensward.gpu.program import build, build_compute, put
from greensward.gpu.view import View
from greensward.motion import motion_defines
from greensward.scene import InputError
from greensward.techniques.leaf import LEAF_BLOCK
from greensward.techniques.tessellated_quads.instances import FADING, Instances
from greensward.techniques.tessellated_quads.pictures import coloured, picture_array, slender
from greensward.techniques.tessellated_quads.settings import Settings
from greensward.world import CHUNKS, Instant, Seen, World

_FOLDER = "techniques/tessellated_quads"
_LISTED, _DRAWN = 5, 7
_PICTURES_UNIT = 22
_DRAWN_PARTS = 1024
_NONE_DRAWN = np.zeros(_DRAWN_PARTS, np.uint32)
_STILL = tuple(np.eye(4).ravel())
_STAGES = [f"{_FOLDER}/blade.{stage}" for stage in ("vert", "tesc", "tese", "frag")]


class TessellatedQuads:
    """A blade is a patch of one vertex: outlined in the vertex stage, culled and cut in the next, then bent."""

    name: ClassVar[str] = "tessellated-quads"
    source: ClassVar[str] = "Jahrmann & Wimmer 2013, Interactive Grass Rendering Using Real-Time Tessellation"
    Settings: ClassVar[type[BaseModel]] = Settings
    last: ClassVar[bool] = False
    draws_unstored: ClassVar[bool] = False

    def __init__(self, ctx: moderngl.Context, world: World, settings: BaseModel) -> None:
        assert isinstance(settings, Settings)
        self._ctx, self._world, self._settings = ctx, world, settings
        scene = world.scene
        self._instances = None
        if not self.draws_field(settings):
            if scene.growth:
                raise InputError('technique.mode: must be "basic" with [growth], as instanced blades are full-grown')
            self._instances = Instances(ctx, world, settings)
        self._block = BlockBuffer(ctx, LEAF_BLOCK)
        self._block.set(**settings.block_values(), slack_m=self._slack_m())
        self._pictures = picture_array(ctx, scene)
        self._drawn = ctx.buffer(_NONE_DRAWN)
        self._arrays = {}
        for purpose in ("picture", "shadow"):
            program = build(ctx, *_STAGES, defines=self._defines(purpose))
            put(program, **self._uniforms())
            self._put_patches(program)
            self._arrays[purpose] = ctx.vertex_array(program, [])
        self._sieve = Sieve(ctx, scene.culling, f"{_FOLDER}/width.glsl", hiding=world.pyramid is not None)
        self._list = build_compute(ctx, f"{_FOLDER}/list.comp")
        self._listed = ctx.buffer(reserve=4)
        self._parts: dict[View, list[tuple[Seen, int, int]]] = {}

    @staticmethod
    def draws_field(settings: BaseModel) -> bool:
        """Whether it draws the blades that the world sows; instanced, it brings its own."""
        assert isinstance(settings, Settings)
        return settings.mode == "basic"

    def _defines(self, purpose: str) -> dict[str, object]:
        scene, settings = self._world.scene, self._settings
        defines: dict[str, object] = {"PATCHES": len(settings.patch), "FADING": FADING}
        defines |= distance_defines(scene.culling)
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
        """How far from its root a blade may reach: its own offset, and what moves it added to that."""
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
            "bySize": settings.level == "size",
            "pxPerQuad": settings.px_per_quad,
            "ownColours": coloured(self._world.scene),
            "slender": slender(self._world.scene),
        }
        if self._instances:
            variations = Settings.model_fields["variation"].annotation.__args__  # type: ignore[union-attr]
            uniforms |= {
                "patch_m": settings.patch_m,
                "bladesStored": self._instances.stored,
                "variation": variations.index(settings.variation),
                "tallest_m": self._world.field.tallest_m + self._slack_m(),
            }
        return uniforms

    def _put_patches(self, program: moderngl.Program) -> None:
        settings, none = self._settings, (-1.0, -1.0)
        bending = [settings.bending_m if each.bending_m is None else each.bending_m for each in settings.patch]
        rows = {
            "patchArea_m": [(*each.from_m, *each.to_m) for each in settings.patch],
            "patchSize_m": [(*(each.width_m or none), *(each.height_m or none)) for each in settings.patch],
            "patchOwn": [
                (each.density, most, each.smoothness or settings.smoothness)
                for each, most in zip(settings.patch, bending, strict=True)
            ],
        }
        for name, values in rows.items():
            if name in program:
                program[name].write(np.array(values, np.float32))  # type: ignore[union-attr]

    def update(self, instant: Instant) -> None:
        """Find the places of the patch, or make room for a list of the blades that some view may show."""
        self._instant = instant
        if self._instances:
            self._instances.place(instant.views)
            return
        self._parts.clear()
        self._used = self._commands = 0
        seen = [seen for view in instant.views for seen in self._world.seen(view)]
        self._listed = at_least(self._ctx, self._listed, sum(map(_room, seen)))
        self._sieve.make_room(len(seen), max((each.blades.count for each in seen), default=0))

    def draw(self, view: View) -> None:
        """Draw every blade that the view shows."""
        self._block.bind()
        self._pictures.use(_PICTURES_UNIT)
        self._ctx.patch_vertices = 1
        if view.purpose == "picture":
            rewrite(self._drawn, _NONE_DRAWN)
            self._drawn.bind_to_storage_buffer(_DRAWN)
        if self._instances:
            self._draw_instances(self._instances, view)
        else:
            self._draw_field(view)

    def _draw_instances(self, instances: Instances, view: View) -> None:
        array = self._arrays[view.purpose]
        instances.bind()
        instant = self._instant
        put(array.program, timeNow=instant.time_s, timePrevious=instant.previous_time_s, previousFromNow=_STILL)
        for group in instances.groups.get(view, ()):
            put(
                array.program,
                firstId=1,
                firstPlace=group.first,
                chunksPerPatch=group.chunks,
                bladesPerPatch=group.blades,
            )
            array.render(moderngl.PATCHES, vertices=CHUNK, instances=group.count * group.chunks)

    def _draw_field(self, view: View) -> None:
        if view not in self._parts:
            self._parts[view] = [self._list_blades(seen, view) for seen in self._world.seen(view)]
        array = self._arrays[view.purpose]
        for seen, offset, command in self._parts[view]:
            page = seen.page
            page.bind()
            self._listed.bind_to_storage_buffer(_LISTED, offset=offset, size=_room(seen))
            put(
                array.program,
                command=command,
                onGround=page.thing is None,
                firstId=page.first_id,
                previousFromNow=tuple(view.relative(page.previous_from_now).T.ravel()),
            )
            self._sieve.draw(array, command)

    def _list_blades(self, seen: Seen, view: View) -> tuple[Seen, int, int]:
        """Test the blades of a page; where the list of those kept begins, in bytes, and the command that draws it."""
        part = seen, self._used, self._commands
        self._used += _room(seen)
        self._commands += 1
        self._sieve.sift(seen.page, seen.blades, self._world.chunks, view, part[2])
        self._world.chunks.bind(CHUNKS)
        self._listed.bind_to_storage_buffer(_LISTED, offset=part[1], size=_room(seen))
        put(self._list, firstChunk=seen.blades.first, chunkCount=seen.blades.count)
        self._list.run(*seen.blades.groups)
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)
        return part

    def considered(self, view: View) -> int:
        """Blades of this view that were handed to its tests in the last frame."""
        if self._instances:
            return sum(group.count * group.blades for group in self._instances.groups.get(view, ()))
        return self._world.considered(view)

    def drawn(self, view: View) -> int:  # noqa: ARG002
        """Blades of the picture that were cut into at least one quad in the last frame."""
        self._ctx.memory_barrier(moderngl.BUFFER_UPDATE_BARRIER_BIT)
        return int(np.frombuffer(self._drawn.read(), np.uint32).sum())

    def release(self) -> None:
        """Free programs, blocks, textures and buffers."""
        if self._instances:
            self._instances.release()
        self._sieve.release()
        self._list.release()
        for array in self._arrays.values():
            array.program.release()
            array.release()
        for part in (self._block, self._pictures):
            part.release()
        for buffer in (self._drawn, self._listed):
            buffer.release()


def _room(seen: Seen) -> int:
    """Bytes for a list of all its blades, as long as bindings must be aligned."""
    return -(-seen.blades.items // 64) * 256
