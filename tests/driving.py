"""Driver of the viewer for tests: event by event, in a framebuffer of its own."""

import time
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.viewer import input as c
from greensward.viewer.application import Application
from greensward.viewer.contexts import Contexts
from greensward.viewer.session import Session

SIZE = (1024, 640)
FRAME_S = 0.05


class Driver:
    """Application without a window, with the input of a user."""

    def __init__(self, contexts: Contexts, session: Session, size: tuple[int, int] = SIZE) -> None:
        self.application = Application(contexts, session)
        self.session, self.viewer, self.ui = session, self.application.viewer, self.application.ui
        self.viewer.resolution.automatic, self.viewer.resolution.scale = False, 0.12
        self._ctx = contexts.ctx
        self.target: moderngl.Framebuffer | None = None
        self.resize(size)

    def resize(self, size: tuple[int, int]) -> None:
        """Set the size of the window."""
        old = self.target
        self.size, self.target = size, self._ctx.framebuffer([self._ctx.texture(size, 4)])
        self.target.use()
        if old is not None:
            old.release()

    def frames(self, count: int = 1, *events: c.Event, seconds: float = FRAME_S) -> None:
        """Draw frames, with the events before the first of them."""
        assert self.target
        for i in range(count):
            self.application.frame(seconds, list(events) if i == 0 else [], self.size, self.target)

    def ready(self, limit_s: float = 120.0) -> None:
        """Draw frames until the current scene is shown."""
        end = time.monotonic() + limit_s
        self.frames(1)
        while self.viewer.building:
            assert time.monotonic() < end, "nothing was drawn in time"
            time.sleep(0.01)
            self.frames(1)
        self.frames(2)

    def key(self, key: str, *held: str) -> None:
        """Press and release a key, while others are held."""
        self.frames(1, *(c.Key(each) for each in held), c.Key(key))
        self.frames(1, c.Key(key, False), *(c.Key(each, False) for each in held))

    def write(self, text: str) -> None:
        """Type a text."""
        self.frames(1, *(c.Character(character) for character in text))

    def drag(self, *points: tuple[float, float], button: Any = "left") -> None:
        """Press a mouse button at the first point, and release it at the last."""
        self.frames(2, c.MouseMove(*points[0]))
        self.frames(1, c.MouseButton(button, True))
        for point in points[1:]:
            self.frames(1, c.MouseMove(*point))
        self.frames(1, c.MouseButton(button, False))

    def picture(self) -> npt.NDArray[np.uint8]:
        """Return the window's content, (height, width, 3), top row first."""
        assert self.target
        pixels = np.frombuffer(self.target.read(components=3, alignment=1), np.uint8)
        return pixels.reshape(*self.size[::-1], 3)[::-1]

    @property
    def scene_part(self) -> npt.NDArray[np.uint8]:
        """Middle of the picture, without panel, tools and messages."""
        x, y, width, height = self.viewer.areas(self.size)[-1]
        return self.picture()[y + 80 : y + height - 120, x + 10 : x + width - 10]

    def message_text(self) -> str:
        """Return all messages on show."""
        return "\n".join(message.text for message in self.viewer.messages)

    def release(self) -> None:
        self.application.release()
        if self.target:
            self.target.release()
