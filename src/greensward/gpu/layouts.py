"""Memory layouts for Python and GLSL, declared once: uniform blocks (std140), storage structs (std430), constants.

A shader includes the GLSL text of a declaration as `layout/NAME`; Python takes its NumPy dtype.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from functools import cached_property
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

WORD = np.dtype(np.uint32).itemsize
"""Bytes of a 32-bit number, of which layouts consist."""
# size in words, alignment in words, NumPy base type and shape; alike in std140 and std430
_TYPES: dict[str, tuple[int, int, Any, tuple[int, ...]]] = {
    "float": (1, 1, np.float32, ()),
    "int": (1, 1, np.int32, ()),
    "uint": (1, 1, np.uint32, ()),
    "vec2": (2, 2, np.float32, (2,)),
    "ivec2": (2, 2, np.int32, (2,)),
    "vec3": (3, 4, np.float32, (3,)),
    "vec4": (4, 4, np.float32, (4,)),
    "uvec4": (4, 4, np.uint32, (4,)),
    "mat4": (16, 4, np.float32, (4, 4)),
}
Member = tuple[str, "str | Struct"] | tuple[str, "str | Struct", int]


def _lines(members: tuple[Member, ...]) -> str:
    return "\n".join(
        f"    {kind if isinstance(kind, str) else kind.name} {name}{f'[{count[0]}]' if count else ''};"
        for name, kind, *count in members
    )


def _dtype(owner: str, members: tuple[Member, ...], std140: bool) -> np.dtype[np.void]:
    names, formats, offsets, at, widest = [], [], [], 0, 4 if std140 else 1
    shape: tuple[int, ...]
    for name, kind, *rest in members:
        if isinstance(kind, Struct):
            words, align, base, shape = kind.dtype.itemsize // WORD, kind.alignment, kind.dtype, ()
        else:
            words, align, base, shape = _TYPES[kind]
        count = rest[0] if rest else 0
        if count and (words % 4 if std140 else words % align):
            allowed = "vec4, uvec4 or mat4" if std140 else "types without padding"
            raise TypeError(f"{owner}.{name}: arrays hold {allowed}")
        at = -(-at // align) * align
        names.append(name)
        formats.append((base, (count, *shape) if count else shape))
        offsets.append(at * WORD)
        at += words * max(count, 1)
        widest = max(widest, align)
    size = -(-at // widest) * widest * WORD
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": size})


@dataclass(frozen=True)
class Block:
    """A std140 uniform block. Members are `(name, type)` or `(name, type, count)`.

    An array's members must be `vec4`, `uvec4` or `mat4`, whose stride std140 leaves alone.
    """

    name: str
    members: tuple[Member, ...]

    @cached_property
    def dtype(self) -> np.dtype[np.void]:
        """NumPy layout of the block. Matrices are stored transposed, as GLSL reads columns."""
        return _dtype(self.name, self.members, std140=True)

    @property
    def glsl(self) -> str:
        """Declaration; members are read as `name.member` with the block's name in lower case."""
        return f"layout(std140) uniform {self.name}Block {{\n{_lines(self.members)}\n}} {self.name.lower()};"


@dataclass(frozen=True)
class Struct:
    """A struct of storage buffers, laid out by std430. Members as those of `Block`, or other structs."""

    name: str
    members: tuple[Member, ...]

    @cached_property
    def dtype(self) -> np.dtype[np.void]:
        """NumPy layout of one element of an array of these structs."""
        return _dtype(self.name, self.members, std140=False)

    @cached_property
    def alignment(self) -> int:
        """Alignment in words: that of the widest member."""
        return max(kind.alignment if isinstance(kind, Struct) else _TYPES[kind][1] for _, kind, *_ in self.members)

    def offset(self, member: str) -> int:
        """Byte offset of a member."""
        fields = self.dtype.fields
        assert fields is not None
        return int(fields[member][1])

    @property
    def glsl(self) -> str:
        """Declaration, after those of the structs that it holds."""
        inner = "".join(
            f'#include "layout/{kind.name}"\n' for _, kind, *_ in self.members if isinstance(kind, Struct)
        )
        return f"{inner}struct {self.name} {{\n{_lines(self.members)}\n}};"


@dataclass(frozen=True)
class Constants:
    """Named integers or floats that Python and GLSL share."""

    name: str
    values: Mapping[str, int | float]
    unsigned: bool = False

    @property
    def glsl(self) -> str:
        """One `const` a line."""
        kind, end = ("uint", "u") if self.unsigned else ("int", "")
        return "\n".join(
            f"const float {name} = {value!r};" if isinstance(value, float) else f"const {kind} {name} = {value}{end};"
            for name, value in self.values.items()
        )


@dataclass(frozen=True)
class Text:
    """GLSL text that follows from a table in Python."""

    name: str
    glsl: str


LAYOUTS: dict[str, Block | Struct | Constants | Text] = {}


def block(name: str, *members: Member) -> Block:
    """Declare a uniform block that shaders include as `layout/NAME`."""
    declared = LAYOUTS[name] = Block(name, members)
    return declared


def struct(name: str, *members: Member) -> Struct:
    """Declare a storage struct that shaders include as `layout/NAME`."""
    declared = LAYOUTS[name] = Struct(name, members)
    return declared


def constants(name: str, values: Mapping[str, int | float], *, unsigned: bool = False) -> Constants:
    """Declare constants that shaders include as `layout/NAME`."""
    declared = LAYOUTS[name] = Constants(name, values, unsigned)
    return declared


def enumeration(name: str, prefix: str, members: type[IntEnum] | type[IntFlag]) -> Constants:
    """Declare the members of an enumeration as `uint` constants `PREFIX_MEMBER`, included as `layout/NAME`."""
    values = {f"{prefix}_{member}": int(value) for member, value in members.__members__.items()}
    declared = LAYOUTS[name] = Constants(name, values, unsigned=True)
    return declared


def text(name: str, glsl: str) -> Text:
    """Declare GLSL text that shaders include as `layout/NAME`."""
    declared = LAYOUTS[name] = Text(name, glsl)
    return declared


def rows_of(struct_name: str, members: Sequence[tuple[str, str]], first: int = 0) -> tuple[str, str]:
    """GLSL of a struct of floats and vectors that lies packed in rows of `vec4`: its text, and that of its value.

    The value takes the components of `vec4 rows[]` in order from number `first` on, without padding.
    """
    arguments, at = [], first
    for _, kind in members:
        width = 1 if kind == "float" else int(kind[-1])
        parts = [f"rows[{k // 4}].{'xyzw'[k % 4]}" for k in range(at, at + width)]
        arguments.append(parts[0] if width == 1 else f"{kind}({', '.join(parts)})")
        at += width
    body = " ".join(f"{kind} {name};" for name, kind in members)
    return f"struct {struct_name} {{ {body} }};", f"{struct_name}({', '.join(arguments)})"


class WrittenBlock:
    """One block's values on the GPU, which a compute shader writes."""

    def __init__(self, ctx: moderngl.Context, block: Block) -> None:
        self.buffer = ctx.buffer(bytes(block.dtype.itemsize))

    def uploaded(self) -> moderngl.Buffer:
        """The buffer, as `BlockBuffer` has it."""
        return self.buffer

    def release(self) -> None:
        """Free the GPU memory."""
        self.buffer.release()


class BlockBuffer:
    """One block's values on the GPU, uploaded only when they changed."""

    def __init__(self, ctx: moderngl.Context, block: Block) -> None:
        self.block = block
        self._kinds = {name: kind for name, kind, *_ in block.members}
        self._values = np.zeros((), block.dtype)
        self._uploaded = b""
        self._changed = True
        self._buffer = ctx.buffer(reserve=block.dtype.itemsize)

    def set(self, **values: npt.ArrayLike) -> None:
        """Set members by name; a matrix is given as NumPy writes it, rows first."""
        for name, value in values.items():
            self._values[name] = np.swapaxes(value, -1, -2) if self._kinds[name] == "mat4" else value
        self._changed = True

    def uploaded(self) -> moderngl.Buffer:
        """The buffer, with what changed written to it."""
        if self._changed:
            self._changed = False
            now = self._values.tobytes()
            if now != self._uploaded:
                self._buffer.write(now)
                self._uploaded = now
        return self._buffer

    def release(self) -> None:
        """Free the GPU memory."""
        self._buffer.release()
