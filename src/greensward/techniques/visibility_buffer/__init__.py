"""Blades rasterised by compute shaders: first which of them is nearest at each pixel, then the surface it shows."""

import math
from collections.abc import Sequence
from typing import ClassVar

import moderngl
import numpy as np
from pydantic import BaseModel, Field

from greensward.culling import Pyramid, Span, at_least, test_defines, width_from
from greensward.gpu.blocks import BlockBuffer
from greensward.gpu.pixel_pass import IMAGES_WRITTEN, Shell, pixel_groups
from greensward.gpu.program import build, build_compute, put
from greensward.gpu.view import View
from greensward.motion import motion_defines
from greensward.scene import InputError
from greensward.scene.base import Count
from greensward.sowing import Page, UnstoredPage
from greensward.techniques.leaf import LEAF_BLOCK, LeafSettings
from greensward.world import Instant, Seen, World

_FOLDER = "techniques/visibility_buffer"
CELLS, NAMES, LISTS, LARGE, WON, DRAWN, SQUARES = range(5, 12)
"""Shader-storage bindings while blades are drawn."""
LARGE_PX = 4000.0
"""Pixels of a blade above which a column of workgroups draws it instead of one invocation."""
_NEAREST_PART = 0.15
"""Of the blades in view, those that are filled before the others are tested against them."""
_DRAWN_PARTS = 1024
_SQUARE = 4  # of squares.glsl
_NO_SQUARES = np.array([4, 0, 0, 0, 0], np.uint32)
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


class _Shaders:
    """Those that look blades up, for one purpose; with `behind`, also behind what the cells already show."""

    def __init__(
        self,
        ctx: moderngl.Context,
        purpose: str,
        defines: dict[str, object],
        extensions: Sequence[str],
        shell: Shell,
        behind: bool,
    ) -> None:
        width = width_from("techniques/leaf.glsl")
        self.raster = build_compute(ctx, f"{_FOLDER}/raster.comp", defines, width, extensions)
        self.raster_behind = self.raster
        if behind:
            hidden = {**defines, "OCCLUSION": 1}
            self.raster_behind = build_compute(ctx, f"{_FOLDER}/raster.comp", hidden, width, extensions)
        self.large = build_compute(ctx, f"{_FOLDER}/large.comp", defines, width, extensions)
        self.resolve: moderngl.ComputeShader | moderngl.Program | None = None
        self.find_squares: moderngl.ComputeShader | None = None
        self.squares: moderngl.VertexArray | None = None
        if purpose == "shadow":
            return
        if shell == "compute":
            self.resolve = build_compute(ctx, f"{_FOLDER}/resolve.comp", defines, extensions=extensions)
        else:
            stages = f"{_FOLDER}/resolve.vert", f"{_FOLDER}/resolve.frag"
            self.resolve = build(ctx, *stages, defines=defines, extensions=extensions)
            self.find_squares = build_compute(ctx, f"{_FOLDER}/squares.comp", defines, extensions=extensions)
            self.squares = ctx.vertex_array(self.resolve, [])

    def release(self) -> None:
        if self.raster_behind is not self.raster:
            self.raster_behind.release()
        for part in (self.raster, self.large, self.find_squares, self.squares, self.resolve):
            if part:
                part.release()


class VisibilityBuffer:
    """Every blade is a strip of quads that one invocation fills; a pass over the picture makes surfaces of them."""

    name: ClassVar[str] = "visibility-buffer"
    source: ClassVar[str] = (
        "Burns & Hunt 2013, The Visibility Buffer; Karis et al. 2021, A Deep Dive into Nanite Virtualized Geometry"
    )
    Settings: ClassVar[type[BaseModel]] = Settings
    last: ClassVar[bool] = True
    draws_unstored: ClassVar[bool] = True

    def __init__(self, ctx: moderngl.Context, world: World, settings: BaseModel) -> None:
        assert isinstance(settings, Settings)
        self._ctx, self._world = ctx, world
        self._wide = has_wide_atomics(ctx)
        self._block = BlockBuffer(ctx, LEAF_BLOCK)
        self._block.set(**settings.block_values())
        tests, hiding = world.scene.culling, world.pyramid is not None
        fold = {"FOLD": 1} if any(grass.shape == "quadratic-3d" for grass in world.scene.grass) else {}
        unstored = {"UNSTORED": 1, **motion_defines(world.scene)}
        wide = _WIDE if self._wide else ()
        self._nearer: Pyramid | None = None
        self._clear: dict[str, moderngl.ComputeShader] = {}
        self._shaders: dict[tuple[str, bool], _Shaders] = {}
        for purpose in ("picture", "shadow"):
            defines = {**test_defines(tests, purpose, hiding), **fold}
            if wide and purpose == "picture":
                defines["WIDE"] = 1
            extensions = wide if purpose == "picture" else ()
            self._clear[purpose] = build_compute(ctx, f"{_FOLDER}/clear.comp", defines, extensions=extensions)
            for stored in (True,) if world.scene.sowing.stored_m is None else (True, False):
                self._shaders[purpose, stored] = _Shaders(
                    ctx,
                    purpose,
                    {**defines, **({} if stored else unstored)},
                    extensions,
                    world.shell,
                    tests.behind_grass and purpose == "picture",
                )
            if tests.behind_grass and purpose == "picture":
                self._nearer = Pyramid(ctx, f"{_FOLDER}/nearness.glsl", defines, extensions)
        shadow = build(ctx, "shaders/screen.vert", f"{_FOLDER}/shadow.frag", defines={"SHADOW": 1})
        self._shadow = ctx.vertex_array(shadow, [])
        self._plan = build_compute(ctx, f"{_FOLDER}/plan.comp")
        self._cells, self._names, self._large_list, self._won, self._squares = (
            ctx.buffer(reserve=20) for _ in range(5)
        )
        self._lists, self._drawn = ctx.buffer(bytes(_LISTS_BYTES)), ctx.buffer(reserve=4 * _DRAWN_PARTS)

    @staticmethod
    def draws_field(settings: BaseModel) -> bool:  # noqa: ARG004
        """Always."""
        return True

    def update(self, instant: Instant) -> None:
        """Make room for the cells of the largest view and for the lists of the longest run of chunks.

        Raises `InputError` for a view of more pixels than the driver can hold cells for.
        """
        self._instant = instant
        pixels = max(view.size_px[0] * view.size_px[1] for view in instant.views)
        self._refuse_too_large(instant.views)
        self._cells = at_least(self._ctx, self._cells, pixels * (8 if self._wide else 4))
        if not self._wide:
            self._names = at_least(self._ctx, self._names, pixels * 4)
        if self._world.shell == "fragment":
            self._squares = at_least(self._ctx, self._squares, 20 + max(map(_squares_in, instant.views)) * 4)
        blades = max((seen.blades.items for view in instant.views for seen in self._world.seen(view)), default=0)
        self._large_list = at_least(self._ctx, self._large_list, blades * 4)
        if not self._wide:
            self._won = at_least(self._ctx, self._won, blades * 4)

    def _refuse_too_large(self, views: Sequence[View]) -> None:
        limit = self._ctx.info["GL_MAX_SHADER_STORAGE_BLOCK_SIZE"]
        for view in views:
            width, height = view.size_px
            most = limit // (8 if self._wide and view.purpose == "picture" else 4)
            if width * height <= most:
                continue
            where, rule = "size", f"must have at most {most / 1e6:,.0f} million pixels"
            if view.purpose == "shadow":
                where, rule = "shadows.size_px", f"must be at most {math.isqrt(most)}"
            raise InputError(
                f"{where}: {rule} for {self.name} on this driver (got {width}x{height}); "
                "take less, or draw with --technique bezier-blades"
            )

    def draw(self, view: View) -> None:
        """Fill the cells with every blade that the view shows, then turn them into surfaces or into depth."""
        seen = self._world.seen(view)
        if not seen:
            return
        self._block.bind()
        bindings = CELLS, NAMES, LISTS, LARGE, WON, DRAWN, SQUARES
        for binding, buffer in zip(bindings, self._buffers(), strict=True):
            buffer.bind_to_storage_buffer(binding)
        self._empty(view)
        if self._nearer and view.purpose == "picture":
            self._fill_behind(self._nearer, seen, view)
        else:
            for each in seen:
                self._fill(each.page, each.blades, view)
        if view.purpose == "shadow":
            self._ctx.enable_only(moderngl.DEPTH_TEST)
            self._shadow.render(moderngl.TRIANGLES, vertices=3)
        else:
            for each in seen:
                each.page.bind()
                self._show(each, view)
        # what comes next may empty the cells before all of them have been looked up
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def _empty(self, view: View) -> None:
        shader = self._clear[view.purpose]
        if view.purpose == "picture":
            shader["farthest_m"] = view.near_and_far_m[1]
        shader.run(*pixel_groups(view.size_px))
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def _fill_behind(self, pyramid: Pyramid, seen: Sequence[Seen], view: View) -> None:
        """First the nearest, which hide the most, then of the others what is not hidden by them."""
        parts = [(each.page, each.blades.split(_NEAREST_PART)) for each in seen]
        for page, (near, _) in parts:
            self._fill(page, near, view)
        pyramid.build(view.size_px)
        for page, (_, far) in parts:
            self._fill(page, far, view, behind=True)

    def _fill(self, page: Page | UnstoredPage, blades: Span, view: View, behind: bool = False) -> None:
        if not blades.count:
            return
        page.bind()
        shaders = self._shaders[view.purpose, isinstance(page, Page)]
        raster, large = shaders.raster_behind if behind else shaders.raster, shaders.large
        values = {
            **self._growing(),
            "firstChunk": blades.first,
            "chunkCount": blades.count,
            "large_px": LARGE_PX,
            "firstName": 32 * page.first_id,
            "near_m": view.near_and_far_m[0],
        }
        for shader in (raster, large):
            put(shader, **values, naming=False)
        self._plan["rows"] = view.size_px[1]
        raster.run(*blades.groups)
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
        shaders = self._shaders[view.purpose, isinstance(page, Page)]
        assert shaders.resolve
        put(
            shaders.resolve,
            **self._growing(),
            firstName=32 * page.first_id,
            bladeCount=page.count,
            onGround=page.thing is None,
            previousFromNow=tuple(view.relative(page.previous_from_now).T.ravel()),
        )
        if isinstance(shaders.resolve, moderngl.ComputeShader):
            shaders.resolve.run(*pixel_groups(view.size_px))
            self._ctx.memory_barrier(IMAGES_WRITTEN)
        else:
            assert shaders.squares
            assert shaders.find_squares
            self._squares.write(_NO_SQUARES)
            put(shaders.find_squares, firstName=32 * page.first_id, bladeCount=page.count)
            shaders.find_squares.run(*(-(-edge // (8 * _SQUARE)) for edge in view.size_px))
            self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT | moderngl.COMMAND_BARRIER_BIT)
            self._ctx.enable_only(moderngl.NOTHING)
            shaders.squares.render_indirect(self._squares, moderngl.TRIANGLE_STRIP, 1)

    def _growing(self) -> dict[str, float]:
        """What the shaders of blades that are not stored need to know."""
        instant = self._instant
        return {
            "timeNow": instant.time_s,
            "timePrevious": instant.previous_time_s,
            "tallest_m": self._world.field.tallest_m,
        }

    def considered(self, view: View) -> int:
        """Blades of this view that were handed to its tests in the last frame."""
        return self._world.considered(view)

    def drawn(self, view: View) -> int:
        """Blades that were drawn of the picture in the last frame."""
        if not self._world.seen(view):
            return 0
        self._ctx.memory_barrier(moderngl.BUFFER_UPDATE_BARRIER_BIT)
        return int(np.frombuffer(self._drawn.read(), np.uint32).sum())

    def release(self) -> None:
        """Free programs, blocks and buffers."""
        for shaders in self._shaders.values():
            shaders.release()
        for shader in self._clear.values():
            shader.release()
        self._shadow.program.release()
        if self._nearer:
            self._nearer.release()
        for buffer in self._buffers():
            buffer.release()
        for part in (self._plan, self._shadow, self._block):
            part.release()

    def _buffers(self) -> tuple[moderngl.Buffer, ...]:
        lists = self._lists, self._large_list, self._won
        return self._cells, self._names, *lists, self._drawn, self._squares


def _squares_in(view: View) -> int:
    """Squares of squares.glsl that cover a view."""
    width, height = (-(-edge // _SQUARE) for edge in view.size_px)
    return width * height
