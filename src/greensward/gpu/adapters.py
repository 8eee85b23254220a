"""Adapters that EGL can draw on, and headless OpenGL contexts on them."""

import ctypes
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import moderngl

from greensward.gpu.current import current_context
from greensward.scene.errors import GreenswardError, InputError

INSTALL = "sudo apt install libegl1 libgl1 libgl1-mesa-dri"
DEVICE_VARIABLE = "GREENSWARD_DEVICE"
_EGL = "libEGL.so.1"
_SOFTWARE = (
    "llvmpipe",
    "softpipe",
    "swrast",
    "software rasterizer",
    "swiftshader",
    "microsoft basic",
    "gdi generic",
)
_EGL_EXTENSIONS, _EGL_RENDERER, _EGL_DRM_FILE = 0x3055, 0x335F, 0x3233


@dataclass(frozen=True)
class Adapter:
    """A GPU or a software driver; `index` is what `open_context` and `GREENSWARD_DEVICE` take."""

    index: int
    name: str
    software: bool

    def __str__(self) -> str:
        return f"{self.index} ({self.name})"


def adapters() -> list[Adapter]:
    """List what EGL can draw on, in its own order. Empty where contexts do not come from EGL."""
    if not sys.platform.startswith("linux"):
        return []
    try:
        egl = ctypes.CDLL(_EGL)
    except OSError:
        raise GreenswardError(f"{_EGL} is missing; on Debian or Ubuntu: {INSTALL}") from None
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    query_at, text_at = (egl.eglGetProcAddress(name) for name in (b"eglQueryDevicesEXT", b"eglQueryDeviceStringEXT"))
    if not query_at or not text_at:
        return []  # no driver is installed behind the library
    query = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)(query_at)
    text = ctypes.CFUNCTYPE(ctypes.c_char_p, ctypes.c_void_p, ctypes.c_int)(text_at)
    handles, count = (ctypes.c_void_p * 64)(), ctypes.c_int()
    if not query(len(handles), handles, ctypes.byref(count)):
        return []
    return [
        _describe(index, lambda name, handle=handle: text(handle, name))  # type: ignore[misc]
        for index, handle in enumerate(handles[: count.value])
    ]


def _describe(index: int, text: Callable[[int], bytes | None]) -> Adapter:
    def ask(name: int) -> str:
        return (text(name) or b"").decode(errors="replace")

    extensions = ask(_EGL_EXTENSIONS).split()
    if "EGL_MESA_device_software" in extensions:
        return Adapter(index, "software", True)
    # a name is asked for only where it is offered: elsewhere the query leaves an error behind
    if "EGL_EXT_device_query_name" in extensions and (name := ask(_EGL_RENDERER)):
        return Adapter(index, name, False)
    if "EGL_NV_device_cuda" in extensions:
        return Adapter(index, "NVIDIA", False)
    drm = ask(_EGL_DRM_FILE) if "EGL_EXT_device_drm" in extensions else ""
    return Adapter(index, drm or "GPU", False)


def open_context(device: str = "auto") -> moderngl.Context:
    """Open a new headless context of OpenGL 4.3 or later and make it current.

    `device` is "auto" (a GPU before the CPU), "cpu", or an index of `adapters()`. The environment variable
    GREENSWARD_DEVICE says what "auto" means. Raises `InputError` for a device that does not exist and
    `GreenswardError`, with the fix, where nothing can draw.
    """
    refuse_after_fork()
    before = current_context()
    before.leave()
    try:
        ctx = _open_on(device)
    except BaseException:
        before.enter()
        raise
    note_context()
    return ctx


def note_context() -> None:
    """Remember that this process has a context of OpenGL."""
    _processes.add(os.getpid())


def refuse_after_fork() -> None:
    """Raise `GreenswardError` in a process forked from one that had a context: drivers hang there."""
    if _processes - {os.getpid()}:
        raise GreenswardError(
            "this process was forked from one that had drawn, and OpenGL drivers do not survive that: "
            'start workers with multiprocessing.get_context("spawn"), or draw in the workers alone'
        )


_processes: set[int] = set()
"""Processes up to this one that have had a context; a forked one inherits its parent's."""


def _open_on(device: str) -> moderngl.Context:
    if sys.platform == "darwin":
        raise GreenswardError(
            "macOS offers OpenGL 4.1 at most and greensward needs 4.3: use Linux or Windows, "
            "or a Linux container (it draws on the CPU)"
        )
    if device == "auto":
        device = os.environ.get(DEVICE_VARIABLE) or "auto"
    if not sys.platform.startswith("linux"):
        if device != "auto":
            raise InputError(f'device: must be "auto" on this system, which has one driver (got "{device}")')
        return _open(None)
    found = adapters()
    if not found:
        raise GreenswardError(f"no OpenGL driver is installed; on Debian or Ubuntu: {INSTALL}")
    problems = []
    for chosen in _choose(device, found):
        try:
            return _open(chosen)
        except GreenswardError as error:
            problems.append(error)
    raise problems[0]


def _choose(device: str, found: list[Adapter]) -> list[Adapter]:
    """Adapters to try, in order; never empty."""
    if device == "auto":
        return sorted(found, key=lambda each: each.software)
    chosen = [each for each in found if (each.software if device == "cpu" else str(each.index) == device)]
    if not chosen:
        listed = ", ".join(map(str, found))
        fix = f"; for a software driver on Debian or Ubuntu: {INSTALL}" if device == "cpu" else ""
        raise InputError(f'device: must be "auto", "cpu" or the index of one of {listed} (got "{device}"){fix}')
    return chosen


def _open(device: Adapter | None) -> moderngl.Context:
    settings: dict[str, Any] = {}
    what, fix, other = "the OpenGL driver", "install or update the graphics card's driver", ""
    if device:
        settings = {"backend": "egl", "libgl": _EGL, "libegl": _EGL, "device_index": device.index}
        what, fix = f"device {device}", f"on Debian or Ubuntu: {INSTALL}"
        other = "" if device.software else f", or draw on the CPU with {DEVICE_VARIABLE}=cpu"
    try:
        return moderngl.create_context(require=430, standalone=True, **settings)
    except Exception as error:  # glcontext raises bare Exception
        reason = error
    try:
        old = moderngl.create_context(require=300, standalone=True, **settings)
    except Exception:  # not a matter of the version, then
        raise GreenswardError(f"{what} cannot be started ({reason}); {fix}{other}") from None
    version = f"{old.version_code // 100}.{old.version_code // 10 % 10}"
    old.release()
    raise GreenswardError(
        f"{what} offers OpenGL {version} and greensward needs 4.3: update the graphics driver{other}"
    )


def is_software(ctx: moderngl.Context) -> bool:
    """Return whether the CPU draws."""
    renderer = ctx.info["GL_RENDERER"].lower()
    return any(name in renderer for name in _SOFTWARE)


def driver_name(ctx: moderngl.Context) -> str:
    """Name of the driver for people: `llvmpipe (LLVM 15.0.6, 256 bits)`, `NVIDIA H200`."""
    name: str = ctx.info["GL_RENDERER"].split("/PCIe")[0].removeprefix("Mesa ")
    return name.replace("(R)", "").replace("(TM)", "")
