"""The panel knows every key of the models, and changes scenes through them."""

import pytest
from pydantic import BaseModel

import greensward as gs
from greensward.scene import SceneError
from greensward.scene.kinds import models_in
from greensward.techniques import SETTINGS
from greensward.viewer.fields import all_keys, can_be_made, fields_of, new_table, slider_range, value_at, with_value


def _models(model: type[BaseModel], found: set[type[BaseModel]]) -> set[type[BaseModel]]:
    if model not in found:
        found.add(model)
        for field in model.model_fields.values():
            for inner in models_in(field.annotation):
                _models(inner, found)
    return found


MODELS = sorted(
    _models(gs.Scene, set()) | set(SETTINGS.values()), key=lambda model: f"{model.__module__}{model.__name__}"
)


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.__name__)
def test_every_key_has_help_and_a_kind(model):
    for spec in fields_of(model):
        assert spec.help, spec.name
        assert spec.label == spec.label.lower()
        if spec.kind == "choice":
            assert len(spec.choices) > 1
        if spec.kind in ("table", "tables"):
            assert spec.models
        if spec.kind in ("number", "count"):
            assert spec.low is None or spec.high is None or spec.low < spec.high


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.__name__)
def test_sliders_hold_the_usual_value_and_stay_within_limits(model):
    for spec in fields_of(model):
        if spec.kind in ("number", "count") and spec.default is not None:
            low, high = slider_range(spec, float(spec.default))
            assert low <= spec.default <= high, spec.name
            assert low < high
            assert spec.low is None or low >= spec.low
            assert spec.high is None or high <= spec.high


def test_units_and_ranges_come_from_the_models():
    specs = {spec.name: spec for spec in fields_of(gs.winds.Gusts)}
    assert (specs["speed_mps"].unit, specs["speed_mps"].label) == ("m/s", "speed")
    assert (specs["gustiness"].low, specs["gustiness"].high) == (0.0, 1.0)
    assert {spec.name: spec for spec in fields_of(gs.Sowing)}["density_per_m2"].unit == "/m²"
    assert {spec.name: spec for spec in fields_of(gs.Grass)}["height_m"].is_range


def test_a_slider_reaches_to_a_value_beyond_the_usual():
    spec = next(spec for spec in fields_of(gs.Sowing) if spec.name == "reach_m")
    assert slider_range(spec, 50_000.0)[1] >= 50_000.0


@pytest.mark.parametrize("name", gs.presets())
def test_every_key_of_the_presets_can_be_set_to_what_it_is(name):
    scene = gs.load(name)
    for path, spec in all_keys(scene):
        if spec.name == "species":
            continue  # it brings keys of its own
        assert with_value(scene, path, value_at(scene, path)) == scene, path


def test_a_changed_scene_keeps_its_folder_and_is_checked():
    scene = gs.load("jahrmann2013-oasis")
    windy = with_value(scene, ("wind", 0, "speed_mps"), 12.0)
    assert windy.wind[0].speed_mps == 12.0
    assert windy.resolve("a") == scene.resolve("a")
    with pytest.raises(SceneError, match=r"sun\.elevation_deg: must be at most 90 \(got 1000"):
        with_value(scene, ("sun", "elevation_deg"), 1000.0)
    with pytest.raises(SceneError, match=r"post\.exposure_ev: must be a finite number"):
        with_value(scene, ("post", "exposure_ev"), float("inf"))
    with pytest.raises(SceneError, match=r"grass\[0\]\.height_m"):
        with_value(scene, ("grass", 0, "height_m"), (3.0, 1.0))


def test_another_species_brings_its_own_look():
    scene = with_value(gs.Scene(grass=(gs.Grass(share=0.3),)), ("grass", 0, "species"), "poppy")
    assert scene.grass[0] == gs.Grass(species="poppy", share=0.3)


def test_settings_of_the_technique_are_keys_of_its_table():
    scene = with_value(gs.Scene(), ("technique", "roundness"), 0.25)
    assert scene.technique.model_extra == {"roundness": 0.25}


@pytest.mark.parametrize(
    "model", [m for m in MODELS if m is not gs.Scene and can_be_made(m)], ids=lambda m: m.__name__
)
def test_a_new_table_of_every_kind_can_be_made(model):
    if any(field.is_required() and name in ("times_s",) for name, field in model.model_fields.items()):
        pytest.skip("a path of an object is written, not made")
    assert isinstance(new_table(model, (3.0, 0.0, -2.0)), model)
