"""Scenes that draw in a tenth of a second on a CPU: a few thousand blades, every look constant pinned here."""

from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from greensward.scene import Scene

GRASS = {
    "height_m": [0.3, 0.6],
    "width_m": [0.012, 0.02],
    "stiffness": [0.4, 0.8],
    "tilt_deg": [8.0, 40.0],
    "bend": [0.1, 0.5],
    "head": "none",
    "shape": "quadratic",
}
BREEZE = {"kind": "gusts", "direction_deg": 250.0, "speed_mps": 5.0, "gust_m": 4.0}
_BASE: dict[str, Any] = {
    "seed": 5,
    "ground": {"kind": "flat", "size_m": [200.0, 200.0]},
    "grass": [GRASS],
    "sowing": {"density_per_m2": 60.0, "full_density_m": 5.0, "reach_m": 12.0, "drift": 0.0, "clumping": 0.3},
    "wind": [],
    "sun": {"azimuth_deg": 120.0, "elevation_deg": 35.0},
    "sky": {"clouds": 0.0},
    "shadows": {"size_px": 256, "cascades": 1},
    "camera": {"position_m": [0.0, 1.3, 4.0], "target_m": [0.0, 0.3, -3.0], "far_m": 400.0},
}
NOISE = {"kind": "noise", "size_m": [80.0, 80.0], "samples": 65, "height_m": 8.0, "wavelength_m": 25.0, "octaves": 3}

DRONE = {
    "kind": "sphere",
    "position_m": [0.0, 1.0, 0.0],
    "drawn": False,
    "collides": False,
    "path": {"times_s": [0.0, 2.0], "positions_m": [[-6.0, 1.0, 0.0], [6.0, 1.0, 0.0]]},
}
"""Object that nothing shows, for winds that objects make."""


COARSE_PX = 128
"""Texels of a billboard unless a test asks for others: they are drawn in a tenth of the time of the default's."""


def small_scene(**tables: Any) -> Scene:
    """The base scene; a table given updates its keys, anything else replaces it."""
    values = dict(_BASE)
    for name, table in tables.items():
        old = values.get(name)
        same_kind = isinstance(old, dict) and table.get("kind", old.get("kind")) == old.get("kind")
        values[name] = {**old, **table} if same_kind else table
    technique = values.get("technique", {})
    if technique.get("name") == "billboard-grid":
        values["technique"] = {"texture_px": COARSE_PX, **technique}
    return Scene.model_validate(values)


def with_pictures(folder: Path, pictures: dict[str, np.ndarray], **tables: Any) -> Scene:
    """A scene whose files are these arrays, written into a folder: uint8 (rows, columns, 3 or 4)."""
    for name, pixels in pictures.items():
        Image.fromarray(pixels).save(folder / name)
    return small_scene(**tables).in_folder(folder)
