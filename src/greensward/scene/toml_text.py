"""Positions of keys and values in a TOML text, so that a part of it can change while the rest is preserved."""

import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import tomli_w

_TOKEN = re.compile(
    r"""
    (?P<text> \"{3}(?:[^\\]|\\.)*?\"{3,5} | '{3}.*?'{3,5} | "(?:[^"\\\n]|\\.)*" | '[^'\n]*' )
    | (?P<comment> \#[^\n]* ) | (?P<line> \n ) | (?P<mark> [][{},=] ) | (?P<space> [ \t\r]+ )
    | (?P<bare> [^][{},=\s"'\#]+ )
    """,
    re.VERBOSE | re.DOTALL,
)
_OPENING = re.compile(r"(?:#[^\n]*(?:\n|$))*")
Place = tuple[int, int]


@dataclass
class Section:
    """A header and the lines below it that belong to it; the first section of a text has no header."""

    start: int
    head: int
    """End of the header's line."""
    end: int
    """End of the last line that sets a key."""
    indent: str = ""
    """Indentation of its keys."""


@dataclass
class Node:
    """A table, an array or another value, and where it is written."""

    path: tuple[str, ...] = ()
    """Names from the root to a table; indices of arrays are left out."""
    span: Place | None = None
    """Place of the value after `=` or between commas; tables and arrays made by headers or dotted keys have none."""
    lines: Place | None = None
    """The whole lines that set it, if it has lines of its own."""
    keys: dict[str, "Node"] | None = None
    """Keys of a table."""
    items: list["Node"] | None = None
    """Items of an array."""
    section: Section | None = None
    """Section of a table with a header, and of the root."""
    home: tuple[Section, str] | None = None
    """Section of a table made by dotted keys, and the prefix of each key there."""

    def inside(self) -> Iterator["Node"]:
        """This and everything in it."""
        yield self
        for node in (*(self.keys or {}).values(), *(self.items or ())):
            yield from node.inside()

    def sections(self) -> list[Section]:
        """Sections of a table or an array, in the order of the text."""
        return sorted((node.section for node in self.inside() if node.section), key=lambda section: section.start)


def parsed(text: str) -> Node:
    """The root of a text that `tomllib` has parsed."""
    return _Reader(text).root()


class _Reader:
    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens = [(str(m.lastgroup), *m.span()) for m in _TOKEN.finditer(text) if m.lastgroup != "space"]
        self._at = 0

    def root(self) -> Node:
        opening = _OPENING.match(self._text)
        end = opening.end() if opening else 0
        root = table = Node(keys={}, section=Section(0, end, end))
        while self._skip_lines():
            table = self._table(root) if self._peek() == "[" else self._pair(table)
        return root

    def _peek(self) -> str:
        _, start, end = self._tokens[self._at]
        return self._text[start:end]

    def _skip_lines(self) -> bool:
        """Step over comments and ends of lines; return whether anything follows."""
        while self._at < len(self._tokens) and self._tokens[self._at][0] in ("line", "comment"):
            self._at += 1
        return self._at < len(self._tokens)

    def _words(self) -> Place:
        """Place of a key, a text, a number or a time."""
        first = self._at
        while self._at < len(self._tokens) and self._tokens[self._at][0] in ("bare", "text"):
            self._at += 1
        return self._tokens[first][1], self._tokens[self._at - 1][2]

    def _names(self) -> list[str]:
        start, end = self._words()
        node: Any = tomllib.loads(f"{self._text[start:end]} = 0")
        names = []
        while isinstance(node, dict):
            ((name, node),) = node.items()
            names.append(name)
        return names

    def _lines(self, start: int, end: int) -> Place:
        after = self._text.find("\n", end)
        return self._text.rfind("\n", 0, start) + 1, len(self._text) if after < 0 else after + 1

    def _table(self, root: Node) -> Node:
        """A header, and the table that the lines below it belong to."""
        at = self._tokens[self._at][1]
        brackets = 2 if self._text[at : at + 2] == "[[" else 1
        self._at += brackets
        *names, last = self._names()
        self._at += brackets
        start, head = self._lines(at, self._tokens[self._at - 1][2])
        parent = root
        for name in names:
            parent = _child(parent, name)
            parent = parent.items[-1] if parent.items else parent
        table = _child(parent, last)
        if brackets == 2:
            array, table = table, Node((*parent.path, last), keys={})
            array.keys, array.items = None, [*(array.items or ()), table]
        table.section = Section(start, head, head, self._text[start:at])
        return table

    def _pair(self, table: Node) -> Node:
        """A line `key = value` of a table, which goes on."""
        assert table.section
        section, start = table.section, self._tokens[self._at][1]
        names = self._names()
        self._at += 1
        value = self._value()
        assert value.span
        value.lines = self._lines(start, value.span[1])
        section.end, section.indent = value.lines[1], self._text[value.lines[0] : start]
        owner = table
        for depth, name in enumerate(names[:-1], 1):
            owner = _child(owner, name)
            owner.home = section, "".join(f"{spelled_key(each)}." for each in names[:depth])
        assert owner.keys is not None
        owner.keys[names[-1]] = value
        return table

    def _value(self) -> Node:
        """The value that stands next; a table in braces is opened up if no key in it is dotted."""
        start = self._tokens[self._at][1]
        match self._peek():
            case "[":
                items = list(self._parts("]", self._value))
                return Node(span=(start, self._tokens[self._at - 1][2]), items=items)
            case "{":
                pairs = list(self._parts("}", self._inline_pair))
                keys = None if any(len(names) > 1 for names, _ in pairs) else {name[0]: node for name, node in pairs}
                return Node(span=(start, self._tokens[self._at - 1][2]), keys=keys)
            case _:
                return Node(span=self._words())

    def _parts(self, closing: str, part: Any) -> Iterator[Any]:
        self._at += 1
        while self._skip_lines() and self._peek() != closing:
            yield part()
            self._skip_lines()
            self._at += self._peek() == ","
        self._at += 1

    def _inline_pair(self) -> tuple[list[str], Node]:
        names = self._names()
        self._at += 1
        return names, self._value()


def _child(parent: Node, name: str) -> Node:
    assert parent.keys is not None
    return parent.keys.setdefault(name, Node((*parent.path, name), keys={}))


# Writing ----------------------------------------------------------------------------------------------------


def spelled_key(name: str) -> str:
    """A key, in quotes where it must be."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else spelled(name)


def spelled(value: Any) -> str:
    """A value on one line, tables in braces."""
    if isinstance(value, Mapping):
        inner = ", ".join(f"{spelled_key(name)} = {spelled(item)}" for name, item in value.items())
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(spelled, value))}]"
    return tomli_w.dumps({"v": value}).removeprefix("v = ").removesuffix("\n")


def is_tables(value: Any) -> bool:
    """Return whether it is written as tables under headers, `[[…]]`."""
    return isinstance(value, list) and bool(value) and all(isinstance(item, Mapping) for item in value)


def under_headers(table: Mapping[str, Any], path: tuple[str, ...] = (), brackets: str = "[]") -> str:
    """The text of a table: its header, its keys, and the tables in it under headers of their own."""
    inner = {name: item for name, item in table.items() if isinstance(item, Mapping) or is_tables(item)}
    parts = [f"{spelled_key(name)} = {spelled(item)}\n" for name, item in table.items() if name not in inner]
    text = "".join(parts)
    if path and (text or not inner or brackets == "[[]]"):
        half = len(brackets) // 2
        text = f"{brackets[:half]}{'.'.join(map(spelled_key, path))}{brackets[half:]}\n{text}"
    for name, item in inner.items():
        for each in [item] if isinstance(item, Mapping) else item:
            part = under_headers(each, (*path, name), "[]" if isinstance(item, Mapping) else "[[]]")
            text += "\n" * bool(text) + part
    return text
