"""Drives the viewer as a person would, event by event, in a framebuffer of its own."""

import time
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.viewer import controls as c
from greensward.viewer.contexts import Contexts
from greensward.viewer.session import Session
from greensward.viewer.viewer import Viewer

SIZE = (1024, 640)
FRAME_S = 0.05


class Driver:
    """A viewer, and what is at its controls."""

    def __init__(self, contexts: Contexts, session: Session, size: tuple[int, int] = SIZE) -> None:
        self.session, self.viewer = session, Viewer(contexts, session)
        self.viewer.pacing.automatic, self.viewer.pacing.scale = False, 0.2
        self._ctx = contexts.ctx
        self.target: moderngl.Framebuffer | None = None
        self.resize(size)

    def resize(self, size: tuple[int, int]) -> None:
        """Make the window of another size."""
        old = self.target
        self.size, self.target = size, self._ctx.framebuffer([self._ctx.texture(size, 4)])
        self.target.use()
        if old is not None:
            old.release()

    def frames(self, count: int = 1, *events: c.Event, seconds: float = FRAME_S) -> None:
        """So many frames, the events before the first of them."""
        assert self.target
        for i in range(count):
            self.viewer.frame(seconds, list(events) if i == 0 else [], self.size, self.target)

    def ready(self, limit_s: float = 120.0) -> None:
        """Frames until what was asked for is shown."""
        end = time.monotonic() + limit_s
        self.frames(1)
        while any(pane.busy for pane in self.viewer.panes):
            assert time.monotonic() < end, "nothing was drawn in time"
            time.sleep(0.01)
            self.frames(1)
        self.frames(2)

    def key(self, key: str, *held: str) -> None:
        """Press a key and let it go, others held meanwhile."""
        self.frames(1, *(c.Press(each) for each in held), c.Press(key))
        self.frames(1, c.Press(key, False), *(c.Press(each, False) for each in held))

    def write(self, text: str) -> None:
        """Type a text."""
        self.frames(1, *(c.Text(character) for character in text))

    def drag(self, *spots: tuple[float, float], button: Any = "left") -> None:
        """Press a button of the mouse at the first spot, and let it go at the last."""
        self.frames(2, c.Move(*spots[0]))
        self.frames(1, c.Click(button, True))
        for spot in spots[1:]:
            self.frames(1, c.Move(*spot))
        self.frames(1, c.Click(button, False))

    def picture(self) -> npt.NDArray[np.uint8]:
        """What is seen, (height, width, 3), top row first."""
        assert self.target
        pixels = np.frombuffer(self.target.read(components=3, alignment=1), np.uint8)
        return pixels.reshape(*self.size[::-1], 3)[::-1]

    @property
    def scene_part(self) -> npt.NDArray[np.uint8]:
        """The middle of the picture, without panel, tools and messages."""
        x, y, width, height = self.viewer.areas(self.size)[-1]
        return self.picture()[y + 80 : y + height - 120, x + 10 : x + width - 10]

    def told(self) -> str:
        """All that is told now."""
        return "\n".join(text for text, _ in self.viewer.told)

    def release(self) -> None:
        self.viewer.release()
        if self.target:
            self.target.release()
