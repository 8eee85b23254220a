"""One function for each kind of key; each shows a value and hands on another. Derived from `FieldSpec` alone."""

import contextlib
import math
import tomllib
from collections.abc import Callable, Sequence
from typing import Any

from imgui_bundle import imgui
from pydantic import BaseModel

from greensward.scene.base import kind_of
from greensward.scene.plain import plain
from greensward.scene.toml_text import spelled
from greensward.viewer.face.style import ACCENT, FAINT, MUTED, SMALL_PX, Icon, colour
from greensward.viewer.fields import FieldSpec, Path, can_be_made, fields_of, fresh, reach, value_at
from greensward.viewer.session import Session

LABEL_PART = 0.40
"""Part of the width that labels take."""
_MOST_INT = 2**31 - 1
_TYPED: dict[str, str] = {}  # what is being typed, by the key that it will go to


_unfolded = False


def unfold(all_of_them: bool) -> None:
    """Open every table from now on, or let people do it."""
    global _unfolded
    _unfolded = all_of_them


def folds(label: str, header: bool = False) -> bool:
    """A table's own line, and whether it is open."""
    if _unfolded:
        imgui.set_next_item_open(True)
    if header:
        return bool(imgui.collapsing_header(label))
    return bool(imgui.tree_node_ex(label, imgui.TreeNodeFlags_.span_avail_width.value))


def heading(text: str) -> None:
    """A quiet heading over a group."""
    imgui.dummy((0.0, 2.0))
    imgui.push_font(None, SMALL_PX)
    imgui.text_colored(colour(ACCENT), text.upper())
    imgui.pop_font()


def note(text: str) -> None:
    """A remark in small, muted type."""
    imgui.push_font(None, SMALL_PX)
    imgui.push_text_wrap_pos(0.0)
    imgui.text_colored(colour(MUTED), text)
    imgui.pop_text_wrap_pos()
    imgui.pop_font()


def tip(text: str) -> None:
    """What the last item says when the mouse rests on it."""
    if text and imgui.is_item_hovered(
        imgui.HoveredFlags_.for_tooltip.value | imgui.HoveredFlags_.allow_when_disabled.value
    ):
        imgui.begin_tooltip()
        imgui.push_text_wrap_pos(22.0 * imgui.get_font_size())
        imgui.text_unformatted(text)
        imgui.pop_text_wrap_pos()
        imgui.end_tooltip()


def labelled(label: str, help_text: str = "") -> None:
    """A label in the left column; what follows fills the right one."""
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


def number_format(low: float, high: float, unit: str, whole: bool = False) -> str:
    """As many digits as a hand can set in this range, and the unit."""
    digits = 0 if whole else min(max(2 - math.floor(math.log10(max(high - low, 1e-6))), 0), 5)
    return f"%.{digits}f" + (f"{'' if unit in ('°', '/m²') else ' '}{unit}" if unit else "")


def tidy(value: float) -> float:
    """A single-precision number as a person would write it."""
    return float(f"{value:.6g}") if math.isfinite(value) else value


def clamped(spec: FieldSpec, value: float) -> float:
    """A number within the range of its key."""
    low = -math.inf if spec.low is None else spec.low
    high = math.inf if spec.high is None else spec.high
    return min(max(value, low), high) if math.isfinite(value) else value


def row(session: Session, path: Path, spec: FieldSpec, value: Any) -> None:
    """One key: its label, and what sets it."""
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
            _SHOWN[spec.kind](session, path, spec, value)
            tip(_help(spec))
    imgui.pop_id()


def _help(spec: FieldSpec) -> str:
    usual = spec.default
    told = isinstance(usual, bool | int | float | str) and usual != ""
    return spec.help + (
        f"\nUsually {str(usual).lower() if isinstance(usual, bool) else usual}{' ' + spec.unit if spec.unit else ''}."
        if told
        else ""
    )


def _absent(session: Session, path: Path, spec: FieldSpec) -> None:
    if imgui.button(f"{Icon.plus}  set"):
        low, high = spec.low or 0.0, spec.high if spec.high is not None else math.inf
        start: Any = min(max(10.0, low), high)
        session.change(path, (start,) * spec.size if spec.kind == "numbers" else start)


def _number(session: Session, path: Path, spec: FieldSpec, value: float) -> None:
    low, high = reach(spec, value)
    if spec.above and low <= (spec.low or 0.0):
        low = (spec.low or 0.0) + 1e-3 * (high - low)
    flags = imgui.SliderFlags_.logarithmic.value if low > 0 and high / low > 200.0 else 0
    changed, new = imgui.slider_float("##v", value, low, high, number_format(low, high, spec.unit), flags)
    _commit(session, path, tidy(clamped(spec, new)), changed)


def _count(session: Session, path: Path, spec: FieldSpec, value: int) -> None:
    low, high = reach(spec, value)
    if (spec.high or 0.0) > _MOST_INT:
        changed, new = imgui.input_int("##v", min(value, _MOST_INT))
    else:
        changed, new = imgui.slider_int("##v", value, int(low), int(high), f"%d {spec.unit}".rstrip())
    _commit(session, path, int(clamped(spec, new)), changed)


def _numbers(session: Session, path: Path, spec: FieldSpec, value: tuple[float, ...]) -> None:
    low, high = reach(spec, max(map(abs, value)))
    shown = number_format(0.0, high, spec.unit if spec.size < 3 else "")
    new: Sequence[float]
    if spec.span:
        speed, (first, last) = max((high - low) / 400.0, 1e-4), value
        changed, first, last = imgui.drag_float_range2("##v", first, last, speed, spec.low or 0.0, high, shown, shown)
        new = (first, max(first, last))
    else:
        drag = imgui.drag_float2 if spec.size == 2 else imgui.drag_float3
        changed, new = drag("##v", list(value), 0.02, 0.0, 0.0, shown)
    _commit(session, path, tuple(tidy(clamped(spec, part)) for part in new), changed)


def _flag(session: Session, path: Path, _: FieldSpec, value: bool) -> None:
    changed, new = imgui.checkbox("##v", value)
    if changed:
        session.change(path, new)


def _choice(session: Session, path: Path, spec: FieldSpec, value: str) -> None:
    if imgui.begin_combo("##v", value):
        for choice in spec.choices:
            if imgui.selectable(choice, choice == value)[0]:
                session.change(path, choice)
        imgui.end_combo()


def _colour(session: Session, path: Path, _: FieldSpec, value: str) -> None:
    parts = [int(value[i : i + 2], 16) / 255.0 for i in (1, 3, 5)]
    flags = imgui.ColorEditFlags_.display_hex.value | imgui.ColorEditFlags_.no_options.value
    changed, new = imgui.color_edit3("##v", parts, flags)
    _commit(
        session,
        path,
        "#" + "".join(f"{round(255 * min(max(part, 0.0), 1.0)):02x}" for part in list(new)[:3]),
        changed,
    )


def _text(session: Session, path: Path, spec: FieldSpec, value: str | None) -> None:
    typed = typing("##v", ".".join(map(str, path)), value or "", spec.optional)
    if typed is not None and typed != (value or ""):
        session.change(path, typed if typed or not spec.optional else None)


def _list(session: Session, path: Path, spec: FieldSpec, value: tuple[Any, ...] | None) -> None:
    text = spelled(plain(value or ()))
    typed = typing("##v", ".".join(map(str, path)), text, spec.optional)
    if typed is None or typed == text:
        return
    try:
        session.change(path, _frozen(tomllib.loads(f"v = {typed}")["v"]))
    except (ValueError, RecursionError) as error:
        session.tell(f"{spec.label}: must be a list such as {text} ({error})", bad=True)


def typing(name: str, key: str, value: str, optional: bool = False) -> str | None:
    """A line of text; returns it when it is done, by Enter or by leaving it."""
    hint = "none" if optional else ""
    changed, text = imgui.input_text_with_hint(name, hint, _TYPED.get(key, value))
    if changed:
        _TYPED[key] = text[:4096]
    if imgui.is_item_deactivated():
        return _TYPED.pop(key, None)
    if not imgui.is_item_active():  # it was left unseen: what was typed is not for what it shows now
        _TYPED.pop(key, None)
    return None


def _frozen(value: Any) -> Any:
    return tuple(_frozen(item) for item in value) if isinstance(value, list) else value


def _commit(session: Session, path: Path, value: Any, changed: bool) -> None:
    """Hand on what a drag has come to; the drag as a whole is one step back."""
    if changed:
        session.change(path, value, drag=True)
    if imgui.is_item_deactivated():
        session.history.seal()


_SHOWN: dict[str, Callable[[Session, Path, FieldSpec, Any], None]] = {
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


def rows(session: Session, path: Path, value: BaseModel) -> None:
    """Every key of a table, as they stand in its model."""
    for spec in fields_of(type(value)):
        held = getattr(value, spec.name, spec.default)
        row(session, (*path, spec.name), spec, held)


def table(session: Session, path: Path, spec: FieldSpec, value: Any) -> None:
    """A table within a table; one that may be left out can be made and removed."""
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


def tables(session: Session, path: Path, spec: FieldSpec, value: tuple[Any, ...]) -> None:
    """A list of tables: each can be opened and removed, and others added."""
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
    """What to call a table of a list."""
    what = getattr(item, "name", "") or getattr(item, "species", "") or kind_of(type(item)) or spec.label
    return f"{number + 1}   {what}"


def _removal(session: Session, path: Path) -> None:
    imgui.push_style_color(imgui.Col_.text.value, colour(FAINT))
    if imgui.small_button(f"{Icon.trash}  remove"):
        session.remove(path)
    imgui.pop_style_color()


def _addition(session: Session, path: Path, spec: FieldSpec) -> None:
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


def kind(session: Session, path: Path, spec: FieldSpec, value: Any) -> None:
    """Which kind a table is, where there are several; another kind keeps the keys that it shares."""
    if len(spec.models) < 2:
        return
    labelled("kind", " ".join((type(value).__doc__ or "").split()))
    if imgui.begin_combo("##kind", kind_of(type(value)) or ""):
        for model in spec.models:
            if can_be_made(model) and imgui.selectable(kind_of(model) or "", model is type(value))[0]:
                _become(session, path, value, model)
        imgui.end_combo()


def _become(session: Session, path: Path, value: Any, model: Any) -> None:
    at = session.walker.aim(8.0)
    try:
        new = fresh(model, (float(at[0]), 0.0, float(at[2])))
    except ValueError as error:
        session.tell(f"{kind_of(model)}: cannot be had here ({error})", bad=True)
        return
    shared = {name: held for name, held in dict(value).items() if name in model.model_fields and name != "kind"}
    with contextlib.suppress(ValueError):  # a key may have the same name and another range
        new = model.model_validate({**dict(new), **shared})
    session.change(path, new)
