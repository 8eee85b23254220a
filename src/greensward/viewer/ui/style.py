"""Style of the panel: dark green with one accent colour, and legible type."""

import colorsys
import zlib
from pathlib import Path

import imgui_bundle
from imgui_bundle import imgui

TEXT_PX, SMALL_PX, TITLE_PX = 16.0, 13.5, 20.0
_FONTS = Path(imgui_bundle.__file__).parent / "assets" / "fonts"
Rgba = tuple[float, float, float, float]

INK: Rgba = (0.90, 0.93, 0.86, 1.0)
MUTED: Rgba = (0.62, 0.69, 0.58, 1.0)
FAINT: Rgba = (0.42, 0.49, 0.40, 1.0)
ACCENT: Rgba = (0.66, 0.80, 0.36, 1.0)
WARN: Rgba = (0.96, 0.66, 0.42, 1.0)
GROUND: Rgba = (0.075, 0.105, 0.080, 1.0)
RAISED: Rgba = (0.135, 0.180, 0.135, 1.0)
_FRAME: Rgba = (0.150, 0.200, 0.150, 1.0)
_HOVER: Rgba = (0.215, 0.285, 0.200, 1.0)
_ACTIVE: Rgba = (0.285, 0.375, 0.240, 1.0)
_CLEAR: Rgba = (0.0, 0.0, 0.0, 0.0)
_PASS_COLOURS: dict[str, Rgba] = {
    "move": (0.55, 0.75, 0.85, 1.0),
    "shadows": (0.38, 0.44, 0.62, 1.0),
    "clear": (0.50, 0.50, 0.50, 1.0),
    "objects": (0.72, 0.55, 0.40, 1.0),
    "heads": (0.88, 0.78, 0.42, 1.0),
    "flowers": (0.86, 0.50, 0.52, 1.0),
    "ground": (0.58, 0.47, 0.34, 1.0),
    "grass": (0.52, 0.74, 0.34, 1.0),
    "far": (0.38, 0.60, 0.36, 1.0),
    "light": (0.95, 0.90, 0.66, 1.0),
    "water": (0.36, 0.60, 0.72, 1.0),
    "blur": (0.66, 0.60, 0.80, 1.0),
    "bloom": (0.80, 0.66, 0.76, 1.0),
    "post": (0.78, 0.70, 0.86, 1.0),
    "blit": (0.40, 0.40, 0.45, 1.0),
}
"""Chosen colours of passes; `pass_colour` derives one for any other name."""


class Icon:
    """Glyphs of the icon font; blank without it."""

    look, sow, thin, mow, press, move = "\uf06e", "\uf4d8", "\uf12d", "\uf0c4", "\uf54b", "\uf0b2"
    play, pause, step = "\uf04b", "\uf04c", "\uf051"
    open, save, picture, video, path = "\uf07c", "\uf0c7", "\uf030", "\uf03d", "\uf4d7"
    undo, redo, help, split = "\uf0e2", "\uf01e", "\uf128", "\uf0db"
    plus, trash, close, warning, target = "\uf067", "\uf1f8", "\uf00d", "\uf071", "\uf05b"


def pass_colour(name: str) -> Rgba:
    """Return the colour of a pass in graphs, the same in every run."""
    if name in _PASS_COLOURS:
        return _PASS_COLOURS[name]
    hue = zlib.crc32(name.encode()) % 360 / 360.0
    return (*colorsys.hls_to_rgb(hue, 0.6, 0.4), 1.0)


def colour(rgba: Rgba) -> imgui.ImVec4:
    """Convert a colour for imgui."""
    return imgui.ImVec4(*rgba)


def packed(rgba: Rgba, alpha: float | None = None) -> int:
    """Pack a colour for the draw lists of imgui."""
    return int(imgui.get_color_u32(imgui.ImVec4(*rgba[:3], rgba[3] if alpha is None else alpha)))


def load_fonts() -> None:
    """Load the font for text and icons, or imgui's own if it is missing."""
    fonts = imgui.get_io().fonts
    text, icons = _FONTS / "Roboto" / "Roboto-Regular.ttf", _FONTS / "Font_Awesome_6_Free-Solid-900.otf"
    if not text.exists():
        fonts.add_font_default()
        return
    fonts.add_font_from_file_ttf(str(text), TEXT_PX)
    if icons.exists():
        merged = imgui.ImFontConfig()
        merged.merge_mode = True
        merged.glyph_min_advance_x = 18.0
        merged.glyph_offset = imgui.ImVec2(0.0, 1.0)
        fonts.add_font_from_file_ttf(str(icons), 13.5, merged)


def apply() -> None:
    """Set colours, spacing and rounding."""
    style = imgui.get_style()
    style.window_rounding = style.popup_rounding = 7.0
    style.frame_rounding = style.grab_rounding = style.child_rounding = style.tab_rounding = 4.0
    style.window_border_size = style.popup_border_size = 0.0
    style.window_padding = imgui.ImVec2(14.0, 12.0)
    style.frame_padding = imgui.ImVec2(8.0, 4.5)
    style.item_spacing = imgui.ImVec2(8.0, 6.0)
    style.item_inner_spacing = imgui.ImVec2(6.0, 4.0)
    style.indent_spacing = 14.0
    style.scrollbar_size = 11.0
    style.grab_min_size = 9.0
    style.scrollbar_rounding = 6.0
    c = imgui.Col_
    for which, rgba in {
        c.text: INK,
        c.text_disabled: MUTED,
        c.window_bg: GROUND,
        c.popup_bg: (0.095, 0.130, 0.100, 0.98),
        c.child_bg: _CLEAR,
        c.border: (0.25, 0.32, 0.24, 1.0),
        c.frame_bg: _FRAME,
        c.frame_bg_hovered: _HOVER,
        c.frame_bg_active: _ACTIVE,
        c.title_bg: RAISED,
        c.title_bg_active: RAISED,
        c.scrollbar_bg: _CLEAR,
        c.scrollbar_grab: _HOVER,
        c.scrollbar_grab_hovered: _ACTIVE,
        c.scrollbar_grab_active: _ACTIVE,
        c.check_mark: ACCENT,
        c.slider_grab: (0.36, 0.47, 0.24, 1.0),
        c.slider_grab_active: (0.46, 0.60, 0.28, 1.0),
        c.button: _FRAME,
        c.button_hovered: _HOVER,
        c.button_active: _ACTIVE,
        c.header: RAISED,
        c.header_hovered: _HOVER,
        c.header_active: _ACTIVE,
        c.separator: (0.20, 0.26, 0.19, 1.0),
        c.tab: GROUND,
        c.tab_hovered: _HOVER,
        c.tab_selected: RAISED,
        c.tab_selected_overline: ACCENT,
        c.text_selected_bg: (0.40, 0.52, 0.22, 0.6),
        c.nav_cursor: ACCENT,
        c.modal_window_dim_bg: (0.02, 0.04, 0.02, 0.55),
    }.items():
        style.set_color_(which, colour(rgba))
