"""The scene once on the GPU: ground, field, winds; what a technique is given."""

from collections.abc import Sequence
from dataclasses import dataclass

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.culling import ChunkTable, Span, distance_to, shares_needed
from greensward.gpu.view import View
from greensward.ground import HeightField
from greensward.ground.ground_gpu import GroundGpu
from greensward.motion import Postures
from greensward.scene import Scene
from greensward.sowing import Field, Page

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]
HEAD_PX = (14.0, 5.0)  # size on the screen down to which a head has full, and simple, detail
BLADES, POSTURES, CHUNKS, HEADS, MESHES, RECORDS = range(6)
"""Shader-storage bindings while the field is drawn."""


@dataclass(frozen=True)
class Instant:
    """When a frame is, when the one before it was, and every view that is drawn of it."""

    time_s: float
    previous_time_s: float
    views: tuple[View, ...]


@dataclass(frozen=True)
class Seen:
    """What a view may show of a page: chunks of blades, nearest tiles first, and heads by level of detail."""

    page: Page
    blades: Span
    heads: tuple[Span, ...]


class World:
    """Ground, field and motion of a scene on one context."""

    def __init__(self, ctx: moderngl.Context, scene: Scene, heights: HeightField) -> None:
        self.ctx = ctx
        self.scene = scene
        self.ground = GroundGpu(ctx, scene, heights)
        self.field = Field(ctx, scene, self.ground)
        self._motion = Postures(ctx, scene)
        self.chunks = ChunkTable(ctx)
        self._seen: dict[View, list[Seen]] = {}
        self._moving: list[tuple[Page, Span]] = []
        self.views: tuple[View, ...] = ()
        """The views that were culled for last."""
        # seed heads are long but thin
        slender = {"none": 0.0, "panicle": 0.4, "spike": 0.4}
        self._broadest_head_m = max(
            (grass.head_size_m[1] * slender.get(grass.head, 1.0) for grass in scene.grass), default=0.0
        )
        self._focus: Floats | None = None
        # a camera may stray this far before blades are sown anew around it
        self._slack_m = 0.15 * scene.sowing.full_density_m

    def follow(self, camera_ws: Floats) -> bool:
        """Sow the field around the camera if it strayed; returns whether it did."""
        if self._focus is not None and np.linalg.norm(camera_ws - self._focus) <= self._slack_m:
            return False
        self.field.sow(camera_ws, self._slack_m)
        self._focus = camera_ws.copy()
        self.views = ()
        return True

    def bind(self) -> None:
        """Bind what every shader of the field may read: ground, maps and sward."""
        self.ground.bind()
        self.field.block.bind()

    def move(self, instant: Instant) -> None:
        """Cull for the instant's views if they changed, and take the postures that they need."""
        if instant.views != self.views:
            self._cull(instant.views)
        self.chunks.bind(CHUNKS)
        for page, span in self._moving:
            self._motion.take(page, span, instant.time_s, instant.previous_time_s)

    def _cull(self, views: tuple[View, ...]) -> None:
        sowing = self.scene.sowing
        self.views = views
        self._seen, self._moving = {view: [] for view in views}, []
        self.chunks.clear()
        for page in self.field.pages:
            tiles = page.tiles
            away = distance_to(tiles, views[0].camera_ws)
            # the nearest first, so that what they hide is rejected by its depth
            order = np.argsort(away, kind="stable")
            shares = shares_needed(tiles, views, away, sowing.full_density_m, sowing.reach_m)[:, order]
            eighths = np.ceil(shares * 8.0).astype(np.int64)
            for view, needed in zip(views, eighths, strict=True):
                blades = self._blades(page, order, needed)
                if blades.count:
                    heads = self._heads(page, order[needed > 0], away, view)
                    self._seen[view].append(Seen(page, blades, heads))
            self._moving.append((page, self._blades(page, order, eighths.max(axis=0))))
        self.chunks.cut()

    def _blades(self, page: Page, order: Indices, eighths: Indices) -> Span:
        some = eighths > 0
        at = order[some]
        return self.chunks.add(page.tiles.start[at], page.tiles.up_to[at, eighths[some] - 1])

    def _heads(self, page: Page, at: Indices, away: Floats, view: View) -> tuple[Span, ...]:
        start, length = page.tiles.head_start[at], page.tiles.heads[at]
        if view.purpose == "shadow":
            # least detail, and none where the map is too coarse to tell them from blades
            shown = self._broadest_head_m > 4.0 * view.pixel_m[1]
            level = np.full(len(at), len(HEAD_PX) if shown else -1)
        else:
            # the broadest decide here; a smaller one may take less detail for itself, never more
            size_px = self._broadest_head_m / np.maximum(away[at] * view.pixel_m[0], 1e-9)
            level = np.searchsorted(-np.array(HEAD_PX), -size_px)
        return tuple(self.chunks.add(start[level == k], length[level == k], 1) for k in range(len(HEAD_PX) + 1))

    def seen(self, view: View) -> Sequence[Seen]:
        """What the view may show, by page of the field."""
        return self._seen.get(view, ())

    def release(self) -> None:
        """Free the GPU resources."""
        self.chunks.release()
        self._motion.release()
        self.field.release()
        self.ground.release()
