"""Someone who looks about in a scene: turns, walks, circles around what they look at, and zooms."""

import math

import numpy as np
import numpy.typing as npt

from greensward.ground import HeightField
from greensward.scene import Camera
from greensward.viewpoint import place

_RADIANS_PER_PX = math.radians(0.2)
_WALK_MPS, _FAST = 1.8, 4.0
_LOWEST_M = 0.2
_STEEPEST = math.radians(89.0)
_FOV_DEG = (2.0, 110.0)


class Eye:
    """Where it is and what it sees. Angles are radians: yaw clockwise from north, pitch up."""

    def __init__(self, camera: Camera, heights: HeightField) -> None:
        self._lens, self._heights = camera, heights
        self.position_ws, target = place(camera, heights)
        x, y, z = target - self.position_ws
        self.away_m = float(np.linalg.norm(target - self.position_ws))
        """How far off that is which it circles around."""
        self.yaw, self.pitch = math.atan2(x, -z), math.atan2(y, math.hypot(x, z))

    @property
    def ahead_ws(self) -> npt.NDArray[np.float64]:
        """Where it looks, of unit length, (3,)."""
        flat = math.cos(self.pitch)
        return np.array([math.sin(self.yaw) * flat, math.sin(self.pitch), -math.cos(self.yaw) * flat])

    def camera(self) -> Camera:
        """What it sees, as a camera of the scene; heights are those of the world."""
        target = self.position_ws + self.away_m * self.ahead_ws
        return self._lens.model_copy(
            update={
                "position_m": tuple(map(float, self.position_ws)),
                "target_m": tuple(map(float, target)),
                "height_above_ground": False,
            }
        )

    def turn(self, right_px: float, down_px: float) -> None:
        """Turn the head by pixels of a mouse."""
        step = _RADIANS_PER_PX * self._lens.fov_y_deg / 50.0
        self.yaw += step * right_px
        self.pitch = min(max(self.pitch - step * down_px, -_STEEPEST), _STEEPEST)

    def circle(self, right_px: float, down_px: float) -> None:
        """Go around what it looks at, as if a mouse dragged that."""
        middle = self.position_ws + self.away_m * self.ahead_ws
        self.yaw += _RADIANS_PER_PX * right_px
        self.pitch = min(max(self.pitch - _RADIANS_PER_PX * down_px, -_STEEPEST), _STEEPEST)
        self.position_ws = middle - self.away_m * self.ahead_ws
        self._stay_above_ground()

    def go(self, ahead: float, right: float, up: float, seconds: float, fast: bool = False) -> None:
        """Walk for so many seconds, over the ground if there is one; each way from -1 to 1."""
        walks = self._heights.there
        forward = np.array([math.sin(self.yaw), 0.0, -math.cos(self.yaw)]) if walks else self.ahead_ws
        way = ahead * forward + right * np.array([math.cos(self.yaw), 0.0, math.sin(self.yaw)])
        step = way * min(1.0, 1.0 / max(float(np.linalg.norm(way)), 1e-9)) + np.array([0.0, up, 0.0])
        before = self._ground_m()
        self.position_ws = self.position_ws + step * _WALK_MPS * (_FAST if fast else 1.0) * seconds
        if walks:
            self.position_ws[1] += self._ground_m() - before
        self._stay_above_ground()

    def zoom(self, factor: float) -> None:
        """See so many times as much."""
        fov = min(max(self._lens.fov_y_deg * factor, _FOV_DEG[0]), _FOV_DEG[1])
        self._lens = self._lens.model_copy(update={"fov_y_deg": fov})

    def _ground_m(self) -> float:
        return float(self._heights.height(self.position_ws[0], self.position_ws[2]))

    def _stay_above_ground(self) -> None:
        if self._heights.there:
            self.position_ws[1] = max(self.position_ws[1], self._ground_m() + _LOWEST_M)
