"""What a caller set in its context is still set after we drew there, in OpenGL and in moderngl's notes."""

import ctypes
from collections.abc import Iterator
from typing import Any

import moderngl
import pytest

from greensward.gpu.adapters import open_context
from greensward.gpu.device import Device
from greensward.gpu.limits import MOST_IMAGES, MOST_STORAGE_BLOCKS, MOST_TEXTURES, MOST_UNIFORM_BLOCKS

_SHADERS: dict[str, Any] = {
    "vertex_shader": """
        #version 430
        uniform float depth;
        void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, depth, 1.0); }
    """,
    "fragment_shader": """
        #version 430
        uniform vec4 paint;
        out vec4 color;
        void main() { color = paint; }
    """,
}


@pytest.fixture(scope="module")
def shared() -> Iterator[moderngl.Context]:
    ctx = open_context()
    yield ctx
    ctx.release()


@pytest.fixture
def ctx(shared: moderngl.Context) -> Iterator[moderngl.Context]:
    with shared:
        yield shared
        assert shared.error == "GL_NO_ERROR"


class Caller:
    """A program that has set everything it can to something unusual, by raw OpenGL or by moderngl."""

    def __init__(self, ctx: moderngl.Context, size: int = 16) -> None:
        self.ctx = ctx
        self.program = ctx.program(**_SHADERS)
        self.array = ctx.vertex_array(self.program, [])
        self.textures: list[Any] = [ctx.texture((4, 4), 4), ctx.texture_array((4, 4, 2), 4)]
        self.sampler = ctx.sampler()
        self.buffer = ctx.buffer(reserve=1024)
        self.image = ctx.texture((8, 8), 1, dtype="f4")
        # moderngl's types know neither masks by attachment nor a scissor of None
        self.framebuffer: Any = ctx.framebuffer(
            [ctx.texture((size, size), 4) for _ in range(2)], ctx.depth_texture((size, size))
        )
        self.reader: Any = ctx.simple_framebuffer((size, size))

    def gl(self, name: str, *arguments: float) -> None:
        kinds = [ctypes.c_float if isinstance(each, float) else ctypes.c_uint for each in arguments]
        Device.of(self.ctx).function(name, None, *kinds)(*arguments)

    def scramble(self, odd: int) -> None:
        """Set everything, to different things for an odd and an even number."""
        ctx, gl = self.ctx, self.gl
        self.framebuffer.use()
        self.framebuffer.viewport = (odd, 2, 7, 9)
        self.framebuffer.scissor = (1, odd, 5, 6)
        self.framebuffer.color_mask = ((True, False, True, bool(odd)), (bool(odd), True, True, True))
        self.framebuffer.depth_mask = bool(odd)
        ctx.enable_only(moderngl.BLEND | moderngl.CULL_FACE if odd else moderngl.DEPTH_TEST)
        ctx.depth_func = ">" if odd else "=="
        ctx.cull_face = "front" if odd else "front_and_back"
        ctx.front_face = "cw" if odd else "ccw"
        ctx.wireframe = bool(odd)
        ctx.multisample = not odd
        ctx.polygon_offset = (1.0 + odd, 2.0)
        ctx.provoking_vertex = moderngl.FIRST_VERTEX_CONVENTION if odd else moderngl.LAST_VERTEX_CONVENTION
        ctx.depth_clamp_range = (0.25, 0.5 + odd / 4) if odd else None
        ctx.patch_vertices = 5 + odd
        ctx.line_width = 1.0
        ctx.point_size = 4.0 + odd
        gl("glBlendFuncSeparatei", 0, 0x0302, 1, 0x0306 + odd, 0)
        gl("glBlendEquationSeparatei", 0, 0x800A + odd, 0x8007 + odd)
        gl("glDisablei", 0x0BE2, 1)
        for switch in (
            0x0B90,
            0x809E,
            0x8C36,
            0x8E51,
            0x8DB9,
            0x0BF2,
            0x0BD0,
            0x8F9D,
            0x8D69,
            0x884F,
            0x3001,
            0x2A01,
        ):
            gl("glEnable" if odd else "glDisable", switch)
        gl("glClearColor", 0.5, 0.25, 0.125, float(odd))
        gl("glClearDepthf", 0.5 + odd / 4)
        if "GL_ARB_clip_control" in ctx.extensions:
            gl("glClipControl", 0x8CA2 - odd, 0x935F - odd)
        for name in (0x0CF2, 0x0CF3, 0x0CF4, 0x806E, 0x806D, 0x0D02, 0x0D03, 0x0D04):
            gl("glPixelStorei", name, 3 + odd)
        gl("glPixelStorei", 0x0CF5, 1 + odd)
        gl("glPixelStorei", 0x0D05, 1 + odd)
        gl("glUseProgram", self.program.glo)
        gl("glBindVertexArray", self.array.glo)
        for unit in range(MOST_TEXTURES):
            self.sampler.use(unit)
            for texture in self.textures:
                texture.use(unit)
        for slot in range(MOST_STORAGE_BLOCKS):
            self.buffer.bind_to_storage_buffer(slot, 256, 512)
        for slot in range(MOST_UNIFORM_BLOCKS):
            self.buffer.bind_to_uniform_block(slot, 256 * odd, 256)
        for slot in range(MOST_IMAGES):
            self.image.bind_to_image(slot, read=bool(odd), write=True, format=0x822E)
        for target in (0x8892, 0x8F36, 0x8F37, 0x88EB, 0x88EC, 0x8F3F, 0x90EE, 0x8A11, 0x90D2, 0x8C2A):
            gl("glBindBuffer", target, self.buffer.glo)
        gl("glActiveTexture", 0x84C0 + 3 + odd)
        gl("glBindFramebuffer", 0x8CA8, self.reader.glo)

    def release(self) -> None:
        """Undo what new contexts do not have, and free everything."""
        for target in (0x88EB, 0x88EC):
            self.gl("glBindBuffer", target, 0)
        for each in (
            self.framebuffer,
            *self.framebuffer.color_attachments,
            self.framebuffer.depth_attachment,
            self.reader,
            self.array,
            self.program,
            *self.textures,
            self.image,
            self.buffer,
            self.sampler,
        ):
            assert each is not None
            each.release()


@pytest.fixture
def callers(ctx: moderngl.Context) -> Iterator[tuple[Caller, Caller]]:
    with Device.of(ctx).state.preserved():
        both = Caller(ctx), Caller(ctx)
        yield both
        for each in both:
            each.release()


@pytest.mark.parametrize("odd", [0, 1])
def test_everything_is_restored(ctx: moderngl.Context, callers: tuple[Caller, Caller], odd: int) -> None:
    caller, we = callers
    caller.scramble(odd)
    before = Device.of(ctx).state.snapshot()
    with Device.of(ctx).state.preserved():
        we.scramble(1 - odd)
        during = Device.of(ctx).state.snapshot()
    after = Device.of(ctx).state.snapshot()
    assert {name: after[name] for name in after if after[name] != before[name]} == {}
    # the test is worth something only if all of it was disturbed; wide lines are not offered everywhere
    assert {name for name in before if before[name] == during[name]} <= {
        *(f"clip_distance{i}" for i in (0, *range(2, 8))),
        *(f"blend{i}" for i in range(1, 8)),
        *(f"color_mask{i}" for i in range(2, 8)),
        *(f"{name}{ctx.default_texture_unit}" for name in ("bound_2d", "bound_2d_array", "sampler")),
        *("line_width", "sample_coverage", "rasterizer_discard", "program_point_size", "renderbuffer"),
        *("scissor_test", "polygon_offset_fill", "polygon_offset_line"),
    }


@pytest.mark.parametrize(
    ("change", "name"),
    [
        (lambda gl: gl("glEnable", 0x80A0), "sample_coverage"),
        (lambda gl: gl("glEnable", 0x8C89), "rasterizer_discard"),
        (lambda gl: gl("glEnable", 0x8642), "program_point_size"),
        (lambda gl: gl("glEnable", 0x0C11), "scissor_test"),
        (lambda gl: gl("glEnable", 0x8037), "polygon_offset_fill"),
        (lambda gl: gl("glEnable", 0x2A02), "polygon_offset_line"),
        (lambda gl: gl("glEnable", 0x3007), "clip_distance7"),
    ],
)
def test_switches_are_restored_from_both_sides(
    ctx: moderngl.Context, callers: tuple[Caller, Caller], change: Any, name: str
) -> None:
    gl = callers[0].gl
    before = Device.of(ctx).state.snapshot()
    with Device.of(ctx).state.preserved():
        change(gl)
        during = Device.of(ctx).state.snapshot()
        with Device.of(ctx).state.preserved():  # which switches it off for us
            assert Device.of(ctx).state.snapshot()[name] == before[name]
        assert Device.of(ctx).state.snapshot() == during
    assert before[name] != during[name]
    assert Device.of(ctx).state.snapshot() == before


def test_drawing_starts_from_the_same_state_whatever_the_caller_did(
    ctx: moderngl.Context, callers: tuple[Caller, Caller]
) -> None:
    kept_by_whoever_draws = {
        *("draw_framebuffer", "read_framebuffer", "viewport", "scissor_box", "clear_depth", "clear_color"),
        *("unpack_alignment", "pack_alignment"),
        *("program", "vertex_array", "active_texture", "moderngl", "blend_factors0", "blend_equations0"),
        *(f"{kind}{i}" for kind in ("bound_2d", "bound_2d_array") for i in range(64)),
        *(f"{kind}{i}" for kind in ("uniform_buffer", "shader_storage_buffer", "image") for i in range(64)),
        *(f"{name}_buffer" for name in ("array", "copy_read", "copy_write", "draw_indirect")),
        *(f"{name}_buffer" for name in ("dispatch_indirect", "texture", "uniform", "shader_storage")),
    }
    starts = []
    for odd in (0, 1):
        callers[0].scramble(odd)
        with Device.of(ctx).state.preserved():
            state = Device.of(ctx).state.snapshot()
        starts.append({name: value for name, value in state.items() if name not in kept_by_whoever_draws})
    assert starts[0] == starts[1]
    assert starts[0]["depth_test"] == (0,)
    assert starts[0]["pixel_unpack_buffer"] == (0,)


def test_state_is_restored_after_an_error(ctx: moderngl.Context, callers: tuple[Caller, Caller]) -> None:
    callers[0].scramble(1)
    before = Device.of(ctx).state.snapshot()

    def fail() -> None:
        callers[1].scramble(0)
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError), Device.of(ctx).state.preserved():
        fail()
    assert Device.of(ctx).state.snapshot() == before


def test_moderngl_draws_on_as_if_nothing_had_been(ctx: moderngl.Context, callers: tuple[Caller, Caller]) -> None:
    caller, we = callers
    target = caller.reader
    target.use()
    target.viewport = (0, 0, 8, 16)  # the left half
    ctx.enable_only(moderngl.BLEND)
    ctx.blend_func = moderngl.ONE, moderngl.ONE
    with Device.of(ctx).state.preserved():
        we.scramble(0)
    assert ctx.fbo is target
    assert ctx.viewport == (0, 0, 8, 16)
    ctx.clear(0.0, 0.0, 0.0, 0.0, viewport=(0, 0, 16, 16))
    for paint in ((1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0)):
        caller.program["paint"] = paint
        caller.array.render(moderngl.TRIANGLES, vertices=3)
    row = target.read(components=4)[: 16 * 4]
    assert row == b"\xff\xff\x00\xff" * 8 + bytes(4 * 8)
    with ctx.scope(we.reader, moderngl.DEPTH_TEST):
        pass
    assert Device.of(ctx).state.snapshot()["blend0"] == (
        1,
    )  # the scope brought blending back, as moderngl remembered


def test_framebuffers_named_keep_their_viewport_and_masks(
    ctx: moderngl.Context, callers: tuple[Caller, Caller]
) -> None:
    target = callers[0].framebuffer
    callers[1].reader.use()
    with Device.of(ctx).state.preserved((target,)):
        target.use()
        target.viewport = (1, 1, 2, 2)
        target.depth_mask = False
        target.color_mask = ((False,) * 4,) * 2
    assert target.viewport == (0, 0, 16, 16)
    assert target.depth_mask is True
    assert target.color_mask == ((True,) * 4,) * 2
    assert ctx.fbo is callers[1].reader


def test_the_bound_framebuffer_may_be_changed_itself(ctx: moderngl.Context, callers: tuple[Caller, Caller]) -> None:
    target = callers[0].reader
    for scissor in (None, (1, 2, 3, 4)):
        target.use()
        target.scissor = scissor
        before = Device.of(ctx).state.snapshot()
        with Device.of(ctx).state.preserved():
            ctx.scissor = (5, 5, 5, 5) if scissor is None else None
            ctx.viewport = (1, 1, 2, 2)
        assert Device.of(ctx).state.snapshot() == before
        target.use()  # sets what moderngl remembers
        assert Device.of(ctx).state.snapshot() == before


def test_a_framebuffer_bound_behind_moderngls_back_stays_bound(
    ctx: moderngl.Context, callers: tuple[Caller, Caller]
) -> None:
    callers[0].reader.use()
    callers[0].gl("glBindFramebuffer", 0x8D40, callers[0].framebuffer.glo)
    callers[0].gl("glViewport", 3, 3, 4, 4)
    before = Device.of(ctx).state.snapshot()
    with Device.of(ctx).state.preserved():
        callers[1].scramble(1)
    assert Device.of(ctx).state.snapshot() == before
    assert ctx.fbo is callers[0].reader
    assert ctx.viewport == (0, 0, 16, 16)


def test_what_was_deleted_meanwhile_is_unbound(ctx: moderngl.Context) -> None:
    with Device.of(ctx).state.preserved():
        caller = Caller(ctx)
        caller.scramble(1)
        with Device.of(ctx).state.preserved():
            caller.gl("glUseProgram", 0)
            caller.release()
        state = Device.of(ctx).state.snapshot()
    assert ctx.error == "GL_NO_ERROR"
    assert state["program"] == state["vertex_array"] == state["draw_framebuffer"] == (0,)
    bound = "bound_", "sampler", "uniform_buffer", "shader_storage_buffer", "image"
    kept = {f"bound_2d{ctx.default_texture_unit}", f"bound_2d_array{ctx.default_texture_unit}"}
    assert {name for name in state if name.startswith(bound) and state[name][0]} <= kept
