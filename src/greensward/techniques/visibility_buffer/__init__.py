"""Blades rasterised by compute shaders into a visibility buffer: which blade is nearest at each pixel, then its surface."""

from collections.abc import Sequence
from typing import ClassVar

import moderngl
import numpy as np
from pydantic import BaseModel, Field

from greensward.culling import at_least, test_defines, width_from
from greensward.gpu.blocks import BlockBuffer
from greensward.gpu.context import is_software
from greensward.gpu.program import build, build_compute, put
from greensward.gpu.view import View
from greensward.scene.base import Count
from greensward.techniques.leaf import LEAF_BLOCK, LeafSettings
from greensward.world import BLADES, POSTURES, Instant, Seen, World

_FOLDER = "techniques/visibility_buffer"
CELLS, NAMES, LISTS, LARGE, WON, DRAWN = range(5, 11)
"""Shader-storage bindings while blades are drawn."""
_DRAWN_PARTS = 1024
_LISTS_BYTES = 40  # of lists.glsl
_LARGE_GROUPS, _WON_GROUPS = 16, 28  # and where in it


_WIDE = ("GL_NV_gpu_shader5", "GL_NV_shader_atomic_int64")


def has_wide_atomics(ctx: moderngl.Context) -> bool:
    """Whether shaders can take the larger of two 64-bit numbers in one step."""
    return set(_WIDE) <= ctx.extensions


class Settings(LeafSettings):
    """How finely blades are cut, and how thin they may become."""

    max_level: Count = Field(12, ge=1, le=32)
    """Never more segments than this."""


class VisibilityBuffer:
    """Every blade is a strip of quads that one invocation fills pixel by pixel; a pass over the picture does the rest."""

    name: ClassVar[str] = "visibility-buffer"
    source: ClassVar[str] = (
        "Burns & Hunt 2013, The Visibility Buffer; Karis et al. 2021, A Deep Dive into Nanite Virtualized Geometry"
    )
    Settings: ClassVar[type[BaseModel]] = Settings
    last: ClassVar[bool] = True

    def __init__(self, ctx: moderngl.Context, world: World, settings: BaseModel) -> None:
        assert isinstance(settings, Settings)
        self._ctx, self._world = ctx, world
        self._software = is_software(ctx)
        self._wide = has_wide_atomics(ctx)
        self._block = BlockBuffer(ctx, LEAF_BLOCK)
        self._block.set(**settings.block_values())
        tests, hiding = world.scene.culling, world.pyramid is not None
        fold = {"FOLD": 1} if any(grass.shape == "quadratic-3d" for grass in world.scene.grass) else {}
        self._clear, self._raster, self._large = {}, {}, {}
        for purpose in ("picture", "shadow"):
            defines = {**test_defines(tests, purpose, hiding), **fold}
            wide = _WIDE if self._wide and purpose == "picture" else ()
            if wide:
                defines["WIDE"] = 1
            for name, shaders in (("clear", self._clear), ("raster", self._raster), ("large", self._large)):
                shaders[purpose] = build_compute(
                    ctx, f"{_FOLDER}/{name}.comp", defines, width_from("techniques/leaf.glsl"), wide
                )
            if purpose == "picture":
                self._build_resolve(defines, wide)
        shadow = build(ctx, "shaders/screen.vert", f"{_FOLDER}/shadow.frag", defines={"SHADOW": 1})
        self._shadow = ctx.vertex_array(shadow, [])
        self._plan = build_compute(ctx, f"{_FOLDER}/plan.comp")
        self._cells, self._names, self._large_list, self._won = (ctx.buffer(reserve=20) for _ in range(4))
        self._lists, self._drawn = ctx.buffer(bytes(_LISTS_BYTES)), ctx.buffer(reserve=4 * _DRAWN_PARTS)

    def _build_resolve(self, defines: dict[str, object], wide: Sequence[str]) -> None:
        if self._software:
            program = build(self._ctx, "shaders/screen.vert", f"{_FOLDER}/resolve.frag", defines=defines)
            self._resolve: moderngl.ComputeShader | moderngl.Program = program
            self._triangle = self._ctx.vertex_array(program, [])
        else:
            self._resolve = build_compute(self._ctx, f"{_FOLDER}/resolve.comp", defines, extensions=wide)

    def update(self, instant: Instant) -> None:
        """Make room for the cells of the largest view and for the lists of the longest run of chunks."""
        pixels = max(view.size_px[0] * view.size_px[1] for view in instant.views)
        self._cells = at_least(self._ctx, self._cells, pixels * (8 if self._wide else 4))
        if not self._wide:
            self._names = at_least(self._ctx, self._names, pixels * 4)
        blades = max((seen.blades.items for view in instant.views for seen in self._world.seen(view)), default=0)
        self._large_list = at_least(self._ctx, self._large_list, blades * 4)
        if not self._wide:
            self._won = at_least(self._ctx, self._won, blades * 4)

    def draw(self, view: View) -> None:
        """Fill the cells with every blade that the view shows, then turn them into surfaces or a shadow map's depth."""
        seen = self._world.seen(view)
        if not seen:
            return
        self._block.bind()
        buffers = (self._cells, self._names, self._lists, self._large_list, self._won, self._drawn)
        for binding, buffer in zip((CELLS, NAMES, LISTS, LARGE, WON, DRAWN), buffers, strict=True):
            buffer.bind_to_storage_buffer(binding)
        self._empty(view)
        for each in seen:
            self._bind(each)
            self._fill(each, view)
        if view.purpose == "shadow":
            self._ctx.enable_only(moderngl.DEPTH_TEST)
            self._shadow.render(moderngl.TRIANGLES, vertices=3)
        else:
            for each in seen:
                self._bind(each)
                self._show(each, view)
        # what comes next may empty the cells before all of them have been looked up
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def _empty(self, view: View) -> None:
        shader = self._clear[view.purpose]
        width, height = view.size_px
        if view.purpose == "picture":
            shader["farthest_m"] = view.near_and_far_m[1]
        shader.run(-(-width // 8), -(-height // 8))
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def _bind(self, seen: Seen) -> None:
        seen.page.blades.bind_to_storage_buffer(BLADES)
        seen.page.postures.bind_to_storage_buffer(POSTURES)

    def _fill(self, seen: Seen, view: View) -> None:
        raster, large = self._raster[view.purpose], self._large[view.purpose]
        values = {
            "firstChunk": seen.blades.first,
            "chunkCount": seen.blades.count,
            "large_px": 1000.0,
            "firstName": 32 * seen.page.first_id,
            "near_m": view.near_and_far_m[0],
        }
        for shader in (raster, large):
            put(shader, **values, naming=False)
        self._plan["rows"] = view.size_px[1]
        raster.run(*seen.blades.groups)
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)
        self._plan.run()
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT | moderngl.COMMAND_BARRIER_BIT)
        large.run_indirect(self._lists, _LARGE_GROUPS)
        if view.purpose == "picture" and not self._wide:
            self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)
            raster["naming"] = large["naming"] = True
            raster.run_indirect(self._lists, _WON_GROUPS)
            large.run_indirect(self._lists, _LARGE_GROUPS)
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def _show(self, seen: Seen, view: View) -> None:
        page = seen.page
        put(
            self._resolve,
            firstName=32 * page.first_id,
            bladeCount=page.count,
            onGround=page.thing is None,
            previousFromNow=tuple(page.previous_from_now.T.ravel()),
        )
        if isinstance(self._resolve, moderngl.ComputeShader):
            self._resolve.run(*(-(-edge // 8) for edge in view.size_px))
            self._ctx.memory_barrier(
                moderngl.SHADER_IMAGE_ACCESS_BARRIER_BIT
                | moderngl.TEXTURE_FETCH_BARRIER_BIT
                | moderngl.FRAMEBUFFER_BARRIER_BIT
                | moderngl.TEXTURE_UPDATE_BARRIER_BIT
            )
        else:
            self._ctx.enable_only(moderngl.NOTHING)
            self._triangle.render(moderngl.TRIANGLES, vertices=3)

    def drawn(self, view: View) -> int:  # noqa: ARG002
        """Blades that were drawn of the picture in the last frame."""
        self._ctx.memory_barrier(moderngl.BUFFER_UPDATE_BARRIER_BIT)
        return int(np.frombuffer(self._drawn.read(), np.uint32).sum())

    def release(self) -> None:
        """Free programs, blocks and buffers."""
        for shader in (*self._clear.values(), *self._raster.values(), *self._large.values(), self._plan, self._resolve):
            shader.release()
        if self._software:
            self._triangle.release()
        self._shadow.program.release()
        self._shadow.release()
        for part in (self._block, self._cells, self._names, self._lists, self._large_list, self._won, self._drawn):
            part.release()

