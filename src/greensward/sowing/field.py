"""Field of blades on the GPU, in tiles of those that lie near each other."""

import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import release_all
from greensward.gpu.device import Device
from greensward.gpu.kernels import Bindings
from greensward.gpu.layouts import BlockBuffer
from greensward.gpu.memory import available_bytes
from greensward.ground.ground_gpu import GroundGpu
from greensward.scene import InputError, Scene
from greensward.sowing.blade import BLADE, MOST_BLADES, POSE
from greensward.sowing.growth import cover_at
from greensward.sowing.objects import grassy_objects, sow_object
from greensward.sowing.pages import Floats, Page, Tiles, UnstoredPage, starts
from greensward.sowing.sower import TILE, Sower, Table
from greensward.sowing.species import SWARD_BLOCK, leaf_edge_m, sward_values
from greensward.sowing.transform import BladeTransform

__all__ = ["Field", "Page", "Tiles"]

_FIX = "lower sowing.density_per_m2, sowing.full_density_m or sowing.reach_m"


class Field:
    """All blades within reach of a focus, thinned with distance from it, and those of all objects.

    Any prefix of a tile is a fair sample of it.
    """

    def __init__(self, device: Device, scene: Scene, ground: GroundGpu) -> None:
        self._device = device
        self._scene = scene
        self._ground = ground
        self._on_objects: list[Page] = []
        self._on_ground: list[Page] = []
        self.unstored: UnstoredPage | None = None
        """Blades of the ground beyond `sowing.stored_m`, if any."""
        self._to_sow = grassy_objects(scene)
        values = sward_values(scene)
        self._species_count = values["count"]
        self.canopy_m = float(values["canopy_m"])  # type: ignore[arg-type]
        grown = max((factor for _, factor in scene.growth.height), default=1.0) if scene.growth else 1.0
        self.tallest_m = max((grass.height_m[1] for grass in scene.grass), default=0.0) * 1.7 * max(grown, 1.0)
        self._block = BlockBuffer(device.ctx, SWARD_BLOCK)
        self._block.set(**values)  # type: ignore[arg-type]
        self.bindings: Bindings = {**ground.bindings, "Sward": self._block}
        """Ground and sward, by their names in shaders."""
        # a technique may keep records of its own for each blade, up to twice as large
        self._page_blades = min(device.limits.storage_block_bytes, 1 << 30) // (2 * BLADE.dtype.itemsize)
        self._sower = Sower(device, "sowing/sow.comp", self._page_blades, self.bindings)
        self._transform = BladeTransform(device, scene) if scene.growth or self._to_sow else None

    @property
    def pages(self) -> list[Page]:
        """Pages of objects, which stay, and then those of the ground."""
        return self._on_objects + self._on_ground

    @property
    def count(self) -> int:
        """Number of blades that are stored."""
        return sum(page.count for page in self.pages)

    def sow(self, focus_ws: npt.ArrayLike, slack_m: float) -> None:
        """Sow the ground anew around a focus, good for cameras up to `slack_m` from it; objects the first time only.

        Raises `InputError` where the device's memory cannot hold the blades.
        """
        focus = np.asarray(focus_ws, np.float64)
        self._forget()
        tiles, away = self._tiles(focus, slack_m)
        stored_m = self._scene.sowing.stored_m
        stored = np.full(len(tiles), True) if stored_m is None else away < stored_m
        unstored = tiles[~stored]
        tiles = tiles[stored]
        self._refuse_too_many(int(tiles["candidates"].sum()))
        self._sow_objects()
        if len(tiles):
            *boxes, coverage = self._bounds(tiles)
            uniforms, first_id = {"focus": (*focus, slack_m)}, self.count + 1
            growing = self._scene.growth is not None
            self._on_ground = self._sower.sow(
                tiles, (boxes[0], boxes[1]), coverage, uniforms, first_id, transformed=growing
            )
        if len(unstored):
            self.unstored = self._left_to_shaders(unstored)

    def _left_to_shaders(self, tiles: Table) -> UnstoredPage:
        low, high, coverage = self._bounds(tiles)
        candidates = tiles["candidates"].astype(np.int64)
        up_to = -(-candidates[:, None] * np.arange(1, 9) // 8)
        none = np.zeros(len(tiles), np.int64)
        lying = np.column_stack([tiles["x"], tiles["z"], tiles["level"]])
        page = UnstoredPage(
            self._device,
            Tiles(low, high, coverage, starts(-(-candidates // 32) * 32), up_to, none, none),
            lying,
            self.count + 1,
        )
        self._refuse_ids(page.count)
        return page

    def _sow_objects(self) -> None:
        if not self._to_sow:
            return
        sower = Sower(self._device, "sowing/sow_object.comp", self._page_blades, self.bindings)
        while self._to_sow:
            grassy, first_id = self._to_sow.pop(0), self.count + 1
            self._on_objects += sow_object(self._device, sower, grassy, self._page_blades, self.tallest_m, first_id)
        sower.release()

    def change_colours(self, scene: Scene) -> None:
        """Colour the blades as another scene has it, whose species differ in colours only."""
        self._scene = scene
        self._block.set(species=sward_values(scene)["species"])  # type: ignore[arg-type]

    def transform(self, placed: Floats, time_s: float) -> None:
        """Bring blades to where their objects are and to their age at a time; once per frame.

        `placed` is the rigid matrix of every object of the scene, world from own space, float64 (n, 4, 4).
        Does nothing where nothing has changed.
        """
        if self._transform:
            self._transform.update(self.pages, placed, time_s)
        if self._scene.growth:
            self._block.set(grown=cover_at(self._scene.growth, time_s))

    def _tiles(self, focus: Floats, slack_m: float) -> tuple[Table, Floats]:
        """Tiles that touch the reach, and how far they are: each level twice as far and as large as the last."""
        scene, sowing = self._scene, self._scene.sowing
        density, reach = sowing.density_per_m2, sowing.blades_m + slack_m
        if density <= 0 or not self._species_count or scene.ground.kind == "none":
            return np.zeros(0, TILE.dtype), np.zeros(0)
        leaf = leaf_edge_m(density)
        level = max(0, int(np.ceil(np.log2(2.0 * reach / leaf))))
        size = leaf * 2.0**level
        corner = np.floor((focus[[0, 2]] - reach) / size)
        xz = np.stack(np.meshgrid(*(corner[i] + np.arange(2) for i in (0, 1)), indexing="ij"), -1)
        xz = xz.reshape(-1, 2).astype(np.int64)
        found, distances = [], []
        while True:
            low = xz * size
            beside = np.maximum(np.maximum(low - focus[[0, 2]], focus[[0, 2]] - low - size), 0.0)
            away = np.maximum(np.hypot(beside[:, 0], beside[:, 1]) - slack_m, 0.0)
            keep = away <= sowing.blades_m
            if scene.ground.beyond == "bare":
                half = 0.5 * np.array(scene.ground.size_m)
                keep &= np.all((low < half) & (low + size > -half), axis=1)
            xz, away = xz[keep], away[keep]
            coverage = np.minimum(1.0, (sowing.full_density_m / np.maximum(away, 1e-3)) ** 2)
            split = ((away < 3.0 * size) | (density * size * size * coverage > self._page_blades)) & (level > 0)
            whole = ~split
            coverage = coverage[whole]
            tiles = np.zeros(int(whole.sum()), TILE.dtype)
            tiles["x"], tiles["z"], tiles["level"] = xz[whole, 0], xz[whole, 1], level
            tiles["candidates"] = np.minimum(np.ceil(density * size * size * coverage), 0xFFFFFFFF)
            found.append(tiles)
            distances.append(away[whole])
            if not split.any():
                return np.concatenate(found), np.concatenate(distances)
            quarter = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
            xz = (2 * xz[split][:, None, :] + quarter).reshape(-1, 2)
            level -= 1
            size *= 0.5

    def _refuse_too_many(self, candidates: int) -> None:
        ground, objects = candidates * self._ground.mean_density, sum(each.blades() for each in self._to_sow)
        blades = ground + objects
        blade_bytes = BLADE.dtype.itemsize
        grown = blade_bytes if self._scene.growth else 0
        needed = blades * (blade_bytes + POSE.dtype.itemsize) + ground * grown + objects * blade_bytes
        free = available_bytes(self._device)
        fix = "lower the density_per_m2 of the grass on objects" if objects > ground else _FIX
        if needed > free:
            raise InputError(
                f"sowing: about {blades / 1e6:,.0f} million blades need {needed / 2**30:,.1f} GiB, "
                f"and this device can give {free / 2**30:,.1f} GiB; {fix}"
            )
        self._refuse_ids(blades, fix)

    def _refuse_ids(self, blades: float, fix: str = _FIX) -> None:
        blades += self.count
        if blades > MOST_BLADES:
            raise InputError(
                f"sowing: must be at most {MOST_BLADES / 1e6:,.0f} million blades "
                f"(got about {blades / 1e6:,.0f} million); {fix}"
            )

    def _bounds(self, tiles: Table) -> tuple[Floats, Floats, Floats]:
        sowing = self._scene.sowing
        size = leaf_edge_m(sowing.density_per_m2) * 2.0 ** tiles["level"]
        x0, z0 = tiles["x"] * size, tiles["z"] * size
        low, high = np.empty((len(tiles), 3)), np.empty((len(tiles), 3))
        for level in np.unique(tiles["level"]):
            at = tiles["level"] == level
            low[at, 1], high[at, 1] = self._ground.heights.height_range(x0[at], z0[at], float(size[at][0]))
        # clumps pull roots, and blades lean, across the edge of a tile
        margin = self.tallest_m + 0.5 * sowing.clump_m
        low[:, 0], high[:, 0] = x0 - margin, x0 + size + margin
        low[:, 2], high[:, 2] = z0 - margin, z0 + size + margin
        low[:, 1] -= self.tallest_m
        high[:, 1] += self.tallest_m
        return low, high, tiles["candidates"] / (sowing.density_per_m2 * size * size)

    @property
    def nbytes(self) -> int:
        """GPU memory of the blades and their poses in bytes."""
        return sum(page.nbytes for page in self.pages) + (self.unstored.nbytes if self.unstored else 0)

    def _forget(self) -> None:
        release_all(*self._on_ground)
        self._on_ground = []
        if self.unstored:
            self.unstored.release()
        self.unstored = None

    def release(self) -> None:
        """Free the GPU memory."""
        self._forget()
        release_all(*self._on_objects)
        self._on_objects = []
        self._block.release()
        self._sower.release()
        if self._transform:
            self._transform.release()
