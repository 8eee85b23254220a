"""Pages of the panel for every key of the scene, and for the cost of a frame."""

from collections.abc import Iterable

from imgui_bundle import imgui

from greensward.scene import Scene
from greensward.techniques import SETTINGS
from greensward.viewer.dynamic_resolution import SCALES
from greensward.viewer.fields import KeyPath, all_keys, fields_of, label_of, value_at
from greensward.viewer.preview import QUALITIES
from greensward.viewer.ui.style import INK, MUTED, RAISED, colour, packed, pass_colour
from greensward.viewer.ui.widgets import folds, heading, kind, labelled, note, row, rows, tables, tip
from greensward.viewer.viewer import Viewer

_GRAPH_PX, _BAR_PX = 92.0, 3.0
_MOST_FOUND = 40


class ScenePage:
    """Page of every key, in the order of the scene's model, or of those that a search finds."""

    def __init__(self) -> None:
        self.search = ""

    def show(self, viewer: Viewer) -> None:
        """Draw the page."""
        session = viewer.session
        imgui.set_next_item_width(-1.0)
        changed, text = imgui.input_text_with_hint("##find", "Find a key", self.search)
        self.search = text[:80] if changed else self.search
        words = self.search.lower().split()
        if words:
            _results(viewer, words)
            return
        plain = [spec for spec in fields_of(Scene) if spec.kind not in ("table", "tables")]
        for spec in plain:
            row(session, (spec.name,), spec, getattr(session.scene, spec.name))
        for spec in fields_of(Scene):
            if spec in plain:
                continue
            held = getattr(session.scene, spec.name)
            count = f"  ({len(held)})" if spec.kind == "tables" and held else ""
            opened = folds(f"{spec.label}{count}###{spec.name}", header=True)
            tip(spec.help)
            if not opened:
                continue
            imgui.push_id(spec.name)
            imgui.indent(6.0)
            if spec.kind == "tables":
                tables(session, (spec.name,), spec, held)
            elif spec.name == "technique":
                _technique(viewer)
            else:
                _section(viewer, spec.name)
            imgui.unindent(6.0)
            imgui.pop_id()
            imgui.dummy((0.0, 2.0))


def _results(viewer: Viewer, words: list[str]) -> None:
    """Draw the keys that contain all words."""
    session, shown = viewer.session, 0
    under: KeyPath | None = None
    for path, spec in all_keys(session.scene):
        text = f"{' '.join(map(str, path))} {spec.help}".lower()
        if spec.kind in ("table", "tables") or not all(word in text for word in words):
            continue
        if shown == _MOST_FOUND:
            note("There are more; a longer word finds fewer.")
            return
        shown += 1
        if path[:-1] != under:
            under = path[:-1]
            words_of = (str(part + 1) if isinstance(part, int) else label_of(part) for part in under)
            heading(" › ".join(words_of) or "scene")
        row(session, path, spec, value_at(session.scene, path))
    if not shown:
        note("No key matches.")


def _section(viewer: Viewer, name: str) -> None:
    """Draw a table of the scene, without a heading of its own."""
    session = viewer.session
    spec = next(spec for spec in fields_of(Scene) if spec.name == name)
    held = getattr(session.scene, name)
    if held is None:
        note(spec.help)
        if imgui.button("add"):
            session.add((name,), spec.models[0])
        return
    if spec.optional and imgui.small_button("remove"):
        session.remove((name,))
        return
    if len(spec.models) > 1:
        kind(session, (name,), spec, held)
        held = getattr(session.scene, name)
    rows(session, (name,), held)


def _technique(viewer: Viewer) -> None:
    """Draw the settings of the technique, which are keys of its table beside its name."""
    session = viewer.session
    choice = session.scene.technique
    (spec,) = fields_of(type(choice))
    row(session, ("technique", "name"), spec, choice.name)
    settings = SETTINGS[choice.name].model_validate(choice.model_extra or {})
    rows(session, ("technique",), settings)


def frame_page(viewer: Viewer) -> None:
    """Draw the page of the cost of a frame: times by pass, blades, memory, and settings of the frame rate."""
    viewport, resolution = viewer.viewports[0], viewer.resolution
    heading("Time")
    _graph(viewer)
    heading("Blades")
    counts = viewer.counts
    for name, value, help_text in (
        ("considered", counts.considered, "Blades in the visible parts of the field."),
        ("simulated", counts.simulated, "Blades whose simulation state was advanced."),
        ("drawn", counts.drawn, "Blades that passed culling."),
        ("pixels", counts.pixels, "Pixels that show a blade."),
    ):
        figure(name, f"{value:,}", help_text)
    renderer = viewport.renderer
    if renderer:
        figure("sown", f"{renderer.blades:,}", "Blades in memory around the camera.")
        figure("memory", f"{renderer.field_bytes / 2**20:,.0f} MiB", "Memory of the sown blades.")
    heading("Frame rate")
    changed, resolution.automatic = imgui.checkbox("Dynamic resolution", resolution.automatic)
    tip("Lowers the resolution if frames take too long, and raises it if there is time.")
    labelled("target, fps", "Frames per second that the resolution is chosen for.")
    changed, fps = imgui.slider_float("##fps", resolution.target_fps, 5.0, 120.0, "%.0f")
    if changed:
        resolution.target_fps = min(max(fps, 1.0), 240.0)
    labelled("scale", "Resolution relative to the window, per axis.")
    changed, scale = imgui.slider_float("##scale", resolution.scale, SCALES[0], SCALES[-1], "%.2f")
    if changed:
        resolution.automatic, resolution.scale = False, scale
    labelled("preview quality", "Fraction of the blades that are drawn here. Saved pictures have all of them.")
    if imgui.begin_combo("##quality", _quality_name(viewer.quality)):
        for quality in QUALITIES:
            if imgui.selectable(_quality_name(quality), quality == viewer.quality)[0]:
                viewer.quality = quality
        imgui.end_combo()
    if viewport.build_s:
        note(f"The last build took {viewport.build_s:.1f} s, on {renderer.driver if renderer else ''}.")


def _graph(viewer: Viewer) -> None:
    corner, width = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail().x
    imgui.dummy((width, _GRAPH_PX))
    draw = imgui.get_window_draw_list()
    bottom = corner.y + _GRAPH_PX
    draw.add_rect_filled((corner.x, corner.y), (corner.x + width, bottom), packed(RAISED), 4.0)
    shown = list(viewer.pass_times)[-int(width / _BAR_PX) :]
    if not shown:
        return
    budget = 1e3 / viewer.resolution.target_fps
    top = max(budget * 1.25, max(sum(frame.values()) for frame in shown) * 1.1)
    passes = passes_of(shown)
    for i, frame in enumerate(reversed(shown)):
        x, y = corner.x + width - (i + 1) * _BAR_PX, bottom
        for name in passes:
            height = frame.get(name, 0.0) / top * (_GRAPH_PX - 2.0)
            if height > 0.2:
                draw.add_rect_filled((x, y - height), (x + _BAR_PX - 0.6, y), packed(pass_colour(name)))
                y -= height
    line = bottom - budget / top * _GRAPH_PX
    draw.add_line((corner.x, line), (corner.x + width, line), packed(INK, 0.35), 1.0)
    draw.add_text((corner.x + 6.0, line - 18.0), packed(INK, 0.6), f"{budget:.0f} ms")
    _legend(shown[-1])


def _legend(frame: dict[str, float]) -> None:
    figure("frame", f"{sum(frame.values()):.1f} ms", "Sum of the passes of the last frame.")
    for name in sorted((name for name in frame if frame[name] >= 0.05), key=lambda n: -frame[n]):
        at = imgui.get_cursor_screen_pos()
        imgui.get_window_draw_list().add_rect_filled(
            (at.x, at.y + 4.0), (at.x + 10.0, at.y + 14.0), packed(pass_colour(name)), 2.0
        )
        imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + 18.0)
        figure(name, f"{frame[name]:.1f} ms")


def passes_of(frames: Iterable[dict[str, float]]) -> list[str]:
    """Return the names of all passes that were timed in these frames, in the order of their first appearance."""
    return list(dict.fromkeys(name for frame in frames for name in frame))


def figure(name: str, value: str, help_text: str = "") -> None:
    """Draw a name at the left and a figure at the right."""
    imgui.text_colored(colour(MUTED), name)
    tip(help_text)
    imgui.same_line(imgui.get_window_width() - imgui.calc_text_size(value).x - 26.0)
    imgui.text_unformatted(value)


def _quality_name(quality: float) -> str:
    return {1.0: "all blades", 0.5: "1/2", 0.25: "1/4", 0.125: "1/8", 0.0625: "1/16"}[quality]
