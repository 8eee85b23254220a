"""Preserve the OpenGL state of a host's context, and moderngl's own notes about it, while greensward draws in it.

Left alone, because nothing here draws with them: viewports beyond the first, stencil functions, transform
feedback, and the draw and read buffers of framebuffers.
"""

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import moderngl

State = dict[str, Any]
_UINT, _INT, _BOOL, _FLOAT, _DOUBLE = (
    ctypes.c_uint,
    ctypes.c_int,
    ctypes.c_ubyte,
    ctypes.c_float,
    ctypes.c_double,
)


@dataclass(frozen=True)
class _Value:
    """State read by glGet and written by one call; `fresh` is what drawing starts from, where it matters."""

    name: str
    queries: tuple[int, ...]
    setter: str
    kinds: tuple[Any, ...]
    fresh: tuple[float, ...] | None = None
    before: tuple[int, ...] = ()  # arguments that precede the value
    exists: str = ""  # asks whether an object's name still is one
    needs: str = ""  # an extension


_EXISTS = {
    "glBindFramebuffer": "glIsFramebuffer",
    "glBindRenderbuffer": "glIsRenderbuffer",
    "glBindVertexArray": "glIsVertexArray",
    "glBindBuffer": "glIsBuffer",
    "glUseProgram": "glIsProgram",
}


def _bound(name: str, query: int, setter: str, target: int | None, *, clear: bool = False) -> _Value:
    before = () if target is None else (target,)
    return _Value(name, (query,), setter, (_UINT,), (0,) if clear else None, before, _EXISTS[setter])


# In the order of writing.
_VALUES = (
    _bound("draw_framebuffer", 0x8CA6, "glBindFramebuffer", 0x8CA9),
    _bound("read_framebuffer", 0x8CAA, "glBindFramebuffer", 0x8CA8),
    _bound("renderbuffer", 0x8CA7, "glBindRenderbuffer", 0x8D41),
    _bound("program", 0x8B8D, "glUseProgram", None),
    _bound("vertex_array", 0x85B5, "glBindVertexArray", None),
    _bound("array_buffer", 0x8894, "glBindBuffer", 0x8892),
    _bound("copy_read_buffer", 0x8F36, "glBindBuffer", 0x8F36),
    _bound("copy_write_buffer", 0x8F37, "glBindBuffer", 0x8F37),
    _bound("pixel_pack_buffer", 0x88ED, "glBindBuffer", 0x88EB, clear=True),
    _bound("pixel_unpack_buffer", 0x88EF, "glBindBuffer", 0x88EC, clear=True),
    _bound("draw_indirect_buffer", 0x8F43, "glBindBuffer", 0x8F3F),
    _bound("dispatch_indirect_buffer", 0x90EF, "glBindBuffer", 0x90EE),
    _bound("texture_buffer", 0x8C2A, "glBindBuffer", 0x8C2A),
    _bound("uniform_buffer", 0x8A28, "glBindBuffer", 0x8A11),
    _bound("shader_storage_buffer", 0x90D3, "glBindBuffer", 0x90D2),
    _Value("viewport", (0x0BA2,), "glViewport", (_INT,) * 4),
    _Value("scissor_box", (0x0C10,), "glScissor", (_INT,) * 4),
    _Value("depth_func", (0x0B74,), "glDepthFunc", (_UINT,), (0x0201,)),
    _Value("depth_mask", (0x0B72,), "glDepthMask", (_BOOL,), (1,)),
    _Value("depth_range", (0x0B70,), "glDepthRange", (_DOUBLE,) * 2, (0.0, 1.0)),
    _Value("clear_depth", (0x0B73,), "glClearDepth", (_DOUBLE,)),
    _Value("clear_color", (0x0C22,), "glClearColor", (_FLOAT,) * 4),
    _Value("cull_face_mode", (0x0B45,), "glCullFace", (_UINT,), (0x0405,)),
    _Value("front_face", (0x0B46,), "glFrontFace", (_UINT,), (0x0901,)),
    _Value("polygon_mode", (0x0B40,), "glPolygonMode", (_UINT,), (0x1B02,), (0x0408,)),
    _Value("polygon_offset", (0x8038, 0x2A00), "glPolygonOffset", (_FLOAT,) * 2, (0.0, 0.0)),
    _Value("line_width", (0x0B21,), "glLineWidth", (_FLOAT,), (1.0,)),
    _Value("point_size", (0x0B11,), "glPointSize", (_FLOAT,), (1.0,)),
    _Value("patch_vertices", (0x8E72,), "glPatchParameteri", (_INT,), (3,), (0x8E72,)),
    _Value("provoking_vertex", (0x8E4F,), "glProvokingVertex", (_UINT,), (0x8E4E,)),
    _Value(
        "clip_control",
        (0x935C, 0x935D),
        "glClipControl",
        (_UINT,) * 2,
        (0x8CA1, 0x935E),
        needs="GL_ARB_clip_control",
    ),
    *(
        _Value(name, (query,), "glPixelStorei", (_INT,), (fresh,), (query,))
        for name, query, fresh in (
            ("unpack_alignment", 0x0CF5, 4),
            ("unpack_row_length", 0x0CF2, 0),
            ("unpack_skip_rows", 0x0CF3, 0),
            ("unpack_skip_pixels", 0x0CF4, 0),
            ("unpack_image_height", 0x806E, 0),
            ("unpack_skip_images", 0x806D, 0),
            ("pack_alignment", 0x0D05, 4),
            ("pack_row_length", 0x0D02, 0),
            ("pack_skip_rows", 0x0D03, 0),
            ("pack_skip_pixels", 0x0D04, 0),
        )
    ),
)
# What a new context has, and what moderngl sets in it.
_SWITCHES = {
    "depth_test": (0x0B71, False),
    "stencil_test": (0x0B90, False),
    "scissor_test": (0x0C11, False),
    "cull_face": (0x0B44, False),
    "rasterizer_discard": (0x8C89, False),
    "program_point_size": (0x8642, False),
    "depth_clamp": (0x864F, False),
    "multisample": (0x809D, True),
    "sample_alpha_to_coverage": (0x809E, False),
    "sample_coverage": (0x80A0, False),
    "sample_shading": (0x8C36, False),
    "framebuffer_srgb": (0x8DB9, False),
    "color_logic_op": (0x0BF2, False),
    "dither": (0x0BD0, True),
    # as moderngl has it, but not dependent on the caller's restart index
    "primitive_restart": (0x8F9D, False),
    "primitive_restart_fixed_index": (0x8D69, True),
    "texture_cube_map_seamless": (0x884F, True),
    "polygon_offset_fill": (0x8037, False),
    "polygon_offset_line": (0x2A02, False),
    "polygon_offset_point": (0x2A01, False),
} | {f"clip_distance{i}": (0x3000 + i, False) for i in range(8)}
_BLEND, _COLOR_MASK = 0x0BE2, 0x0C23
_BLEND_QUERIES = (0x80C9, 0x80C8, 0x80CB, 0x80CA, 0x8009, 0x883D)  # factors, then equations
_FRESH_TARGET = (False, (0x0302, 0x0303, 0x0302, 0x0303), (0x8006, 0x8006), (1, 1, 1, 1))
# texture target → what asks for its binding: 2D, 2D array, 3D, cube, buffer
_TEXTURES = {0x0DE1: 0x8069, 0x8C1A: 0x8C1D, 0x806F: 0x806A, 0x8513: 0x8514, 0x8C2A: 0x8C2C}
_ACTIVE_TEXTURE, _TEXTURE0, _SAMPLER_BINDING = 0x84E0, 0x84C0, 0x8919
_BUFFERS = {  # name → target, what asks for buffer, start, size
    "uniform_buffers": (0x8A11, 0x8A28, 0x8A29, 0x8A2A),
    "shader_storage_buffers": (0x90D2, 0x90D3, 0x90D4, 0x90D5),
}
_IMAGE_QUERIES = (
    0x8F3A,
    0x8F3B,
    0x8F3C,
    0x8F3D,
    0x8F3E,
    0x906E,
)  # name, level, layered, layer, access, format
_NO_IMAGE = (0, 0, 0, 0, 0x88B8, 0x8229)
# state that moderngl itself keeps
_NOTES = (
    "depth_func",
    "front_face",
    "cull_face",
    "wireframe",
    "multisample",
    "polygon_offset",
    "provoking_vertex",
    "depth_clamp_range",
)
_FRAMEBUFFER_NOTES = ("viewport", "color_mask", "depth_mask")


class PreservedState:
    """Reads and writes a context's state; made once per context, since finding the functions takes time."""

    def __init__(self, ctx: moderngl.Context, loader: Callable[..., Callable[..., Any]]) -> None:
        def function(name: str, *kinds: Any, returns: Any = None) -> Callable[..., Any]:
            return loader(name, returns, *kinds)

        self._ctx = ctx

        # one piece of memory that every query writes into
        self._memory = (ctypes.c_double * 8)()
        self._at = ctypes.addressof(self._memory)
        self._ints = (_INT * 16).from_buffer(self._memory)
        self._longs = (ctypes.c_int64 * 8).from_buffer(self._memory)
        self._floats = (_FLOAT * 16).from_buffer(self._memory)
        self._get_i = function("glGetIntegerv", _UINT, ctypes.c_void_p)
        self._get_i_at = function("glGetIntegeri_v", _UINT, _UINT, ctypes.c_void_p)
        self._get_l_at = function("glGetInteger64i_v", _UINT, _UINT, ctypes.c_void_p)
        get_f = function("glGetFloatv", _UINT, ctypes.c_void_p)
        get_d = function("glGetDoublev", _UINT, ctypes.c_void_p)
        self._enabled = function("glIsEnabled", _UINT, returns=_BOOL)
        self._enabled_at = function("glIsEnabledi", _UINT, _UINT, returns=_BOOL)
        self._switch = function("glDisable", _UINT), function("glEnable", _UINT)
        self._switch_at = function("glDisablei", _UINT, _UINT), function("glEnablei", _UINT, _UINT)
        self._blend_func = function("glBlendFuncSeparatei", *(_UINT,) * 5)
        self._blend_equation = function("glBlendEquationSeparatei", *(_UINT,) * 3)
        self._color_mask = function("glColorMaski", _UINT, *(_BOOL,) * 4)
        self._activate = function("glActiveTexture", _UINT)
        self._bind_texture = function("glBindTexture", _UINT, _UINT)
        self._bind_sampler = function("glBindSampler", _UINT, _UINT)
        self._bind_base = function("glBindBufferBase", *(_UINT,) * 3)
        self._bind_range = function("glBindBufferRange", *(_UINT,) * 3, *(ctypes.c_ssize_t,) * 2)
        self._bind_image = function("glBindImageTexture", _UINT, _UINT, _INT, _BOOL, _INT, _UINT, _UINT)
        self._is_texture, self._is_sampler, self._is_buffer = (
            function(name, _UINT, returns=_BOOL) for name in ("glIsTexture", "glIsSampler", "glIsBuffer")
        )
        getters: dict[Any, tuple[Callable[..., Any], Any, int]] = {
            _FLOAT: (get_f, self._floats, 4),
            _DOUBLE: (get_d, self._memory, 8),
        }
        self._values = [
            (
                value,
                *getters.get(value.kinds[0], (self._get_i, self._ints, 4)),
                function(value.setter, *(_UINT,) * len(value.before), *value.kinds),
                function(value.exists, _UINT, returns=_BOOL) if value.exists else None,
            )
            for value in _VALUES
            if not value.needs or value.needs in ctx.extensions
        ]
        # moderngl makes and fills textures on its last unit
        self._units = (*range(16), ctx.default_texture_unit)
        self._targets = min(8, self._integer(0x8824))
        self._slots = {
            "uniform_buffers": min(16, self._integer(0x8A2F)),
            "shader_storage_buffers": min(16, self._integer(0x90DD)),
        }
        self._images = min(8, self._integer(0x8F38))
        self._fresh: State = {value.name: value.fresh for value, *_ in self._values if value.fresh is not None}
        self._fresh |= {name: fresh for name, (_, fresh) in _SWITCHES.items()}
        self._fresh |= {"targets": [_FRESH_TARGET] * self._targets, "samplers": [0] * len(self._units)}

    def read(self) -> State:
        """The state as OpenGL reports it, by name."""
        state: State = {}
        for value, get, cells, width, *_ in self._values:
            count = len(value.kinds)
            for i, query in enumerate(value.queries):
                get(query, self._at + i * width)
            state[value.name] = tuple(cells[:count])
        for name, (switch, _) in _SWITCHES.items():
            state[name] = self._enabled(switch) != 0
        state["targets"] = [self._read_target(i) for i in range(self._targets)]
        state["active_texture"] = self._integer(_ACTIVE_TEXTURE)
        textures, samplers = [], []
        for unit in self._units:
            self._activate(_TEXTURE0 + unit)
            textures.append([self._integer(query) for query in _TEXTURES.values()])
            samplers.append(self._integer(_SAMPLER_BINDING))
        self._activate(state["active_texture"])
        state["textures"], state["samplers"] = textures, samplers
        for name, slots in self._slots.items():
            state[name] = [self._read_buffer(name, slot) for slot in range(slots)]
        state["images"] = [self._read_image(unit) for unit in range(self._images)]
        return state

    def _integer(self, query: int) -> int:
        self._get_i(query, self._at)
        return self._ints[0]

    def _integer_at(self, query: int, index: int) -> int:
        self._get_i_at(query, index, self._at)
        return self._ints[0]

    def _read_target(self, index: int) -> tuple[bool, tuple[int, ...], tuple[int, ...], tuple[int, ...]]:
        blend = [self._integer_at(query, index) for query in _BLEND_QUERIES]
        self._get_i_at(_COLOR_MASK, index, self._at)
        mask = tuple(self._ints[:4])
        return self._enabled_at(_BLEND, index) != 0, tuple(blend[:4]), tuple(blend[4:]), mask

    def _read_buffer(self, name: str, slot: int) -> tuple[int, int, int]:
        _, binding, *extent = _BUFFERS[name]
        buffer = self._integer_at(binding, slot)
        if not buffer:
            return 0, 0, 0
        start, size = (self._long_at(query, slot) for query in extent)
        return buffer, start, size

    def _long_at(self, query: int, index: int) -> int:
        self._get_l_at(query, index, self._at)
        return self._longs[0]

    def _read_image(self, unit: int) -> tuple[int, ...]:
        if not self._integer_at(_IMAGE_QUERIES[0], unit):
            return _NO_IMAGE
        return tuple(self._integer_at(query, unit) for query in _IMAGE_QUERIES)

    def freshen(self, state: State) -> None:
        """Change the given state to one like a new context's, in all that can change how something is drawn."""
        self.write({name: value for name, value in self._fresh.items() if value != state[name]})

    def write(self, state: State) -> None:
        """Make the state so; names left out stay as they are. Objects deleted since are unbound."""
        for name in self._slots:
            for slot, binding in enumerate(state.get(name, ())):
                self._write_buffer(_BUFFERS[name][0], slot, *binding)
        for unit, image in enumerate(state.get("images", ())):
            self._bind_image(unit, *(image if self._is_texture(image[0]) else _NO_IMAGE))
        for unit, sampler in zip(self._units, state.get("samplers", ()), strict=False):
            self._bind_sampler(unit, sampler and sampler * self._is_sampler(sampler))
        for unit, textures in zip(self._units, state.get("textures", ()), strict=False):
            self._activate(_TEXTURE0 + unit)
            for target, texture in zip(_TEXTURES, textures, strict=True):
                self._bind_texture(target, texture and texture * self._is_texture(texture))
        if "active_texture" in state:
            self._activate(state["active_texture"])
        for value, _, _, _, put, exists in self._values:
            if value.name in state:
                now = state[value.name]
                put(*value.before, *((0,) if exists and now[0] and not exists(now[0]) else now))
        for name, (switch, _) in _SWITCHES.items():
            if name in state:
                self._switch[state[name]](switch)
        for index, (blend, factors, equations, mask) in enumerate(state.get("targets", ())):
            self._switch_at[blend](_BLEND, index)
            self._blend_func(index, *factors)
            self._blend_equation(index, *equations)
            self._color_mask(index, *mask)

    def _write_buffer(self, target: int, slot: int, buffer: int, start: int, size: int) -> None:
        if not (buffer and self._is_buffer(buffer)):
            self._bind_base(target, slot, 0)
        elif size:
            self._bind_range(target, slot, buffer, start, size)
        else:
            self._bind_base(target, slot, buffer)

    def snapshot(self) -> State:
        """All that `preserved` preserves, by name; equal dictionaries mean equal state."""
        return self.read() | {"moderngl": _read_notes(self._ctx, ())}

    @contextmanager
    def preserved(
        self, framebuffers: tuple[moderngl.Framebuffer, ...] = (), *, write_back: bool = True
    ) -> Iterator[None]:
        """Start from the state of a new context; afterwards everything is as the host had it, errors or not.

        Without `write_back` only what moderngl does not set itself starts fresh, and stays as it is left.
        """
        if not write_back:
            self.write(self._fresh)
            self._ctx.mglo.enable_only(moderngl.NOTHING)
            yield
            return
        state, notes = self.read(), _read_notes(self._ctx, framebuffers)
        try:
            self.freshen(state)
            self._ctx.mglo.enable_only(moderngl.NOTHING)
            yield
        finally:
            _write_notes(self._ctx, notes, state)
            self.write(state)


def _read_notes(ctx: moderngl.Context, framebuffers: tuple[moderngl.Framebuffer, ...]) -> State:
    bound = ctx.mglo.fbo
    return {
        "fbo": ctx.fbo,
        "bound": bound,
        "scissor": bound.scissor,
        "context": {name: getattr(ctx.mglo, name) for name in _NOTES},
        "framebuffers": [
            (each, {name: getattr(each, name) for name in _FRAMEBUFFER_NOTES})
            for each in (bound, *(framebuffer.mglo for framebuffer in framebuffers))
        ],
    }


def _write_notes(ctx: moderngl.Context, notes: State, state: State) -> None:
    """Most setters also call OpenGL, so this comes before the state itself."""
    ctx.fbo = notes["fbo"]
    ctx.mglo.fbo = bound = notes["bound"]
    if bound.scissor != notes["scissor"]:
        bound.scissor = notes["scissor"] if state["scissor_test"] else None
    for owner, saved in ((ctx.mglo, notes["context"]), *notes["framebuffers"]):
        for name, value in saved.items():
            if getattr(owner, name) != value:
                setattr(owner, name, value)
    flags = {
        moderngl.BLEND: state["targets"][0][0],
        moderngl.DEPTH_TEST: state["depth_test"],
        moderngl.CULL_FACE: state["cull_face"],
        moderngl.RASTERIZER_DISCARD: state["rasterizer_discard"],
        moderngl.PROGRAM_POINT_SIZE: state["program_point_size"],
    }
    ctx.mglo.enable_only(sum(flag for flag, enabled in flags.items() if enabled))
