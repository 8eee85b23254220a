"""Heads of blades: every level of detail shows as much of them, in their colours and at their places."""

from itertools import pairwise

import numpy as np
import pytest

from blades import blades_by_number, has_head, numbers_of
from greensward.passes.heads.meshes import LEVELS, OUTLINES, head_meshes
from greensward.scene import Scene, SurfaceClass
from greensward.scene.grass import HEADS
from reprojection import world_points
from small_scenes import GRASS, small_scene

_DAISY = {**GRASS, "head": "daisy", "head_size_m": [0.06, 0.06], "head_share": 0.3}


def _area(triangles: np.ndarray, elevation: float, views: int = 5, cells: int = 100) -> float:
    """Area that triangles (n, 3, 3) cover, seen from around at an angle above the side."""
    covered = 0.0
    for turn in 2 * np.pi * (np.arange(views) + 0.3) / views:
        to_viewer = np.array([np.cos(elevation) * np.cos(turn), np.sin(elevation), np.cos(elevation) * np.sin(turn)])
        across = np.cross([0.0, 1.0, 0.0], to_viewer)
        across /= np.linalg.norm(across)
        flat = triangles @ np.stack([across, np.cross(to_viewer, across)], 1)
        low, high = flat.min((0, 1)), flat.max((0, 1))
        cell = (high - low) / cells
        x, y = (low + (np.arange(cells)[:, None] + 0.5) * cell).T
        shown = np.zeros((cells, cells), bool)
        for corners in flat:
            first, last = np.clip((([corners.min(0), corners.max(0)] - low) / cell).astype(int), 0, cells - 1)
            box = np.s_[first[1] : last[1] + 1, first[0] : last[0] + 1]
            sides = [
                (b[0] - a[0]) * (y[box[0], None] - a[1]) - (b[1] - a[1]) * (x[None, box[1]] - a[0])
                for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)
            ]
            shown[box] |= np.all(np.array(sides) >= 0, axis=0) | np.all(np.array(sides) <= 0, axis=0)
        covered += shown.sum() * cell.prod() / views
    return covered


@pytest.mark.parametrize("kind", [kind for kind in HEADS if kind != "none"])
def test_every_level_shows_as_much_of_a_head(kind):
    mesh = head_meshes()[HEADS.index(kind)].astype(float)
    for elevation in np.radians([10.0, 30.0, 60.0]):
        side, along = OUTLINES[kind]
        told = np.hypot(side * np.cos(elevation), along * np.sin(elevation))
        for first, count in LEVELS:
            corners = mesh[first : first + count].reshape(-1, 3, 8)
            corners = corners[corners[:, 0, 3] >= 0, :, :3]  # without the stem
            corners = corners[
                np.abs(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])).sum(1) > 0
            ]
            assert _area(corners, elevation) == pytest.approx(told, rel=0.15, abs=0.004), (kind, elevation, first)


def test_heads_sit_at_the_tips(renderer):
    scene = small_scene(grass=[_DAISY], sowing={"full_density_m": 100.0})
    _sit_at_tips(renderer(scene), scene, 4.5)


def test_heads_of_objects_sit_at_the_tips_at_any_distance(renderer):
    """The places of neighbours on an object are unknown, so a head there stands for others only by its size."""
    grown = {
        "kind": "box",
        "position_m": [0.0, 0.0, -6.0],
        "size_m": [4.0, 0.5, 4.0],
        "grass": {"density_per_m2": 120.0},
    }
    scene = small_scene(grass=[_DAISY], object=[grown], sowing={"full_density_m": 3.0, "reach_m": 40.0})
    drawn = renderer(scene, size=(640, 360))
    frame = drawn.render(aovs=["class", "depth", "blade_id"])
    p = world_points(drawn, scene.camera, frame.truth["depth"])
    on_top = (frame.truth["class"] == SurfaceClass.FLOWER) & (np.abs(p[..., 2] + 6) < 1.8) & (p[..., 1] > 0.6)
    assert on_top.sum() > 100
    ids, counts = np.unique(frame.truth["blade_id"][on_top], return_counts=True)
    spans = [np.ptp(p[on_top & (frame.truth["blade_id"] == each)], axis=0).max() for each in ids[counts > 1]]
    assert len(spans) > 20
    assert max(spans) < 0.2  # of a head as large as nine


def test_far_heads_of_objects_stand_on_stems(renderer):
    box = {"kind": "box", "position_m": [0.0, 0.0, -10.0], "size_m": [8.0, 2.0, 3.0]}
    tall = {"species": "daisy", "head_share": 1.0, "height_m": [0.6, 0.8], "stiffness": [1.0, 1.0]}
    camera = {"position_m": [0.0, 2.2, 0.0], "target_m": [0.0, 2.2, -10.0], "fov_y_deg": 24}
    scene = small_scene(
        grass=[{**tall, "width_m": [0.001, 0.001]}],
        object=[{**box, "grass": {"density_per_m2": 10.0}}],
        camera=camera,
        wind=[],
        sowing={"density_per_m2": 0.0},
    )
    truth = renderer(scene, size=(320, 180)).render(aovs=["class", "blade_id"]).truth
    horizon = 90
    stems = heads = 0
    for each in np.unique(truth["blade_id"][:horizon][truth["class"][:horizon] == SurfaceClass.FLOWER]):
        rows, columns = np.nonzero((truth["class"] == SurfaceClass.FLOWER) & (truth["blade_id"] == each))
        if rows.max() < horizon - 5 and np.ptp(columns) < 6:
            own = (truth["class"] == SurfaceClass.GRASS) & (truth["blade_id"] == each)
            heads += 1
            stems += own[rows.max() + 1 : rows.max() + 5].any(axis=1).sum()
    assert heads > 20
    assert stems > 2 * heads


def _sit_at_tips(drawn, scene, within_m):
    truth = drawn.render(aovs=["class", "depth", "blade_id"]).truth
    rows, columns = np.nonzero((truth["class"] == SurfaceClass.FLOWER) & (truth["depth"] < within_m))
    assert len(rows) > 100
    field = drawn._world.field
    blade = blades_by_number(field)[numbers_of(field, truth["blade_id"][rows, columns])]
    p = world_points(drawn, scene.camera, truth["depth"])[rows, columns]
    assert np.linalg.norm(p - blade["tip"], axis=1).max() < 0.12
    assert has_head(blade).all()


_EDGES_M = 8.0, 12.0, 18.0, 28.0
_BLUE = {"head_colour": "#0000ff"}


def _strip(full_density_m: float, sun_deg: float, seed: int) -> Scene:
    grass = [
        {"species": "meadow-grass", "share": 0.81},
        {"species": "bent", "share": 0.05, **_BLUE},
        {"species": "timothy", "share": 0.04, **_BLUE},
        {"species": "daisy", "share": 0.05, "height_m": [0.3, 0.5]},
        {"species": "poppy", "share": 0.05},
    ]
    return Scene.model_validate(
        {
            "seed": seed,
            "ground": {"kind": "flat", "size_m": [10.0, 64.0], "beyond": "bare"},
            "sowing": {"drift": 0, "density_per_m2": 500, "full_density_m": full_density_m},
            "grass": grass,
            "wind": [],
            "sun": {"elevation_deg": sun_deg},
            "camera": {"position_m": [0, 3.0, 31.0], "target_m": [0, 0.0, 17.0], "fov_y_deg": 30},
        }
    )


def _heads_seen(renderer, scene: Scene) -> np.ndarray:
    """Shares of flowers and seed heads and linear colour by band, (bands, 5)."""
    drawn = renderer(scene, size=(480, 270), samples=2)
    frame = drawn.render(aovs=["class", "albedo", "depth"])
    away = 31.0 - world_points(drawn, scene.camera, frame.truth["depth"])[..., 2]
    albedo, colour = frame.truth["albedo"], (frame.image / 255.0) ** 2.2
    flowers = frame.truth["class"] == SurfaceClass.FLOWER
    seeds = albedo[..., 2] > 2.5 * albedo[..., :2].max(-1)
    rows = []
    for low, high in pairwise(_EDGES_M):
        band = (away >= low) & (away < high)
        rows.append([flowers[band].mean(), seeds[band].mean(), *colour[band].mean(0)])
    drawn.release()
    return np.array(rows)


@pytest.mark.slow
@pytest.mark.parametrize("sun_deg", [12.0, 58.0])
def test_heads_keep_their_cover_and_colour_with_distance(renderer, sun_deg):
    full, less = (
        np.mean([_heads_seen(renderer, _strip(metres, sun_deg, seed)) for seed in (1, 2)], axis=0)
        for metres in (1000.0, 5.5)
    )
    assert (full[:, :2] > 0.004).all()
    ratio = less / full
    assert (np.abs(ratio[:, :2] - 1.0) < 0.3).all(), ratio
    assert (np.abs(ratio[:, 2:] - 1.0) < 0.15).all(), ratio
