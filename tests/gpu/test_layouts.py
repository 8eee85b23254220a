"""The layouts that Python computes, std140 and std430, are those that the driver uses."""

from enum import IntEnum

import numpy as np
import pytest

import greensward.renderer  # noqa: F401  declares them all
from greensward.gpu import layouts, shader_source
from greensward.gpu.kernels import Kernel
from greensward.gpu.layouts import LAYOUTS, Block, BlockBuffer, Struct
from shader_calls import shader_call

# every awkward neighbour: a scalar after a vec3, a pair after one scalar, matrices and arrays after odd ends
_ODD = Block(
    "Odd",
    (
        ("a", "float"),
        ("b", "vec2"),
        ("c", "vec3"),
        ("d", "float"),
        ("e", "vec3"),
        ("f", "vec2"),
        ("g", "mat4"),
        ("h", "int"),
        ("i", "uvec4"),
        ("j", "uint"),
        ("k", "vec4", 3),
        ("l", "float"),
        ("m", "mat4", 2),
        ("n", "ivec2"),
        ("o", "vec3"),
    ),
)


# of a struct, and of a struct in another: odd ends, and arrays of what std430 packs
_INNER = Struct("Inner", (("x", "float"), ("xy", "vec2"), ("n", "uint", 3)))
_OUTER = Struct(
    "Outer",
    (
        ("a", "float"),
        ("b", "vec3"),
        ("c", "float"),
        ("d", _INNER),
        ("e", "int"),
        ("f", _INNER, 2),
        ("g", "uint"),
        ("h", "vec2", 3),
        ("i", "ivec2"),
        ("j", "float", 5),
        ("k", "vec4"),
        ("l", "uint"),
        ("m", "mat4"),
        ("n", "uvec4", 2),
        ("o", "float"),
    ),
)


@pytest.fixture
def declared(monkeypatch):
    for each in (_ODD, _INNER, _OUTER):
        monkeypatch.setitem(LAYOUTS, each.name, each)
    shader_source.forget_files()
    yield _ODD
    shader_source.forget_files()


def _values(block: Block) -> dict[str, np.ndarray]:
    """Distinct numbers in every cell, matrices not symmetric."""
    number, values = 1, {}
    for name, kind, *rest in block.members:
        shape = block.dtype[name].shape
        size = int(np.prod(shape, dtype=int))
        values[name] = np.arange(number, number + size, dtype=float).reshape(shape)
        number += size
        assert bool(rest) == (
            values[name].ndim == (3 if kind == "mat4" else 2) and kind in ("vec4", "mat4") and bool(rest)
        )
    return values


@pytest.mark.parametrize("member", [name for name, *_ in _ODD.members])
def test_a_shader_reads_every_member(device, declared, member):
    values = _values(declared)
    _, kind, *rest = next(m for m in declared.members if m[0] == member)
    for index in range(rest[0] if rest else 1):
        at = f"odd.{member}[{index}]" if rest else f"odd.{member}"
        expected = np.asarray(values[member][index] if rest else values[member], float)
        if kind == "mat4":
            # rows in Python are rows in GLSL: M * (1, 0, 0, 0) is the first column
            for column in range(4):
                basis = ", ".join("1.0" if i == column else "0.0" for i in range(4))
                got = shader_call(
                    device,
                    "layout/Odd",
                    f"{at} * vec4({basis})",
                    {"x": np.zeros(1)},
                    "vec4",
                    blocks={declared: values},
                )
                assert np.array_equal(got[0], expected[:, column])
        else:
            got = shader_call(device, "layout/Odd", at, {"x": np.zeros(1)}, kind, blocks={declared: values})
            assert np.array_equal(np.ravel(got[0]), np.ravel(expected))


@pytest.mark.parametrize("name", sorted(name for name, each in LAYOUTS.items() if isinstance(each, Block)))
def test_the_driver_agrees_on_the_size(device, name):
    block = LAYOUTS[name]
    first, kind, *rest = block.members[-1]
    read = f"{name.lower()}.{first}{f'[{rest[0] - 1}]' if rest else ''}"
    text = (
        f'#include "layout/{name}"\nlayout(local_size_x = 1) in;\n'
        "layout(std430) buffer B { float seen; };\n"
        f"void main() {{ seen = float({read}{'.x' if kind[-1].isdigit() else ''}); }}"
    )
    kernel = Kernel(device, "size", generated={"size": text})
    assert kernel._program.gl[f"{name}Block"].size == block.dtype.itemsize
    kernel.release()


# Storage structs --------------------------------------------------------------------------------------------


_SCALARS = {"i": "int", "u": "uint"}


def _writes(struct: Struct, target: str, number: list[int]) -> list[str]:
    """GLSL that writes the next number into every cell of a struct, in order."""
    lines = []
    for name, kind, *count in struct.members:
        if count and kind in ("float", "int", "uint"):  # a loop: compilers take half a minute for a thousand lines
            value = f"{kind}({number[0]} + k + 1000 * int(i))"
            lines.append(f"for (int k = 0; k < {count[0]}; k++) {target}.{name}[k] = {value};")
            number[0] += count[0]
            continue
        for place in [f"{target}.{name}[{i}]" for i in range(count[0])] if count else [f"{target}.{name}"]:
            if isinstance(kind, Struct):
                lines += _writes(kind, place, number)
                continue
            cells = {"4": [f"[{i}]" for i in range(4)], "3": list("xyz"), "2": list("xy")}.get(kind[-1], [""])
            if kind == "mat4":
                cells = [f"[{column}][{row}]" for column in range(4) for row in range(4)]
            for cell in cells:
                dot = "." if cell and cell[0] != "[" else ""
                lines.append(f"{place}{dot}{cell} = {_SCALARS.get(kind[0], 'float')}({number[0]} + 1000 * int(i));")
                number[0] += 1
    return lines


def _cells(row: np.void) -> list[float]:
    """Every number of a row, in order of its members."""
    if row.dtype.names is None:
        return np.ravel(row).tolist()
    return [cell for name in row.dtype.names for part in np.atleast_1d(row[name]) for cell in _cells(part)]


_STRUCTS = [_OUTER, *(each for each in LAYOUTS.values() if isinstance(each, Struct))]


@pytest.mark.parametrize("struct", _STRUCTS, ids=[each.name for each in _STRUCTS])
@pytest.mark.usefixtures("declared")
def test_what_a_shader_writes_is_read_by_the_dtype(device, struct):
    number = [1]
    lines = "\n".join(_writes(struct, "rows[i]", number))
    text = (
        f'#include "layout/{struct.name}"\nlayout(local_size_x = 1) in;\n'
        f"layout(std430) buffer Rows {{ {struct.name} rows[]; }};\n"
        f"void main() {{ uint i = gl_WorkGroupID.x;\n{lines}\n}}"
    )
    kernel = Kernel(device, "write", generated={"write": text})
    buffer = device.ctx.buffer(bytes(3 * struct.dtype.itemsize))
    kernel.run(3, Rows=buffer)
    rows = np.frombuffer(buffer.read(), struct.dtype)
    for i, row in enumerate(rows):
        assert _cells(row) == (np.arange(1, number[0]) + 1000 * i).tolist()
    for each in (kernel, buffer):
        each.release()


def test_arrays_with_padded_strides_are_refused():
    for declared in (Block("Bad", (("x", "float", 4),)), Struct("Bad", (("x", "vec3", 4),))):
        with pytest.raises(TypeError, match=r"Bad\.x: arrays hold"):
            _ = declared.dtype


# Constants --------------------------------------------------------------------------------------------------


class _Fruit(IntEnum):
    APPLE = 0
    PEAR = 1 << 31


def test_constants_are_those_of_python(device, monkeypatch):
    monkeypatch.setattr(layouts, "LAYOUTS", dict(LAYOUTS))
    declared = [
        layouts.enumeration("Fruit", "FRUIT", _Fruit),
        layouts.constants("Signed", {"LEAST": -7, "PART": 0.1}),
        layouts.constants("Unsigned", {"MOST": (1 << 32) - 1}, unsigned=True),
        layouts.text("Twice", "float twice(float x) { return 2.0 * x; }"),
    ]
    assert all(layouts.LAYOUTS[each.name] is each for each in declared)
    source = "\n".join(each.glsl for each in declared)
    none = {"x": np.zeros(1)}
    for call, kind, value in (
        ("uvec3(FRUIT_APPLE, FRUIT_PEAR, MOST)", "uvec3", [0, 1 << 31, (1 << 32) - 1]),
        ("ivec2(LEAST, SPECIES_ROWS)", "ivec2", [-7, 9]),
        ("vec2(PART, twice(PART))", "vec2", np.array([0.1, 0.2], np.float32).tolist()),
    ):
        got = shader_call(device, "layout/SpeciesRow", call, none, kind, source=source)
        assert got[0].tolist() == value


def test_packed_rows_are_read_in_order(device):
    members = (("a", "float"), ("b", "vec3"), ("c", "vec2"), ("d", "float"), ("e", "vec4"))
    struct, value = layouts.rows_of("Packed", members, first=1)
    source = f"{struct}\nvec4 rows[3] = vec4[3](vec4(0, 1, 2, 3), vec4(4, 5, 6, 7), vec4(8, 9, 10, 11));"
    cells = ["a", "b.x", "b.y", "b.z", "c.x", "c.y", "d", "e.x", "e.y", "e.z", "e.w"]
    for i, cell in enumerate(cells, start=1):
        got = shader_call(device, "", f"{value}.{cell}", {"x": np.zeros(1)}, "float", source=source)
        assert got[0] == i


# Buffers ----------------------------------------------------------------------------------------------------


def test_unknown_member_is_refused_and_unchanged_values_are_not_sent_again(device):
    buffer = BlockBuffer(device.ctx, Block("Once", (("x", "float"),)))
    with pytest.raises(KeyError, match="y"):
        buffer.set(y=1.0)
    buffer.set(x=2.0)
    buffer.uploaded().write(b"\0" * 16)
    buffer.set(x=2.0)
    assert buffer.uploaded().read() == b"\0" * 16
    buffer.set(x=3.0)
    assert np.frombuffer(buffer.uploaded().read(), "f4")[0] == 3.0
    buffer.release()
