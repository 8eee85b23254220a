"""Validation errors of a scene in words: a sentence each, with place, rule, value and fix."""

import json
import re
from collections.abc import Callable, Iterable, Mapping
from difflib import get_close_matches
from itertools import product
from typing import Any, TypeAlias

from pydantic import BaseModel, ValidationError

from greensward.scene.kinds import kind_of, models_in

Loc: TypeAlias = tuple[int | str, ...]
Models: TypeAlias = tuple[type[BaseModel], ...]
MOST_TOLD = 1000
_UNITS = "m|cm|mm|km|px|deg|rad|s|ms|mps|mps2|kmh|m_s|hz|kg|kg_per_m2|per_m2|m2|ev|stops"
_FOREIGN_WORDS = {
    "angle": ("yaw", "azimuth", "direction"),
    "collide": ("collides",),
    "color": ("colour",),
    "colors": ("colour", "colours"),
    "eye": ("position",),
    "gray": ("grey",),
    "heading": ("yaw", "azimuth", "direction"),
    "length": ("height", "size"),
    "location": ("position",),
    "look": ("target",),
    "lookat": ("target",),
    "orientation": ("yaw",),
    "pitch": ("lean", "elevation"),
    "pos": ("position",),
    "radius": ("size",),
    "rot": ("yaw",),
    "rotation": ("yaw", "azimuth", "direction"),
    "tilt": ("lean", "elevation"),
    "velocity": ("speed",),
    "visible": ("drawn",),
}
"""Words of other programs by those of a scene."""


def sentences(
    error: ValidationError, model: type[BaseModel], origin: Callable[[Loc], str], under: Loc = ()
) -> list[str]:
    """One sentence for each problem of a table of this model, up to a thousand; it lies at `under` in the scene.

    `origin` returns where the value of a key was written: the scene file or an option.
    """
    found: dict[Loc, str] = {}
    for problem in error.errors(include_url=False)[:MOST_TOLD]:
        loc, models = _untagged(problem["loc"], model)
        kind, given, context = problem["type"], problem["input"], problem.get("ctx", {})
        if kind == "missing":
            rule = "is missing and has no default"
            if loc and isinstance(last := loc[-1], int):
                loc, rule = loc[:-1], f"must hold {last + 1} values (got {len(given)})"
        elif kind == "extra_forbidden":
            rule = _unknown_key(str(loc[-1]), models)
        elif kind in ("union_tag_invalid", "union_tag_not_found"):
            rule = _kind_rule(dict(given), models)
            loc = (*loc, "kind")
        elif "expected" in context:
            rule = one_of(given, re.findall(r"'([^']*)'", context["expected"]))
        elif kind == "too_short":
            rule = f"must hold at least {context['min_length']} values (got {context['actual_length']})"
        elif kind == "too_long":
            rule = f"must hold at most {context['max_length']} values (got {context['actual_length']})"
        else:
            rule = _rule(kind, loc, context, bool(models))
            # What a table as a whole breaks names its keys already; its contents would only be noise.
            rule += "" if kind == "value_error" and isinstance(given, dict) else f" (got {short(given)})"
        found[under + loc] = rule
    return [f"{origin(loc)}: {place_of(loc) + ': ' if loc else ''}{rule}" for loc, rule in found.items()]


def _untagged(loc: Loc, model: type[BaseModel]) -> tuple[Loc, Models]:
    """The keys that lead to `loc` in the file, and the models that may stand there.

    Where `kind` chooses among models, the validator puts the kind into the path; no file has it there.
    For an unknown key these are the model that lacks it and, after it, those of the other kinds.
    """
    place: Loc = ()
    kinds: Models = (model,)
    options = kinds
    for part in loc:
        if isinstance(part, str) and len(options) > 1:
            options = tuple(option for option in options if kind_of(option) == part)
            continue
        if isinstance(part, str):
            field = options[0].model_fields.get(part) if options else None
            if field is None:
                return (*place, part), (*options, *(other for other in kinds if other not in options))
            kinds = options = models_in(field.annotation)
        place = (*place, part)
    return place, options


def _kind_rule(given: Mapping[str, Any], models: Models) -> str:
    """The rule of a table whose `kind` is missing or unknown; other keys may tell which one was meant."""
    kinds = [str(kind_of(option)) for option in models]
    rule = one_of(given.get("kind", ""), kinds)
    able = [kind for kind, option in zip(kinds, models, strict=True) if set(given) <= set(option.model_fields)]
    return rule if "kind" in given or len(able) != 1 else f'{rule}; only "{able[0]}" has all keys given'


def _unknown_key(key: str, models: Models) -> str:
    if not models:
        return "unknown key"
    owners = [f'"{kind_of(other)}"' for other in models[1:] if key in other.model_fields]
    if owners:
        return f'belongs to kind {" or ".join(owners)}, but the kind here is "{kind_of(models[0])}"'
    near = _key_meant(key, models[0].model_fields)
    return f"unknown key{near or '; known here are ' + ', '.join(models[0].model_fields)}"


def _key_meant(key: str, known: Iterable[str]) -> str:
    """`; did you mean …?` where a known key says the same in other words or units, or is near."""
    names = list(known)
    words = _stem(key[:80].lower()).split("_")[:4]
    for meant in map("_".join, product(*((word, *_FOREIGN_WORDS.get(word, ())) for word in words))):
        for name in names:
            if meant and meant in (name, _stem(name)):
                return f"; did you mean {name}?"
    return did_you_mean(key, names)


def _stem(key: str) -> str:
    """A key without its unit."""
    return re.sub(rf"(_({_UNITS}))+$", "", key)


def _rule(kind: str, loc: Loc, context: Mapping[str, Any], table: bool) -> str:
    """The rule that a value breaks; `table` says that its key holds a table or a list of them."""
    match kind:
        case "greater_than":
            return f"must be above {context['gt']:.10g}"
        case "greater_than_equal":
            return f"must be at least {context['ge']:.10g}"
        case "less_than":
            return f"must be below {context['lt']:.10g}"
        case "less_than_equal":
            return f"must be at most {context['le']:.10g}"
        case "finite_number":
            return "must be a finite number"
        case "float_type" | "float_parsing":
            return "must be a number"
        case "int_type" | "int_parsing" | "int_from_float" | "int_parsing_size":
            return "must be a whole number"
        case "string_type":
            return "must be text in quotes"
        case "bool_type" | "bool_parsing":
            return "must be true or false"
        case "string_too_short":
            return "must not be empty"
        case "tuple_type" | "list_type" if table:
            return f"must be a list of tables, each under its own [[{place_of(loc)}]]"
        case "tuple_type" | "list_type":
            return "must be a list"
        case "model_type" | "model_attributes_type" | "dict_type":
            return "must be a table"
        case "value_error":
            return str(context["error"])
        case _:
            return "is not a value that this key can take"


def one_of(given: Any, known: Iterable[str]) -> str:
    """The rule that a word must be one of those known."""
    names = list(known)
    near = did_you_mean(given, names) if isinstance(given, str) else ""
    return f"must be one of {', '.join(names)} (got {short(given)}){near}"


def place_of(loc: Loc) -> str:
    """`grass[0].height_m`; keys that no scene has are quoted and shortened."""
    text = ""
    for part in loc:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            text += "." * bool(text) + (part if re.fullmatch(r"[\w-]{1,40}", part) else short(part))
    return text


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """`; did you mean …?` where a known word is near."""
    return "".join(f"; did you mean {near}?" for near in get_close_matches(word[:80], list(known), 1))


def short(value: Any, quoted: bool = True) -> str:
    """A value as a person wrote it, cut to a few words."""
    match value:
        case bool():
            return str(value).lower()
        case str() if not quoted and value.isprintable():
            return value if len(value) <= 200 else f"{value[:199]}…"
        case str() if not quoted:
            return short(value)
        case str():
            cut = value if len(value) <= 40 else f"{value[:39]}…"
            # a line separator, or a sign that turns the direction of text, would break the sentence
            return json.dumps(cut, ensure_ascii=not cut.isprintable())
        case int() if abs(value) >= 10**20:
            return f"a number of {value.bit_length()} bits"
        case list() | tuple():
            shown = [short(item) for item in value[:4]]
            return f"[{', '.join(shown + ['…'] * (len(value) > 4))}]"
        case dict():
            return "a table"
        case BaseModel():
            return f"a {type(value).__name__}"
        case _ if shape := getattr(value, "shape", ()):
            return "an array of " + " × ".join(map(str, shape))
        case _:
            return str(value)
