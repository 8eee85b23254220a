"""Mouse input over the viewports: turning the camera, painting with a brush, dragging handles."""

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from greensward.viewer.camera_controller import ground_hit
from greensward.viewer.fields import KeyPath, value_at
from greensward.viewer.handles import Handle, handles_of
from greensward.viewer.input import Button
from greensward.viewer.picking import Picker, ScreenPoint
from greensward.viewer.session import Session

Floats = npt.NDArray[np.float64]
_GRAB_RADIUS = 14.0  # points


class Pointer:
    """Mouse with its position, its drag, and the item below it."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._mouse: ScreenPoint = (0.0, 0.0)
        self._turn: ScreenPoint = (0.0, 0.0)
        self._painting = False
        self._picker = Picker(None, [(0, 0, 1, 1)])
        self.captured = False
        """True while the mouse turns the camera and its cursor is hidden."""
        self.on_ground: Floats | None = None
        """Point of the ground below the mouse, (3,)."""
        self.handles: list[Handle] = []
        """Handles that can be dragged."""
        self.held: Handle | None = None
        """Handle that is being dragged."""
        self.hovered: KeyPath | None = None
        """Path of the handle that a click would grab."""

    @property
    def busy(self) -> bool:
        """True while a button turns the camera, paints or drags."""
        return self.captured or self._painting or self.held is not None

    def take_turn(self) -> ScreenPoint:
        """Return the mouse motion, in points, that turned the camera since the last call."""
        turn, self._turn = self._turn, (0.0, 0.0)
        return turn

    def move(self, x: float, y: float) -> None:
        """Move the mouse to a point of the window."""
        if self.captured:
            self._turn = self._turn[0] + x - self._mouse[0], self._turn[1] + y - self._mouse[1]
        self._mouse = (x, y)

    def press(self, button: Button) -> None:
        """Press a button over a viewport."""
        session = self._session
        self.update(self._picker, free=True)  # a frame ago the mouse may have been over a widget
        if button != "left" or session.tool == "look":
            self.captured = True
        elif session.tool == "move":
            self.held = next((handle for handle in self.handles if handle.path == self.hovered), None)
            self.captured = self.held is None  # beside the handles, dragging turns the camera
        elif self.on_ground is not None:
            self._painting = True
            self._paint(self.on_ground)

    def release(self) -> bool:
        """Release a button; return True if it ended a drag."""
        was_busy = self.busy
        if self._painting:
            self._session.end_stroke()
        if self.held is not None:
            if self._exists(self.held):
                self._apply(self.held)
            self._session.history.end_drag()
        self.captured, self._painting, self.held = False, False, None
        return was_busy

    def scroll(self, y: float, speed: bool) -> None:
        """Change the speed of the camera, or the width of the brush that is in use."""
        session = self._session
        if speed or session.tool in ("look", "move"):
            controller = session.controller
            controller.speed_factor = min(max(controller.speed_factor * 1.15**y, 0.05), 50.0)
        else:
            session.brush = replace(session.brush, radius_m=min(max(session.brush.radius_m * 1.15**y, 0.1), 50.0))

    def update(self, picker: Picker, free: bool) -> None:
        """Pick the item below the mouse, and let brush or handle follow; `free` means that no widget covers it."""
        session = self._session
        self._picker = picker
        self.on_ground, self.hovered, self.handles = None, None, []
        if session.tool == "look":
            return
        if free and not self.captured and (direction := picker.ray(self._mouse)) is not None:
            self.on_ground = ground_hit(session.heights, session.controller.position_ws, direction)
        if session.tool == "move":
            self._update_handles(picker, free)
        elif self._painting and self.on_ground is not None:
            self._paint(self.on_ground)

    def _update_handles(self, picker: Picker, free: bool) -> None:
        session = self._session
        self.handles = handles_of(session.scene, session.heights, session.controller.position_ws)
        if self.held is None:
            projected = [(picker.project(handle.position_ws), handle.path) for handle in self.handles]
            distances = [(math.dist(point, self._mouse), path) for point, path in projected if point is not None]
            distance, path = min(distances, key=lambda each: each[0], default=(math.inf, None))
            self.hovered = path if free and distance <= _GRAB_RADIUS else None
            return
        if not self._exists(self.held):
            self.held = None
            return
        held = self.held
        if self.on_ground is not None:
            held = self.held = held.moved(self.on_ground, session.heights)
            if held.live:
                self._apply(held)
        self.handles = [held if each.path == held.path else each for each in self.handles]

    def _exists(self, handle: Handle) -> bool:
        """Return False for a handle whose key is gone: the file may have changed meanwhile."""
        try:
            return value_at(self._session.scene, handle.path) is not None
        except (IndexError, AttributeError):
            return False

    def _apply(self, handle: Handle) -> None:
        before = value_at(self._session.scene, handle.path)
        self._session.change(handle.path, handle.value(before), drag=True)

    def _paint(self, ground_ws: Floats) -> None:
        self._session.extend_stroke((float(ground_ws[0]), float(ground_ws[2])))
