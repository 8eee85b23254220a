"""Field of blades on the GPU, in tiles of those that lie near each other."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import read_back, release_all
from greensward.gpu.device import Device
from greensward.gpu.kernels import Bindings, Kernel
from greensward.gpu.layouts import BlockBuffer
from greensward.gpu.memory import available_bytes
from greensward.ground.ground_gpu import GroundGpu
from greensward.scene import InputError, Scene
from greensward.sowing.blade import BLADE, FIRST_TRACED, MOST_BLADES, POSE
from greensward.sowing.clearings import sward_defines
from greensward.sowing.colour import GrassColours, colour_defines
from greensward.sowing.growth import cover_at
from greensward.sowing.identity import BladeKind, Ids, blade_ids
from greensward.sowing.objects import grassy_objects, sow_object
from greensward.sowing.pages import ID_BYTES, Floats, Page, Tiles, UnstoredPage, starts
from greensward.sowing.sower import TILE, Sower, Table
from greensward.sowing.species import SWARD_BLOCK, leaf_edge_m, sward_values
from greensward.sowing.streaming import Bounds, Mask, Order, StreamedPages, keys_of
from greensward.sowing.transform import BladeTransform

__all__ = ["Field", "Page", "Tiles"]

_SPLIT = 4.5
"""A tile is nowhere nearer than this times its edge, or it is split."""
_MOST_SPLIT = 2**19
"""Tiles of a level that are split at most: no field that fits into the numbers of blades has nearly as many."""
_FIX = "lower sowing.density_per_m2, sowing.reach_m, or sowing.full_density_m"


@dataclass(frozen=True)
class _Plan:
    """Step of the field to another focus."""

    focus: Floats
    missing: Table
    """Tiles to sow."""
    stays: Mask
    """Resident tiles that stay."""
    unstored: Table
    candidates: int
    """Candidates of the tiles to sow."""
    bounds: Bounds = (np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))
    """Those of the tiles to sow, once it has begun."""


class Field:
    """All blades within reach of a focus, thinned with distance from it, and those of all objects.

    Any prefix of a tile is a fair sample of it. The bounds of tiles leave room for what is drawn `beside` blades, in
    mean distances between them. `clearings` are those of the scene, by their names in shaders. Without `on_ground`
    only objects are sown; `density` is a factor on the scene's for the ground.
    """

    def __init__(
        self,
        device: Device,
        scene: Scene,
        ground: GroundGpu,
        beside: float = 0.0,
        clearings: Bindings | None = None,
        on_ground: bool = True,
        density: float = 1.0,
    ) -> None:
        self._device = device
        self._grows_on_ground, self._density = on_ground and ground.heights.exists, density
        scene = self._scene = self._denser(scene)
        self._ground = ground
        self._beside = beside
        self._on_objects: list[Page] = []
        self._plan: _Plan | None = None
        """Step that has begun."""
        self.most_blades = MOST_BLADES if scene.sowing.traced_m is None else FIRST_TRACED - 1
        """Greatest number of a blade, as those in pictures of grass have others."""
        self._anchor_ws = np.zeros(3)
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
        self._colours = GrassColours(device, scene)
        self.bindings: Bindings = {
            **ground.bindings,
            **self._colours.bindings,
            **(clearings or {}),
            "Sward": self._block,
        }
        """Ground, sward and its colours, by their names in shaders."""
        # a technique may keep records of its own for each blade, up to twice as large
        self._page_blades = min(device.limits.storage_block_bytes, 1 << 30) // (2 * BLADE.dtype.itemsize)
        defines = sward_defines(scene) if clearings else colour_defines(scene)
        self._sower = Sower(device, "sowing/sow.comp", self._page_blades, self.bindings, defines)
        self._on_ground = StreamedPages(device, self._sower, scene.growth is not None)
        self._unstored_keys: list[npt.NDArray[np.int64]] = []
        self._transform = BladeTransform(device, scene) if scene.growth or self._to_sow else None
        self._identify: dict[bool, Kernel] = {}
        """Kernel for pages that are not stored and for those that are, once asked for."""

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
        again: bool = False,
    ) -> bool:
        """Make the tiles around a focus resident, good for cameras up to `slack_m` from it; those that are stay.

        Objects are sown the first time only. `before` is called with the tiles that are about to go, by page. With
        `again` none stays, as after `count_from`. Returns whether anything changed. Raises `InputError` where the
        device's memory cannot hold the blades.
        """
        focus = np.asarray(focus_ws, np.float64)
        plan, self._plan = self._plan, None
        if plan is None or again or not np.array_equal(plan.focus, focus):
            plan = self._planned(focus, slack_m, again)
            # where none stays, those that go leave their room
            self._refuse_too_many(plan, slack_m, self._on_ground.capacity if again else 0)
            plan = self._begun(plan)
        changed = bool(len(plan.missing) or not plan.stays.all() or self._to_sow)
        if changed:
            if before:
                before(self._on_ground.dropped(plan.stays))
            self._sow_objects()
            self._on_ground.replace(
                plan.missing,
                plan.stays,
                plan.bounds,
                lambda: self.next_number,
                self._refuse_numbers,
                keep=again,
            )
            if self._transform:
                self._transform.forget_ground()
        return self._leave_to_shaders(plan.unstored) or changed

    def prepare(self, focus_ws: npt.ArrayLike, slack_m: float) -> None:
        """Begin what `sow` will do around a focus, if that takes no more memory; it is done sooner then."""
        focus = np.asarray(focus_ws, np.float64)
        if self._to_sow or (self._plan and np.array_equal(self._plan.focus, focus)):
            return
        plan = self._planned(focus, slack_m)
        if plan.candidates <= self._on_ground.free:
            self._plan = self._begun(plan)

    def _planned(self, focus: Floats, slack_m: float, again: bool = False) -> _Plan:
        tiles, unstored = self._tiles(focus, slack_m, self._scene.sowing.full_density_m)
        tiles = tiles[np.argsort(keys_of(tiles), kind="stable")]
        new, stays = self._on_ground.missing(tiles)
        if again:
            new[:], stays[:] = True, False
        missing = tiles[new]
        return _Plan(focus, missing, stays, unstored, int(missing["candidates"].sum()))

    def _begun(self, plan: _Plan) -> _Plan:
        if not len(plan.missing):
            return plan
        self._sower.count(plan.missing)
        # while the GPU counts
        return replace(plan, bounds=self._bounds(plan.missing))

    def count_from(self, anchor_ws: Floats) -> None:
        """Count points of the world from an anchor (3,) from the next sowing on, which must be of all."""
        at, sowing = anchor_ws[[0, 2]], self._scene.sowing
        clumps = at / sowing.clump_m
        self._block.set(
            anchor_leaf=(at / leaf_edge_m(sowing.density_per_m2)).astype(np.int32),
            anchor_clump=np.floor(clumps).astype(np.int32),
            in_clump=clumps - np.floor(clumps),
        )
        self._anchor_ws = anchor_ws

    def order(self) -> Order:
        """Order the blades: those of objects as they lie, then those of the ground by their tiles' places."""
        objects, ground = self._on_objects, self._on_ground.order()
        return Order(
            np.concatenate([*(np.full(page.count, i) for i, page in enumerate(objects)), ground.page + len(objects)]),
            np.concatenate([*(np.arange(page.count) for page in objects), ground.row]),
            np.concatenate([*(page.tiles.serial for page in objects), ground.serial]),
        )

    def identify(self, numbers: npt.NDArray[np.uint32]) -> Ids:
        """Find the permanent ids of blades by their numbers in this frame: uint64 (n,). Waits for the GPU."""
        ids = np.zeros(len(numbers), np.uint64)
        before, index = 0, None
        pages: list[Page | UnstoredPage] = [*self.pages, *([self.unstored] if self.unstored else [])]
        for page in pages:
            mine = (numbers >= page.first_number) & (numbers - page.first_number < page.capacity)
            rows = numbers[mine] - page.first_number
            if page.object_index is None:
                ids[mine] = self._ids_of(page, rows)
                continue
            before = before if page.object_index == index else 0
            index = page.object_index
            ids[mine] = blade_ids(BladeKind.OBJECT, index, 0, before + rows.astype(np.int64))
            before += page.capacity
        return ids

    def stored(self, number: int) -> tuple[np.void, npt.NDArray[np.float64], int | None] | None:
        """Read back a stored blade by its number: its row, its root in the world and the object that it grows on.

        None for a number that no stored blade has. Waits for the GPU.
        """
        for page in self.pages:
            at = number - page.first_number
            if 0 <= at < page.capacity:
                size = BLADE.dtype.itemsize
                row = np.frombuffer(read_back(self._device, page.blades, size, at * size), BLADE.dtype)[0]
                return row, np.array([row["x"], row["y"], row["z"]], np.float64) + self._anchor_ws, page.object_index
        return None

    def number_of(self, blade_id: int) -> int:
        """Find the number of the blade with a permanent id; 0 if it is not stored. Waits for the GPU."""
        kind = blade_id >> 60
        if kind == BladeKind.GROUND:
            for page in self.pages:
                if page.ids is not None:
                    # what a freed slot held is still there; only rows of tiles count
                    rows = page.tiles.rows()
                    ids = np.frombuffer(read_back(self._device, page.ids), np.uint64)[rows]
                    if len(found := np.flatnonzero(ids == np.uint64(blade_id))):
                        return page.first_number + int(rows[found[0]])
        if kind == BladeKind.OBJECT:
            index, left = blade_id >> 48 & 0xFFF, blade_id & ((1 << 44) - 1)
            for page in self.pages:
                if page.object_index == index:
                    if left < page.count:
                        return page.first_number + int(left)
                    left -= page.capacity
        return 0

    def _ids_of(self, page: Page | UnstoredPage, rows: npt.NDArray[np.uint32]) -> Ids:
        if not len(rows):
            return np.zeros(0, np.uint64)
        numbers, found = self._device.ctx.buffer(rows), self._device.ctx.buffer(reserve=ID_BYTES * len(rows))
        named = {"Ids": page.ids} if isinstance(page, Page) else page.bindings
        unstored = isinstance(page, UnstoredPage)
        if unstored not in self._identify:
            defines = {"UNSTORED": 1} if unstored else {}
            self._identify[unstored] = Kernel(self._device, "sowing/identify.comp", defines, self.bindings)
        kernel = self._identify[unstored]
        kernel.run_over(len(rows), Numbers=numbers, Found=found, count=len(rows), **named)
        self._device.ctx.memory_barrier()
        ids = np.frombuffer(found.read(), np.uint64)
        release_all(numbers, found)
        return ids

    @property
    def next_number(self) -> int:
        """First number that no page has; 1 is the first of all."""
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
            self.next_number,
        )
        self._refuse_numbers(page.count)
        return page

    def _sow_objects(self) -> None:
        if not self._to_sow:
            return
        sower = Sower(self._device, "sowing/sow_object.comp", self._page_blades, self.bindings)
        while self._to_sow:
            grassy = self._to_sow.pop(0)
            self._on_objects += sow_object(
                self._device,
                sower,
                grassy,
                self._page_blades,
                self._margin_m(grassy.density_per_m2),
                self.next_number,
            )
        sower.release()

    def change_colours(self, scene: Scene) -> None:
        """Colour the blades as another scene has it, whose species and noises differ in colours only."""
        self._scene = self._denser(scene)
        self._colours.change(scene)
        self._block.set(species=sward_values(scene)["species"])  # type: ignore[arg-type]

    def _denser(self, scene: Scene) -> Scene:
        if self._density == 1.0:
            return scene
        density = {"density_per_m2": self._density * scene.sowing.density_per_m2}
        return scene.model_copy(update={"sowing": scene.sowing.model_copy(update=density)})

    def transform(self, placed: Floats, time_s: float) -> None:
        """Bring blades to where their objects are and to their age at a time; once per frame.

        `placed` is the rigid matrix of every object of the scene, world from own space, float64 (n, 4, 4).
        Does nothing where nothing has changed.
        """
        if self._transform:
            self._transform.update(self.pages, placed, time_s, self._anchor_ws)
        if self._scene.growth:
            self._block.set(grown=cover_at(self._scene.growth, time_s))

    def _tiles(self, focus: Floats, slack_m: float, full_density_m: float) -> tuple[Table, Table]:
        """Tiles within reach, each level twice as far and as large as the last: stored ones, and the others."""
        scene, sowing = self._scene, self._scene.sowing
        density, reach = sowing.density_per_m2, sowing.blades_m + slack_m
        if density <= 0 or not self._species_count or not self._grows_on_ground:
            return np.zeros(0, TILE.dtype), np.zeros(0, TILE.dtype)
        leaf = leaf_edge_m(density)
        # the largest that is not split wherever in the reach it lies
        level = max(0, int(np.ceil(np.log2(reach / (_SPLIT * leaf)))))
        size = leaf * 2.0**level
        middle_x, _, middle_z = focus
        x, z = (
            each.ravel()
            for each in np.meshgrid(
                *(np.arange((at - reach) // size, (at + reach) // size + 1.0) for at in (middle_x, middle_z))
            )
        )
        half = 0.5 * np.array(self._ground.heights.size_m) if scene.ground.beyond == "bare" else None
        found: list[tuple[Floats, Floats, Floats]] = []
        sizes = []
        while True:
            low_x, low_z = x * size, z * size
            away = np.hypot(_outside(low_x, middle_x, size), _outside(low_z, middle_z, size)) - slack_m
            keep = away <= sowing.blades_m
            if half is not None:
                keep &= (low_x < half[0]) & (low_x + size > -half[0]) & (low_z < half[1]) & (low_z + size > -half[1])
            split = keep & (away < _SPLIT * size) if level else np.zeros(len(x), np.bool_)
            if level and density * size * size > self._page_blades:
                split |= keep & (_candidates(away, size, density, full_density_m) > self._page_blades)
            left = keep & ~split
            found.append((x[left], z[left], away[left]))
            sizes.append(size)
            if not split.any():
                break
            if split.sum() > _MOST_SPLIT:
                self._refuse_numbers(float(_candidates(away, size, density, full_density_m)[keep].sum()), most=0)
            x, z = 2.0 * x[split], 2.0 * z[split]
            x, z = np.concatenate([x, x + 1.0, x, x + 1.0]), np.concatenate([z, z, z + 1.0, z + 1.0])
            level -= 1
            size *= 0.5
        x, z, away = (np.concatenate(each) for each in zip(*found, strict=True))
        counts = [len(each) for each, *_ in found]
        tiles = np.zeros(len(x), TILE.dtype)
        tiles["x"], tiles["z"] = x, z
        tiles["level"] = np.repeat(np.arange(level, level + len(counts))[::-1], counts)
        candidates = _candidates(away, np.repeat(sizes, counts), density, full_density_m)
        tiles["candidates"] = np.minimum(candidates, 0xFFFFFFFF)
        stored_m = sowing.stored_m
        stored = np.full(len(tiles), True) if stored_m is None else np.maximum(away, 0.0) < stored_m
        return tiles[stored], tiles[~stored]

    def _refuse_too_many(self, plan: _Plan, slack_m: float, room: int) -> None:
        """Refuse more blades than there is memory or are numbers for, where some must be made room for.

        `room` is for so many on pages whose blades go.
        """
        candidates, full_density_m = plan.candidates, self._scene.sowing.full_density_m
        if not self._to_sow and candidates <= max(self._on_ground.free, room):
            return
        ground = max(candidates * self._ground.mean_density - room, 0.0)
        objects = sum(each.blades() for each in self._to_sow)
        blades = ground + objects
        blade_bytes = BLADE.dtype.itemsize
        grown = blade_bytes if self._scene.growth else 0
        needed = blades * (blade_bytes + POSE.dtype.itemsize + ID_BYTES) + ground * grown + objects * blade_bytes
        free = available_bytes(self._device)
        most = min(self.most_blades, free * blades / max(needed, 1.0)) - objects
        fix = "lower the density_per_m2 of the grass on objects" if objects > ground else _FIX
        if objects <= ground and blades > most + objects:

            def fits(part: float) -> bool:
                stored, _ = self._tiles(plan.focus, slack_m, part * full_density_m)
                return bool(stored["candidates"].sum() * self._ground.mean_density <= most)

            part = _largest_part(fits)
            if part > 0.0:
                fix += f" to {part * full_density_m:.3g}"
        if needed > free:
            raise InputError(
                f"sowing: about {blades / 1e6:,.0f} million blades need {needed / 2**30:,.1f} GiB, "
                f"and this device can give {free / 2**30:,.1f} GiB; {fix}"
            )
        self._refuse_numbers(blades, fix)

    def _refuse_numbers(self, blades: float, fix: str = _FIX, most: int | None = None) -> None:
        blades += self.next_number - 1
        if blades > (self.most_blades if most is None else most):
            raise InputError(
                f"sowing: must be at most {self.most_blades / 1e6:,.0f} million blades "
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
        release_all(self._block, self._colours, self._sower, *self._identify.values())
        if self._transform:
            self._transform.release()


def _outside(low: Floats, at: float, size: float) -> Floats:
    """Distance from a coordinate to the range of each tile along the same axis."""
    result: Floats = np.maximum(np.maximum(low - at, at - size - low), 0.0)
    return result


def _candidates(away: Floats, size: Floats | float, density_per_m2: float, full_density_m: float) -> Floats:
    """Candidates of tiles so far away, in steps, so that a tile stays as it is while the camera moves."""
    halvings = np.floor(4.0 * np.log2(np.maximum(away / full_density_m, 1.0)))
    result: Floats = np.ceil(density_per_m2 * size * size * 2.0 ** (-0.5 * halvings))
    return result


def _largest_part(fits: Callable[[float], bool]) -> float:
    """Find by bisection the largest part of a whole, 0 to 1, that fits; 0 where it is below a thousandth."""
    low, high = 0.0, 1.0
    for _ in range(10):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low
