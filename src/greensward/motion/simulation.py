"""The memory of blades: state that is carried on by fixed steps of time, on the GPU."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.culling import Span
from greensward.gpu.program import build_compute, put
from greensward.motion.colliders import GRID, MOST_INSTANTS, Colliders
from greensward.motion.postures import motion_defines
from greensward.scene import InputError, Scene
from greensward.sowing import Page

STATE_BYTES, _ENTRY_BYTES = 32, 48
_MOST_STEPS = 30  # per dispatch, so that drivers do not take it for a hang
_SHOWN_FIRST, _SHOWN_LAST, _FRESH = 1, 2, 4
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Remembering:
    """Chunks of a page whose blades remember, each as those that did so before and those that are new."""

    page: Page
    near: tuple[Span, Span]
    """In the middle of the reach of memory."""
    edge: tuple[Span, Span]
    """Where they blend into closed form."""

    @property
    def items(self) -> int:
        """How many blades."""
        return sum(span.items for span in (*self.near, *self.edge))


class Simulated:
    """State of the blades near the camera, by page. Chunk table, winds and motion block must be bound."""

    def __init__(self, ctx: moderngl.Context, scene: Scene, colliders: Colliders) -> None:
        assert scene.simulation
        self._ctx = ctx
        self._settings = scene.simulation
        self._colliders = colliders
        self._states: dict[Page, moderngl.Buffer] = {}
        self._fresh: set[Page] = set()
        self._steps: int | None = None
        self._kept: tuple[moderngl.Buffer, moderngl.Buffer] | None = None
        defines = motion_defines(scene) | GRID | ({} if colliders.count else {"NO_COLLIDERS": 1})
        self._begin, self._near, self._edge = (
            build_compute(ctx, "motion/simulate.comp", {**defines, **variant})
            for variant in ({"BEGIN": 1}, {}, {"EDGE": 1})
        )
        self._keep, self._restore = (
            build_compute(ctx, "motion/keep.comp", {name: 1}) for name in ("KEEP", "RESTORE")
        )

    def advance(
        self,
        parts: Sequence[Remembering],
        enter: bool,
        time_s: float,
        camera_ws: Floats,
        tallest_m: float,
    ) -> None:
        """Carry these blades on to an instant and write their postures; with `enter`, some have none of late.

        A first instant, one before the last, and one long after it find grass that has been moving for `settle_s`.
        """
        step = self._settings.step_s
        target = int(np.floor(time_s / step + 1e-6))
        settle = int(np.ceil(self._settings.settle_s / step))
        if self._steps is None or target < self._steps or target - self._steps > max(settle, int(2.0 / step)):
            self._steps = target - settle
            for page in self._states:
                self._start(page)
        first, rest = _SHOWN_FIRST, max(time_s - target * step, 0.0)
        frame_steps = max(target - self._steps, 0)
        while True:
            count = min(target - self._steps, MOST_INSTANTS - 1 if self._colliders.moving else _MOST_STEPS)
            last = _SHOWN_LAST if self._steps + count == target else 0
            self._colliders.place([*((self._steps + k) * step for k in range(1, count + 1)), time_s], tallest_m)
            for part in parts:
                fresh = part.page in self._fresh
                for shader, spans in ((self._near, part.near), (self._edge, part.edge)):
                    for span, new in zip(spans, (fresh, fresh or enter), strict=True):
                        flags = first | last | (_FRESH if new else 0)
                        if span.count:
                            self._dispatch(shader, part.page, span, count, rest, flags, camera_ws, frame_steps)
            self._steps += count
            first = 0
            if last:
                break
        self._fresh.clear()

    def _dispatch(
        self,
        shader: moderngl.ComputeShader,
        page: Page,
        span: Span,
        count: int,
        rest: float,
        flags: int,
        camera_ws: Floats,
        frame_steps: int,
    ) -> None:
        assert self._steps is not None
        state = self._state(page)
        self._colliders.bind()
        page.blades.bind_to_storage_buffer(0)
        page.postures.bind_to_storage_buffer(1)
        state.bind_to_storage_buffer(3)
        put(
            shader,
            firstChunk=span.first,
            chunkCount=span.count,
            timeStart=self._steps * self._settings.step_s,
            steps=count,
            rest=rest,
            flags=flags,
            camera=tuple(camera_ws),
            previousFromNow=tuple(page.previous_from_now.T.ravel()),
            moved=1.0 / max(frame_steps, 1),
        )
        shader.run(*span.groups)
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def _state(self, page: Page) -> moderngl.Buffer:
        if page not in self._states:
            self._states[page] = self._ctx.buffer(reserve=page.count * STATE_BYTES)
            self._start(page)
        return self._states[page]

    def _start(self, page: Page) -> None:
        """Give every blade of a page the state of its closed form."""
        self._fresh.add(page)
        page.blades.bind_to_storage_buffer(0)
        self._states[page].bind_to_storage_buffer(3)
        put(self._begin, timeStart=(self._steps or 0) * self._settings.step_s, bladeCount=page.count)
        groups = -(-page.count // 32)
        self._begin.run(min(groups, 32768), -(-groups // 32768))
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    # A field that is sown anew -------------------------------------------------------------------------------

    def keep(self, pages: Sequence[Page]) -> None:
        """Keep the states of pages that are about to go, by the places of their blades' roots."""
        held = [page for page in pages if page in self._states]
        count = sum(page.count for page in held)
        if not count:
            return
        slots = 1 << int(np.ceil(np.log2(2 * count)))
        claims, entries = self._ctx.buffer(reserve=slots * 4), self._ctx.buffer(reserve=slots * _ENTRY_BYTES)
        claims.clear()
        self._kept = claims, entries
        for page in held:
            self._carry_over(self._keep, page)
            self._states.pop(page).release()

    def restore(self, pages: Sequence[Page]) -> None:
        """Give blades that have been there before their states back."""
        if self._kept is None:
            return
        for page in pages:
            self._carry_over(self._restore, page)
        for buffer in self._kept:
            buffer.release()
        self._kept = None

    def _carry_over(self, shader: moderngl.ComputeShader, page: Page) -> None:
        assert self._kept is not None
        claims, entries = self._kept
        page.blades.bind_to_storage_buffer(0)
        self._state(page).bind_to_storage_buffer(3)
        claims.bind_to_storage_buffer(6)
        entries.bind_to_storage_buffer(7)
        shader["bladeCount"] = page.count
        shader["slots"] = claims.size // 4
        groups = -(-page.count // 64)
        shader.run(min(groups, 32768), -(-groups // 32768))
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    # Saved and continued -------------------------------------------------------------------------------------

    def saved(self, pages: Sequence[Page]) -> dict[str, npt.NDArray[Any]]:
        """Everything that the next step depends on, as arrays."""
        found: dict[str, npt.NDArray[Any]] = {"steps": np.array(self._steps or 0, np.int64)}
        for i, page in enumerate(pages):
            found[f"state_{i}"] = np.frombuffer(self._state(page).read(), np.float32).reshape(-1, 8)
            found[f"posture_{i}"] = np.frombuffer(page.postures.read(), np.uint32).reshape(-1, 6)
        return found

    def resume(self, pages: Sequence[Page], saved: Mapping[str, npt.NDArray[Any]]) -> None:
        """Continue from what `saved` returned; the same field must be sown. Raises `InputError` where it is not."""
        for i, page in enumerate(pages):
            state, posture = saved.get(f"state_{i}"), saved.get(f"posture_{i}")
            if state is None or posture is None or len(state) != page.count or len(posture) != page.count:
                raise InputError("the checkpoint was made of another field: use the same scene, seed and camera")
        for i, page in enumerate(pages):
            self._state(page).write(np.ascontiguousarray(saved[f"state_{i}"], np.float32))
            page.postures.write(np.ascontiguousarray(saved[f"posture_{i}"], np.uint32))
        self._steps = int(saved["steps"])
        self._fresh.clear()

    def release(self) -> None:
        """Free the GPU resources."""
        for buffer in (*self._states.values(), *(self._kept or ())):
            buffer.release()
        for shader in (self._begin, self._near, self._edge, self._keep, self._restore):
            shader.release()
