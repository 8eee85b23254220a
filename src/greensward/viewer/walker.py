"""Someone who walks, flies or circles through a scene: from what is asked of them to a camera."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from greensward.ground import HeightField
from greensward.scene import Camera, GreenswardError
from greensward.viewer.obstacles import Obstacles
from greensward.viewpoint import place

Floats = npt.NDArray[np.float64]
Mode = Literal["walk", "fly", "orbit"]
MODES: tuple[Mode, ...] = ("walk", "fly", "orbit")
_EYE_M, _LOWEST_EYE_M, _HIGHEST_EYE_M = 1.7, 0.25, 4.0
_WALK_MPS, _FLY_MPS, _FAST = 1.8, 6.0, 4.0
_DEGREES_PER_PX = 0.18
_STEEPEST_DEG = 58.0
_SOFTNESS_S = 0.09  # time after which a change of speed is two thirds done
_CLEAR_M = 0.2  # kept between a flying eye and the ground
_UP_DOWN_DEG = 89.0
_FOV_DEG = (2.0, 110.0)


@dataclass(frozen=True)
class Intent:
    """Where someone wants to go, each from -1 to 1, and how they turn their head, in pixels of a mouse."""

    ahead: float = 0.0
    right: float = 0.0
    up: float = 0.0
    turn_px: tuple[float, float] = (0.0, 0.0)
    fast: bool = False


class Walker:
    """An eye in a scene. Angles are radians: yaw clockwise from north, pitch up."""

    def __init__(self, camera: Camera, heights: HeightField) -> None:
        self.mode: Mode = "walk" if heights.there else "orbit"
        self.pace = 1.0
        """Factor on the speed."""
        self._velocity = np.zeros(3)
        self.yaw = self.pitch = 0.0
        self.enter(heights, Obstacles(()), water_m=-math.inf)
        self.look_from(camera)

    def enter(self, heights: HeightField, obstacles: Obstacles, water_m: float) -> None:
        """What can be walked on and run into from now on."""
        self._heights, self._obstacles, self._water_m = heights, obstacles, water_m
        if not heights.there and self.mode == "walk":
            self.mode = "fly"

    def look_from(self, camera: Camera) -> None:
        """Stand where a camera is."""
        self.lens = camera
        try:
            position, target = place(camera, self._heights)
        except GreenswardError:  # in the ground, say; whoever draws it tells
            position, target = np.array(camera.position_m), np.array(camera.target_m)
        self.position_ws = position
        self._towards(target - position)
        self.pivot_ws = self._pivot(float(np.linalg.norm(target - position)))
        self._stand()

    def _stand(self) -> None:
        """Stay at the height that this place has; too high for someone who walks, they fly."""
        above_m = self._above_ground(self.position_ws)
        self._eye_m = min(max(above_m, _LOWEST_EYE_M), _HIGHEST_EYE_M)
        self._velocity[:] = 0.0
        if self.mode == "walk" and above_m > _HIGHEST_EYE_M:
            self.mode = "fly"

    def choose(self, mode: Mode) -> None:
        """Walk, fly or orbit from here."""
        if mode == "walk" and not self._heights.there:
            return
        if mode == "orbit":
            self.pivot_ws = self._pivot(12.0)
        if mode == "walk" and self.mode != "walk":
            self._eye_m = _EYE_M
        self.mode = mode
        self._velocity[:] = 0.0

    def hold(self) -> None:
        """Take hold of what is looked at, for `circle`."""
        if self.mode != "orbit":
            self.pivot_ws = self._pivot(12.0)

    def circle(self, turn_px: tuple[float, float]) -> None:
        """Go around what is held by pixels of a mouse, and walk or fly on from there."""
        mode, self.mode = self.mode, "orbit"
        self.move(Intent(turn_px=turn_px), 0.0)
        self.mode = mode
        self._stand()

    def zoom(self, factor: float) -> None:
        """See so many times as much."""
        fov = min(max(self.lens.fov_y_deg * factor, _FOV_DEG[0]), _FOV_DEG[1])
        self.lens = self.lens.model_copy(update={"fov_y_deg": fov})

    @property
    def forward_ws(self) -> Floats:
        """Where it looks, of unit length."""
        flat = math.cos(self.pitch)
        return np.array([math.sin(self.yaw) * flat, math.sin(self.pitch), -math.cos(self.yaw) * flat])

    def aim(self, away_m: float) -> Floats:
        """A point in front, (3,): of the ground if it looks down at it nearby, or at this distance."""
        hit = ground_hit(self._heights, self.position_ws, self.forward_ws, 3.0 * away_m)
        return hit if hit is not None else self.position_ws + away_m * self.forward_ws

    def camera(self) -> Camera:
        """What it sees, as a camera of the scene, heights in the world."""
        position, target = self.position_ws, self.position_ws + 10.0 * self.forward_ws
        return self.lens.model_copy(
            update={
                "position_m": tuple(round(float(x), 6) for x in position),
                "target_m": tuple(round(float(x), 6) for x in target),
                "height_above_ground": False,
            }
        )

    def move(self, intent: Intent, seconds: float) -> bool:
        """Go on by so many seconds; whether anything changed."""
        before = (*self.position_ws, self.yaw, self.pitch)
        turn = math.radians(_DEGREES_PER_PX) * (self.lens.fov_y_deg / 50.0)
        self.yaw = (self.yaw + turn * intent.turn_px[0]) % math.tau
        limit = math.radians(_UP_DOWN_DEG)
        self.pitch = min(max(self.pitch - turn * intent.turn_px[1], -limit), limit)
        if self.mode == "orbit":
            self._circle(intent, seconds)
        else:
            self._go(intent, seconds)
        after = (*self.position_ws, self.yaw, self.pitch)
        return any(abs(a - b) > 1e-7 for a, b in zip(before, after, strict=True))

    def _go(self, intent: Intent, seconds: float) -> None:
        walks = self.mode == "walk"
        heading = self.forward_ws
        if walks:
            heading = np.array([math.sin(self.yaw), 0.0, -math.cos(self.yaw)])
        right = np.array([math.cos(self.yaw), 0.0, math.sin(self.yaw)])
        wish = intent.ahead * heading + intent.right * right
        wish[1] += 0.0 if walks else intent.up
        length = float(np.linalg.norm(wish))
        if length > 1.0:
            wish /= length
        wish *= (_WALK_MPS if walks else _FLY_MPS) * self.pace * (_FAST if intent.fast else 1.0)
        self._velocity += (wish - self._velocity) * (1.0 - math.exp(-seconds / _SOFTNESS_S))
        if float(np.abs(self._velocity).max()) < 1e-3 and not length:
            self._velocity[:] = 0.0
        if walks and intent.up:
            self._eye_m = min(max(self._eye_m * math.exp(intent.up * seconds), _LOWEST_EYE_M), _HIGHEST_EYE_M)
        # no step leaps through a fence
        steps = max(1, math.ceil(float(np.linalg.norm(self._velocity)) * seconds / 0.2))
        for _ in range(min(steps, 64)):
            self._step(self._velocity * (seconds / steps), walks)

    def _step(self, way: Floats, walks: bool) -> None:
        at = self.position_ws + way
        feet_m = at[1] - (self._eye_m if walks else 0.3)
        at[[0, 2]] += self._obstacles.push(at, feet_m)
        if walks:
            if self._too_steep(at):
                return
            floor = float(self._heights.height(at[0], at[2]))
            wanted = max(floor, self._water_m) + self._eye_m
            # feet find small bumps, the head does not
            at[1] = max(self.position_ws[1] + 0.35 * (wanted - self.position_ws[1]), floor + _LOWEST_EYE_M)
        at[1] = max(at[1], self._lowest(at))
        self.position_ws = at

    def _too_steep(self, at: Floats) -> bool:
        here, there = (float(self._heights.height(p[0], p[2])) for p in (self.position_ws, at))
        run = float(np.hypot(at[0] - self.position_ws[0], at[2] - self.position_ws[2]))
        return run > 0.0 and there - here > run * math.tan(math.radians(_STEEPEST_DEG))

    def _lowest(self, at: Floats) -> float:
        floor = float(self._heights.height(at[0], at[2])) if self._heights.there else -math.inf
        return max(floor, self._water_m) + (_CLEAR_M if math.isfinite(max(floor, self._water_m)) else 0.0)

    def _circle(self, intent: Intent, seconds: float) -> None:
        fast = self.pace * (_FAST if intent.fast else 1.0)
        self.yaw = (self.yaw - 0.9 * fast * intent.right * seconds) % math.tau
        away = float(np.linalg.norm(self.position_ws - self.pivot_ws))
        away = min(max(away * math.exp(-1.2 * fast * intent.ahead * seconds), 0.4), 1e5)
        self.pivot_ws[1] += 0.4 * away * fast * intent.up * seconds
        at = self.pivot_ws - away * self.forward_ws
        if at[1] < self._lowest(at):
            # up along the circle rather than into the ground
            rise = self._lowest(at) - self.pivot_ws[1]
            if abs(rise) < away:
                self.pitch = -math.asin(rise / away)
                at = self.pivot_ws - away * self.forward_ws
            at[1] = max(at[1], self._lowest(at))
        self.position_ws = at

    def _towards(self, way: Sequence[float] | Floats) -> None:
        x, y, z = (float(part) for part in way)
        self.yaw = math.atan2(x, -z) % math.tau
        self.pitch = math.atan2(y, math.hypot(x, z))

    def _above_ground(self, at: Floats) -> float:
        return float(at[1] - self._heights.height(at[0], at[2])) if self._heights.there else _EYE_M

    def _pivot(self, away_m: float) -> Floats:
        hit = ground_hit(self._heights, self.position_ws, self.forward_ws, 60.0)
        return hit if hit is not None else self.position_ws + min(away_m, 30.0) * self.forward_ws


def ground_hit(heights: HeightField, from_ws: Floats, way_ws: Floats, furthest_m: float = 2000.0) -> Floats | None:
    """Where a ray meets the ground, (3,), or None."""
    if not heights.there:
        return None
    away = np.concatenate([np.linspace(0.0, 20.0, 81), np.geomspace(20.0, furthest_m, 240)[1:]])
    points = from_ws + away[:, None] * way_ws
    below = points[:, 1] < heights.height(points[:, 0], points[:, 2])
    if not below.any():
        return None
    i = int(below.argmax())
    low, high = away[max(i - 1, 0)], away[i]
    for _ in range(24):
        middle = 0.5 * (low + high)
        at = from_ws + middle * way_ws
        low, high = (low, middle) if at[1] < heights.height(at[0], at[2]) else (middle, high)
    hit: Floats = from_ws + high * way_ws
    return hit
