"""Kernels and draws bind by the names in the shader, and say which of them is wrong."""

import re

import moderngl
import numpy as np
import pytest

from greensward.gpu.buffers import BufferRange, at_least, full, upload
from greensward.gpu.device import Device
from greensward.gpu.kernels import BindingError, Draw, Kernel, Mesh, grid
from greensward.gpu.layouts import BlockBuffer, block

_PAIR = block("Pair", ("pair", "vec4"))
_TEXT = """
#include "layout/Pair"
layout(local_size_x = 4, local_size_y = 2) in;
uniform sampler2D picture;
uniform float factor;
uniform float dropped, dropped_too[2];
uniform sampler2D dropped_picture;
layout(std430) readonly buffer Given { float given[]; };
layout(std430) buffer Result { float result[]; };
void main() {
    uint i = gl_GlobalInvocationID.y * 4u * gl_NumWorkGroups.x + gl_GlobalInvocationID.x;
    result[i] = factor * given[i] + texelFetch(picture, ivec2(0), 0).r + pair.pair.x;
}
"""


@pytest.fixture
def made(device):
    """Resources of the shader above, by name; released afterwards."""
    picture = device.ctx.texture((1, 1), 1, np.float32(100.0).tobytes(), dtype="f4")
    picture.filter = moderngl.NEAREST, moderngl.NEAREST
    values = {
        "picture": picture,
        "Pair": BlockBuffer(device.ctx, _PAIR),
        "Given": device.ctx.buffer(np.arange(128, dtype="f4")),
        "Result": device.ctx.buffer(bytes(512)),
    }
    values["Pair"].set(pair=(1000.0, 0.0, 0.0, 0.0))
    yield values
    for each in values.values():
        each.release()


@pytest.fixture
def kernel(device):
    kernel = Kernel(device, "some.comp", generated={"some.comp": _TEXT})
    yield kernel
    kernel.release()


def _floats(buffer: moderngl.Buffer) -> np.ndarray:
    return np.frombuffer(buffer.read(), "f4")


def test_everything_is_bound_by_its_name(kernel, made):
    assert kernel.group == (4, 2, 1)
    kernel.run((2, 1), **made, factor=2.0)
    assert _floats(made["Result"])[:16].tolist() == (1100.0 + 2.0 * np.arange(16)).tolist()
    assert not _floats(made["Result"])[16:].any()
    kernel.run_over((5, 3), **made)
    assert _floats(made["Result"])[:32].tolist() == (1100.0 + 2.0 * np.arange(32)).tolist(), "what is set stays"


def test_shared_bindings_are_looked_up_at_each_run_and_named_ones_come_first(device, made):
    bindings = {name: made[name] for name in ("picture", "Pair")}
    kernel = Kernel(device, "some.comp", {}, bindings, generated={"some.comp": _TEXT})
    with pytest.raises(BindingError, match=r"^some\.comp: Given is not bound$"):
        kernel.run(1, factor=1.0, Result=made["Result"])
    bindings |= {"Given": made["Given"], "Result": made["Result"]}
    kernel.run(1, factor=1.0)
    assert _floats(made["Result"])[1] == 1101.0
    other = device.ctx.buffer(np.full(8, 5.0, "f4"))
    kernel.run(1, Given=other)
    assert _floats(made["Result"])[1] == 1105.0
    other.release()
    kernel.release()


@pytest.mark.parametrize("missing", ["picture", "Pair", "Given", "Result"])
def test_a_missing_resource_is_named(kernel, made, missing):
    with pytest.raises(BindingError, match=rf"^some\.comp: {missing} is not bound$"):
        kernel.run(1, factor=1.0, **{name: value for name, value in made.items() if name != missing})


def test_a_missing_uniform_is_named(kernel, made):
    with pytest.raises(BindingError, match=r"^some\.comp: factor is not set$"):
        kernel.run(1, **made)


@pytest.mark.parametrize("name", ["Facktor", "factor_", "PairBlock", "given", "main"])
def test_an_unknown_name_is_refused(kernel, made, name):
    with pytest.raises(BindingError, match=rf"^some\.comp: declares no {name}$"):
        kernel.run(1, **made, factor=1.0, **{name: 1.0})
    with pytest.raises(BindingError, match=f"declares no {name}"):
        kernel.set(**{name: 1.0})


def test_names_that_the_compiler_dropped_pass(kernel, made):
    dropped = {"dropped": 1.0, "dropped_too": (1.0, 2.0), "dropped_picture": made["picture"]}
    assert not any(name in kernel for name in dropped)
    assert "factor" in kernel
    assert "Given" in kernel
    kernel.run(1, **made, factor=1.0, **dropped)


def test_groups_that_a_buffer_tells(device, kernel, made):
    arguments = device.ctx.buffer(np.array([9, 9, 9, 2, 1, 1], "u4"))
    kernel.run_indirect(arguments, 12, **made, factor=1.0)
    assert np.count_nonzero(_floats(made["Result"])) == 16
    arguments.release()


@pytest.mark.parametrize("groups", [0, 1, 32768, 32769, 100_000, 2**20])
def test_a_grid_has_room_for_all_and_no_side_too_long(groups):
    columns, rows = grid(groups)
    assert groups <= columns * rows < groups + 32768
    assert max(columns, rows) <= 65535


def test_too_many_groups_are_an_error_of_ours(kernel, made):
    with pytest.raises(AssertionError, match=r"some\.comp"):
        kernel.run(65536, **made, factor=1.0)


# Limits -----------------------------------------------------------------------------------------------------


def _storage(count: int) -> str:
    declared = "".join(f"layout(std430) buffer B{i} {{ float b{i}; }};\n" for i in range(count))
    written = " ".join(f"b{i} = {i}.0;" for i in range(count))
    return f"layout(local_size_x = 1) in;\n{declared}void main() {{ {written} }}"


def _images(count: int) -> str:
    declared = "".join(f"layout(r32f) writeonly uniform image2D i{i};\n" for i in range(count))
    stored = " ".join(f"imageStore(i{i}, ivec2(0), vec4({i}.0));" for i in range(count))
    return f"layout(local_size_x = 1) in;\n{declared}void main() {{ {stored} }}"


def test_eight_storage_blocks_and_four_images_are_bound_in_dense_slots(device):
    kernel = Kernel(device, "a", generated={"a": _storage(8)})
    buffers = {f"B{i}": device.ctx.buffer(bytes(4)) for i in range(8)}
    kernel.run(1, **buffers)
    assert [float(_floats(each)[0]) for each in buffers.values()] == list(range(8))
    members = kernel._program.gl._members.values()
    slots = [each.binding for each in members if isinstance(each, moderngl.StorageBlock)]
    assert sorted(slots) == list(range(8))
    textures = {f"i{i}": device.ctx.texture((1, 1), 1, dtype="f4") for i in range(4)}
    drawing = Kernel(device, "a", generated={"a": _images(4)})
    drawing.run(1, **textures)
    device.ctx.memory_barrier()
    assert [float(np.frombuffer(each.read(), "f4")[0]) for each in textures.values()] == list(range(4))
    for part in (kernel, drawing, *buffers.values(), *textures.values()):
        part.release()


@pytest.mark.parametrize(
    ("text", "got"), [(_storage(9), "8 storage blocks (got 9)"), (_images(5), "4 images (got 5)")]
)
def test_more_are_refused_and_the_program_goes_back(device, text, got):
    reused = device.programs.reused
    for _ in range(2):
        with pytest.raises(BindingError, match=f"^a: must use at most {re.escape(got)}$"):
            Kernel(device, "a", generated={"a": text})
    assert device.programs.reused == reused + 1


# Uniforms ---------------------------------------------------------------------------------------------------


def _echo(device: Device, declared: str, expression: str, count: int = 1, **values: object) -> list[float]:
    cells = "\n".join(f"result[{i}] = {expression.format(i=i)};" for i in range(count))
    head = "layout(local_size_x = 1) in;\nlayout(std430) buffer Result { float result[]; };"
    kernel = Kernel(device, "echo", generated={"echo": f"{head}\nuniform {declared};\nvoid main() {{ {cells} }}"})
    buffer = device.ctx.buffer(reserve=4 * count)
    kernel.run(1, Result=buffer, **values)
    result = _floats(buffer).tolist()
    buffer.release()
    kernel.release()
    return result


@pytest.mark.parametrize(
    ("declared", "expression", "value", "expected"),
    [
        ("float a", "a", 1.5, [1.5]),
        ("bool a", "a ? 1.0 : 0.0", True, [1.0]),
        ("int a", "float(a)", -3, [-3.0]),
        ("uint a", "float(a >> 31u)", 1 << 31, [1.0]),
        ("vec3 a", "a[{i}]", np.array([1.0, 2.0, 3.0]), [1, 2, 3]),
        ("ivec2 a", "float(a[{i}])", (-1, 2), [-1, 2]),
        ("float a[3]", "a[{i}]", [4, 5, 6], [4, 5, 6]),
        ("vec2 a[2]", "a[{i} / 2][{i} % 2]", [(1, 2), (3, 4)], [1, 2, 3, 4]),
        ("int a[2]", "float(a[{i}])", [7, -8], [7, -8]),
        ("float a[1]", "a[{i}]", [4], [4]),
        ("vec2 a[1]", "a[0][{i}]", np.array([[1.0, 2.0]]), [1, 2]),
        ("mat4 a[1]", "a[0][{i} % 4][{i} / 4]", np.arange(16.0).reshape(1, 4, 4), list(range(16))),
        # rows first, as NumPy writes them: GLSL's a[column][row]
        ("mat3 a", "a[{i} % 3][{i} / 3]", np.arange(9.0).reshape(3, 3), list(range(9))),
        ("mat4 a", "a[{i} % 4][{i} / 4]", np.arange(16.0).reshape(4, 4), list(range(16))),
        (
            "mat4 a[2]",
            "a[{i} / 16][{i} % 4][{i} % 16 / 4]",
            np.arange(32.0).reshape(2, 4, 4),
            list(range(32)),
        ),
    ],
)
def test_uniforms_of_every_kind(device, declared, expression, value, expected):
    assert _echo(device, declared, expression, len(expected), a=value) == expected


@pytest.mark.parametrize("used", [1, 2])
@pytest.mark.parametrize(
    ("kind", "of", "values"),
    [
        ("float", "", np.arange(1, 9)),
        ("vec2", ".y", np.repeat(np.arange(1, 9), 2).reshape(8, 2)),
        ("mat4", "[3][3]", np.arange(1, 9)[:, None, None] * np.ones((4, 4))),
    ],
)
def test_an_array_that_the_compiler_trimmed_takes_all_that_was_declared(device, kind, of, values, used):
    """Only its first elements are used: more must not run over into what lies behind it."""
    declared, cell = f"{kind} a[8];\nuniform float b", "a[{i}]" + of + " + b"
    assert _echo(device, declared, cell, used, a=values, b=9.0) == [10.0, 11.0][:used]


def test_a_matrix_multiplies_columns_as_in_python(device):
    matrix, point = np.random.default_rng(1).normal(size=(4, 4)).astype("f4"), np.array([1, 2, 3, 1], "f4")
    got = _echo(device, "mat4 a;\nuniform vec4 p", "(a * p)[{i}]", 4, a=matrix, p=point)
    assert np.allclose(got, matrix @ point, rtol=1e-5)


# Buffers ----------------------------------------------------------------------------------------------------


def test_part_of_a_buffer(kernel, made):
    kernel.run(1, **{**made, "Given": BufferRange(made["Given"], 256, 32)}, factor=1.0)
    assert _floats(made["Result"])[:8].tolist() == (1100.0 + np.arange(64, 72)).tolist()
    kernel.run(1, **{**made, "Result": BufferRange(made["Result"], 256, 256)})
    assert _floats(made["Result"])[64] == 1100.0


@pytest.mark.parametrize(("value", "word"), [(0, b"\0" * 4), (7, b"\7\0\0\0"), (np.float32(-1.0), b"\0\0\x80\xbf")])
def test_full(device, value, word):
    buffer = full(device, 4000, value)
    assert buffer.read() == word * 1000
    buffer.release()


def test_upload_writes_from_the_beginning_on(device):
    buffer = device.ctx.buffer(reserve=64)
    upload(device, buffer, np.arange(16, dtype="f4"))
    upload(device, buffer, np.arange(8, dtype="f4")[::-1][::2])
    assert _floats(buffer)[:4].tolist() == [7, 5, 3, 1]
    buffer.release()


def test_upload_leaves_to_earlier_calls_what_they_read(device):
    slow = """
        layout(local_size_x = 64) in;
        uniform uint row;
        layout(std430) readonly buffer Given { uint given[]; };
        layout(std430) buffer Result { uint result[]; };
        void main() {
            uint i = gl_GlobalInvocationID.x, sum = 0u;
            for (uint k = 0u; k < 2000u; ++k) sum = sum * 747796405u + given[(i + k) % uint(given.length())];
            result[row * 4096u + i] = sum;
        }
    """
    rows = np.arange(8, dtype=np.uint32)[:, None] * 7 + np.arange(64, dtype=np.uint32)
    given, result = device.ctx.buffer(reserve=rows[0].nbytes), device.ctx.buffer(reserve=8 * 4096 * 4)
    kernel = Kernel(device, "slow.comp", generated={"slow.comp": slow})
    seen = []
    for wait in (device.ctx.finish, lambda: None):
        for row, values in enumerate(rows):
            wait()
            upload(device, given, values)
            kernel.run_over(4096, row=row, Given=given, Result=result)
        device.ctx.memory_barrier()
        seen.append(result.read())
    assert seen[0] == seen[1]
    for each in (given, result, kernel):
        each.release()


@pytest.mark.parametrize("item_bytes", [4, 20, 64])
def test_a_buffer_that_is_too_small_is_replaced_by_one_of_whole_items(device, item_bytes):
    small = device.ctx.buffer(reserve=100)
    assert at_least(device, small, 100, item_bytes) is small
    large = at_least(device, small, 101, item_bytes)
    assert large.size >= 101
    assert large.size % item_bytes == 0
    assert isinstance(small.mglo, moderngl.InvalidObject)
    large.release()


# Draws ------------------------------------------------------------------------------------------------------

_STAGES = {
    "a.vert": """
in vec2 corner;
in vec3 unused;
in float height;
in vec2 shift;
void main() { gl_Position = vec4(corner * height + shift, 0.0, 1.0); }
""",
    "a.frag": "uniform vec4 paint;\nout vec4 colour;\nvoid main() { colour = paint; }",
}


def test_attributes_that_the_compiler_dropped_are_skipped(device):
    corners = np.zeros(3, [("corner", "f4", 2), ("unused", "f4", 3), ("height", "f4")])
    corners["corner"], corners["unused"], corners["height"] = [[-1, -1], [3, -1], [-1, 3]], 9.0, 4.0
    shifts = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 9.0]], "f4")[:, [0, 1, 3]]
    shifts[0, :2] = 0.5, 0.5
    buffers = device.ctx.buffer(corners), device.ctx.buffer(shifts.copy())
    content = (buffers[0], "2f4 3f4 1f4", "corner", "unused", "height"), (buffers[1], "2f4 1f4/i", "shift", "gone")
    target = device.ctx.simple_framebuffer((4, 4))
    draw = Draw(device, "a.vert", "a.frag", meshes=(Mesh(content),), generated=_STAGES)
    target.clear()
    target.use()
    draw.run(moderngl.TRIANGLES, -1, 1, paint=(1.0, 0.0, 1.0, 1.0))
    assert target.read(components=4) == b"\xff\x00\xff\xff" * 16
    for each in (draw, *buffers, target):
        each.release()


def test_meshes_are_drawn_by_their_number_and_by_command(device):
    square = device.ctx.buffer(np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]], "f4"))
    triangles = device.ctx.buffer(np.array([0, 1, 2, 1, 3, 2], "u4"))
    stages = {**_STAGES, "a.vert": "in vec2 corner;\nvoid main() { gl_Position = vec4(corner, 0.0, 1.0); }"}
    corner = (square, "2f4", "corner")
    meshes = Mesh((corner,)), Mesh((corner,), triangles)
    draw = Draw(device, "a.vert", "a.frag", meshes=meshes, generated=stages)
    target = device.ctx.simple_framebuffer((4, 4))
    commands = device.ctx.buffer(np.array([0] * 5 + [4, 1, 0, 0, 0], "u4"))
    covers = []
    for step in (
        lambda: draw.run(moderngl.TRIANGLES, 3),
        lambda: draw.run(moderngl.TRIANGLES, -1, 1, 1),
        lambda: draw.run_indirect(moderngl.TRIANGLE_STRIP, commands, 1),
    ):
        target.clear()
        target.use()
        draw.set(paint=(1.0, 1.0, 1.0, 1.0))
        step()
        covers.append(sum(target.read(components=1)) // 255)
    assert 4 < covers[0] < 12
    assert covers[1:] == [16, 16]
    with pytest.raises(BindingError, match=r"^a\.frag: declares no pain$"):
        draw.run(moderngl.TRIANGLES, 3, pain=1.0)
    for each in (draw, square, triangles, target, commands):
        each.release()
