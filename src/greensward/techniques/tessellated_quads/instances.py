"""Places at which one stored patch of blades is drawn."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from greensward.culling import CHUNK
from greensward.gpu.buffers import at_least, upload
from greensward.gpu.device import Device
from greensward.gpu.kernels import Resource
from greensward.gpu.view import View
from greensward.scene import InputError
from greensward.sowing.identity import MOST_OF_A_PATCH, BladeKind, Ids, blade_ids
from greensward.sowing.pattern import PATTERN_ROOT, Grid, patches_in_view, pattern_of
from greensward.techniques.tessellated_quads.settings import QuadSettings
from greensward.world import World

FADING = 0.12
"""Part of all ranks over which blades that thinning leaves out next are narrower. The shaders are built with it."""
_PLACE = np.dtype((np.int32, 2))
_EACH_WAY = 1 << 19
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
    """The pattern, stored once, and for each view the places where it shows, by density."""

    def __init__(self, device: Device, world: World, settings: QuadSettings, tallest_m: float) -> None:
        self.tallest_m = tallest_m
        """Farthest that anything of a blade is from its root."""
        self._device, self._world, self._settings = device, world, settings
        scene = world.scene
        grows = bool(scene.grass) and world.ground.heights.exists
        density_per_m2 = scene.sowing.density_per_m2 * settings.most_density
        self.stored = int(np.ceil(density_per_m2 * settings.patch_m**2)) if grows else 0
        limit = min(device.limits.storage_block_bytes // PATTERN_ROOT.dtype.itemsize, MOST_OF_A_PATCH)
        if self.stored > limit:
            raise InputError(
                f"technique.patch_m: must leave at most {limit / 1e6:.1f} million blades to a patch on this driver "
                f"(got {self.stored / 1e6:.1f} million); lower it or sowing.density_per_m2"
            )
        self._patch = device.ctx.buffer(pattern_of(self.stored, scene.seed))
        self._places = device.ctx.buffer(reserve=_PLACE.itemsize)
        self._grid = self._grid_of(settings.patch_m)
        self._views: tuple[View, ...] = ()
        self.groups: dict[View, list[Group]] = {}
        self._listed = np.zeros((0, 2), np.int32)
        """Column and row of the patch at each place."""

    def _grid_of(self, patch_m: float) -> Grid:
        world, scene = self._world, self._world.scene
        heights = world.ground.heights
        if scene.ground.beyond == "bare":
            columns, rows = (int(np.ceil(0.5 * edge / patch_m)) for edge in heights.size_m)
        else:
            columns = rows = _EACH_WAY
        tallest = self.tallest_m
        return Grid(
            patch_m,
            (-columns, -rows),
            (columns, rows),
            (heights.lowest_m - tallest, heights.highest_m + tallest),
            tallest + 0.5 * scene.sowing.clump_m,
            heights,
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
        if self.first_number + at * self.stored > self._world.field.most_blades:
            raise InputError(
                f"technique.patch_m: {at:,} patches of {self.stored:,} blades are more than can be numbered; "
                "lower sowing.density_per_m2 or sowing.reach_m"
            )
        if places:
            self._places = at_least(self._device, self._places, _PLACE.itemsize * at)
            self._listed = np.concatenate(places).astype(np.int32)
            upload(self._device, self._places, self._listed)

    @property
    def first_number(self) -> int:
        """Number of the first blade of the first place: those of objects come before."""
        return self._world.field.next_number

    def identify(self, numbers: npt.NDArray[np.uint32]) -> Ids:
        """Find the permanent ids of blades by their numbers, counted through all places: uint64 (n,)."""
        place, index = np.divmod(numbers - np.uint32(self.first_number), np.uint32(self.stored))
        return blade_ids(BladeKind.PATCH, *self._listed[place].T, index)

    def _needed(self, away: np.ndarray, view: View) -> np.ndarray:
        """Part of the patch that a view needs at a distance: by the scene's level of detail, then by section 6.3."""
        scene, settings = self._world.scene, self._settings
        coverage = 1.0 - settings.thinning * np.minimum(away / scene.sowing.reach_m, 1.0)
        coverage = np.minimum(coverage * (1.0 + FADING), 1.0) if settings.thinning else coverage
        if scene.culling.distance:
            coverage = np.minimum(coverage, (scene.sowing.full_density_m / np.maximum(away, 1e-3)) ** 2)
        return np.minimum(coverage, 1.0) * (view.density if scene.culling.distance else float(view.density > 0.0))

    @property
    def bindings(self) -> dict[str, Resource]:
        """The pattern and its places, by their names in shaders."""
        return {"Patch": self._patch, "Places": self._places}

    def release(self) -> None:
        """Free the GPU memory."""
        self._patch.release()
        self._places.release()
