"""Shader programs from files of the package, with nested includes and errors that name file and line."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import moderngl

from greensward.gpu.blocks import BLOCKS
from greensward.scene.errors import GreenswardError

_INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$')
# Mesa says 0:12(5), NVIDIA 0(12), others 0:12
_POSITION = re.compile(r"\b\d+(?::(\d+)(?:\(\d+\))?|\((\d+)\))\s*:")
_STAGES = {
    "vert": "vertex_shader",
    "tesc": "tess_control_shader",
    "tese": "tess_evaluation_shader",
    "geom": "geometry_shader",
    "frag": "fragment_shader",
}


class ShaderError(GreenswardError):
    """A shader that the driver refused, with the file and line that a person wrote."""


@dataclass(frozen=True)
class Source:
    """A flat shader text and, for each of its lines, the file and line it came from."""

    text: str
    origin: tuple[tuple[str, int], ...]


@cache
def _read(path: str) -> tuple[str, ...]:
    if path.startswith("block/"):
        return tuple(BLOCKS[path.removeprefix("block/")].glsl().splitlines())
    return tuple((files("greensward") / path).read_text(encoding="utf-8").splitlines())


def assemble(
    path: str,
    defines: Mapping[str, object] = {},
    generated: Mapping[str, str] = {},
    extensions: Sequence[str] = (),
) -> Source:
    """Inline the root-relative includes of a shader file, each once.

    `generated` holds texts that exist only in memory, by include path.
    """
    lines: list[str] = []
    origin: list[tuple[str, int]] = []
    seen: set[str] = set()

    def put(line: str, file: str, number: int) -> None:
        lines.append(line)
        origin.append((file, number))

    def inline(file: str) -> None:
        seen.add(file)
        body = generated[file].splitlines() if file in generated else _read(file)
        for number, line in enumerate(body, start=1):
            include = _INCLUDE.match(line)
            if include is None:
                put(line, file, number)
            elif include[1] not in seen:
                inline(include[1])

    put("#version 430 core", path, 0)
    for extension in extensions:
        put(f"#extension {extension} : require", path, 0)
    for name, value in defines.items():
        put(f"#define {name} {value}", path, 0)
    inline(path)
    return Source("\n".join(lines) + "\n", tuple(origin))


def locate(message: str, sources: Mapping[str, Source]) -> str:
    """Rewrite a driver's message so that its positions name the files that people wrote."""
    source = next((s for stage, s in sources.items() if stage in message), next(iter(sources.values())))

    def replace(match: re.Match[str]) -> str:
        number = int(match[1] or match[2])
        if not 1 <= number <= len(source.origin):
            return match[0]
        file, line = source.origin[number - 1]
        return f"{file}:{line}:"

    return _POSITION.sub(replace, message)


def build(
    ctx: moderngl.Context, *paths: str, defines: Mapping[str, object] = {}, extensions: Sequence[str] = ()
) -> moderngl.Program:
    """Compile and link one program from stage files, whose suffix is the stage."""
    sources = {_STAGES[path.rsplit(".", 1)[1]]: assemble(path, defines, extensions=extensions) for path in paths}
    try:
        return ctx.program(**{stage: source.text for stage, source in sources.items()})  # type: ignore[arg-type]
    except moderngl.Error as error:
        raise ShaderError(locate(str(error), sources)) from None


def put(shader: moderngl.ComputeShader | moderngl.Program, **values: Any) -> None:
    """Set uniforms, but for those that the compiler dropped because the shader does not need them."""
    for name, value in values.items():
        if name in shader:
            shader[name] = value


def build_compute(
    ctx: moderngl.Context,
    path: str,
    defines: Mapping[str, object] = {},
    generated: Mapping[str, str] = {},
    extensions: Sequence[str] = (),
) -> moderngl.ComputeShader:
    """Compile and link one compute shader."""
    source = assemble(path, defines, generated, extensions)
    try:
        return ctx.compute_shader(source.text)
    except moderngl.Error as error:
        raise ShaderError(locate(str(error), {"compute_shader": source})) from None


def forget_sources() -> None:
    """Read shader files again when they are next asked for: they have changed."""
    _read.cache_clear()
