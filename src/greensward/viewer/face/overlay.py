"""What lies over the picture: tools, the brush on the ground, handles, time, messages."""

import math
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import imgui

from greensward.viewer.brushes import Tool
from greensward.viewer.clock import FASTEST, SLOWEST
from greensward.viewer.controls import HINT
from greensward.viewer.face.style import ACCENT, INK, MUTED, WARN, Icon, colour, packed
from greensward.viewer.face.widgets import tip
from greensward.viewer.saving import legible

if TYPE_CHECKING:
    from greensward.viewer.viewer import Viewer

_TOOLS: tuple[tuple[Tool, str, str], ...] = (
    ("look", Icon.look, "Look: hold a button of the mouse and move."),
    ("sow", Icon.sow, "Sow: paint grass back to full density and height."),
    ("thin", Icon.thin, "Thin: paint grass away."),
    ("mow", Icon.mow, "Mow: cut the grass short."),
    ("press", Icon.press, "Press: lay the grass down along a track."),
    ("move", Icon.move, "Move: drag objects, and what winds and forces come from."),
)
_FLOATING = (
    imgui.WindowFlags_.no_decoration.value
    | imgui.WindowFlags_.no_move.value
    | imgui.WindowFlags_.no_saved_settings.value
    | imgui.WindowFlags_.always_auto_resize.value
    | imgui.WindowFlags_.no_focus_on_appearing.value
    | imgui.WindowFlags_.no_nav.value
)
_RING = 48


def pictures(viewer: "Viewer", size: tuple[int, int]) -> None:
    """The picture, or two side by side, behind everything."""
    draw = imgui.get_background_draw_list()
    for pane, (x, y, width, height) in zip(viewer.panes, viewer.areas(size), strict=False):
        if pane.picture is None:
            text = "Sowing …" if not pane.problems else "The scene cannot be drawn."
            wide = imgui.calc_text_size(text).x
            draw.add_text((x + 0.5 * (width - wide), y + 0.5 * height - 10.0), packed(MUTED), text)
            continue
        name, _ = pane.picture
        draw.add_image(imgui.ImTextureRef(name), (x, y), (x + width, y + height), (0.0, 1.0), (1.0, 0.0))
    areas = viewer.areas(size)
    if len(areas) > 1:
        x, _, _, height = areas[1]
        draw.add_line((x, 0.0), (x, height), packed(INK, 0.8), 2.0)
        for word, (left, _, width, _), pane in zip(("before", "now"), areas, viewer.panes, strict=True):
            text = f"{word}   {pane.scene.technique.name if pane.scene else ''}"
            wide = imgui.calc_text_size(text).x
            at, top = left + 0.5 * (width - wide), 92.0  # below the tools; messages come at the foot
            box = (at - 9.0, top - 3.0), (at + wide + 9.0, top + 22.0)
            draw.add_rect_filled(*box, packed((0.05, 0.08, 0.05, 0.75)), 5.0)
            draw.add_text((at, top), packed(INK), text)
    _brush(viewer)
    _handles(viewer)


def _brush(viewer: "Viewer") -> None:
    """A ring on the ground where the brush is, and its stroke so far."""
    session, at = viewer.session, viewer.hand.on_ground
    if session.tool in ("look", "move"):
        return
    draw = imgui.get_background_draw_list()
    heights = session.heights
    sowing = any(pane.busy for pane in viewer.panes)
    if (stroke := session.stroke or (session.laid if sowing else [])) and session.tool != "press":
        spots = np.array(stroke)
        points = np.column_stack([spots[:, 0], heights.height(spots[:, 0], spots[:, 1]) + 0.1, spots[:, 1]])
        shown = [spot for point in points if (spot := viewer.sight.spot(point)) is not None]
        for under, wide in ((packed((0.0, 0.0, 0.0, 1.0), 0.4), 7.0), (packed(ACCENT), 4.0)):
            for spot in shown:
                draw.add_circle_filled(spot, 0.5 * wide, under)
            for one, next_one in pairwise(shown):
                draw.add_line(one, next_one, under, wide)
    if at is None:
        return
    angle = np.linspace(0.0, math.tau, _RING + 1)
    x = at[0] + session.brush.radius_m * np.sin(angle)
    z = at[2] + session.brush.radius_m * np.cos(angle)
    ring = [viewer.sight.spot(p) for p in np.column_stack([x, heights.height(x, z) + 0.15, z])]
    for a, b in pairwise(ring):
        if a is not None and b is not None:
            draw.add_line(a, b, packed((0.0, 0.0, 0.0, 1.0), 0.35), 4.0)
            draw.add_line(a, b, packed(ACCENT), 2.0)


def _handles(viewer: "Viewer") -> None:
    draw = imgui.get_background_draw_list()
    for handle in viewer.hand.handles:
        spot = viewer.sight.spot(handle.at_ws)
        if spot is None:
            continue
        held = viewer.hand.held is not None and viewer.hand.held.path == handle.path
        lit = held or viewer.hand.near == handle.path
        away_m = float(np.linalg.norm(handle.at_ws - viewer.session.walker.position_ws))
        radius = 8.0 if lit else min(max(45.0 / away_m, 2.0), 6.0)
        draw.add_circle_filled(spot, radius, packed(ACCENT if lit else INK, 0.9))
        draw.add_circle(spot, radius + 1.5, packed((0.0, 0.0, 0.0, 1.0), 0.5), 0, 1.5)
        if lit:
            wide = imgui.calc_text_size(handle.name).x
            x, y = spot[0] + 14.0, spot[1] - 12.0
            draw.add_rect_filled((x - 4.0, y), (x + wide + 6.0, y + 23.0), packed((0.05, 0.08, 0.05, 0.8)), 4.0)
            draw.add_text((x + 1.0, y + 3.0), packed(INK), handle.name)


def tools(viewer: "Viewer", size: tuple[int, int]) -> None:
    """Tools at the upper left, time and speed at the lower left."""
    if size[0] < 320 or size[1] < 240 or not viewer.face.panel:
        return
    session = viewer.session
    imgui.push_style_var(imgui.StyleVar_.window_padding.value, imgui.ImVec2(6.0, 6.0))
    imgui.set_next_window_pos((12.0, 12.0))
    imgui.set_next_window_bg_alpha(0.78)
    imgui.begin("tools", None, _FLOATING)
    for i, (tool, icon, text) in enumerate(_TOOLS):
        if i:
            imgui.same_line(0.0, 4.0)
        chosen = session.tool == tool
        imgui.push_style_color(
            imgui.Col_.button.value, colour((0.36, 0.47, 0.22, 1.0) if chosen else (0.0, 0.0, 0.0, 0.0))
        )
        if imgui.button(f"{icon}  {tool}"):
            viewer.choose_tool(tool)
        imgui.pop_style_color()
        tip(text)
    if session.tool not in ("look", "move"):
        _brush_settings(viewer)
    imgui.end()
    _time(viewer, size)
    imgui.pop_style_var()


def _brush_settings(viewer: "Viewer") -> None:
    session = viewer.session
    imgui.set_next_item_width(150.0)
    changed, width = imgui.slider_float(
        "##width", 2.0 * session.brush.radius_m, 0.2, 40.0, "%.1f m wide", imgui.SliderFlags_.logarithmic.value
    )
    tip("Width of the brush. The wheel of the mouse changes it too.")
    if changed:
        session.brush = replace(session.brush, radius_m=min(max(0.5 * width, 0.05), 50.0))
    imgui.same_line()
    imgui.set_next_item_width(150.0)
    changed, strength = imgui.slider_float("##strength", 100.0 * session.brush.strength, 5.0, 100.0, "%.0f %% strong")
    if changed:
        session.brush = replace(session.brush, strength=min(max(strength / 100.0, 0.01), 1.0))


def _time(viewer: "Viewer", size: tuple[int, int]) -> None:
    clock, session = viewer.session.clock, viewer.session
    imgui.set_next_window_pos((12.0, size[1] - 12.0), 0, (0.0, 1.0))
    imgui.set_next_window_bg_alpha(0.78)
    imgui.begin("time", None, _FLOATING)
    if imgui.button(Icon.play if clock.paused else Icon.pause, (32.0, 0.0)):
        viewer.act("pause")
    tip("Let time run, or stop it. P")
    imgui.same_line(0.0, 4.0)
    if imgui.button(Icon.step, (32.0, 0.0)):
        viewer.act("step")
    tip("Go on by a thirtieth of a second. N")
    imgui.same_line()
    imgui.set_next_item_width(96.0)
    changed, pace = imgui.slider_float(
        "##speed", clock.pace, 0.05, 4.0, "%.2f ×", imgui.SliderFlags_.logarithmic.value
    )
    tip("Slow motion, or a lapse.")
    if changed:
        clock.pace = min(max(pace, SLOWEST), FASTEST)
    imgui.same_line()
    imgui.align_text_to_frame_padding()
    imgui.text_unformatted(f"{clock.time_s:7.1f} s")
    imgui.same_line()
    pane = viewer.panes[0]
    fps = 1e3 / pane.took_ms if pane.took_ms else 0.0
    shown = "still" if viewer.resting else f"{fps:.0f} fps"
    at = pane.picture[1] if pane.picture else (0, 0)
    imgui.text_colored(colour(MUTED), f"{shown}   {at[0]}×{at[1]}   {session.walker.mode}")
    tip("Frames a second, the size at which the picture is drawn, and how you move.")
    imgui.end()


def messages(viewer: "Viewer", size: tuple[int, int]) -> None:
    """What is going on, what was done, and what is wrong."""
    width = viewer.areas(size)[-1][0] + viewer.areas(size)[-1][2]
    lines: list[tuple[str, bool]] = []
    for pane in viewer.panes:
        if pane.busy and pane.picture is not None:
            lines.append((f"{Icon.sow}  Sowing … {viewer.building_s(pane):.0f} s", False))
            break
    lines += [(text, False) for text in viewer.recorder.working]
    problems = dict.fromkeys(problem for pane in viewer.panes for problem in pane.problems)
    for problem in (*viewer.problems, *problems):
        lines.append((f"{Icon.warning}  {problem}", True))
    lines += [(f"{Icon.warning}  {text}" if bad else text, bad) for text, bad in viewer.told]
    if not lines and viewer.is_new and viewer.panes[0].picture:
        lines = [(HINT, False)]
    if not lines:
        return
    imgui.set_next_window_pos((0.5 * width, size[1] - 64.0), 0, (0.5, 1.0))
    imgui.set_next_window_bg_alpha(0.88)
    imgui.set_next_window_size_constraints((0.0, 0.0), (max(0.86 * width, 120.0), 0.7 * size[1]))
    imgui.begin("messages", None, _FLOATING | imgui.WindowFlags_.no_inputs.value)
    most = max(0.8 * width, 100.0)
    for text, bad in lines[:10]:
        imgui.push_text_wrap_pos(most)
        for part in [line for line in text.splitlines() if line.strip(" =")][:8]:
            imgui.text_colored(colour(WARN if bad else INK), legible(part[:400]))
        imgui.pop_text_wrap_pos()
    imgui.end()
