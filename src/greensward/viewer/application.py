"""Viewer with input and user interface, without a window: events in, a picture out."""

import time
from collections.abc import Sequence

import moderngl

from greensward.viewer.commands import command_for
from greensward.viewer.contexts import Contexts
from greensward.viewer.input import (
    CloseRequest,
    Event,
    FileDrop,
    FocusLost,
    Gamepad,
    HeldKeys,
    Key,
    MouseButton,
    MouseMove,
    Scroll,
    events_of_frame,
)
from greensward.viewer.session import Session
from greensward.viewer.ui.user_interface import UserInterface
from greensward.viewer.viewer import Size, Viewer


class Application:
    """Viewer, user interface and input; a window and a test drive it alike."""

    def __init__(self, contexts: Contexts, session: Session) -> None:
        self._ctx = contexts.ctx
        self.viewer = Viewer(contexts, session)
        self.ui = UserInterface()
        self._keys = HeldKeys()
        self._queue: list[Event] = []
        self._ui_ms = 0.0

    def frame(
        self,
        seconds: float,
        events: Sequence[Event],
        size: Size,
        target: moderngl.Framebuffer,
        content_scale: float = 1.0,
    ) -> None:
        """Handle events, advance by wall-clock seconds, and draw the content of the window.

        `size` and the positions of events are in points; the framebuffer has `content_scale` times as many pixels.
        """
        self._queue += events
        count = events_of_frame(self._queue)
        for event in self._queue[:count]:
            self._handle(event)
        del self._queue[:count]
        viewer = self.viewer
        viewer.watch_files()
        viewer.advance(seconds, self._keys.intent(viewer.pointer.take_turn()))
        viewer.pick(size, free=not self.ui.wants_mouse)
        drawn = viewer.draw(size, content_scale, self._ui_ms)
        viewer.record(seconds)
        viewer.update_messages(seconds)
        began = time.perf_counter()
        self.ui.draw(viewer, seconds, size, target, content_scale)
        if viewer.software:
            self._ctx.finish()
        self._ui_ms += 0.2 * (1e3 * (time.perf_counter() - began) - self._ui_ms)
        viewer.idle = not (drawn or events or self._queue or viewer.building or viewer.recorder.progress)

    def _handle(self, event: Event) -> None:
        viewer = self.viewer
        match event:
            case MouseMove(x, y):
                viewer.pointer.move(x, y)
                if viewer.pointer.captured:
                    return
            case MouseButton():
                if self._click(event):
                    return
            case Scroll(y) if not self.ui.wants_mouse:
                viewer.pointer.scroll(y, speed=self._keys.ctrl)
                return
            case Key(key, down, repeat):
                if down and not self._typing and not repeat:
                    self._keys.handle(event)
                    self._press(key)
                elif not down or not self._typing:
                    self._keys.handle(event)
            case Gamepad() | FocusLost():
                self._keys.handle(event)
            case CloseRequest():
                viewer.ask_leave()
            case FileDrop(path):
                viewer.open_or_ask(path)
        if self._typing:
            self._keys.clear()
        self.ui.handle(event)

    @property
    def _typing(self) -> bool:
        """True while text fields or a dialog take the keys."""
        return self.ui.wants_text or self.viewer.dialogs.open

    def _press(self, key: str) -> None:
        viewer = self.viewer
        if key == "escape":
            viewer.cancel()
        command = command_for(self._keys.chord(key))
        if command and (command.while_dragging or not viewer.pointer.busy):
            command.run(viewer)

    def _click(self, event: MouseButton) -> bool:
        """Pass a click to the pointer; return False if it is for the user interface."""
        pointer = self.viewer.pointer
        if not event.down:
            return pointer.release()
        if self.ui.wants_mouse or self.viewer.dialogs.open:
            return False
        pointer.press(event.button)
        return True

    def release(self) -> None:
        """Stop recordings, and free the GPU resources and temporary files."""
        self.viewer.release()
        self.ui.release()
