"""User interface, drawn with Dear ImGui into any framebuffer: that of a window or of a test."""

from collections.abc import Callable, Sequence
from typing import Any

import moderngl
from imgui_bundle import imgui

from greensward.viewer import commands
from greensward.viewer.input import Character, Event, FocusLost, Key, MouseButton, MouseMove, Scroll
from greensward.viewer.saving import printable
from greensward.viewer.ui import dialogs, overlay, quick, style, widgets
from greensward.viewer.ui.pages import ScenePage, frame_page
from greensward.viewer.ui.style import ACCENT, GROUND, MUTED, SMALL_PX, TITLE_PX, WARN, Icon, colour
from greensward.viewer.ui.widgets import tip
from greensward.viewer.viewer import Size, Viewer

_BUTTONS = {"left": 0, "right": 1, "middle": 2}
_MODS = {"ctrl": "mod_ctrl", "shift": "mod_shift", "alt": "mod_alt"}
_MOST_PASTED = 10_000


class UserInterface:
    """Panel, tools, messages and dialogs around the viewports."""

    def __init__(self) -> None:
        self._context = imgui.create_context()
        io = imgui.get_io()
        io.set_ini_filename("")
        io.config_input_trickle_event_queue = False
        io.config_drag_click_to_input_text = False
        style.load_fonts()
        style.apply()
        imgui.backends.opengl3_init("#version 430")
        self.scene_page = ScenePage()
        self._next_page: str | None = None
        self.unfolded = False
        """True to open every table, which shows all keys."""

    def share_clipboard(self, read: Callable[[], str], write: Callable[[str], None]) -> None:
        """Connect copy and paste to the clipboard of the system."""
        io = imgui.get_platform_io()
        io.platform_get_clipboard_text_fn = lambda _: read()[:_MOST_PASTED]
        io.platform_set_clipboard_text_fn = lambda _, text: write(text)

    @property
    def wants_mouse(self) -> bool:
        """True while the mouse is over a widget or drags one."""
        return bool(imgui.get_io().want_capture_mouse)

    @property
    def wants_text(self) -> bool:
        """True while a text field takes the keys."""
        return bool(imgui.get_io().want_text_input)

    def go_to(self, page: str) -> None:
        """Open a page of the panel: `Quick`, `Scene` or `Frame`."""
        self._next_page = page

    def handle(self, event: Event) -> None:
        """Pass an event to the widgets."""
        io = imgui.get_io()
        match event:
            case MouseMove(x, y):
                io.add_mouse_pos_event(x, y)
            case MouseButton(button, down):
                io.add_mouse_button_event(_BUTTONS[button], down)
            case Scroll(y, x):
                io.add_mouse_wheel_event(x, y)
            case Key(key, down):
                for side in ("left_", "right_"):
                    if key.startswith(side) and (name := _MODS.get(key.removeprefix(side))):
                        io.add_key_event(getattr(imgui.Key, name), down)
                if known := getattr(imgui.Key, key, None):
                    io.add_key_event(known, down)
            case Character(character):
                io.add_input_character(ord(character))
            case FocusLost():
                io.add_focus_event(False)
                io.add_focus_event(True)

    def draw(
        self,
        viewer: Viewer,
        seconds: float,
        size: tuple[int, int],
        target: moderngl.Framebuffer,
        content_scale: float,
    ) -> None:
        """Draw everything over a cleared framebuffer of this size in points, with `content_scale` pixels each."""
        io = imgui.get_io()
        io.display_size = imgui.ImVec2(*map(float, size))
        io.display_framebuffer_scale = imgui.ImVec2(content_scale, content_scale)
        io.delta_time = max(seconds, 1e-4)
        widgets.unfold(self.unfolded)
        imgui.backends.opengl3_new_frame()
        imgui.new_frame()
        try:
            overlay.pictures(viewer, size)
            viewer.timing = False
            if viewer.panel_px(size[0]):
                self._panel(viewer, size)
            overlay.tools(viewer, size)
            overlay.messages(viewer, size)
            dialogs.show(viewer)
        finally:
            imgui.render()
        target.use()
        target.clear(*GROUND[:3], 1.0)
        imgui.backends.opengl3_render_draw_data(imgui.get_draw_data())

    def _panel(self, viewer: Viewer, size: Size) -> None:
        width = viewer.panel_px(size[0])
        imgui.set_next_window_pos((size[0] - width, 0.0))
        imgui.set_next_window_size((width, size[1]))
        flags = imgui.WindowFlags_.no_decoration.value | imgui.WindowFlags_.no_move.value
        imgui.push_style_var(imgui.StyleVar_.window_rounding.value, 0.0)
        imgui.begin(
            "panel",
            None,
            flags | imgui.WindowFlags_.no_saved_settings.value | imgui.WindowFlags_.no_bring_to_front_on_focus.value,
        )
        imgui.pop_style_var()
        _head(viewer)
        if imgui.begin_tab_bar("pages"):
            pages: Sequence[tuple[str, Any]] = (
                ("Quick", lambda: quick.page(viewer.session)),
                ("Scene", lambda: self.scene_page.show(viewer)),
                ("Frame", lambda: frame_page(viewer)),
            )
            for name, show in pages:
                wanted = imgui.TabItemFlags_.set_selected.value if self._next_page == name else 0
                if imgui.begin_tab_item(f"  {name}  ###{name}", None, wanted)[0]:
                    viewer.timing = name == "Frame"
                    imgui.begin_child("page")
                    show()
                    imgui.dummy((0.0, 8.0))
                    imgui.end_child()
                    imgui.end_tab_item()
            self._next_page = None
            imgui.end_tab_bar()
        imgui.end()

    def release(self) -> None:
        """Free the GPU resources."""
        imgui.backends.opengl3_shutdown()
        imgui.destroy_context(self._context)


def _head(viewer: Viewer) -> None:
    session = viewer.session
    imgui.push_font(None, TITLE_PX)
    imgui.text_unformatted(printable(session.name))
    imgui.pop_font()
    imgui.push_font(None, SMALL_PX)
    file = session.origin.file
    imgui.text_colored(colour(MUTED), printable(str(file)) if file else f"preset {session.origin.name}")
    if session.unsaved:
        imgui.same_line()
        imgui.text_colored(colour(ACCENT), "changed, not saved")
    imgui.pop_font()
    undo, redo = session.history.undo_label, session.history.redo_label
    recorder, compares = viewer.recorder, session.compared is not None
    for icon, command, text, enabled, active in (
        (Icon.open, commands.OPEN, "Open. Ctrl+O", True, False),
        (Icon.save, commands.SAVE, "Save. Ctrl+S", True, False),
        (Icon.picture, commands.SAVE_PICTURE, "Save a picture. F12", True, False),
        (Icon.path, commands.RECORD_PATH, "Record a camera path. F5", True, recorder.recording_path),
        (Icon.video, commands.RECORD_VIDEO, "Record a video. F6", True, recorder.recording_video),
        (Icon.split, commands.SPLIT, "Compare with the scene as it is now. C", True, compares),
        (Icon.undo, commands.UNDO, f"Undo: {undo}. Ctrl+Z" if undo is not None else "Undo", undo is not None, False),
        (
            Icon.redo,
            commands.REDO,
            f"Redo: {redo}. Ctrl+Shift+Z" if redo is not None else "Redo",
            redo is not None,
            False,
        ),
        (Icon.help, commands.TOGGLE_KEY_LIST, "All keys. ?", True, False),
    ):
        imgui.begin_disabled(not enabled)
        imgui.push_style_color(imgui.Col_.text.value, colour(WARN if active else style.INK))
        if imgui.button(f"{icon}##{command.help}", (30.0, 0.0)):
            command.run(viewer)
        imgui.pop_style_color()
        imgui.end_disabled()
        tip(text)
        imgui.same_line(0.0, 5.0)
    imgui.new_line()
    imgui.dummy((0.0, 2.0))
