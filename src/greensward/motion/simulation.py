"""The memory of blades: state that is carried on by fixed steps of time, on the GPU."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.culling import Span
from greensward.gpu.buffers import filled
from greensward.gpu.program import build_compute, put
from greensward.motion.colliders import GRID, MOST_INSTANTS, Colliders
from greensward.motion.postures import motion_defines
from greensward.scene import InputError, Scene
from greensward.sowing import Page

STATE_BYTES, _ENTRY_BYTES = 32, 56
_MOST_STEPS = 30  # per dispatch, so that drivers do not take it for a hang
_SHOWN_FIRST, _SHOWN_LAST = 1, 2
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
        previous_time_s: float,
        camera_ws: Floats,
        placed_at: Callable[[float], Floats],
        tallest_m: float,
    ) -> None:
        """Carry these blades on to an instant and write their postures; with `enter`, some begin now.

        A first instant, one before the last, and one long after it find grass that has been moving for `settle_s`.
        """
        step = self._settings.step_s
        target = int(np.floor(time_s / step + 1e-6))
        settle = int(np.ceil(self._settings.settle_s / step))
        again = self._steps is None or target < self._steps or target - self._steps > max(settle, int(2.0 / step))
        if self._steps is None or again:
            self._steps = target - settle
        for part in parts:
            spans = (*part.near, *part.edge) if again else (part.near[1], part.edge[1]) if enter else ()
            for span in spans:
                self._dispatch(self._begin, part.page, span, timePrevious=previous_time_s)
        self._restore_kept(parts, again)
        first, rest = _SHOWN_FIRST, max(time_s - target * step, 0.0)
        while True:
            count = min(target - self._steps, MOST_INSTANTS - 1 if self._colliders.moving else _MOST_STEPS)
            last = _SHOWN_LAST if self._steps + count == target else 0
            self._colliders.place([*((self._steps + k) * step for k in range(1, count + 1)), time_s], tallest_m)
            # how far what is grown on moves while these steps last, or within one where there is none
            from_s, steps = self._steps * step, max(count, 1)
            moved = (placed_at(from_s + steps * step) - placed_at(from_s)) / steps
            start_s, self._steps = from_s, self._steps + count
            for part in parts:
                thing = part.page.thing
                turned = np.zeros((4, 4)) if thing is None else moved[thing] @ np.linalg.inv(placed_at(time_s)[thing])
                for shader, spans in ((self._near, part.near), (self._edge, part.edge)):
                    for span in spans:
                        self._dispatch(
                            shader,
                            part.page,
                            span,
                            timeStart=start_s,
                            steps=count,
                            rest=rest,
                            flags=first | last,
                            camera=tuple(camera_ws),
                            movedPerStep=tuple(turned.T.ravel()),
                            previousFromNow=tuple(part.page.previous_from_now.T.ravel()),
                        )
            first = 0
            if last:
                break

    def _dispatch(self, shader: moderngl.ComputeShader, page: Page, span: Span, **values: Any) -> None:
        if not span.count:
            return
        assert self._steps is not None
        self._colliders.bind()
        page.blades.bind_to_storage_buffer(0)
        page.postures.bind_to_storage_buffer(1)
        self._state(page).bind_to_storage_buffer(3)
        start = {"timeStart": self._steps * self._settings.step_s, "stepNow": float(self._steps)}
        put(shader, firstChunk=span.first, chunkCount=span.count, **{**start, **values})
        shader.run(*span.groups)
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def _state(self, page: Page) -> moderngl.Buffer:
        if page not in self._states:
            self._states[page] = filled(self._ctx, page.count * STATE_BYTES, np.float32(-1.0))
        return self._states[page]

    # A field that is sown anew -------------------------------------------------------------------------------

    def keep(self, pages: Sequence[Page]) -> None:
        """Keep the states of pages that are about to go, by the places of their blades' roots."""
        held = [page for page in pages if page in self._states and page.thing is None]
        count = sum(page.count for page in held)
        if not count or self._kept:
            return
        slots = 1 << int(np.ceil(np.log2(2 * count)))
        claims, entries = filled(self._ctx, slots * 4), self._ctx.buffer(reserve=slots * _ENTRY_BYTES)
        self._kept = claims, entries
        for page in held:
            self._carry_over(self._keep, page)
            self._states.pop(page).release()

    def _restore_kept(self, parts: Sequence[Remembering], forget: bool) -> None:
        """Give blades that have been there before their states back, unless all is to be forgotten."""
        if self._kept is None:
            return
        for part in () if forget else parts:
            self._carry_over(self._restore, part.page)
        for buffer in self._kept:
            buffer.release()
        self._kept = None

    def _carry_over(self, shader: moderngl.ComputeShader, page: Page) -> None:
        assert self._kept is not None
        claims, entries = self._kept
        page.blades.bind_to_storage_buffer(0)
        page.postures.bind_to_storage_buffer(1)
        self._state(page).bind_to_storage_buffer(3)
        claims.bind_to_storage_buffer(6)
        entries.bind_to_storage_buffer(7)
        put(shader, bladeCount=page.count, slots=claims.size // 4, stepNow=float(self._steps or 0))
        groups = -(-page.count // 64)
        shader.run(min(groups, 32768), -(-groups // 32768))
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    # Saved and continued -------------------------------------------------------------------------------------

    def saved(self, pages: Sequence[Page]) -> dict[str, npt.NDArray[Any]]:
        """Everything that the next step depends on, as arrays."""
        self._ctx.memory_barrier()
        found: dict[str, npt.NDArray[Any]] = {"steps": np.array(self._steps or 0, np.int64)}
        for i, page in enumerate(pages):
            found[f"state_{i}"] = np.frombuffer(self._state(page).read(), np.float32).reshape(-1, 8)
            found[f"posture_{i}"] = np.frombuffer(page.postures.read(), np.uint32).reshape(-1, 6)
        return found

    def resume(self, pages: Sequence[Page], saved: Mapping[str, npt.NDArray[Any]]) -> None:
        """Continue from what `saved` returned; the same field must be sown. Raises `InputError` where it is not."""
        shapes: dict[str, tuple[int, ...]] = {"steps": ()}
        for i, page in enumerate(pages):
            shapes |= {f"state_{i}": (page.count, 8), f"posture_{i}": (page.count, 6)}
        if any(name not in saved or saved[name].shape != shape for name, shape in shapes.items()):
            raise InputError("the checkpoint was made of another field: use the same scene, seed and camera")
        states = [self._state(page) for page in pages]
        # NVIDIA's driver may write before it has cleared
        self._ctx.finish()
        for i, page in enumerate(pages):
            states[i].write(np.ascontiguousarray(saved[f"state_{i}"], np.float32))
            page.postures.write(np.ascontiguousarray(saved[f"posture_{i}"], np.uint32))
        self._steps = int(saved["steps"])

    def release(self) -> None:
        """Free the GPU resources."""
        for buffer in (*self._states.values(), *(self._kept or ())):
            buffer.release()
        for shader in (self._begin, self._near, self._edge, self._keep, self._restore):
            shader.release()
