"""Blades as they are now: grown to their age, and where their object is."""

from collections.abc import Sequence

import moderngl
import numpy as np

from greensward.gpu.blocks import BlockBuffer
from greensward.gpu.program import build_compute
from greensward.scene import Scene
from greensward.sowing.growth import GROWTH_BLOCK, curve_rows, phase_at
from greensward.sowing.pages import Floats, Page

_WIDEST = 32768  # workgroups side by side


class Carrying:
    """Keeps the blades of pages that are carried or grow up to date."""

    def __init__(self, ctx: moderngl.Context, scene: Scene) -> None:
        self._ctx = ctx
        self._growth = scene.growth
        self._shader = build_compute(ctx, "sowing/carry.comp", {"GROWTH": 1} if scene.growth else {})
        self._block = BlockBuffer(ctx, GROWTH_BLOCK)
        if scene.growth:
            self._block.set(keys=curve_rows(scene.growth), spread=scene.growth.spread)
        self._state: dict[Page, tuple[Floats | None, float]] = {}

    def carry(self, pages: Sequence[Page], placed: Floats, time_s: float) -> None:
        """Bring every page up to date whose object has moved or whose grass has grown since the last time."""
        phase = phase_at(self._growth, time_s) if self._growth else 0.0
        before, self._state = self._state, {}
        wrote = False
        for page in pages:
            if page.sown is None:
                continue
            matrix = None if page.thing is None else np.array(placed[page.thing], np.float64)
            old_matrix, old_phase = before.get(page, (None, np.nan))
            self._state[page] = matrix, phase
            same_place = matrix is None or (old_matrix is not None and np.array_equal(matrix, old_matrix))
            if matrix is not None:
                fixed = same_place or old_matrix is None
                page.previous_from_now = np.eye(4) if fixed else old_matrix @ np.linalg.inv(matrix)  # type: ignore[operator]
                if not same_place:
                    page.tiles = page.tiles_as_sown.placed(matrix)
            if not same_place or phase != old_phase:
                self._write(page, matrix, phase)
                wrote = True
        if wrote:
            self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def _write(self, page: Page, matrix: Floats | None, phase: float) -> None:
        assert page.sown is not None
        if self._growth:
            self._block.set(phase=phase)
            self._block.bind()
        page.sown.bind_to_storage_buffer(0)
        page.blades.bind_to_storage_buffer(1)
        self._shader["bladeCount"] = page.count
        self._shader["moves"] = matrix is not None
        self._shader["placed"] = tuple((np.eye(4) if matrix is None else matrix).T.ravel())
        groups = -(-page.count // 64)
        self._shader.run(min(groups, _WIDEST), -(-groups // _WIDEST))

    def release(self) -> None:
        """Free the GPU resources."""
        self._shader.release()
        self._block.release()
