"""Simulation of blades: state that is advanced by fixed steps of time, on the GPU."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.culling import ChunkRange, ChunkTable, NeededTiles, VisibleSet
from greensward.gpu.buffers import at_least, clear, full, release_all
from greensward.gpu.device import STORAGE_WRITTEN, Device
from greensward.gpu.kernels import Kernel, Resource
from greensward.gpu.layouts import WORD, struct
from greensward.gpu.view import anchor_near, anchored
from greensward.motion.colliders import MOST_INSTANTS, Colliders
from greensward.motion.poses import motion_defines
from greensward.motion.stateful import MotionStep, Saved
from greensward.scene import InputError, Scene
from greensward.sowing import Field, Page, Tiles
from greensward.sowing.blade import BLADE, POSE

STATE = struct(
    "State",
    ("x", "float"),  # tip from the root, metres
    ("y", "float"),
    ("z", "float"),
    ("pressed", "float"),  # collision strength, 0 to 1
    ("vx", "float"),  # velocity of the tip, m/s
    ("vy", "float"),
    ("vz", "float"),
    ("step", "float"),  # up to which it was advanced
)
# a state by the id of its blade
_ENTRY = struct("Entry", ("low", "uint"), ("high", "uint"), ("pose", "uint", 3), ("state", STATE))
_MOST_STEPS = 30  # per dispatch, so that drivers do not take it for a hang
_SHOWN_FIRST, _SHOWN_LAST = 1, 2
_STATE_WORDS, _POSE_WORDS = STATE.dtype.itemsize // WORD, POSE.dtype.itemsize // WORD
Indices = npt.NDArray[np.int64]


@dataclass(frozen=True)
class SimulatedRanges:
    """Chunks of a page whose blades are simulated, each as those that were before and those that are new."""

    page: Page
    near: tuple[ChunkRange, ChunkRange]
    """Chunks in the middle of the simulated reach."""
    edge: tuple[ChunkRange, ChunkRange]
    """Chunks where blades blend into analytic motion."""

    @property
    def items(self) -> int:
        """Number of blades."""
        return sum(each.items for each in (*self.near, *self.edge))


class BladeSimulation:
    """State of the blades near the camera, by page."""

    def __init__(
        self, device: Device, scene: Scene, field: Field, colliders: Colliders, bindings: Mapping[str, Resource]
    ) -> None:
        assert scene.simulation
        self._device = device
        self._field = field
        self._settings = scene.simulation
        self._colliders = colliders
        self._states: dict[Page, moderngl.Buffer] = {}
        self._ranges: list[SimulatedRanges] = []
        self._within = np.zeros(3), np.zeros(3)
        """Corners of a box that holds all blades that are simulated."""
        self._simulated: dict[Page, Indices] = {}
        """Serial numbers of the tiles of each page that were simulated for the last visible set."""
        self._steps: int | None = None
        self._slots = 0
        """Slots of the table of preserved states, a power of two; 0 where none are."""
        self._table = {name: device.ctx.buffer(reserve=WORD) for name in ("Claims", "Entries")}
        self._newest_serial = -1
        """Greatest serial number of a tile when states were preserved last."""
        self._chunks = ChunkTable(device)
        defines = motion_defines(scene) | ({} if colliders.count else {"NO_COLLIDERS": 1})
        self._begin, self._near, self._edge = (
            Kernel(device, "motion/simulate.comp", {**defines, **variant}, bindings)
            for variant in ({"BEGIN": 1}, {}, {"EDGE": 1})
        )
        self._preserve, self._restore = (
            Kernel(device, "motion/preserve.comp", {name: 1}) for name in ("PRESERVE", "RESTORE")
        )

    @property
    def blades(self) -> int:
        """Number of blades that the last visible set simulates."""
        return sum(each.items for each in self._ranges)

    def schedule(self, stored: Sequence[NeededTiles], visible: VisibleSet) -> list[Indices]:
        """Take the tiles within reach; returns how many eighths of each page's tiles are left to analytic motion."""
        within_m, left = self._settings.within_m, []
        simulated: dict[Page, Indices] = {}
        self._ranges = []
        corners = [np.full((1, 3), np.inf)], [np.full((1, 3), -np.inf)]
        for needed in stored:
            page, order, away = needed.page, needed.order, needed.away
            wide = np.linalg.norm(2.0 * page.tiles.half, axis=1)[order]
            inside, blends = away[order] < within_m, away[order] + wide > 0.8 * within_m
            serial = page.tiles.serial
            known = np.isin(serial, self._simulated.get(page, ()))[order]
            near, edge = (
                (
                    visible.add(page, order, np.where(where & known, 8, 0)),
                    visible.add(page, order, np.where(where & ~known, 8, 0)),
                )
                for where in (inside & ~blends, inside & blends)
            )
            self._ranges.append(SimulatedRanges(page, near, edge))
            simulated[page] = serial[away < within_m]
            left.append(np.where(inside, 0, needed.eighths))
            for end, bounds in zip(corners, (page.tiles.low, page.tiles.high), strict=True):
                end.append(bounds[away < within_m])
        self._within = np.concatenate(corners[0]).min(axis=0), np.concatenate(corners[1]).max(axis=0)
        self._simulated = simulated
        # what a step of the camera may leave behind, or the first steps would make room in the midst of frames
        self._reserved(self.blades // 8)
        for page in self._states.keys() - simulated.keys():
            self._states.pop(page).release()
        return left

    def advance(self, step: MotionStep) -> None:
        """Advance the blades to an instant and write their poses; where the visible set changed, some begin now.

        A first instant, one before the last, and one long after it find grass that has been moving for `settle_s`.
        """
        time_s, parts, chunks, placed_at = step.time_s, self._ranges, step.chunks, step.placed_at
        enter, previous_time_s, anchor_ws = step.culled, step.previous_time_s, anchor_near(step.camera_ws)
        step_s = self._settings.step_s
        target = int(np.floor(time_s / step_s + 1e-6))
        settle = int(np.ceil(self._settings.settle_s / step_s))
        again = self._steps is None or target < self._steps or target - self._steps > max(settle, int(2.0 / step_s))
        if self._steps is None or again:
            self._steps = target - settle
        for part in parts:
            begun = (*part.near, *part.edge) if again else (part.near[1], part.edge[1]) if enter else ()
            for blades in begun:
                self._run(self._begin, part.page, blades, chunks, previous_time_s=previous_time_s)
        self._restore_preserved(again)
        first, rest = _SHOWN_FIRST, max(time_s - target * step_s, 0.0)
        while True:
            count = min(target - self._steps, MOST_INSTANTS - 1 if self._colliders.moving else _MOST_STEPS)
            self._colliders.place(
                [*((self._steps + k) * step_s for k in range(1, count + 1)), time_s],
                self._field.tallest_m,
                anchor_ws,
                self._within,
            )
            count = min(count, self._colliders.most_steps)
            last = _SHOWN_LAST if self._steps + count == target else 0
            # how far what is grown on moves while these steps last, or within one where there is none
            from_s, steps = self._steps * step_s, max(count, 1)
            moved = (placed_at(from_s + steps * step_s) - placed_at(from_s)) / steps
            start_s, self._steps = from_s, self._steps + count
            for part in parts:
                index = part.page.object_index
                turned = np.zeros((4, 4))
                if index is not None:
                    turned = moved[index] @ np.linalg.inv(anchored(placed_at(time_s)[index], anchor_ws))
                for kernel, ranges in ((self._near, part.near), (self._edge, part.edge)):
                    for blades in ranges:
                        self._run(
                            kernel,
                            part.page,
                            blades,
                            chunks,
                            start_s=start_s,
                            steps=count,
                            rest=rest,
                            flags=first | last,
                            camera=step.camera_ws - anchor_ws,
                            moved_per_step=turned,
                            previous_from_now=part.page.previous_from_now,
                        )
            first = 0
            if last:
                break

    def _run(self, kernel: Kernel, page: Page, blades: ChunkRange, chunks: ChunkTable, **values: Any) -> None:
        if not blades.count:
            return
        assert self._steps is not None
        start = {"start_s": self._steps * self._settings.step_s, "step_now": float(self._steps)}
        kernel.run(
            blades.groups,
            **page.bindings,
            States=self._state(page),
            Chunks=chunks.buffer,
            first_chunk=blades.first,
            chunk_count=blades.count,
            **{**start, **values},
        )
        self._device.ctx.memory_barrier(STORAGE_WRITTEN)

    def _state(self, page: Page) -> moderngl.Buffer:
        if page not in self._states:
            self._states[page] = full(self._device, page.capacity * STATE.dtype.itemsize, np.float32(-1.0))
        return self._states[page]

    # Tiles that go and come -----------------------------------------------------------------------------------

    def preserve(self, going: Sequence[tuple[Page, Tiles]]) -> None:
        """Preserve the states of tiles that are about to go, by the ids of their blades."""
        held = [
            (page, tiles.where(np.isin(tiles.serial, self._simulated[page])))
            for page, tiles in going
            if page in self._states and page in self._simulated
        ]
        count = sum(int(tiles.up_to[:, 7].sum()) for _, tiles in held)
        if not count or self._slots:
            return
        self._slots = self._reserved(count)
        clear(self._device, self._table["Claims"], self._slots * WORD)
        self._newest_serial = max(int(page.tiles.serial.max(initial=-1)) for page in self._field.pages)
        self._look_up(self._preserve, held)

    def _reserved(self, count: int) -> int:
        """Number of slots of a table for the states of so many blades, for which there is room then."""
        slots = 1 << int(np.ceil(np.log2(2 * max(count, 1))))
        for name, nbytes in (("Claims", slots * WORD), ("Entries", slots * _ENTRY.dtype.itemsize)):
            before = self._table[name]
            self._table[name] = at_least(self._device, before, nbytes)
            if self._table[name] is not before:
                # drivers commit memory when it is first written
                clear(self._device, self._table[name], nbytes)
        return slots

    def _restore_preserved(self, forget: bool) -> None:
        """Give blades of new tiles that were simulated before their states back, unless all is to be forgotten."""
        if not self._slots:
            return
        if not forget:
            pages = [part.page for part in self._ranges if part.page.object_index is None]
            self._look_up(
                self._restore,
                [(page, page.tiles.where(page.tiles.serial > self._newest_serial)) for page in pages],
            )
        self._slots = 0

    def _look_up(self, kernel: Kernel, parts: Sequence[tuple[Page, Tiles]]) -> None:
        self._chunks.clear()
        ranges = [(page, self._chunks.add(tiles.start, tiles.up_to[:, 7])) for page, tiles in parts]
        self._chunks.cut()
        for page, blades in ranges:
            if blades.count:
                kernel.run(
                    blades.groups,
                    Ids=page.ids,
                    Poses=page.poses,
                    States=self._state(page),
                    **self._table,
                    Chunks=self._chunks.buffer,
                    first_chunk=blades.first,
                    chunk_count=blades.count,
                    slots=self._slots,
                    step_now=float(self._steps or 0),
                )
                self._device.ctx.memory_barrier(STORAGE_WRITTEN)

    # Saved and continued -------------------------------------------------------------------------------------

    def saved(self) -> Saved:
        """Read back everything that the next step depends on, as arrays in the field's own order."""
        self._device.ctx.memory_barrier()
        pages, order = self._field.pages, self._field.order()
        at = _first_rows(pages)[order.page] + order.row
        simulated = np.concatenate([np.zeros(0, np.int64), *(self._simulated.get(page, ()) for page in pages)])
        return {
            "steps": np.array(self._steps or 0, np.int64),
            "state": _read([self._state(page) for page in pages], _STATE_WORDS, np.float32)[at],
            "pose": _read([page.poses for page in pages], _POSE_WORDS, np.uint32)[at],
            "simulated": np.isin(order.serial, simulated),
            "field": self._digest(),
        }

    def _digest(self) -> npt.NDArray[np.uint8]:
        """Digest of where every blade was sown, 32 bytes: that of another field differs."""
        order, words = self._field.order(), BLADE.dtype.itemsize // WORD
        pages = self._field.pages
        blades = _read([page.sown or page.blades for page in pages], words, np.uint32)
        roots = blades[:, :3][_first_rows(pages)[order.page] + order.row]
        return np.frombuffer(hashlib.sha256(roots.tobytes()).digest(), np.uint8)

    def resume(self, saved: Mapping[str, npt.NDArray[Any]]) -> None:
        """Continue from what `saved` returned; the same field must be sown. Raises `InputError` where it is not."""
        pages, order = self._field.pages, self._field.order()
        shapes = {
            "steps": (),
            "state": (len(order.row), _STATE_WORDS),
            "pose": (len(order.row), _POSE_WORDS),
            "simulated": (len(order.serial),),
        }
        same = "field" in saved and np.array_equal(saved["field"], self._digest())
        if not same or any(name not in saved or saved[name].shape != shape for name, shape in shapes.items()):
            raise InputError("the checkpoint was made of another field: use the same scene, seed and camera")
        if not 0 <= float(saved["steps"]) < 2**62:
            raise InputError("the checkpoint's steps is damaged")
        states = [self._state(page) for page in pages]
        # NVIDIA's driver may write before it has cleared
        self._device.ctx.finish()
        for name, buffers, words, kind in (
            ("state", states, _STATE_WORDS, np.float32),
            ("pose", [page.poses for page in pages], _POSE_WORDS, np.uint32),
        ):
            for number, buffer in enumerate(buffers):
                mine = order.page == number
                rows = np.frombuffer(buffer.read(), kind).reshape(-1, words).copy()
                rows[order.row[mine]] = saved[name][mine]
                buffer.write(rows)
        simulated = order.serial[saved["simulated"].astype(np.bool_)]
        self._simulated = dict.fromkeys(pages, simulated)
        self._steps = int(saved["steps"])
        self._slots = 0  # what was preserved is of the time before

    def release(self) -> None:
        """Free the GPU resources."""
        release_all(*self._states.values(), *self._table.values())
        release_all(self._begin, self._near, self._edge, self._preserve, self._restore, self._chunks)


def _first_rows(pages: Sequence[Page]) -> Indices:
    """First row of each page where all of them follow each other."""
    return np.cumsum([0, *(page.capacity for page in pages)], dtype=np.int64)


def _read(buffers: Sequence[moderngl.Buffer], words: int, kind: type) -> npt.NDArray[Any]:
    return np.concatenate(
        [np.zeros((0, words), kind), *(np.frombuffer(each.read(), kind).reshape(-1, words) for each in buffers)]
    )
