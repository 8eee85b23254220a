"""OpenGL contexts that are current in this thread, through EGL or GLX, so that one can be left and entered again."""

import ctypes
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any

_EGL_DRAW, _EGL_READ = 0x3059, 0x305A
_POINTER, _XID = ctypes.c_void_p, ctypes.c_ulong


@dataclass(frozen=True)
class CurrentContext:
    """A context as it was current; `handle` is its address in the window system's library, None for no context."""

    handle: int | None
    _enter: Callable[[], Any] = lambda: None
    _leave: Callable[[], Any] = lambda: None

    def leave(self) -> None:
        """Make no context current. Another library's cannot become current before that."""
        self._leave()

    def enter(self) -> None:
        """Make it current again."""
        self._enter()


NO_CONTEXT = CurrentContext(None)


@contextmanager
def context_kept() -> Iterator[None]:
    """Leave the context current that was, whatever is made current inside."""
    before = current_context()
    try:
        yield
    finally:
        now = current_context()
        if now.handle != before.handle:
            now.leave()
            before.enter()


def current_context() -> CurrentContext:
    """The context that is current in this thread. Elsewhere than on Linux it is not known."""
    if not sys.platform.startswith("linux"):
        return NO_CONTEXT
    return _of_egl() or _of_glx() or NO_CONTEXT


def _of_egl() -> CurrentContext | None:
    egl = _loaded("libEGL.so.1", "eglGetCurrentContext", ())
    context = egl and egl()
    if not context:
        return None
    display = _loaded("libEGL.so.1", "eglGetCurrentDisplay", ())()
    surface = _loaded("libEGL.so.1", "eglGetCurrentSurface", (ctypes.c_int,))
    draw, read = surface(_EGL_DRAW), surface(_EGL_READ)
    make = _loaded("libEGL.so.1", "eglMakeCurrent", (_POINTER,) * 4)
    return CurrentContext(
        context, lambda: make(display, draw, read, context), lambda: make(display, None, None, None)
    )


def _of_glx() -> CurrentContext | None:
    get = _loaded(_glx(), "glXGetCurrentContext", ())
    context = get and get()
    if not context:
        return None
    display = _loaded(_glx(), "glXGetCurrentDisplay", ())()
    draw = _loaded(_glx(), "glXGetCurrentDrawable", (), _XID)()
    read = _loaded(_glx(), "glXGetCurrentReadDrawable", (), _XID)()
    make = _loaded(_glx(), "glXMakeContextCurrent", (_POINTER, _XID, _XID, _POINTER))
    return CurrentContext(context, lambda: make(display, draw, read, context), lambda: make(display, 0, 0, None))


def _glx() -> str:
    return "libGLX.so.0" if _library("libGLX.so.0") else "libGL.so.1"


def _library(name: str) -> Any:
    """A library if the process has loaded it; one that it has not has no context."""
    try:
        return ctypes.CDLL(name, os.RTLD_NOLOAD | os.RTLD_LAZY)
    except OSError:
        return None


@cache
def _found(name: str, function: str, arguments: tuple[Any, ...], result: Any) -> Any:
    found = getattr(_library(name), function, None)
    if found is not None:
        found.argtypes, found.restype = arguments, result
    return found


def _loaded(name: str, function: str, arguments: tuple[Any, ...], result: Any = _POINTER) -> Any:
    """A function of a library, or None while the process has not loaded it."""
    if name not in _LOADED:
        if _library(name) is None:
            return None
        _LOADED.add(name)
    return _found(name, function, arguments, result)


_LOADED: set[str] = set()
