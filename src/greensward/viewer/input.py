"""Input events and the keys that are held, independent of any window toolkit."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

from greensward.viewer.camera_controller import Intent

Button = Literal["left", "right", "middle"]


@dataclass(frozen=True)
class MouseMove:
    """Position of the mouse in points from the upper left corner of the window."""

    x: float
    y: float


@dataclass(frozen=True)
class MouseButton:
    """Press or release of a mouse button."""

    button: Button
    down: bool


@dataclass(frozen=True)
class Scroll:
    """Turn of the mouse wheel; up is positive."""

    y: float
    x: float = 0.0


@dataclass(frozen=True)
class Key:
    """Press, repeat or release of a key."""

    key: str
    down: bool = True
    repeat: bool = False


@dataclass(frozen=True)
class Character:
    """Typed character."""

    character: str


@dataclass(frozen=True)
class Gamepad:
    """Current state of a gamepad: sticks, triggers, and the button for speed."""

    left: tuple[float, float] = (0.0, 0.0)
    right: tuple[float, float] = (0.0, 0.0)
    up: float = 0.0
    fast: bool = False


@dataclass(frozen=True)
class CloseRequest:
    """Request to close the window."""


@dataclass(frozen=True)
class FocusLost:
    """Loss of the keyboard focus: the release of held keys will not be seen."""


@dataclass(frozen=True)
class FileDrop:
    """File dropped onto the window."""

    path: str


Event: TypeAlias = MouseMove | MouseButton | Scroll | Key | Character | Gamepad | CloseRequest | FocusLost | FileDrop


def events_of_frame(events: Sequence[Event]) -> int:
    """Count the leading events that one frame may handle.

    The item under the mouse is known one frame after the mouse moved there, and a button or key that goes down and up
    within one frame would be missed: such events wait for the next frame.
    """
    moved = False
    seen: set[str] = set()
    for count, event in enumerate(events):
        match event:
            case MouseMove():
                moved = True
            case MouseButton(button):
                if moved or button in seen:
                    return count
                seen.add(button)
            case Key(key, repeat=False):  # a repeat carries no news, and must not delay the rest
                if key in seen:
                    return count
                seen.add(key)
    return len(events)


_SHIFTED = {"slash": "?"}
_PLAIN = {"comma": ",", "period": "."}
_MODIFIERS = ("left_shift", "right_shift", "left_ctrl", "right_ctrl", "left_alt", "right_alt")


class HeldKeys:
    """Keys that are down and the state of the gamepad, and the motion that they ask for."""

    def __init__(self) -> None:
        self._down: set[str] = set()
        self.gamepad = Gamepad()

    def handle(self, event: Event) -> None:
        """Update from an event."""
        match event:
            case Key(key, down):
                (self._down.add if down else self._down.discard)(key)
            case Gamepad():
                self.gamepad = event
            case FocusLost():
                self.clear()

    def clear(self) -> None:
        """Release all keys."""
        self._down.clear()
        self.gamepad = Gamepad()

    def is_down(self, *keys: str) -> bool:
        """Return True if any of these keys is down."""
        return bool(self._down.intersection(keys))

    @property
    def ctrl(self) -> bool:
        """State of the control keys."""
        return self.is_down("left_ctrl", "right_ctrl")

    @property
    def shift(self) -> bool:
        """State of the shift keys."""
        return self.is_down("left_shift", "right_shift")

    def intent(self, turn_px: tuple[float, float]) -> Intent:
        """Return the motion that keys, gamepad and mouse ask for."""

        def axis(more: tuple[str, ...], less: tuple[str, ...], stick: float) -> float:
            keys = 0.0 if self.ctrl else float(self.is_down(*more)) - float(self.is_down(*less))
            return min(max(keys + stick, -1.0), 1.0)

        pad = self.gamepad
        return Intent(
            ahead=axis(("w", "up_arrow"), ("s", "down_arrow"), -pad.left[1]),
            right=axis(("d", "right_arrow"), ("a", "left_arrow"), pad.left[0]),
            up=axis(("e", "page_up"), ("q", "page_down"), pad.up),
            turn_px=(turn_px[0] + 14.0 * pad.right[0], turn_px[1] + 10.0 * pad.right[1]),
            fast=self.shift or pad.fast,
        )

    def chord(self, key: str) -> str:
        """Return the chord that a key makes with the held modifiers, as in `Command.keys`; empty for a modifier."""
        if key in _MODIFIERS:
            return ""
        if self.shift and not self.ctrl and key in _SHIFTED:
            return _SHIFTED[key]
        name = _PLAIN.get(key, key.removeprefix("_"))
        return "ctrl+" * self.ctrl + "shift+" * (self.shift and self.ctrl) + name
