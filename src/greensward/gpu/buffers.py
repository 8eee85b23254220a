"""Storage buffers: filled by the device, grown, and uploaded while earlier work may still read them."""

import ctypes
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.device import Device, Releasable
from greensward.gpu.layouts import WORD

_ARRAY_BUFFER, _R32UI, _RED_INTEGER, _UNSIGNED_INT = 0x8892, 0x8236, 0x8D94, 0x1405


@dataclass(frozen=True)
class BufferRange:
    """Part of a buffer, in bytes; it begins where the driver lets bindings begin, at a multiple of 256."""

    buffer: moderngl.Buffer
    offset: int
    size: int


def release_all(*resources: Releasable) -> None:
    """Free GPU resources of several kinds."""
    for resource in resources:
        resource.release()


def zeros(device: Device, nbytes: int) -> moderngl.Buffer:
    """Make a buffer of whole 32-bit words, each 0."""
    return full(device, nbytes, 0)


def full(device: Device, nbytes: int, value: int | np.float32) -> moderngl.Buffer:
    """Make a buffer of whole 32-bit words, each this number."""
    buffer = device.ctx.buffer(reserve=nbytes)
    clear(device, buffer, nbytes, value)
    return buffer


def clear(device: Device, buffer: moderngl.Buffer, nbytes: int, value: int | np.float32 = 0) -> None:
    """Set the first whole 32-bit words of a buffer to a number.

    The device does it: moderngl's `Buffer.clear` writes through mapped memory, 60 ms for 200 MB on an H200.
    """
    unsigned, size = ctypes.c_uint, ctypes.c_ssize_t
    bind = device.function("glBindBuffer", None, unsigned, unsigned)
    fill = device.function(
        "glClearBufferSubData", None, unsigned, unsigned, size, size, unsigned, unsigned, ctypes.POINTER(unsigned)
    )
    bind(_ARRAY_BUFFER, buffer.glo)
    word = np.asarray(value, np.float32 if isinstance(value, np.float32) else np.uint32).view(np.uint32)
    fill(_ARRAY_BUFFER, _R32UI, 0, nbytes, _RED_INTEGER, _UNSIGNED_INT, ctypes.byref(unsigned(int(word))))


def upload(device: Device, buffer: moderngl.Buffer, data: npt.NDArray[Any]) -> None:
    """Write from the buffer's beginning on, after what was called before and before what is called next.

    The device copies from new memory. NVIDIA's driver lets `Buffer.write` overwrite what shaders called earlier still
    have to read from a storage buffer, also after `Buffer.orphan`.
    """
    if data.size:
        written = device.ctx.buffer(np.ascontiguousarray(data))
        device.ctx.copy_buffer(buffer, written, size=written.size)
        written.release()


def read_back(device: Device, buffer: moderngl.Buffer, nbytes: int | None = None, offset: int = 0) -> bytes:
    """Read bytes that the device wrote, through a copy. Waits for the GPU.

    NVIDIA's driver moves a buffer that is read itself to the host's memory, where each later draw waits for it.
    """
    nbytes = buffer.size - offset if nbytes is None else nbytes
    device.ctx.memory_barrier(moderngl.BUFFER_UPDATE_BARRIER_BIT)
    copy = device.ctx.buffer(reserve=nbytes)
    device.ctx.copy_buffer(copy, buffer, size=nbytes, read_offset=offset)
    data: bytes = copy.read()
    copy.release()
    return data


def at_least(device: Device, buffer: moderngl.Buffer, nbytes: int, item_bytes: int = WORD) -> moderngl.Buffer:
    """Return the buffer, or in its place a larger one of whole items that holds nothing yet."""
    if buffer.size >= nbytes:
        return buffer
    buffer.release()
    # with some room to grow
    return device.ctx.buffer(reserve=-(-nbytes * 5 // 4 // item_bytes) * item_bytes)
