"""First page of the panel: the settings that are used most."""

import math

from imgui_bundle import imgui
from pydantic import BaseModel

from greensward.scene import Gusts
from greensward.techniques import TECHNIQUES
from greensward.viewer.camera_controller import MODES
from greensward.viewer.fields import KeyPath, fields_of, value_at
from greensward.viewer.session import Session
from greensward.viewer.sun import EARLIEST_H, LATEST_H, hour_of
from greensward.viewer.ui.style import ACCENT, FAINT, MUTED, RAISED, Icon, colour, packed
from greensward.viewer.ui.widgets import heading, labelled, note, row, tip

_DIAL_PX = 68.0


def page(session: Session) -> None:
    """Draw the page: light, wind, grass, technique and view."""
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


def one(session: Session, path: KeyPath) -> None:
    """Draw one key of the scene."""
    holder: BaseModel = value_at(session.scene, path[:-1])
    spec = next(spec for spec in fields_of(type(holder)) if spec.name == path[-1])
    row(session, path, spec, getattr(holder, spec.name))


def _hour(session: Session) -> None:
    sun = session.scene.sun
    hour = hour_of(sun.azimuth_deg, sun.elevation_deg)
    labelled("time of day", "Sun of a day in May at 48° north. Any other position can be set under Scene, sun.")
    minutes = round(hour * 12.0) * 5
    shown = f"{minutes // 60:02d}:{minutes % 60:02d}"
    changed, new = imgui.slider_float("##hour", hour, EARLIEST_H, LATEST_H, shown)
    if changed:
        session.set_hour(min(max(new, EARLIEST_H), LATEST_H))
    if imgui.is_item_deactivated():
        session.history.end_drag()


def _wind(session: Session) -> None:
    winds = session.scene.wind
    if not winds:
        note("There is no wind.")
        if imgui.button(f"{Icon.plus}  add wind"):
            session.add(("wind",), Gusts)
        return
    wind = winds[0]
    if hasattr(wind, "direction_deg"):
        _dial(session, float(wind.direction_deg))
        imgui.same_line()
        imgui.begin_group()
        note("Drag to set where the wind comes from. North is up.")
        imgui.end_group()
    shown = [spec for spec in fields_of(type(wind)) if spec.unit == "m/s" or spec.name in ("gustiness", "turbulence")]
    for spec in shown:
        row(session, ("wind", 0, spec.name), spec, getattr(wind, spec.name))
    if len(winds) > 1:
        note(f"{len(winds) - 1} more under Scene, wind.")


def _dial(session: Session, from_deg: float) -> None:
    """Draw a compass whose needle points downwind."""
    corner = imgui.get_cursor_screen_pos()
    imgui.invisible_button("##dial", (_DIAL_PX, _DIAL_PX))
    centre, radius = (corner.x + 0.5 * _DIAL_PX, corner.y + 0.5 * _DIAL_PX), 0.46 * _DIAL_PX
    if imgui.is_item_active():
        mouse = imgui.get_mouse_pos()
        dx, dy = mouse.x - centre[0], mouse.y - centre[1]
        if math.hypot(dx, dy) > 3.0:
            turned = round(math.degrees(math.atan2(dx, -dy)) % 360.0)
            session.change(("wind", 0, "direction_deg"), float(turned), drag=True)
    if imgui.is_item_deactivated():
        session.history.end_drag()
    lit = imgui.is_item_hovered() or imgui.is_item_active()
    draw = imgui.get_window_draw_list()
    draw.add_circle_filled(centre, radius, packed(RAISED), 48)
    for quarter in range(8):
        angle = math.radians(45.0 * quarter)
        inner = radius - (7.0 if quarter % 2 == 0 else 4.0)
        a, b = ((centre[0] + r * math.sin(angle), centre[1] - r * math.cos(angle)) for r in (inner, radius - 2.0))
        draw.add_line(a, b, packed(FAINT), 1.0)
    angle = math.radians(from_deg)
    downwind = -math.sin(angle), math.cos(angle)
    start = centre[0] - 0.72 * radius * downwind[0], centre[1] - 0.72 * radius * downwind[1]
    end = centre[0] + 0.72 * radius * downwind[0], centre[1] + 0.72 * radius * downwind[1]
    line = packed(ACCENT if lit else (0.56, 0.70, 0.32, 1.0))
    draw.add_line(start, end, line, 2.5)
    across = -downwind[1], downwind[0]
    back = end[0] - 9.0 * downwind[0], end[1] - 9.0 * downwind[1]
    wings = [(back[0] + 5.0 * s * across[0], back[1] + 5.0 * s * across[1]) for s in (-1.0, 1.0)]
    draw.add_triangle_filled(end, wings[0], wings[1], line)
    draw.add_circle_filled(start, 3.5, line)
    tip(f"From {from_deg:.0f}°, clockwise from north.")


def _view(session: Session) -> None:
    controller = session.controller
    width = (imgui.get_content_region_avail().x - 16.0) / 3.0
    helps = {
        "walk": "On the ground, at walking speed; Shift is faster. F",
        "fly": "Above the ground; E and Q move up and down. F",
        "orbit": "Around the point in view; W and S change the distance. O",
    }
    for i, mode in enumerate(MODES):
        if i:
            imgui.same_line()
        chosen = controller.mode == mode
        imgui.push_style_color(imgui.Col_.button.value, colour((0.33, 0.43, 0.22, 1.0) if chosen else RAISED))
        imgui.push_style_color(imgui.Col_.text.value, colour((0.97, 1.0, 0.92, 1.0) if chosen else MUTED))
        if imgui.button(mode, (width, 0.0)):
            controller.choose(mode)
        imgui.pop_style_color(2)
        tip(helps[mode])
    labelled("speed", "Factor on the speed. The mouse wheel changes it as well.")
    changed, factor = imgui.slider_float(
        "##speed", controller.speed_factor, 0.1, 10.0, "%.1f ×", imgui.SliderFlags_.logarithmic.value
    )
    if changed:
        controller.speed_factor = min(max(factor, 0.02), 100.0)
    one(session, ("camera", "fov_y_deg"))
    if imgui.button("Reset the camera"):
        session.reset_camera()
    tip("Return to the camera of the scene. Home")
    imgui.same_line()
    if imgui.button("Keep this view"):
        session.keep_view()
    tip("Make the current view the camera of the scene.")
