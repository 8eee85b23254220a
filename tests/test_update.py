"""A renderer that takes a changed scene draws what a new one would, to the byte."""

import numpy as np
import pytest

import greensward as gs
from greensward.passes.post import Post
from greensward.renderer import Renderer
from greensward.techniques import TECHNIQUES
from live_objects import live_objects
from small_scenes import COARSE_PX

pytestmark = pytest.mark.slow


def _technique(name: str) -> gs.TechniqueChoice:
    coarse = {"texture_px": COARSE_PX} if name == "billboard-grid" else {}
    return gs.TechniqueChoice.model_validate({"name": name, **coarse})


TRACK = gs.forces.Tracks(path=((-2, 2), (2, 0)), gauge_m=0.0, tyre_m=0.8)
SCENE = gs.Scene(
    ground=gs.grounds.NoiseGround(height_m=4.0, size_m=(100, 100)),
    sowing=gs.Sowing(density_per_m2=60, reach_m=14),
    shadows=gs.Shadows(cascades=2, size_px=128),
    object=(gs.objects.Box(position_m=(1, 0, 0)),),
    force=(TRACK,),
    wind=(gs.winds.Gusts(), gs.winds.Blast(power_mps=10.0)),
)
IN_PLACE = {
    "sun": {"sun": gs.Sun(azimuth_deg=80, elevation_deg=35, strength=0.8)},
    "night": {"sun": gs.Sun(elevation_deg=-5)},
    "sky": {"sky": gs.Sky(haze=6.0, clouds=0.9)},
    "post": {"post": gs.Post(exposure_ev=1.5, tone_map="linear", vignette=0.5)},
    "shadows": {"shadows": gs.Shadows(cascades=3, size_px=256)},
    "camera": {"camera": gs.Camera(position_m=(2, 2, 6), target_m=(0, 0, 0), fov_y_deg=70)},
    "wind": {"wind": (gs.winds.Gusts(speed_mps=15.0, direction_deg=10.0), gs.winds.Blast(centre_m=(1, 1, 0)))},
    "force": {"force": (TRACK, gs.forces.Tracks(path=((0, 4), (0, -4)), tyre_m=0.5))},
    "colours": {"grass": (gs.Grass(root_colour="#ff0000", tip_colour="#0000ff", transmittance=0.1, roughness=0.9),)},
    "title": {"title": "Another"},
}
ANEW = {
    "seed": {"seed": 4},
    "kind of wind": {"wind": (gs.winds.Gusts(), gs.winds.Gusts(direction_deg=90.0))},
    "no wind": {"wind": ()},
    "helicopter": {"wind": (*SCENE.wind, gs.winds.Helicopter(centre_m=(0, 0), radius_m=2.0))},
    "no force": {"force": ()},
    "height of grass": {"grass": (gs.Grass(height_m=(0.1, 0.2)),)},
    "one more species": {"grass": (*SCENE.grass, gs.Grass(tip_colour="#ff0000"))},
    "blur": {"post": gs.Post(blur="average")},
    "far": {"camera": gs.Camera(far_m=10.0)},
    "density": {"sowing": gs.Sowing(density_per_m2=40, reach_m=14)},
    "one more object": {"object": (*SCENE.object, gs.objects.Sphere(position_m=(-1, 0, 0)))},
    "no object": {"object": ()},
    "ground": {"ground": gs.grounds.NoiseGround(height_m=1.0, size_m=(100, 100))},
    "flat": {"ground": gs.grounds.FlatGround()},
    "water": {"water": gs.Water(level_m=0.5)},
    "culling": {"culling": gs.Culling(occlusion=False, distance=False)},
    "growth": {"growth": gs.Growth(age=0.3)},
    "simulation": {"simulation": gs.Simulation(within_m=4.0, settle_s=0.5)},
    "flowers": {"flowers": (gs.Flowers(density_per_m2=5.0),)},
    **{each.name: {"technique": _technique(each.name)} for each in TECHNIQUES[:4]},
}


@pytest.fixture(scope="module")
def usual():
    """Image of the scene, drawn by a new renderer."""
    with Renderer(SCENE, size=(160, 90)) as drawn:
        return drawn.render(1.0).image


def _drawn_alike(kept: Renderer, changed: gs.Scene) -> np.ndarray:
    """The picture of a renderer that goes on, which is that of a new one."""
    with Renderer(changed, size=kept.size, ctx=kept.ctx, temporal=kept.temporal) as anew:
        expected = anew.render(1.0)
    after = kept.render(1.0)
    assert np.array_equal(after.image, expected.image)
    return after.image


@pytest.mark.parametrize(
    ("name", "water"), [*((name, False) for name in (*IN_PLACE, *ANEW)), ("sun", True), ("sky", True)]
)
def test_a_change_is_drawn_as_by_a_new_renderer(renderer, usual, name, water):
    base = SCENE.model_copy(update={"water": gs.Water(level_m=-0.5)}) if water else SCENE
    changed = base.model_copy(update={**IN_PLACE, **ANEW}[name])
    kept = renderer(base)
    before = kept.render(1.0).image
    assert water or np.array_equal(before, usual)
    assert kept.updates_in_place(changed) == (name in IN_PLACE)
    kept.update(changed)
    assert kept.scene is changed
    # the renderer that goes on has moved from its own frame before, the new one from a thirtieth of a second
    after = _drawn_alike(kept, changed)
    assert name in ("title", "visibility-buffer") or not np.array_equal(after, before)


def test_there_and_back(renderer, usual):
    """All changes one after another, and then the first scene again."""
    kept = renderer(SCENE)
    for change in (*ANEW.values(), *IN_PLACE.values()):
        kept.update(SCENE.model_copy(update=change))
        kept.render(0.5)
    kept.update(SCENE)
    assert np.array_equal(kept.render(1.0).image, usual)


def test_a_scene_is_named_as_when_it_is_first_drawn(renderer, tmp_path):
    kept = renderer(SCENE)
    file = tmp_path / "scene.toml"
    file.write_text("seed = 9\n[sowing]\ndensity_per_m2 = 20\nreach_m = 10\n")
    kept.update(file)
    assert kept.scene.seed == 9
    _drawn_alike(kept, kept.scene)


def test_the_same_scene_of_another_folder_has_other_files(renderer, tmp_path):
    scenes = []
    for name, value in (("dense", 255), ("bare", 0)):
        folder = tmp_path / name
        folder.mkdir()
        np.save(folder / "heights.npy", np.full((4, 4), 0.01 * value, np.float32))
        ground = gs.grounds.HeightMapGround(file="heights.npy", size_m=(50, 50))
        scenes.append(SCENE.model_copy(update={"ground": ground}).in_folder(folder))
    kept = renderer(scenes[0])
    kept.render(1.0)
    kept.update(scenes[1])
    assert kept.scene.resolve(".") == scenes[1].resolve(".")
    _drawn_alike(kept, scenes[1])


def test_nothing_is_done_for_the_scene_that_it_draws(renderer):
    kept = renderer(SCENE)
    kept.render(1.0)
    world = kept._world
    kept.update(SCENE.model_copy())
    assert kept._world is world
    assert kept.scene is SCENE


@pytest.mark.parametrize("size_px", [64, 256])
@pytest.mark.parametrize("technique", TECHNIQUES, ids=lambda technique: technique.name)
def test_shadow_maps_may_change_their_size(renderer, technique, size_px):
    base = SCENE.model_copy(
        update={"technique": _technique(technique.name), "shadows": gs.Shadows(cascades=2, size_px=96)}
    )
    kept = renderer(base)
    kept.render(1.0)
    kept.update(base.model_copy(update={"shadows": gs.Shadows(cascades=2, size_px=size_px)}))
    _drawn_alike(kept, kept.scene)


@pytest.mark.parametrize("change", [{"sun": gs.Sun(elevation_deg=70)}, {"seed": 4}], ids=["in place", "anew"])
@pytest.mark.parametrize("options", [{"temporal": True}, {"samples": 2}, {"scripts": {"box": lambda t: (t, 0, 0)}}])
def test_options_stay_what_they_were(renderer, change, options):
    base = SCENE.model_copy(update={"object": (gs.objects.Box(position_m=(1, 0, 0), name="box"),)})
    changed = base.model_copy(update=change)
    kept, anew = renderer(base, **options), renderer(changed, **options)
    kept.render(0.0)
    kept.resize((100, 60))
    anew.resize((100, 60))
    kept.update(changed)
    if "temporal" in options and "sun" in change:
        kept.render(9.0)  # a cut, after which its history begins anew
    assert np.array_equal(kept.render(1.0).image, anew.render(1.0).image)


def test_state_of_the_grass_goes_on_where_nothing_is_built_anew(renderer):
    base = SCENE.model_copy(update={"simulation": gs.Simulation(within_m=4.0, settle_s=0.5)})
    kept = renderer(base)
    kept.render(1.0)
    before = kept.checkpoint()
    kept.update(base.model_copy(update={"sun": gs.Sun(elevation_deg=70)}))
    after = kept.checkpoint()
    assert before.keys() == after.keys()
    assert all(np.array_equal(before[name], after[name]) for name in before)
    kept.update(base.model_copy(update={"seed": 4}))
    assert kept.checkpoint().keys() == {"time_s", "camera"}


# Refused ----------------------------------------------------------------------------------------------------

REFUSED = {
    "a camera in the ground": ({"camera": gs.Camera(position_m=(0, -1, 0))}, "above the ground"),
    "and another seed": ({"seed": 4, "camera": gs.Camera(position_m=(0, -1, 0))}, "above the ground"),
    "no such technique": ({"technique": gs.TechniqueChoice(name="no-such")}, "technique.name"),
    "no such setting": ({"technique": gs.TechniqueChoice(name="bezier-blades", x=1)}, "technique.x"),
    "no such file": ({"object": (gs.objects.Mesh(file="none.obj", position_m=(0, 0, 0)),)}, "none.obj"),
    "no such map": ({"sowing": gs.Sowing(density_map="none.png")}, "none.png"),
    "no such ground": ({"ground": gs.grounds.HeightMapGround(file="none.png")}, "none.png"),
    "a technique that cannot": (
        {"technique": gs.TechniqueChoice(name="billboard-grid"), "growth": gs.Growth()},
        r"\[growth\]",
    ),
    "a force without a file": ({"force": (gs.forces.ForceMap(file="none.png"),)}, "none.png"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_refused_scene_leaves_the_renderer_drawing_the_old_one(device, renderer, usual, name):
    change, words = REFUSED[name]
    kept = renderer(SCENE)
    kept.render(1.0)
    counts = {kind: len(names) for kind, names in live_objects(device).items()}
    before = device.state.snapshot()
    for _ in range(2):
        with pytest.raises(gs.InputError, match=words):
            kept.update(SCENE.model_copy(update=change))
        assert kept.scene is SCENE
        assert device.state.snapshot() == before
        assert np.array_equal(kept.render(1.0).image, usual)
    assert {kind: len(names) for kind, names in live_objects(device).items()} == counts, "nothing is left behind"


def test_an_error_at_the_end_of_building_leaves_the_renderer_drawing_the_old_one(
    device, renderer, usual, monkeypatch
):
    kept = renderer(SCENE)
    kept.render(1.0)
    counts = {kind: len(names) for kind, names in live_objects(device).items()}
    usual_post = Post.__init__
    calls = 0

    def broken(self, *arguments, **options):
        nonlocal calls
        usual_post(self, *arguments, **options)
        calls += 1
        if calls == 1:
            raise gs.GreenswardError("a driver's complaint")

    monkeypatch.setattr(Post, "__init__", broken)
    with pytest.raises(gs.GreenswardError, match="complaint"):
        kept.update(SCENE.model_copy(update={"seed": 4}))
    assert calls == 2
    kept.render(1.0)
    assert {kind: len(names) for kind, names in live_objects(device).items()} == counts
    assert np.array_equal(kept.render(1.0).image, usual)


def test_a_camera_under_water_can_be_taken_back(renderer):
    base = SCENE.model_copy(update={"ground": gs.grounds.FlatGround(), "water": gs.Water(level_m=1.0)})
    kept = renderer(base)
    before = kept.render(1.0).image
    kept.update(base.model_copy(update={"camera": gs.Camera(position_m=(0, 0.5, 6), target_m=(0, 0.5, 0))}))
    with pytest.raises(gs.InputError, match="above the water"):
        kept.render(1.0)
    kept.update(base)
    assert np.array_equal(kept.render(1.0).image, before)
