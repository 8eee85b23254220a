"""An OpenGL context with its limits, features, entry points and program pool: what every GPU resource is made on."""

import atexit
import ctypes
import gc
import os
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, Protocol

import moderngl

from greensward.gpu.adapters import (
    DEVICE_VARIABLE,
    driver_name,
    is_software,
    note_context,
    open_context,
    refuse_after_fork,
)
from greensward.gpu.current import context_kept, current_context
from greensward.gpu.programs import ProgramPool
from greensward.gpu.state import PreservedState
from greensward.scene.errors import GreenswardError, InputError

Stage = Literal["fragment", "compute"]
"""Shader stage that full-screen passes run in."""

IMAGES_WRITTEN = (
    moderngl.TEXTURE_FETCH_BARRIER_BIT
    | moderngl.SHADER_IMAGE_ACCESS_BARRIER_BIT
    | moderngl.FRAMEBUFFER_BARRIER_BIT
    | moderngl.TEXTURE_UPDATE_BARRIER_BIT
)
"""Barrier after a compute shader wrote images that anything may read."""
STORAGE_WRITTEN = moderngl.SHADER_STORAGE_BARRIER_BIT | moderngl.BUFFER_UPDATE_BARRIER_BIT
"""Barrier after a shader wrote buffers that shaders read or that are filled anew."""
COMMANDS_WRITTEN = STORAGE_WRITTEN | moderngl.COMMAND_BARRIER_BIT
"""Barrier after a compute shader wrote arguments of indirect draws and dispatches."""

_DRAW_FRAMEBUFFER_BINDING, _VIEWPORT, _DEPTH_RANGE = 0x8CA6, 0x0BA2, 0x0B70
_CLIP_DEPTH_MODE, _ZERO_TO_ONE = 0x935D, 0x935F
_TIME_ELAPSED, _QUERY_COUNTER_BITS = 0x88BF, 0x8864
_STAGE_BLOCKS = {  # storage blocks of a stage
    "vertex": 0x90D6,
    "tess_control": 0x90D8,
    "tess_evaluation": 0x90D9,
    "geometry": 0x90D7,
    "fragment": 0x90DA,
    "compute": 0x90DB,
}


class Releasable(Protocol):
    """GPU resource."""

    def release(self) -> None:
        """Free it."""


@dataclass(frozen=True)
class Limits:
    """Limits of the driver."""

    storage_block_bytes: int
    texture_px: int
    picture_px: int
    """Edge of the largest picture."""
    storage_blocks: dict[str, int]
    """Storage blocks by shader stage: vertex, tess_control, tess_evaluation, geometry, fragment, compute."""


@dataclass(frozen=True)
class Features:
    """Abilities beyond OpenGL 4.3; each has a fallback."""

    clip_control: bool
    """The range of clip space can be chosen, for reversed depth."""
    timer_queries: bool
    """Timer queries measure work; on software drivers they miss most of it."""
    wide_atomics: bool
    """Shaders can take the larger of two 64-bit numbers atomically."""


class Device:
    """An OpenGL 4.3 context and what has been asked of it and compiled for it once.

    Renderers on one device share its programs. `Device("auto")`, `Device("cpu")` or `Device("0")` opens a headless
    context, which is current afterwards; `Device.of(ctx)` takes that of a host program. Raises `InputError` for a
    device that does not exist and `GreenswardError`, with the fix, for a driver that lacks something.
    """

    def __init__(
        self, adapter: str = "auto", *, ctx: moderngl.Context | None = None, preserve_state: bool = True
    ) -> None:
        self.headless = ctx is None
        """The context is the device's own."""
        self.ctx: moderngl.Context = open_context(adapter) if ctx is None else ctx
        note_context()
        self._process, self._thread = os.getpid(), threading.get_ident()
        self._handle = current_context().handle
        self._forgotten: list[Sequence[Releasable]] = []
        self.preserves_state = preserve_state and not self.headless
        """The host's OpenGL state is read before and written back after each call."""
        if self.ctx.version_code < 430:
            raise InputError(f"ctx: must be OpenGL 4.3 or newer (got {self.ctx.version_code / 100:.1f})")
        self._functions: dict[tuple[Any, ...], Callable[..., Any]] = {}
        self.name = driver_name(self.ctx)
        self.software = is_software(self.ctx)
        self.best_stage: Stage = "fragment" if self.software else "compute"
        """Faster stage for full-screen passes on this kind of driver.

        A compute shader is an order of magnitude faster on GPUs with few raster units; on software drivers the
        fragment shader is the faster one.
        """
        info = self.ctx.info
        self.limits = Limits(
            info["GL_MAX_SHADER_STORAGE_BLOCK_SIZE"],
            info["GL_MAX_TEXTURE_SIZE"],
            min(*info["GL_MAX_VIEWPORT_DIMS"], info["GL_MAX_TEXTURE_SIZE"]),
            {stage: self._integer(query) for stage, query in _STAGE_BLOCKS.items()},
        )
        extensions = self.ctx.extensions
        self.features = Features(
            clip_control="GL_ARB_clip_control" in extensions,
            timer_queries=not self.software and self._timer_bits() > 0,
            wide_atomics={"GL_NV_gpu_shader5", "GL_NV_shader_atomic_int64"} <= extensions,
        )
        self.programs = ProgramPool(self.ctx, self.function)
        self.units: list[object] = [None] * 64
        """Texture that kernels bound to each unit last, so that none is bound twice."""

    @classmethod
    def of(cls, ctx: moderngl.Context, *, preserve_state: bool = True) -> "Device":
        """The device of a host's context: the same one each time, as long as the context lives.

        Its OpenGL state is preserved around every call unless `preserve_state` is false, for a host that sets all
        the state that it draws with.
        """
        devices: dict[bool, Device] = ctx.__dict__.setdefault("_greensward", {})
        if preserve_state not in devices:
            refuse_after_fork()
            devices[preserve_state] = cls(ctx=ctx, preserve_state=preserve_state)
        return devices[preserve_state]

    @classmethod
    def shared(cls, adapter: str = "auto") -> "Device":
        """The headless device of this thread that renderers share which are not given one."""
        if adapter == "auto":
            adapter = os.environ.get(DEVICE_VARIABLE) or "auto"
        key = os.getpid(), threading.get_ident(), adapter
        if key not in _SHARED:
            _SHARED[key] = cls(adapter)
        device = _SHARED[key]
        device.make_current()
        return device

    def function(self, name: str, result: Any, *arguments: Any) -> Callable[..., Any]:
        """An OpenGL function that moderngl does not offer, with ctypes types. Call it while the context is current.

        A name that the driver does not know may still resolve, to a stub: ask the context's extensions first.
        """
        key = name, result, arguments
        if key not in self._functions:
            address = self.ctx.mglo._context.load_opengl_function(name)
            if not address:
                raise GreenswardError(f"the OpenGL driver lacks {name}: update the graphics driver")
            prototype = getattr(ctypes, "WINFUNCTYPE", ctypes.CFUNCTYPE)
            self._functions[key] = prototype(result, *arguments)(address)
        return self._functions[key]

    def _integer(self, query: int) -> int:
        value = ctypes.c_int()
        self.function("glGetIntegerv", None, ctypes.c_uint, ctypes.c_void_p)(query, ctypes.byref(value))
        return value.value

    def _timer_bits(self) -> int:
        bits = ctypes.c_int()
        get = self.function("glGetQueryiv", None, ctypes.c_uint, ctypes.c_uint, ctypes.c_void_p)
        get(_TIME_ELAPSED, _QUERY_COUNTER_BITS, ctypes.byref(bits))
        return bits.value

    @cached_property
    def state(self) -> PreservedState:
        """Reads and writes the context's OpenGL state."""
        return PreservedState(self.ctx, self.function)

    def make_current(self) -> None:
        """Make a headless context current, as another one may be."""
        if self.headless:
            self._refuse_elsewhere()
            now = current_context()
            if now.handle is None or now.handle != self._handle:
                now.leave()
                self.ctx.__enter__()  # type: ignore[no-untyped-call]

    def _refuse_elsewhere(self) -> None:
        """Raise `GreenswardError` in another process or thread, or where the host's context is not current."""
        if os.getpid() != self._process:
            refuse_after_fork()
        if self.headless:
            if threading.get_ident() != self._thread:
                raise GreenswardError(
                    "a renderer is used in the thread that made it: OpenGL draws in one thread at a time; "
                    "make one for each thread"
                )
        elif self._handle is not None and current_context().handle != self._handle:
            raise GreenswardError(
                "the OpenGL context that the renderer was made with is not current in this thread: "
                "make it current before each call"
            )

    def forget(self, parts: Sequence[Releasable]) -> None:
        """Free GPU resources, last first, when the context is used next; from any thread, at any time."""
        self._forgotten.append(parts)

    def _free_forgotten(self) -> None:
        while self._forgotten:
            for part in reversed(self._forgotten.pop()):
                part.release()

    @contextmanager
    def use(self, *framebuffers: moderngl.Framebuffer) -> Iterator[None]:
        """Draw inside: a headless context is made current, a host's gets its state back afterwards.

        moderngl keeps viewport and masks per framebuffer: name those that will be drawn into besides the bound
        one.
        """
        self._refuse_elsewhere()
        self.units = [None] * len(self.units)
        if not self.headless:
            try:
                with self.state.preserved(framebuffers, write_back=self.preserves_state):
                    self._free_forgotten()
                    yield
            finally:
                self.units = [None] * len(self.units)
            return
        with context_kept():
            self.make_current()
            bound = self.ctx.fbo
            try:
                self._free_forgotten()
                yield
            finally:
                self.bind_again(bound)

    def drawing_into(
        self, framebuffer: moderngl.Framebuffer
    ) -> tuple[tuple[int, int, int, int], bool, tuple[float, float]]:
        """The viewport of a host's framebuffer, whether clip z is 0 to 1, and the depth range.

        OpenGL has one viewport; moderngl sets each framebuffer's when that is bound.
        """
        self._refuse_elsewhere()
        get, get_doubles = (
            self.function(name, None, ctypes.c_uint, ctypes.c_void_p) for name in ("glGetIntegerv", "glGetDoublev")
        )
        integers, doubles = (ctypes.c_int * 4)(), (ctypes.c_double * 2)()
        get(_DRAW_FRAMEBUFFER_BINDING, ctypes.addressof(integers))
        viewport = framebuffer.viewport
        if integers[0] == framebuffer.glo:
            get(_VIEWPORT, ctypes.addressof(integers))
            viewport = integers[0], integers[1], integers[2], integers[3]
        zero_to_one = False
        if self.features.clip_control:
            get(_CLIP_DEPTH_MODE, ctypes.addressof(integers))
            zero_to_one = integers[0] == _ZERO_TO_ONE
        get_doubles(_DEPTH_RANGE, ctypes.addressof(doubles))
        return viewport, zero_to_one, (doubles[0], doubles[1])

    def free_dropped(self, error: BaseException) -> None:
        """Free what constructors had made when this error left them: nobody holds it but the error's own frames."""
        self.units = [None] * len(self.units)
        mode, self.ctx.gc_mode = self.ctx.gc_mode, "auto"
        traceback.clear_frames(error.__traceback__)
        gc.collect()
        self.ctx.gc_mode = mode
        # one of ours may be bound, which moderngl would bind again
        self.bind_again(None)

    def bind_again(self, framebuffer: moderngl.Framebuffer | None) -> None:
        """Bind the framebuffer that was bound before, or the default one where that has been released since."""
        if framebuffer is None or isinstance(framebuffer.mglo, moderngl.InvalidObject):
            framebuffer = self.ctx.detect_framebuffer(0)
        framebuffer.use()

    def release(self) -> None:
        """Free the idle programs, and the context if it is the device's own."""
        for key in [key for key, shared in _SHARED.items() if shared is self]:
            del _SHARED[key]
        before = current_context()
        self.make_current()
        self._free_forgotten()
        self.programs.release()
        if self.headless:
            self.ctx.release()
            # a context that is gone stays current, and another library's cannot be entered beside it
            current_context().leave()
            if before.handle != self._handle:
                before.enter()


_SHARED: dict[tuple[int, int, str], Device] = {}


@atexit.register
def _release_shared() -> None:
    for (process, thread, _), device in list(_SHARED.items()):
        if process == os.getpid() and thread == threading.get_ident():
            with suppress(Exception):
                device.release()
