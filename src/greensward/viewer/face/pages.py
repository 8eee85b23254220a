"""The other pages of the panel: every key of the scene, and what a frame costs."""

from collections import deque
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from greensward.scene import Scene
from greensward.techniques import SETTINGS
from greensward.viewer.face.style import INK, MUTED, PASSES, RAISED, colour, packed
from greensward.viewer.face.widgets import folds, heading, kind, labelled, note, row, rows, tables, tip
from greensward.viewer.fields import Path, fields_of, label_of, value_at, walk
from greensward.viewer.pacing import DETAILS, SCALES

if TYPE_CHECKING:
    from greensward.viewer.viewer import Viewer

_GRAPH_PX, _BAR_PX = 92.0, 3.0
_MOST_FOUND = 40


class ScenePage:
    """Every key, in the order of the scene's model, or those that a word finds."""

    def __init__(self) -> None:
        self.search = ""

    def show(self, viewer: "Viewer") -> None:
        """Draw it."""
        session = viewer.session
        imgui.set_next_item_width(-1.0)
        changed, text = imgui.input_text_with_hint("##find", "Find a key", self.search)
        self.search = text[:80] if changed else self.search
        words = self.search.lower().split()
        if words:
            self._found(viewer, words)
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

    def _found(self, viewer: "Viewer", words: list[str]) -> None:
        session, shown = viewer.session, 0
        under: Path | None = None
        for path, spec in walk(session.scene):
            text = f"{' '.join(map(str, path))} {spec.help}".lower()
            if spec.kind in ("table", "tables") or not all(word in text for word in words):
                continue
            if shown == _MOST_FOUND:
                note("And more: a longer word finds fewer.")
                return
            shown += 1
            if path[:-1] != under:
                under = path[:-1]
                words_of = (str(part + 1) if isinstance(part, int) else label_of(part) for part in under)
                heading(" › ".join(words_of) or "scene")
            row(session, path, spec, value_at(session.scene, path))
        if not shown:
            note("No key has these words.")


def _section(viewer: "Viewer", name: str) -> None:
    """A table of the scene, without a heading of its own."""
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


def _technique(viewer: "Viewer") -> None:
    """The technique's own settings, which are keys of its table beside its name."""
    session = viewer.session
    choice = session.scene.technique
    (spec,) = fields_of(type(choice))
    row(session, ("technique", "name"), spec, choice.name)
    settings = SETTINGS[choice.name].model_validate(choice.model_extra or {})
    rows(session, ("technique",), settings)


class FramePage:
    """What a frame costs: by pass over the last seconds, blades, memory, and what keeps it quick."""

    def __init__(self) -> None:
        self._past: deque[dict[str, float]] = deque(maxlen=120)

    def took(self, pass_ms: dict[str, float]) -> None:
        """Take note of a frame's passes."""
        self._past.append(pass_ms)

    def show(self, viewer: "Viewer") -> None:
        """Draw it."""
        pane, pacing = viewer.panes[0], viewer.pacing
        heading("Time")
        self._graph(viewer)
        heading("Blades")
        counts = viewer.counts
        for name, value, help_text in (
            ("considered", counts.considered, "In the parts of the field that the camera may see."),
            ("simulated", counts.simulated, "Whose memory was carried on."),
            ("drawn", counts.drawn, "Left by the tests of culling."),
            ("pixels", counts.pixels, "Of the picture that show a blade."),
        ):
            figure(name, f"{value:,}", help_text)
        renderer = pane.renderer
        if renderer:
            figure("sown", f"{renderer.blades:,}", "In memory around you.")
            figure("memory", f"{renderer.field_bytes / 2**20:,.0f} MiB", "Of the sown blades.")
        heading("Pace")
        changed, pacing.automatic = imgui.checkbox("Picture size follows the frame rate", pacing.automatic)
        tip("Draws fewer pixels where frames take too long, and more where there is time.")
        labelled("frames a second", "What the size of the picture is chosen for.")
        changed, fps = imgui.slider_float("##fps", pacing.target_fps, 5.0, 120.0, "%.0f")
        if changed:
            pacing.target_fps = min(max(fps, 1.0), 240.0)
        labelled("picture size", "Part of the window's width and height that is drawn.")
        changed, scale = imgui.slider_float("##scale", pacing.scale, SCALES[0], SCALES[-1], "%.2f")
        if changed:
            pacing.automatic, pacing.scale = False, scale
        labelled("blades", "Part of the scene's blades that are drawn here. Saved pictures have all of them.")
        if imgui.begin_combo("##detail", _detail(viewer.detail)):
            for detail in DETAILS:
                if imgui.selectable(_detail(detail), detail == viewer.detail)[0]:
                    viewer.choose_detail(detail)
            imgui.end_combo()
        if pane.build_s:
            note(f"The field was last made in {pane.build_s:.1f} s, on {renderer.driver if renderer else ''}.")

    def _graph(self, viewer: "Viewer") -> None:
        corner, width = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail().x
        imgui.dummy((width, _GRAPH_PX))
        draw = imgui.get_window_draw_list()
        bottom = corner.y + _GRAPH_PX
        draw.add_rect_filled((corner.x, corner.y), (corner.x + width, bottom), packed(RAISED), 4.0)
        shown = list(self._past)[-int(width / _BAR_PX) :]
        if not shown:
            return
        budget = 1e3 / viewer.pacing.target_fps
        top = max(budget * 1.25, max(sum(frame.values()) for frame in shown) * 1.1)
        for i, frame in enumerate(reversed(shown)):
            x, y = corner.x + width - (i + 1) * _BAR_PX, bottom
            for name in PASSES:
                part = frame.get(name, 0.0) / top * (_GRAPH_PX - 2.0)
                if part > 0.2:
                    draw.add_rect_filled((x, y - part), (x + _BAR_PX - 0.6, y), packed(PASSES[name]))
                    y -= part
        line = bottom - budget / top * _GRAPH_PX
        draw.add_line((corner.x, line), (corner.x + width, line), packed(INK, 0.35), 1.0)
        draw.add_text((corner.x + 6.0, line - 18.0), packed(INK, 0.6), f"{budget:.0f} ms")
        self._legend(shown[-1])

    def _legend(self, frame: dict[str, float]) -> None:
        figure("frame", f"{sum(frame.values()):.1f} ms", "All passes of the last frame together.")
        for name in sorted((name for name in PASSES if frame.get(name, 0.0) >= 0.05), key=lambda n: -frame[n]):
            at = imgui.get_cursor_screen_pos()
            imgui.get_window_draw_list().add_rect_filled(
                (at.x, at.y + 4.0), (at.x + 10.0, at.y + 14.0), packed(PASSES[name]), 2.0
            )
            imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + 18.0)
            figure(name, f"{frame[name]:.1f} ms")


def figure(name: str, value: str, help_text: str = "") -> None:
    """A name at the left and a figure at the right."""
    imgui.text_colored(colour(MUTED), name)
    tip(help_text)
    imgui.same_line(imgui.get_window_width() - imgui.calc_text_size(value).x - 26.0)
    imgui.text_unformatted(value)


def _detail(detail: float) -> str:
    return {1.0: "all", 0.5: "half", 0.25: "a quarter", 0.125: "an eighth", 0.0625: "a sixteenth"}[detail]
