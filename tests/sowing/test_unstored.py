"""Blades that shaders grow from the seed whenever they look at them."""

import numpy as np
import pytest

from blades import numbers_of
from greensward.scene import Camera, SceneError, SurfaceClass
from greensward.techniques import chosen
from small_scenes import BREEZE, NOISE, small_scene

AOVS = ["class", "depth", "motion", "normal", "albedo"]


def _scene(stored_m, **tables):
    sowing = {"density_per_m2": 150.0, "full_density_m": 4.0, "reach_m": 40.0, "drift": 0.7, "clumping": 0.5}
    if stored_m is not None:
        sowing["stored_m"] = stored_m
    return small_scene(sowing=sowing, wind=[BREEZE], **{"ground": {**NOISE, "height_m": 3.0}, **tables})


@pytest.mark.slow
@pytest.mark.parametrize("stored_m", [0.0, 6.0, 1000.0])
def test_they_are_the_same_blades(renderer, stored_m):
    stored, unstored = (renderer(_scene(each), size=(320, 180)) for each in (None, stored_m))
    frames = [each.render(2.0, aovs=AOVS) for each in (stored, unstored)]
    here, there = (frame.truth for frame in frames)
    assert (here["class"] == SurfaceClass.GRASS).mean() > 0.2
    # two programs may round differently, and a blade grows or does not by a hair
    assert (here["class"] == there["class"]).mean() > 0.998
    same = np.isclose(here["depth"], there["depth"], rtol=1e-4)
    assert same.mean() > 0.995
    for name in ("motion", "normal", "albedo"):
        assert np.isclose(here[name], there[name], atol=0.02).all(-1)[same].mean() > 0.995, name
    assert np.abs(frames[0].image.astype(int) - frames[1].image).mean() < 0.3
    assert abs(frames[1].counts.drawn - frames[0].counts.drawn) <= 0.001 * frames[0].counts.drawn


def test_ids_tell_blades_apart_across_the_border(renderer):
    drawn = renderer(_scene(6.0), size=(320, 180))
    ids = drawn.render(2.0, aovs=["blade_id"]).truth["blade_id"]
    stored = numbers_of(drawn._world.field, ids) > 0
    assert len(np.unique(ids[stored])) > 50
    assert len(np.unique(ids[(ids > 0) & ~stored])) > 50
    # a blade has the same id whether it is stored or not
    all_stored = renderer(_scene(None), size=(320, 180)).render(2.0, aovs=["blade_id"]).truth["blade_id"]
    assert (ids == all_stored).mean() > 0.995


def test_they_take_no_memory(renderer):
    stored, unstored = (renderer(_scene(each)) for each in (None, 0.0))
    for each in (stored, unstored):
        each.render(0.0)
    candidates = unstored._world.field.unstored.count
    assert unstored.blades == 0
    assert candidates > 10_000
    assert unstored.field_bytes < candidates  # a bit and tiles, where a stored blade takes 96 bytes
    assert stored.field_bytes > 80 * stored.blades > 500_000


def test_shadows_of_both_kinds(renderer):
    shaded = {"enabled": True, "size_px": 512, "cascades": 2, "nearest_m": 8.0, "furthest_m": 30.0}
    images = [renderer(_scene(each, shadows=shaded), size=(320, 180)).render(2.0).image for each in (None, 5.0)]
    assert np.abs(images[0].astype(int) - images[1]).mean() < 0.1


def test_simulation_goes_on_near_the_camera(renderer):
    drawn = renderer(_scene(6.0, simulation={"within_m": 5.0}))
    frame = drawn.render(0.0)
    assert 0 < frame.counts.simulated <= drawn.blades
    assert frame.counts.drawn > frame.counts.simulated / 4


def test_the_field_follows_the_camera(renderer):
    drawn, fresh = renderer(_scene(5.0)), renderer(_scene(5.0))
    away = Camera(position_m=(60.0, 1.3, -45.0), target_m=(60.0, 0.3, -55.0))
    drawn.render(1.0)
    moved = drawn.render(1.0, camera=away)
    assert moved.image.tobytes() == fresh.render(1.0, camera=away).image.tobytes()


@pytest.mark.parametrize(
    ("tables", "why"),
    [
        ({"technique": {"name": "bezier-blades"}}, "is for visibility-buffer only"),
        ({"growth": {}}, "cannot grow older"),
    ],
)
def test_what_does_not_go_with_it_is_told(tables, why):
    with pytest.raises(SceneError, match=f"sowing.stored_m: .*{why}"):
        chosen(_scene(5.0, **tables))
