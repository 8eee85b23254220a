#!/usr/bin/env python3
"""Time one step of blade dynamics beside a plain version of the published shaders, in one run.

The plain version is what the papers describe: an invocation a blade; one shader reads its four vectors and writes two
of them back (gravity, recovery, a strong wind, state correction), another tests orientation, frustum and distance and
appends the index of what is left. greensward's own step is timed for each form and wind, and for many colliders.
It prints JSON, from which `scripts/figures.py` makes tables of docs/performance.md.
"""

import argparse
import json
import platform
import statistics
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

import greensward as gs

FORCES = """
#version 430
layout(local_size_x = 32) in;
struct Blade { vec4 v0, v1, v2, up; };
layout(std430, binding = 0) buffer Blades { Blade blades[]; };
uniform int count; uniform float time; uniform float dt;
void main() {
    uint i = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 32u * 32768u;
    if (i >= uint(count)) return;
    Blade b = blades[i];
    vec3 v0 = b.v0.xyz, v2 = b.v2.xyz, up = b.up.xyz;
    float angle = b.v0.w, height = b.v1.w, stiffness = b.up.w;
    vec3 side = normalize(cross(up, normalize(vec3(sin(angle), sin(angle) + cos(angle), cos(angle)))));
    vec3 gravity = vec3(0.0, -9.8, 0.0) + 0.25 * 9.8 * normalize(cross(up, side));
    vec3 recovery = (v0 + up * height - v2) * stiffness * 30.0;
    vec3 direction = normalize(vec3(1.0, 0.0, 1.0));
    float wave = cos((dot(v0, direction) - 6.0 * time) / 2.0);
    float aligned = 1.0 - abs(dot(direction, normalize(v2 - v0))), ratio = abs(dot(v2 - v0, up)) / height;
    vec3 wind = direction * 8.0 * wave * aligned * ratio;
    v2 += (gravity + recovery + wind) * dt;
    v2 -= up * min(dot(up, v2 - v0), 0.0);
    float l = length(v2 - v0 - up * dot(v2 - v0, up));
    vec3 v1 = v0 + height * up * max(1.0 - l / height, 0.05 * max(l / height, 1.0));
    float curve = (2.0 * distance(v0, v2) + distance(v0, v1) + distance(v1, v2)) / 3.0, scale = height / curve;
    vec3 upper = (v2 - v1) * scale;
    v1 = v0 + (v1 - v0) * scale;
    blades[i].v1.xyz = v1;
    blades[i].v2.xyz = v1 + upper;
}
"""
VISIBILITY = """
#version 430
layout(local_size_x = 32) in;
struct Blade { vec4 v0, v1, v2, up; };
layout(std430, binding = 0) readonly buffer Blades { Blade blades[]; };
layout(std430, binding = 1) buffer Command { uint drawn, instances, first, base, instance; };
layout(std430, binding = 2) writeonly buffer Visible { uint visible[]; };
uniform int count; uniform mat4 clip; uniform vec3 eye;
bool inside(vec3 p) {
    vec4 c = clip * vec4(p, 1.0);
    float h = c.w + 0.5;
    return all(lessThan(abs(c.xyz), vec3(h)));
}
void main() {
    uint i = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 32u * 32768u;
    if (i >= uint(count)) return;
    Blade b = blades[i];
    vec3 v0 = b.v0.xyz, v1 = b.v1.xyz, v2 = b.v2.xyz, up = b.up.xyz, m = 0.25 * v0 + 0.5 * v1 + 0.25 * v2;
    float angle = b.v0.w;
    vec3 side = normalize(cross(up, normalize(vec3(sin(angle), sin(angle) + cos(angle), cos(angle)))));
    if (abs(dot(normalize(eye - v0), side)) >= 0.9) return;
    if (!inside(v0) && !inside(m) && !inside(v2)) return;
    vec3 to = v0 - eye;
    float away = length(to - up * dot(to, up));
    if (int(i) % 10 >= int(ceil(10.0 * max(1.0 - away / 200.0, 0.0)))) return;
    visible[atomicAdd(drawn, 1u)] = i;
}
"""
CASES: dict[str, dict[str, Any]] = {
    "yan2024, strong": {"simulation": {"form": "yan2024"}, "wind": [{"kind": "strong"}]},
    "jahrmann2017, waves": {"simulation": {"form": "jahrmann2017"}, "wind": [{"kind": "waves"}]},
    "natural, strong": {"simulation": {}, "wind": [{"kind": "strong"}]},
    "natural, gusts": {"simulation": {}, "wind": [{"kind": "gusts"}]},
    "natural, gusts, 1 ball": {"simulation": {}, "wind": [{"kind": "gusts"}], "balls": 1},
    "natural, gusts, 100 balls": {"simulation": {}, "wind": [{"kind": "gusts"}], "balls": 100},
}


def field(blades: int, case: dict[str, Any]) -> gs.Scene:
    """Return a scene with this many blades on a square of 120 m, all simulated."""
    rng = np.random.default_rng(1)
    balls = [
        {
            "kind": "sphere",
            "position_m": [0, 0, 0],
            "path": {"times_s": [0, 100], "positions_m": [[x, 0, z], [z, 0, x]], "smooth": False},
        }
        for x, z in rng.uniform(-55, 55, (case.get("balls", 0), 2)).tolist()
    ]
    return gs.Scene.model_validate(
        {
            "ground": {"kind": "flat", "size_m": [120, 120], "beyond": "bare"},
            "sowing": {"density_per_m2": blades / 14_400, "drift": 0, "full_density_m": 1000, "reach_m": 1000},
            "camera": {"position_m": [0, 1.7, 55], "target_m": [0, 0.9, 0]},
            "shadows": {"enabled": False},
            "simulation": {"within_m": 1000, "settle_s": 0.0, **case["simulation"]},
            "wind": case["wind"],
            "object": balls,
        }
    )


class Plain:
    """Plain version of the published shaders, for a number of blades."""

    def __init__(self, ctx: moderngl.Context, blades: int) -> None:
        rng = np.random.default_rng(2)
        rows = np.zeros((blades, 4, 4), np.float32)
        rows[:, 0, [0, 2]] = rng.uniform(-60, 60, (blades, 2))
        rows[:, 0, 3] = rng.uniform(0, 6.28, blades)
        height = rng.uniform(0.25, 0.6, blades)
        rows[:, 1:3, :3] = rows[:, :1, :3]
        rows[:, 1:3, 1] += height[:, None]
        rows[:, 1, 3], rows[:, 2, 3] = height, 0.005
        rows[:, 3] = 0, 1, 0, 0.6
        self.groups = min(-(-blades // 32), 32768), -(-blades // (32 * 32768))
        self.blades, self.command = ctx.buffer(rows), ctx.buffer(bytes(20))
        self.visible = ctx.buffer(reserve=blades * 4)
        self.forces, self.visibility = ctx.compute_shader(FORCES), ctx.compute_shader(VISIBILITY)
        for shader in (self.forces, self.visibility):
            shader["count"] = blades
        self.forces["dt"] = 1 / 60

    def run(self, name: str, time_s: float, clip: npt.NDArray[Any]) -> None:
        for binding, buffer in enumerate((self.blades, self.command, self.visible)):
            buffer.bind_to_storage_buffer(binding)
        if name == "forces":
            self.forces["time"] = time_s
            self.forces.run(*self.groups)
        else:
            self.command.clear()
            self.visibility["clip"] = tuple(clip.T.ravel())
            self.visibility["eye"] = (0.0, 1.7, 55.0)
            self.visibility.run(*self.groups)


def timed(renderer: gs.Renderer, work: Callable[[], None]) -> float:
    """Return the milliseconds of some work: by a timer query on a GPU, by the clock on a software driver."""
    ctx = renderer.ctx
    ctx.finish()
    if not renderer.device.features.timer_queries:
        started = time.perf_counter()
        work()
        ctx.finish()
        return (time.perf_counter() - started) * 1e3
    query: Any = ctx.query(time=True)
    with query:
        work()
    elapsed: float = query.elapsed / 1e6
    query.query = None
    return elapsed


def measure(name: str, case: dict[str, Any], blades: int, frames: int) -> dict[str, object]:
    """Return one row: times of greensward's step and of the plain shaders, measured alternately."""
    with gs.Renderer(field(blades, case), size=(640, 360)) as renderer:
        renderer.render(0.0)
        count = renderer.counts.simulated
        plain = Plain(renderer.ctx, count)
        view_from_world, clip_from_view = renderer.camera_matrices()
        clip = clip_from_view @ view_from_world
        samples: dict[str, list[float]] = {"greensward": [], "forces": [], "visibility": []}
        for frame in range(1, frames + 3):
            time_s = frame / 60

            times = {"greensward": timed(renderer, partial(renderer.advance, time_s))}
            for part in ("forces", "visibility"):
                times[part] = timed(renderer, partial(plain.run, part, time_s, clip))
            if frame > 2:
                for part, value in times.items():
                    samples[part].append(value)
        median = {part: statistics.median(values) for part, values in samples.items()}
        return {
            "workload": name,
            "blades": count,
            "step_ms": round(median["greensward"], 4),
            "step_ms_min": round(min(samples["greensward"]), 4),
            "plain_forces_ms": round(median["forces"], 4),
            "plain_visibility_ms": round(median["visibility"], 4),
            # blade, state and pose: 64 + 32 + 24 bytes read, 32 + 24 written
            "gb_per_s": round(count * 176 / median["greensward"] / 1e6, 1),
        }


def main() -> None:
    """Measure, and print the result."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blades", type=int, default=100_000)
    parser.add_argument("--frames", type=int, default=15)
    arguments = parser.parse_args()
    rows = []
    for name, case in CASES.items():
        rows.append(measure(name, case, arguments.blades, arguments.frames))
        print(rows[-1], file=sys.stderr)
    with gs.Renderer(gs.Scene(grass=()), size=(8, 8)) as renderer:
        driver = renderer.driver
    machine = {"driver": driver, "python": platform.python_version(), "greensward": gs.__version__}
    print(json.dumps({"machine": machine, "rows": rows}, indent=1))


if __name__ == "__main__":
    main()
