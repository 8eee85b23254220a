"""How much memory a device can still give."""

import ctypes
from pathlib import Path

import moderngl

from greensward.gpu.context import gl_function, is_software

_NVX_AVAILABLE_KIB, _ATI_FREE_KIB = 0x9049, 0x87FC
_UNKNOWN = 2 << 30


def available_bytes(ctx: moderngl.Context) -> int:
    """Free memory of the context's device in bytes; 2 GiB where no driver tells."""
    if is_software(ctx):
        try:
            meminfo = Path("/proc/meminfo").read_text(encoding="ascii")
        except OSError:
            return _UNKNOWN
        line = next(line for line in meminfo.splitlines() if line.startswith("MemAvailable"))
        return int(line.split()[1]) * 1024 // 2
    for extension, name in (
        ("GL_NVX_gpu_memory_info", _NVX_AVAILABLE_KIB),
        ("GL_ATI_meminfo", _ATI_FREE_KIB),
    ):
        if extension in ctx.extensions:
            values = (ctypes.c_int * 4)()
            gl_function(ctx, "glGetIntegerv", None, ctypes.c_uint, ctypes.c_void_p)(name, values)
            # an int of KiB overflows beyond 2 TiB only
            return values[0] * 1024
    return _UNKNOWN
