"""Visible set: what each view of a frame may show of every page of the field."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from greensward.culling.chunks import ChunkRange, ChunkTable
from greensward.culling.tiles import coverage_needed, distance_to
from greensward.gpu.device import Device
from greensward.gpu.view import View
from greensward.scene import Scene
from greensward.sowing import Field, Page, UnstoredPage

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


@dataclass(frozen=True)
class DrawList:
    """Chunks of blades of a page that a view may show, nearest tiles first, and of its heads."""

    page: Page | UnstoredPage
    tiles: Indices
    """Numbers of the tiles that hold these blades."""
    lengths: Indices
    """Number of blades of each, from its first on, that the view may show."""
    blades: ChunkRange
    heads: ChunkRange


@dataclass(frozen=True)
class NeededTiles:
    """Tiles of a stored page, the nearest first: which, how far, and the eighths of the blades that a view needs."""

    page: Page
    order: Indices
    away: Floats
    """Distance of each tile in metres, in the page's own order."""
    eighths: Indices


class VisibleSet:
    """Draw lists of a frame's views, and the table of chunks that they point into."""

    def __init__(self, device: Device, scene: Scene) -> None:
        self._scene = scene
        self.chunks = ChunkTable(device)
        self.views: tuple[View, ...] = ()
        """Views that were culled for last."""
        self._lists: dict[View, list[DrawList]] = {}
        # seed heads are long but thin
        slender = {"none": 0.0, "panicle": 0.4, "spike": 0.4}
        self._broadest_head_m = max(
            (grass.head_size_m[1] * slender.get(grass.head, 1.0) for grass in scene.grass), default=0.0
        )

    def update(self, field: Field, views: tuple[View, ...]) -> list[NeededTiles]:
        """Cull the tiles of the field for new views; returns what is needed of its stored pages.

        More chunks may be added to the table before it is cut.
        """
        sowing = self._scene.sowing
        # without the test by distance, no blade that was sown is left out within the reach
        full_density_m = sowing.full_density_m if self._scene.culling.distance else np.inf
        self.views, self._lists = views, {view: [] for view in views}
        self.chunks.clear()
        stored: list[NeededTiles] = []
        for page in field.pages + ([field.unstored] if field.unstored else []):
            away = distance_to(page.tiles, views[0].camera_ws)
            # the nearest first, so that what they hide is rejected by its depth
            order = np.argsort(away, kind="stable")
            coverage = coverage_needed(page.tiles, views, away, full_density_m, sowing.blades_m)[:, order]
            eighths = np.ceil(coverage * 8.0).astype(np.int64)
            for view, needed in zip(views, eighths, strict=True):
                at, lengths = _needed(page, order, needed)
                blades = self.chunks.add(page.tiles.start[at], lengths)
                if blades.count:
                    self._lists[view].append(DrawList(page, at, lengths, blades, self._heads(page, at, view)))
            if isinstance(page, Page):
                stored.append(NeededTiles(page, order, away, eighths.max(axis=0)))
        return stored

    def add(self, page: Page | UnstoredPage, order: Indices, eighths: Indices) -> ChunkRange:
        """Add so many eighths of the blades of each tile, in this order, to the table."""
        at, lengths = _needed(page, order, eighths)
        return self.chunks.add(page.tiles.start[at], lengths)

    def _heads(self, page: Page | UnstoredPage, at: Indices, view: View) -> ChunkRange:
        # none where a shadow map is too coarse to tell them from blades
        if not isinstance(page, Page) or (
            view.purpose == "shadow" and self._broadest_head_m <= 4.0 * view.pixel_m[1]
        ):
            return ChunkRange(0, 0, 0)
        return self.chunks.add(page.tiles.head_start[at], page.tiles.heads[at])

    def of(self, view: View) -> Sequence[DrawList]:
        """Draw lists of a view, by page of the field."""
        return self._lists.get(view, ())

    def considered(self, view: View) -> int:
        """Number of blades that the view may show."""
        return sum(each.blades.items for each in self.of(view))

    def forget(self) -> None:
        """Cull again for the next frame, whatever its views."""
        self.views = ()

    def release(self) -> None:
        """Free the GPU resources."""
        self.chunks.release()


def _needed(page: Page | UnstoredPage, order: Indices, eighths: Indices) -> tuple[Indices, Indices]:
    """Tiles of which any eighths of the blades are needed, in this order, and how many blades that is."""
    some = eighths > 0
    at = order[some]
    return at, page.tiles.up_to[at, eighths[some] - 1]
