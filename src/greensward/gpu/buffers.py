"""Shader-storage buffers that begin with something known in them, or are written while they may be in use."""

import ctypes
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.context import gl_function

_ARRAY_BUFFER, _R32UI, _RED_INTEGER, _UNSIGNED_INT = 0x8892, 0x8236, 0x8D94, 0x1405


def filled(ctx: moderngl.Context, nbytes: int, value: int | np.float32 = 0) -> moderngl.Buffer:
    """A buffer of whole words of 32 bits, each this number.

    The device fills it: moderngl's `Buffer.clear` writes through mapped memory, 60 ms for 200 MB on an H200.
    """
    buffer = ctx.buffer(reserve=nbytes)
    unsigned = ctypes.c_uint
    bind = gl_function(ctx, "glBindBuffer", None, unsigned, unsigned)
    clear = gl_function(
        ctx, "glClearBufferData", None, unsigned, unsigned, unsigned, unsigned, ctypes.POINTER(unsigned)
    )
    bind(_ARRAY_BUFFER, buffer.glo)
    word = np.asarray(value, np.float32 if isinstance(value, np.float32) else np.uint32).view(np.uint32)
    clear(_ARRAY_BUFFER, _R32UI, _RED_INTEGER, _UNSIGNED_INT, ctypes.byref(unsigned(int(word))))
    return buffer


def rewrite(buffer: moderngl.Buffer, data: npt.NDArray[Any]) -> None:
    """Write from the buffer's beginning on; what it held is lost.

    It gets new storage, as NVIDIA's driver may overwrite the old before compute shaders called earlier have read it.
    """
    buffer.orphan()
    buffer.write(np.ascontiguousarray(data))
