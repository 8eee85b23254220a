"""Quadratic Bézier blades as tessellated quads."""

from dataclasses import dataclass
from typing import ClassVar

import moderngl
from pydantic import BaseModel

from greensward.culling import CHUNK, Sieve, at_least, distance_defines
from greensward.gpu.blocks import BlockBuffer
from greensward.gpu.program import build, build_compute
from greensward.gpu.view import View
from greensward.techniques.leaf import LEAF_BLOCK, LeafSettings
from greensward.world import RECORDS, Instant, Seen, World

_FOLDER = "techniques/bezier_blades"
_RECORD_BYTES = 72


class Settings(LeafSettings):
    """How finely blades are cut, and how thin they may become."""


@dataclass(frozen=True)
class _Part:
    """Records of what a view shows of a page: where they begin, in bytes, and which command draws them."""

    seen: Seen
    offset: int
    command: int


def _room(seen: Seen) -> int:
    """Bytes for records of all its blades, in whole instances, which is aligned as bindings must be."""
    return -(-seen.blades.items // CHUNK) * CHUNK * _RECORD_BYTES


class BezierBlades:
    """One patch per blade: culled, levelled and widened in a compute stage, curved in the evaluation stage."""

    name: ClassVar[str] = "bezier-blades"
    source: ClassVar[str] = (
        "Jahrmann & Wimmer 2017, Responsive Real-Time Grass Rendering for General 3D Scenes; "
        "Yan, Wu & Wang 2024, Enhanced Real-Time Grass Rendering"
    )
    Settings: ClassVar[type[BaseModel]] = Settings
    last: ClassVar[bool] = False
    draws_unstored: ClassVar[bool] = False

    def __init__(self, ctx: moderngl.Context, world: World, settings: BaseModel) -> None:
        assert isinstance(settings, Settings)
        self._ctx, self._world = ctx, world
        self._block = BlockBuffer(ctx, LEAF_BLOCK)
        self._block.set(**settings.block_values())
        tests = world.scene.culling
        self._sieve = Sieve(ctx, tests, "techniques/leaf.glsl", hiding=world.pyramid is not None)
        stages = [f"{_FOLDER}/blade.{stage}" for stage in ("vert", "tesc", "tese", "frag")]
        self._prepare, self._arrays = {}, {}
        for purpose, defines in (("picture", {}), ("shadow", {"SHADOW": 1})):
            self._prepare[purpose] = build_compute(
                ctx, f"{_FOLDER}/prepare.comp", {**distance_defines(tests), **defines}
            )
            self._arrays[purpose] = ctx.vertex_array(build(ctx, *stages, defines=defines), [])
        self._records = ctx.buffer(reserve=_RECORD_BYTES)
        self._prepared: dict[View, list[_Part]] = {}

    @staticmethod
    def draws_field(settings: BaseModel) -> bool:  # noqa: ARG004
        """Always."""
        return True

    def update(self, instant: Instant) -> None:
        """Make room for a record of every blade that some view may show; `draw` fills it once per view."""
        self._prepared.clear()
        self._used = self._commands = 0
        seen = [seen for view in instant.views for seen in self._world.seen(view)]
        self._records = at_least(self._ctx, self._records, sum(map(_room, seen)))
        self._sieve.make_room(len(seen), max((each.blades.count for each in seen), default=0))

    def draw(self, view: View) -> None:
        """Draw every blade that the view shows."""
        self._block.bind()
        if view not in self._prepared:
            self._prepared[view] = [self._fill(seen, view) for seen in self._world.seen(view)]
        self._ctx.patch_vertices = 1
        array = self._arrays[view.purpose]
        program = array.program
        for part in self._prepared[view]:
            self._bind_records(part)
            program["command"] = part.command
            if view.purpose == "picture":
                page = part.seen.page
                program["firstId"] = page.first_id
                program["previousFromNow"] = tuple(view.relative(page.previous_from_now).T.ravel())
            self._sieve.draw(array, part.command)

    def _fill(self, seen: Seen, view: View) -> "_Part":
        """Decide about every blade in compute shaders, which run on all cores; the stages only look up."""
        part = _Part(seen, self._used, self._commands)
        self._used += _room(seen)
        self._commands += 1
        self._sieve.sift(seen.page, seen.blades, self._world.chunks, view, part.command)
        self._bind_records(part)
        shader = self._prepare[view.purpose]
        shader["firstChunk"] = seen.blades.first
        shader["chunkCount"] = seen.blades.count
        if view.purpose == "picture":
            shader["onGround"] = seen.page.thing is None
        shader.run(*seen.blades.groups)
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)
        return part

    def _bind_records(self, part: "_Part") -> None:
        self._records.bind_to_storage_buffer(RECORDS, offset=part.offset, size=_room(part.seen))

    def considered(self, view: View) -> int:
        """Blades of this view that were handed to its tests in the last frame."""
        return self._world.considered(view)

    def drawn(self, view: View) -> int:
        """Blades that were drawn of this view in the last frame."""
        parts = self._prepared.get(view, ())
        kept = self._sieve.kept() if parts else ()
        return sum(int(kept[part.command]) for part in parts)

    def release(self) -> None:
        """Free programs, blocks and records."""
        self._block.release()
        self._records.release()
        self._sieve.release()
        for shader in self._prepare.values():
            shader.release()
        for array in self._arrays.values():
            array.program.release()
            array.release()
