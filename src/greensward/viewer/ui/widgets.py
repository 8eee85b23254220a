"""Widgets for the keys of a scene: one function for each kind, derived from `FieldSpec` alone."""

import contextlib
import math
import tomllib
from collections.abc import Callable, Sequence
from typing import Any

from imgui_bundle import imgui
from pydantic import BaseModel

from greensward.scene.kinds import kind_of
from greensward.scene.plain import plain
from greensward.scene.toml_text import spelled
from greensward.viewer.fields import FieldSpec, KeyPath, can_be_made, fields_of, new_table, slider_range, value_at
from greensward.viewer.session import Session
from greensward.viewer.ui.style import ACCENT, FAINT, MUTED, SMALL_PX, Icon, colour

LABEL_PART = 0.40
"""Fraction of the width that labels take."""
_MOST_INT = 2**31 - 1
_ENTRIES: dict[str, str] = {}  # text in progress, by key


_unfolded = False


def unfold(every_table: bool) -> None:
    """Open every table, or leave that to the user."""
    global _unfolded
    _unfolded = every_table


def folds(label: str, header: bool = False) -> bool:
    """Draw the header of a table; return True if it is open."""
    if _unfolded:
        imgui.set_next_item_open(True)
    if header:
        return bool(imgui.collapsing_header(label))
    return bool(imgui.tree_node_ex(label, imgui.TreeNodeFlags_.span_avail_width.value))


def heading(text: str) -> None:
    """Draw the heading of a group."""
    imgui.dummy((0.0, 2.0))
    imgui.push_font(None, SMALL_PX)
    imgui.text_colored(colour(ACCENT), text.upper())
    imgui.pop_font()


def note(text: str) -> None:
    """Draw a remark in small, muted type."""
    imgui.push_font(None, SMALL_PX)
    imgui.push_text_wrap_pos(0.0)
    imgui.text_colored(colour(MUTED), text)
    imgui.pop_text_wrap_pos()
    imgui.pop_font()


def tip(text: str) -> None:
    """Add a tooltip to the last item."""
    if text and imgui.is_item_hovered(
        imgui.HoveredFlags_.for_tooltip.value | imgui.HoveredFlags_.allow_when_disabled.value
    ):
        imgui.begin_tooltip()
        imgui.push_text_wrap_pos(22.0 * imgui.get_font_size())
        imgui.text_unformatted(text)
        imgui.pop_text_wrap_pos()
        imgui.end_tooltip()


def labelled(label: str, help_text: str = "") -> None:
    """Draw a label in the left column; the next item fills the right one."""
    left, width = imgui.get_cursor_pos_x(), imgui.get_content_region_avail().x
    edge = imgui.get_window_width() - imgui.get_style().window_padding.x
    column = max(edge - (1.0 - LABEL_PART) * (imgui.get_window_width() - 28.0), left + 60.0)
    imgui.align_text_to_frame_padding()
    imgui.push_clip_rect(
        imgui.get_cursor_screen_pos(), imgui.get_cursor_screen_pos() + imgui.ImVec2(column - left - 6.0, 40.0), True
    )
    imgui.text_colored(colour(MUTED), label)
    imgui.pop_clip_rect()
    tip(help_text)
    imgui.same_line(column)
    imgui.set_next_item_width(max(width - (column - left), 40.0))


def number_format(low: float, high: float, unit: str) -> str:
    """Return the format of a number: digits to suit a slider of this range, and the unit."""
    digits = min(max(2 - math.floor(math.log10(max(high - low, 1e-6))), 0), 5)
    return f"%.{digits}f" + (f"{'' if unit in ('°', '/m²') else ' '}{unit}" if unit else "")


def tidy(value: float) -> float:
    """Round a single-precision number to six digits."""
    return float(f"{value:.6g}") if math.isfinite(value) else value


def clamped(spec: FieldSpec, value: float) -> float:
    """Clamp a number to the range of its key."""
    low = -math.inf if spec.low is None else spec.low
    high = math.inf if spec.high is None else spec.high
    return min(max(value, low), high) if math.isfinite(value) else value


def row(session: Session, path: KeyPath, spec: FieldSpec, value: Any) -> None:
    """Draw one key: its label, and the widget that sets it."""
    imgui.push_id(".".join(map(str, path)))
    if spec.kind == "table":
        table(session, path, spec, value)
    elif spec.kind == "tables":
        labelled(spec.label, spec.help)
        if value:
            imgui.new_line()
        tables(session, path, spec, value)
    else:
        labelled(spec.label, _help(spec))
        if value is None and spec.kind not in ("file", "text", "list"):
            _absent(session, path, spec)
        else:
            _WIDGETS[spec.kind](session, path, spec, value)
            tip(_help(spec))
    imgui.pop_id()


def _help(spec: FieldSpec) -> str:
    default = spec.default
    if not isinstance(default, bool | int | float | str) or default == "":
        return spec.help
    shown = str(default).lower() if isinstance(default, bool) else default
    return f"{spec.help}\nDefault: {shown}{' ' + spec.unit if spec.unit else ''}."


def _absent(session: Session, path: KeyPath, spec: FieldSpec) -> None:
    if imgui.button(f"{Icon.plus}  set"):
        low, high = spec.low or 0.0, spec.high if spec.high is not None else math.inf
        start: Any = min(max(10.0, low), high)
        session.change(path, (start,) * spec.size if spec.kind == "numbers" else start)


def _number(session: Session, path: KeyPath, spec: FieldSpec, value: float) -> None:
    low, high = slider_range(spec, value)
    if spec.above and low <= (spec.low or 0.0):
        low = (spec.low or 0.0) + 1e-3 * (high - low)
    flags = imgui.SliderFlags_.logarithmic.value if low > 0 and high / low > 200.0 else 0
    changed, new = imgui.slider_float("##v", value, low, high, number_format(low, high, spec.unit), flags)
    _commit(session, path, tidy(clamped(spec, new)), changed)


def _count(session: Session, path: KeyPath, spec: FieldSpec, value: int) -> None:
    low, high = slider_range(spec, value)
    if (spec.high or 0.0) > _MOST_INT:
        changed, new = imgui.input_int("##v", min(value, _MOST_INT))
    else:
        changed, new = imgui.slider_int("##v", value, int(low), int(high), f"%d {spec.unit}".rstrip())
    _commit(session, path, int(clamped(spec, new)), changed)


def _numbers(session: Session, path: KeyPath, spec: FieldSpec, value: tuple[float, ...]) -> None:
    low, high = slider_range(spec, max(map(abs, value)))
    shown = number_format(0.0, high, spec.unit if spec.size < 3 else "")
    new: Sequence[float]
    if spec.is_range:
        speed, (first, last) = max((high - low) / 400.0, 1e-4), value
        changed, first, last = imgui.drag_float_range2("##v", first, last, speed, spec.low or 0.0, high, shown, shown)
        new = (first, max(first, last))
    else:
        drag = imgui.drag_float2 if spec.size == 2 else imgui.drag_float3
        changed, new = drag("##v", list(value), 0.02, 0.0, 0.0, shown)
    _commit(session, path, tuple(tidy(clamped(spec, part)) for part in new), changed)


def _flag(session: Session, path: KeyPath, _: FieldSpec, value: bool) -> None:
    changed, new = imgui.checkbox("##v", value)
    if changed:
        session.change(path, new)


def _choice(session: Session, path: KeyPath, spec: FieldSpec, value: str) -> None:
    if imgui.begin_combo("##v", value):
        for choice in spec.choices:
            if imgui.selectable(choice, choice == value)[0]:
                session.change(path, choice)
        imgui.end_combo()


def _colour(session: Session, path: KeyPath, _: FieldSpec, value: str) -> None:
    parts = [int(value[i : i + 2], 16) / 255.0 for i in (1, 3, 5)]
    flags = imgui.ColorEditFlags_.display_hex.value | imgui.ColorEditFlags_.no_options.value
    changed, new = imgui.color_edit3("##v", parts, flags)
    _commit(
        session,
        path,
        "#" + "".join(f"{round(255 * min(max(part, 0.0), 1.0)):02x}" for part in list(new)[:3]),
        changed,
    )


def _text(session: Session, path: KeyPath, spec: FieldSpec, value: str | None) -> None:
    entered = text_field("##v", ".".join(map(str, path)), value or "", spec.optional)
    if entered is not None and entered != (value or ""):
        session.change(path, entered if entered or not spec.optional else None)


def _list(session: Session, path: KeyPath, spec: FieldSpec, value: tuple[Any, ...] | None) -> None:
    text = spelled(plain(value or ()))
    entered = text_field("##v", ".".join(map(str, path)), text, spec.optional)
    if entered is None or entered == text:
        return
    try:
        session.change(path, _frozen(tomllib.loads(f"v = {entered}")["v"]))
    except (ValueError, RecursionError) as error:
        session.notify(f"{spec.label}: must be a list such as {text} ({error})", error=True)


def text_field(name: str, key: str, value: str, optional: bool = False) -> str | None:
    """Draw a line of text; return it once it is complete, by Enter or by leaving the field."""
    hint = "none" if optional else ""
    changed, text = imgui.input_text_with_hint(name, hint, _ENTRIES.get(key, value))
    if changed:
        _ENTRIES[key] = text[:4096]
    if imgui.is_item_deactivated():
        return _ENTRIES.pop(key, None)
    if not imgui.is_item_active():  # hidden while in use: the entry is not for the current value
        _ENTRIES.pop(key, None)
    return None


def _frozen(value: Any) -> Any:
    return tuple(_frozen(item) for item in value) if isinstance(value, list) else value


def _commit(session: Session, path: KeyPath, value: Any, changed: bool) -> None:
    """Set the value of a drag; the whole drag is one step of the history."""
    if changed:
        session.change(path, value, drag=True)
    if imgui.is_item_deactivated():
        session.history.end_drag()


_WIDGETS: dict[str, Callable[[Session, KeyPath, FieldSpec, Any], None]] = {
    "number": _number,
    "count": _count,
    "numbers": _numbers,
    "flag": _flag,
    "choice": _choice,
    "colour": _colour,
    "text": _text,
    "file": _text,
    "list": _list,
}


# Tables -----------------------------------------------------------------------------------------------------


def rows(session: Session, path: KeyPath, value: BaseModel) -> None:
    """Draw every key of a table, in the order of its model."""
    for spec in fields_of(type(value)):
        held = getattr(value, spec.name, spec.default)
        row(session, (*path, spec.name), spec, held)


def table(session: Session, path: KeyPath, spec: FieldSpec, value: Any) -> None:
    """Draw a table within a table; an optional one can be added and removed."""
    if value is None:
        labelled(spec.label, spec.help)
        if imgui.button(f"{Icon.plus}  add"):
            session.add(path, spec.models[0])
        tip(spec.help)
        return
    opened = folds(spec.label)
    tip(spec.help)
    if not opened:
        return
    if spec.optional:
        _removal(session, path)
    kind(session, path, spec, value)
    rows(session, path, value)
    imgui.tree_pop()


def tables(session: Session, path: KeyPath, spec: FieldSpec, value: tuple[Any, ...]) -> None:
    """Draw a list of tables: each can be opened and removed, and others added."""
    for i, item in enumerate(value):
        imgui.push_id(i)
        opened = folds(f"{title_of(spec, item, i)}###{i}")
        if opened:
            if len(value) > spec.least:
                _removal(session, (*path, i))
            if i < len(value_at(session.scene, path)):
                kind(session, (*path, i), spec, item)
                rows(session, (*path, i), item)
            imgui.tree_pop()
        imgui.pop_id()
    if len(value) < spec.most:
        _addition(session, path, spec)


def title_of(spec: FieldSpec, item: Any, number: int) -> str:
    """Return the title of a table of a list."""
    name = getattr(item, "name", "") or getattr(item, "species", "") or kind_of(type(item)) or spec.label
    return f"{number + 1}   {name}"


def _removal(session: Session, path: KeyPath) -> None:
    imgui.push_style_color(imgui.Col_.text.value, colour(FAINT))
    if imgui.small_button(f"{Icon.trash}  remove"):
        session.remove(path)
    imgui.pop_style_color()


def _addition(session: Session, path: KeyPath, spec: FieldSpec) -> None:
    models = [model for model in spec.models if can_be_made(model)]
    if imgui.small_button(f"{Icon.plus}  add"):
        if len(models) == 1:
            session.add(path, models[0])
        else:
            imgui.open_popup("kinds")
    tip(spec.help)
    if imgui.begin_popup("kinds"):
        for model in models:
            if imgui.selectable(kind_of(model) or model.__name__.lower(), False)[0]:
                session.add(path, model)
            tip(" ".join((model.__doc__ or "").split()))
        imgui.end_popup()


def kind(session: Session, path: KeyPath, spec: FieldSpec, value: Any) -> None:
    """Draw the choice of a table's kind, if it has several; another kind keeps the shared keys."""
    if len(spec.models) < 2:
        return
    labelled("kind", " ".join((type(value).__doc__ or "").split()))
    if imgui.begin_combo("##kind", kind_of(type(value)) or ""):
        for model in spec.models:
            if can_be_made(model) and imgui.selectable(kind_of(model) or "", model is type(value))[0]:
                _change_kind(session, path, value, model)
        imgui.end_combo()


def _change_kind(session: Session, path: KeyPath, value: Any, model: Any) -> None:
    at = session.controller.target(8.0)
    try:
        new = new_table(model, (float(at[0]), 0.0, float(at[2])))
    except ValueError as error:
        session.notify(f"{kind_of(model)}: cannot be added here ({error})", error=True)
        return
    shared = {name: held for name, held in dict(value).items() if name in model.model_fields and name != "kind"}
    with contextlib.suppress(ValueError):  # a key may have the same name and another range
        new = model.model_validate({**dict(new), **shared})
    session.change(path, new)
