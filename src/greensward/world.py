"""The scene once on the GPU: ground, field, winds; what a technique is given."""

from collections.abc import Sequence
from dataclasses import dataclass

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.culling import Chunks, share_needed
from greensward.gpu.view import View
from greensward.ground import HeightField
from greensward.ground.ground_gpu import GroundGpu
from greensward.motion import Postures
from greensward.scene import Scene
from greensward.sowing import Field, Page

BLADES, POSTURES, CHUNKS, HEADS = range(4)


@dataclass(frozen=True)
class Instant:
    """When a frame is, when the one before it was, and every view that is drawn of it."""

    time_s: float
    previous_time_s: float
    views: tuple[View, ...]


class World:
    """Ground, field and motion of a scene on one context."""

    def __init__(self, ctx: moderngl.Context, scene: Scene, heights: HeightField) -> None:
        self.ctx = ctx
        self.scene = scene
        self.ground = GroundGpu(ctx, scene, heights)
        self.field = Field(ctx, scene, self.ground)
        self._motion = Postures(ctx, scene)
        self._pool: list[Chunks] = []
        self._seen: dict[View, list[tuple[Page, Chunks]]] = {}
        self._shares: dict[View, list[npt.NDArray[np.float64]]] = {}
        self._needed: list[tuple[Page, Chunks]] = []
        self.views: tuple[View, ...] = ()
        """The views that were culled for last."""
        self._focus: npt.NDArray[np.float64] | None = None
        # a camera may stray this far before blades are sown anew around it
        self._slack_m = 0.15 * scene.sowing.full_density_m

    def follow(self, camera_ws: npt.NDArray[np.float64]) -> bool:
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
        """Cull tiles for every view of the instant and take the postures that they need."""
        if instant.views == self.views:
            for page, needed in self._needed:
                self._motion.take(page, needed, instant.time_s, instant.previous_time_s)
            return
        self.views = instant.views
        self._needed = []
        sowing = self.scene.sowing
        pool = iter(self._pooled(len(self.field.pages) * (len(instant.views) + 1)))
        self._seen = {view: [] for view in instant.views}
        self._shares = {view: [] for view in instant.views}
        for page in self.field.pages:
            shares = [
                share_needed(page.tiles, view, sowing.full_density_m, sowing.reach_m) for view in instant.views
            ]
            for view, share in zip(instant.views, shares, strict=True):
                self._shares[view].append(share)
                chunks = next(pool)
                _select(chunks, page, share)
                if chunks.count:
                    self._seen[view].append((page, chunks))
            needed = next(pool)
            _select(needed, page, np.max(shares, axis=0))
            self._needed.append((page, needed))
            self._motion.take(page, needed, instant.time_s, instant.previous_time_s)

    def chunks(self, view: View) -> Sequence[tuple[Page, Chunks]]:
        """Pages of the field with the chunks of blades that the view may show."""
        return self._seen.get(view, ())

    def seen_tiles(self, view: View) -> Sequence[tuple[Page, npt.NDArray[np.int64]]]:
        """Pages of the field with the numbers of the tiles that the view may show."""
        return [(p, np.flatnonzero(s)) for p, s in zip(self.field.pages, self._shares[view], strict=True)]

    def _pooled(self, count: int) -> list[Chunks]:
        while len(self._pool) < count:
            self._pool.append(Chunks(self.ctx))
        return self._pool

    def release(self) -> None:
        """Free the GPU resources."""
        for chunks in self._pool:
            chunks.release()
        self._motion.release()
        self.field.release()
        self.ground.release()


def _select(chunks: Chunks, page: Page, share: npt.NDArray[np.float64]) -> None:
    bin_ = np.clip(np.ceil(share * 8.0).astype(np.int64), 0, 8)
    at = np.flatnonzero(bin_)
    chunks.set(page.tiles.start[at], page.tiles.up_to[at, bin_[at] - 1])
