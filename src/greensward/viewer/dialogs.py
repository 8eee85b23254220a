"""State of the dialogs, which the user interface draws."""

from collections.abc import Callable
from enum import Enum


class Dialog(Enum):
    """Dialogs, by their titles."""

    OPEN = "Open"
    SAVE_AS = "Save as"
    REPLACE = "Replace the file?"
    PICTURE = "Save a picture"
    LEAVE = "Leave?"
    DISCARD = "Open without saving?"


def _nothing() -> None:
    pass


class Dialogs:
    """Open dialog with what was entered. At most one is open; while it is, it takes all keys."""

    def __init__(self) -> None:
        self.shown: Dialog | None = None
        self.then: Callable[[], None] = _nothing
        """Call that follows once the scene is saved."""
        self.text = ""
        """Path or source in the text field."""
        self.picture_size, self.picture_samples = (1920, 1080), 16
        self.key_list = False
        """Visibility of the list of keys, which may be open beside a dialog."""

    @property
    def open(self) -> bool:
        """True while a dialog is open."""
        return self.shown is not None

    def ask(self, dialog: Dialog, text: str = "", then: Callable[[], None] = _nothing) -> None:
        """Open a dialog with this text in its field; `then` is called once the scene is saved."""
        self.shown, self.text, self.then = dialog, text, then

    def close(self) -> None:
        """Close the dialog."""
        self.shown = None

    def finish(self) -> None:
        """Close the dialog after saving, and call what follows."""
        self.shown = None
        self.then()
