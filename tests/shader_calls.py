"""Runs the package's own GLSL functions in a small compute shader over arrays of inputs."""

import re
from collections.abc import Mapping
from importlib.resources import files
from typing import ClassVar

import moderngl
import numpy as np

from greensward.gpu.device import Device
from greensward.gpu.kernels import Kernel, Resource
from greensward.gpu.layouts import LAYOUTS, Block, BlockBuffer

_BASES = {"f": ("float", np.float32), "i": ("int", np.int32), "u": ("uint", np.uint32)}
_VECTORS = {"float": "vec", "int": "ivec", "uint": "uvec"}
_ARRAYS = {0x8DC1, 0x8DCF, 0x8DD7}
"""OpenGL's sampler2DArray, isampler2DArray and usampler2DArray."""
_WHOLE = {0x8DCA: "i4", 0x8DCF: "i4", 0x8DD2: "u4", 0x8DD7: "u4", 0x9058: "i4", 0x9063: "u4"}
"""dtypes of samplers and images of whole numbers."""


class Neutral(dict[str, Resource]):
    """Resources by name; whatever else a shader names is zero: a block, a texel, a buffer."""

    made: ClassVar[dict[Device, dict[object, Resource]]] = {}
    kernel: Kernel
    """The shader that names them."""

    def get(self, name: str, _: object = None) -> Resource:  # type: ignore[override]
        if name in self:
            return self[name]
        ctx, made = self.kernel.device.ctx, self.made.setdefault(self.kernel.device, {})
        member = self.kernel._program.gl._members.get(name)
        kind = member.gl_type if isinstance(member, moderngl.Uniform) else name
        if kind not in made:
            if isinstance(member, moderngl.StorageBlock):
                made[kind] = ctx.buffer(bytes(4096))
            elif isinstance(member, moderngl.Uniform):
                dtype = _WHOLE.get(member.gl_type, "f4")
                is_array = member.gl_type in _ARRAYS
                made[kind] = (ctx.texture_array if is_array else ctx.texture)(
                    (1, 1, 1) if is_array else (1, 1), 4, bytes(16), dtype=dtype
                )
                made[kind].filter = moderngl.NEAREST, moderngl.NEAREST
            else:
                made[kind] = BlockBuffer(ctx, LAYOUTS[name])
        return made[kind]


def shader_call(
    device: Device,
    include: str,
    body: str,
    inputs: Mapping[str, np.ndarray],
    output: str,
    *,
    blocks: Mapping[Block, Mapping[str, object]] = {},
    source: str = "",
    bindings: Mapping[str, Resource] = {},
    defines: Mapping[str, object] = {},
    uniforms: Mapping[str, object] = {},
) -> np.ndarray:
    """Evaluate GLSL for every row of the inputs.

    `inputs` are arrays (n,) or (n, 2..4) of float, int32 or uint32, seen by name. `body` is an expression, or
    statements that end in `result = …;`. `output` is `float`, `uvec3` and the like; the result is float64,
    int32 or uint32, (n,) or (n, k). `blocks` have these values, `bindings` are other resources, `uniforms` those
    of the include, and `source` stands before the call. What else the include names is zero.
    """
    rows = len(next(iter(inputs.values())))
    base = {"v": "f", "f": "f", "i": "i", "u": "u"}[output[0]]
    width = int(output[-1]) if output[-1].isdigit() else 1
    scalar, kind = _BASES[base]
    declared, loaded, buffers = [], [], {}
    for name, values in inputs.items():
        element, dtype = _BASES["f" if values.dtype.kind == "f" else values.dtype.kind]
        array = np.ascontiguousarray(values, dtype)
        parts = 1 if array.ndim == 1 else array.shape[1]
        declared.append(f"layout(std430) readonly buffer In_{name} {{ {element} in_{name}[]; }};")
        cells = ", ".join(f"in_{name}[row * {parts} + {part}]" for part in range(parts))
        glsl = element if parts == 1 else f"{_VECTORS[element]}{parts}"
        loaded.append(f"    {glsl} {name} = {glsl}({cells});")
        buffers[f"In_{name}"] = device.ctx.buffer(array.tobytes())
    statements = body if "result" in body else f"result = {body};"
    stores = "\n".join(
        f"    called[row * {width} + {part}] = result{f'[{part}]' if width > 1 else ''};" for part in range(width)
    )
    text = "\n".join(
        [
            "#define main unusedMain",
            f'#include "{include}"' if include else "",
            "#undef main",
            source,
            *declared,
            f"layout(std430) writeonly buffer Called {{ {scalar} called[]; }};",
            # a file of the package may have set the size of a group
            "" if include.endswith(".comp") else "layout(local_size_x = 64) in;",
            "uniform int row_count;",
            "void main() {",
            "    int row = int(gl_GlobalInvocationID.x);",
            "    if (row >= row_count) return;",
            *loaded,
            f"    {output} result;",
            f"    {statements}",
            stores,
            "}",
        ]
    )
    neutral = Neutral(bindings)
    # full-screen passes want to know their targets
    kernel = neutral.kernel = Kernel(device, "call", {"TARGETS": 1, **defines}, neutral, generated={"call": text})
    for name in kernel._uniforms:
        member = kernel._program.members[name]
        kernel._values[name] = bytes(member.element_size * member.array_length)
    kernel.set(**uniforms)
    for block, members in blocks.items():
        neutral[block.name] = BlockBuffer(device.ctx, block)
        neutral[block.name].set(**members)
    result = buffers["Called"] = device.ctx.buffer(reserve=rows * width * 4)
    kernel.run_over(rows, **{name: buffer for name, buffer in buffers.items() if name in kernel}, row_count=rows)
    device.ctx.finish()
    values = np.frombuffer(result.read(), kind).reshape((rows, width) if width > 1 else (rows,))
    for each in (kernel, *buffers.values(), *(neutral[block.name] for block in blocks)):
        each.release()
    return values.astype(np.float64) if kind is np.float32 else values.copy()


def surface_at(device: Device, depth: np.ndarray) -> moderngl.Texture:
    """A G-buffer's surface with these depths, float32 (rows, columns), rows from the bottom."""
    words = np.stack([np.zeros(depth.shape, np.uint32), depth.view(np.uint32)], -1)
    return device.ctx.texture(depth.shape[::-1], 2, words.tobytes(), dtype="u4")


def cut(path: str, function: str) -> str:
    """The text of one function out of a stage file, whose inputs and outputs a compute shader cannot have."""
    text = (files("greensward") / path).read_text(encoding="utf-8")
    found = re.search(rf"^\w+ {function}\(.*?^}}", text, re.MULTILINE | re.DOTALL)
    assert found, f"{path} has no function {function}"
    return found[0]
