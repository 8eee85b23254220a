"""Saving a scene into its file: values that differ change, and the rest of the text is preserved."""

import re
import tomllib
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

from pydantic import BaseModel, ValidationError

from greensward.scene.edits import Edits
from greensward.scene.errors import SceneError
from greensward.scene.kinds import kind_of
from greensward.scene.plain import defaults_of, held, plain
from greensward.scene.problems import sentences
from greensward.scene.scene import Scene
from greensward.scene.toml_text import Node, Place, Section, is_tables, parsed, spelled, spelled_key, under_headers

_MOST_PAIRS = 40_000
_Row: TypeAlias = tuple[int | None, int | None]


def saved_text(original: str | None, scene: Scene) -> str:
    """TOML that loads to an equal scene: every kind and species, and each key that differs from its default.

    With `original`, the text of a scene's file, it is that text with its comments, blank lines, order and spelling of
    numbers: values that differ change, and keys and tables come and go. A key that is there stays, even where its
    value is the default now. Files that the scene names stay relative to its own folder.
    Raises `SceneError` where `original` is not the text of a scene.
    """
    if original is None:
        return under_headers(plain(scene))
    mark = "\ufeff" if original.startswith("\ufeff") else ""
    windows = original.count("\r\n") == original.count("\n") > 0
    text = original.removeprefix(mark)
    text = text.replace("\r\n", "\n") if windows else text
    before = _scene(text)
    edits = Edits(text)
    _fit(parsed(text), before, scene, edits)
    made = edits.applied()
    return mark + (made.replace("\n", "\r\n") if windows else made)


def _scene(text: str) -> Scene:
    try:
        return Scene.model_validate(tomllib.loads(text))
    except ValidationError as error:
        raise SceneError(sentences(error, Scene, lambda _: "the text to save into")) from None
    except (ValueError, RecursionError) as error:
        raise SceneError([f"the text to save into: must be TOML ({error})"]) from None


# Tables -----------------------------------------------------------------------------------------------------


def _is_table(value: Any) -> bool:
    return isinstance(value, BaseModel | Mapping)


def _fit(node: Node, old: Any, new: Any, edits: Edits) -> None:
    """Change a table's lines from what `old` holds to what `new` holds."""
    had, wanted, keys = held(old), held(new), node.keys or {}
    known = _known(old, new, keys)
    first = node.sections()[:1]
    for key in [key for key in keys if wanted.get(key) is None]:
        edits.remove(keys.pop(key))
    fresh = {}
    for key, value in wanted.items():
        if key in keys:
            if had[key] == value or _change(keys[key], had[key], value, edits):
                continue
            edits.remove(keys.pop(key))
        if value is not None and (key not in known or value != known[key]):
            fresh[key] = plain(value)
    if not node.section and not node.home and (fresh or not keys) and first:  # only tables inside it had headers
        edits.add_block(edits.above(first[0]), under_headers(fresh, node.path))
    elif node.home and not keys and not fresh:
        edits.add_line(node.home[0].end, f"{node.home[0].indent}{node.home[1].rstrip('.')} = {{}}\n")
    elif fresh:
        _add(node, fresh, list(wanted), edits)


def _known(old: Any, new: Any, written: Mapping[str, Node]) -> dict[str, Any]:
    """Defaults of a table, which need not be written."""
    if not isinstance(new, BaseModel):
        return {}
    known = defaults_of(type(new), held(new))
    known.pop("kind", None)  # a model's own is not what a table without one means
    if type(old) is type(new) and kind_of(type(new)) and "kind" not in written:
        known["kind"] = kind_of(type(new))  # where it is left out, it is the first
    return known


def _keeps_its_keys(node: Node, old: Any, new: Any) -> bool:
    """Return whether a table would gain and lose no keys."""
    keys = node.keys or {}
    known = _known(old, new, keys)
    wanted = {key: value for key, value in held(new).items() if value is not None}
    return all(key in wanted for key in keys) and all(
        key in keys or (key in known and value == known[key]) for key, value in wanted.items()
    )


def _add(node: Node, fresh: Mapping[str, Any], order: Sequence[str], edits: Edits) -> None:
    """Write keys that a table lacks; tables go below what precedes them in the order of the model."""
    section, prefix = node.home or (node.section, "")
    assert section
    for key, value in fresh.items():
        if node.home or not (isinstance(value, Mapping) or is_tables(value)):
            line = f"{section.indent}{prefix}{spelled_key(key)} = {spelled(value)}\n"
            edits.add_line(section.head if key == "kind" and not prefix else section.end, line)
        else:
            before = [part for name in order[: order.index(key)] for part in _sections(node, name)]
            ends = [part.end for part in before or (node.sections() if node.path else [])]
            edits.add_block(edits.below(max(ends)) if ends else edits.end, under_headers({key: value}, node.path))


def _sections(node: Node, name: str) -> list[Section]:
    return (node.keys or {})[name].sections() if name in (node.keys or {}) else []


# Values -----------------------------------------------------------------------------------------------------


def _change(node: Node, old: Any, new: Any, edits: Edits) -> bool:
    """Replace `old` by `new` where it is written; return whether that is possible in its place."""
    if _is_table(old) and _is_table(new) and node.keys is not None:
        if not node.span or _keeps_its_keys(node, old, new):
            _fit(node, old, new, edits)
            return True
    elif isinstance(old, tuple | list) and isinstance(new, tuple | list) and node.items:
        if len(node.items) == len(old) and _change_items(node, node.items, old, new, edits):
            return True
    elif node.lines and node.items == [] and is_tables(plain(new)):
        return False  # tables with headers take the place of []
    if node.span:
        edits.change(node.span, _spelled_alike(new, edits.there(node.span)))
    return bool(node.span)


def _spelled_alike(value: Any, before: str) -> str:
    """Spell a value like the one before: a number without a decimal point stays so where it can."""
    if isinstance(value, float) and value.is_integer() and re.fullmatch(r"[-+]?\d+", before):
        return str(int(value))
    return spelled(plain(value))


# Arrays -----------------------------------------------------------------------------------------------------


def _change_items(node: Node, items: list[Node], old: Sequence[Any], new: Sequence[Any], edits: Edits) -> bool:
    """Replace the items of an array that is not empty, one by one; return whether that is possible."""
    if not new or (not node.span and not all(map(_is_table, new))):
        return False
    rows = _aligned(old, new)
    for i, j in rows:
        if i is not None and j is not None and old[i] != new[j]:
            _change(items[i], old[i], new[j], edits)
    if node.span:
        _remove_between_commas([items[i].span or (0, 0) for i, _ in rows if i is not None], rows, edits)
    last: Node | None = None
    for i, j in rows:
        if i is None and j is not None:
            _insert(items, last, plain(new[j]), edits)
        elif j is None and i is not None and not node.span:
            edits.remove(items[i])
        last = items[i] if i is not None else last
    return True


def _remove_between_commas(spans: list[Place], rows: Sequence[_Row], edits: Edits) -> None:
    """Remove the items of an array on a line that have no counterpart; one at least has."""
    stays = [j is not None for i, j in rows if i is not None]
    after = max(index for index, stay in enumerate(stays) if stay)
    for index, stay in enumerate(stays):
        if not stay and index < after:
            edits.replace((spans[index][0], spans[index + 1][0]), "")
        elif not stay:
            edits.replace((spans[index - 1][1], spans[index][1]), "")


def _insert(items: list[Node], last: Node | None, value: Any, edits: Edits) -> None:
    """Write an item of an array behind the last one, or before all."""
    first = items[0]
    if first.span:
        at = last.span[1] if last and last.span else first.span[0]
        edits.add(at, f", {spelled(value)}" if last else f"{spelled(value)}, ")
        return
    sections = (last or first).sections()
    at = edits.below(max(section.end for section in sections)) if last else edits.above(sections[0])
    edits.add_block(at, under_headers({first.path[-1]: [value]}, first.path[:-1]))


def _aligned(old: Sequence[Any], new: Sequence[Any]) -> list[_Row]:
    """Alignment of two lists: pairs of the most similar items, in order; items left over pair with None."""
    head = 0
    while head < min(len(old), len(new)) and old[head] == new[head]:
        head += 1
    tail = 0
    while tail < min(len(old), len(new)) - head and old[-1 - tail] == new[-1 - tail]:
        tail += 1
    rows: list[_Row] = [(k, k) for k in range(head)]
    inner = _most_alike(old[head : len(old) - tail], new[head : len(new) - tail])
    rows += [(None if i is None else head + i, None if j is None else head + j) for i, j in inner]
    return rows + [(len(old) - k, len(new) - k) for k in range(tail, 0, -1)]


def _most_alike(old: Sequence[Any], new: Sequence[Any]) -> list[_Row]:
    shorter = min(len(old), len(new))
    if len(old) == len(new) or len(old) * len(new) > _MOST_PAIRS:
        over: list[_Row] = [(i, None) for i in range(shorter, len(old))]
        return [(k, k) for k in range(shorter)] + over + [(None, j) for j in range(shorter, len(new))]
    # best[i][j] is what the first i and j items have in common at most (Needleman & Wunsch 1970, without a penalty)
    best = [[0.0] * (len(new) + 1) for _ in range(len(old) + 1)]
    for i, one in enumerate(old):
        for j, other in enumerate(new):
            best[i + 1][j + 1] = max(best[i][j] + _likeness(one, other), best[i][j + 1], best[i + 1][j])
    i, j = len(old), len(new)
    rows: list[_Row] = []
    while i or j:
        if i and j and best[i][j] not in (best[i - 1][j], best[i][j - 1]):
            i, j = i - 1, j - 1
            rows.append((i, j))
        elif i and (not j or best[i][j] == best[i - 1][j]):
            i -= 1
            rows.append((i, None))
        else:
            j -= 1
            rows.append((None, j))
    return rows[::-1]


def _likeness(one: Any, other: Any) -> float:
    """Similarity of two items; above 0, so that pairs are made wherever possible."""
    if one == other:
        return 2.0
    if type(one) is not type(other) or not _is_table(one):
        return 0.01
    here, there = held(one), held(other)
    alike = sum(bool(key in there and value == there[key]) for key, value in here.items())
    return 0.01 + alike / len(here | there)
