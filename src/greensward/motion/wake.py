"""Wind field with memory, which what moves pushes ahead of itself (Derstroff, section 2.3).

It is computed on the CPU, as a field of a few thousand cells is, so that it is the same on every device.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import release_all
from greensward.gpu.device import Device
from greensward.gpu.kernels import Bindings
from greensward.gpu.layouts import BlockBuffer, block
from greensward.gpu.view import anchor_near
from greensward.ground import HeightField
from greensward.motion.stateful import MotionStep, Saved
from greensward.objects.placing import height_of
from greensward.scene import InputError, Wake
from greensward.scene.objects import Object

WAKE_BLOCK = block(
    "Wake",
    ("origin_before", "ivec2"),  # number of the first cell along x and z, a frame ago
    ("origin", "ivec2"),
    ("times_s", "vec2"),  # of the frame before and of this one
    ("cells", "int"),  # a side; 0 without a wake
)
STEP_HZ = 60
"""Steps a second: the frames per second that the source's damping is for."""
SETTLE_STEPS = 4 * STEP_HZ
"""Steps for which objects have moved the air when a field begins, and the longest gap that it goes on after."""
CUT_M = 100.0
"""Way of the camera in a frame, or of an object in a step, that is a jump and pushes no air."""
_FAR = 6.0  # times reach_m: the bell-shaped curve is below 1e-14 there
_STILL_MPS = 1e-9
Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Mover:
    """Camera or object that moves the air, in one step."""

    at: Floats
    """Place: x and z."""
    above_m: float
    """Height above the ground."""
    velocity: Floats
    """Velocity along x and z, m/s."""
    downwash_mps2: float = 0.0
    """Outward acceleration around it."""


class WakeLayers:
    """The wind field on the GPU, of this frame and of the one before. Without cells it is only there to be bound."""

    def __init__(self, device: Device, cells: int) -> None:
        self._block = BlockBuffer(device.ctx, WAKE_BLOCK)
        self._block.set(cells=cells)
        side = max(cells, 1)
        self._shown = np.zeros((2, side, side, 2), np.float32)
        self._texture = device.ctx.texture_array((side, side, 2), 2, self._shown.tobytes(), dtype="f4")
        self._texture.filter = moderngl.NEAREST, moderngl.NEAREST
        self.bindings: Bindings = {"Wake": self._block, "wake_field": self._texture}
        """Block and velocities, by their names in shaders."""

    def show(self, before: "Grid", now: "Grid", times_s: tuple[float, float], anchor_ws: Floats) -> None:
        """Take over the fields of two instants; shaders count from the anchor, (3,)."""
        layers = np.stack([before.velocities, now.velocities]).astype(np.float32)
        if not np.array_equal(layers, self._shown):
            self._texture.write(layers)
            self._shown = layers
        anchor = np.floor(anchor_ws[[0, 2]] / now.cell_m).astype(np.int64)
        self._block.set(origin_before=before.origin - anchor, origin=now.origin - anchor, times_s=times_s)

    def release(self) -> None:
        """Free the GPU memory."""
        release_all(self._block, self._texture)


class Grid:
    """Velocities of the air at the centres of cells, in a square of cells around the camera's."""

    def __init__(self, cells: int, cell_m: float) -> None:
        self.cell_m = cell_m
        self.velocities: Floats = np.zeros((cells, cells, 2))
        """Velocities along x and z in m/s, by row (z) and column (x)."""
        self.origin: Indices = np.zeros(2, np.int64)
        """Numbers of the first cell along x and z; cell 0 begins at the world's origin."""

    def copy(self) -> "Grid":
        """Return a grid of the same velocities."""
        other = Grid(len(self.velocities), self.cell_m)
        other.velocities, other.origin = self.velocities.copy(), self.origin.copy()
        return other

    def follow(self, camera_ws: Floats) -> None:
        """Shift by whole cells so that the camera's is in the middle; the cells that come in are calm."""
        count = len(self.velocities)
        origin = np.floor(camera_ws[[0, 2]] / self.cell_m).astype(np.int64) - count // 2
        shift = origin - self.origin
        if not shift.any():
            return
        shifted = np.zeros_like(self.velocities)
        if (abs(shift) < count).all():
            (to_x, from_x), (to_z, from_z) = (
                (slice(max(-cells, 0), count - max(cells, 0)), slice(max(cells, 0), count + min(cells, 0)))
                for cells in shift
            )
            shifted[to_z, to_x] = self.velocities[from_z, from_x]
        self.velocities, self.origin = shifted, origin

    def push(self, mover: Mover, wake: Wake, step_s: float) -> None:
        """Accelerate the air around a mover, only forwards, and outwards by its downwash.

        k is the source's, times exp(-dy²) for a mover above the ground, which the source has not.
        """
        speed = float(np.hypot(*mover.velocity))
        if speed < _STILL_MPS and not mover.downwash_mps2:
            return
        far = _FAR * wake.reach_m
        low, high = (
            np.clip(np.floor((mover.at + side) / self.cell_m).astype(np.int64) - self.origin, 0, len(self.velocities))
            for side in (-far, far + self.cell_m)
        )
        x, z = (
            ((np.arange(low[i], high[i]) + self.origin[i] + 0.5) * self.cell_m - mover.at[i]) / wake.reach_m
            for i in (0, 1)
        )
        dx, dz = np.meshgrid(x, z)
        away = np.hypot(dx, dz)
        bell = np.exp(-(away * away) - (mover.above_m / wake.reach_m) ** 2)
        outwards = math.sqrt(2.0 * math.e) * mover.downwash_mps2 * away * bell  # |k| is 1 / sqrt(2 e) at most
        if speed >= _STILL_MPS:
            ahead = (dx * mover.velocity[0] + dz * mover.velocity[1]) / speed * bell
            outwards += np.clip(ahead, 0.0, 1.0) * wake.strength * speed
        by_unit = outwards * step_s / np.maximum(away, 1e-12)
        self.velocities[low[1] : high[1], low[0] : high[0]] += by_unit[..., None] * np.stack([dx, dz], -1)


class WindField:
    """The wake of a scene, advanced by fixed steps, so that it is the same at every frame rate."""

    def __init__(
        self, layers: WakeLayers, wake: Wake, heights: HeightField, objects: Sequence[Object], moving: Sequence[bool]
    ) -> None:
        self.settings = wake
        """Wind that it blows as; one of other numbers may take its place if the cells are the same."""
        self._layers = layers
        self._heights = heights
        self._moving = [i for i, (_, moves) in enumerate(zip(objects, moving, strict=False)) if moves]
        self._middles = np.array([[0.0, 0.5 * height_of(objects[i]), 0.0, 1.0] for i in self._moving])
        self._grid = Grid(wake.cells, wake.cell_m)
        self._steps: int | None = None
        self._time_s = 0.0
        self._camera = self._camera_stepped = np.zeros(3)
        """The camera at the frame before, and at the last step."""

    @property
    def _movers(self) -> list[int]:
        """Numbers of the objects that move the air."""
        return [] if self.settings.by == "camera" else self._moving

    def advance(self, step: MotionStep) -> None:
        """Advance the field to an instant, and show it and that of the frame before."""
        target = _steps_at(step.time_s)
        if self._begins_anew(step, target):
            self._steps = target - (SETTLE_STEPS if self._movers else 0)
            self._grid = Grid(self.settings.cells, self.settings.cell_m)
            self._camera, self._time_s = step.camera_ws.copy(), step.time_s
        if step.time_s == self._time_s:
            # a camera that moves while time stands still pushes no air
            self._camera_stepped = step.camera_ws.copy()
            self._grid.follow(step.camera_ws)
        self._run(step, min(_steps_at(step.previous_time_s), target))
        before = self._grid.copy()
        self._run(step, target)
        times_s = min(step.previous_time_s, step.time_s), step.time_s
        self._layers.show(before, self._grid, times_s, anchor_near(step.camera_ws))
        self._camera, self._time_s = step.camera_ws.copy(), step.time_s

    def _begins_anew(self, step: MotionStep, target: int) -> bool:
        """Return whether it begins calm: at first, back in time, after a gap, and where the camera jumps."""
        if self._steps is None or step.time_s < self._time_s or target - self._steps > SETTLE_STEPS:
            return True
        return float(np.linalg.norm(step.camera_ws - self._camera)) > CUT_M

    def _run(self, step: MotionStep, until: int) -> None:
        """Take the steps up to one of this number: v = damping * v + a dt."""
        assert self._steps is not None
        if self._steps >= until:
            return
        damping = self.settings.damping ** (1.0 / STEP_HZ)
        places = self._places(step.placed_at, self._steps)
        while self._steps < until:
            self._steps += 1
            camera, places_before = self._camera_at(step, self._steps / STEP_HZ), places
            places = self._places(step.placed_at, self._steps)
            self._grid.follow(camera)
            self._grid.velocities *= damping
            # speeds fade for ever otherwise, into numbers that processors are slow at
            self._grid.velocities[np.abs(self._grid.velocities) < 1e-9] = 0.0
            for mover in self._moving_air(camera, places_before, places):
                self._grid.push(mover, self.settings, 1.0 / STEP_HZ)
            self._camera_stepped = camera

    def _camera_at(self, step: MotionStep, time_s: float) -> Floats:
        """Place of the camera between the last frame and this one."""
        span = step.time_s - self._time_s
        part = min(max((time_s - self._time_s) / span, 0.0), 1.0) if span > 0.0 else 1.0
        return self._camera + part * (step.camera_ws - self._camera)

    def _places(self, placed_at: Callable[[float], Floats], steps: int) -> Floats:
        """Middles of the objects that move the air, (objects, 3)."""
        if not self._movers:
            return np.zeros((0, 3))
        places: Floats = np.einsum("nij,nj->ni", placed_at(steps / STEP_HZ)[self._movers], self._middles)[:, :3]
        return places

    def _moving_air(self, camera: Floats, places_before: Floats, places: Floats) -> Iterator[Mover]:
        """Yield what moves air of the grid: no object that stands still, or is far above the ground or beside it."""
        if self.settings.by != "objects":
            yield from self._movers_at(self._camera_stepped[None], camera[None], 0.0)
        jumps = np.linalg.norm(places - places_before, axis=1, keepdims=True) > CUT_M
        yield from self._movers_at(np.where(jumps, places, places_before), places, self.settings.downwash_mps2)

    def _movers_at(self, before: Floats, places: Floats, downwash_mps2: float) -> Iterator[Mover]:
        at, velocity = places[:, [0, 2]], (places - before)[:, [0, 2]] * STEP_HZ
        above_m = places[:, 1] - self._heights.height(at[:, 0], at[:, 1])
        cell = at / self._grid.cell_m - self._grid.origin
        far = _FAR * self.settings.reach_m
        outside = np.maximum(-cell, cell - len(self._grid.velocities)).max(axis=1) * self._grid.cell_m
        pushes = (outside < far) & (np.abs(above_m) < far)
        pushes &= (np.hypot(*velocity.T) >= _STILL_MPS) | (downwash_mps2 > 0.0)
        for i in np.flatnonzero(pushes):
            yield Mover(at[i], float(above_m[i]), velocity[i], downwash_mps2)

    # Saved and continued -------------------------------------------------------------------------------------

    def saved(self) -> Saved:
        """Copy everything that the next step depends on, as arrays."""
        return {
            "wake_velocities": self._grid.velocities.copy(),
            "wake_origin": self._grid.origin.copy(),
            "wake_cell_m": np.array(self._grid.cell_m),
            "wake_steps": np.array(self._steps or 0, np.int64),
            "wake_time_s": np.array(self._time_s),
            "wake_cameras": np.stack([self._camera, self._camera_stepped]),
        }

    def resume(self, saved: Mapping[str, npt.NDArray[Any]]) -> None:
        """Continue from what `saved` returned. Raises `InputError` where it does not fit the scene's wake."""
        now = self.saved()
        fits = all(name in saved and saved[name].shape == value.shape for name, value in now.items())
        if not fits or float(saved["wake_cell_m"]) != self._grid.cell_m:
            raise InputError("the checkpoint was made of a scene without this wake: use the same scene")
        self._grid.velocities = saved["wake_velocities"].astype(np.float64)
        self._grid.origin = saved["wake_origin"].astype(np.int64)
        self._steps, self._time_s = int(saved["wake_steps"]), float(saved["wake_time_s"])
        self._camera, self._camera_stepped = saved["wake_cameras"].astype(np.float64)

    def release(self) -> None:
        """Hold nothing on the GPU: the `Winds` free the layers."""


def _steps_at(time_s: float) -> int:
    return math.floor(time_s * STEP_HZ + 1e-6)
