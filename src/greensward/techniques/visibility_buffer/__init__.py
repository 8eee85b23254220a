"""Visibility buffer: blades rasterised by compute shaders, first which is nearest at each pixel, then its surface."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import moderngl
import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, Field

from greensward.culling import (
    DRAW_COMMAND,
    ChunkRange,
    DepthPyramid,
    DrawList,
    test_defines,
    width_from,
)
from greensward.gpu.buffers import at_least, read_back, release_all, upload, zeros
from greensward.gpu.device import COMMANDS_WRITTEN, IMAGES_WRITTEN, STORAGE_WRITTEN, Device, Stage
from greensward.gpu.kernels import Bindings, Draw, Kernel
from greensward.gpu.layouts import WORD, BlockBuffer, struct
from greensward.gpu.view import View
from greensward.motion import motion_defines
from greensward.scene import InputError, Scene
from greensward.scene.base import Count
from greensward.sowing import Page, UnstoredPage, sward_defines
from greensward.sowing.identity import Ids
from greensward.techniques.blades.leaf import LEAF_BLOCK, LeafSettings
from greensward.techniques.technique import Needs
from greensward.world import FrameTime, World

_FOLDER = "techniques/visibility_buffer"
LARGE_PX = 4000.0
"""Pixels of a blade above which a column of workgroups draws it instead of one invocation."""
_NEAREST_PART = 0.15
"""Part of the blades in view that is filled before the others are tested against them."""
_SQUARE = 4  # of squares.glsl
_NO_SQUARES = np.array((4, 0, 0, 0, 0), DRAW_COMMAND.dtype)
_LISTS = struct(
    "DeferredLists",
    ("gathered", "uint", 2),  # blades in the lists that are being written
    ("listed", "uint", 2),  # and in those that are read
    ("large_groups", "uint", 3),
    ("won_groups", "uint", 3),
    ("drawn", "uint", 1024),  # blades that are drawn, summed in parts
)
_WIDE = ("GL_NV_gpu_shader5", "GL_NV_shader_atomic_int64")


class VisibilitySettings(LeafSettings):
    """Fineness, thinness and roundness of blades."""

    max_level: Count = Field(default=12, ge=1, le=32)
    """Never more segments than this."""


@dataclass(frozen=True)
class _Kernels:
    """Kernels that look blades up, for one purpose; with `behind`, also behind what is already visible."""

    raster: Kernel
    raster_behind: Kernel
    large: Kernel
    resolve: Kernel | Draw | None
    find_squares: Kernel | None

    @classmethod
    def build(
        cls,
        device: Device,
        bindings: Bindings,
        purpose: str,
        defines: dict[str, object],
        generated: dict[str, str],
        stage: Stage,
        behind: bool,
    ) -> "_Kernels":
        """Build them; those of a shadow map need no surfaces."""
        extensions = _WIDE if "WIDE" in defines else ()
        options: dict[str, Any] = {"generated": generated, "extensions": extensions}

        def kernel(name: str, **more: object) -> Kernel:
            return Kernel(device, f"{_FOLDER}/{name}.comp", {**defines, **more}, bindings, **options)

        raster, large = kernel("raster"), kernel("large")
        raster_behind = kernel("raster", OCCLUSION=1) if behind else raster
        if purpose == "shadow":
            return cls(raster, raster_behind, large, None, None)
        if stage == "compute":
            return cls(raster, raster_behind, large, kernel("resolve"), None)
        stages = f"{_FOLDER}/resolve.vert", f"{_FOLDER}/resolve.frag"
        resolve = Draw(device, *stages, defines=defines, bindings=bindings, **options)
        return cls(raster, raster_behind, large, resolve, kernel("squares"))

    def release(self) -> None:
        """Free the programs."""
        if self.raster_behind is not self.raster:
            self.raster_behind.release()
        for part in (self.raster, self.large, self.find_squares, self.resolve):
            if part:
                part.release()


class VisibilityBuffer:
    """Every blade is a strip of quads that one invocation fills; a pass over the picture makes surfaces of them."""

    name: ClassVar[str] = "visibility-buffer"
    source: ClassVar[str] = (
        "Burns & Hunt 2013, The Visibility Buffer; Karis et al. 2021, A Deep Dive into Nanite Virtualized Geometry"
    )
    Settings: ClassVar[type[BaseModel]] = VisibilitySettings

    def __init__(self, device: Device, world: World, settings: VisibilitySettings) -> None:
        self._device, self._world = device, world
        self._wide = device.features.wide_atomics
        self._block = BlockBuffer(device.ctx, LEAF_BLOCK)
        self._block.set(**settings.block_values())
        bindings = world.bindings
        bindings["Leaf"] = self._block
        tests, occlusion = world.scene.culling, world.depth_pyramid is not None
        fold = {"FOLD": 1} if any(grass.shape == "quadratic-3d" for grass in world.scene.grass) else {}
        colours = sward_defines(world.scene)
        unstored = {"culling/blades.glsl": '#include "motion/unstored_blades.glsl"'}
        self._nearer: DepthPyramid | None = None
        self._clear: dict[str, Kernel] = {}
        self._kernels: dict[tuple[str, bool], _Kernels] = {}
        for purpose in ("picture", "shadow"):
            defines = {**test_defines(tests, purpose, occlusion), **fold}
            if self._wide and purpose == "picture":
                defines["WIDE"] = 1
            extensions = _WIDE if "WIDE" in defines else ()
            self._clear[purpose] = Kernel(device, f"{_FOLDER}/clear.comp", defines, bindings, extensions=extensions)
            behind = tests.behind_grass and purpose == "picture"
            for stored in (True,) if world.scene.sowing.stored_m is None else (True, False):
                self._kernels[purpose, stored] = _Kernels.build(
                    device,
                    bindings,
                    purpose,
                    {**defines, **colours, **({} if stored else motion_defines(world.scene))},
                    {**width_from("techniques/blades/width.glsl"), **({} if stored else unstored)},
                    world.stage,
                    behind,
                )
            if behind:
                self._nearer = DepthPyramid(device, bindings, f"{_FOLDER}/depth_so_far.glsl", defines, extensions)
        stages = "shaders/screen.vert", f"{_FOLDER}/shadow.frag"
        self._shadow = Draw(device, *stages, defines={"SHADOW": 1}, bindings=bindings)
        self._plan = Kernel(device, f"{_FOLDER}/plan.comp", {}, bindings)
        self._visible, self._ids, self._deferred, self._squares = (
            device.ctx.buffer(reserve=DRAW_COMMAND.dtype.itemsize) for _ in range(4)
        )
        self._lists = zeros(device, _LISTS.dtype.itemsize)

    @staticmethod
    def check(scene: Scene, settings: VisibilitySettings) -> None:
        """Accept any scene."""

    @staticmethod
    def needs(settings: VisibilitySettings) -> Needs:  # noqa: ARG004
        """Blades, stored or not, after all else."""
        return Needs(unstored=True, all_else_first=True)

    def update(self, frame: FrameTime) -> None:
        """Make room for the pixels of the largest view and for the lists of the longest run of chunks.

        Raises `InputError` for a view of more pixels than the driver can hold.
        """
        self._frame = frame
        device = self._device
        pixels = max(view.size_px[0] * view.size_px[1] for view in frame.views)
        self._refuse_too_large(frame.views)
        self._visible = at_least(device, self._visible, pixels * WORD * (2 if self._wide else 1))
        if not self._wide:
            self._ids = at_least(device, self._ids, pixels * WORD)
        if self._world.stage == "fragment":
            squares = max(map(_squares_in, frame.views))
            self._squares = at_least(device, self._squares, DRAW_COMMAND.dtype.itemsize + squares * WORD)
        shown = (each for view in frame.views for each in self._world.visible.of(view))
        # a list of the large, and with 32 bits one of those whose ids are still to be written
        self._capacity = max((each.blades.items for each in shown), default=0)
        self._deferred = at_least(device, self._deferred, self._capacity * WORD * (1 if self._wide else 2))

    def _refuse_too_large(self, views: Sequence[View]) -> None:
        limit = self._device.limits.storage_block_bytes
        for view in views:
            width, height = view.size_px
            most = limit // (WORD * (2 if self._wide and view.purpose == "picture" else 1))
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
        """Fill the visibility buffer with every blade that the view shows, then make surfaces or depth of it."""
        lists = self._world.visible.of(view)
        if not lists:
            return
        self._world.bindings.update(
            VisibilityBuffer=self._visible,
            Nearnesses=self._visible,
            PrimitiveIds=self._ids,
            Lists=self._lists,
            Deferred=self._deferred,
            Squares=self._squares,
        )
        self._empty(view)
        if self._nearer and view.purpose == "picture":
            self._fill_behind(self._nearer, lists, view)
        else:
            for each in lists:
                self._fill(each.page, each.blades, view)
        if view.purpose == "shadow":
            self._device.ctx.enable_only(moderngl.DEPTH_TEST)
            self._shadow.run(moderngl.TRIANGLES, 3)
        else:
            for each in lists:
                self._show(each, view)
        # what comes next may empty the buffer before all of it has been looked up
        self._device.ctx.memory_barrier(STORAGE_WRITTEN)

    def _empty(self, view: View) -> None:
        self._clear[view.purpose].run_over(view.size_px)
        self._device.ctx.memory_barrier(STORAGE_WRITTEN)

    def _fill_behind(self, pyramid: DepthPyramid, lists: Sequence[DrawList], view: View) -> None:
        """Fill the nearest first, which hide the most, then of the others what is not hidden by them."""
        parts = [(each.page, each.blades.split(_NEAREST_PART)) for each in lists]
        for page, (near, _) in parts:
            self._fill(page, near, view)
        pyramid.build(view.size_px)
        self._world.bindings["DepthPyramid"] = pyramid.buffer
        for page, (_, far) in parts:
            self._fill(page, far, view, behind=True)

    def _fill(self, page: Page | UnstoredPage, blades: ChunkRange, view: View, behind: bool = False) -> None:
        if not blades.count:
            return
        kernels = self._kernels[view.purpose, isinstance(page, Page)]
        raster, large = kernels.raster_behind if behind else kernels.raster, kernels.large
        values: dict[str, Any] = {
            **page.bindings,
            **self._unstored(page),
            "list_capacity": self._capacity,
            "first_primitive_id": 32 * page.first_number,
            "writing_ids": False,
        }
        culled: dict[str, Any] = {
            "Chunks": self._world.visible.chunks.buffer,
            "first_chunk": blades.first,
            "chunk_count": blades.count,
            "large_px": LARGE_PX,
        }
        barrier = self._device.ctx.memory_barrier
        raster.run(blades.groups, **values, **culled)
        barrier(STORAGE_WRITTEN)
        self._plan.run(1, rows=view.size_px[1])
        barrier(COMMANDS_WRITTEN)
        large.run_indirect(self._lists, _LISTS.offset("large_groups"), **values)
        if view.purpose == "picture" and not self._wide:
            barrier(STORAGE_WRITTEN)
            values["writing_ids"] = True
            raster.run_indirect(self._lists, _LISTS.offset("won_groups"), **values, **culled)
            large.run_indirect(self._lists, _LISTS.offset("large_groups"), **values)
        barrier(STORAGE_WRITTEN)

    def _show(self, shown: DrawList, view: View) -> None:
        page = shown.page
        kernels = self._kernels[view.purpose, isinstance(page, Page)]
        resolve, ids = kernels.resolve, {"first_primitive_id": 32 * page.first_number, "blade_count": page.capacity}
        assert resolve
        values = {
            **page.bindings,
            **self._unstored(page),
            **ids,
            "on_ground": page.object_index is None,
            "previous_from_now": view.relative(page.previous_from_now),
        }
        if isinstance(resolve, Kernel):
            resolve.run_over(view.size_px, **values)
            self._device.ctx.memory_barrier(IMAGES_WRITTEN)
            return
        find = kernels.find_squares
        assert find
        upload(self._device, self._squares, _NO_SQUARES)
        columns, rows = (-(-edge // _SQUARE) for edge in view.size_px)
        find.run_over((columns, rows), **ids)
        self._device.ctx.memory_barrier(COMMANDS_WRITTEN)
        self._device.ctx.enable_only(moderngl.NOTHING)
        resolve.run_indirect(moderngl.TRIANGLE_STRIP, self._squares, 0, **values)

    def _unstored(self, page: Page | UnstoredPage) -> dict[str, Any]:
        """Values that shaders of blades that are not stored name."""
        if isinstance(page, Page):
            return {}
        frame = self._frame
        return {
            "time_s": frame.time_s,
            "previous_time_s": frame.previous_time_s,
            "tallest_m": self._world.field.tallest_m,
        }

    def identify(self, numbers: npt.NDArray[np.uint32]) -> Ids:
        """Find the permanent ids of stored blades by their numbers."""
        return self._world.field.identify(numbers)

    def considered(self, view: View) -> int:
        """Count the blades of this view that were handed to its tests in the last frame."""
        return self._world.visible.considered(view)

    def drawn(self, view: View) -> int:
        """Count the blades that were drawn of the picture in the last frame."""
        if not self._world.visible.of(view):
            return 0
        (lists,) = np.frombuffer(read_back(self._device, self._lists), _LISTS.dtype)
        return int(lists["drawn"].sum())

    def release(self) -> None:
        """Free programs, blocks and buffers."""
        release_all(*self._kernels.values())
        if self._nearer:
            self._nearer.release()
        release_all(*self._clear.values(), self._plan, self._shadow, self._block)
        release_all(self._visible, self._ids, self._deferred, self._squares, self._lists)


def _squares_in(view: View) -> int:
    """Number of squares of squares.glsl that cover a view."""
    width, height = (-(-edge // _SQUARE) for edge in view.size_px)
    return width * height
