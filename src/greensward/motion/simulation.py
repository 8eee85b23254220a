"""Simulation of blades: state that is advanced by fixed steps of time, on the GPU."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.culling import ChunkRange, ChunkTable, NeededTiles, VisibleSet
from greensward.gpu.buffers import full, release_all, zeros
from greensward.gpu.device import STORAGE_WRITTEN, Device
from greensward.gpu.kernels import Kernel, Resource, grid
from greensward.gpu.layouts import WORD, struct
from greensward.motion.colliders import GRID, MOST_INSTANTS, Colliders
from greensward.motion.poses import motion_defines
from greensward.motion.stateful import MotionStep, Saved
from greensward.scene import InputError, Scene
from greensward.sowing import Field, Page
from greensward.sowing.blade import POSE

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
# a state by the root of its blade
_ENTRY = struct("Entry", ("x", "float"), ("y", "float"), ("z", "float"), ("pose", "uint", 3), ("state", STATE))
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
        self._simulated: dict[Page, npt.NDArray[np.bool_]] = {}
        """Tiles of each page that were simulated for the last visible set."""
        self._steps: int | None = None
        self._preserved: tuple[moderngl.Buffer, moderngl.Buffer, int] | None = None
        defines = motion_defines(scene) | GRID | ({} if colliders.count else {"NO_COLLIDERS": 1})
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
        simulated: dict[Page, npt.NDArray[np.bool_]] = {}
        self._ranges = []
        for needed in stored:
            page, order, away = needed.page, needed.order, needed.away
            wide = np.linalg.norm(2.0 * page.tiles.half, axis=1)[order]
            inside, blends = away[order] < within_m, away[order] + wide > 0.8 * within_m
            known = self._simulated.get(page, np.zeros(len(away), np.bool_))[order]
            near, edge = (
                (
                    visible.add(page, order, np.where(where & known, 8, 0)),
                    visible.add(page, order, np.where(where & ~known, 8, 0)),
                )
                for where in (inside & ~blends, inside & blends)
            )
            self._ranges.append(SimulatedRanges(page, near, edge))
            simulated[page] = away < within_m
            left.append(np.where(inside, 0, needed.eighths))
        self._simulated = simulated
        return left

    def advance(self, step: MotionStep) -> None:
        """Advance the blades to an instant and write their poses; where the visible set changed, some begin now.

        A first instant, one before the last, and one long after it find grass that has been moving for `settle_s`.
        """
        time_s, parts, chunks, placed_at = step.time_s, self._ranges, step.chunks, step.placed_at
        enter, previous_time_s = step.culled, step.previous_time_s
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
        self._restore_preserved(parts, again)
        first, rest = _SHOWN_FIRST, max(time_s - target * step_s, 0.0)
        while True:
            count = min(target - self._steps, MOST_INSTANTS - 1 if self._colliders.moving else _MOST_STEPS)
            last = _SHOWN_LAST if self._steps + count == target else 0
            self._colliders.place(
                [*((self._steps + k) * step_s for k in range(1, count + 1)), time_s], self._field.tallest_m
            )
            # how far what is grown on moves while these steps last, or within one where there is none
            from_s, steps = self._steps * step_s, max(count, 1)
            moved = (placed_at(from_s + steps * step_s) - placed_at(from_s)) / steps
            start_s, self._steps = from_s, self._steps + count
            for part in parts:
                index = part.page.object_index
                turned = np.zeros((4, 4)) if index is None else moved[index] @ np.linalg.inv(placed_at(time_s)[index])
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
                            camera=step.camera_ws,
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
            self._states[page] = full(self._device, page.count * STATE.dtype.itemsize, np.float32(-1.0))
        return self._states[page]

    # A field that is sown anew -------------------------------------------------------------------------------

    def preserve(self) -> None:
        """Preserve the states of the ground's pages, which are about to go, by the places of their blades' roots."""
        held = [page for page in self._field.pages if page in self._states and page.object_index is None]
        count = sum(page.count for page in held)
        if not count or self._preserved:
            return
        slots = 1 << int(np.ceil(np.log2(2 * count)))
        claims = zeros(self._device, slots * WORD)
        self._preserved = claims, self._device.ctx.buffer(reserve=slots * _ENTRY.dtype.itemsize), slots
        for page in held:
            self._look_up(self._preserve, page)
            self._states.pop(page).release()

    def _restore_preserved(self, parts: Sequence[SimulatedRanges], forget: bool) -> None:
        """Give blades that were simulated before their states back, unless all is to be forgotten."""
        if self._preserved is None:
            return
        for part in () if forget else parts:
            self._look_up(self._restore, part.page)
        release_all(*self._preserved[:2])
        self._preserved = None

    def _look_up(self, kernel: Kernel, page: Page) -> None:
        assert self._preserved is not None
        claims, entries, slots = self._preserved
        kernel.run(
            grid(-(-page.count // kernel.group[0])),
            **page.bindings,
            States=self._state(page),
            Claims=claims,
            Entries=entries,
            blade_count=page.count,
            slots=slots,
            step_now=float(self._steps or 0),
        )
        self._device.ctx.memory_barrier(STORAGE_WRITTEN)

    # Saved and continued -------------------------------------------------------------------------------------

    def saved(self) -> Saved:
        """Read back everything that the next step depends on, as arrays."""
        self._device.ctx.memory_barrier()
        found: Saved = {"steps": np.array(self._steps or 0, np.int64)}
        for i, page in enumerate(self._field.pages):
            found[f"state_{i}"] = np.frombuffer(self._state(page).read(), np.float32).reshape(-1, _STATE_WORDS)
            found[f"pose_{i}"] = np.frombuffer(page.poses.read(), np.uint32).reshape(-1, _POSE_WORDS)
            found[f"simulated_{i}"] = self._simulated.get(page, np.zeros(len(page.tiles.start), np.bool_))
        return found

    def resume(self, saved: Mapping[str, npt.NDArray[Any]]) -> None:
        """Continue from what `saved` returned; the same field must be sown. Raises `InputError` where it is not."""
        pages = self._field.pages
        shapes: dict[str, tuple[int, ...]] = {"steps": ()}
        for i, page in enumerate(pages):
            shapes |= {f"state_{i}": (page.count, _STATE_WORDS), f"pose_{i}": (page.count, _POSE_WORDS)}
            shapes[f"simulated_{i}"] = (len(page.tiles.start),)
        if any(name not in saved or saved[name].shape != shape for name, shape in shapes.items()):
            raise InputError("the checkpoint was made of another field: use the same scene, seed and camera")
        states = [self._state(page) for page in pages]
        # NVIDIA's driver may write before it has cleared
        self._device.ctx.finish()
        for i, page in enumerate(pages):
            states[i].write(np.ascontiguousarray(saved[f"state_{i}"], np.float32))
            page.poses.write(np.ascontiguousarray(saved[f"pose_{i}"], np.uint32))
            self._simulated[page] = saved[f"simulated_{i}"].astype(np.bool_)
        self._steps = int(saved["steps"])

    def release(self) -> None:
        """Free the GPU resources."""
        release_all(*self._states.values(), *(self._preserved or ())[:2])
        release_all(self._begin, self._near, self._edge, self._preserve, self._restore)
