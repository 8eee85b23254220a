"""Shader texts: files of the package with nested includes, made flat, and errors that name the file and line."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.resources import files

from greensward.gpu.layouts import LAYOUTS
from greensward.scene.errors import GreenswardError

INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"\s*$')
_CONDITION = re.compile(r"^\s*#\s*(if|el|endif)")
# Mesa says 0:12(5), NVIDIA 0(12), others 0:12
_POSITION = re.compile(r"\b\d+(?::(\d+)(?:\(\d+\))?|\((\d+)\))\s*:")


class ShaderError(GreenswardError):
    """A shader that the driver refused, with the file and line that a person wrote."""


@dataclass(frozen=True)
class Source:
    """A flat shader text, and the files and lines it came from."""

    text: str
    runs: tuple[tuple[str, int, int], ...]
    """File, number of the first line, and how many of its lines follow each other."""

    def origin(self, number: int) -> tuple[str, int] | None:
        """File and line of a line of the text, from 1; None where there is no such line."""
        for file, first, count in self.runs:
            if 1 <= number <= count:
                return file, first + number - 1
            number -= count
        return None


@cache
def read_lines(path: str) -> tuple[str, ...]:
    """Lines of a file of the package, or of a declaration as `layout/NAME`."""
    if path.startswith("layout/"):
        return tuple(LAYOUTS[path.removeprefix("layout/")].glsl.splitlines())
    return tuple((files("greensward") / path).read_text(encoding="utf-8").splitlines())


def forget_files() -> None:
    """Read shader files again when they are next needed: they have changed."""
    read_lines.cache_clear()
    _assembled.cache_clear()


@dataclass(frozen=True)
class _Run:
    """Consecutive lines of a file, and the condition in the last of them or the include after them."""

    first: int
    lines: tuple[str, ...]
    condition: str = ""
    include: str = ""


@lru_cache(maxsize=1024)
def _runs(body: tuple[str, ...]) -> tuple[_Run, ...]:
    runs, first = [], 1
    for number, line in enumerate(body, start=1):
        if condition := _CONDITION.match(line):
            runs.append(_Run(first, body[first - 1 : number], condition=condition[1]))
        elif include := INCLUDE.match(line):
            runs.append(_Run(first, body[first - 1 : number - 1], include=include[1]))
        else:
            continue
        first = number + 1
    return (*runs, _Run(first, body[first - 1 :]))


def assemble(
    path: str,
    defines: Mapping[str, object] = {},
    generated: Mapping[str, str] = {},
    extensions: Sequence[str] = (),
) -> Source:
    """Inline the root-relative includes of a shader file.

    Each inclusion stands in a guard. A file is inlined again where an earlier inclusion stands in an `#if`, since
    only the compiler knows whether that one is live. `generated` holds texts that exist only in memory, by path.
    """
    values = tuple((name, str(value)) for name, value in defines.items())
    return _assembled(path, values, tuple(generated.items()), tuple(extensions))


@lru_cache(maxsize=512)
def _assembled(
    path: str,
    defines: tuple[tuple[str, str], ...],
    generated_texts: tuple[tuple[str, str], ...],
    extensions: tuple[str, ...],
) -> Source:
    generated = dict(generated_texts)
    lines: list[str] = []
    origins: list[tuple[str, int, int]] = []
    scopes: list[set[str]] = [set()]  # files that are live wherever the text inside these conditions is

    def emit(file: str, number: int, *text: str) -> None:
        lines.extend(text)
        origins.extend((file, number, 1) for _ in text)

    def inline(file: str, parents: tuple[str, ...]) -> None:
        scopes[-1].add(file)
        for run in _runs(tuple(generated[file].splitlines()) if file in generated else read_lines(file)):
            lines.extend(run.lines)
            end = run.first + len(run.lines)
            origins.append((file, run.first, len(run.lines)))
            if run.condition:
                if run.condition != "if":
                    scopes.pop()
                if run.condition != "endif":
                    scopes.append(set())
            included = run.include
            if included and included not in parents and not any(included in scope for scope in scopes):
                guard = "INCLUDED_" + re.sub(r"\W+", "_", included)
                emit(file, end, f"#ifndef {guard}", f"#define {guard}")
                inline(included, (*parents, included))
                emit(file, end, "#endif")

    emit(path, 0, "#version 430 core")
    emit(path, 0, *(f"#extension {extension} : require" for extension in extensions))
    emit(path, 0, *(f"#define {name} {value}" for name, value in defines))
    inline(path, (path,))
    return Source("\n".join(lines) + "\n", tuple(origins))


def locate(message: str, sources: Mapping[str, Source]) -> str:
    """Rewrite a driver's message so that its positions name the files that people wrote."""
    source = next((s for stage, s in sources.items() if stage in message), next(iter(sources.values())))

    def replace(match: re.Match[str]) -> str:
        number = int(match[1] or match[2])
        origin = source.origin(number)
        return "{}:{}:".format(*origin) if origin else match[0]

    return _POSITION.sub(replace, message)
