"""Overlay of the viewports: tools, outline of the brush, handles, time, messages."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
from imgui_bundle import imgui

from greensward.viewer import commands
from greensward.viewer.brushes import Tool
from greensward.viewer.clock import FASTEST, SLOWEST
from greensward.viewer.saving import printable
from greensward.viewer.ui.style import ACCENT, INK, MUTED, WARN, Icon, colour, packed
from greensward.viewer.ui.widgets import tip
from greensward.viewer.viewer import Viewer

_TOOLS: tuple[tuple[Tool, str, str], ...] = (
    ("look", Icon.look, "Look: drag to turn the camera."),
    ("sow", Icon.sow, "Sow: restore full density and height."),
    ("thin", Icon.thin, "Thin: remove grass."),
    ("mow", Icon.mow, "Mow: cut the grass short."),
    ("press", Icon.press, "Press: press grass down along a track."),
    ("move", Icon.move, "Move: drag objects, and centres of winds and forces."),
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
_HINT = "Move with W A S D   ·   drag to turn the camera   ·   ? lists all keys"


def pictures(viewer: Viewer, size: tuple[int, int]) -> None:
    """Draw the picture, or two side by side, behind everything."""
    draw = imgui.get_background_draw_list()
    for viewport, (x, y, width, height) in zip(viewer.viewports, viewer.areas(size), strict=False):
        if viewport.picture is None:
            text = "Sowing …" if not viewport.problems else "The scene cannot be drawn."
            wide = imgui.calc_text_size(text).x
            draw.add_text((x + 0.5 * (width - wide), y + 0.5 * height - 10.0), packed(MUTED), text)
            continue
        name, _ = viewport.picture
        draw.add_image(imgui.ImTextureRef(name), (x, y), (x + width, y + height), (0.0, 1.0), (1.0, 0.0))
    areas = viewer.areas(size)
    if len(areas) > 1:
        x, _, _, height = areas[1]
        draw.add_line((x, 0.0), (x, height), packed(INK, 0.8), 2.0)
        for label, (left, _, width, _), viewport in zip(("before", "now"), areas, viewer.viewports, strict=True):
            text = f"{label}   {viewport.scene.technique.name if viewport.scene else ''}"
            wide = imgui.calc_text_size(text).x
            at, top = left + 0.5 * (width - wide), 92.0  # below the tools; messages are at the bottom
            box = (at - 9.0, top - 3.0), (at + wide + 9.0, top + 22.0)
            draw.add_rect_filled(*box, packed((0.05, 0.08, 0.05, 0.75)), 5.0)
            draw.add_text((at, top), packed(INK), text)
    _brush(viewer)
    _handles(viewer)


def _brush(viewer: Viewer) -> None:
    """Draw the outline of the brush on the ground, and the current stroke."""
    session, centre = viewer.session, viewer.pointer.on_ground
    if session.tool in ("look", "move"):
        return
    draw = imgui.get_background_draw_list()
    heights = session.heights
    if (stroke := session.stroke or (session.last_stroke if viewer.building else [])) and session.tool != "press":
        path = np.array(stroke)
        points = np.column_stack([path[:, 0], heights.height(path[:, 0], path[:, 1]) + 0.1, path[:, 1]])
        visible = [at for at in map(viewer.picker.project, points) if at is not None]
        for line, width in ((packed((0.0, 0.0, 0.0, 1.0), 0.4), 7.0), (packed(ACCENT), 4.0)):
            for joint in visible:
                draw.add_circle_filled(joint, 0.5 * width, line)
            for start, end in pairwise(visible):
                draw.add_line(start, end, line, width)
    if centre is None:
        return
    angle = np.linspace(0.0, math.tau, _RING + 1)
    x = centre[0] + session.brush.radius_m * np.sin(angle)
    z = centre[2] + session.brush.radius_m * np.cos(angle)
    ring = [viewer.picker.project(p) for p in np.column_stack([x, heights.height(x, z) + 0.15, z])]
    for a, b in pairwise(ring):
        if a is not None and b is not None:
            draw.add_line(a, b, packed((0.0, 0.0, 0.0, 1.0), 0.35), 4.0)
            draw.add_line(a, b, packed(ACCENT), 2.0)


def _handles(viewer: Viewer) -> None:
    draw = imgui.get_background_draw_list()
    for handle in viewer.pointer.handles:
        at = viewer.picker.project(handle.position_ws)
        if at is None:
            continue
        held = viewer.pointer.held is not None and viewer.pointer.held.path == handle.path
        lit = held or viewer.pointer.hovered == handle.path
        distance_m = float(np.linalg.norm(handle.position_ws - viewer.session.controller.position_ws))
        radius = 8.0 if lit else min(max(45.0 / distance_m, 2.0), 6.0)
        draw.add_circle_filled(at, radius, packed(ACCENT if lit else INK, 0.9))
        draw.add_circle(at, radius + 1.5, packed((0.0, 0.0, 0.0, 1.0), 0.5), 0, 1.5)
        if lit:
            wide = imgui.calc_text_size(handle.name).x
            x, y = at[0] + 14.0, at[1] - 12.0
            draw.add_rect_filled((x - 4.0, y), (x + wide + 6.0, y + 23.0), packed((0.05, 0.08, 0.05, 0.8)), 4.0)
            draw.add_text((x + 1.0, y + 3.0), packed(INK), handle.name)


def tools(viewer: Viewer, size: tuple[int, int]) -> None:
    """Draw tools at the upper left, time and its speed at the lower left."""
    if size[0] < 320 or size[1] < 240 or not viewer.panel:
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
            session.tool = tool
        imgui.pop_style_color()
        tip(text)
    if session.tool not in ("look", "move"):
        _brush_settings(viewer)
    imgui.end()
    _time(viewer, size)
    imgui.pop_style_var()


def _brush_settings(viewer: Viewer) -> None:
    session = viewer.session
    imgui.set_next_item_width(150.0)
    changed, width = imgui.slider_float(
        "##width", 2.0 * session.brush.radius_m, 0.2, 40.0, "%.1f m wide", imgui.SliderFlags_.logarithmic.value
    )
    tip("Width of the brush. The mouse wheel changes it as well.")
    if changed:
        session.brush = replace(session.brush, radius_m=min(max(0.5 * width, 0.05), 50.0))
    imgui.same_line()
    imgui.set_next_item_width(150.0)
    changed, strength = imgui.slider_float("##strength", 100.0 * session.brush.strength, 5.0, 100.0, "%.0f %% strong")
    if changed:
        session.brush = replace(session.brush, strength=min(max(strength / 100.0, 0.01), 1.0))


def _time(viewer: Viewer, size: tuple[int, int]) -> None:
    clock, session = viewer.session.clock, viewer.session
    imgui.set_next_window_pos((12.0, size[1] - 12.0), 0, (0.0, 1.0))
    imgui.set_next_window_bg_alpha(0.78)
    imgui.begin("time", None, _FLOATING)
    if imgui.button(Icon.play if clock.paused else Icon.pause, (32.0, 0.0)):
        commands.PAUSE.run(viewer)
    tip("Pause or continue. P")
    imgui.same_line(0.0, 4.0)
    if imgui.button(Icon.step, (32.0, 0.0)):
        commands.STEP.run(viewer)
    tip("Advance by 1/30 s. N")
    imgui.same_line()
    imgui.set_next_item_width(96.0)
    changed, rate = imgui.slider_float(
        "##speed", clock.rate, 0.05, 4.0, "%.2f ×", imgui.SliderFlags_.logarithmic.value
    )
    tip("Speed of time: below 1 slow motion, above 1 time lapse.")
    if changed:
        clock.rate = min(max(rate, SLOWEST), FASTEST)
    imgui.same_line()
    imgui.align_text_to_frame_padding()
    imgui.text_unformatted(f"{clock.time_s:7.1f} s")
    imgui.same_line()
    viewport = viewer.viewports[0]
    fps = 1e3 / viewport.took_ms if viewport.took_ms else 0.0
    shown = "still" if viewer.idle else f"{fps:.0f} fps"
    at = viewport.picture[1] if viewport.picture else (0, 0)
    imgui.text_colored(colour(MUTED), f"{shown}   {at[0]}×{at[1]}   {session.controller.mode}")
    tip("Frames per second, resolution of the picture, and mode of the camera.")
    imgui.end()


def messages(viewer: Viewer, size: tuple[int, int]) -> None:
    """Draw work in progress, messages and errors."""
    width = viewer.areas(size)[-1][0] + viewer.areas(size)[-1][2]
    lines: list[tuple[str, bool]] = []
    for viewport in viewer.viewports:
        if viewport.busy and viewport.picture is not None:
            lines.append((f"{Icon.sow}  Sowing … {viewer.building_s(viewport):.0f} s", False))
            break
    lines += [(text, False) for text in viewer.recorder.progress]
    problems = dict.fromkeys(problem for viewport in viewer.viewports for problem in viewport.problems)
    for problem in (*viewer.problems, *problems):
        lines.append((f"{Icon.warning}  {problem}", True))
    for message in viewer.messages:
        lines.append((f"{Icon.warning}  {message.text}" if message.error else message.text, message.error))
    if not lines and viewer.shows_hint and viewer.viewports[0].picture:
        lines = [(_HINT, False)]
    if not lines:
        return
    imgui.set_next_window_pos((0.5 * width, size[1] - 64.0), 0, (0.5, 1.0))
    imgui.set_next_window_bg_alpha(0.88)
    imgui.set_next_window_size_constraints((0.0, 0.0), (max(0.86 * width, 120.0), 0.7 * size[1]))
    imgui.begin("messages", None, _FLOATING | imgui.WindowFlags_.no_inputs.value)
    most = max(0.8 * width, 100.0)
    for text, error in lines[:10]:
        imgui.push_text_wrap_pos(most)
        for part in [line for line in text.splitlines() if line.strip(" =")][:8]:
            imgui.text_colored(colour(WARN if error else INK), printable(part[:400]))
        imgui.pop_text_wrap_pos()
    imgui.end()
