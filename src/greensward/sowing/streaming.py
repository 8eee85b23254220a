"""Tiles of the ground that are resident on the GPU: new ones are sown into room that others have left."""

from bisect import bisect
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import clear, release_all
from greensward.gpu.device import Device
from greensward.sowing.pages import Floats, Indices, Page, Tiles, page_numbers
from greensward.sowing.sower import Sower, Table

_ROOM = 0.25
"""Part of the blades for which pages have room besides."""
_LEAST_ROOM = 4096
Mask = npt.NDArray[np.bool_]
Bounds = tuple[Floats, Floats, Floats]
"""Lowest and highest corner of each tile, (n, 3), and the part of its blades that its candidates are, (n,)."""
_TILES = ("low", "high", "coverage", "start", "up_to", "head_start", "heads", "serial")
# one array for all that is known of a tile, as it is indexed and joined as a whole
_ROW = np.dtype(
    [
        ("key", np.int64),
        ("candidates", np.int64),
        ("page", np.int64),  # -1 where nothing grows
        ("low", np.float64, 3),
        ("high", np.float64, 3),
        ("coverage", np.float64),
        ("start", np.int64),
        ("up_to", np.int64, 8),
        ("head_start", np.int64),
        ("heads", np.int64),
        ("serial", np.int64),
    ]
)
# structured rows are copied field by field, five times as slowly as what they are bytes of
_BYTES = np.dtype((np.void, _ROW.itemsize))


@dataclass(frozen=True)
class Order:
    """Blades and tiles of a field in an order that does not depend on where they found room."""

    page: Indices
    """Index of the page of each blade, (blades,)."""
    row: Indices
    """Index of each blade within its page, (blades,)."""
    serial: Indices
    """Serial number of each tile, (tiles,)."""


class Room:
    """Free ranges of a buffer: first fit, and neighbours that are both free become one."""

    def __init__(self, capacity: int) -> None:
        self._starts, self._sizes = [0], [capacity]

    @property
    def free(self) -> int:
        """Number of items that are free."""
        return sum(self._sizes)

    def take(self, count: int) -> int | None:
        """Return where a range of so many items begins; None where there is none."""
        for i, free in enumerate(self._sizes):
            if free >= count:
                start = self._starts[i]
                if free == count:
                    del self._starts[i], self._sizes[i]
                else:
                    self._starts[i], self._sizes[i] = start + count, free - count
                return start
        return None

    def give(self, start: int, count: int) -> None:
        """Give back the range of so many items that begins here."""
        if not count:
            return
        i = bisect(self._starts, start)
        if i < len(self._starts) and start + count == self._starts[i]:
            count += self._sizes.pop(i)
            del self._starts[i]
        if i and self._starts[i - 1] + self._sizes[i - 1] == start:
            self._sizes[i - 1] += count
        else:
            self._starts.insert(i, start)
            self._sizes.insert(i, count)


def keys_of(tiles: Table) -> Indices:
    """One whole number for the level and the place of each tile."""
    side = 1 << 28
    place = (tiles["x"].astype(np.int64) + side) << 29 | (tiles["z"].astype(np.int64) + side)
    return tiles["level"].astype(np.int64) << 58 | place


class StreamedPages:
    """Pages of the ground's blades, whose tiles come and go."""

    def __init__(self, device: Device, sower: Sower, transformed: bool) -> None:
        self._device, self._sower, self._transformed = device, sower, transformed
        self.pages: list[Page] = []
        self._rooms: list[tuple[Room, Room]] = []
        """Room for blades and for heads, by page."""
        self._resident = np.zeros(0, _ROW)
        """Tiles that are sown, sorted by key."""
        self._serial = 0

    @property
    def free(self) -> int:
        """Number of blades that pages have room for, at most."""
        return sum(blades.free for blades, _ in self._rooms)

    @property
    def capacity(self) -> int:
        """Number of blades that all pages hold at most."""
        return sum(page.capacity for page in self.pages)

    def order(self) -> Order:
        """Order the blades by the places of their tiles."""
        grown = _some(self._resident, self._resident["page"] >= 0)
        tiles = _tiles(grown)
        return Order(np.repeat(grown["page"], tiles.up_to[:, 7]), tiles.rows(), tiles.serial)

    def missing(self, tiles: Table) -> tuple[Mask, Mask]:
        """Compare wanted tiles, sorted by key, with the resident ones: those to sow, and those that stay."""
        keys, candidates, old = keys_of(tiles), tiles["candidates"].astype(np.int64), self._resident
        return (
            ~_same(keys, candidates, old["key"], old["candidates"]),
            _same(old["key"], old["candidates"], keys, candidates),
        )

    def dropped(self, stays: Mask) -> list[tuple[Page, Tiles]]:
        """Resident tiles that do not stay, by page."""
        gone = _some(self._resident, ~stays)
        return [(page, _tiles(_some(gone, gone["page"] == number))) for number, page in enumerate(self.pages)]

    def replace(
        self,
        tiles: Table,
        stays: Mask,
        bounds: Bounds,
        next_number: Callable[[], int],
        check: Callable[[int], None],
        keep: bool = False,
    ) -> None:
        """Sow the tiles that were counted last in place of those that do not stay.

        Where none does, on new pages, unless they are to be kept. `next_number` is the first of a further page;
        `check` refuses more blades than there are numbers for.
        """
        if keep or stays.any():
            self._give_back(_some(self._resident, ~stays))
        else:
            self.release()
        try:
            new = self._sow(tiles, bounds, next_number, check)
            stay = _some(self._resident, stays[: len(self._resident)])
            rows = np.concatenate([stay.view(_BYTES), new.view(_BYTES)]).view(_ROW)
        except BaseException:
            self.release()
            raise
        self._resident = _some(rows, np.argsort(rows["key"]))
        for number, page in enumerate(self.pages):
            page.hold(_tiles(_some(self._resident, self._resident["page"] == number)))

    def _give_back(self, gone: Table) -> None:
        grown = _some(gone, gone["page"] >= 0)
        # few: what a step of the camera leaves behind
        for page, start, blades, head_start, heads in zip(
            *(grown[name].tolist() for name in ("page", "start")),
            grown["up_to"][:, 7].tolist(),
            *(grown[name].tolist() for name in ("head_start", "heads")),
            strict=True,
        ):
            self._rooms[page][0].give(start, blades)
            self._rooms[page][1].give(head_start, heads)

    def _sow(
        self, tiles: Table, bounds: Bounds, next_number: Callable[[], int], check: Callable[[int], None]
    ) -> Table:
        rows = np.zeros(len(tiles), _ROW)
        if not len(tiles):
            return rows
        counts = self._sower.counted()
        rows["key"], rows["candidates"], rows["page"] = keys_of(tiles), tiles["candidates"], -1
        rows["low"], rows["high"], rows["coverage"] = bounds
        rows["up_to"], rows["heads"] = counts["up_to"], counts["heads"]
        rows["serial"] = self._serial + np.arange(len(tiles))
        self._serial += len(tiles)
        first = not self.pages
        left = self._place(rows, np.flatnonzero(rows["up_to"][:, 7]))
        if len(left):
            blades = rows["up_to"][left, 7]
            check(int(blades.sum()))
            total = _blades_and_heads(rows) + _blades_and_heads(self._resident)
            for number in np.split(left, np.flatnonzero(np.diff(page_numbers(blades, self._sower.page_blades))) + 1):
                self._add_page(_blades_and_heads(rows[number]), total, next_number())
                self._place(rows, number)
            if first and self.free < int(_ROOM * total[0]):
                self._add_page(np.zeros(2, np.int64), total, next_number())
                room = self.pages[-1].blades
                # drivers commit memory when it is first written, 15 ms for 300 MB
                clear(self._device, room, room.size)
        counts["start"], counts["head_start"], counts["page"] = rows["start"], rows["head_start"], rows["page"]
        self._sower.place(counts, self.pages)
        return rows

    def _place(self, rows: Table, which: Indices) -> Indices:
        """Find room for tiles, in order; returns those for which there is none."""
        left = []
        sizes = zip(rows["up_to"][which, 7].tolist(), rows["heads"][which].tolist(), strict=True)
        for row, (blades, heads) in zip(which.tolist(), sizes, strict=True):
            # the newest page has the most room
            for number in reversed(range(len(self.pages))):
                blade_room, head_room = self._rooms[number]
                start = blade_room.take(blades)
                head_start = head_room.take(heads) if heads and start is not None else 0
                if start is not None and head_start is not None:
                    rows["page"][row], rows["start"][row], rows["head_start"][row] = number, start, head_start
                    break
                if start is not None:
                    blade_room.give(start, blades)
            else:
                left.append(row)
        return np.array(left, np.int64)

    def _add_page(self, needed: Indices, total: Indices, first_number: int) -> None:
        """Make a page for so many blades and heads, with room for those to come, as a part of the total."""
        room = np.maximum(_ROOM * total, _LEAST_ROOM).astype(np.int64)
        blades = max(int(needed[0]), min(int(needed[0] + room[0]), self._sower.page_blades))
        heads = int(needed[1] + 2 * room[1])
        self.pages.append(Page(self._device, blades, heads, first_number, transformed=self._transformed))
        self._rooms.append((Room(blades), Room(heads)))

    def release(self) -> None:
        """Free the GPU memory."""
        release_all(*self.pages)
        self.pages, self._rooms, self._resident = [], [], np.zeros(0, _ROW)


def _blades_and_heads(rows: Table) -> Indices:
    return np.array([rows["up_to"][:, 7].sum(), rows["heads"].sum()])


def _some(rows: Table, which: Mask | Indices) -> Table:
    return rows.view(_BYTES)[which].view(_ROW)


def _tiles(rows: Table) -> Tiles:
    return Tiles(*(np.ascontiguousarray(rows[name]) for name in _TILES))


def _same(keys: Indices, candidates: Indices, others: Indices, other_candidates: Indices) -> Mask:
    """Return which rows are among others, by key and number of candidates; both are sorted by key."""
    if not len(others):
        return np.zeros(len(keys), np.bool_)
    at = np.minimum(np.searchsorted(others, keys), len(others) - 1)
    result: Mask = (others[at] == keys) & (other_candidates[at] == candidates)
    return result
