#!/usr/bin/env python3
"""Time `Renderer.update` by what changed in the meadow, and a renderer's start with and without compiled programs.

Each update is from the preset to a changed scene; the time is of the call and `finish()`, and beside it that of the
next frame. Starts are of new processes, with empty and with filled folders of programs, also those of the driver, and
of a second renderer in one process. It prints JSON, from which `scripts/figures.py` makes tables of
docs/performance.md.
"""

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import greensward as gs
from greensward.gpu.programs import CACHE_VARIABLE

FOLDERS = (CACHE_VARIABLE, "MESA_SHADER_CACHE_DIR", "__GL_SHADER_DISK_CACHE_PATH")
"""Variables of the folders in which greensward, Mesa and NVIDIA's driver keep programs."""
Change = Callable[[gs.Scene, int], dict[str, Any]]
CHANGES: dict[str, Change] = {
    "sun": lambda scene, run: {"sun": scene.sun.model_copy(update={"azimuth_deg": 200.0 + run})},
    "wind": lambda scene, run: {"wind": first(scene.wind, speed_mps=8.0 + run)},
    "colour of a species": lambda scene, run: {"grass": first(scene.grass, tip_colour=f"#88aa{44 + run}")},
    "one object more": lambda scene, run: {
        "object": (*scene.object, gs.objects.Sphere(position_m=(0.1 * run, 0.0, -6.0)))
    },
    "density": lambda scene, run: {"sowing": scene.sowing.model_copy(update={"density_per_m2": 500.0 + run})},
    "ground": lambda scene, run: {"ground": scene.ground.model_copy(update={"height_m": 5.0 + 0.1 * run})},
    "seed": lambda scene, run: {"seed": scene.seed + run + 1},
}


def first(tables: Sequence[Any], **values: Any) -> tuple[Any, ...]:
    """Return the tables with these values in the first of them."""
    return tables[0].model_copy(update=values), *tables[1:]


def updates(size: tuple[int, int], runs: int) -> list[dict[str, Any]]:
    """Return a row of medians for each change."""
    before = gs.load("meadow")
    rows = []
    with gs.Renderer(before, size=size) as renderer:
        renderer.device.make_current()
        for name, change in CHANGES.items():
            times: list[tuple[float, float]] = []
            for run in range(runs):
                after = before.model_copy(update=change(before, run))
                in_place = renderer.updates_in_place(after)
                renderer.update(before)
                renderer.render(0.0)
                renderer.ctx.finish()
                began = time.perf_counter()
                renderer.update(after)
                renderer.ctx.finish()
                updated = time.perf_counter()
                renderer.render(0.0)
                times.append((updated - began, time.perf_counter() - updated))
            update_s, frame_s = (statistics.median(column) for column in zip(*times, strict=True))
            rows.append(
                {
                    "change": name,
                    "in_place": in_place,
                    "update_ms": round(1e3 * update_s, 2),
                    "next_frame_ms": round(1e3 * frame_s, 2),
                }
            )
            print(rows[-1], file=sys.stderr)
    return rows


def start(size: tuple[int, int]) -> dict[str, float]:
    """Return the milliseconds of a new renderer's first picture, and of its programs and waiting for them."""
    began = time.perf_counter()
    with gs.Renderer("meadow", size=size) as renderer:
        renderer.render(0.0)
        whole_s = time.perf_counter() - began
        return {"picture_ms": round(1e3 * whole_s, 1), "shaders_ms": round(1e3 * renderer.seconds["shaders"], 1)}


def starts(size: tuple[int, int], runs: int) -> list[dict[str, Any]]:
    """Return a row of medians for each state of what is compiled."""
    found: dict[str, list[dict[str, float]]] = {}
    for _ in range(runs):
        with tempfile.TemporaryDirectory() as folder:
            for name in FOLDERS:
                Path(folder, name).mkdir()
            for process in ("first process", "second process"):
                run = subprocess.run(
                    [sys.executable, __file__, "--start", "--size", f"{size[0]}x{size[1]}"],
                    env={**os.environ, **{name: f"{folder}/{name}" for name in FOLDERS}},
                    capture_output=True,
                    text=True,
                    check=True,
                )
                for label, row in json.loads(run.stdout).items():
                    found.setdefault(f"{process}, {label}", []).append(row)
    return [
        {"start": name, **{key: statistics.median(row[key] for row in rows) for key in rows[0]}}
        for name, rows in found.items()
    ]


def main() -> None:
    """Measure, and print the result."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--start", action="store_true", help="print the times of two renderers after each other only")
    arguments = parser.parse_args()
    width, height = map(int, arguments.size.split("x"))
    size = width, height
    if arguments.start:
        print(json.dumps({"first renderer": start(size), "second renderer": start(size)}))
        return
    with gs.Renderer(gs.Scene(grass=()), size=(8, 8)) as renderer:
        driver = renderer.driver
    machine = {"driver": driver, "python": platform.python_version(), "greensward": gs.__version__}
    result = {
        "machine": machine,
        "size": arguments.size,
        "starts": starts(size, arguments.runs),
        "updates": updates(size, arguments.runs),
    }
    print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
