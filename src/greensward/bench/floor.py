"""What the same machine needs at least: as many bare primitives, and as many pixels filled."""

import statistics
import time
from collections.abc import Callable
from math import sqrt

import moderngl

from greensward.gpu.program import build
from greensward.gpu.timers import has_timer_queries

_TRIANGLES = 5
_SLENDERNESS = 8.0  # height of a strip to its width


def milliseconds(ctx: moderngl.Context, draw: Callable[[], None]) -> float:
    """Time of some work: the GPU's own where it tells, the wall clock around `finish()` elsewhere."""
    ctx.finish()
    if not has_timer_queries(ctx):
        started = time.perf_counter()
        draw()
        ctx.finish()
        return (time.perf_counter() - started) * 1e3
    query = ctx.query(time=True)
    with query:
        draw()
    return float(query.elapsed) / 1e6


def floor_ms(
    ctx: moderngl.Context, size: tuple[int, int], *, blades: int, primitives: int, blade_pixels: int, repeats: int
) -> float:
    """Median time of instanced strips in one colour and one full-screen fill, without buffers, textures or light.

    There are as many strips as blades, or as it takes for as many triangles; together they have the area of the
    pixels that show blades.
    """
    strips = max(blades, -(-primitives // _TRIANGLES), 1)
    pixel_area = 4.0 / (size[0] * size[1])
    width = sqrt(max(blade_pixels, 1) * pixel_area / strips / _SLENDERNESS)
    array = ctx.vertex_array(build(ctx, "bench/floor.vert", "bench/floor.frag"), [])
    fill = ctx.vertex_array(build(ctx, "shaders/screen.vert", "bench/floor.frag"), [])
    array.program["size"] = width, width * _SLENDERNESS
    colour, depth = ctx.texture(size, 4), ctx.depth_renderbuffer(size)
    target = ctx.framebuffer([colour], depth)

    def draw() -> None:
        target.use()
        target.clear()
        ctx.enable_only(moderngl.DEPTH_TEST)
        array.render(moderngl.TRIANGLE_STRIP, vertices=7, instances=strips)
        ctx.enable_only(moderngl.NOTHING)
        fill.render(moderngl.TRIANGLES, vertices=3)

    draw()
    took = statistics.median(milliseconds(ctx, draw) for _ in range(repeats))
    for part in (
        array.program,
        array,
        fill.program,
        fill,
        *target.color_attachments,
        target.depth_attachment,
        target,
    ):
        part.release()
    return took
