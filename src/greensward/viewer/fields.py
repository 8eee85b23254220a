"""Descriptions of the keys of a scene, derived from its models: range, unit, help, choices."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MaxLen, MinLen
from pydantic import BaseModel, ValidationError
from pydantic_core import PydanticUndefined

from greensward.scene import Clearing, Grass, Scene, SceneError
from greensward.scene.base import is_for_python, names_a_file
from greensward.scene.grass import species_table
from greensward.scene.kinds import kind_of, models_in
from greensward.scene.problems import sentences
from greensward.scene.reference import unit_of
from greensward.techniques import SETTINGS

Kind = Literal["number", "count", "flag", "text", "choice", "colour", "file", "numbers", "list", "table", "tables"]
KeyPath = tuple[str | int, ...]
"""Path of a key in a scene: `("wind", 0, "speed_mps")`."""
_FULL_RANGE = 12.0  # times the default: the largest range that a slider covers whole
_WORDS = {"per m²": "/m²", "pixels": "px", "stops": "EV"}


@dataclass(frozen=True)
class FieldSpec:
    """Description of a key of a model."""

    name: str
    label: str
    kind: Kind
    help: str
    unit: str = ""
    low: float | None = None
    high: float | None = None
    above: bool = False
    """True if `low` itself is out of range."""
    size: int = 1
    """Number of components, for the kind `numbers`."""
    is_range: bool = False
    """True if two numbers are the ends of a range."""
    optional: bool = False
    """True if the key may be left out."""
    default: Any = None
    choices: tuple[str, ...] = ()
    models: tuple[type[BaseModel], ...] = field(default=(), repr=False)
    """Models of the tables that it may hold."""
    files: bool = False
    """True if the value names files."""
    least: int = 0
    most: int = 1000
    """Largest length of a list."""


def label_of(name: str) -> str:
    """Return a key as words without its unit: `full density` for `full_density_m`."""
    unit = unit_of(name)
    endings = ("per_m2", "m2", "mps2", "mps", "deg", "px", "ev", "hz", "m", "s")
    bare = next((name[: -len(end) - 1] for end in endings if unit and name.endswith(f"_{end}")), name)
    return bare.replace("_", " ")


@cache
def fields_of(model: type[BaseModel]) -> tuple[FieldSpec, ...]:
    """Return the keys of a model in its order, without those that can have one value only, such as `kind`."""
    kinds = {name: field.annotation for name, field in model.model_fields.items() if not is_for_python(field)}
    found = [
        _field(model, name)
        for name, kind in kinds.items()
        if not (get_origin(kind) is Literal and len(get_args(kind)) == 1)
        and not is_for_python(model.model_fields[name])
    ]
    labels = [spec.label for spec in found]
    # `texture` and `texture_m` are different keys
    return tuple(
        replace(spec, label=f"{spec.label}, {spec.unit}") if spec.unit and labels.count(spec.label) > 1 else spec
        for spec in found
    )


def _field(model: type[BaseModel], name: str) -> FieldSpec:
    info = model.model_fields[name]
    annotation, limits = _bare(info.annotation, list(info.metadata))
    optional = type(None) in get_args(info.annotation)
    unit = unit_of(name)
    default = None if info.default is PydanticUndefined else info.default
    common: dict[str, Any] = {
        "name": name,
        "label": label_of(name),
        "help": " ".join((info.description or "").split()),
        "unit": _WORDS.get(unit, unit),
        "optional": optional,
        "default": default,
    }
    if model is Grass and name == "species":
        return FieldSpec(kind="choice", choices=tuple(species_table()), **common)
    if name == "name" and "technique" in model.__name__.lower():
        return FieldSpec(kind="choice", choices=tuple(SETTINGS), **common)
    return FieldSpec(**common, **_shape(model, name, annotation, limits))


def _shape(model: type[BaseModel], name: str, annotation: Any, limits: list[Any]) -> dict[str, Any]:
    """Return kind, limits and contents of a value."""
    origin, parts = get_origin(annotation), get_args(annotation)
    models = models_in(annotation)
    if models and origin is tuple:
        return {"kind": "tables", "models": models, **_lengths(limits)}
    if models:
        return {"kind": "table", "models": models}
    if origin is Literal:
        return {"kind": "choice", "choices": tuple(map(str, parts))}
    if names_a_file(model.model_fields[name]):
        return {"kind": "list" if origin is tuple else "file", "files": True, **_lengths(limits)}
    if origin is tuple:
        inner, inner_limits = _bare(parts[0], [])
        if Ellipsis in parts or get_origin(inner) is tuple:
            return {"kind": "list", **_lengths(limits)}
        is_range = any(getattr(limit, "func", None) is not None for limit in limits)
        return {"kind": "numbers", "size": len(parts), "is_range": is_range, **_range(inner_limits)}
    if annotation is bool:
        return {"kind": "flag"}
    if annotation is int:
        return {"kind": "count", **_range(limits)}
    if annotation is float:
        return {"kind": "number", **_range(limits)}
    return {"kind": "colour" if "colour" in name else "text"}


def _bare(annotation: Any, limits: list[Any]) -> tuple[Any, list[Any]]:
    """Return a type without `None` and annotations, and its annotations."""
    while True:
        parts = [part for part in get_args(annotation) if part is not type(None)]
        if get_origin(annotation) is Annotated:
            annotation, limits = parts[0], limits + _unpacked(parts[1:])
        elif len(parts) == 1 and type(None) in get_args(annotation):
            annotation = parts[0]
        elif get_origin(annotation) is Union or type(None) in get_args(annotation):
            return Union[tuple(parts)], limits  # noqa: UP007
        else:
            return annotation, limits


def _unpacked(extras: list[Any]) -> list[Any]:
    """Return the annotations of a type; pydantic's own wrapper holds several."""
    return [inner for extra in extras for inner in getattr(extra, "metadata", None) or [extra]]


def _range(limits: list[Any]) -> dict[str, Any]:
    low = next((float(getattr(x, "ge", getattr(x, "gt", 0.0))) for x in limits if isinstance(x, Ge | Gt)), None)
    high = next((float(getattr(x, "le", getattr(x, "lt", 0.0))) for x in limits if isinstance(x, Le | Lt)), None)
    return {"low": low, "high": high, "above": any(isinstance(x, Gt) for x in limits)}


def _lengths(limits: list[Any]) -> dict[str, int]:
    found = {}
    for limit in limits:
        if isinstance(limit, MinLen):
            found["least"] = limit.min_length
        elif isinstance(limit, MaxLen):
            found["most"] = limit.max_length
    return found


def slider_range(spec: FieldSpec, value: float) -> tuple[float, float]:
    """Return the ends of a slider: the full range if it is narrow enough, or one around the default."""
    default = spec.default if isinstance(spec.default, int | float) else max(_numbers(spec.default), default=1.0)
    default = abs(float(default)) or 1.0
    if spec.low is not None and spec.high is not None:
        full = spec.high - spec.low
        if full <= max(_FULL_RANGE * default, 0.0 if spec.unit else 1.0) or (spec.unit == "°" and full <= 720.0):
            return spec.low, spec.high
    wide = _rounded_up(4.0 * default)
    while wide < abs(value):
        wide *= 4.0
    low = max(-wide, -math.inf if spec.low is None else spec.low)
    return low, min(max(wide, 2.0 * low), math.inf if spec.high is None else spec.high)


def _numbers(value: Any) -> list[float]:
    """Return the magnitudes of the numbers in a default."""
    return [abs(float(x)) for x in value if isinstance(x, int | float)] if isinstance(value, tuple) else []


def _rounded_up(value: float) -> float:
    """Round up to 1, 2, 5, 10, …"""
    scale = 10.0 ** math.floor(math.log10(value))
    return next(step * scale for step in (1.0, 2.0, 5.0, 10.0) if step * scale >= value * (1.0 - 1e-9))


# Changing a scene -------------------------------------------------------------------------------------------


def value_at(scene: BaseModel, path: KeyPath) -> Any:
    """Return the value at a path."""
    node: Any = scene
    for key in path:
        node = node[key] if isinstance(key, int) else getattr(node, key)
    return node


def with_value(scene: Scene, path: KeyPath, value: Any) -> Scene:
    """Return the scene with another value at a path, validated by its models. Raises `SceneError`."""
    changed: Scene = _put(scene, path, value, ())
    return changed.in_folder(scene.folder)


def _put(node: Any, path: KeyPath, value: Any, done: KeyPath) -> Any:
    if not path:
        return value
    key, *rest = path
    if isinstance(key, int):
        items = list(node)
        items[key] = _put(node[key], tuple(rest), value, (*done, key))
        return tuple(items)
    inner = _put(getattr(node, key), tuple(rest), value, (*done, key)) if rest else value
    if isinstance(node, Grass) and key == "species":
        return Grass(species=value, share=node.share)  # another species brings its own shape and colours
    model = type(node)
    try:
        return model.model_validate({**dict(node), **(node.model_extra or {}), key: inner})
    except ValidationError as error:
        raise SceneError(sentences(error, model, lambda _: "scene", done)) from None


def new_table(model: type[BaseModel], near_m: tuple[float, float, float]) -> BaseModel:
    """Return a new table of this model; required positions lie near a point of the ground, (x, 0, z)."""
    x, y, z = near_m
    positions: dict[str, Any] = {
        "position_m": (x, y, z),
        "centre_m": (x, max(y, 1.0), z),
        "path": ((x, z), (x + 1.0, z - 1.0), (x + 3.0, z - 1.0)),
        "from_m": (x - 1.0, z - 1.0),
        "to_m": (x + 1.0, z + 1.0),
    }
    values = {
        name: positions[name]
        for name, info in model.model_fields.items()
        if (name in positions and len(get_args(info.annotation)) != 2) or (name in positions and info.is_required())
    }
    if "centre_m" in values and len(get_args(model.model_fields["centre_m"].annotation)) == 2:
        values["centre_m"] = (x, z)
    if model is Clearing:  # which is along a path or inside an outline
        values = {"path": positions["path"], "width_m": 1.0}
    if kind := kind_of(model):
        values["kind"] = kind
    return model.model_validate(values)


def can_be_made(model: type[BaseModel]) -> bool:
    """Return True if a new table of this model requires no file, which a panel cannot invent."""
    try:
        new_table(model, (0.0, 0.0, 0.0))
    except ValidationError:
        return False
    return True


def all_keys(scene: BaseModel, path: KeyPath = ()) -> Iterator[tuple[KeyPath, FieldSpec]]:
    """Yield every key of a scene with its path."""
    for spec in fields_of(type(scene)):
        at = (*path, spec.name)
        yield at, spec
        held = getattr(scene, spec.name)
        if spec.kind == "table" and isinstance(held, BaseModel):
            yield from all_keys(held, at)
        elif spec.kind == "tables":
            for i, item in enumerate(held):
                yield from all_keys(item, (*at, i))
