"""Window: its context, its events, and the main loop. The only module that knows GLFW."""

import contextlib
import gc
import os
import signal
import sys
import time
from collections.abc import Callable
from typing import Any

import imgui_bundle  # noqa: F401  # before glfw, which then uses the same library

import glfw  # isort: skip
import moderngl

from greensward.gpu.adapters import INSTALL
from greensward.interrupts import handled
from greensward.scene import GreenswardError
from greensward.viewer.application import Application
from greensward.viewer.contexts import Contexts
from greensward.viewer.input import (
    Button,
    Character,
    CloseRequest,
    Event,
    FileDrop,
    FocusLost,
    Gamepad,
    Key,
    MouseButton,
    MouseMove,
    Scroll,
)
from greensward.viewer.saving import printable
from greensward.viewer.session import Session

_NOTHING: Any = None
_VERSION = (4, 3)
_IDLE_S, _HIDDEN_S = 0.05, 0.2
_BUTTONS: dict[int, Button] = {
    glfw.MOUSE_BUTTON_LEFT: "left",
    glfw.MOUSE_BUTTON_RIGHT: "right",
    glfw.MOUSE_BUTTON_MIDDLE: "middle",
}
_RENAMED = {
    "left": "left_arrow",
    "right": "right_arrow",
    "up": "up_arrow",
    "down": "down_arrow",
    "left_control": "left_ctrl",
    "right_control": "right_ctrl",
}
_DEAD_ZONE = 0.15


def _key_names() -> dict[int, str]:
    """Return the name of each key in `input` and imgui, by its number in GLFW."""
    names = {}
    for attribute in dir(glfw):
        if attribute.startswith("KEY_") and isinstance(number := getattr(glfw, attribute), int) and number > 0:
            name = attribute.removeprefix("KEY_").lower()
            name = f"_{name}" if name.isdecimal() else name.replace("kp_", "keypad_")
            names[number] = _RENAMED.get(name, name)
    return names


_KEYS = _key_names()


class Window:
    """Window with an OpenGL context and a queue of events."""

    def __init__(self, title: str, size: tuple[int, int], hidden: bool = False) -> None:
        self._errors: list[str] = []
        glfw.set_error_callback(lambda _, text: self._errors.append(_as_text(text)))
        if not glfw.init():
            raise GreenswardError(_no_display(self._errors))
        for hint, value in (
            (glfw.CONTEXT_VERSION_MAJOR, _VERSION[0]),
            (glfw.CONTEXT_VERSION_MINOR, _VERSION[1]),
            (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE),
            (glfw.OPENGL_FORWARD_COMPAT, True),
            (glfw.VISIBLE, not hidden),
        ):
            glfw.window_hint(hint, value)
        self._window = glfw.create_window(*size, title, None, None)
        if not self._window:
            glfw.terminate()
            raise GreenswardError(_no_context(self._errors))
        self.events: list[Event] = []
        self._hidden: list[Any] = []
        self._gamepad = Gamepad()
        self.warned = False
        """True after a first Ctrl+C."""
        glfw.make_context_current(self._window)
        glfw.swap_interval(1)
        self.ctx = moderngl.create_context(require=430)
        self.contexts = Contexts(self.ctx, lambda: glfw.make_context_current(self._window), self._new_context, _leave)
        self._listen()

    def _new_context(self) -> tuple[moderngl.Context, Callable[[], None]]:
        """Create a context that shares objects with this one, in a hidden window."""
        glfw.window_hint(glfw.VISIBLE, False)
        other = glfw.create_window(16, 16, "", None, self._window)
        if not other:
            raise GreenswardError(_no_context(self._errors))
        self._hidden.append(other)

        def enter() -> None:
            glfw.make_context_current(other)

        enter()
        return moderngl.create_context(require=430), enter

    def _listen(self) -> None:
        window, emit = self._window, self.events.append

        def button(_: Any, number: int, action: int, __: int) -> None:
            if name := _BUTTONS.get(number):
                emit(MouseButton(name, action == glfw.PRESS))

        def key(_: Any, number: int, __: int, action: int, ___: int) -> None:
            if name := _KEYS.get(number):
                emit(Key(name, action != glfw.RELEASE, action == glfw.REPEAT))

        def move(_: Any, x: float, y: float) -> None:
            scale_x, scale_y = self._points_per_unit()
            emit(MouseMove(x * scale_x, y * scale_y))

        def drop(_: Any, paths: Any) -> None:
            if paths:
                emit(FileDrop(_as_text(paths[0])))

        def close(_: Any) -> None:
            glfw.set_window_should_close(window, False)
            emit(CloseRequest())

        glfw.set_mouse_button_callback(window, button)
        glfw.set_key_callback(window, key)
        glfw.set_cursor_pos_callback(window, move)
        glfw.set_scroll_callback(window, lambda _, x, y: emit(Scroll(y, x)))
        glfw.set_char_callback(window, lambda _, code: emit(Character(chr(code))))
        glfw.set_window_close_callback(window, close)
        glfw.set_window_focus_callback(window, lambda _, focused: None if focused else emit(FocusLost()))
        dropped: Any = drop
        glfw.set_drop_callback(window, dropped)

    def _points_per_unit(self) -> tuple[float, float]:
        """Return points per unit of mouse positions, which depends on the system."""
        width, height = glfw.get_window_size(self._window)
        return self.size[0] / max(width, 1), self.size[1] / max(height, 1)

    @property
    def content_scale(self) -> float:
        """Pixels per point."""
        return max(float(glfw.get_window_content_scale(self._window)[0]), 0.5)

    @property
    def size(self) -> tuple[int, int]:
        """Size of the content in points; 0 while the window is minimised."""
        width, height = glfw.get_framebuffer_size(self._window)
        return round(width / self.content_scale), round(height / self.content_scale)

    def take(self, wait_s: float = 0.0) -> list[Event]:
        """Return the events since the last call, after waiting up to this long for one."""
        if wait_s > 0.0:
            glfw.wait_events_timeout(wait_s)
        else:
            glfw.poll_events()
        self._read_gamepad()
        taken = self.events.copy()
        self.events.clear()
        return taken

    def _read_gamepad(self) -> None:
        if not glfw.joystick_is_gamepad(glfw.JOYSTICK_1):
            return
        state = glfw.get_gamepad_state(glfw.JOYSTICK_1)
        if not state:
            return
        axes = [value if abs(value) > _DEAD_ZONE else 0.0 for value in state.axes[:4]]
        up = 0.5 * (state.axes[5] - state.axes[4])
        pad = Gamepad(
            (axes[0], axes[1]),
            (axes[2], axes[3]),
            up if abs(up) > _DEAD_ZONE else 0.0,
            bool(state.buttons[glfw.GAMEPAD_BUTTON_LEFT_THUMB]),
        )
        # a held stick goes on turning and moving in every frame
        if pad != self._gamepad or pad != Gamepad():
            self._gamepad = pad
            self.events.append(pad)

    def capture(self, captured: bool) -> None:
        """Hide the cursor and let the mouse move without limits, or show it again."""
        mode = glfw.CURSOR_DISABLED if captured else glfw.CURSOR_NORMAL
        if glfw.get_input_mode(self._window, glfw.CURSOR) != mode:
            glfw.set_input_mode(self._window, glfw.CURSOR, mode)

    def read_clipboard(self) -> str:
        """Return the text in the clipboard; empty if it holds something else."""
        return _as_text(glfw.get_clipboard_string(self._window) or "")

    def write_clipboard(self, text: str) -> None:
        """Put a text into the clipboard."""
        glfw.set_clipboard_string(self._window, text)

    def show(self, title: str) -> None:
        """Show the frame that was drawn."""
        glfw.set_window_title(self._window, title)
        glfw.swap_buffers(self._window)

    def hide(self) -> None:
        """Hide the window."""
        glfw.hide_window(self._window)

    def close(self) -> None:
        """Close the window and all contexts."""
        for window in (*self._hidden, self._window):
            glfw.destroy_window(window)
        glfw.terminate()


def run(session: Session, size: tuple[int, int] = (1280, 800)) -> None:
    """Open a window on a session and return when it closes.

    Raises `GreenswardError` if no window can be opened or drawing fails; unsaved changes are then written to a file.
    """
    window = Window("greensward", size)
    application = Application(window.contexts, session)
    viewer = application.viewer
    signals: list[int] = []
    listening = contextlib.ExitStack()
    # else a full collection of all that was imported stops one frame of hundreds for 15 ms
    gc.freeze()
    application.ui.share_clipboard(window.read_clipboard, window.write_clipboard)
    try:
        last = time.perf_counter()
        listening.enter_context(handled(lambda number, _: signals.append(number)))
        while not viewer.done:
            _handle_signals(signals, window)
            visible = min(window.size) > 0
            events = window.take(0.0 if visible and not viewer.idle else _IDLE_S if visible else _HIDDEN_S)
            now = time.perf_counter()
            size = window.size if visible else (1, 1)
            application.frame(now - last, events, size, window.ctx.screen, window.content_scale)
            last = now
            window.capture(viewer.pointer.captured)
            changed = "• " if session.unsaved else ""
            window.show(printable(f"{changed}{session.name} – greensward"))
    except (KeyboardInterrupt, SystemExit):
        if rescued := session.rescue():
            print(f"view: unsaved changes were written to {rescued}", file=sys.stderr)
        raise
    except Exception as error:  # a lost device, say
        rescued = session.rescue()
        note = f"; unsaved changes were written to {rescued}" if rescued else ""
        raise GreenswardError(f"view: {type(error).__name__}: {error}{note}") from error
    finally:
        listening.close()
        window.hide()  # a picture that is being rendered may take a while to stop
        with contextlib.suppress(moderngl.Error):
            application.release()
        window.close()


def _handle_signals(received: list[int], window: Window) -> None:
    """Request to close at the first Ctrl+C; leave at once at the second, or at another signal."""
    if any(number != signal.SIGINT for number in received):
        raise SystemExit(143)
    if len(received) > 1:
        raise KeyboardInterrupt
    if received and not window.warned:
        window.warned = True
        window.events.append(CloseRequest())


def _as_text(text: Any) -> str:
    return text.decode(errors="replace") if isinstance(text, bytes) else str(text)


def _leave() -> None:
    glfw.make_context_current(_NOTHING)


def _no_display(errors: list[str]) -> str:
    reason = f" ({errors[-1]})" if errors else ""
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return (
            "view: there is no display to open a window on; use a desktop, `xvfb-run greensward view`, "
            "or `greensward render`, which needs no window"
        )
    return f"view: no window can be opened{reason}; `greensward render` needs none"


def _no_context(errors: list[str]) -> str:
    reason = f" ({errors[-1]})" if errors else ""
    return (
        f"view: this display offers no OpenGL {_VERSION[0]}.{_VERSION[1]}{reason}; update the graphics driver, "
        f"or draw on the CPU: {INSTALL}"
    )
