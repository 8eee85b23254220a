"""Floor of the same machine: the time for as many bare primitives, and for filling as many pixels."""

import statistics
import time
from collections.abc import Callable
from math import sqrt

import moderngl

from greensward.gpu.device import Device
from greensward.gpu.kernels import Draw

_TRIANGLES = 5
_SLENDERNESS = 8.0  # height of a strip to its width


def milliseconds(device: Device, draw: Callable[[], None]) -> float:
    """Time of some work: GPU timer queries where there are any, else the wall clock around `finish()`."""
    ctx = device.ctx
    ctx.finish()
    if not device.features.timer_queries:
        started = time.perf_counter()
        draw()
        ctx.finish()
        return (time.perf_counter() - started) * 1e3
    query = ctx.query(time=True)
    with query:
        draw()
    return float(query.elapsed) / 1e6


def floor_ms(
    device: Device, size: tuple[int, int], *, blades: int, primitives: int, blade_pixels: int, repeats: int
) -> float:
    """Median time of instanced strips in one colour and one full-screen fill, without buffers, textures or light.

    There are as many strips as blades, or as it takes for as many triangles; together they have the area of the
    pixels that show blades.
    """
    strips = max(blades, -(-primitives // _TRIANGLES), 1)
    pixel_area = 4.0 / (size[0] * size[1])
    width = sqrt(max(blade_pixels, 1) * pixel_area / strips / _SLENDERNESS)
    ctx = device.ctx
    strip = Draw(device, "bench/floor.vert", "bench/floor.frag")
    fill = Draw(device, "shaders/screen.vert", "bench/floor.frag")
    strip.set(size=(width, width * _SLENDERNESS))
    colour, depth = ctx.texture(size, 4), ctx.depth_renderbuffer(size)
    target = ctx.framebuffer([colour], depth)

    def draw() -> None:
        target.use()
        target.clear()
        ctx.enable_only(moderngl.DEPTH_TEST)
        strip.run(moderngl.TRIANGLE_STRIP, 7, strips)
        ctx.enable_only(moderngl.NOTHING)
        fill.run(moderngl.TRIANGLES, 3)

    draw()
    took = statistics.median(milliseconds(device, draw) for _ in range(repeats))
    for part in (
        strip,
        fill,
        *target.color_attachments,
        target.depth_attachment,
        target,
    ):
        part.release()
    return took
