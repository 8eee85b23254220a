"""Frame statistics: draw calls, dispatches, vertices, primitives, and GPU memory."""

import ctypes
import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps
from typing import Any

import moderngl

from greensward.gpu.device import Device

_VERTICES_SUBMITTED, _TESSELLATED, _LEFT_BY_CLIPPING, _PRIMITIVES_GENERATED = 0x82EE, 0x82F2, 0x82F7, 0x8C87
_RESULT = 0x8866
_STATISTICS = "GL_ARB_pipeline_statistics_query"
_ITEM_BYTES = {"f1": 1, "f2": 2, "f4": 4, "u1": 1, "u2": 2, "u4": 4, "i1": 1, "i2": 2, "i4": 4, "nu1": 1, "nu2": 2}
_KINDS = (
    moderngl.Buffer,
    moderngl.Texture,
    moderngl.TextureArray,
    moderngl.Texture3D,
    moderngl.TextureCube,
    moderngl.Renderbuffer,
)


@dataclass
class FrameStatistics:
    """Counts of one frame."""

    draw_calls: int = 0
    dispatches: int = 0
    vertices: int | None = None
    """Vertices submitted to draw calls or made by tessellation; None where the driver does not count them."""
    primitives: int = 0
    """Primitives passed to the rasteriser. Blades that compute shaders fill are none."""
    primitives_in_view: int = 0
    """Primitives left by clipping; all of them where the driver does not count them."""


@contextmanager
def counted(device: Device) -> Iterator[FrameStatistics]:
    """Count what is drawn inside; complete at the end."""
    frame = FrameStatistics()
    queries = _PipelineQueries(device)
    with _calls(frame):
        queries.begin()
        try:
            yield frame
        finally:
            counts = queries.end()
    frame.primitives = counts[_PRIMITIVES_GENERATED]
    frame.primitives_in_view = min(counts.get(_LEFT_BY_CLIPPING, frame.primitives), frame.primitives)
    if _VERTICES_SUBMITTED in counts:
        frame.vertices = counts[_VERTICES_SUBMITTED] + counts[_TESSELLATED]


@contextmanager
def _calls(frame: FrameStatistics) -> Iterator[None]:
    """Count calls by wrapping them meanwhile, as moderngl has no hook for them."""

    def counting(kind: type, name: str, of: str) -> Callable[..., Any]:
        original = getattr(kind, name)

        @wraps(original)
        def call(*arguments: Any, **options: Any) -> Any:
            setattr(frame, of, getattr(frame, of) + 1)
            return original(*arguments, **options)

        setattr(kind, name, call)
        return lambda: setattr(kind, name, original)

    undo = [counting(moderngl.VertexArray, name, "draw_calls") for name in ("render", "render_indirect")]
    undo += [counting(moderngl.ComputeShader, name, "dispatches") for name in ("run", "run_indirect")]
    try:
        yield
    finally:
        for each in undo:
            each()


class _PipelineQueries:
    """Pipeline statistics queries, which moderngl lacks."""

    def __init__(self, device: Device) -> None:
        unsigned, pointer = ctypes.c_uint, ctypes.c_void_p
        self._make = device.function("glGenQueries", None, ctypes.c_int, pointer)
        self._begin = device.function("glBeginQuery", None, unsigned, unsigned)
        self._end = device.function("glEndQuery", None, unsigned)
        self._get = device.function("glGetQueryObjectui64v", None, unsigned, unsigned, pointer)
        self._delete = device.function("glDeleteQueries", None, ctypes.c_int, pointer)
        more = (_VERTICES_SUBMITTED, _TESSELLATED, _LEFT_BY_CLIPPING) if _STATISTICS in device.ctx.extensions else ()
        self._targets = (_PRIMITIVES_GENERATED, *more)

    def begin(self) -> None:
        self._names = (ctypes.c_uint * len(self._targets))()
        self._make(len(self._targets), self._names)
        for target, name in zip(self._targets, self._names, strict=True):
            self._begin(target, name)

    def end(self) -> dict[int, int]:
        for target in self._targets:
            self._end(target)
        counts = {}
        for target, name in zip(self._targets, self._names, strict=True):
            value = ctypes.c_uint64()
            self._get(name, _RESULT, ctypes.byref(value))
            counts[target] = value.value
        self._delete(len(self._targets), self._names)
        return counts


def gpu_bytes(ctx: moderngl.Context) -> int:
    """Bytes of every buffer, texture and renderbuffer of a context that is still there."""
    return sum(
        _bytes(each)
        for each in gc.get_objects()
        if isinstance(each, _KINDS) and each.ctx is ctx and not isinstance(each.mglo, moderngl.InvalidObject)
    )


def _bytes(each: Any) -> int:
    if isinstance(each, moderngl.Buffer):
        return each.size
    texels = 6 if isinstance(each, moderngl.TextureCube) else 1
    for edge in each.size:
        texels *= edge
    samples = max(getattr(each, "samples", 0), 1)
    item = 4 if getattr(each, "depth", False) is True else _ITEM_BYTES.get(each.dtype, 4) * each.components
    return texels * item * samples
