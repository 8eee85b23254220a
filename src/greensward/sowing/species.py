"""Species and drifts of the scene as one uniform block."""

import math

import numpy as np

from greensward.gpu.layouts import block, constants
from greensward.scene import Grass, Scene
from greensward.scene.base import linear
from greensward.scene.grass import HEADS, MOST_SPECIES, SHAPES
from greensward.sowing.growth import cover_at

_ROWS = ("MIX", "SIZE", "STANCE", "HABIT", "ROOT", "TIP", "DRY", "HEAD", "HEART")
"""Rows of a species, in the order of `_rows`."""
ROWS = len(_ROWS)
constants("SpeciesRow", {"SPECIES_ROWS": ROWS, **{name: row for row, name in enumerate(_ROWS)}})

SWARD_BLOCK = block(
    "Sward",
    ("species", "vec4", MOST_SPECIES * ROWS),  # rows in the order of `_rows`
    ("count", "int"),
    ("seed", "uint"),
    ("density_per_m2", "float"),
    ("min_normal_y", "float"),
    ("clump_m", "float"),
    ("clumping", "float"),
    ("drift_m", "float"),
    ("drift", "float"),
    ("full_density_m", "float"),
    ("reach_m", "float"),
    ("blades_m", "float"),
    ("canopy_m", "float"),
    ("blade_m", "vec2"),  # mean length and width of a blade
    ("leaf_m", "float"),
    ("anchor_leaf", "ivec2"),  # leaf, and cell of clumps, in which the anchor lies, and where in the cell
    ("anchor_clump", "ivec2"),
    ("in_clump", "vec2"),
    ("along_normal", "float"),  # direction of growth, from the vertical to the normal of the ground
    ("towards_normal", "float"),  # factor on the level part of that direction which about gives the normal
    ("grown", "float"),  # cover so far, as a part of the full-grown field's
)


def _rows(grass: Grass, share: float) -> list[tuple[float, ...]]:
    tilt = tuple(math.radians(angle) for angle in grass.tilt_deg)
    size_low, size_high = grass.head_size_m
    return [
        (share, grass.patchiness, SHAPES.index(grass.shape), HEADS.index(grass.head)),
        (*grass.height_m, *grass.width_m),
        (*grass.stiffness, *tilt),
        (*grass.bend, *grass.dryness),
        (*linear(grass.root_colour), grass.transmittance),
        (*linear(grass.tip_colour), grass.roughness),
        (*linear(grass.dry_colour), grass.head_share if grass.head != "none" else 0.0),
        (*linear(grass.head_colour), size_low),
        (*linear(grass.heart_colour), size_high),
    ]


def leaf_edge_m(density_per_m2: float) -> float:
    """Edge of the smallest tile, a power of two in metres, for one to four thousand blades."""
    return float(2.0 ** math.floor(math.log2(math.sqrt(4000.0 / max(density_per_m2, 1e-3)))))


def sward_values(scene: Scene) -> dict[str, object]:
    """Members of the `Sward` block for a scene."""
    sowing = scene.sowing
    table = np.zeros((MOST_SPECIES * ROWS, 4), np.float32)
    shares = np.array([grass.share for grass in scene.grass] or [0.0])
    for i, grass in enumerate(scene.grass):
        table[i * ROWS : (i + 1) * ROWS] = _rows(grass, grass.share / max(shares.sum(), 1e-9))
    sizes = np.array([(sum(grass.height_m) / 2.0, sum(grass.width_m) / 2.0) for grass in scene.grass] or [(0.0, 0.0)])
    mean = shares @ sizes / max(shares.sum(), 1e-9)
    return {
        "species": table,
        "count": len(scene.grass) if shares.sum() > 0 else 0,
        "seed": scene.seed,
        "density_per_m2": sowing.density_per_m2,
        "min_normal_y": math.cos(math.radians(sowing.max_slope_deg)),
        "clump_m": sowing.clump_m,
        "clumping": sowing.clumping,
        "drift_m": sowing.drift_m,
        "drift": sowing.drift,
        "full_density_m": sowing.full_density_m,
        "reach_m": sowing.reach_m,
        "blades_m": sowing.blades_m,
        "canopy_m": 0.8 * float(mean[0]),
        "blade_m": mean,
        "along_normal": sowing.along_normal,
        "towards_normal": round(1.0 / max(sowing.along_normal, 0.01), 2),
        "leaf_m": leaf_edge_m(sowing.density_per_m2),
        "grown": cover_at(scene.growth, 0.0),
    }
