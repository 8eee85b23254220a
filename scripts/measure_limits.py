#!/usr/bin/env python3
"""Find what bounds the rasterisation of blades: one field with more and more of `visibility-buffer` left out.

`scripts/measure_limits.py --blades 1000000 --size 640x360` prints JSON, from which `scripts/figures.py` makes a table
of docs/performance.md.
"""

import argparse
import json
import statistics
import sys
import time

import greensward as gs
from greensward.bench.workloads import drawn_by, even_field
from greensward.gpu import shader_source

RASTER, FILL = ("techniques/visibility_buffer/" + name for name in ("raster.comp", "fill.glsl"))
_NEVER = "1.0e30"
# Results must look used, or the compiler removes more code than is meant.
LEFT_OUT: dict[str, list[tuple[str, str, str]]] = {
    "nothing": [],
    "atomics": [
        (
            FILL,
            "if (value > visible[pixel_index]) atomicMax",
            "if (value + visible[pixel_index] == uint64_t(1)) atomicMax",
        ),
        (FILL, "return atomicMax(inverse_depths[pixel_index], key) <= key;", "return key == before + 1u;"),
    ],
    "pixels": [(FILL, "for (int column = columns.x;", "for (int column = max(columns.x, columns.y - 1);")],
    "quads": [
        (RASTER, "bool shown = false;", f"if (s.c0.x + s.c2.y + s.side.z != {_NEVER}) return; bool shown = false;")
    ],
    "strips": [
        (
            RASTER,
            "Strip s = stripOf(b, h, wide);",
            f"if (h.v2.x + wide != {_NEVER}) return; Strip s = stripOf(b, h, wide);",
        )
    ],
}


SEGMENTS = (1, 2, 3, 6)


def milliseconds(scene: gs.Scene, size: tuple[int, int], frames: int, left_out: list[tuple[str, str, str]]) -> float:
    """Return the median time of the grass pass with these replacements in the shaders' text."""
    original = shader_source.read_lines

    def read(path: str) -> tuple[str, ...]:
        lines = original(path)
        for file, old, new in left_out:
            if path == file:
                assert any(old in line for line in lines), old
                lines = tuple(line.replace(old, new) for line in lines)
        return lines

    shader_source.read_lines = read  # type: ignore[assignment]
    try:
        with gs.Renderer(scene, size=size) as renderer:
            ctx = renderer.ctx
            target = ctx.framebuffer([ctx.texture(size, 4)], ctx.depth_renderbuffer(size))
            renderer.timers.enabled = True
            # a GPU that was idle while the scene was built takes time to raise its clock
            started = time.perf_counter()
            while time.perf_counter() - started < 1.0:
                renderer.draw(target, 0.0)
                ctx.finish()
            times = []
            for frame in range(frames):
                renderer.draw(target, frame / 60.0)
                times.append(renderer.timers.milliseconds()["grass"])
            return statistics.median(times)
    finally:
        shader_source.read_lines = original


def main() -> None:
    """Measure, and print the result."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blades", type=int, default=1_000_000)
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--frames", type=int, default=7)
    arguments = parser.parse_args()
    width, height = map(int, arguments.size.split("x"))
    scene = drawn_by("visibility-buffer", even_field(arguments.blades), {})
    grass_ms = {}
    cases = {name: (scene, left_out) for name, left_out in LEFT_OUT.items()}
    # straight, evenly tapering blades have the same shape with any number of segments
    straight = gs.Grass(bend=(0.0, 0.0), shape="triangle")
    for most in SEGMENTS:
        settings = type(scene.technique)(name="visibility-buffer", error_px=1e-6, max_level=most)
        changes = {"technique": settings, "grass": (straight,), "wind": ()}
        cases[f"{most} segments"] = scene.model_copy(update=changes), []
    for name, (drawn, left_out) in cases.items():
        grass_ms[name] = round(milliseconds(drawn, (width, height), arguments.frames, left_out), 4)
        print(name, grass_ms[name], file=sys.stderr)
    with gs.Renderer(scene, size=(width, height)) as renderer:
        renderer.render()
        in_view, driver = renderer.blades_in_view, renderer.driver
    print(json.dumps({"driver": driver, "size": arguments.size, "in_view": in_view, "grass_ms": grass_ms}, indent=1))


if __name__ == "__main__":
    main()
