"""The scene once on the GPU: ground, field, winds, objects; what a technique is given."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.culling import ChunkTable, Pyramid, Span, distance_to, shares_needed
from greensward.gpu.pixel_pass import Shell
from greensward.gpu.view import View
from greensward.ground import HeightField
from greensward.ground.ground_gpu import GroundGpu
from greensward.motion import Colliders, Forces, Postures, Remembering, Simulated, Winds, absent_forces
from greensward.objects.helicopter import helicopters
from greensward.objects.placing import Placing, Script
from greensward.scene import InputError, Scene
from greensward.sowing import Field, Page, UnstoredPage

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]
HEAD_PX = (14.0, 5.0)  # size on the screen down to which a head has full, and simple, detail
CHUNKS, HEADS, MESHES, RECORDS, SOWN = range(2, 7)
"""Shader-storage bindings while the field is drawn, besides 0 and 1 of its pages and those of culling."""


@dataclass(frozen=True)
class Instant:
    """When a frame is, when the one before it was, and every view that is drawn of it."""

    time_s: float
    previous_time_s: float
    views: tuple[View, ...]


@dataclass(frozen=True)
class Seen:
    """What a view may show of a page: chunks of blades, nearest tiles first, and heads by level of detail."""

    page: Page | UnstoredPage
    blades: Span
    heads: tuple[Span, ...]


class World:
    """Ground, field, objects and motion of a scene on one context.

    Without `sown` the field stays empty, for a technique that brings blades of its own.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        scene: Scene,
        heights: HeightField,
        shell: Shell,
        scripts: Mapping[str, Script] | None = None,
        sown: bool = True,
        stray_m: float | None = None,
    ) -> None:
        self.ctx = ctx
        self.scene = scene
        self.shell = shell
        self._sown = sown
        """Where full-screen passes run."""
        self.ground = GroundGpu(ctx, scene, heights)
        flying, flights = helicopters(scene.wind, heights)
        self.objects = scene.object + flying
        """Those of the scene, and those that belong to its winds."""
        self.placing = Placing(self.objects, heights, {**flights, **(scripts or {})})
        self.placed = self.previously_placed = self.placing.at(0.0)
        """World from own space of every object, now and a frame ago: float64 (objects, 4, 4)."""
        self.field = Field(ctx, scene, self.ground)
        self._winds = Winds(ctx, scene, heights)
        self._forces = Forces(ctx, scene)
        self._motion = Postures(ctx, scene)
        self._simulated = self._colliders = None
        if scene.simulation:
            self._colliders = Colliders(ctx, self.objects, heights, scripts or {}, scene.resolve)
            self._simulated = Simulated(ctx, scene, self._colliders)
        self.has_meshes = any(thing.drawn for thing in self.objects) or any(g.head != "none" for g in scene.grass)
        self.has_meshes |= bool(scene.flowers)
        """Whether a picture may show objects, flowers or seed heads, which have triangles."""
        self.chunks = ChunkTable(ctx)
        hills = heights.there and heights.highest_m > heights.lowest_m
        hiding = hills or any(thing.drawn for thing in self.objects)
        self.pyramid = Pyramid(ctx) if scene.culling.occlusion and hiding else None
        """How far away what hides grass in the picture is; None where nothing can, or the scene asks for none."""
        self._seen: dict[View, list[Seen]] = {}
        self._closed: list[tuple[Page, Span]] = []
        self._remembering: list[Remembering] = []
        self._remembered: dict[Page, npt.NDArray[np.bool_]] = {}
        self.views: tuple[View, ...] = ()
        """The views that were culled for last."""
        # seed heads are long but thin
        slender = {"none": 0.0, "panicle": 0.4, "spike": 0.4}
        self._broadest_head_m = max(
            (grass.head_size_m[1] * slender.get(grass.head, 1.0) for grass in scene.grass), default=0.0
        )
        self._focus: Floats | None = None
        # a camera may stray this far before blades are sown anew around it
        self._slack_m = 0.15 * scene.sowing.full_density_m if stray_m is None else stray_m

    def follow(self, camera_ws: Floats) -> bool:
        """Sow the field around the camera if it strayed; returns whether it did."""
        if self._focus is not None and np.linalg.norm(camera_ws - self._focus) <= self._slack_m:
            return False
        if self._simulated:
            self._simulated.keep(self.field.pages)
        if self._sown:
            self.field.sow(camera_ws, self._slack_m)
        self._focus = camera_ws.copy()
        self.views = ()
        return True

    def change(self, scene: Scene) -> bool:
        """Take over another scene's winds and forces, if shaders and objects are good for them; returns whether.

        All else must be the same but for what the world does not read.
        """
        before = self.scene
        if absent_forces(scene) != absent_forces(before):
            return False
        forces = Forces(self.ctx, scene) if scene.force != before.force else self._forces
        if not self._winds.change(before, scene, self.ground.heights):
            return False
        if forces is not self._forces:
            self._forces.release()
            self._forces = forces
        self.scene = scene
        return True

    def bind(self) -> None:
        """Bind what every shader of the field may read: ground, maps and sward."""
        self.ground.bind()
        self.field.block.bind()

    def move(self, instant: Instant) -> None:
        """Put objects in their places, cull for the instant's views if need be, and take the postures they need."""
        self.placed = self.placing.at(instant.time_s)
        self.previously_placed = self.placing.at(instant.previous_time_s)
        self.field.carry(self.placed, instant.time_s)
        for page in self.field.pages:
            if page.thing is not None:
                page.previous_from_now = self.previously_placed[page.thing] @ np.linalg.inv(self.placed[page.thing])
        carried = any(page.thing is not None and self.placing.moving[page.thing] for page in self.field.pages)
        culled = instant.views != self.views or carried
        if culled:
            self._cull(instant.views)
        self.chunks.bind(CHUNKS)
        self._winds.bind()
        self._forces.bind()
        self._motion.bind()
        for page, span in self._closed:
            self._motion.take(page, span, instant.time_s, instant.previous_time_s)
        if self._simulated:
            self._simulated.advance(
                self._remembering,
                culled,
                instant.time_s,
                instant.previous_time_s,
                instant.views[0].camera_ws,
                self.placing.at,
                self.field.tallest_m,
            )

    @property
    def blades_simulated(self) -> int:
        """Blades whose state was carried on for the last instant."""
        return sum(each.items for each in self._remembering)

    def _cull(self, views: tuple[View, ...]) -> None:
        sowing = self.scene.sowing
        # without the test by distance, no blade that was sown is left out within the reach
        full_density_m = sowing.full_density_m if self.scene.culling.distance else np.inf
        self.views = views
        self._seen, self._closed, self._remembering = {view: [] for view in views}, [], []
        remembered: dict[Page, npt.NDArray[np.bool_]] = {}
        self.chunks.clear()
        for page in self.field.pages + ([self.field.unstored] if self.field.unstored else []):
            tiles = page.tiles
            away = distance_to(tiles, views[0].camera_ws)
            # the nearest first, so that what they hide is rejected by its depth
            order = np.argsort(away, kind="stable")
            shares = shares_needed(tiles, views, away, full_density_m, sowing.blades_m)[:, order]
            eighths = np.ceil(shares * 8.0).astype(np.int64)
            for view, needed in zip(views, eighths, strict=True):
                blades = self._blades(page, order, needed)
                if blades.count:
                    heads = self._heads(page, order[needed > 0], away, view) if isinstance(page, Page) else ()
                    self._seen[view].append(Seen(page, blades, heads))
            if isinstance(page, UnstoredPage):
                continue
            needed = eighths.max(axis=0)
            if self.scene.simulation:
                within = self.scene.simulation.within_m
                wide = np.linalg.norm(2.0 * tiles.half, axis=1)[order]
                remembers, blends = away[order] < within, away[order] + wide > 0.8 * within
                known = self._remembered.get(page, np.zeros(len(away), np.bool_))[order]
                middle, rim = (
                    (
                        self._blades(page, order, np.where(where & known, 8, 0)),
                        self._blades(page, order, np.where(where & ~known, 8, 0)),
                    )
                    for where in (remembers & ~blends, remembers & blends)
                )
                self._remembering.append(Remembering(page, middle, rim))
                remembered[page] = away < within
                needed = np.where(remembers, 0, needed)
            self._closed.append((page, self._blades(page, order, needed)))
        self._remembered = remembered
        self.chunks.cut()

    def _blades(self, page: Page | UnstoredPage, order: Indices, eighths: Indices) -> Span:
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

    def considered(self, view: View) -> int:
        """Blades that the view may show."""
        return sum(seen.blades.items for seen in self.seen(view))

    def saved(self) -> dict[str, npt.NDArray[Any]]:
        """The memory of the grass, and where the field lies, as arrays. Empty where the scene has no simulation."""
        if not self._simulated or self._focus is None:
            return {}
        remembered = {
            f"remembered_{i}": self._remembered.get(page, np.zeros(len(page.tiles.start), np.bool_))
            for i, page in enumerate(self.field.pages)
        }
        return {**self._simulated.saved(self.field.pages), **remembered, "focus": self._focus}

    def resume(self, saved: Mapping[str, npt.NDArray[Any]]) -> None:
        """Continue from what `saved` returned. Raises `InputError` where it does not fit the scene."""
        if not self._simulated:
            return
        if "focus" not in saved or saved["focus"].shape != (3,):
            raise InputError("the checkpoint was made before the first frame, or of a scene without simulation")
        self._focus = None
        self.follow(saved["focus"].astype(np.float64))
        self._simulated.resume(self.field.pages, saved)
        for i, page in enumerate(self.field.pages):
            mask = saved.get(f"remembered_{i}")
            if mask is None or mask.shape != (len(page.tiles.start),):
                raise InputError("the checkpoint was made of another field: use the same scene, seed and camera")
            self._remembered[page] = mask.astype(np.bool_)

    def release(self) -> None:
        """Free the GPU resources."""
        self.chunks.release()
        for part in (self.pyramid, self._simulated, self._colliders, self._winds, self._forces):
            if part:
                part.release()
        self._motion.release()
        self.field.release()
        self.ground.release()
