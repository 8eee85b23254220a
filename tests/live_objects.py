"""Which OpenGL objects exist, asked of the driver itself."""

import ctypes
from collections.abc import Callable, Iterator

from greensward.gpu.device import Device

_KINDS = ("Buffer", "Texture", "Framebuffer", "Renderbuffer", "VertexArray", "Program", "Shader", "Sampler", "Query")
_GAP = 2_000
_DELETE_STATUS = 0x8B80


def live_objects(device: Device) -> dict[str, set[int]]:
    """Names of the objects of each kind that nobody has deleted; it ends after 2,000 names that are nobody's.

    Programs without users belong to the device, and do not count.
    """
    found = {}
    for kind in _KINDS:
        exists = device.function(f"glIs{kind}", ctypes.c_ubyte, ctypes.c_uint)
        found[kind] = {name for name in _existing(exists) if not _is_deleted(device, kind, name)}
    found["Program"] -= {each.gl.glo for each in device.programs._programs.values() if not each.users}
    return found


def _existing(exists: Callable[[int], int]) -> Iterator[int]:
    name = last = 0
    while name < last + _GAP:
        name += 1
        if exists(name):
            yield (last := name)


def _is_deleted(device: Device, kind: str, name: int) -> bool:
    """Deleted programs and shaders live on while something still uses them."""
    if kind not in ("Program", "Shader"):
        return False
    status = ctypes.c_int()
    ask = device.function(f"glGet{kind}iv", None, ctypes.c_uint, ctypes.c_uint, ctypes.c_void_p)
    ask(name, _DELETE_STATUS, ctypes.byref(status))
    return bool(status.value)
