"""Which OpenGL objects exist, asked of the driver itself."""

import ctypes

import moderngl

from greensward.gpu.context import gl_function

_KINDS = ("Buffer", "Texture", "Framebuffer", "Renderbuffer", "VertexArray", "Program", "Shader", "Sampler", "Query")
_MOST = 20_000
_DELETE_STATUS = 0x8B80


def live_objects(ctx: moderngl.Context) -> dict[str, set[int]]:
    """Names of the objects of each kind that nobody has deleted; names above 20,000 are not looked at."""
    found = {}
    for kind in _KINDS:
        exists = gl_function(ctx, f"glIs{kind}", ctypes.c_ubyte, ctypes.c_uint)
        found[kind] = {name for name in range(1, _MOST) if exists(name) and not _is_deleted(ctx, kind, name)}
    return found


def _is_deleted(ctx: moderngl.Context, kind: str, name: int) -> bool:
    """Deleted programs and shaders live on while something still uses them."""
    if kind not in ("Program", "Shader"):
        return False
    status = ctypes.c_int()
    ask = gl_function(ctx, f"glGet{kind}iv", None, ctypes.c_uint, ctypes.c_uint, ctypes.c_void_p)
    ask(name, _DELETE_STATUS, ctypes.byref(status))
    return bool(status.value)
