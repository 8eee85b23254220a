"""Field of blades on the GPU, in tiles of those that lie near each other."""

from collections.abc import Callable, Sequence

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
from greensward.sowing.streaming import Order, StreamedPages, keys_of
from greensward.sowing.transform import BladeTransform

__all__ = ["Field", "Page", "Tiles"]

_SPLIT = 4.5
"""A tile is nowhere nearer than this times its edge, or it is split."""
_FIX = "lower sowing.density_per_m2, sowing.full_density_m or sowing.reach_m"


class Field:
    """All blades within reach of a focus, thinned with distance from it, and those of all objects.

    Any prefix of a tile is a fair sample of it. The bounds of tiles leave room for what is drawn `beside` blades, in
    mean distances between them.
    """

    def __init__(self, device: Device, scene: Scene, ground: GroundGpu, beside: float = 0.0) -> None:
        self._device = device
        self._scene = scene
        self._ground = ground
        self._beside = beside
        self._on_objects: list[Page] = []
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
        self._on_ground = StreamedPages(device, self._sower, scene.growth is not None)
        self._unstored_keys: list[npt.NDArray[np.int64]] = []
        self._transform = BladeTransform(device, scene) if scene.growth or self._to_sow else None

    @property
    def pages(self) -> list[Page]:
        """Pages of objects, which stay, and then those of the ground."""
        return self._on_objects + self._on_ground.pages

    @property
    def count(self) -> int:
        """Number of blades that are stored."""
        return sum(page.count for page in self.pages)

    def sow(
        self,
        focus_ws: npt.ArrayLike,
        slack_m: float,
        before: Callable[[Sequence[tuple[Page, Tiles]]], None] | None = None,
    ) -> bool:
        """Make the tiles around a focus resident, good for cameras up to `slack_m` from it; those that are stay.

        Objects are sown the first time only. `before` is called with the tiles that are about to go, by page. Returns
        whether anything changed. Raises `InputError` where the device's memory cannot hold the blades.
        """
        focus = np.asarray(focus_ws, np.float64)
        tiles, away = self._tiles(focus, slack_m)
        stored_m = self._scene.sowing.stored_m
        stored = np.full(len(tiles), True) if stored_m is None else away < stored_m
        unstored = tiles[~stored]
        tiles = tiles[stored]
        tiles = tiles[np.argsort(keys_of(tiles), kind="stable")]
        new, stays = self._on_ground.missing(tiles)
        changed = bool(new.any() or not stays.all() or self._to_sow)
        if changed:
            missing = tiles[new]
            candidates = int(missing["candidates"].sum())
            if self._to_sow or candidates > self._on_ground.free:
                self._refuse_too_many(candidates)
            if before:
                before(self._on_ground.dropped(stays))
            self._sow_objects()
            self._on_ground.replace(missing, stays, self._bounds(missing), self._next_id, self._refuse_ids)
            if self._transform:
                self._transform.forget_ground()
        return self._leave_to_shaders(unstored) or changed

    def order(self) -> Order:
        """Order the blades: those of objects as they lie, then those of the ground by their tiles' places."""
        objects, ground = self._on_objects, self._on_ground.order()
        return Order(
            np.concatenate([*(np.full(page.count, i) for i, page in enumerate(objects)), ground.page + len(objects)]),
            np.concatenate([*(np.arange(page.count) for page in objects), ground.row]),
            np.concatenate([*(page.tiles.serial for page in objects), ground.serial]),
        )

    def _next_id(self) -> int:
        """First id that no page has; 1 is the first of all."""
        return 1 + sum(page.capacity for page in self.pages)

    def _leave_to_shaders(self, tiles: Table) -> bool:
        keys = [keys_of(tiles), tiles["candidates"].astype(np.int64)]
        if self._unstored_keys and all(map(np.array_equal, keys, self._unstored_keys)):
            return False
        changed, self._unstored_keys = bool(len(tiles)) or self.unstored is not None, keys
        if self.unstored:
            self.unstored.release()
        self.unstored = self._left_to_shaders(tiles) if len(tiles) else None
        return changed

    def _left_to_shaders(self, tiles: Table) -> UnstoredPage:
        low, high, coverage = self._bounds(tiles)
        candidates = tiles["candidates"].astype(np.int64)
        up_to = -(-candidates[:, None] * np.arange(1, 9) // 8)
        none = np.zeros(len(tiles), np.int64)
        lying = np.column_stack([tiles["x"], tiles["z"], tiles["level"]])
        page = UnstoredPage(
            self._device,
            Tiles(low, high, coverage, starts(-(-candidates // 32) * 32), up_to, none, none, none),
            lying,
            self._next_id(),
        )
        self._refuse_ids(page.count)
        return page

    def _sow_objects(self) -> None:
        if not self._to_sow:
            return
        sower = Sower(self._device, "sowing/sow_object.comp", self._page_blades, self.bindings)
        while self._to_sow:
            grassy = self._to_sow.pop(0)
            self._on_objects += sow_object(
                self._device, sower, grassy, self._page_blades, self._margin_m(grassy.density_per_m2), self._next_id()
            )
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
        found: list[tuple[npt.NDArray[np.int64], int, Floats, Floats]] = []
        half = 0.5 * np.array(scene.ground.size_m) if scene.ground.beyond == "bare" else None
        quarter = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
        middle = focus[[0, 2]]
        while True:
            low = xz * size
            beside = np.maximum(np.maximum(low - middle, middle - low - size), 0.0)
            away = np.maximum(np.hypot(beside[:, 0], beside[:, 1]) - slack_m, 0.0)
            keep = away <= sowing.blades_m
            if half is not None:
                keep &= np.all((low < half) & (low + size > -half), axis=1)
            xz, away = xz[keep], away[keep]
            # in steps, so that a tile stays as it is while the camera moves
            halvings = np.floor(4.0 * np.log2(np.maximum(away / sowing.full_density_m, 1.0)))
            candidates = np.ceil(density * size * size * 2.0 ** (-0.5 * halvings))
            split = ((away < _SPLIT * size) | (candidates > self._page_blades)) & (level > 0)
            found.append((xz[~split], level, candidates[~split], away[~split]))
            if not split.any():
                break
            xz = (2 * xz[split][:, None, :] + quarter).reshape(-1, 2)
            level -= 1
            size *= 0.5
        places, levels, counts, distances = zip(*found, strict=True)
        tiles = np.zeros(sum(map(len, counts)), TILE.dtype)
        tiles["x"], tiles["z"] = np.concatenate(places).T
        tiles["level"] = np.repeat(levels, [len(each) for each in counts])
        tiles["candidates"] = np.minimum(np.concatenate(counts), 0xFFFFFFFF)
        return tiles, np.concatenate(distances)

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
        blades += self._next_id() - 1
        if blades > MOST_BLADES:
            raise InputError(
                f"sowing: must be at most {MOST_BLADES / 1e6:,.0f} million blades "
                f"(got about {blades / 1e6:,.0f} million); {fix}"
            )

    def _margin_m(self, density_per_m2: float) -> float:
        """Greatest distance from a root at which anything is drawn for it, on land no steeper than 2 to 1."""
        return self.tallest_m + 2.0 * self._beside / float(np.sqrt(density_per_m2))

    def _bounds(self, tiles: Table) -> tuple[Floats, Floats, Floats]:
        sowing = self._scene.sowing
        size = leaf_edge_m(sowing.density_per_m2) * 2.0 ** tiles["level"]
        x0, z0 = tiles["x"] * size, tiles["z"] * size
        low, high = np.empty((len(tiles), 3)), np.empty((len(tiles), 3))
        low[:, 1], high[:, 1] = self._ground.heights.height_range(x0, z0, size)
        # clumps pull roots, and blades lean, across the edge of a tile
        rise = self._margin_m(sowing.density_per_m2)
        margin = rise + 0.5 * sowing.clump_m
        low[:, 0], high[:, 0] = x0 - margin, x0 + size + margin
        low[:, 2], high[:, 2] = z0 - margin, z0 + size + margin
        low[:, 1] -= rise
        high[:, 1] += rise
        return low, high, tiles["candidates"] / (sowing.density_per_m2 * size * size)

    @property
    def nbytes(self) -> int:
        """GPU memory of the blades and their poses in bytes."""
        return sum(page.nbytes for page in self.pages) + (self.unstored.nbytes if self.unstored else 0)

    def release(self) -> None:
        """Free the GPU memory."""
        self._on_ground.release()
        if self.unstored:
            self.unstored.release()
        self.unstored = None
        release_all(*self._on_objects)
        self._on_objects = []
        self._block.release()
        self._sower.release()
        if self._transform:
            self._transform.release()
