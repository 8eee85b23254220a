"""A grassy hillside from a real elevation model: the Jacksboro fault, as it comes with matplotlib.

    python examples/hillside.py -o hillside

writes a scene folder (scene.toml, elevation.npz, three maps) with near.png and far.png.
"""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.cbook import get_sample_data
from PIL import Image

import greensward as gs

FINER = 4  # texels of the maps in a cell of the elevation model
VIEWS = {  # position, target, near plane
    "near": ((985, 1.3, -2425), (-104, 10, -748), 0.2),
    "far": ((-60, 2.0, 2340), (1794, -60, -3366), 0.3),
}
CAMERAS = {
    name: gs.Camera(position_m=position, target_m=target, near_m=near, far_m=40_000, fov_y_deg=40)
    for name, (position, target, near) in VIEWS.items()
}


def elevation():
    """Heights in metres, north row first, and the size of the ground: east-west, north-south."""
    model = get_sample_data("jacksboro_fault_dem.npz")
    rows, columns = model["elevation"].shape
    degree_m = 111_320.0  # of latitude; of longitude it shrinks towards the pole
    shrink = np.cos(np.radians(0.5 * (model["ymin"] + model["ymax"])))
    size_m = (columns - 1) * model["dx"] * degree_m * shrink, (rows - 1) * model["dy"] * degree_m
    return model["elevation"].astype(np.float32), (float(size_m[0]), float(size_m[1]))


def enlarged(values, size):
    return np.asarray(Image.fromarray(values.astype(np.float32)).resize(size, Image.Resampling.BICUBIC))


def maps(heights, size_m):
    """Density, bare earth and vegetation: nothing on steep slopes, less, shorter and drier grass towards the tops."""
    rows, columns = heights.shape
    rise_z, rise_x = np.gradient(heights, size_m[1] / (rows - 1), size_m[0] / (columns - 1))
    size = columns * FINER, rows * FINER
    slope_deg = enlarged(np.degrees(np.arctan(np.hypot(rise_x, rise_z))), size)
    top = np.clip((enlarged(heights, size) - 650.0) / 300.0, 0.0, 1.0)
    random = np.random.default_rng(5)
    noises = (random.normal(0.0, 2.2, (rows * k // 2, columns * k // 2)) for k in (1, 2, 4, 8))
    ragged = sum(enlarged(noise, size) for noise in noises)
    density = np.clip((27.0 + ragged - slope_deg) / 10.0, 0.0, 1.0) * (1.0 - 0.3 * top)
    yield "density.png", np.dstack([density, np.zeros_like(density), 1.0 - 0.25 * top])  # red; unused; height
    earth = np.clip(0.5 + 0.1 * ragged, 0.0, 1.0)[..., None]
    pale, dark = np.array([0.64, 0.56, 0.42, 1.0]), np.array([0.46, 0.42, 0.36, 1.0])
    yield "terrain.png", pale * earth + dark * (1.0 - earth)
    straw = 0.7 * np.clip(top + 0.05 * ragged, 0.0, 1.0)
    yield "vegetation.png", np.dstack([np.full((*straw.shape, 3), (0.69, 0.6, 0.36)), straw])


def make(folder):
    """Write the scene's folder."""
    folder.mkdir(parents=True, exist_ok=True)
    heights, size_m = elevation()
    np.savez_compressed(folder / "elevation.npz", elevation=heights)
    for name, map_ in maps(heights, size_m):
        Image.fromarray(np.round(255.0 * map_).astype(np.uint8)).save(folder / name)
    scene = gs.Scene(
        title="Hillside at the Jacksboro fault",
        ground=gs.grounds.HeightMapGround(file="elevation.npz", terrain_map="terrain.png", size_m=size_m),
        sowing=gs.Sowing(
            density_map="density.png",
            vegetation_map="vegetation.png",
            max_slope_deg=30,
            density_per_m2=1000,
            reach_m=500,
        ),
        grass=(
            gs.Grass(species="fescue", share=0.6),
            gs.Grass(species="meadow-grass", share=0.3),
            gs.Grass(species="bent", share=0.06, patchiness=0.8),
            gs.Grass(species="daisy", share=0.02, patchiness=0.9),
        ),
        sun=gs.Sun(azimuth_deg=262, elevation_deg=33),
        sky=gs.Sky(haze=1.3),
        camera=CAMERAS["near"],
        post=gs.Post(saturation=0.9),
    )
    (folder / "scene.toml").write_text(gs.dump(scene), encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--samples", type=int, default=4)
    parser.add_argument("-o", "--out", type=Path, default=Path("hillside"))
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    make(options.out)
    with gs.Renderer(gs.load(options.out), size=(width, height), samples=options.samples) as renderer:
        for name, camera in CAMERAS.items():
            Image.fromarray(renderer.render(camera=camera).image).save(options.out / f"{name}.png")
            print(options.out / f"{name}.png")


if __name__ == "__main__":
    main()
