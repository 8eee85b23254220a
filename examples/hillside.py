"""A grassy hillside from a real elevation model: the Jacksboro fault in Tennessee, as it comes with matplotlib.

    python examples/hillside.py -o hillside

writes a scene folder (scene.toml, elevation.npz, density.png) and two pictures of it, near.png and far.png.
"""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.cbook import get_sample_data
from PIL import Image

import greensward as gs

NEAR = gs.Camera(position_m=(0, 1.7, 0), target_m=(100, 0, -100), fov_y_deg=45, near_m=0.2, far_m=40_000)
FAR = NEAR


def elevation():
    """Heights in metres, north row first, and the size of the ground (east, south) in metres."""
    model = get_sample_data("jacksboro_fault_dem.npz")
    heights = model["elevation"].astype(np.float32)
    rows, columns = heights.shape
    # the spacing is in degrees: of latitude from north to south, of longitude from west to east
    degree_m = 111_320.0
    latitude = np.radians(0.5 * (model["ymin"] + model["ymax"]))
    east_m = (columns - 1) * float(model["dx"]) * degree_m * np.cos(latitude)
    return heights, (float(east_m), (rows - 1) * float(model["dy"]) * degree_m)


def density_map(heights, size_m):
    """Red is density: none where it is steep, less towards the tops. Blue is height: shorter up there."""
    rows, columns = heights.shape
    south, east = np.gradient(heights, size_m[1] / (rows - 1), size_m[0] / (columns - 1))
    slope_deg = np.degrees(np.arctan(np.hypot(south, east)))
    top = np.clip((heights - 700.0) / 250.0, 0.0, 1.0)
    density = np.clip((26.0 - slope_deg) / 6.0, 0.0, 1.0) * (1.0 - 0.7 * top)
    pixels = np.stack([density, np.zeros_like(density), 1.0 - 0.5 * top], axis=-1)
    return np.round(255.0 * pixels).astype(np.uint8)


def scene(folder):
    """Write the folder and load it."""
    folder.mkdir(parents=True, exist_ok=True)
    heights, size_m = elevation()
    np.savez_compressed(folder / "elevation.npz", elevation=heights)
    Image.fromarray(density_map(heights, size_m)).save(folder / "density.png")
    built = gs.Scene(
        title="Hillside at the Jacksboro fault",
        ground=gs.HeightMapGround(file="elevation.npz", size_m=size_m),
        sowing=gs.Sowing(density_map="density.png", max_slope_deg=30, reach_m=400),
        grass=(gs.Grass(species="fescue"), gs.Grass(species="meadow-grass")),
        camera=NEAR,
    )
    (folder / "scene.toml").write_text(gs.dump(built), encoding="utf-8")
    return gs.load(folder)
