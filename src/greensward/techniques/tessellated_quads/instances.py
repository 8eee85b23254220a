"""One stored patch of blades, and the places at which it is drawn."""

from collections.abc import Sequence
from dataclasses import dataclass

import moderngl
import numpy as np

from greensward.culling import CHUNK, at_least
from greensward.culling.patches import Grid, patches_in_view
from greensward.gpu.buffers import rewrite
from greensward.gpu.view import View
from greensward.scene import InputError
from greensward.techniques.tessellated_quads.settings import Settings
from greensward.world import World

PATCH, PLACES = 5, 6
"""Shader-storage bindings."""
FADING = 0.12
"""Of all ranks: those that thinning leaves out next are narrower already. The shaders are built with it."""
_MOST_IDS = (1 << 27) - 2
_STORED_FLOATS = 10
_EACH_WAY = 1 << 14
"""Patches to each side of the origin where the ground goes on beyond its edge."""


@dataclass(frozen=True)
class Group:
    """Patches that a view shows at one density: consecutive places, and blades of each."""

    first: int
    count: int
    blades: int

    @property
    def chunks(self) -> int:
        """Instances of a draw that one patch takes."""
        return -(-self.blades // CHUNK)


class Instances:
    """The patch, stored once, and for each view the places where it shows, by density."""

    def __init__(self, ctx: moderngl.Context, world: World, settings: Settings) -> None:
        self._ctx, self._world, self._settings = ctx, world, settings
        scene = world.scene
        self.stored = int(np.ceil(scene.sowing.density_per_m2 * settings.patch_m**2)) if scene.grass else 0
        limit = ctx.info["GL_MAX_SHADER_STORAGE_BLOCK_SIZE"] // (4 * _STORED_FLOATS)
        if self.stored > limit:
            raise InputError(
                f"technique.patch_m: must leave at most {limit / 1e6:.1f} million blades to a patch on this driver "
                f"(got {self.stored / 1e6:.1f} million); lower it or sowing.density_per_m2"
            )
        self._patch = ctx.buffer(_stored(self.stored, scene.seed))
        self._places = ctx.buffer(reserve=8)
        self._grid = self._grid_of(settings.patch_m)
        self._views: tuple[View, ...] = ()
        self.groups: dict[View, list[Group]] = {}

    def _grid_of(self, patch_m: float) -> Grid:
        world, scene = self._world, self._world.scene
        heights = world.ground.heights
        if scene.ground.beyond == "bare":
            columns, rows = (int(np.ceil(0.5 * edge / patch_m)) for edge in scene.ground.size_m)
        else:
            columns = rows = _EACH_WAY
        tallest = world.field.tallest_m
        return Grid(
            patch_m,
            (-columns, -rows),
            (columns, rows),
            (heights.lowest_m - tallest, heights.highest_m + tallest),
            tallest + 0.5 * scene.sowing.clump_m,
        )

    @property
    def nbytes(self) -> int:
        """GPU memory in bytes."""
        return self._patch.size + self._places.size

    def place(self, views: Sequence[View]) -> None:
        """Find where each view shows the patch, if the views have changed."""
        if tuple(views) == self._views:
            return
        self._views, self.groups = tuple(views), {}
        places: list[np.ndarray] = []
        at = 0
        nodes, shown, away = patches_in_view(self._grid, views, views[0].camera_ws, self._world.scene.sowing.blades_m)
        for view, mask in zip(views, shown, strict=True):
            nearest = np.nonzero(mask)[0][np.argsort(away[mask], kind="stable")]
            needed = self._needed(away[nearest], view)
            halvings = np.floor(-np.log2(np.maximum(needed, 1e-9))).astype(np.int64)
            halvings = np.minimum(halvings, self._settings.densities - 1)
            self.groups[view] = []
            for step in range(self._settings.densities):
                mine = nearest[(halvings == step) & (needed > 0.0)]
                blades = -(-self.stored // (1 << step))
                if len(mine) and blades:
                    self.groups[view].append(Group(at, len(mine), blades))
                    places.append(nodes[mine])
                    at += len(mine)
        if at * self.stored > _MOST_IDS:
            raise InputError(
                f"technique.patch_m: {at:,} patches of {self.stored:,} blades are more than ids are for; "
                "lower sowing.density_per_m2 or sowing.reach_m"
            )
        if places:
            self._places = at_least(self._ctx, self._places, 8 * at)
            rewrite(self._places, np.concatenate(places).astype(np.int32))

    def _needed(self, away: np.ndarray, view: View) -> np.ndarray:
        """Part of the patch that a view needs at a distance: the scene's level of detail, then section 6.3's."""
        scene, settings = self._world.scene, self._settings
        kept = 1.0 - settings.thinning * np.minimum(away / scene.sowing.reach_m, 1.0)
        kept = np.minimum(kept * (1.0 + FADING), 1.0) if settings.thinning else kept
        if scene.culling.distance:
            kept = np.minimum(kept, (scene.sowing.full_density_m / np.maximum(away, 1e-3)) ** 2)
        return np.minimum(kept, 1.0) * (view.density if scene.culling.distance else float(view.density > 0.0))

    def bind(self) -> None:
        """Bind the patch and its places."""
        self._patch.bind_to_storage_buffer(PATCH)
        self._places.bind_to_storage_buffer(PLACES)

    def release(self) -> None:
        """Free the GPU memory."""
        self._patch.release()
        self._places.release()


def _stored(count: int, seed: int) -> np.ndarray:
    """Blades of a patch of edge 1: x and z, even in any prefix, and eight random values, float32 (count, 10)."""
    random = np.random.default_rng([seed, 2013])
    # as in sowing/ground_blade.glsl: an additive recurrence, jittered by the spacing of the points so far
    index = np.arange(count)[:, None]
    even = index * np.array([0.7548776662466927, 0.5698402909980532]) + random.random(2)
    jitter = (random.random((count, 2)) - 0.5) * 1.4 / np.sqrt(index + 1.0)
    table = np.empty((max(count, 1), _STORED_FLOATS), np.float32)
    table[:count, :2] = (even + jitter) % 1.0
    table[:count, 2:] = random.random((count, 8))
    return table
