"""What asks a question: open, save as, picture, closing with changes; and the list of keys."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from greensward.library import presets
from greensward.viewer.controls import ACTIONS, MOVING
from greensward.viewer.face.style import ACCENT, MUTED, Icon, colour
from greensward.viewer.face.widgets import heading, labelled, note
from greensward.viewer.saving import legible, typed

if TYPE_CHECKING:
    from greensward.viewer.viewer import Viewer

_MOST_FILES = 200
_HELP_PX = 690.0


def _nothing() -> None:
    pass


class Dialogs:
    """At most one is open; while it is, keys are its own."""

    def __init__(self) -> None:
        self._asked: str | None = None
        self._then: Callable[[], None] = _nothing
        self._text = ""
        self._size, self._samples = (1920, 1080), 16
        self.help = False

    @property
    def open(self) -> bool:
        """Whether one is."""
        return self._asked is not None

    def ask(self, what: str, text: str = "", then: Callable[[], None] = _nothing) -> None:
        """Open `open`, `save`, `replace`, `picture`, `leave` or `discard`; `then` follows if the scene is saved."""
        self._asked, self._text, self._then = what, text, then

    def cancel(self) -> None:
        """Close it, and do nothing."""
        self._asked = None

    def show(self, viewer: "Viewer") -> None:
        """Draw what is open."""
        if self.help:
            self._help()
        titles = {
            "open": "Open",
            "save": "Save as",
            "replace": "Replace the file?",
            "picture": "Save a picture",
            "leave": "Leave?",
            "discard": "Open without saving?",
        }
        if self._asked is None:
            return
        title = titles[self._asked]
        if not imgui.is_popup_open(title):
            imgui.open_popup(title)
        centre = imgui.get_main_viewport().get_center()
        imgui.set_next_window_pos(centre, imgui.Cond_.appearing.value, (0.5, 0.5))
        imgui.set_next_window_size((min(560.0, 2.0 * centre.x - 20.0), 0.0))
        flags = (
            imgui.WindowFlags_.no_resize.value
            | imgui.WindowFlags_.no_move.value
            | imgui.WindowFlags_.no_saved_settings.value
        )
        shown, _ = imgui.begin_popup_modal(title, None, flags)
        if shown:
            getattr(self, f"_{self._asked}")(viewer)
            if self._asked is None:
                imgui.close_current_popup()
            imgui.end_popup()

    def _open(self, viewer: "Viewer") -> None:
        heading("Presets")
        imgui.begin_child("presets", (0.0, 216.0))
        for name, (title, summary) in presets().items():
            if imgui.selectable(f"{title}##{name}", False)[0]:
                self._chosen(viewer, name)
            imgui.same_line(270.0)
            imgui.text_colored(colour(MUTED), name)
            if summary and imgui.is_item_hovered():
                imgui.set_tooltip(summary[:240])
        imgui.end_child()
        heading("Files here")
        imgui.begin_child("files", (0.0, 96.0))
        found = _scenes_near(viewer.recorder.folder)
        for path in found:
            if imgui.selectable(legible(str(path)), False)[0]:
                self._chosen(viewer, str(path))
        if not found:
            note(legible(f"No scene lies in {viewer.recorder.folder.resolve()}."))
        imgui.end_child()
        imgui.set_next_item_width(-190.0)
        _, self._text = imgui.input_text_with_hint("##file", "or the path of a .toml file", self._text)
        imgui.same_line()
        if imgui.button("Open", (86.0, 0.0)) and self._text.strip():
            self._chosen(viewer, os.path.expanduser(self._text.strip()))  # noqa: PTH111  # as it is for no such user
        self._cancel()

    def _chosen(self, viewer: "Viewer", source: str) -> None:
        self._asked = None
        if viewer.session.would_be_lost:
            self.ask("discard", source)
        else:
            viewer.open(source)

    def _save(self, viewer: "Viewer") -> None:
        note("A scene is a text file; its pictures and maps are copied beside it if need be.")
        imgui.set_next_item_width(-190.0)
        _, self._text = imgui.input_text("##file", self._text)
        imgui.same_line()
        path = typed(self._text, ".toml")
        there = path is not None and path.exists() and path != viewer.session.origin.file
        imgui.begin_disabled(path is None)
        if imgui.button("Replace" if there else "Save", (86.0, 0.0)) and path and viewer.session.save(path):
            self._done()
        imgui.end_disabled()
        self._cancel()
        _remark(path, there)

    def _done(self) -> None:
        self._asked, then = None, self._then
        then()

    def _replace(self, viewer: "Viewer") -> None:
        file = viewer.session.origin.file
        imgui.text_wrapped(legible(f"Another program has changed {file}. Saving puts your scene in its place."))
        if imgui.button("Replace", (100.0, 0.0)) and viewer.session.save():
            self._done()
        imgui.same_line()
        if imgui.button("Save as", (100.0, 0.0)):
            viewer.ask_save_as(self._then)
        self._cancel()

    def _picture(self, viewer: "Viewer") -> None:
        labelled("file")
        _, self._text = imgui.input_text("##file", self._text)
        labelled("width and height", "In pixels.")
        _, edges = imgui.input_int2("##size", list(self._size))
        self._size = min(max(int(edges[0]), 1), 16384), min(max(int(edges[1]), 1), 16384)
        labelled("samples", "For each pixel: more, cleaner edges.")
        _, samples = imgui.slider_int("##samples", self._samples, 1, 64)
        self._samples = min(max(samples, 1), 4096)
        note("Drawn with every blade and at this size, while you go on.")
        path = typed(self._text, ".png")
        there = path is not None and path.exists()
        imgui.begin_disabled(path is None)
        pressed = imgui.button(f"{Icon.picture}  {'Replace' if there else 'Save'}", (110.0, 0.0))
        imgui.end_disabled()
        if pressed and path and viewer.draw_picture(path, self._size, self._samples):
            self._asked = None
        self._cancel()
        _remark(path, there)

    def _leave(self, viewer: "Viewer") -> None:
        for line in viewer.would_be_lost:
            imgui.text_wrapped(legible(line))
        unsaved = bool(viewer.session.would_be_lost)
        if unsaved:
            if imgui.button("Save", (100.0, 0.0)):
                self._asked = None
                viewer.save(viewer.ask_leave)
            imgui.same_line()
        if imgui.button("Leave without saving" if unsaved else "Leave", (190.0 if unsaved else 100.0, 0.0)):
            self._asked, viewer.done = None, True
        self._cancel()

    def _discard(self, viewer: "Viewer") -> None:
        for line in viewer.session.would_be_lost:
            imgui.text_wrapped(legible(line))
        source = self._text
        if imgui.button("Save", (100.0, 0.0)):
            self._asked = None
            viewer.save(lambda: viewer.open(source))
        imgui.same_line()
        if imgui.button("Open all the same", (160.0, 0.0)):
            self._asked = None
            viewer.open(self._text)
        self._cancel()

    def _cancel(self) -> None:
        imgui.same_line()
        if imgui.button("Cancel", (86.0, 0.0)) or imgui.is_key_pressed(imgui.Key.escape):
            self._asked = None

    def _help(self) -> None:
        centre = imgui.get_main_viewport().get_center()
        imgui.set_next_window_pos(centre, imgui.Cond_.always.value, (0.5, 0.5))
        imgui.set_next_window_size((min(540.0, 2.0 * centre.x - 20.0), min(_HELP_PX, 2.0 * centre.y - 20.0)))
        flags = imgui.WindowFlags_.no_decoration.value | imgui.WindowFlags_.no_saved_settings.value
        flags &= ~imgui.WindowFlags_.no_scrollbar.value  # in a low window
        imgui.begin("keys", None, flags)
        heading("Moving")
        for keys, text in MOVING:
            _key(keys, text)
        heading("Keys")
        for action in ACTIONS:
            _key(action.shown_keys, action.help)
        if imgui.is_mouse_clicked(0) and not imgui.is_window_hovered():
            self.help = False
        imgui.end()


def _key(keys: str, text: str) -> None:
    imgui.text_colored(colour(ACCENT), keys)
    imgui.same_line(190.0)
    imgui.text_unformatted(text)


def _remark(path: Path | None, there: bool) -> None:
    if path is None:
        note("That names no file.")
    else:
        note(legible(f"{path.name} is there already, in" if there else "In") + legible(f" {path.parent.absolute()}"))


def _scenes_near(folder: Path) -> list[Path]:
    """Scene files of a folder and of those in it."""
    try:
        found = [*sorted(folder.glob("*.toml")), *sorted(folder.glob("*/scene.toml"))]
    except OSError:
        return []
    return [path for path in found if path.name != "pyproject.toml"][:_MOST_FILES]
