"""Tiles against a view, vectorised; the survivors as chunks of blades, one per instance of a draw."""

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.view import View
from greensward.sowing.field import Tiles

CHUNK = 32
Floats = npt.NDArray[np.float64]


def visible(tiles: Tiles, view: View) -> npt.NDArray[np.bool_]:
    """Which tiles' boxes touch the view's volume: bool (n,). A box outside one plane is out."""
    planes = view.planes_ws()
    centre, half = 0.5 * (tiles.low + tiles.high), 0.5 * (tiles.high - tiles.low)
    reach = centre @ planes[:, :3].T + half @ np.abs(planes[:, :3]).T + planes[:, 3]
    result: npt.NDArray[np.bool_] = (reach >= 0.0).all(axis=1)
    return result


def distance_to(tiles: Tiles, point: Floats) -> Floats:
    """Metres from a point to the nearest of each tile's box: float64 (n,)."""
    beside = np.maximum(np.maximum(tiles.low - point, point - tiles.high), 0.0)
    distance: Floats = np.sqrt((beside * beside).sum(axis=1))
    return distance


def share_needed(tiles: Tiles, view: View, full_density_m: float, reach_m: float) -> Floats:
    """Part of each tile's sown blades that the view may need: float64 (n,), in 0..1, 0 where unseen."""
    away = distance_to(tiles, view.camera_ws)
    kept = np.minimum(1.0, (full_density_m / np.maximum(away, 1e-3)) ** 2) * view.density
    if view.density <= 0.0:
        return np.zeros(len(away))
    seen = visible(tiles, view) & (away <= reach_m)
    result: Floats = np.where(seen, np.minimum(kept / tiles.kept, 1.0), 0.0)
    return result


class Chunks:
    """Runs of at most `size` blades, (first, count) each, on the GPU."""

    def __init__(self, ctx: moderngl.Context, size: int = CHUNK) -> None:
        self._ctx = ctx
        self._size = size
        self._buffer: moderngl.Buffer | None = None
        self.count = 0
        self.blades = 0

    def set(self, start: npt.NDArray[np.int64], length: npt.NDArray[np.int64]) -> None:
        """Cut runs of blades into chunks and upload them."""
        size = self._size
        per_run = -(-length // size)
        self.count, self.blades = int(per_run.sum()), int(length.sum())
        if not self.count:
            return
        run = np.repeat(np.arange(len(length)), per_run)
        within = np.arange(self.count) - np.repeat(np.cumsum(per_run) - per_run, per_run)
        table = np.empty((self.count, 2), np.uint32)
        table[:, 0] = start[run] + within * size
        table[:, 1] = np.minimum(size, length[run] - within * size)
        if self._buffer is None or self._buffer.size < table.nbytes:
            self.release()
            self._buffer = self._ctx.buffer(reserve=table.nbytes * 5 // 4)
        self._buffer.write(table)

    def bind(self, binding: int) -> None:
        """Bind to a shader-storage binding; there must be chunks."""
        assert self._buffer is not None
        self._buffer.bind_to_storage_buffer(binding)

    def release(self) -> None:
        """Free the GPU memory."""
        if self._buffer is not None:
            self._buffer.release()
            self._buffer = None
