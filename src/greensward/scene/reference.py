"""The reference page of scene files, generated from the models."""

import json
import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from greensward.scene.base import is_for_python, names_a_file, takes_an_array
from greensward.scene.grass import Grass, species_table
from greensward.scene.kinds import kind_of, models_in
from greensward.scene.scene import DEFAULT_KINDS, Scene

_UNITS = {
    "kg_per_m2": "kg/m²",
    "per_m2": "per m²",
    "m2": "m²",
    "kg": "kg",
    "m": "m",
    "deg": "°",
    "mps2": "m/s²",
    "mps": "m/s",
    "px": "pixels",
    "ev": "stops",
    "hz": "Hz",
    "s": "s",
}
_WORDS = {float: "number", int: "whole number", str: "text", bool: "true or false"}


def reference(technique_settings: Mapping[str, type[BaseModel]]) -> str:
    """The page as Markdown. `technique_settings` maps each technique's name to the model of its settings."""
    parts = [
        "# Scene files",
        "<!-- Generated from the models in src/greensward/scene; do not edit. -->",
        "A scene is a TOML file. Every key may be left out unless it is *required*. Distances, angles and "
        "rates carry their unit in the key; names of files are relative to the scene file; x points east, "
        "y up and z south. A pair of numbers that blades vary over is `[low, high]`; a colour is sRGB, such "
        'as `"#7d9a45"`. `greensward check SCENE` reports every error in a scene, and '
        "`--set key=value` changes one key: `--set wind.0.speed_mps=12`.",
        "## The scene itself",
        _table(Scene),
    ]
    for name, field in Scene.model_fields.items():
        listed = get_origin(field.annotation) is tuple
        for model in models_in(field.annotation):
            parts += _section(name, model, listed, len(models_in(field.annotation)) > 1)
            if model is Grass:
                parts += _species()
        parts += _inner_sections(name, models_in(field.annotation))
        if name == "technique":
            for technique, settings in technique_settings.items():
                heading = f'### `[technique]` with `name = "{technique}"`'
                parts += [
                    heading,
                    _help(settings),
                    _table(settings) if settings.model_fields else "It has no settings.",
                ]
    return "\n\n".join(parts) + "\n"


def _section(name: str, model: type[BaseModel], listed: bool, choice: bool) -> list[str]:
    title = f"`[[{name}]]`" if listed else f"`[{name}]`"
    if choice:
        title += f' with `kind = "{kind_of(model)}"`'
    repeated = [f"Repeat the table for more. {Scene.model_fields[name].description}"] if listed else []
    return [f"## {title}", _help(model), *repeated, _table(model)]


def _inner_sections(name: str, models: tuple[type[BaseModel], ...]) -> list[str]:
    """Sections of the tables within a table, each once."""
    inner = {
        f"{name}.{key}": held
        for model in models
        for key, field in model.model_fields.items()
        for held in models_in(field.annotation)
    }
    return [part for key, model in inner.items() for part in (f"## `[{key}]`", _help(model), _table(model))]


def _help(model: type[BaseModel]) -> str:
    return " ".join((model.__doc__ or "").split())


def _species() -> list[str]:
    """Values that each named species sets; the rest are the defaults above."""
    common = ("height_m", "width_m", "shape", "root_colour", "tip_colour", "head")
    rows = []
    for name in species_table():
        grass = Grass(species=name)
        cells = [_shown(getattr(grass, key)) for key in common]
        rows.append(f"| `{name}` | " + " | ".join(cells) + " |")
    header = "| species | " + " | ".join(f"`{key}`" for key in common) + " |\n|" + "---|" * (len(common) + 1)
    text = "Each species also sets its own stiffness, tilt, bend and dryness; a scene may override every key."
    return ["### Species", text, header + "\n" + "\n".join(rows)]


def _table(model: type[BaseModel]) -> str:
    rows = ["| key | type | default | range | unit | meaning |", "|---|---|---|---|---|---|"]
    schemas = model.model_json_schema()["properties"]
    for name, field in model.model_fields.items():
        if model is Scene and models_in(field.annotation):
            continue
        cells = [
            f"`{name}`",
            _files(field)
            if names_a_file(field)
            else "array, in Python alone"
            if is_for_python(field)
            else "colour"
            if "colour" in name
            else _type(field.annotation),
            "*required*" if _is_required(name, field) else _shown(field.default),
            _range(schemas[name]),
            unit_of(name),
            " ".join((field.description or "").split()) or ("What it is." if name == "kind" else ""),
        ]
        rows.append("| " + " | ".join(cells) + " |")
    return "\n".join(rows)


def _is_required(name: str, field: FieldInfo) -> bool:
    if name == "kind" and get_origin(field.annotation) is Literal:
        return field.default not in DEFAULT_KINDS.values()
    return field.is_required()


def _type(annotation: Any) -> str:
    parts = [part for part in get_args(annotation) if part is not type(None)]
    if get_origin(annotation) is Annotated:
        return _type(parts[0])
    if get_origin(annotation) is Literal:
        return (
            " or ".join(f'`"{word}"`' for word in parts)
            if len(parts) == 1
            else "one of " + ", ".join(f"`{word}`" for word in parts)
        )
    if get_origin(annotation) is tuple:
        inner = _type(parts[0])
        if Ellipsis in parts:
            return "list of pairs" if inner == "2 numbers" else f"list of {inner}s".replace("3 numberss", "points")
        return f"{len(parts)} {inner}s"
    if models_in(annotation):
        return "table"
    return _WORDS.get(annotation) or " or ".join(_type(part) for part in parts)


def _files(field: FieldInfo) -> str:
    kind = "list of files" if get_origin(field.annotation) is tuple else "file"
    return f"{kind}, or array in Python" if takes_an_array(field) else kind


def _shown(value: Any) -> str:
    """A default as the scene file would hold it."""
    if value is None:
        return "none"
    if isinstance(value, BaseModel) or (isinstance(value, tuple) and value and isinstance(value[0], BaseModel)):
        return ""
    return f"`{_toml(value)}`"


def _toml(value: Any) -> str:
    if isinstance(value, tuple | list):
        return f"[{', '.join(_toml(item) for item in value)}]"
    return json.dumps(value) if isinstance(value, str | bool) else f"{value:g}"


def _range(schema: Mapping[str, Any]) -> str:
    """The limits of a number, or of each number of a list: `0 to 1`, `above 0`."""
    inner = schema.get("anyOf", [schema])[0]
    inner = inner.get("prefixItems", [inner])[0]
    words = {"minimum": "from", "exclusiveMinimum": "above", "maximum": "to", "exclusiveMaximum": "below"}
    return " ".join(f"{word} {inner[name]:.10g}" for name, word in words.items() if name in inner)


def unit_of(key: str) -> str:
    """The unit that a key ends in, as people write it; empty where it has none."""
    return next((unit for ending, unit in _UNITS.items() if re.search(f"_{ending}$", key)), "")
