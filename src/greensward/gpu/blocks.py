"""Uniform blocks, declared once: the GLSL text and the NumPy dtype both follow from the declaration."""

from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

# std140: size in 4-byte words, alignment in words, NumPy base type and shape
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


@dataclass(frozen=True)
class Block:
    """A std140 uniform block at a fixed binding. Members are `(name, type)` or `(name, type, count)`.

    An array's members must be `vec4`, `uvec4` or `mat4`, whose stride std140 leaves alone.
    """

    name: str
    binding: int
    members: tuple[tuple[str, str] | tuple[str, str, int], ...]

    def dtype(self) -> np.dtype[np.void]:
        """The NumPy layout of the block. Matrices are stored transposed, as GLSL reads columns."""
        names, formats, offsets, at = [], [], [], 0
        for name, kind, *rest in self.members:
            words, align, base, shape = _TYPES[kind]
            count = rest[0] if rest else 0
            if count and words % 4:
                raise TypeError(f"{self.name}.{name}: arrays hold vec4, uvec4 or mat4")
            at = -(-at // align) * align
            names.append(name)
            formats.append((base, (count, *shape) if count else shape))
            offsets.append(at * 4)
            at += words * max(count, 1)
        return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": -(-at // 4) * 16})

    def glsl(self) -> str:
        """The declaration; members are read as `name.member` with the block's name in lower case."""
        body = "\n".join(f"    {kind} {name}{f'[{rest[0]}]' if rest else ''};" for name, kind, *rest in self.members)
        return (
            f"layout(std140, binding = {self.binding}) uniform {self.name}Block {{\n{body}\n}} {self.name.lower()};"
        )


BLOCKS: dict[str, Block] = {}


def declare(name: str, binding: int, *members: tuple[str, str] | tuple[str, str, int]) -> Block:
    """Declare a block that shaders include as `block/NAME`."""
    block = Block(name, binding, members)
    taken = [other.name for other in BLOCKS.values() if other.binding == binding and other.name != name]
    if taken:
        raise ValueError(f"{name}: binding {binding} is taken by {taken[0]}")
    BLOCKS[name] = block
    return block


class BlockBuffer:
    """One block's values on the GPU, uploaded only when they changed."""

    def __init__(self, ctx: moderngl.Context, block: Block) -> None:
        self.block = block
        self._values = np.zeros((), block.dtype())
        self._uploaded = b""
        self._buffer = ctx.buffer(reserve=block.dtype().itemsize)

    def set(self, **values: npt.ArrayLike) -> None:
        """Set members by name; a matrix is given as NumPy writes it, rows first."""
        kinds = {name: kind for name, kind, *_ in self.block.members}
        for name, value in values.items():
            self._values[name] = np.swapaxes(value, -1, -2) if kinds[name] == "mat4" else value

    def bind(self) -> None:
        """Upload what changed and bind at the block's binding."""
        now = self._values.tobytes()
        if now != self._uploaded:
            self._buffer.write(now)
            self._uploaded = now
        self._buffer.bind_to_uniform_block(self.block.binding)

    def release(self) -> None:
        """Free the GPU memory."""
        self._buffer.release()
