"""Keys, mouse and pad as events of our own, and what they ask for. Knows no window toolkit."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

from greensward.viewer.walker import Intent

Button = Literal["left", "right", "middle"]


@dataclass(frozen=True)
class Move:
    """The mouse is here, in points from the window's upper left corner."""

    x: float
    y: float


@dataclass(frozen=True)
class Click:
    """A button of the mouse goes down or up."""

    button: Button
    down: bool


@dataclass(frozen=True)
class Wheel:
    """The wheel turns; up is positive."""

    y: float
    x: float = 0.0


@dataclass(frozen=True)
class Press:
    """A key goes down or up; `again` where it is held and repeats."""

    key: str
    down: bool = True
    again: bool = False


@dataclass(frozen=True)
class Text:
    """A character was typed."""

    character: str


@dataclass(frozen=True)
class Pad:
    """How a gamepad is held now."""

    left: tuple[float, float] = (0.0, 0.0)
    right: tuple[float, float] = (0.0, 0.0)
    up: float = 0.0
    fast: bool = False


@dataclass(frozen=True)
class Close:
    """The window is asked to close."""


@dataclass(frozen=True)
class Blur:
    """The window lost the keyboard: keys that are held will not be seen to rise."""


@dataclass(frozen=True)
class Drop:
    """A file was dropped onto the window."""

    path: str


Event: TypeAlias = Move | Click | Wheel | Press | Text | Pad | Close | Blur | Drop


def one_by_one(events: Sequence[Event]) -> int:
    """How many of these events one frame may take.

    What lies under the mouse is known a frame after it moved there, and a button or key that goes down and up in
    one frame would not be seen: such events wait for the next.
    """
    moved = False
    seen: set[str] = set()
    for count, event in enumerate(events):
        match event:
            case Move():
                moved = True
            case Click(button):
                if moved or button in seen:
                    return count
                seen.add(button)
            case Press(key, again=False):  # one that repeats says nothing new, and must not hold up the rest
                if key in seen:
                    return count
                seen.add(key)
    return len(events)


@dataclass(frozen=True)
class Action:
    """Something that a key does: the name of a method of `Viewer`."""

    name: str
    keys: tuple[str, ...]
    """`ctrl+shift+z`: modifiers first."""
    help: str

    @property
    def shown_keys(self) -> str:
        """`Ctrl+Shift+Z or Ctrl+Y`."""
        return " or ".join("+".join(part.capitalize() for part in chord.split("+")) for chord in self.keys)


ACTIONS = (
    Action("toggle_help", ("?", "f1"), "Show or hide this list"),
    Action("toggle_panel", ("h",), "Show or hide the panel"),
    Action("fly_or_walk", ("f",), "Fly or walk"),
    Action("orbit", ("o",), "Circle around what you look at"),
    Action("go_back", ("home",), "Back to the scene's own view"),
    Action("pause", ("p",), "Stop time, or let it run"),
    Action("step", ("n",), "Go on by a thirtieth of a second"),
    Action("slower", (",",), "Slow motion: half as fast"),
    Action("faster", (".",), "Twice as fast"),
    Action("undo", ("ctrl+z",), "Undo"),
    Action("redo", ("ctrl+shift+z", "ctrl+y"), "Redo"),
    Action("ask_open", ("ctrl+o",), "Open a preset or a file"),
    Action("save", ("ctrl+s",), "Save the scene"),
    Action("ask_save_as", ("ctrl+shift+s",), "Save it under another name"),
    Action("picture", ("f12",), "Save a picture"),
    Action("record_path", ("f5",), "Record the way you go, or stop"),
    Action("play_path", ("f7",), "Go that way again, or stop"),
    Action("record_video", ("f6",), "Record a video of what you see, or stop"),
    Action("split", ("c",), "Keep the scene as it is beside what it becomes"),
    Action("reload_shaders", ("ctrl+r",), "Read shaders and files again"),
)
MOVING = (
    ("W A S D, arrows", "Walk"),
    ("Mouse, button held", "Look around"),
    ("Shift", "Hurry"),
    ("E, Q", "Up and down; where you walk, taller and smaller"),
    ("Wheel", "Walking speed; with a brush, its size"),
    ("1, 2, 3 …", "Techniques"),
    ("Esc", "Put the brush away; close what is open"),
)
HINT = "Walk with W A S D   ·   hold a button of the mouse to look around   ·   ? lists all keys"
"""For someone who has done neither yet."""
_SHIFTED = {"slash": "?"}
_PLAIN = {"comma": ",", "period": "."}
_MODIFIERS = ("left_shift", "right_shift", "left_ctrl", "right_ctrl", "left_alt", "right_alt")


class Held:
    """Which keys are down, and where that leads."""

    def __init__(self) -> None:
        self._down: set[str] = set()
        self.pad = Pad()

    def take(self, event: Event) -> None:
        """Take note of an event."""
        match event:
            case Press(key, down):
                (self._down.add if down else self._down.discard)(key)
            case Pad():
                self.pad = event
            case Blur():
                self.clear()

    def clear(self) -> None:
        """All keys are up."""
        self._down.clear()
        self.pad = Pad()

    def is_down(self, *keys: str) -> bool:
        """Whether any of these is down."""
        return bool(self._down.intersection(keys))

    @property
    def ctrl(self) -> bool:
        """Whether a control key is down."""
        return self.is_down("left_ctrl", "right_ctrl")

    @property
    def shift(self) -> bool:
        """Whether a shift key is down."""
        return self.is_down("left_shift", "right_shift")

    def intent(self, turn_px: tuple[float, float]) -> Intent:
        """Where these keys, and the pad, lead."""

        def axis(more: tuple[str, ...], less: tuple[str, ...], pad: float) -> float:
            keys = 0.0 if self.ctrl else float(self.is_down(*more)) - float(self.is_down(*less))
            return min(max(keys + pad, -1.0), 1.0)

        pad = self.pad
        return Intent(
            ahead=axis(("w", "up_arrow"), ("s", "down_arrow"), -pad.left[1]),
            right=axis(("d", "right_arrow"), ("a", "left_arrow"), pad.left[0]),
            up=axis(("e", "page_up"), ("q", "page_down"), pad.up),
            turn_px=(turn_px[0] + 14.0 * pad.right[0], turn_px[1] + 10.0 * pad.right[1]),
            fast=self.shift or pad.fast,
        )

    def chord(self, key: str) -> str:
        """A key that goes down now, with the modifiers that are held, as `Action.keys` has it."""
        if key in _MODIFIERS:
            return ""
        if self.shift and not self.ctrl and key in _SHIFTED:
            return _SHIFTED[key]
        name = _PLAIN.get(key, key.removeprefix("_"))
        return "ctrl+" * self.ctrl + "shift+" * (self.shift and self.ctrl) + name


def action_for(chord: str) -> str | None:
    """The name of what a chord does; `technique 2` for a digit."""
    if chord.isdecimal() and chord != "0":
        return f"technique {chord}"
    return next((action.name for action in ACTIONS if chord in action.keys), None)
