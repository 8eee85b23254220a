"""The user interface, drawn with Dear ImGui into any framebuffer: a window's, or one of a test."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import moderngl
from imgui_bundle import imgui

from greensward.viewer import controls
from greensward.viewer.face import overlay, quick, style, widgets
from greensward.viewer.face.dialogs import Dialogs
from greensward.viewer.face.pages import FramePage, ScenePage
from greensward.viewer.face.style import ACCENT, GROUND, MUTED, PANEL_PX, SMALL_PX, TITLE_PX, WARN, Icon, colour
from greensward.viewer.face.widgets import tip
from greensward.viewer.saving import legible

if TYPE_CHECKING:
    from greensward.viewer.viewer import Viewer

_BUTTONS = {"left": 0, "right": 1, "middle": 2}
_MODS = {"ctrl": "mod_ctrl", "shift": "mod_shift", "alt": "mod_alt"}
_NARROWEST_PX = 640
_MOST_PASTED = 10_000


class Face:
    """Panel, tools, messages and dialogs around the picture."""

    def __init__(self) -> None:
        self._context = imgui.create_context()
        io = imgui.get_io()
        io.set_ini_filename("")
        io.config_input_trickle_event_queue = False
        io.config_drag_click_to_input_text = False
        style.load_fonts()
        style.apply()
        imgui.backends.opengl3_init("#version 430")
        self.panel = True
        self.dialogs = Dialogs()
        self.scene_page, self.frame_page = ScenePage(), FramePage()
        self.timing = False
        """Whether the times of passes are on show."""
        self._goto: str | None = None
        self.unfolded = False
        """Whether every table is opened, for a look at all keys."""

    def share_clipboard(self, read: Callable[[], str], write: Callable[[str], None]) -> None:
        """Copy and paste with other programs."""
        io = imgui.get_platform_io()
        io.platform_get_clipboard_text_fn = lambda _: read()[:_MOST_PASTED]
        io.platform_set_clipboard_text_fn = lambda _, text: write(text)

    @property
    def wants_mouse(self) -> bool:
        """Whether the mouse is over what is drawn here, or drags it."""
        return bool(imgui.get_io().want_capture_mouse)

    @property
    def wants_keys(self) -> bool:
        """Whether something is being typed or asked."""
        return bool(imgui.get_io().want_text_input) or self.dialogs.open

    def panel_px(self, width: int) -> int:
        """Width of the panel in a window of this width."""
        return min(PANEL_PX, width) if self.panel and width >= _NARROWEST_PX else 0

    def go_to(self, page: str) -> None:
        """Open a page of the panel: `Quick`, `Scene` or `Frame`."""
        self._goto = page

    def feed(self, event: controls.Event) -> None:
        """Let widgets know of an event."""
        io = imgui.get_io()
        match event:
            case controls.Move(x, y):
                io.add_mouse_pos_event(x, y)
            case controls.Click(button, down):
                io.add_mouse_button_event(_BUTTONS[button], down)
            case controls.Wheel(y, x):
                io.add_mouse_wheel_event(x, y)
            case controls.Press(key, down):
                for side in ("left_", "right_"):
                    if key.startswith(side) and (name := _MODS.get(key.removeprefix(side))):
                        io.add_key_event(getattr(imgui.Key, name), down)
                if known := getattr(imgui.Key, key, None):
                    io.add_key_event(known, down)
            case controls.Text(character):
                io.add_input_character(ord(character))
            case controls.Blur():
                io.add_focus_event(False)
                io.add_focus_event(True)

    def draw(
        self, viewer: "Viewer", seconds: float, size: tuple[int, int], target: moderngl.Framebuffer, zoom: float
    ) -> None:
        """Draw everything over a cleared framebuffer of this size in points, `zoom` times as many pixels."""
        io = imgui.get_io()
        io.display_size = imgui.ImVec2(*map(float, size))
        io.display_framebuffer_scale = imgui.ImVec2(zoom, zoom)
        io.delta_time = max(seconds, 1e-4)
        widgets.unfold(self.unfolded)
        imgui.backends.opengl3_new_frame()
        imgui.new_frame()
        try:
            overlay.pictures(viewer, size)
            self.timing = False
            if self.panel_px(size[0]):
                self._panel(viewer, size)
            overlay.tools(viewer, size)
            overlay.messages(viewer, size)
            self.dialogs.show(viewer)
        finally:
            imgui.render()
        target.use()
        target.clear(*GROUND[:3], 1.0)
        imgui.backends.opengl3_render_draw_data(imgui.get_draw_data())

    def _panel(self, viewer: "Viewer", size: tuple[int, int]) -> None:
        width = self.panel_px(size[0])
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
        self._head(viewer)
        if imgui.begin_tab_bar("pages"):
            pages: Sequence[tuple[str, Any]] = (
                ("Quick", lambda: quick.page(viewer.session)),
                ("Scene", lambda: self.scene_page.show(viewer)),
                ("Frame", lambda: self.frame_page.show(viewer)),
            )
            for name, show in pages:
                wanted = imgui.TabItemFlags_.set_selected.value if self._goto == name else 0
                if imgui.begin_tab_item(f"  {name}  ###{name}", None, wanted)[0]:
                    self.timing = name == "Frame"
                    imgui.begin_child("page")
                    show()
                    imgui.dummy((0.0, 8.0))
                    imgui.end_child()
                    imgui.end_tab_item()
            self._goto = None
            imgui.end_tab_bar()
        imgui.end()

    def _head(self, viewer: "Viewer") -> None:
        session = viewer.session
        imgui.push_font(None, TITLE_PX)
        imgui.text_unformatted(legible(session.name))
        imgui.pop_font()
        imgui.push_font(None, SMALL_PX)
        file = session.origin.file
        imgui.text_colored(colour(MUTED), legible(str(file)) if file else f"the preset {session.origin.name}")
        if session.unsaved:
            imgui.same_line()
            imgui.text_colored(colour(ACCENT), "changed, not saved")
        imgui.pop_font()
        history = session.history
        for icon, name, text, possible in (
            (Icon.open, "ask_open", "Open. Ctrl+O", True),
            (Icon.save, "save", "Save. Ctrl+S", True),
            (Icon.picture, "picture", "Save a picture. F12", True),
            (Icon.path, "record_path", "Record the way you go. F5", True),
            (Icon.video, "record_video", "Record a video. F6", True),
            (Icon.split, "split", "Keep the scene as it is beside what it becomes. C", True),
            (Icon.undo, "undo", f"Undo: {history.undoes}. Ctrl+Z", history.undoes is not None),
            (Icon.redo, "redo", f"Do again: {history.redoes}. Ctrl+Shift+Z", history.redoes is not None),
            (Icon.help, "toggle_help", "All keys. ?", True),
        ):
            imgui.begin_disabled(not possible)
            lit = name in viewer.recorder.running or (name == "split" and viewer.session.compared is not None)
            imgui.push_style_color(imgui.Col_.text.value, colour(WARN if lit else style.INK))
            if imgui.button(f"{icon}##{name}", (30.0, 0.0)):
                viewer.act(name)
            imgui.pop_style_color()
            imgui.end_disabled()
            tip(text if possible else text.split(":")[0])
            imgui.same_line(0.0, 5.0)
        imgui.new_line()
        imgui.dummy((0.0, 2.0))

    def release(self) -> None:
        """Free what it holds on the GPU."""
        imgui.backends.opengl3_shutdown()
        imgui.destroy_context(self._context)
