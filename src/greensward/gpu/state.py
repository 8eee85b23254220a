"""Preserve the OpenGL state of a host's context, and moderngl's own notes about it, while greensward draws in it.

Left alone, because nothing here changes them: viewports beyond the first, stencil functions, transform feedback, the
draw and read buffers of framebuffers, and what is bound where kernels bind nothing: textures of other kinds than 2D
and 2D arrays, and units, blocks and images beyond those that kernels use.
"""

import ctypes
import struct
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.limits import MOST_IMAGES, MOST_STORAGE_BLOCKS, MOST_TEXTURES, MOST_UNIFORM_BLOCKS

_UINT, _INT, _BOOL, _FLOAT, _DOUBLE = (
    ctypes.c_uint,
    ctypes.c_int,
    ctypes.c_ubyte,
    ctypes.c_float,
    ctypes.c_double,
)
_CODES = {_UINT: "I", _INT: "i", _BOOL: "i", _FLOAT: "f", _DOUBLE: "d"}
"""Types in which the driver answers: booleans as integers."""


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
        _Value(name, (query,), "glPixelStorei", (_INT,), fresh, (query,))
        for name, query, fresh in (
            ("unpack_alignment", 0x0CF5, None),  # moderngl sets both whenever it needs them
            ("unpack_row_length", 0x0CF2, (0,)),
            ("unpack_skip_rows", 0x0CF3, (0,)),
            ("unpack_skip_pixels", 0x0CF4, (0,)),
            ("unpack_image_height", 0x806E, (0,)),
            ("unpack_skip_images", 0x806D, (0,)),
            ("pack_alignment", 0x0D05, None),
            ("pack_row_length", 0x0D02, (0,)),
            ("pack_skip_rows", 0x0D03, (0,)),
            ("pack_skip_pixels", 0x0D04, (0,)),
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
    "sample_mask": (0x8E51, False),
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
_TARGETS = 8  # draw buffers
_TEXTURES = {"2d": (0x0DE1, 0x8069), "2d_array": (0x8C1A, 0x8C1D)}  # target, and what asks for its binding
_ACTIVE_TEXTURE, _TEXTURE0, _SAMPLER_BINDING = 0x84E0, 0x84C0, 0x8919
_BUFFERS = {  # name → number of slots, target, what asks for buffer, start, size
    "uniform_buffer": (MOST_UNIFORM_BLOCKS, 0x8A11, 0x8A28, 0x8A29, 0x8A2A),
    "shader_storage_buffer": (MOST_STORAGE_BLOCKS, 0x90D2, 0x90D3, 0x90D4, 0x90D5),
}
_IMAGE_QUERIES = (0x8F3A, 0x8F3B, 0x8F3C, 0x8F3D, 0x8F3E, 0x906E)  # name, level, layered, layer, access, format
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
_FLAGS = {
    "blend0": moderngl.BLEND,
    "depth_test": moderngl.DEPTH_TEST,
    "cull_face": moderngl.CULL_FACE,
    "rasterizer_discard": moderngl.RASTERIZER_DISCARD,
    "program_point_size": moderngl.PROGRAM_POINT_SIZE,
}
_FRAMEBUFFER_NOTES = ("viewport", "color_mask", "depth_mask")


_Words = npt.NDArray[np.uint32]


class _Entry:
    """Part of the state: where it is kept in memory, and what writes it."""

    def __init__(
        self,
        name: str,
        offset: int,
        code: str,
        write: Callable[..., Any],
        fresh: Sequence[float] | None = None,
    ) -> None:
        self.name, self.offset, self.write = name, offset, write
        self.struct = struct.Struct("=" + code)
        self.end = offset + self.struct.size
        self.fresh = None if fresh is None else self.struct.pack(*fresh)

    def value(self, memory: _Words) -> tuple[float, ...]:
        """Return what it was when the memory was filled."""
        return self.struct.unpack_from(memory.data, self.offset)


_Calls = list[tuple[Callable[..., Any], tuple[Sequence[Any], ...]]]


class PreservedState:
    """Reads and writes a context's state; made once per context, since finding the functions takes time.

    All of it is read into one piece of memory by `map`, which calls the driver without a step of Python's own
    between; afterwards it is read again, and only what differs is written.
    """

    def __init__(self, ctx: moderngl.Context, loader: Callable[..., Callable[..., Any]]) -> None:
        self._ctx, self._loader = ctx, loader
        room: _Words = np.zeros(512, np.uint32)
        self._start = room.ctypes.data
        self._used = 0
        self._entries: list[_Entry] = []
        self._calls: _Calls = []
        self._switches: Sequence[Any] = ()
        self._get_i_at = self._function("glGetIntegeri_v", _UINT, _UINT, ctypes.c_void_p)
        self._get_l_at = self._function("glGetInteger64i_v", _UINT, _UINT, ctypes.c_void_p)
        self._activate = self._function("glActiveTexture", _UINT)
        # in the order of writing: a binding before what it decides
        self._add_slots()
        self._add_textures()
        self._add_values()
        self._add_switches()
        self._add_targets()
        self._entry = {entry.name: entry for entry in self._entries}
        words = self._used // 4
        self._fresh, self._is_fresh = np.zeros(words, np.uint32), np.zeros(words, np.bool_)
        self._entry_of = np.full(words, -1)
        for number, entry in enumerate(self._entries):
            span = slice(entry.offset // 4, entry.end // 4)
            self._entry_of[span] = number
            if entry.fresh is not None:
                self._fresh[span], self._is_fresh[span] = np.frombuffer(entry.fresh, np.uint32), True

        self._words = room[:words]
        self._slot_words = np.array([offset // 4 for offset, *_ in self._bindings])
        self._calls = [(call, _converted(call, lists)) for call, lists in self._calls]
        self._blends = _converted(self._enabled_at, ([_BLEND] * _TARGETS, range(_TARGETS)))
        (self._switches,) = _converted(self._enabled, (self._switches,))

    def _function(self, name: str, *kinds: Any, returns: Any = None) -> Callable[..., Any]:
        return self._loader(name, returns, *kinds)

    def _reserve(self, code: str) -> tuple[int, int]:
        """Offset in the memory and address of room for an answer."""
        offset = self._used
        self._used += struct.calcsize("=" + code)
        return offset, self._start + offset

    # What there is -----------------------------------------------------------------------------------------

    def _add_values(self) -> None:
        names = {_FLOAT: "glGetFloatv", _DOUBLE: "glGetDoublev"}
        calls: dict[str, tuple[list[int], list[int]]] = {}
        for value in _VALUES:
            if value.needs and value.needs not in self._ctx.extensions:
                continue
            code = "".join(_CODES[kind] for kind in value.kinds)
            offset, address = self._reserve(code)
            if value.name == "polygon_mode":
                self._reserve(code)  # some drivers answer for front and back
            queries, addresses = calls.setdefault(names.get(value.kinds[0], "glGetIntegerv"), ([], []))
            queries.extend(value.queries)
            step = struct.calcsize("=" + code) // len(value.queries)
            addresses.extend(address + i * step for i in range(len(value.queries)))
            put = self._function(value.setter, *(_UINT,) * len(value.before), *value.kinds)
            exists = self._function(value.exists, _UINT, returns=_BOOL) if value.exists else None
            self._entries.append(_Entry(value.name, offset, code, _writer(put, value.before, exists), value.fresh))
        for name, asked in calls.items():
            self._calls.append((self._function(name, _UINT, ctypes.c_void_p), asked))

    def _add_switches(self) -> None:
        self._enabled = self._function("glIsEnabled", _UINT, returns=_BOOL)
        self._enabled_at = self._function("glIsEnabledi", _UINT, _UINT, returns=_BOOL)
        switch = self._function("glDisable", _UINT), self._function("glEnable", _UINT)
        self._switches = [number for number, _ in _SWITCHES.values()]
        self._switch_offset = self._used
        for name, (number, fresh) in _SWITCHES.items():
            offset, _ = self._reserve("i")
            self._entries.append(_Entry(name, offset, "i", _switcher(switch, number), (int(fresh),)))

    def _add_targets(self) -> None:
        switch_at = self._function("glDisablei", _UINT, _UINT), self._function("glEnablei", _UINT, _UINT)
        factors = self._function("glBlendFuncSeparatei", *(_UINT,) * 5)
        equations = self._function("glBlendEquationSeparatei", *(_UINT,) * 3)
        mask = self._function("glColorMaski", _UINT, *(_BOOL,) * 4)
        queries: list[int] = []
        indices: list[int] = []
        addresses: list[int] = []
        for index in range(_TARGETS):
            offset, _ = self._reserve("i")
            self._entries.append(_Entry(f"blend{index}", offset, "i", _switcher_at(switch_at, _BLEND, index), (0,)))
        self._switch_words = slice(self._switch_offset // 4, self._used // 4)
        for index in range(_TARGETS):
            for name, code, put, asked in (
                ("blend_factors", "4i", factors, _BLEND_QUERIES[:4]),
                ("blend_equations", "2i", equations, _BLEND_QUERIES[4:]),
                ("color_mask", "4i", mask, (_COLOR_MASK,)),
            ):
                if index and name != "color_mask":
                    continue  # blending is into the first alone
                offset, address = self._reserve(code)
                fresh = (1, 1, 1, 1) if name == "color_mask" else None
                self._entries.append(_Entry(f"{name}{index}", offset, code, _writer(put, (index,)), fresh))
                queries.extend(asked)
                indices.extend([index] * len(asked))
                addresses.extend(address + 4 * i for i in range(len(asked)))
        self._calls.append((self._get_i_at, (queries, indices, addresses)))

    def _add_textures(self) -> None:
        get = self._function("glGetIntegerv", _UINT, ctypes.c_void_p)
        bind, sampler = self._function("glBindTexture", _UINT, _UINT), self._function("glBindSampler", _UINT, _UINT)
        is_texture, is_sampler = (
            self._function(name, _UINT, returns=_BOOL) for name in ("glIsTexture", "glIsSampler")
        )
        # moderngl makes and fills textures on its last unit
        self._units: list[tuple[int, list[int], list[int]]] = []
        self._get_i = get
        offset, self._active_at = self._reserve("I")
        active_offset = offset
        queries = [*(query for _, query in _TEXTURES.values()), _SAMPLER_BINDING]
        all_units = (*range(MOST_TEXTURES), self._ctx.default_texture_unit)
        everywhere: list[int] = []
        for unit in all_units:
            addresses = []
            for name, (target, _) in _TEXTURES.items():
                offset, address = self._reserve("I")
                addresses.append(address)
                self._entries.append(
                    _Entry(f"bound_{name}{unit}", offset, "I", self._binder(bind, unit, target, is_texture))
                )
            offset, address = self._reserve("I")
            self._entries.append(_Entry(f"sampler{unit}", offset, "I", _writer(sampler, (unit,), is_sampler), (0,)))
            addresses.append(address)
            everywhere.extend(addresses)
            self._units.append((_TEXTURE0 + unit, queries, addresses))
        if self._tells_units():
            self._units.clear()
            numbers = [unit for unit in all_units for _ in queries]
            self._calls.append((self._get_i_at, (queries * len(all_units), numbers, everywhere)))
        self._entries.append(_Entry("active_texture", active_offset, "I", self._activate))

    def _tells_units(self) -> bool:
        """Return whether the driver tells what is bound to a unit that is not active, as many do."""
        if self._ctx.version_code < 450 or self._ctx.error != "GL_NO_ERROR":
            return False
        texture = self._ctx.texture((1, 1), 1)
        texture.use(1)
        self._activate(_TEXTURE0)
        cell = ctypes.c_uint()
        self._get_i_at(_TEXTURES["2d"][1], 1, ctypes.addressof(cell))
        told = self._ctx.error == "GL_NO_ERROR" and cell.value == texture.glo
        texture.release()
        return told

    def _binder(
        self, bind: Callable[..., Any], unit: int, target: int, exists: Callable[..., Any]
    ) -> Callable[..., None]:
        def write(texture: int) -> None:
            self._activate(_TEXTURE0 + unit)
            bind(target, texture if texture and exists(texture) else 0)

        return write

    def _add_slots(self) -> None:
        """Bindings by number: buffers with their extent, and images."""
        base = self._function("glBindBufferBase", *(_UINT,) * 3)
        part = self._function("glBindBufferRange", *(_UINT,) * 3, *(ctypes.c_ssize_t,) * 2)
        image = self._function("glBindImageTexture", _UINT, _UINT, _INT, _BOOL, _INT, _UINT, _UINT)
        is_buffer, is_texture = (self._function(name, _UINT, returns=_BOOL) for name in ("glIsBuffer", "glIsTexture"))
        self._bindings: list[tuple[int, int, tuple[int, ...], Callable[..., Any]]] = []
        queries: list[int] = []
        indices: list[int] = []
        addresses: list[int] = []
        slots_offset = self._used
        for name, (count, target, binding, *extent) in _BUFFERS.items():
            for slot in range(count):
                offset, address = self._reserve("3q")
                write = _buffer_writer(base, part, is_buffer, target, slot)
                self._entries.append(_Entry(f"{name}{slot}", offset, "3q", write))
                self._bindings.append((offset, slot, tuple(extent), self._get_l_at))
                queries.append(binding)
                indices.append(slot)
                addresses.append(address)
        for unit in range(MOST_IMAGES):
            offset, address = self._reserve("6i")
            self._entries.append(_Entry(f"image{unit}", offset, "6i", _image_writer(image, is_texture, unit)))
            self._bindings.append((offset, unit, _IMAGE_QUERIES[1:], self._get_i_at))
            queries.append(_IMAGE_QUERIES[0])
            indices.append(unit)
            addresses.append(address)
        self._slots = slice(slots_offset // 4, self._used // 4)
        self._calls.append((self._get_i_at, (queries, indices, addresses)))

    # Reading and writing -----------------------------------------------------------------------------------

    def _read(self) -> _Words:
        words, start = self._words, self._start
        words[self._slots] = 0
        for call, arguments in self._calls:
            deque(map(call, *arguments), maxlen=0)
        words[self._switch_words] = [*map(self._enabled, self._switches), *map(self._enabled_at, *self._blends)]
        for number in words[self._slot_words].nonzero()[0].tolist():
            offset, slot, queries, get = self._bindings[number]
            width = 8 if get is self._get_l_at else 4
            for i, query in enumerate(queries, 1):
                get(query, slot, start + offset + i * width)
        self._get_i(_ACTIVE_TEXTURE, self._active_at)
        if self._units:
            active = ctypes.c_uint.from_address(self._active_at).value
            for unit, asked, addresses in self._units:
                self._activate(unit)
                deque(map(self._get_i, asked, addresses), maxlen=0)
            self._activate(active)
        return words.copy()

    def _write_entries(self, which: Any, wanted: _Words) -> None:
        moved = False
        # less than 0: the second answer of what is told twice
        for number in sorted({number for number in self._entry_of[which].tolist() if number >= 0}):
            entry = self._entries[number]
            entry.write(*entry.value(wanted))
            moved = moved or entry.name.startswith("bound_")
        if moved:
            self._activate(int(wanted[(self._active_at - self._start) // 4]))

    def _freshen(self, now: _Words) -> None:
        """Change the state, as it is now, to one like a new context's in all that changes how something is drawn."""
        stale = (now != self._fresh) & self._is_fresh
        if stale.any():
            self._write_entries(stale, self._fresh)

    def snapshot(self) -> dict[str, Any]:
        """Read all that `preserved` preserves, by name; equal dictionaries mean equal state."""
        memory = self._read()
        state: dict[str, Any] = {entry.name: entry.value(memory) for entry in self._entries}
        return state | {"moderngl": _read_notes(self._ctx, ())}

    @contextmanager
    def preserved(
        self, framebuffers: tuple[moderngl.Framebuffer, ...] = (), *, write_back: bool = True
    ) -> Iterator[None]:
        """Start from the state of a new context; afterwards everything is as the host had it, errors or not.

        Objects deleted meanwhile are unbound. Without `write_back` only what moderngl does not set itself starts
        fresh, and stays as it is left.
        """
        if not write_back:
            self._write_entries(self._is_fresh, self._fresh)
            self._ctx.mglo.enable_only(moderngl.NOTHING)
            yield
            return
        before, notes = self._read(), _read_notes(self._ctx, framebuffers)
        try:
            self._freshen(before)
            self._ctx.mglo.enable_only(moderngl.NOTHING)
            yield
        finally:
            _write_notes(self._ctx, notes, lambda name: self._entry[name].value(before)[0] != 0)
            self._write_entries(before != self._read(), before)


def _converted(call: Any, lists: Sequence[Sequence[Any]]) -> tuple[Sequence[Any], ...]:
    """The arguments of many calls as the function takes them, so that none is converted again."""
    return tuple([kind(value) for value in values] for kind, values in zip(call.argtypes, lists, strict=True))


def _writer(
    put: Callable[..., Any], first: tuple[int, ...], exists: Callable[..., Any] | None = None
) -> Callable[..., None]:
    if exists is None:
        return lambda *values: put(*first, *values)
    return lambda name: put(*first, name if name and exists(name) else 0)


def _switcher(switch: tuple[Callable[..., Any], Callable[..., Any]], number: int) -> Callable[..., None]:
    return lambda enabled: switch[enabled](number)


def _switcher_at(
    switch: tuple[Callable[..., Any], Callable[..., Any]], number: int, index: int
) -> Callable[..., None]:
    return lambda enabled: switch[enabled](number, index)


def _buffer_writer(
    base: Callable[..., Any], part: Callable[..., Any], exists: Callable[..., Any], target: int, slot: int
) -> Callable[..., None]:
    def write(buffer: int, start: int, size: int) -> None:
        if not (buffer and exists(buffer)):
            base(target, slot, 0)
        elif size:
            part(target, slot, buffer, start, size)
        else:
            base(target, slot, buffer)

    return write


def _image_writer(put: Callable[..., Any], exists: Callable[..., Any], unit: int) -> Callable[..., None]:
    return lambda *image: put(unit, *(image if image[0] and exists(image[0]) else _NO_IMAGE))


_noted, _noted_of_framebuffer = attrgetter(*_NOTES), attrgetter(*_FRAMEBUFFER_NOTES)


def _note(owner: Any, names: Sequence[str], now: Sequence[Any], saved: Sequence[Any]) -> None:
    for name, value, before in zip(names, now, saved, strict=True):
        if value != before:
            setattr(owner, name, before)


def _read_notes(ctx: moderngl.Context, framebuffers: tuple[moderngl.Framebuffer, ...]) -> dict[str, Any]:
    bound = ctx.mglo.fbo
    return {
        "fbo": ctx.fbo,
        "bound": bound,
        "scissor": bound.scissor,
        "context": _noted(ctx.mglo),
        "framebuffers": [
            (each, _noted_of_framebuffer(each))
            for each in (bound, *(framebuffer.mglo for framebuffer in framebuffers))
        ],
    }


def _write_notes(ctx: moderngl.Context, notes: dict[str, Any], was_on: Callable[[str], bool]) -> None:
    """Most setters also call OpenGL, so this comes before the state itself."""
    ctx.fbo = notes["fbo"]
    ctx.mglo.fbo = bound = notes["bound"]
    if bound.scissor != notes["scissor"]:
        bound.scissor = notes["scissor"] if was_on("scissor_test") else None
    if (now := _noted(ctx.mglo)) != notes["context"]:
        _note(ctx.mglo, _NOTES, now, notes["context"])
    for each, saved in notes["framebuffers"]:
        if (now := _noted_of_framebuffer(each)) != saved:
            _note(each, _FRAMEBUFFER_NOTES, now, saved)
    ctx.mglo.enable_only(sum(flag for name, flag in _FLAGS.items() if was_on(name)))
