"""Everything that has a surface, unlit, from one view after another: which passes draw it, and in which order."""

from collections.abc import Callable, Sequence

import moderngl

from greensward.gpu.blocks import BlockBuffer
from greensward.gpu.depth import ReversedDepth
from greensward.gpu.pixel_pass import Shell
from greensward.gpu.timers import PassTimers
from greensward.gpu.view import VIEW_BLOCK, View, view_values
from greensward.passes.flowers import BillboardFlowers
from greensward.passes.gbuffer import GBuffer
from greensward.passes.heads import Heads
from greensward.passes.shadows import MOST_CASCADES
from greensward.passes.solids import Solids
from greensward.passes.terrain import Terrain
from greensward.techniques import Technique
from greensward.world import Instant, World

PICTURE, MIRROR = 0, MOST_CASCADES + 1
"""Whose block of the view is which; those between are the shadow maps'."""
_CLIP_DISTANCE = 0x3000


class Surfaces:
    """Draws grass by a technique, ground, objects, heads and flowers into G-buffers and shadow maps."""

    def __init__(
        self,
        ctx: moderngl.Context,
        world: World,
        technique: Technique,
        far: Technique | None,
        shell: Shell,
        depth: ReversedDepth,
        timers: PassTimers,
    ) -> None:
        self._ctx, self._world, self._technique, self._far = ctx, world, technique, far
        self._depth, self._timers = depth, timers
        self._blocks = [BlockBuffer(ctx, VIEW_BLOCK) for _ in range(MIRROR + 1)]
        self._terrain = Terrain(ctx, world, shell, technique.last)
        self._solids = Solids(ctx, world)
        self._heads = Heads(ctx, world)
        self.flowers = BillboardFlowers(ctx, world)
        self._lit_by: Sequence[View] | None = None

    def update(self, instant: Instant) -> None:
        """Compute work for this instant, once for all views."""
        self._technique.update(instant)
        if self._far:
            self._far.update(instant)
        self.flowers.update(instant)

    def cast(self, framebuffers: Sequence[moderngl.Framebuffer], views: Sequence[View]) -> None:
        """Fill the shadow maps, each seen by its view."""
        for slot, (view, framebuffer) in enumerate(zip(views, framebuffers, strict=False), start=1):
            framebuffer.clear(depth=1.0)
            if self._lit_by is not views:
                self._blocks[slot].set(**view_values(view, view))
            self._draw(framebuffer, view, slot, hiding=False)
        self._lit_by = views

    def fill(
        self,
        gbuffer: GBuffer,
        view: View,
        previous_view: View,
        offset_px: tuple[float, float],
        *,
        slot: int,
        hiding: bool,
    ) -> None:
        """Fill a G-buffer with all that a view shows, its sample shifted by so many pixels.

        `hiding` builds the pyramid of what hides grass, which grass is tested against in this view's first sample.
        """
        with self._timers.measure("clear" if slot == PICTURE else "water"):
            gbuffer.clear(rastered=not self._technique.last or self._world.has_meshes)
        with self._depth.drawing():
            values = view_values(view, previous_view, offset_px)
            jittered = "jittered_clip_from_relative"
            values[jittered] = self._depth.matrix(values[jittered])
            self._blocks[slot].set(**values)
            gbuffer.id.use(13)
            gbuffer.depth.use(14)
            gbuffer.bind_images()
            self._draw(gbuffer.framebuffer, view, slot, hiding)
        with self._timers.measure("ground" if slot == PICTURE else "water"):
            self._terrain.paint(gbuffer)

    def _draw(self, target: moderngl.Framebuffer, view: View, slot: int, hiding: bool) -> None:
        self._blocks[slot].bind()
        target.use()
        self._ctx.enable_only(moderngl.DEPTH_TEST)
        if slot == MIRROR:
            self._ctx.enable_direct(_CLIP_DISTANCE)
        told = {PICTURE: None, MIRROR: "water"}.get(slot, "shadows")
        for name, draw in self._order(hiding and self._world.pyramid is not None):
            with self._timers.measure(told or name):
                draw(view)
        if slot == MIRROR:
            self._ctx.disable_direct(_CLIP_DISTANCE)

    def _order(self, hiding: bool) -> list[tuple[str, Callable[[View], None]]]:
        objects, ground = ("objects", self._solids.draw), ("ground", self._terrain.draw)
        grass, heads = ("grass", self._technique.draw), ("heads", self._heads.draw)
        flowers, pyramid = ("flowers", self.flowers.draw), [("ground", self._build_pyramid)] if hiding else []
        far = [("far", self._far.draw)] if self._far else []
        if self._technique.last:
            return [objects, heads, flowers, ground, *pyramid, grass, *far]
        if hiding:
            return [objects, ground, *pyramid, grass, heads, flowers, *far]
        # the ground after it: where grass hides it, its shader does not run
        return [objects, grass, heads, flowers, ground, *far]

    def _build_pyramid(self, view: View) -> None:
        assert self._world.pyramid
        self._world.pyramid.build(view.size_px)

    def release(self) -> None:
        """Free the GPU resources."""
        for part in (self.flowers, self._heads, self._solids, self._terrain, *self._blocks):
            part.release()  # type: ignore[attr-defined]
