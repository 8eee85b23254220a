"""The window itself: GLFW's events as our own, its context, and the loop. The only file that knows GLFW."""

import contextlib
import os
import signal
import sys
import time
from collections.abc import Callable
from typing import Any

import imgui_bundle  # noqa: F401  # before glfw, which then uses the same library

import glfw  # isort: skip
import moderngl

from greensward.gpu.context import INSTALL
from greensward.scene import GreenswardError
from greensward.viewer import controls
from greensward.viewer.contexts import Contexts
from greensward.viewer.saving import legible
from greensward.viewer.session import Session
from greensward.viewer.viewer import Viewer

_NOTHING: Any = None
_VERSION = (4, 3)
_RESTING_S, _HIDDEN_S = 0.05, 0.2
_BUTTONS: dict[int, controls.Button] = {
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
    """GLFW's number of each key to the name that `controls` and imgui have for it."""
    names = {}
    for attribute in dir(glfw):
        if attribute.startswith("KEY_") and isinstance(number := getattr(glfw, attribute), int) and number > 0:
            name = attribute.removeprefix("KEY_").lower()
            name = f"_{name}" if name.isdecimal() else name.replace("kp_", "keypad_")
            names[number] = _RENAMED.get(name, name)
    return names


_KEYS = _key_names()


class Window:
    """A window with an OpenGL context, and the events that it sees."""

    def __init__(self, title: str, size: tuple[int, int], hidden: bool = False) -> None:
        self._said: list[str] = []
        glfw.set_error_callback(lambda _, text: self._said.append(_as_text(text)))
        if not glfw.init():
            raise GreenswardError(_no_display(self._said))
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
            raise GreenswardError(_no_context(self._said))
        self.events: list[controls.Event] = []
        self._others: list[Any] = []
        self._pad = controls.Pad()
        self.warned = False
        """Whether a first Ctrl+C was seen."""
        glfw.make_context_current(self._window)
        glfw.swap_interval(1)
        self.ctx = moderngl.create_context(require=430)
        self.contexts = Contexts(self.ctx, lambda: glfw.make_context_current(self._window), self._another, _leave)
        self._listen()

    def _another(self) -> tuple[moderngl.Context, Callable[[], None]]:
        """A context of a window that nobody sees, which shares what this one holds."""
        glfw.window_hint(glfw.VISIBLE, False)
        other = glfw.create_window(16, 16, "", None, self._window)
        if not other:
            raise GreenswardError(_no_context(self._said))
        self._others.append(other)

        def enter() -> None:
            glfw.make_context_current(other)

        enter()
        return moderngl.create_context(require=430), enter

    def _listen(self) -> None:
        window, put = self._window, self.events.append

        def button(_: Any, number: int, action: int, __: int) -> None:
            if name := _BUTTONS.get(number):
                put(controls.Click(name, action == glfw.PRESS))

        def key(_: Any, number: int, __: int, action: int, ___: int) -> None:
            if name := _KEYS.get(number):
                put(controls.Press(name, action != glfw.RELEASE, action == glfw.REPEAT))

        def move(_: Any, x: float, y: float) -> None:
            scale_x, scale_y = self._points_per_unit()
            put(controls.Move(x * scale_x, y * scale_y))

        def drop(_: Any, paths: Any) -> None:
            if paths:
                put(controls.Drop(_as_text(paths[0])))

        def close(_: Any) -> None:
            glfw.set_window_should_close(window, False)
            put(controls.Close())

        glfw.set_mouse_button_callback(window, button)
        glfw.set_key_callback(window, key)
        glfw.set_cursor_pos_callback(window, move)
        glfw.set_scroll_callback(window, lambda _, x, y: put(controls.Wheel(y, x)))
        glfw.set_char_callback(window, lambda _, code: put(controls.Text(chr(code))))
        glfw.set_window_close_callback(window, close)
        glfw.set_window_focus_callback(window, lambda _, focused: None if focused else put(controls.Blur()))
        dropped: Any = drop
        glfw.set_drop_callback(window, dropped)

    def _points_per_unit(self) -> tuple[float, float]:
        """Systems count the mouse in pixels or in points of their own."""
        width, height = glfw.get_window_size(self._window)
        return self.size[0] / max(width, 1), self.size[1] / max(height, 1)

    @property
    def zoom(self) -> float:
        """Pixels in a point, by which a screen of fine pixels is to be read."""
        return max(float(glfw.get_window_content_scale(self._window)[0]), 0.5)

    @property
    def size(self) -> tuple[int, int]:
        """Points of its content; 0 while it is minimised."""
        width, height = glfw.get_framebuffer_size(self._window)
        return round(width / self.zoom), round(height / self.zoom)

    def take(self, wait_s: float = 0.0) -> list[controls.Event]:
        """Events since the last call; waits for one so long at most."""
        if wait_s > 0.0:
            glfw.wait_events_timeout(wait_s)
        else:
            glfw.poll_events()
        self._look_at_pad()
        taken = self.events.copy()
        self.events.clear()
        return taken

    def _look_at_pad(self) -> None:
        if not glfw.joystick_is_gamepad(glfw.JOYSTICK_1):
            return
        state = glfw.get_gamepad_state(glfw.JOYSTICK_1)
        if not state:
            return
        axes = [value if abs(value) > _DEAD_ZONE else 0.0 for value in state.axes[:4]]
        up = 0.5 * (state.axes[5] - state.axes[4])
        pad = controls.Pad(
            (axes[0], axes[1]),
            (axes[2], axes[3]),
            up if abs(up) > _DEAD_ZONE else 0.0,
            bool(state.buttons[glfw.GAMEPAD_BUTTON_LEFT_THUMB]),
        )
        # a stick that is held turns and walks on in every frame
        if pad != self._pad or pad != controls.Pad():
            self._pad = pad
            self.events.append(pad)

    def capture(self, captured: bool) -> None:
        """Hide the mouse and let it move without end, or show it again."""
        mode = glfw.CURSOR_DISABLED if captured else glfw.CURSOR_NORMAL
        if glfw.get_input_mode(self._window, glfw.CURSOR) != mode:
            glfw.set_input_mode(self._window, glfw.CURSOR, mode)

    def read_clipboard(self) -> str:
        """What other programs copied; nothing where that is no text."""
        return _as_text(glfw.get_clipboard_string(self._window) or "")

    def write_clipboard(self, text: str) -> None:
        """Let other programs paste this."""
        glfw.set_clipboard_string(self._window, text)

    def show(self, title: str) -> None:
        """Put what was drawn on the screen."""
        glfw.set_window_title(self._window, title)
        glfw.swap_buffers(self._window)

    def hide(self) -> None:
        """Take it off the screen, whatever goes on behind it."""
        glfw.hide_window(self._window)

    def close(self) -> None:
        """Close it and all contexts."""
        for window in (*self._others, self._window):
            glfw.destroy_window(window)
        glfw.terminate()


def run(session: Session, size: tuple[int, int] = (1280, 800)) -> None:
    """Open a window on a session and stay until it closes.

    Raises `GreenswardError` where no window can open, and where it fails; then what was not saved is in a file.
    """
    window = Window("greensward", size)
    viewer = Viewer(window.contexts, session)
    asked: list[int] = []
    viewer.face.share_clipboard(window.read_clipboard, window.write_clipboard)
    try:
        last = time.perf_counter()
        _listen_to_signals(asked)
        while not viewer.done:
            _heed(asked, window)
            shown = min(window.size) > 0
            events = window.take(0.0 if shown and not viewer.resting else _RESTING_S if shown else _HIDDEN_S)
            now = time.perf_counter()
            viewer.frame(now - last, events, window.size if shown else (1, 1), window.ctx.screen, window.zoom)
            last = now
            window.capture(viewer.hand.captured)
            changed = "• " if session.unsaved else ""
            window.show(legible(f"{changed}{session.name} – greensward"))
    except (KeyboardInterrupt, SystemExit):
        if kept := session.rescue():
            print(f"view: what was not saved is in {kept}", file=sys.stderr)
        raise
    except Exception as error:  # a lost device, say
        kept = session.rescue()
        told = f"; what was not saved is in {kept}" if kept else ""
        raise GreenswardError(f"view: {type(error).__name__}: {error}{told}") from error
    finally:
        _listen_to_signals(None)
        window.hide()  # a picture that is being drawn may take a while to stop
        with contextlib.suppress(moderngl.Error):
            viewer.release()
        window.close()


_SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


def _listen_to_signals(asked: list[int] | None) -> None:
    """Let `asked` have the signals that end programs, or let them end this one."""
    with contextlib.suppress(ValueError):  # another thread than the first cannot
        for number in _SIGNALS:
            usual = signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL
            signal.signal(number, usual if asked is None else lambda number, _: asked.append(number))


def _heed(asked: list[int], window: Window) -> None:
    """Ctrl+C in the terminal asks as closing does; a second one, or the end of the login, leaves at once."""
    if any(number != signal.SIGINT for number in asked):
        raise SystemExit(143)
    if len(asked) > 1:
        raise KeyboardInterrupt
    if asked and not window.warned:
        window.warned = True
        window.events.append(controls.Close())


def _as_text(said: Any) -> str:
    return said.decode(errors="replace") if isinstance(said, bytes) else str(said)


def _leave() -> None:
    glfw.make_context_current(_NOTHING)


def _no_display(said: list[str]) -> str:
    reason = f" ({said[-1]})" if said else ""
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return (
            "view: there is no display to open a window on; use a desktop, `xvfb-run greensward view`, "
            "or `greensward render` for pictures without a window"
        )
    return f"view: no window can be opened{reason}; `greensward render` needs none"


def _no_context(said: list[str]) -> str:
    reason = f" ({said[-1]})" if said else ""
    return (
        f"view: this display offers no OpenGL {_VERSION[0]}.{_VERSION[1]}{reason}; update the graphics driver, "
        f"or draw on the CPU: {INSTALL}"
    )
