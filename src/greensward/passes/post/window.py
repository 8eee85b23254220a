"""Framebuffers of a host: the part that a picture is drawn into, its depth, and the drawing."""

import ctypes
from dataclasses import dataclass
from typing import Any

import moderngl

from greensward.gpu.buffers import release_all
from greensward.gpu.device import Device
from greensward.gpu.kernels import Bindings, Draw
from greensward.passes.post import Look, Post

_DRAW_BUFFERS = 8  # which OpenGL promises
_DRAW_FRAMEBUFFER, _COLOUR_ATTACHMENT, _BACK_LEFT, _COLOUR_ENCODING = 0x8CA9, 0x8CE0, 0x0402, 0x8210
_SRGB, _FRAMEBUFFER_SRGB = 0x8C40, 0x8DB9


@dataclass(frozen=True)
class DepthScale:
    """Numbers of a host's depth buffer, from the depth along the view axis."""

    offset: float
    factor: float
    """Added to the offset after division by the depth in metres, or in a parallel view times it."""
    reversed: bool
    """True if nearer is greater."""
    sky: float = 1.0
    """Depth of the sky: the far end of the depth range."""

    @classmethod
    def of(
        cls,
        a: float,
        b: float,
        *,
        parallel: bool,
        zero_to_one: bool,
        depth_range: tuple[float, float],
        behind_m: float = 0.0,
    ) -> "DepthScale":
        """Compute it of a projection whose clip z is b − a · depth, and of the context's depth range.

        The depth that is drawn is counted from so far behind.
        """
        b += a * behind_m if parallel else 0.0
        low, span = depth_range[0], depth_range[1] - depth_range[0]
        scale, shift = (span, low) if zero_to_one else (0.5 * span, low + 0.5 * span)
        nearer_is_greater = scale * (a if parallel else b) > 0.0
        sky = min(depth_range) if nearer_is_greater else max(depth_range)
        if parallel:
            return cls(shift + scale * b, -scale * a, nearer_is_greater, sky)
        return cls(shift - scale * a, scale * b, nearer_is_greater, sky)


@dataclass(frozen=True)
class Window:
    """Part of a framebuffer that a picture is drawn into."""

    framebuffer: moderngl.Framebuffer
    viewport: tuple[int, int, int, int]
    depth: DepthScale
    layer: int | None = None
    """Layer, where the framebuffer's attachments have any."""


class Blit:
    """Draws finished pictures into windows of the host, behind what these hold already."""

    def __init__(self, device: Device, bindings: Bindings) -> None:
        self._device, self._ctx, self._bindings = device, device.ctx, bindings
        self._draws: dict[tuple[bool, bool], Draw] = {}
        unsigned, integer = ctypes.c_uint, ctypes.c_int
        self._colour_mask = device.function("glColorMaski", None, unsigned, *(ctypes.c_ubyte,) * 4)
        self._blend = device.function("glBlendFunci", None, *(unsigned,) * 3)
        self._attachment = device.function(
            "glGetFramebufferAttachmentParameteriv", None, *(unsigned,) * 3, ctypes.POINTER(integer)
        )
        self._draw(True, False)

    def _draw(self, whole: bool, layered: bool) -> Draw:
        key = whole, layered
        if key not in self._draws:
            stages = "shaders/screen.vert", *(["passes/post/layer.geom"] if layered else []), "passes/post/blit.frag"
            self._draws[key] = Draw(
                self._device, *stages, defines={} if whole else {"CUT_OUT": 1}, bindings=self._bindings
            )
        return self._draws[key]

    def run(self, picture: moderngl.Texture, window: Window, look: Look, post: Post) -> None:
        """Draw a picture with its depth into the first colour attachment; the others stay as they are."""
        target, scale = window.framebuffer, window.depth
        target.use()
        self._ctx.viewport = window.viewport
        target.depth_mask = True
        for i in range(_DRAW_BUFFERS):
            self._colour_mask(i, *(int(i == 0),) * 4)
        self._ctx.enable_only(moderngl.DEPTH_TEST if look.is_whole else moderngl.DEPTH_TEST | moderngl.BLEND)
        values: dict[str, Any] = {}
        if not look.is_whole:
            self._blend(0, moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA)
            values["shown_depth"] = post.shown_depth
        if window.layer is not None:
            values["layer"] = window.layer
        encodes = look.encoding == "linear" and self._is_srgb(target)
        if encodes:
            self._ctx.enable_direct(_FRAMEBUFFER_SRGB)
        self._ctx.depth_func = ">=" if scale.reversed else "<="
        self._draw(look.is_whole, window.layer is not None).run(
            moderngl.TRIANGLES,
            3,
            picture=picture,
            depth_scale=(scale.offset, scale.factor),
            sky_depth=scale.sky,
            corner_px=window.viewport[:2],
            **values,
        )
        self._ctx.depth_func = "<"
        if encodes:
            self._ctx.disable_direct(_FRAMEBUFFER_SRGB)

    def _is_srgb(self, target: moderngl.Framebuffer) -> bool:
        """Return whether the driver would encode what is written, if asked to."""
        found = ctypes.c_int()
        first = _COLOUR_ATTACHMENT if target.glo else _BACK_LEFT
        self._attachment(_DRAW_FRAMEBUFFER, first, _COLOUR_ENCODING, ctypes.byref(found))
        return found.value == _SRGB

    def release(self) -> None:
        """Free the programs."""
        release_all(*self._draws.values())
