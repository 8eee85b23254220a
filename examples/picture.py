"""A picture and its ground truth from Python: load a preset, change it, render to arrays.

    python examples/picture.py -o picture.png

writes picture.png and, beside it, picture.npz with depth, classes and blade ids.
"""

import argparse
from pathlib import Path

import numpy as np
from PIL import Image

import greensward as gs


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--samples", type=int, default=4)
    parser.add_argument("-o", "--out", type=Path, default=Path("picture.png"))
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))

    # keys as in a scene file; docs/scene-reference.md lists them
    scene = gs.load("meadow", overrides={"wind.0.speed_mps": 9.0, "sun.elevation_deg": 25.0}, seed=4)
    with gs.Renderer(scene, size=(width, height), samples=options.samples) as renderer:
        frame = renderer.render(time_s=2.5, aovs=("depth", "class", "blade_id"))
        print(f"{renderer.blades:,} blades on {renderer.driver}")

    Image.fromarray(frame.image).save(options.out)
    np.savez_compressed(options.out.with_suffix(".npz"), **frame.truth)
    grass = frame.truth["class"] == gs.SurfaceClass.GRASS
    seen = len(np.unique(frame.truth["blade_id"][grass]))
    print(f"{options.out}: grass covers {grass.mean():.0%} of it, and {seen:,} different blades show")


if __name__ == "__main__":
    main()
