"""Geometry of a frame: everything that has a surface, unlit, from one view after another, in which order."""

from collections.abc import Callable, Sequence

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import release_all
from greensward.gpu.depth import ReversedDepth
from greensward.gpu.device import Device, Stage
from greensward.gpu.layouts import BlockBuffer
from greensward.gpu.timers import PassTimers
from greensward.gpu.view import VIEW_BLOCK, View, view_values
from greensward.passes.flowers import BillboardFlowers
from greensward.passes.gbuffer import GBuffer
from greensward.passes.heads import Heads
from greensward.passes.solids import Solids
from greensward.passes.terrain import Terrain
from greensward.scene.classes import BLADE_NUMBER_BITS, SurfaceClass
from greensward.scene.field import MOST_CASCADES
from greensward.sowing.blade import FIRST_TRACED
from greensward.sowing.identity import Ids
from greensward.techniques import AnyTechnique, Needs
from greensward.world import FrameTime, World

PICTURE, MIRROR = 0, MOST_CASCADES + 1
"""Numbers of the views' blocks; those between are the shadow maps'."""
_CLIP_DISTANCE = 0x3000


class GeometryPasses:
    """Draws grass by a technique, ground, objects, heads and flowers into G-buffers and shadow maps."""

    def __init__(
        self,
        device: Device,
        world: World,
        technique: AnyTechnique,
        needs: Needs,
        far: AnyTechnique | None,
        stage: Stage,
        depth: ReversedDepth,
        timers: PassTimers,
    ) -> None:
        self._device, self._ctx = device, device.ctx
        self._world, self._technique, self._far = world, technique, far
        self._grass_last = needs.all_else_first
        self._depth, self._timers = depth, timers
        self._blocks = [BlockBuffer(device.ctx, VIEW_BLOCK) for _ in range(MIRROR + 1)]
        self._terrain = Terrain(device, world, stage, self._grass_last, (needs.thinning, needs.shrinking))
        self._solids = Solids(device, world)
        self._heads = Heads(device, world)
        self.flowers = BillboardFlowers(device, world)
        self._lit_by: Sequence[View] | None = None

    def change_objects(self) -> None:
        """Draw the objects that the world has now."""
        self._solids.release()
        self._solids = Solids(self._device, self._world)

    def update(self, frame: FrameTime) -> None:
        """Do the compute work for this frame, once for all views."""
        self._technique.update(frame)
        if self._far:
            self._far.update(frame)
        self.flowers.update(frame)

    def fill_shadow_maps(self, framebuffers: Sequence[moderngl.Framebuffer], views: Sequence[View]) -> None:
        """Fill the shadow maps, each seen by its view."""
        for slot, (view, framebuffer) in enumerate(zip(views, framebuffers, strict=False), start=1):
            framebuffer.clear(depth=1.0)
            if self._lit_by is not views:
                self._blocks[slot].set(**view_values(view, view))
            self._draw(framebuffer, view, slot, occlusion=False)
        self._lit_by = views

    def fill(
        self,
        gbuffer: GBuffer,
        view: View,
        previous_view: View,
        offset_px: tuple[float, float],
        *,
        slot: int,
        occlusion: bool,
    ) -> None:
        """Fill a G-buffer with all that a view shows, its sample shifted by so many pixels.

        `occlusion` builds the depth pyramid, which grass is tested against in this view's first sample.
        """
        self._world.bindings.update(gbuffer.bindings)
        with self._timers.measure("clear" if slot == PICTURE else "water"):
            gbuffer.clear(rastered=not self._grass_last or self._world.has_meshes)
        with self._depth.drawing():
            values = view_values(view, previous_view, offset_px)
            jittered = "jittered_clip_from_relative"
            values[jittered] = self._depth.matrix(values[jittered])
            values["parallel_depth_m"] = self._depth.parallel_depth_m(*view.near_and_far_m)
            self._blocks[slot].set(**values)
            self._draw(gbuffer.framebuffer, view, slot, occlusion)
        with self._timers.measure("ground" if slot == PICTURE else "water"):
            self._terrain.paint(gbuffer)

    def _draw(self, target: moderngl.Framebuffer, view: View, slot: int, occlusion: bool) -> None:
        self._world.bindings["View"] = self._blocks[slot]
        target.use()
        self._ctx.enable_only(moderngl.DEPTH_TEST)
        if slot == MIRROR:
            self._ctx.enable_direct(_CLIP_DISTANCE)
        label = {PICTURE: None, MIRROR: "water"}.get(slot, "shadows")
        for name, draw in self._order(occlusion and self._world.depth_pyramid is not None):
            with self._timers.measure(label or name):
                draw(view)
        if slot == MIRROR:
            self._ctx.disable_direct(_CLIP_DISTANCE)

    def _order(self, occlusion: bool) -> list[tuple[str, Callable[[View], None]]]:
        objects, ground = ("objects", self._solids.draw), ("ground", self._terrain.draw)
        grass, heads = ("grass", self._technique.draw), ("heads", self._heads.draw)
        flowers, pyramid = ("flowers", self.flowers.draw), [("ground", self._build_pyramid)] if occlusion else []
        far = [("far", self._far.draw)] if self._far else []
        if self._grass_last:
            return [objects, heads, flowers, ground, *pyramid, grass, *far]
        if occlusion:
            return [objects, ground, *pyramid, grass, heads, flowers, *far]
        # the ground after it: where grass hides it, its shader does not run
        return [objects, grass, heads, flowers, ground, *far]

    def _build_pyramid(self, view: View) -> None:
        pyramid = self._world.depth_pyramid
        assert pyramid
        pyramid.build(view.size_px)
        self._world.bindings["DepthPyramid"] = pyramid.buffer

    def identify(self, kinds: npt.NDArray[np.uint8], numbers: npt.NDArray[np.uint32]) -> Ids:
        """Find the permanent ids of what the last picture shows, from `SurfaceClass` and number of each pixel.

        uint64 of the same shape; 0 where there is no blade.
        """
        ids, left = np.zeros(numbers.shape, np.uint64), (numbers > 0) & (kinds != SurfaceClass.OBJECT)
        flowers = np.uint32((1 << BLADE_NUMBER_BITS) - 1) - numbers
        # flowers are numbered from the other end than blades
        parts: list[tuple[npt.NDArray[np.bool_], npt.NDArray[np.uint32], Callable[..., Ids]]] = [
            ((kinds == SurfaceClass.FLOWER) & (flowers < self.flowers.most), flowers, self.flowers.identify),
            *([(numbers >= FIRST_TRACED, numbers, self._far.identify)] if self._far else []),
            (left, numbers, self._technique.identify),
        ]
        for which, own, identify in parts:
            mine = left & which
            left = left & ~mine
            found, at = np.unique(own[mine], return_inverse=True)
            if len(found):
                ids[mine] = identify(found)[at]
        return ids

    def release(self) -> None:
        """Free the GPU resources."""
        release_all(self.flowers, self._heads, self._solids, self._terrain, *self._blocks)
