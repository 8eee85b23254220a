"""Reversed depth in floating point: as exact a kilometre away as near by, where the driver has clip control."""

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.device import Device

_LOWER_LEFT, _MINUS_ONE_TO_ONE, _ZERO_TO_ONE = 0x8CA1, 0x935E, 0x935F
_RENDERBUFFER, _DEPTH32F = 0x8D41, 0x8CAC
_UINT, _INT = ctypes.c_uint, ctypes.c_int


class ReversedDepth:
    """Draws with depth 1 at the near plane and 0 far away (Lapidous & Jiao 1999); without clip control, as usual."""

    def __init__(self, device: Device) -> None:
        self._ctx = device.ctx
        self.available = device.features.clip_control
        self.cleared = 0.0 if self.available else 1.0
        """Value that the depth buffer is cleared to."""
        self._bind = device.function("glBindRenderbuffer", None, _UINT, _UINT)
        self._store = device.function("glRenderbufferStorage", None, _UINT, _UINT, _INT, _INT)
        if self.available:
            self._control = device.function("glClipControl", None, _UINT, _UINT)

    def renderbuffer(self, size: tuple[int, int]) -> moderngl.Renderbuffer:
        """A depth buffer of 32-bit floats, which moderngl does not offer."""
        buffer = self._ctx.depth_renderbuffer(size)
        self._bind(_RENDERBUFFER, buffer.glo)
        self._store(_RENDERBUFFER, _DEPTH32F, *size)
        self._bind(_RENDERBUFFER, 0)
        return buffer

    def matrix(self, clip_from_world: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """The matrix to draw with, from one of OpenGL's usual clip space."""
        if not self.available:
            return clip_from_world
        reversed_ = clip_from_world.copy()
        reversed_[2] = 0.5 * (clip_from_world[3] - clip_from_world[2])
        return reversed_

    def parallel_depth_m(self, near_m: float, far_m: float) -> tuple[float, float, float, float]:
        """Depth in a parallel view drawn with such a matrix: x + y · clip z, or z + w · the fragment's."""
        if self.available:
            return far_m, near_m - far_m, far_m, near_m - far_m
        return 0.5 * (near_m + far_m), 0.5 * (far_m - near_m), near_m, far_m - near_m

    @contextmanager
    def drawing(self) -> Iterator[None]:
        """Set clip space and depth test for such matrices inside."""
        if not self.available:
            yield
            return
        self._control(_LOWER_LEFT, _ZERO_TO_ONE)
        self._ctx.depth_func = ">"
        try:
            yield
        finally:
            self._control(_LOWER_LEFT, _MINUS_ONE_TO_ONE)
            self._ctx.depth_func = "<"
