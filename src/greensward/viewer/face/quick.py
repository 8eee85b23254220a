"""The first page of the panel: what most people reach for."""

import math

from imgui_bundle import imgui
from pydantic import BaseModel

from greensward.scene import Gusts
from greensward.techniques import TECHNIQUES
from greensward.viewer.face.style import ACCENT, FAINT, MUTED, RAISED, Icon, colour, packed
from greensward.viewer.face.widgets import heading, labelled, note, row, tip
from greensward.viewer.fields import Path, fields_of, value_at
from greensward.viewer.session import Session
from greensward.viewer.sun import EARLIEST_H, LATEST_H, hour_of
from greensward.viewer.walker import MODES

_DIAL_PX = 68.0


def page(session: Session) -> None:
    """Light, wind, grass, technique and view."""
    heading("Light")
    _hour(session)
    for path in (("post", "exposure_ev"), ("sky", "haze"), ("sky", "clouds")):
        one(session, path)
    heading("Wind")
    _wind(session)
    heading("Grass")
    for path in (("sowing", "density_per_m2"), ("sowing", "drift"), ("sowing", "clumping")):
        one(session, path)
    heading("Technique")
    for number, technique in enumerate(TECHNIQUES, start=1):
        if imgui.radio_button(f"{technique.name}##{number}", session.scene.technique.name == technique.name):
            session.use_technique(technique.name)
        tip(technique.source)
        imgui.same_line(imgui.get_window_width() - 46.0)
        imgui.text_colored(colour(FAINT), str(number))
    heading("View")
    _view(session)


def one(session: Session, path: Path) -> None:
    """One key of the scene, wherever it stands."""
    holder: BaseModel = value_at(session.scene, path[:-1])
    spec = next(spec for spec in fields_of(type(holder)) if spec.name == path[-1])
    row(session, path, spec, getattr(holder, spec.name))


def _hour(session: Session) -> None:
    sun = session.scene.sun
    hour = hour_of(sun.azimuth_deg, sun.elevation_deg)
    labelled("time of day", "The sun of a day in May at 48° north. Its place can be set freely under Scene, sun.")
    minutes = round(hour * 12.0) * 5
    shown = f"{minutes // 60:02d}:{minutes % 60:02d}"
    changed, new = imgui.slider_float("##hour", hour, EARLIEST_H, LATEST_H, shown)
    if changed:
        session.set_hour(min(max(new, EARLIEST_H), LATEST_H))
    if imgui.is_item_deactivated():
        session.history.seal()


def _wind(session: Session) -> None:
    winds = session.scene.wind
    if not winds:
        note("It is calm.")
        if imgui.button(f"{Icon.plus}  let it blow"):
            session.add(("wind",), Gusts)
        return
    wind = winds[0]
    if hasattr(wind, "direction_deg"):
        _dial(session, float(wind.direction_deg))
        imgui.same_line()
        imgui.begin_group()
        note("Drag the dial: the wind blows from there. North is up.")
        imgui.end_group()
    shown = [spec for spec in fields_of(type(wind)) if spec.unit == "m/s" or spec.name in ("gustiness", "turbulence")]
    for spec in shown:
        row(session, ("wind", 0, spec.name), spec, getattr(wind, spec.name))
    if len(winds) > 1:
        note(f"{len(winds) - 1} more under Scene, wind.")


def _dial(session: Session, from_deg: float) -> None:
    """A compass; the needle points to where the wind goes."""
    corner = imgui.get_cursor_screen_pos()
    imgui.invisible_button("##dial", (_DIAL_PX, _DIAL_PX))
    middle, radius = (corner.x + 0.5 * _DIAL_PX, corner.y + 0.5 * _DIAL_PX), 0.46 * _DIAL_PX
    if imgui.is_item_active():
        mouse = imgui.get_mouse_pos()
        dx, dy = mouse.x - middle[0], mouse.y - middle[1]
        if math.hypot(dx, dy) > 3.0:
            turned = round(math.degrees(math.atan2(dx, -dy)) % 360.0)
            session.change(("wind", 0, "direction_deg"), float(turned), drag=True)
    if imgui.is_item_deactivated():
        session.history.seal()
    lit = imgui.is_item_hovered() or imgui.is_item_active()
    draw = imgui.get_window_draw_list()
    draw.add_circle_filled(middle, radius, packed(RAISED), 48)
    for quarter in range(8):
        angle = math.radians(45.0 * quarter)
        inner = radius - (7.0 if quarter % 2 == 0 else 4.0)
        a, b = ((middle[0] + r * math.sin(angle), middle[1] - r * math.cos(angle)) for r in (inner, radius - 2.0))
        draw.add_line(a, b, packed(FAINT), 1.0)
    angle = math.radians(from_deg)
    way = -math.sin(angle), math.cos(angle)
    start = middle[0] - 0.72 * radius * way[0], middle[1] - 0.72 * radius * way[1]
    end = middle[0] + 0.72 * radius * way[0], middle[1] + 0.72 * radius * way[1]
    line = packed(ACCENT if lit else (0.56, 0.70, 0.32, 1.0))
    draw.add_line(start, end, line, 2.5)
    side = -way[1], way[0]
    wings = [
        (end[0] - 9.0 * way[0] + 5.0 * s * side[0], end[1] - 9.0 * way[1] + 5.0 * s * side[1]) for s in (-1.0, 1.0)
    ]
    draw.add_triangle_filled(end, wings[0], wings[1], line)
    draw.add_circle_filled(start, 3.5, line)
    tip(f"From {from_deg:.0f}°, clockwise from north.")


def _view(session: Session) -> None:
    walker = session.walker
    width = (imgui.get_content_region_avail().x - 16.0) / 3.0
    helps = {
        "walk": "On the ground, as fast as a person; Shift hurries. F",
        "fly": "Anywhere above the ground; E and Q go up and down. F",
        "orbit": "Around what you look at; W and S come nearer or leave. O",
    }
    for i, mode in enumerate(MODES):
        if i:
            imgui.same_line()
        chosen = walker.mode == mode
        imgui.push_style_color(imgui.Col_.button.value, colour((0.33, 0.43, 0.22, 1.0) if chosen else RAISED))
        imgui.push_style_color(imgui.Col_.text.value, colour((0.97, 1.0, 0.92, 1.0) if chosen else MUTED))
        if imgui.button(mode, (width, 0.0)):
            walker.choose(mode)
        imgui.pop_style_color(2)
        tip(helps[mode])
    labelled("pace", "Factor on the speed. The wheel of the mouse changes it too.")
    changed, pace = imgui.slider_float(
        "##pace", walker.pace, 0.1, 10.0, "%.1f ×", imgui.SliderFlags_.logarithmic.value
    )
    if changed:
        walker.pace = min(max(pace, 0.02), 100.0)
    one(session, ("camera", "fov_y_deg"))
    if imgui.button("Back to the start"):
        session.go_back()
    tip("Stand where the scene's camera is. Home")
    imgui.same_line()
    if imgui.button("Start from here"):
        session.keep_view()
    tip("Make what you see now the scene's own camera.")
