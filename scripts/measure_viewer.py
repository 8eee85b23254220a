#!/usr/bin/env python3
"""Measure the frame times of the viewer, without a window: `.venv/bin/python scripts/measure_viewer.py`.

For each preset the camera is at rest for some seconds, after the resolution has settled, and then moves. Each prints
a line of JSON, from which `scripts/figures.py` makes a table of docs/viewer.md.
"""

import argparse
import json
import sys
import time
from collections.abc import Sequence

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.adapters import driver_name, open_context
from greensward.viewer.application import Application
from greensward.viewer.contexts import Contexts
from greensward.viewer.input import Event, Key
from greensward.viewer.session import Session

PRESETS = ("meadow", "jahrmann2013-meadow", "jahrmann2013-oasis", "yan2024-helicopter", "planet")


def measure(ctx: moderngl.Context, name: str, size: tuple[int, int], seconds: float) -> dict[str, object]:
    began = time.perf_counter()
    application = Application(Contexts(ctx, lambda: None), Session(name))
    viewer = application.viewer
    target = ctx.simple_framebuffer(size)
    application.frame(0.0, [], size, target)
    first_s = time.perf_counter() - began

    def frames(for_s: float, events: Sequence[Event] = ()) -> npt.NDArray[np.float64]:
        times: list[float] = []
        waiting, last = list(events), time.perf_counter()
        end = last + for_s
        while last < end:
            application.frame(times[-1] if times else 0.0, waiting, size, target)
            ctx.finish()
            waiting, now = [], time.perf_counter()
            times.append(now - last)
            last = now
        return np.array(times)

    frames(max(8.0, seconds))
    at_rest = frames(seconds)
    key = "a" if viewer.session.controller.mode == "orbit" else "w"
    moving = frames(seconds, [Key(key)])
    result = {
        "preset": name,
        "first_frame_s": round(first_s, 2),
        "scale": viewer.resolution.scale,
        "detail": viewer.quality,
        **{
            f"{what}_{key}": value
            for what, times in (("standing", at_rest), ("walking", moving))
            for key, value in {
                "fps": round(len(times) / times.sum(), 1),
                "p95_ms": round(1e3 * float(np.percentile(times, 95)), 1),
                "max_ms": round(1e3 * float(times.max()), 1),
            }.items()
        },
    }
    application.release()
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("presets", nargs="*", default=PRESETS, metavar="PRESET")
    parser.add_argument("--size", type=int, nargs=2, default=(1280, 800), metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--seconds", type=float, default=6.0)
    options = parser.parse_args()
    ctx = open_context()
    print(driver_name(ctx), file=sys.stderr)
    for name in options.presets:
        print(json.dumps(measure(ctx, name, tuple(options.size), options.seconds)), flush=True)


if __name__ == "__main__":
    main()
