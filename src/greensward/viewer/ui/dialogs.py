"""Dialogs: open, save as, picture, closing with changes; and the list of keys."""

import os
from collections.abc import Callable
from pathlib import Path

from imgui_bundle import imgui

from greensward.library import presets
from greensward.viewer.commands import COMMANDS
from greensward.viewer.dialogs import Dialog
from greensward.viewer.saving import entered_path, printable
from greensward.viewer.ui.style import ACCENT, MUTED, Icon, colour
from greensward.viewer.ui.widgets import heading, labelled, note
from greensward.viewer.viewer import Viewer

_MOST_FILES = 200
_KEY_LIST_PX = 690.0
_MOVEMENT_KEYS = (
    ("W A S D, arrows", "Move"),
    ("Mouse, button held", "Turn the camera"),
    ("Shift", "Move faster"),
    ("E, Q", "Up and down; eye height while walking"),
    ("Wheel", "Speed; with a brush, its width"),
    ("1, 2, 3 …", "Techniques"),
    ("Esc", "Put the brush away; close a dialog"),
)


def show(viewer: Viewer) -> None:
    """Draw the open dialog and the list of keys."""
    dialogs = viewer.dialogs
    if dialogs.key_list:
        _key_list(viewer)
    if dialogs.shown is None:
        return
    title = dialogs.shown.value
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
    visible, _ = imgui.begin_popup_modal(title, None, flags)
    if visible:
        _CONTENTS[dialogs.shown](viewer)
        if dialogs.shown is None:
            imgui.close_current_popup()
        imgui.end_popup()


def _open(viewer: Viewer) -> None:
    dialogs = viewer.dialogs
    heading("Presets")
    imgui.begin_child("presets", (0.0, 216.0))
    for name, (title, summary) in presets().items():
        if imgui.selectable(f"{title}##{name}", False)[0]:
            _open_chosen(viewer, name)
        imgui.same_line(270.0)
        imgui.text_colored(colour(MUTED), name)
        if summary and imgui.is_item_hovered():
            imgui.set_tooltip(summary[:240])
    imgui.end_child()
    heading("Files")
    imgui.begin_child("files", (0.0, 96.0))
    found = _scene_files(viewer.recorder.folder)
    for path in found:
        if imgui.selectable(printable(str(path)), False)[0]:
            _open_chosen(viewer, str(path))
    if not found:
        note(printable(f"There is no scene in {viewer.recorder.folder.resolve()}."))
    imgui.end_child()
    imgui.set_next_item_width(-190.0)
    _, dialogs.text = imgui.input_text_with_hint("##file", "or the path of a .toml file", dialogs.text)
    imgui.same_line()
    if imgui.button("Open", (86.0, 0.0)) and dialogs.text.strip():
        source = os.path.expanduser(dialogs.text.strip())  # noqa: PTH111  # pathlib raises for an unknown user
        _open_chosen(viewer, source)
    _cancel(viewer)


def _open_chosen(viewer: Viewer, source: str) -> None:
    viewer.dialogs.close()
    viewer.open_or_ask(source)


def _save_as(viewer: Viewer) -> None:
    dialogs = viewer.dialogs
    note("A scene is a text file; its images and maps are copied beside it if they lie elsewhere.")
    imgui.set_next_item_width(-190.0)
    _, dialogs.text = imgui.input_text("##file", dialogs.text)
    imgui.same_line()
    path = entered_path(dialogs.text, ".toml")
    exists = path is not None and path.exists() and path != viewer.session.origin.file
    imgui.begin_disabled(path is None)
    if imgui.button("Replace" if exists else "Save", (86.0, 0.0)) and path and viewer.session.save(path):
        dialogs.finish()
    imgui.end_disabled()
    _cancel(viewer)
    _remark(path, exists)


def _replace(viewer: Viewer) -> None:
    file = viewer.session.origin.file
    imgui.text_wrapped(printable(f"Another program has changed {file}. Saving replaces that version by yours."))
    if imgui.button("Replace", (100.0, 0.0)) and viewer.session.save():
        viewer.dialogs.finish()
    imgui.same_line()
    if imgui.button("Save as", (100.0, 0.0)):
        viewer.ask_save_as(viewer.dialogs.then)
    _cancel(viewer)


def _picture(viewer: Viewer) -> None:
    dialogs = viewer.dialogs
    labelled("file")
    _, dialogs.text = imgui.input_text("##file", dialogs.text)
    labelled("width and height", "In pixels.")
    _, edges = imgui.input_int2("##size", list(dialogs.picture_size))
    dialogs.picture_size = min(max(int(edges[0]), 1), 16384), min(max(int(edges[1]), 1), 16384)
    labelled("samples", "Samples per pixel, for anti-aliasing.")
    _, samples = imgui.slider_int("##samples", dialogs.picture_samples, 1, 64)
    dialogs.picture_samples = min(max(samples, 1), 4096)
    note("Rendered in the background with every blade.")
    path = entered_path(dialogs.text, ".png")
    exists = path is not None and path.exists()
    imgui.begin_disabled(path is None)
    pressed = imgui.button(f"{Icon.picture}  {'Replace' if exists else 'Save'}", (110.0, 0.0))
    imgui.end_disabled()
    if pressed and path and viewer.save_picture(path, dialogs.picture_size, dialogs.picture_samples):
        dialogs.close()
    _cancel(viewer)
    _remark(path, exists)


def _leave(viewer: Viewer) -> None:
    for line in viewer.would_be_lost:
        imgui.text_wrapped(printable(line))
    unsaved = bool(viewer.session.would_be_lost)
    if unsaved:
        if imgui.button("Save", (100.0, 0.0)):
            viewer.dialogs.close()
            viewer.save(viewer.ask_leave)
        imgui.same_line()
    if imgui.button("Leave without saving" if unsaved else "Leave", (190.0 if unsaved else 100.0, 0.0)):
        viewer.dialogs.close()
        viewer.done = True
    _cancel(viewer)


def _discard(viewer: Viewer) -> None:
    for line in viewer.session.would_be_lost:
        imgui.text_wrapped(printable(line))
    source = viewer.dialogs.text
    if imgui.button("Save", (100.0, 0.0)):
        viewer.dialogs.close()
        viewer.save(lambda: viewer.open(source))
    imgui.same_line()
    if imgui.button("Open without saving", (170.0, 0.0)):
        viewer.dialogs.close()
        viewer.open(source)
    _cancel(viewer)


_CONTENTS: dict[Dialog, Callable[[Viewer], None]] = {
    Dialog.OPEN: _open,
    Dialog.SAVE_AS: _save_as,
    Dialog.REPLACE: _replace,
    Dialog.PICTURE: _picture,
    Dialog.LEAVE: _leave,
    Dialog.DISCARD: _discard,
}


def _cancel(viewer: Viewer) -> None:
    imgui.same_line()
    if imgui.button("Cancel", (86.0, 0.0)) or imgui.is_key_pressed(imgui.Key.escape):
        viewer.dialogs.close()


def _key_list(viewer: Viewer) -> None:
    centre = imgui.get_main_viewport().get_center()
    imgui.set_next_window_pos(centre, imgui.Cond_.always.value, (0.5, 0.5))
    imgui.set_next_window_size((min(540.0, 2.0 * centre.x - 20.0), min(_KEY_LIST_PX, 2.0 * centre.y - 20.0)))
    flags = imgui.WindowFlags_.no_decoration.value | imgui.WindowFlags_.no_saved_settings.value
    flags &= ~imgui.WindowFlags_.no_scrollbar.value  # for a low window
    imgui.begin("keys", None, flags)
    heading("Camera")
    for keys, text in _MOVEMENT_KEYS:
        _key(keys, text)
    heading("Commands")
    for command in COMMANDS:
        _key(command.shown_keys, command.help)
    if imgui.is_mouse_clicked(0) and not imgui.is_window_hovered():
        viewer.dialogs.key_list = False
    imgui.end()


def _key(keys: str, text: str) -> None:
    imgui.text_colored(colour(ACCENT), keys)
    imgui.same_line(190.0)
    imgui.text_unformatted(text)


def _remark(path: Path | None, exists: bool) -> None:
    if path is None:
        note("This is not the name of a file.")
    else:
        note(printable(f"{path.name} exists in" if exists else "In") + printable(f" {path.parent.absolute()}"))


def _scene_files(folder: Path) -> list[Path]:
    """Return the scene files of a folder and of its subfolders."""
    try:
        found = [*sorted(folder.glob("*.toml")), *sorted(folder.glob("*/scene.toml"))]
    except OSError:
        return []
    return [path for path in found if path.name != "pyproject.toml"][:_MOST_FILES]
