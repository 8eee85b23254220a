"""Free memory of a device."""

import ctypes

from greensward.gpu.device import Device
from greensward.scene.files import free_memory

_NVX_AVAILABLE_KIB, _ATI_FREE_KIB = 0x9049, 0x87FC
_UNKNOWN = 2 << 30


def available_bytes(device: Device) -> int:
    """Free memory of the device in bytes; 2 GiB where the driver does not report it."""
    if device.software:
        return free_memory() // 2
    for extension, name in (
        ("GL_NVX_gpu_memory_info", _NVX_AVAILABLE_KIB),
        ("GL_ATI_meminfo", _ATI_FREE_KIB),
    ):
        if extension in device.ctx.extensions:
            values = (ctypes.c_int * 4)()
            device.function("glGetIntegerv", None, ctypes.c_uint, ctypes.c_void_p)(name, values)
            # an int of KiB overflows beyond 2 TiB only
            return values[0] * 1024
    return _UNKNOWN
