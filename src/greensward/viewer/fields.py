"""What a panel needs to know of each key of a scene, all of it from the models: range, unit, help, choices."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MaxLen, MinLen
from pydantic import BaseModel, ValidationError
from pydantic_core import PydanticUndefined

from greensward.scene import Grass, Scene, SceneError
from greensward.scene.base import kind_of, models_in, names_a_file
from greensward.scene.grass import species_table
from greensward.scene.problems import sentences
from greensward.scene.reference import unit_of
from greensward.techniques import SETTINGS

Kind = Literal["number", "count", "flag", "text", "choice", "colour", "file", "numbers", "list", "table", "tables"]
Path = tuple[str | int, ...]
"""The keys that lead to a value: `("wind", 0, "speed_mps")`."""
_HANDY = 12.0  # times the usual: a range that a slider covers whole
_WORDS = {"per m²": "/m²", "pixels": "px", "stops": "EV"}


@dataclass(frozen=True)
class FieldSpec:
    """A key of a model, for people."""

    name: str
    label: str
    kind: Kind
    help: str
    unit: str = ""
    low: float | None = None
    high: float | None = None
    above: bool = False
    """Whether `low` itself is out of range."""
    size: int = 1
    """How many numbers, where `kind` is `numbers`."""
    span: bool = False
    """Whether two numbers are a low and a high."""
    optional: bool = False
    """Whether it may be left out."""
    default: Any = None
    choices: tuple[str, ...] = ()
    models: tuple[type[BaseModel], ...] = field(default=(), repr=False)
    """What a table may hold."""
    files: bool = False
    """Whether it names files."""
    least: int = 0
    most: int = 1000
    """How many a list may hold."""

    @property
    def whole(self) -> bool:
        """Whether it takes whole numbers only."""
        return self.kind == "count"


def label_of(name: str) -> str:
    """A key without its unit, as words: `full_density_m` to `full density`."""
    unit = unit_of(name)
    endings = ("per_m2", "m2", "mps2", "mps", "deg", "px", "ev", "hz", "m", "s")
    bare = next((name[: -len(end) - 1] for end in endings if unit and name.endswith(f"_{end}")), name)
    return bare.replace("_", " ")


@cache
def fields_of(model: type[BaseModel]) -> tuple[FieldSpec, ...]:
    """Every key of a model but its `kind`, in the order of the model."""
    found = [_field(model, name) for name in model.model_fields if not (name == "kind" and kind_of(model))]
    labels = [spec.label for spec in found]
    # `texture` and `texture_m` are two things
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
    told: dict[str, Any] = {
        "name": name,
        "label": label_of(name),
        "help": " ".join((info.description or "").split()),
        "unit": _WORDS.get(unit, unit),
        "optional": optional,
        "default": default,
    }
    if model is Grass and name == "species":
        return FieldSpec(kind="choice", choices=tuple(species_table()), **told)
    if name == "name" and "technique" in model.__name__.lower():
        return FieldSpec(kind="choice", choices=tuple(SETTINGS), **told)
    return FieldSpec(**told, **_shape(model, name, annotation, limits))


def _shape(model: type[BaseModel], name: str, annotation: Any, limits: list[Any]) -> dict[str, Any]:
    """What kind of value it is, its limits, and what it may hold."""
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
        spans = any(getattr(limit, "func", None) is not None for limit in limits)
        return {"kind": "numbers", "size": len(parts), "span": spans, **_range(inner_limits)}
    if annotation is bool:
        return {"kind": "flag"}
    if annotation is int:
        return {"kind": "count", **_range(limits)}
    if annotation is float:
        return {"kind": "number", **_range(limits)}
    return {"kind": "colour" if "colour" in name else "text"}


def _bare(annotation: Any, limits: list[Any]) -> tuple[Any, list[Any]]:
    """A type without what may be left out or annotates it, and all that annotates it."""
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
    """What annotates a type; pydantic's own wrapper holds several."""
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


def reach(spec: FieldSpec, value: float) -> tuple[float, float]:
    """Ends of a slider for a value: the whole range where a hand can set it, or what lies around the usual."""
    usual = spec.default if isinstance(spec.default, int | float) else max(_numbers(spec.default), default=1.0)
    usual = abs(float(usual)) or 1.0
    if spec.low is not None and spec.high is not None:
        whole = spec.high - spec.low
        if whole <= max(_HANDY * usual, 0.0 if spec.unit else 1.0) or (spec.unit == "°" and whole <= 720.0):
            return spec.low, spec.high
    wide = _rounded_up(4.0 * usual)
    while wide < abs(value):
        wide *= 4.0
    low = max(-wide, -math.inf if spec.low is None else spec.low)
    return low, min(max(wide, 2.0 * low), math.inf if spec.high is None else spec.high)


def _numbers(value: Any) -> list[float]:
    """The numbers of a default, whatever holds them."""
    return [abs(float(x)) for x in value if isinstance(x, int | float)] if isinstance(value, tuple) else []


def _rounded_up(value: float) -> float:
    """The next of 1, 2, 5, 10, …"""
    scale = 10.0 ** math.floor(math.log10(value))
    return next(step * scale for step in (1.0, 2.0, 5.0, 10.0) if step * scale >= value * (1.0 - 1e-9))


# Changing a scene -------------------------------------------------------------------------------------------


def value_at(scene: BaseModel, path: Path) -> Any:
    """What a scene holds there."""
    node: Any = scene
    for key in path:
        node = node[key] if isinstance(key, int) else getattr(node, key)
    return node


def with_value(scene: Scene, path: Path, value: Any) -> Scene:
    """The scene with another value there, checked by its models. Raises `SceneError`."""
    changed: Scene = _put(scene, path, value, ())
    return changed.in_folder(scene.resolve("."))


def _put(node: Any, path: Path, value: Any, done: Path) -> Any:
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


def fresh(model: type[BaseModel], near_m: tuple[float, float, float]) -> BaseModel:
    """A new table of this model; what has to be told is put near a point of the ground, (x, 0, z)."""
    x, y, z = near_m
    told: dict[str, Any] = {
        "position_m": (x, y, z),
        "centre_m": (x, max(y, 1.0), z),
        "path": ((x, z), (x + 1.0, z - 1.0), (x + 3.0, z - 1.0)),
        "from_m": (x - 1.0, z - 1.0),
        "to_m": (x + 1.0, z + 1.0),
    }
    values = {
        name: told[name]
        for name, info in model.model_fields.items()
        if (name in told and len(get_args(info.annotation)) != 2) or (name in told and info.is_required())
    }
    if "centre_m" in values and len(get_args(model.model_fields["centre_m"].annotation)) == 2:
        values["centre_m"] = (x, z)
    if kind := kind_of(model):
        values["kind"] = kind
    return model.model_validate(values)


def can_be_made(model: type[BaseModel]) -> bool:
    """Whether a new one needs no file, which a panel cannot make up."""
    return not any(info.is_required() and names_a_file(info) for info in model.model_fields.values())


def walk(scene: BaseModel, path: Path = ()) -> Iterator[tuple[Path, FieldSpec]]:
    """Every key of a scene as it stands, with the path that leads to it."""
    for spec in fields_of(type(scene)):
        here = (*path, spec.name)
        yield here, spec
        held = getattr(scene, spec.name)
        if spec.kind == "table" and isinstance(held, BaseModel):
            yield from walk(held, here)
        elif spec.kind == "tables":
            for i, item in enumerate(held):
                yield from walk(item, (*here, i))
