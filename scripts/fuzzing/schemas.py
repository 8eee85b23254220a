"""Tables of scenes from the models' JSON schemas: values that fit, and values at the edge and beyond."""

from __future__ import annotations

import datetime
import math
import random
from collections.abc import Iterator
from functools import cache
from typing import Any

from pydantic import BaseModel

from greensward.scene import Scene
from greensward.scene.base import names_a_file
from greensward.scene.kinds import models_in
from greensward.techniques import SETTINGS

Schema = dict[str, Any]

NUMBERS = (
    *(0, -0.0, 1, -1, 2, 0.5, 1e-3, 1e-6, 1e-12, 1e-38, 1e-45, 5e-324, 1e3, 1e6, 1e9, 1e38, 3.5e38, 1e308),
    *(math.nan, math.inf, -math.inf, -1e-38, -1e38, 2**31, 2**32, 2**63, 2**64, -(2**63), 10**30, 255, 256),
)
TEXTS = (
    *(
        "",
        " ",
        "\0",
        "\n",
        "\x1b[31m",
        "x" * 300,
        "x" * 100_000,
        "é",
        "草",
        "\U0001f33f",
        "\u202e",
        "\ufeff",
        "\u2028",
    ),
    *("nan", "1", "true", "#fff", "#ffffff", "none", "None", "{}", "%s", "../..", "~nobody/x", "kind"),
)
FILES = (
    *("missing.png", ".", "/", "/dev/zero", "/dev/null", "/proc/self/mem", "http://127.0.0.1:9/x.png", "\0"),
    *("x" * 300, "a/" * 3000, "~nobody/x", "fifo", "folder", "empty.png", "text.png", "picture.png", "deep.png"),
    *("loop.png", "NUL", "picture.png ", "heights.npy", "mesh.obj", "-"),
)


@cache
def scene_schema() -> Schema:
    """The schema of a scene, its references put in, files marked, and technique settings by name."""
    schema = _inlined(Scene)
    choice = schema["properties"]["technique"]
    kinds = []
    for name, model in SETTINGS.items():
        own = _inlined(model)
        properties = {"name": {"const": name}, **own.get("properties", {})}
        kinds.append({"type": "object", "properties": properties, "tag": "name"})
    schema["properties"]["technique"] = {"oneOf": kinds, "default": choice.get("default")}
    return schema


def _inlined(model: type[BaseModel]) -> Schema:
    schema = model.model_json_schema()
    definitions = schema.pop("$defs", {})
    files = set(_named_files(model, set()))

    def put_in(node: Any) -> Any:
        if isinstance(node, list):
            return [put_in(each) for each in node]
        if not isinstance(node, dict):
            return node
        if "$ref" in node:
            rest = {key: value for key, value in node.items() if key != "$ref"}
            return put_in({**definitions[node["$ref"].rsplit("/", 1)[1]], **rest})
        made = {key: put_in(value) for key, value in node.items() if key != "default"}
        own = made.get("properties", {})
        for key in [key for key, value in own.items() if _is_for_python(value)]:
            del own[key]
        for key, value in own.items():
            if isinstance(value, dict) and (node.get("title"), key) in files:
                _mark(value)
        return made

    result: Schema = put_in(schema)
    return result


def _is_for_python(schema: Any) -> bool:
    """Return whether a key takes arrays alone, which TOML cannot give."""
    found = options(schema) if isinstance(schema, dict) else []
    return bool(found) and all(
        each.get("type") == "array" and not {"items", "prefixItems"} & each.keys() for each in found
    )


def _mark(schema: Schema) -> None:
    schema["file"] = True
    for each in (*schema.get("anyOf", ()), schema.get("items")):
        if isinstance(each, dict):
            each["file"] = True


def _named_files(model: type[BaseModel], seen: set[type[BaseModel]]) -> Iterator[tuple[str, str]]:
    if model in seen:
        return
    seen.add(model)
    for key, field in model.model_fields.items():
        if names_a_file(field):
            yield model.__name__, key
        for each in models_in(field.annotation):
            yield from _named_files(each, seen)


def options(schema: Schema) -> list[Schema]:
    """The schemas of which one may stand here, apart from none."""
    found = [each for key in ("anyOf", "oneOf") for one in schema.get(key, ()) for each in options(one)]
    return [each for each in found or [schema] if each.get("type") != "null"]


def fitting(schema: Schema | None, value: Any) -> Schema | None:
    """The one of a schema's options that a table or a list is of."""
    if schema is None:
        return None
    for each in options(schema):
        if isinstance(value, dict) and "properties" in each:
            tag = each.get("tag", "kind")
            said = each["properties"].get(tag, {}).get("const")
            if said is None or value.get(tag, said) == said:
                return each
        if isinstance(value, list) and each.get("type") == "array":
            return each
    return None


def child(schema: Schema | None, key: str | int) -> Schema | None:
    """The schema of what a table or a list has there."""
    if schema is None:
        return None
    if isinstance(key, str):
        found: Schema | None = schema.get("properties", {}).get(key)
        return found
    places = schema.get("prefixItems")
    if places:
        return places[key] if key < len(places) else None
    return schema.get("items")


def places(node: Any, schema: Schema | None) -> Iterator[tuple[Any, Any, Schema | None]]:
    """Every value below a table: what holds it, its key there, and its schema if it has one."""
    own = fitting(schema, node)
    keys = list(node) if isinstance(node, dict) else range(min(len(node), 8))
    for key in keys:
        below = child(own, key)
        yield node, key, below
        if isinstance(node[key], dict | list):
            yield from places(node[key], below)


def tables(node: Any, schema: Schema | None) -> Iterator[tuple[dict[str, Any], Schema]]:
    """Every table whose schema is known."""
    if isinstance(node, dict) and (own := fitting(schema, node)):
        yield node, own
    for holder, key, below in list(places(node, schema)):
        if isinstance(holder[key], dict) and (own := fitting(below, holder[key])):
            yield holder[key], own


def valid(schema: Schema, rng: random.Random, depth: int = 0) -> Any:
    """A value that a schema allows."""
    schema = rng.choice(options(schema))
    if "const" in schema:
        return schema["const"]
    if "enum" in schema:
        return rng.choice(schema["enum"])
    match schema.get("type"):
        case "boolean":
            return rng.random() < 0.5
        case "integer":
            low, high = _bounds(schema)
            return rng.randint(math.ceil(low), math.floor(min(high, low + 64 if rng.random() < 0.8 else high)))
        case "number":
            return _number(schema, rng)
        case "array":
            return _items(schema, rng, depth)
        case "object":
            required = set(schema.get("required", ())) | {schema.get("tag", "kind")}
            return {
                key: valid(each, rng, depth + 1)
                for key, each in schema.get("properties", {}).items()
                if key in required or rng.random() < (0.3 if depth else 0.2)
            }
        case _:
            return "picture.png" if schema.get("file") else f"#{rng.randrange(1 << 24):06x}"


def _items(schema: Schema, rng: random.Random, depth: int) -> list[Any]:
    if "prefixItems" in schema:
        made = [valid(each, rng, depth + 1) for each in schema["prefixItems"]]
        return sorted(made) if len(made) == 2 and rng.random() < 0.9 else made
    low = schema.get("minItems", 0)
    count = rng.randint(low, max(low, min(schema.get("maxItems", 3), low + 2)))
    return [valid(schema["items"], rng, depth + 1) for _ in range(count)]


def _bounds(schema: Schema) -> tuple[float, float]:
    low = schema.get("minimum", schema.get("exclusiveMinimum"))
    high = schema.get("maximum", schema.get("exclusiveMaximum"))
    if low is None:
        low = -100.0 if high is None else high - 100.0
    return low, low + 100.0 if high is None else high


def _number(schema: Schema, rng: random.Random) -> float:
    low, high = _bounds(schema)
    if rng.random() < 0.1:
        return _edge_number(schema, rng, 1.0)
    if rng.random() < 0.6 and low <= 1.0 <= high:
        return min(max(math.pow(10.0, rng.uniform(-2, 2)), low), high)
    return rng.uniform(low, high) or 0.5 * (low + high)


def edge(schema: Schema | None, rng: random.Random) -> Any:
    """A value at the edge of what a schema allows, or beyond."""
    if schema is None:
        return hostile(rng)
    schema = rng.choice(options(schema))
    if schema.get("file"):
        return rng.choice(FILES)
    match schema.get("type"):
        case "integer" | "number":
            return _edge_number(schema, rng)
        case "array":
            return _edge_items(schema, rng)
        case "boolean":
            return rng.choice([True, False, 0, "true"])
        case "object":
            return valid(schema, rng)
        case _ if "enum" in schema or "const" in schema:
            return valid(schema, rng)
        case _:
            return rng.choice(TEXTS)


def _edge_number(schema: Schema, rng: random.Random, allowed_share: float = 0.7) -> float:
    """A number at a bound or a strange one, more often one that is allowed."""
    found = [*_edges(schema), *(rng.choice(NUMBERS) for _ in range(3))]
    low, high = schema.get("minimum", -math.inf), schema.get("maximum", math.inf)
    above, below = schema.get("exclusiveMinimum", -math.inf), schema.get("exclusiveMaximum", math.inf)
    allowed = [each for each in found if low <= each <= high and above < each < below and math.isfinite(each)]
    chosen: float = rng.choice(allowed if allowed and rng.random() < allowed_share else found)
    return chosen


def _edges(schema: Schema) -> list[float]:
    found: list[float] = []
    for name in ("minimum", "exclusiveMinimum", "maximum", "exclusiveMaximum"):
        if name in schema:
            bound = schema[name]
            if schema["type"] == "integer":
                found += [bound, bound - 1, bound + 1]
            else:
                found += [float(bound), math.nextafter(bound, math.inf), math.nextafter(bound, -math.inf)]
    return found or [0.0]


def _edge_items(schema: Schema, rng: random.Random) -> list[Any]:
    if "prefixItems" in schema:
        made = [edge(each, rng) for each in schema["prefixItems"]]
        if rng.random() < 0.5:
            made = [made[0]] * len(made)
        elif rng.random() < 0.5 and not any(isinstance(each, dict | list | str | bool) for each in made):
            made.sort()
        return made[: len(made) - (rng.random() < 0.1)]
    most = schema.get("maxItems", 64)
    count = rng.choice([0, 1, 2, schema.get("minItems", 1) - 1, min(most, 2000), min(most, 2000) + 1])
    one = edge(schema["items"], rng) if rng.random() < 0.5 else valid(schema["items"], rng)
    return [one if rng.random() < 0.5 else valid(schema["items"], rng) for _ in range(max(count, 0))]


def hostile(rng: random.Random) -> Any:
    """A value of any type that TOML has."""
    return rng.choice(
        [
            *(rng.choice(NUMBERS), rng.choice(NUMBERS), rng.choice(TEXTS), rng.choice(FILES), True, False),
            *(
                [],
                {},
                [[]],
                [{}],
                {"kind": "box"},
                [1, "a", [2]],
                [0.0] * 1000,
                [[[[[[1]]]]]],
                nested(rng.choice([20, 90])),
            ),
            *(datetime.date(2020, 1, 1), datetime.datetime(1, 1, 1), datetime.time(1)),
            {f"k{i}": i for i in range(1000)},
        ]
    )


def nested(depth: int) -> Any:
    """Lists within lists."""
    value: Any = 1
    for _ in range(depth):
        value = [value]
    return value
