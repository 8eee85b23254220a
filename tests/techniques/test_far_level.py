"""Blades near the camera and, beyond `sowing.traced_m`, rays through pictures of them: same cover and colour."""

import numpy as np
import pytest

from greensward.scene import SceneError, SurfaceClass
from greensward.techniques import FAR, TECHNIQUES
from live_objects import live_objects
from small_scenes import BREEZE, GRASS, NOISE, small_scene

BLADED = [technique.name for technique in TECHNIQUES if technique is not FAR]
DENSE = {"density_per_m2": 250.0, "full_density_m": 100.0, "reach_m": 60.0}
TRACED_M = 20.0
STRIP = {"kind": "flat", "size_m": [34.0, 62.0], "beyond": "bare"}
"""As much ground as a square picture shows within reach, with the camera at its southern edge."""
SOUTH_M = 30.0
SQUARE = 96, 96
AHEAD = {"position_m": [0.0, 1.6, SOUTH_M], "target_m": [0.0, 0.4, SOUTH_M - 20.0], "fov_y_deg": 30.0}


def _scene(technique="visibility-buffer", traced_m=TRACED_M, **tables):
    sowing = {**DENSE, **({} if traced_m is None else {"traced_m": traced_m}), **tables.pop("sowing", {})}
    base = {"ground": STRIP, "camera": AHEAD, "shadows": {"enabled": False}, "culling": {"occlusion": False}}
    return small_scene(technique={"name": technique}, sowing=sowing, **{**base, **tables})


def _away(drawn, shape) -> np.ndarray:
    """Distance in metres from the camera at which each pixel's ray meets level ground, inf above the horizon."""
    height, width = shape
    view_from_world, clip_from_view = drawn.camera_matrices()
    x = (2.0 * (np.arange(width) + 0.5) / width - 1.0)[None, :] / clip_from_view[0, 0]
    y = (1.0 - 2.0 * (np.arange(height) + 0.5) / height)[:, None] / clip_from_view[1, 1]
    rays = np.stack(np.broadcast_arrays(x, y, -1.0), -1) @ view_from_world[:3, :3]
    along = np.where(rays[..., 1] < 0.0, -AHEAD["position_m"][1] / np.minimum(rays[..., 1], -1e-9), np.inf)
    return along * np.linalg.norm(rays, axis=-1)


@pytest.mark.slow
@pytest.mark.usefixtures("coarse_far")
@pytest.mark.parametrize(
    ("stage", "technique"), [*(("compute", name) for name in BLADED), ("fragment", "visibility-buffer")]
)
def test_grass_goes_on_where_blades_end(renderer, technique, stage):
    ended = _scene(technique, None, sowing={"reach_m": TRACED_M})
    scenes = ended, _scene(technique, None), _scene(technique)
    short, long, far = (renderer(scene, size=SQUARE, stage=stage) for scene in scenes)
    few, blades, both = (drawn.render(aovs=["class", "depth", "blade_id"]) for drawn in (short, long, far))
    assert far.blades == short.blades
    away = _away(far, both.image.shape[:2])
    beyond, near = (away > 25.0) & (away < 45.0), both.truth["depth"] < 12.5
    assert (few.truth["class"][beyond] == SurfaceClass.GRASS).mean() < 0.3
    assert (both.truth["class"][beyond] == SurfaceClass.GRASS).mean() > 0.95
    assert both.truth["depth"][beyond].min() > 12.0
    assert len(np.unique(both.truth["blade_id"][beyond])) > 100
    # nearer than that nothing has changed
    assert near.sum() > 1000
    for name in ("class", "depth"):
        assert np.array_equal(blades.truth[name][near], both.truth[name][near]), name
    assert np.array_equal(blades.image[near], both.image[near])


@pytest.mark.slow
def test_the_seam_is_not_seen(renderer):
    """Cover and colour by distance are those of blades all the way, where blades end and beyond."""
    seen = []
    for traced_m in (None, TRACED_M):
        drawn = renderer(_scene(traced_m=traced_m), size=(180, 180), samples=4)
        frame = drawn.render(aovs=["class"])
        away = _away(drawn, (180, 180))
        light = (frame.image / 255.0) ** 2.2
        for low, high in ((10.0, 15.0), (15.0, 20.0), (20.0, 28.0), (28.0, 40.0)):
            band = (away >= low) & (away < high)
            seen.append([(frame.truth["class"][band] == SurfaceClass.GRASS).mean(), *light[band].mean(axis=0)[:2]])
    blades, both = np.array(seen).reshape(2, 4, 3)
    assert blades[:, 0].min() > 0.9
    ratio = both / blades
    assert np.abs(ratio[0] - 1.0).max() < 1e-6
    assert np.abs(ratio[:, 0] - 1.0).max() < 0.04
    assert np.abs(ratio[:, 1:] - 1.0).max() < 0.08


@pytest.mark.slow
@pytest.mark.usefixtures("coarse_far")
def test_wind_moves_what_is_traced(renderer):
    drawn = renderer(_scene(wind=[BREEZE]), size=SQUARE)
    before, after = (drawn.render(time, aovs=["motion", "depth"]) for time in (0.0, 0.5))
    far = (after.truth["depth"] > 22.0) & (after.truth["depth"] < 50.0)
    assert (before.image[far] != after.image[far]).mean() > 0.1
    assert np.abs(after.truth["motion"][far]).max() > 0.01


@pytest.mark.slow
@pytest.mark.usefixtures("coarse_far")
def test_it_stands_on_hills_and_behind_objects(renderer):
    box = {"kind": "box", "position_m": [0.0, 0.0, -24.0], "size_m": [3.0, 3.0, 3.0]}
    camera = {**AHEAD, "position_m": [0.0, 1.6, 0.0], "target_m": [0.0, 0.4, -20.0]}
    tables = {"ground": NOISE, "object": [box], "camera": camera}
    drawn = renderer(_scene(**tables, wind=[BREEZE], sowing={"density_per_m2": 100.0}))
    truth = drawn.render(aovs=["class", "depth"]).truth
    assert (truth["class"] == SurfaceClass.GRASS).mean() > 0.2
    bare = renderer(_scene(**tables, grass=[])).render(aovs=["class", "depth"]).truth
    shown = (truth["class"] == SurfaceClass.OBJECT) & (bare["class"] == SurfaceClass.OBJECT)
    assert shown.sum() > 10
    assert (truth["depth"] <= bare["depth"] * 1.001 + 0.02)[bare["class"] != SurfaceClass.SKY].all()


@pytest.mark.slow
@pytest.mark.usefixtures("coarse_far")
@pytest.mark.parametrize("stage", ["fragment", "compute"])
def test_every_resource_is_released(device, renderer, stage):
    before = live_objects(device)
    drawn = renderer(_scene(water={"level_m": -1.0}), size=SQUARE, stage=stage)
    drawn.render()
    drawn.release()
    assert live_objects(device) == before


@pytest.mark.slow
@pytest.mark.usefixtures("coarse_far")
def test_fields_without_end(renderer):
    """Blades that are not stored end there as well."""
    drawn = renderer(_scene(sowing={"stored_m": 5.0}), size=SQUARE)
    truth = drawn.render(aovs=["class"]).truth
    away = _away(drawn, truth["class"].shape)
    assert (truth["class"][(away > 8.0) & (away < 50.0)] == SurfaceClass.GRASS).mean() > 0.9


def test_what_cannot_be_traced_is_refused(renderer):
    with pytest.raises(SceneError, match=r"sowing.traced_m: .* billboard-grid draws none; leave traced_m out"):
        renderer(_scene("billboard-grid"))
    with pytest.raises(SceneError, match=r"sowing.traced_m: .*\[growth\].*leave traced_m out"):
        renderer(_scene(growth={"age": 0.5}))
    with pytest.raises(ValueError, match=r"traced_m must be below reach_m, 60 \(got 60\)"):
        _scene(traced_m=60.0)


def test_a_bare_field_has_nothing_to_trace(renderer):
    for bare in ({"sowing": {"density_per_m2": 0.0}}, {"grass": [{**GRASS, "share": 0.0}]}, {"grass": []}):
        truth = renderer(_scene(**bare)).render(aovs=["class"]).truth
        assert not (truth["class"] == SurfaceClass.GRASS).any()
