"""A walk through the meadow as a video: a camera that moves, drawn frame by frame.

    python examples/walk.py -o walk.mp4 --seconds 60

Edges are smoothed over time, from one frame to the next; `--samples 8` averages so many samples per frame instead.
"""

import argparse
from pathlib import Path

import numpy as np

import greensward as gs
from greensward.io.video import VideoWriter

PACE_MPS, STEP_M, BOB_M = 1.2, 1.4, 0.02


def camera_at(start: gs.Camera, time_s: float) -> gs.Camera:
    """Ahead at a walking pace, swaying with every step, and looking about."""
    position, target = np.array(start.position_m), np.array(start.target_m)
    ahead = (target - position) * (1.0, 0.0, 1.0)
    ahead /= np.linalg.norm(ahead)
    turn = 0.25 * np.sin(time_s / 7.0)
    ahead = ahead * np.cos(turn) + np.array([-ahead[2], 0.0, ahead[0]]) * np.sin(turn)
    away = PACE_MPS * time_s
    sway = BOB_M * np.array([np.sin(np.pi * away / STEP_M), np.cos(2 * np.pi * away / STEP_M), 0.0])
    here = position + ahead * away + sway
    return start.model_copy(
        update={"position_m": tuple(here), "target_m": tuple(here + 10.0 * ahead - (0.0, 0.9, 0.0))}
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", default="960x540")
    parser.add_argument("--samples", type=int)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--fps", type=int, default=30)
    parser.add_argument("-o", "--out", type=Path, default=Path("walk.mp4"))
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))

    scene = gs.load("meadow")
    smooth = {"temporal": True} if options.samples is None else {"samples": options.samples}
    with (
        gs.Renderer(scene, size=(width, height), **smooth) as renderer,
        VideoWriter(str(options.out), (width, height), fps=options.fps) as video,
    ):
        for i in range(round(options.seconds * options.fps)):
            time_s = i / options.fps
            video.add(renderer.render(time_s, camera=camera_at(scene.camera, time_s)).image)
    print(f"{options.out}: {options.seconds:g} s, {options.seconds * PACE_MPS:.0f} m through the meadow")


if __name__ == "__main__":
    main()
