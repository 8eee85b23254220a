"""The std140 layout that Python computes is the one that the driver uses."""

import numpy as np
import pytest

from greensward.gpu.blocks import BLOCKS, Block, BlockBuffer, declare
from greensward.gpu.program import build_compute
from shader_calls import shader_call

# every awkward neighbour: a scalar after a vec3, a pair after one scalar, matrices and arrays after odd ends
_ODD = Block(
    "Odd",
    7,
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


@pytest.fixture
def declared(monkeypatch):
    from greensward.gpu import program

    monkeypatch.setitem(BLOCKS, "Odd", _ODD)
    program._read.cache_clear()
    yield _ODD
    program._read.cache_clear()


def _values(block: Block) -> dict[str, np.ndarray]:
    """Distinct numbers in every cell, matrices not symmetric."""
    number, values = 1, {}
    for name, kind, *rest in block.members:
        shape = block.dtype()[name].shape
        size = int(np.prod(shape, dtype=int))
        values[name] = np.arange(number, number + size, dtype=float).reshape(shape)
        number += size
        assert bool(rest) == (
            values[name].ndim == (3 if kind == "mat4" else 2) and kind in ("vec4", "mat4") and bool(rest)
        )
    return values


@pytest.mark.parametrize("member", [name for name, *_ in _ODD.members])
def test_a_shader_reads_every_member(ctx, declared, member):
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
                    ctx, "block/Odd", f"{at} * vec4({basis})", {"x": np.zeros(1)}, "vec4", blocks={declared: values}
                )
                assert np.array_equal(got[0], expected[:, column])
        else:
            got = shader_call(ctx, "block/Odd", at, {"x": np.zeros(1)}, kind, blocks={declared: values})
            assert np.array_equal(np.ravel(got[0]), np.ravel(expected))


@pytest.mark.parametrize("name", ["View", "Ground", "Sward", "Winds", "Light", "Leaf"])
def test_the_driver_agrees_on_the_size(ctx, name):
    import greensward.renderer  # noqa: F401  declares them all

    block = BLOCKS[name]
    first, kind, *rest = block.members[-1]
    read = f"{name.lower()}.{first}{f'[{rest[0] - 1}]' if rest else ''}"
    text = (
        f'#include "block/{name}"\nlayout(local_size_x = 1) in;\n'
        "layout(std430, binding = 0) buffer B { float seen; };\n"
        f"void main() {{ seen = float({read}{'.x' if kind[-1].isdigit() else ''}); }}"
    )
    shader = build_compute(ctx, "size", {}, {"size": text})
    member = shader[f"{name}Block"]
    assert member.size == block.dtype().itemsize
    shader.release()


def test_bindings_are_unique():
    import greensward.renderer  # noqa: F401

    bindings = [block.binding for block in BLOCKS.values()]
    assert len(bindings) == len(set(bindings))
    taken = next(iter(BLOCKS.values()))
    with pytest.raises(ValueError, match=f"taken by {taken.name}"):
        declare("Another", taken.binding, ("x", "float"))
    assert "Another" not in BLOCKS


def test_arrays_with_padded_strides_are_refused():
    with pytest.raises(TypeError, match=r"Bad\.x: arrays hold"):
        Block("Bad", 15, (("x", "float", 4),)).dtype()


def test_unknown_member_is_refused_and_unchanged_values_are_not_sent_again(ctx):
    block = Block("Once", 15, (("x", "float"),))
    buffer = BlockBuffer(ctx, block)
    with pytest.raises(KeyError, match="y"):
        buffer.set(y=1.0)
    buffer.set(x=2.0)
    buffer.bind()
    buffer._buffer.write(b"\0" * 16)
    buffer.bind()
    assert buffer._buffer.read() == b"\0" * 16
    buffer.set(x=3.0)
    buffer.bind()
    assert np.frombuffer(buffer._buffer.read(), "f4")[0] == 3.0
    buffer.release()
