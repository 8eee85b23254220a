"""Blades as they are now: grown to their age, and transformed with their object."""

from collections.abc import Sequence

import numpy as np

from greensward.gpu.device import STORAGE_WRITTEN, Device
from greensward.gpu.kernels import Bindings, Kernel, grid
from greensward.gpu.layouts import BlockBuffer
from greensward.gpu.view import anchored
from greensward.scene import Scene
from greensward.sowing.growth import GROWTH_BLOCK, curve_rows, phase_at
from greensward.sowing.pages import Floats, Page


class BladeTransform:
    """Keeps the blades of pages that move with an object or grow up to date."""

    def __init__(self, device: Device, scene: Scene) -> None:
        self._ctx = device.ctx
        self._growth = scene.growth
        self._block = BlockBuffer(device.ctx, GROWTH_BLOCK)
        bindings: Bindings = {"Growth": self._block}
        self._kernel = Kernel(device, "sowing/transform.comp", {"GROWTH": 1} if scene.growth else {}, bindings)
        if scene.growth:
            self._block.set(keys=curve_rows(scene.growth), spread=scene.growth.spread)
        self._state: dict[Page, tuple[Floats | None, float]] = {}
        self._anchor_ws = np.zeros(3)

    def update(self, pages: Sequence[Page], placed: Floats, time_s: float, anchor_ws: Floats) -> None:
        """Bring every page up to date whose object has moved or whose grass has grown since the last time.

        Blades are counted from the anchor, (3,).
        """
        phase = phase_at(self._growth, time_s) if self._growth else 0.0
        before, self._state = self._state, {}
        wrote = False
        for page in pages:
            if page.sown is None:
                continue
            matrix = None if page.object_index is None else np.array(placed[page.object_index], np.float64)
            old_matrix, old_phase = before.get(page, (None, np.nan))
            self._state[page] = matrix, phase
            same_place = matrix is None or (old_matrix is not None and np.array_equal(matrix, old_matrix))
            same_place &= matrix is None or np.array_equal(anchor_ws, self._anchor_ws)
            if matrix is not None:
                fixed = same_place or old_matrix is None
                page.previous_from_now = np.eye(4) if fixed else old_matrix @ np.linalg.inv(matrix)  # type: ignore[operator]
                if not same_place:
                    page.tiles = page.tiles_as_sown.placed(matrix)
            if not same_place or phase != old_phase:
                self._write(page, None if matrix is None else anchored(matrix, anchor_ws), phase)
                wrote = True
        self._anchor_ws = anchor_ws
        if wrote:
            self._ctx.memory_barrier(STORAGE_WRITTEN)

    def forget_ground(self) -> None:
        """Bring the ground's pages up to date the next time in any case: some of their tiles are new."""
        self._state = {page: known for page, known in self._state.items() if page.object_index is not None}

    def _write(self, page: Page, matrix: Floats | None, phase: float) -> None:
        assert page.sown is not None
        if self._growth:
            self._block.set(phase=phase)
        self._kernel.run(
            grid(-(-page.capacity // self._kernel.group[0])),
            Sown=page.sown,
            Blades=page.blades,
            blade_count=page.capacity,
            moves=matrix is not None,
            placed=np.eye(4) if matrix is None else matrix,
        )

    def release(self) -> None:
        """Free the GPU resources."""
        self._kernel.release()
        self._block.release()
