"""A renderer that takes a changed scene draws what a new one would."""

import numpy as np
import pytest

import greensward as gs
from greensward.techniques import TECHNIQUES

TRACK = gs.Tracks(kind="tracks", path=((-2, 2), (2, 0)), gauge_m=0.0, tyre_m=0.8)
SCENE = gs.Scene(
    ground=gs.NoiseGround(height_m=4.0, size_m=(100, 100)),
    sowing=gs.Sowing(density_per_m2=150, reach_m=30),
    object=(gs.Box(kind="box", position_m=(1, 0, 0)),),
    force=(TRACK,),
    wind=(gs.Gusts(), gs.Blast(kind="blast", power_mps=10.0)),
)
CHANGES = {
    "sun": {"sun": gs.Sun(azimuth_deg=80, elevation_deg=35, strength=0.8)},
    "night": {"sun": gs.Sun(elevation_deg=-5)},
    "sky": {"sky": gs.Sky(haze=6.0, clouds=0.9)},
    "post": {"post": gs.Post(exposure_ev=1.5, tone_map="linear", vignette=0.5)},
    "shadows": {"shadows": gs.Shadows(cascades=2, size_px=512)},
    "camera": {"camera": gs.Camera(position_m=(2, 2, 6), target_m=(0, 0, 0), fov_y_deg=70)},
    "wind": {"wind": (gs.Gusts(speed_mps=15.0, direction_deg=10.0), gs.Blast(kind="blast", centre_m=(1, 1, 0)))},
    "force": {"force": (TRACK, gs.Tracks(kind="tracks", path=((0, 4), (0, -4)), tyre_m=0.5))},
    "title": {"title": "Another"},
}
REFUSED = {
    "seed": {"seed": 4},
    "kind of wind": {"wind": (gs.Gusts(), gs.Gusts())},
    "first force": {"force": ()},
    "blur": {"post": gs.Post(blur="average")},
    "far": {"camera": gs.Camera(far_m=900.0)},
    "sowing": {"sowing": gs.Sowing(density_per_m2=100, reach_m=30)},
    "object": {"object": ()},
    "technique": {"technique": gs.TechniqueChoice(name="bezier-blades")},
}


@pytest.mark.parametrize(("name", "water"), [*((name, False) for name in CHANGES), ("sun", True), ("sky", True)])
def test_a_change_is_drawn_as_by_a_new_renderer(renderer, name, water):
    base = SCENE.model_copy(update={"water": gs.Water(level_m=-0.5)}) if water else SCENE
    changed = base.model_copy(update=CHANGES[name])
    kept, anew = renderer(base), renderer(changed)
    before = kept.render(1.0).image
    assert kept.change(changed)
    assert kept.scene is changed
    after, expected = kept.render(1.0), anew.render(1.0)
    # the renderer that goes on has moved from its own frame before, the new one from a thirtieth of a second
    assert np.array_equal(after.image, expected.image)
    assert name == "title" or not np.array_equal(after.image, before)


@pytest.mark.parametrize("size_px", [64, 512])
@pytest.mark.parametrize("technique", TECHNIQUES, ids=lambda technique: technique.name)
def test_shadow_maps_may_change_their_size(renderer, technique, size_px):
    base = SCENE.model_copy(
        update={"technique": gs.TechniqueChoice(name=technique.name), "shadows": gs.Shadows(size_px=256)}
    )
    changed = base.model_copy(update={"shadows": gs.Shadows(size_px=size_px)})
    kept, anew = renderer(base), renderer(changed)
    kept.render(1.0)
    assert kept.change(changed)
    assert np.array_equal(kept.render(1.0).image, anew.render(1.0).image)


@pytest.mark.parametrize("name", REFUSED)
def test_what_needs_sowing_or_shaders_is_refused_and_changes_nothing(renderer, name):
    kept = renderer(SCENE)
    before = kept.render(1.0).image
    assert not kept.change(SCENE.model_copy(update=REFUSED[name]))
    assert kept.scene is SCENE
    assert np.array_equal(kept.render(1.0).image, before)


def test_a_camera_in_the_ground_is_refused(renderer):
    kept = renderer(SCENE)
    with pytest.raises(gs.InputError, match="above the ground"):
        kept.change(SCENE.model_copy(update={"camera": gs.Camera(position_m=(0, -1, 0))}))
    assert kept.scene is SCENE


def test_sowing_further_than_the_camera_strays_draws_the_same_grass(renderer):
    near, far = renderer(SCENE), renderer(SCENE, stray_m=3.0)
    assert far.render().counts.considered > 0
    assert far.blades > near.blades
    difference = np.abs(far.render().image.astype(int) - near.render().image.astype(int))
    assert (difference > 8).mean() < 0.02
