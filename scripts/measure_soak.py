#!/usr/bin/env python3
"""Draw very many frames of simulated grass with rolling balls and a moving camera, and say whether all stays level.

For each tenth of the frames: frame time, memory, open files, and the mean and contrast of pictures. The camera goes
round and round, so each tenth shows the same. With several processes beside each other, times are means, memory and
files the largest, and frames their sum. It prints JSON, from which `scripts/figures.py` makes a table of
docs/performance.md.
"""

import argparse
import json
import math
import platform
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

import greensward as gs
from greensward.gpu.memory import available_bytes

LOOP_FRAMES = 2000
"""Frames that the camera takes for a round."""
SEEN_EVERY = 100


def scene(density_per_m2: float, reach_m: float, cascades: int) -> gs.Scene:
    """The preset of rolling balls with so much grass."""
    overrides = {
        "sowing.density_per_m2": density_per_m2,
        "sowing.reach_m": reach_m,
        "ground.beyond": "repeat",
        "shadows.enabled": cascades > 0,
        "shadows.cascades": max(cascades, 1),
    }
    return gs.load("jahrmann2017-balls", overrides=overrides)


def camera(start: gs.Camera, frame: int) -> gs.Camera:
    """The camera on a circle of 60 m, so that grass is sown and dropped all the way."""
    turn = math.tau * frame / LOOP_FRAMES
    at = 60.0 * math.cos(turn), 1.7, 60.0 * math.sin(turn)
    towards = at[0] - 5.0 * math.sin(turn), 1.2, at[2] + 5.0 * math.cos(turn)
    return start.model_copy(update={"position_m": at, "target_m": towards, "height_above_ground": True})


def soak(frames: int, size: tuple[int, int], drawn: gs.Scene) -> dict[str, Any]:
    """Draw so many frames; figures of each tenth."""
    rows: list[dict[str, float]] = []
    cameras = [camera(drawn.camera, frame) for frame in range(LOOP_FRAMES)]
    with gs.Renderer(drawn, size=size, temporal=True) as renderer, renderer.ctx as ctx:
        target = ctx.framebuffer([ctx.texture(size, 4)], ctx.depth_renderbuffer(size))
        for part in range(10):
            times, seen = [], []
            for frame in range(part * frames // 10, (part + 1) * frames // 10):
                target.clear()
                started = time.perf_counter()
                renderer.draw(target, frame / 60.0, camera=cameras[frame % LOOP_FRAMES])
                ctx.finish()
                times.append((time.perf_counter() - started) * 1e3)
                if frame % SEEN_EVERY == 0:
                    seen.append(np.frombuffer(target.read(components=3), np.uint8) / 255.0)
            pictures = np.array(seen)
            rows.append(
                {
                    "to_frame": (part + 1) * frames // 10,
                    "frame_ms": float(np.median(times)),
                    "frame_ms_p99": float(np.percentile(times, 99)),
                    "frame_ms_max": max(times),
                    "process_mib": _resident_mib(),
                    "gpu_free_mib": available_bytes(renderer.device) >> 20,
                    "open_files": sum(1 for _ in Path("/proc/self/fd").iterdir()),
                    "mean": float(pictures.mean()),
                    "contrast": float(pictures.std(axis=1).mean()),
                }
            )
            print(rows[-1], file=sys.stderr)
        driver, blades = renderer.driver, renderer.blades
    machine = {"driver": driver, "python": platform.python_version(), "greensward": gs.__version__}
    return {
        "machine": machine,
        "size": f"{size[0]}x{size[1]}",
        "blades": blades,
        "processes": 1,
        "at_once": 1,
        "rows": rows,
    }


def _resident_mib() -> int:
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) >> 10


def merged(results: list[dict[str, Any]]) -> dict[str, Any]:
    """Results of as many processes each as one."""
    rows = []
    for parts in zip(*(result["rows"] for result in results), strict=True):
        row = {key: float(np.mean([part[key] for part in parts])) for key in ("frame_ms", "mean", "contrast")}
        row |= {key: max(part[key] for part in parts) for key in ("frame_ms_p99", "frame_ms_max")}
        row |= {key: max(part[key] for part in parts) for key in ("process_mib", "open_files")}
        row["gpu_free_mib"] = min(part["gpu_free_mib"] for part in parts)
        rows.append(row | {"to_frame": sum(part["to_frame"] for part in parts)})
    processes = sum(result["processes"] for result in results)
    return {**results[0], "processes": processes, "rows": rows}


def main() -> None:
    """Draw, and print the figures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--frames", type=int, default=20_000, help="frames of each process, a multiple of 20,000")
    parser.add_argument("--size", default="96x54")
    parser.add_argument("--density", type=float, default=10.0, help="blades per square metre")
    parser.add_argument("--reach", type=float, default=40.0, help="metres")
    parser.add_argument("--cascades", type=int, default=1, help="of shadows; 0 for none")
    parser.add_argument("--processes", type=int, default=1, help="processes beside each other")
    parser.add_argument("--add", type=Path, metavar="FILE", help="an earlier result of as many processes to add to")
    arguments = parser.parse_args()
    if arguments.processes > 1:
        command = [sys.executable, __file__, "--frames", str(arguments.frames), "--size", arguments.size]
        command += ["--density", str(arguments.density), "--reach", str(arguments.reach)]
        command += ["--cascades", str(arguments.cascades)]
        running = [subprocess.Popen(command, stdout=subprocess.PIPE) for _ in range(arguments.processes)]
        result = merged([json.loads(process.communicate()[0]) for process in running])
        result["at_once"] = arguments.processes
        if arguments.add:
            result = merged([json.loads(arguments.add.read_text(encoding="utf-8")), result])
        print(json.dumps(result, indent=1))
        return
    width, height = map(int, arguments.size.split("x"))
    drawn = scene(arguments.density, arguments.reach, arguments.cascades)
    print(json.dumps(soak(arguments.frames, (width, height), drawn), indent=1))


if __name__ == "__main__":
    main()
