"""Camera controller: walking, flying and orbiting, from requested motion to a camera."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from greensward.ground import HeightField
from greensward.scene import Camera, GreenswardError
from greensward.scene.light import INTRINSICS
from greensward.viewer.obstacles import Obstacles
from greensward.viewpoint import place

Floats = npt.NDArray[np.float64]
Mode = Literal["walk", "fly", "orbit"]
MODES: tuple[Mode, ...] = ("walk", "fly", "orbit")
_EYE_M, _LOWEST_EYE_M, _HIGHEST_EYE_M = 1.7, 0.25, 4.0
_WALK_MPS, _FLY_MPS, _FAST = 1.8, 6.0, 4.0
_DEGREES_PER_PX = 0.18
_STEEPEST_DEG = 58.0
_SOFTNESS_S = 0.09  # time constant of a change of speed
_CLEAR_M = 0.2  # least height of a flying camera above the ground
_FURTHEST_M = 999_980.0  # so that its target can be written in a scene too
_UP_DOWN_DEG = 89.0
_FOV_DEG = (2.0, 110.0)


@dataclass(frozen=True)
class Intent:
    """Requested motion: axes from -1 to 1, and a turn of the camera in mouse pixels."""

    ahead: float = 0.0
    right: float = 0.0
    up: float = 0.0
    turn_px: tuple[float, float] = (0.0, 0.0)
    fast: bool = False


class CameraController:
    """Position and direction of the camera. Angles are radians: yaw clockwise from north, pitch up."""

    def __init__(self, camera: Camera, heights: HeightField) -> None:
        self.mode: Mode = "walk" if heights.exists else "orbit"
        self.speed_factor = 1.0
        self._velocity = np.zeros(3)
        self.yaw = self.pitch = 0.0
        self.set_world(heights, Obstacles(()), water_m=-math.inf)
        self.set_camera(camera)

    def set_world(self, heights: HeightField, obstacles: Obstacles, water_m: float) -> None:
        """Set ground, obstacles and water level of the scene."""
        self._heights, self._obstacles, self._water_m = heights, obstacles, water_m
        if not heights.exists and self.mode == "walk":
            self.mode = "fly"

    def set_camera(self, camera: Camera) -> None:
        """Take position, direction and lens of a camera."""
        # a window shows straight lines; from what bends them, the middle of the picture
        self.lens = camera if camera.is_straight else camera.model_copy(update=_straight(camera))
        try:
            position, target = place(camera, self._heights)
        except GreenswardError:  # below the ground, say; the renderer reports it
            position, target = np.array(camera.position_m), np.array(camera.target_m)
        self.position_ws = position
        self._look_along(target - position)
        self.pivot_ws = self._pivot(float(np.linalg.norm(target - position)))
        self._keep_height()

    def _keep_height(self) -> None:
        """Walk at the current height above the ground; fly if it is too high for that."""
        above_m = self._above_ground(self.position_ws)
        self._eye_m = min(max(above_m, _LOWEST_EYE_M), _HIGHEST_EYE_M)
        self._velocity[:] = 0.0
        if self.mode == "walk" and above_m > _HIGHEST_EYE_M:
            self.mode = "fly"

    def choose(self, mode: Mode) -> None:
        """Switch to walking, flying or orbiting."""
        if mode == "walk" and not self._heights.exists:
            return
        if mode == "orbit":
            self.pivot_ws = self._pivot(12.0)
        if mode == "walk" and self.mode != "walk":
            self._eye_m = _EYE_M
        self.mode = mode
        self._velocity[:] = 0.0

    def toggle_walk(self) -> None:
        """Walk, or fly if the camera walks already."""
        self.choose("walk" if self.mode != "walk" else "fly")

    def toggle_orbit(self) -> None:
        """Orbit the point in view, or fly if the camera orbits already."""
        self.choose("orbit" if self.mode != "orbit" else "fly")

    def set_pivot(self) -> None:
        """Take the point in view as the centre for `orbit`."""
        if self.mode != "orbit":
            self.pivot_ws = self._pivot(12.0)

    def orbit(self, turn_px: tuple[float, float]) -> None:
        """Orbit the pivot by mouse pixels, whatever the mode."""
        mode, self.mode = self.mode, "orbit"
        self.move(Intent(turn_px=turn_px), 0.0)
        self.mode = mode
        self._keep_height()

    def zoom(self, factor: float) -> None:
        """Multiply the field of view by a factor."""
        lens = self.lens
        fov = min(max(lens.fov_y_deg * factor, _FOV_DEG[0]), _FOV_DEG[1])
        measured = {name: px / factor for name in ("fx_px", "fy_px") if (px := getattr(lens, name)) is not None}
        height = {"view_height_m": lens.view_height_m * factor} if lens.projection == "orthographic" else {}
        self.lens = lens.model_copy(update={"fov_y_deg": fov, **measured, **height})

    @property
    def forward_ws(self) -> Floats:
        """Unit direction of view, (3,)."""
        flat = math.cos(self.pitch)
        return np.array([math.sin(self.yaw) * flat, math.sin(self.pitch), -math.cos(self.yaw) * flat])

    def target(self, distance_m: float) -> Floats:
        """Return the point of the ground in view, (3,), or one at this distance if there is none nearby."""
        hit = ground_hit(self._heights, self.position_ws, self.forward_ws, 3.0 * distance_m)
        return hit if hit is not None else self.position_ws + distance_m * self.forward_ws

    def camera(self) -> Camera:
        """Return the current camera; its heights are absolute."""
        position = np.clip(self.position_ws, -_FURTHEST_M, _FURTHEST_M)
        target = position + 10.0 * self.forward_ws
        return self.lens.model_copy(
            update={
                "position_m": tuple(round(float(x), 6) for x in position),
                "target_m": tuple(round(float(x), 6) for x in target),
                "height_above_ground": False,
            }
        )

    def move(self, intent: Intent, seconds: float) -> bool:
        """Move for this many seconds; return True if the camera changed."""
        before = (*self.position_ws, self.yaw, self.pitch)
        turn = math.radians(_DEGREES_PER_PX) * (self.lens.fov_y_deg / 50.0)
        self.yaw = (self.yaw + turn * intent.turn_px[0]) % math.tau
        limit = math.radians(_UP_DOWN_DEG)
        self.pitch = min(max(self.pitch - turn * intent.turn_px[1], -limit), limit)
        if self.mode == "orbit":
            self._move_on_orbit(intent, seconds)
        else:
            self._move_freely(intent, seconds)
        after = (*self.position_ws, self.yaw, self.pitch)
        return any(abs(a - b) > 1e-7 for a, b in zip(before, after, strict=True))

    def _move_freely(self, intent: Intent, seconds: float) -> None:
        walks = self.mode == "walk"
        heading = self.forward_ws
        if walks:
            heading = np.array([math.sin(self.yaw), 0.0, -math.cos(self.yaw)])
        right = np.array([math.cos(self.yaw), 0.0, math.sin(self.yaw)])
        velocity = intent.ahead * heading + intent.right * right
        velocity[1] += 0.0 if walks else intent.up
        length = float(np.linalg.norm(velocity))
        if length > 1.0:
            velocity /= length
        velocity *= (_WALK_MPS if walks else _FLY_MPS) * self.speed_factor * (_FAST if intent.fast else 1.0)
        self._velocity += (velocity - self._velocity) * (1.0 - math.exp(-seconds / _SOFTNESS_S))
        if float(np.abs(self._velocity).max()) < 1e-3 and not length:
            self._velocity[:] = 0.0
        if walks and intent.up:
            self._eye_m = min(max(self._eye_m * math.exp(intent.up * seconds), _LOWEST_EYE_M), _HIGHEST_EYE_M)
        # short steps, none of which crosses a fence
        steps = max(1, math.ceil(float(np.linalg.norm(self._velocity)) * seconds / 0.2))
        for _ in range(min(steps, 64)):
            self._step(self._velocity * (seconds / steps), walks)

    def _step(self, offset: Floats, walks: bool) -> None:
        at = self.position_ws + offset
        feet_m = at[1] - (self._eye_m if walks else 0.3)
        at[[0, 2]] += self._obstacles.push(at, feet_m)
        if walks:
            if self._too_steep(at):
                return
            floor = float(self._heights.height(at[0], at[2]))
            wanted = max(floor, self._water_m) + self._eye_m
            # smooths small bumps of the ground
            at[1] = max(self.position_ws[1] + 0.35 * (wanted - self.position_ws[1]), floor + _LOWEST_EYE_M)
        at[1] = max(at[1], self._lowest(at))
        self.position_ws = at

    def _too_steep(self, at: Floats) -> bool:
        before, after = (float(self._heights.height(p[0], p[2])) for p in (self.position_ws, at))
        run = float(np.hypot(at[0] - self.position_ws[0], at[2] - self.position_ws[2]))
        return run > 0.0 and after - before > run * math.tan(math.radians(_STEEPEST_DEG))

    def _lowest(self, at: Floats) -> float:
        floor = float(self._heights.height(at[0], at[2])) if self._heights.exists else -math.inf
        return max(floor, self._water_m) + (_CLEAR_M if math.isfinite(max(floor, self._water_m)) else 0.0)

    def _move_on_orbit(self, intent: Intent, seconds: float) -> None:
        speed = self.speed_factor * (_FAST if intent.fast else 1.0)
        self.yaw = (self.yaw - 0.9 * speed * intent.right * seconds) % math.tau
        distance = float(np.linalg.norm(self.position_ws - self.pivot_ws))
        distance = min(max(distance * math.exp(-1.2 * speed * intent.ahead * seconds), 0.4), 1e5)
        self.pivot_ws[1] += 0.4 * distance * speed * intent.up * seconds
        at = self.pivot_ws - distance * self.forward_ws
        if at[1] < self._lowest(at):
            # up along the orbit rather than into the ground
            rise = self._lowest(at) - self.pivot_ws[1]
            if abs(rise) < distance:
                self.pitch = -math.asin(rise / distance)
                at = self.pivot_ws - distance * self.forward_ws
            at[1] = max(at[1], self._lowest(at))
        self.position_ws = at

    def _look_along(self, direction: Sequence[float] | Floats) -> None:
        x, y, z = (float(part) for part in direction)
        self.yaw = math.atan2(x, -z) % math.tau
        self.pitch = math.atan2(y, math.hypot(x, z))

    def _above_ground(self, at: Floats) -> float:
        return float(at[1] - self._heights.height(at[0], at[2])) if self._heights.exists else _EYE_M

    def _pivot(self, distance_m: float) -> Floats:
        hit = ground_hit(self._heights, self.position_ws, self.forward_ws, 60.0)
        return hit if hit is not None else self.position_ws + min(distance_m, 30.0) * self.forward_ws


def _straight(camera: Camera) -> dict[str, object]:
    if camera.projection == "perspective":
        return {"distortion": ()}
    fov = min(camera.fov_y_deg, _FOV_DEG[1])
    return {"projection": "perspective", "fov_y_deg": fov, **dict.fromkeys(INTRINSICS)}


def ground_hit(
    heights: HeightField, from_ws: Floats, direction_ws: Floats, furthest_m: float = 2000.0
) -> Floats | None:
    """Return the first point of a ray on the ground, (3,), or None."""
    if not heights.exists:
        return None
    distances = np.concatenate([np.linspace(0.0, 20.0, 81), np.geomspace(20.0, furthest_m, 240)[1:]])
    points = from_ws + distances[:, None] * direction_ws
    below = points[:, 1] < heights.height(points[:, 0], points[:, 2])
    if not below.any():
        return None
    i = int(below.argmax())
    low, high = distances[max(i - 1, 0)], distances[i]
    for _ in range(24):
        middle = 0.5 * (low + high)
        at = from_ws + middle * direction_ws
        low, high = (low, middle) if at[1] < heights.height(at[0], at[2]) else (middle, high)
    hit: Floats = from_ws + high * direction_ws
    return hit
