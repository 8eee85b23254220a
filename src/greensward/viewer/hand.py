"""The mouse over the picture: it turns the head, holds a brush to the ground, or drags things about."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from greensward.gpu.view import View
from greensward.scene import Camera, GreenswardError
from greensward.viewer import controls
from greensward.viewer.fields import Path, value_at
from greensward.viewer.handles import Handle, handles_of
from greensward.viewer.session import Session
from greensward.viewer.walker import ground_hit
from greensward.viewpoint import camera_view

Floats = npt.NDArray[np.float64]
Spot = tuple[float, float]
Area = tuple[int, int, int, int]
"""x, y, width and height in points of the window."""
_NEAR = 14.0  # points


@dataclass(frozen=True, eq=False)
class Sight:
    """What is seen where in the window: pictures of one view, side by side."""

    view: View | None
    """None where the camera stands where none can."""
    areas: Sequence[Area]

    @classmethod
    def of(cls, camera: Camera, session: Session, areas: Sequence[Area]) -> "Sight":
        """What a camera sees."""
        _, _, width, height = areas[-1]
        try:
            return cls(camera_view(camera, session.heights, (width, height)), areas)
        except GreenswardError:
            return cls(None, areas)

    def ray(self, spot: Spot) -> Floats | None:
        """The direction in which a point of the window looks, (3,); None beside the pictures."""
        for x, y, width, height in self.areas:
            if self.view and x <= spot[0] < x + width and y <= spot[1] < y + height:
                right, up = 2.0 * (spot[0] - x) / width - 1.0, 1.0 - 2.0 * (spot[1] - y) / height
                way = self.view.rays_ws[0] + right * self.view.rays_ws[1] + up * self.view.rays_ws[2]
                result: Floats = way / np.linalg.norm(way)
                return result
        return None

    def spot(self, point_ws: Floats) -> Spot | None:
        """Where a point of the world lies in the last picture; None where it is not in view."""
        if self.view is None:
            return None
        clip = self.view.clip_from_world @ np.array([*point_ws, 1.0])
        if clip[3] <= 1e-6 or abs(clip[0]) > clip[3] or abs(clip[1]) > clip[3]:
            return None
        x, y, width, height = self.areas[-1]
        return float(x + (0.5 + 0.5 * clip[0] / clip[3]) * width), float(y + (0.5 - 0.5 * clip[1] / clip[3]) * height)


class Hand:
    """The mouse, and what it holds."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._mouse: Spot = (0.0, 0.0)
        self._turned: Spot = (0.0, 0.0)
        self._paints = False
        self._sight = Sight(None, [(0, 0, 1, 1)])
        self.captured = False
        """Whether the mouse turns the head, and is not to be seen."""
        self.on_ground: Floats | None = None
        """The point of the ground below the mouse, (3,)."""
        self.handles: list[Handle] = []
        """What can be dragged."""
        self.held: Handle | None = None
        self.near: Path | None = None
        """Which handle a click would take."""

    @property
    def busy(self) -> bool:
        """Whether a button holds it to something."""
        return self.captured or self._paints or self.held is not None

    def turned(self) -> Spot:
        """How far the mouse has turned the head since this was last asked, in points."""
        turned, self._turned = self._turned, (0.0, 0.0)
        return turned

    def move(self, x: float, y: float) -> None:
        """The mouse is here now."""
        if self.captured:
            self._turned = self._turned[0] + x - self._mouse[0], self._turned[1] + y - self._mouse[1]
        self._mouse = (x, y)

    def press(self, button: controls.Button) -> None:
        """A button goes down over the picture."""
        session = self._session
        self.reach(self._sight, free=True)  # a frame ago the mouse may have been over a widget
        if button != "left" or session.tool == "look":
            self.captured = True
        elif session.tool == "move":
            self.held = next((handle for handle in self.handles if handle.path == self.near), None)
            self.captured = self.held is None  # where nothing is, one looks around
        elif self.on_ground is not None:
            self._paints = True
            self._touch(self.on_ground)

    def release(self) -> bool:
        """A button goes up; whether it had held something."""
        was = self.busy
        if self._paints:
            self._session.lift()
        if self.held is not None:
            if self._is_there(self.held):
                self._put(self.held)
            self._session.history.seal()
        self.captured, self._paints, self.held = False, False, None
        return was

    def wheel(self, y: float, pace: bool) -> None:
        """Walk faster or slower, or take a wider or narrower brush."""
        session = self._session
        if pace or session.tool in ("look", "move"):
            session.walker.pace = min(max(session.walker.pace * 1.15**y, 0.05), 50.0)
        else:
            session.brush = replace(session.brush, radius_m=min(max(session.brush.radius_m * 1.15**y, 0.1), 50.0))

    def reach(self, sight: Sight, free: bool) -> None:
        """Find what lies under the mouse, and let brush or handle follow; `free` says that no widget is there."""
        session = self._session
        self._sight = sight
        self.on_ground, self.near, self.handles = None, None, []
        if session.tool == "look":
            return
        if free and not self.captured and (way := sight.ray(self._mouse)) is not None:
            self.on_ground = ground_hit(session.heights, session.walker.position_ws, way)
        if session.tool == "move":
            self._reach_for_handles(sight, free)
        elif self._paints and self.on_ground is not None:
            self._touch(self.on_ground)

    def _reach_for_handles(self, sight: Sight, free: bool) -> None:
        session = self._session
        self.handles = handles_of(session.scene, session.heights, session.walker.position_ws)
        if self.held is None:
            spots = [(sight.spot(handle.at_ws), handle.path) for handle in self.handles]
            near = [(math.dist(spot, self._mouse), path) for spot, path in spots if spot is not None]
            away, path = min(near, key=lambda each: each[0], default=(math.inf, None))
            self.near = path if free and away <= _NEAR else None
            return
        if not self._is_there(self.held):
            self.held = None
            return
        held = self.held
        if self.on_ground is not None:
            held = self.held = held.moved(self.on_ground, session.heights)
            if held.live:
                self._put(held)
        self.handles = [held if each.path == held.path else each for each in self.handles]

    def _is_there(self, handle: Handle) -> bool:
        """Whether the scene still has it: a file that changed meanwhile may not."""
        try:
            return value_at(self._session.scene, handle.path) is not None
        except (IndexError, AttributeError):
            return False

    def _put(self, handle: Handle) -> None:
        before = value_at(self._session.scene, handle.path)
        self._session.change(handle.path, handle.value(before), drag=True)

    def _touch(self, ground_ws: Floats) -> None:
        self._session.touch((float(ground_ws[0]), float(ground_ws[2])))
