"""Protocol of a measurement: warm-up, a recorded path, a fixed time step, medians with their spread."""

import gc
import math
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import moderngl
import numpy as np

from greensward.bench.floor import floor_ms
from greensward.bench.frame_statistics import counted, gpu_bytes
from greensward.gpu.device import Device
from greensward.gpu.timers import PassTimers
from greensward.io.camera_path import CameraPath
from greensward.renderer import Counts
from greensward.scene import Camera, GreenswardError

STEP_S = 1.0 / 60.0
PATH_S = 40.0
_ASIDE_M, _AHEAD_M, _TURN_DEG = 1.5, 2.0, 12.0
_FAR = 3.0  # interquartile ranges above the third quartile: an outlier, listed and counted
_MOST_OUTLIERS = 50
_FEW = 5


@dataclass(frozen=True)
class Pace:
    """Length of a measurement: number of frames, and the least and the most seconds."""

    name: str
    frames: int
    least_s: float = 0.0
    warm_up: int = 3
    most_s: float = math.inf
    """Time limit; once it is over, a few frames are enough."""
    warm_s: float = 0.0
    """Least duration of the warm-up frames: a GPU that idled while a scene was built needs about a second to raise
    its clock."""

    def goes_on(self, frames: int, lasted_s: float) -> bool:
        """Return whether another frame is due."""
        if frames >= self.frames:
            return lasted_s < self.least_s
        return frames < _FEW or lasted_s < self.most_s


def pace(protocol: str, frames: int | None, software: bool) -> Pace:
    """The named protocol; `frames` takes the place of its own number, and then no time is prescribed."""
    warm_s = 0.0 if software else 1.0
    if protocol == "thesis":
        return Pace("thesis", frames or 10_000, 0.0 if frames else 40.0, 3 if software else 30, warm_s=warm_s)
    warm_up, most_s = (2, 5.0) if software else (10, 30.0)
    return Pace("quick", frames or (7 if software else 61), 0.0, warm_up, math.inf if frames else most_s, warm_s)


class Subject(Protocol):
    """Subject of a measurement: `Renderer` or `InstancedStrips`."""

    device: Device
    timers: PassTimers

    @property
    def blades(self) -> int:
        """Blades sown."""

    @property
    def counts(self) -> Counts:
        """Counts of the last frame."""

    def draw(self, framebuffer: moderngl.Framebuffer, time_s: float = 0.0, *, camera: Camera | None = None) -> None:
        """Draw a frame."""


class DeviceLostError(GreenswardError):
    """The driver gave up in the middle of a measurement."""


def camera_on_path(camera: Camera, step: int, path: CameraPath | None = None) -> Camera:
    """The camera of a step of the path, which begins anew at its end.

    Without one it is a loop of 40 s aside and ahead, looking to both sides; it begins at rest.
    """
    if path:
        first_s = path.key[0].time_s
        return path.at(first_s + step * STEP_S % (path.end_s - first_s), camera)
    turn = 2.0 * math.pi * step * STEP_S / PATH_S
    x, y, z = camera.position_m
    tx, ty, tz = camera.target_m
    away = math.hypot(tx - x, tz - z) or 1.0
    ahead = (tx - x) / away, (tz - z) / away
    aside_m, ahead_m = _ASIDE_M * math.sin(turn), _AHEAD_M * 0.5 * (1.0 - math.cos(turn))
    angle = math.radians(_TURN_DEG) * math.sin(2.0 * turn)
    looking = (
        ahead[0] * math.cos(angle) - ahead[1] * math.sin(angle),
        ahead[0] * math.sin(angle) + ahead[1] * math.cos(angle),
    )
    x += ahead[0] * ahead_m - ahead[1] * aside_m
    z += ahead[1] * ahead_m + ahead[0] * aside_m
    return camera.model_copy(
        update={"position_m": (x, y, z), "target_m": (x + away * looking[0], ty, z + away * looking[1])}
    )


def camera_in_flight(camera: Camera, step: int, speed_mps: float) -> Camera:
    """The camera of a step of a straight and level flight in the direction in which it looks."""
    x, y, z = camera.position_m
    tx, ty, tz = camera.target_m
    gone = speed_mps * step * STEP_S / (math.hypot(tx - x, tz - z) or 1.0)
    dx, dz = (tx - x) * gone, (tz - z) * gone
    return camera.model_copy(update={"position_m": (x + dx, y, z + dz), "target_m": (tx + dx, ty, tz + dz)})


def clock(device: Device, timers: PassTimers) -> str:
    """Describe the clock that times the frames."""
    if timers.queried:
        return "GPU timer queries, each pass; a frame is their sum"
    if device.software:
        return "wall clock around finish(), as the CPU draws"
    return "wall clock around finish(), as this driver has no timer queries"


def measure(
    subject: Subject,
    camera: Camera,
    size: tuple[int, int],
    at: Pace,
    path: CameraPath | None = None,
    still: bool = False,
    began_s: float | None = None,
    flight_mps: float = 0.0,
) -> dict[str, Any]:
    """Measure frames of a subject; returns the columns of a row. Raises `DeviceLostError`.

    With `still` the camera stays where the path begins; with `flight_mps` it flies straight on instead. `began_s` is
    the `time.perf_counter()` at which the subject, which has drawn nothing yet, began to be built.
    """
    ctx = subject.device.ctx

    def camera_at(step: int) -> Camera:
        if flight_mps:
            return camera_in_flight(camera, step, flight_mps)
        return camera_on_path(camera, 0 if still else step, path)

    with subject.device.use():
        colour, depth = ctx.texture(size, 4), ctx.depth_renderbuffer(size)
        target = ctx.framebuffer([colour], depth)
        try:
            return _measured(subject, target, at, camera_at, began_s)
        finally:
            for part in (target, colour, depth):
                part.release()


def _measured(
    subject: Subject,
    target: moderngl.Framebuffer,
    at: Pace,
    camera_at: Callable[[int], Camera],
    began_s: float | None,
) -> dict[str, Any]:
    device = subject.device
    ctx = device.ctx
    first = camera_at(0)
    started, drawn, first_frame_s = time.perf_counter(), 0, None
    while drawn < at.warm_up or time.perf_counter() - started < at.warm_s:
        subject.draw(target, 0.0, camera=first)
        ctx.finish()
        drawn += 1
        if drawn == 1 and began_s is not None:
            first_frame_s = round(time.perf_counter() - began_s, 4)
    with counted(device) as submitted:
        subject.draw(target, 0.0, camera=first)
    counts = subject.counts
    nbytes = gpu_bytes(ctx)
    _refuse_lost(ctx)
    # else a full collection of all that was imported stops one frame of hundreds for 15 ms
    gc.collect()
    gc.freeze()
    times = _frames(subject, target, at, camera_at)
    gc.unfreeze()
    _refuse_lost(ctx)
    repeats = min(max(at.frames // 2, 3), 31)
    least_ms = floor_ms(
        device,
        target.size,
        # of blades drawn without a test, many are out of view; the primitives show which are not
        blades=counts.drawn if getattr(subject, "culls", True) else 0,
        primitives=submitted.primitives_in_view,
        blade_pixels=counts.pixels,
        repeats=repeats,
    )
    return {
        "blades_sown": subject.blades,
        "blades_considered": counts.considered,
        "blades_simulated": counts.simulated,
        "blades_drawn": counts.drawn,
        "blade_pixels": counts.pixels,
        "vertices": submitted.vertices,
        "primitives": submitted.primitives,
        "primitives_in_view": submitted.primitives_in_view,
        "draw_calls": submitted.draw_calls,
        "dispatches": submitted.dispatches,
        **times,
        "floor_ms": round(least_ms, 4),
        "over_floor": round(times["frame_ms_median"] / max(least_ms, 1e-6), 2),
        "gpu_bytes": nbytes,
        "first_frame_s": first_frame_s,
    }


def _frames(
    subject: Subject, target: moderngl.Framebuffer, at: Pace, camera_at: Callable[[int], Camera]
) -> dict[str, Any]:
    """Frames along the path. Where passes are timed by the clock, they are timed apart: that stalls between them."""
    queried = subject.timers.queried
    whole, wall, python, passes, cpu_passes = [], [], [], _Series(), _Series()
    subject.timers.enabled = queried
    step, began = 0, time.perf_counter()
    while at.goes_on(step, time.perf_counter() - began):
        seen_from = camera_at(step)
        subject.device.ctx.finish()
        started = time.perf_counter()
        subject.draw(target, step * STEP_S, camera=seen_from)
        python.append((time.perf_counter() - started) * 1e3)
        subject.device.ctx.finish()
        wall.append((time.perf_counter() - started) * 1e3)
        if queried:
            parts = subject.timers.milliseconds()
            passes.add(parts)
            cpu_passes.add(subject.timers.cpu_milliseconds())
            whole.append(sum(parts.values()))
        step += 1
    lasted_s = time.perf_counter() - began
    if not queried:
        whole = wall
        subject.timers.enabled = True
        slow = statistics.median(whole) > 1000.0
        for again in range(1 if slow else min(max(at.frames // 3, 3), 100)):
            subject.draw(target, again * STEP_S, camera=camera_at(again))
            passes.add(subject.timers.milliseconds())
    subject.timers.enabled = False
    return {
        "frames": step,
        "lasted_s": round(lasted_s, 2),
        **spread(whole),
        "wall_ms_median": round(statistics.median(wall), 4),
        "wall_ms_p95": round(float(np.percentile(wall, 95)), 4),
        "wall_ms_p99": round(float(np.percentile(wall, 99)), 4),
        "wall_ms_max": round(max(wall), 4),
        # where the CPU draws, the calls themselves do
        "cpu_ms_median": round(statistics.median(python), 4) if queried else None,
        "pass_ms": passes.medians(),
        "cpu_pass_ms": cpu_passes.medians(),
    }


def spread(frames_ms: Sequence[float]) -> dict[str, Any]:
    """Columns that describe the distribution of frame times. Outliers are in all of them, and are listed."""
    values = np.asarray(frames_ms, np.float64)
    low, middle, high, p95 = np.percentile(values, (25, 50, 75, 95))
    outliers = np.sort(values[values > high + _FAR * max(high - low, 0.01 * middle)])[::-1]
    described = {
        "frame_ms_median": middle,
        "frame_ms_mean": values.mean(),
        "frame_ms_p25": low,
        "frame_ms_p75": high,
        "frame_ms_p95": p95,
        "frame_ms_min": values.min(),
        "frame_ms_max": values.max(),
    }
    return {
        **{name: round(float(value), 4) for name, value in described.items()},
        "outliers": len(outliers),
        "outliers_ms": [round(float(value), 4) for value in outliers[:_MOST_OUTLIERS]],
    }


class _Series:
    """Times of passes, frame by frame."""

    def __init__(self) -> None:
        self._values: dict[str, list[float]] = {}

    def add(self, parts: dict[str, float]) -> None:
        for name, value in parts.items():
            self._values.setdefault(name, []).append(value)

    def medians(self) -> dict[str, float]:
        return {name: round(statistics.median(values), 4) for name, values in self._values.items()}


def _refuse_lost(ctx: moderngl.Context) -> None:
    if (error := ctx.error) != "GL_NO_ERROR":
        raise DeviceLostError(f"the driver failed with {error}")
