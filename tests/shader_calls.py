"""Runs the package's own GLSL functions in a small compute shader over arrays of inputs."""

import re
from collections.abc import Mapping
from importlib.resources import files
from itertools import count

import moderngl
import numpy as np

from greensward.gpu.blocks import Block, BlockBuffer
from greensward.gpu.program import build_compute

_FIRST_BINDING = 4
_BASES = {"f": ("float", np.float32), "i": ("int", np.int32), "u": ("uint", np.uint32)}
_VECTORS = {"float": "vec", "int": "ivec", "uint": "uvec"}
_numbers = count()


def shader_call(
    ctx: moderngl.Context,
    include: str,
    body: str,
    inputs: Mapping[str, np.ndarray],
    output: str,
    *,
    blocks: Mapping[Block, Mapping[str, object]] = {},
    source: str = "",
) -> np.ndarray:
    """Evaluate GLSL for every row of the inputs.

    `inputs` are arrays (n,) or (n, 2..4) of float, int32 or uint32, seen by name. `body` is an expression, or
    statements that end in `result = …;`. `output` is `float`, `uvec3` and the like; the result is float64,
    int32 or uint32, (n,) or (n, k). `blocks` are bound with these values, `source` stands before the call.
    """
    rows = len(next(iter(inputs.values())))
    base = {"v": "f", "f": "f", "i": "i", "u": "u"}[output[0]]
    width = int(output[-1]) if output[-1].isdigit() else 1
    scalar, kind = _BASES[base]
    declared, loaded, buffers = [], [], []
    for number, (name, values) in enumerate(inputs.items()):
        array = np.ascontiguousarray(values, _BASES["f" if values.dtype.kind == "f" else values.dtype.kind][1])
        element = _BASES["f" if values.dtype.kind == "f" else values.dtype.kind][0]
        parts = 1 if array.ndim == 1 else array.shape[1]
        binding = _FIRST_BINDING + 1 + number
        declared.append(
            f"layout(std430, binding = {binding}) readonly buffer In_{name} {{ {element} in_{name}[]; }};"
        )
        cells = ", ".join(f"in_{name}[row * {parts} + {part}]" for part in range(parts))
        glsl = element if parts == 1 else f"{_VECTORS[element]}{parts}"
        loaded.append(f"    {glsl} {name} = {glsl}({cells});")
        buffers.append((binding, ctx.buffer(array.tobytes())))
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
            f"layout(std430, binding = {_FIRST_BINDING}) writeonly buffer Called {{ {scalar} called[]; }};",
            # a file of the package may have set the size of a group
            "" if include.endswith(".comp") else "layout(local_size_x = 64) in;",
            "uniform int rows;",
            "void main() {",
            "    int row = int(gl_GlobalInvocationID.x);",
            "    if (row >= rows) return;",
            *loaded,
            f"    {output} result;",
            f"    {statements}",
            stores,
            "}",
        ]
    )
    name = f"called_{next(_numbers)}"
    shader = build_compute(ctx, name, {"TARGETS": 1}, {name: text})  # full-screen passes want to know
    bound = [BlockBuffer(ctx, block) for block in blocks]
    for buffer, values in zip(bound, blocks.values(), strict=True):
        buffer.set(**values)
        buffer.bind()
    result = ctx.buffer(reserve=rows * width * 4)
    result.bind_to_storage_buffer(_FIRST_BINDING)
    for binding, buffer in buffers:
        buffer.bind_to_storage_buffer(binding)
    shader["rows"] = rows
    shader.run(-(-rows // shader_group(include)))
    ctx.finish()
    values = np.frombuffer(result.read(), kind).reshape((rows, width) if width > 1 else (rows,))
    for each in (shader, result, *bound, *(buffer for _, buffer in buffers)):
        each.release()
    return values.astype(np.float64) if kind is np.float32 else values.copy()


def shader_group(include: str) -> int:
    """Invocations in a group of the compute shader that is included, or of ours."""
    if not include.endswith(".comp"):
        return 64
    found = re.search(r"local_size_x = (\d+)", (files("greensward") / include).read_text(encoding="utf-8"))
    assert found
    return int(found[1])


def cut(path: str, function: str) -> str:
    """The text of one function out of a stage file, whose inputs and outputs a compute shader cannot have."""
    text = (files("greensward") / path).read_text(encoding="utf-8")
    found = re.search(rf"^\w+ {function}\(.*?^}}", text, re.MULTILINE | re.DOTALL)
    assert found, f"{path} has no function {function}"
    return found[0]
