"""The workloads: what their sources say, in scenes that load."""

import numpy as np
import pytest

from greensward.bench.variants import split_names, variant_of
from greensward.bench.workloads import (
    QUICK,
    STRIPS,
    chosen_techniques,
    chosen_workloads,
    drawn_by,
    toy,
    workloads,
)
from greensward.ground import HeightField
from greensward.library import load
from greensward.scene import InputError, SceneError
from greensward.scene.load import dump
from greensward.techniques import SETTINGS

ALL = workloads()
CASES = [pytest.param(each, case, id=f"{name}: {case.name}") for name, each in ALL.items() for case in each.cases]


@pytest.mark.parametrize(("workload", "case"), CASES)
def test_every_case_is_a_scene_for_its_techniques(workload, case):
    scene = case.build()
    known = [name for name in workload.techniques if name != STRIPS]
    assert known
    for technique in known:
        drawn = drawn_by(technique, case.scene(technique), case.settings)
        name, settings = variant_of(technique)
        assert drawn.technique.name == name
        assert settings.items() <= drawn.technique.model_extra.items()
        SETTINGS[name].model_validate(drawn.technique.model_extra)
        assert toy(drawn).sowing.density_per_m2 <= 20.0
        assert drawn.resolve("x") == scene.resolve("x")


def test_names_of_cases_tell_them_apart():
    for each in ALL.values():
        names = [case.name for case in each.cases]
        assert len(set(names)) == len(names)
    assert set(QUICK) <= set(ALL)


def test_a_preset_is_not_changed():
    for case in ALL["presets"].cases:
        assert dump(drawn_by("visibility-buffer", case.build(), case.settings)) == dump(load("meadow"))
    assert [case.still for case in ALL["presets"].cases] == [True, False]


def test_table_1_has_its_rows():
    cases = {case.name: case for case in ALL["jahrmann2013-table1"].cases}
    assert len(cases) == 22
    assert {case.size for case in cases.values()} == {(1200, 800)}
    plain = cases["Meadow 300x300, effects off"].build()
    assert (plain.post.blur, plain.post.darkening, plain.object) == ("off", 0.0, ())
    full = cases["Meadow 600x600, objects, effects on"].build()
    assert (full.post.blur, full.ground.size_m) == ("average", (600.0, 600.0))
    assert full.object
    assert full.post.darkening > 0.0
    far = cases["Instance 90000x90000, flowers, effects on"].build()
    assert (far.ground.size_m, far.ground.beyond) == ((90_000.0, 90_000.0), "bare")
    assert far.flowers
    assert far.sowing.reach_m == cases["Instance 2000x2000, flowers, effects on"].build().sowing.reach_m


_PUBLISHED = """
Oasis 160 on 75 136650, Oasis 160 off 78 136650, Oasis 320 on 65 330816, Oasis 320 off 68 330816,
Meadow 300 on 84 348370, Meadow 300 off 88 348370, Meadow 300 objects on 83 348370, Meadow 300 objects off 87 348370,
Meadow 600 objects on 81 340716, Meadow 600 objects off 85 340716,
Instance 300 on 60 660000, Instance 300 off 62 660000, Instance 600 on 56 824000, Instance 600 off 58 824000,
Instance 2000 flowers on 55 1008000, Instance 2000 flowers off 57 1008000,
Instance 4000 flowers on 55 1008000, Instance 4000 flowers off 57 1008000,
Instance 8000 flowers on 55 1008000, Instance 8000 flowers off 57 1008000,
Instance 90000 flowers on 55 1008000, Instance 90000 flowers off 57 1008000"""


def test_table_1_quotes_the_paper():
    expected = []
    for name, edge, *added, effects, fps, visible in map(str.split, _PUBLISHED.split(",")):
        scene = ", ".join([f"{name} {edge}x{edge}", *added, f"effects {effects}"])
        expected.append((scene, f"{fps} frames per second, {int(visible):,} blades visible"))
    assert [(case.name, case.published) for case in ALL["jahrmann2013-table1"].cases] == expected


@pytest.mark.parametrize("row", [each.strip() for each in _PUBLISHED.split(",")])
def test_a_row_of_table_1_is_drawn_as_it_says(row):
    """Its field, its effects, and what else is drawn; only what the row says differs from the preset."""
    name, edge, *added, effects, _, _ = row.split()
    label = ", ".join([f"{name} {edge}x{edge}", *added, f"effects {effects}"])
    (case,) = (each for each in ALL["jahrmann2013-table1"].cases if each.name == label)
    scene, usual = case.build(), load(f"jahrmann2013-{name.lower()}")
    assert scene.ground.size_m == (float(edge), float(edge))
    assert (scene.post.blur, scene.post.darkening) == (("average", 0.3) if effects == "on" else ("off", 0.0))
    assert bool(scene.object) == ("objects" in added)
    assert bool(scene.flowers) == ("flowers" in added)
    for table in ("grass", "sowing", "technique", "wind", "force", "water", "sun"):
        assert getattr(scene, table) == getattr(usual, table), table
    assert scene.technique.model_extra.get("mode", "basic") == ("instanced" if name == "Instance" else "basic")


@pytest.mark.parametrize("edge_m", [160, 320])
def test_the_camera_stands_at_the_shore_of_an_oasis_of_any_size(edge_m):
    (scene,) = (
        case.build()
        for case in ALL["jahrmann2013-table1"].cases
        if case.name == f"Oasis {edge_m}x{edge_m}, effects off"
    )
    heights, usual = HeightField.of(scene), load("jahrmann2013-oasis")
    x, _, z = scene.camera.position_m
    assert (x / edge_m, z / edge_m) == pytest.approx(
        (usual.camera.position_m[0] / 160, usual.camera.position_m[2] / 160)
    )
    assert 0.0 < heights.height(x, z) - scene.water.level_m < 2.0
    ahead = np.subtract(scene.camera.target_m, scene.camera.position_m)
    usual_ahead = np.subtract(usual.camera.target_m, usual.camera.position_m)
    assert np.allclose(ahead, usual_ahead), "the same way of looking"


def test_the_hills_of_table_1_are_those_of_the_preset_at_every_size():
    x, z = np.meshgrid(*2 * [np.linspace(-50.0, 50.0, 21)])
    for name, most_m in (("Meadow", 0.05), ("Instance", 0.2)):
        usual = HeightField.of(load(f"jahrmann2013-{name.lower()}")).height(x, z)
        for case in ALL["jahrmann2013-table1"].cases:
            if case.name.startswith(name) and case.name.endswith("off") and "90000" not in case.name:
                scene = case.build()
                assert scene.ground.beyond == "bare"
                if max(scene.ground.size_m) < 3000:  # larger ones take seconds
                    assert np.abs(HeightField.of(scene).height(x, z) - usual).max() < most_m, case.name


def _roots(scene):
    """Return the number of roots that a workload of the thesis sends."""
    return round(scene.ground.size_m[0] ** 2 * scene.sowing.density_per_m2)


def _no_other_level_of_detail(scene):
    sowing = scene.sowing
    return (sowing.drift, sowing.full_density_m, sowing.reach_m, scene.ground.beyond) == (0, 1000, 1000, "bare")


def test_the_thesis_limit_has_its_roots():
    """Section 3.1.4."""
    (case,) = ALL["tillman2013-limit"].cases
    scene = case.build()
    assert case.size == (1680, 1050)
    assert _roots(scene) == 9_144_576
    assert case.published == "vertex-buffer: 36.28 ms, texture-array: 58.69 ms"
    drawn = drawn_by("expanded-roots", case.scene("expanded-roots"), case.settings)
    settings = SETTINGS["expanded-roots"].model_validate(drawn.technique.model_extra)
    assert (settings.points[0] * 9_144_576, settings.extra_blades) == (64_012_032, 0)
    assert min(settings.levels_m) >= scene.sowing.reach_m


def test_the_thesis_makes_as_many_blades_of_fewer_roots():
    """Tables 6 to 8: vertices sent, blades made of each, all blades."""
    tables = {"A": (139_800, 0, 139_800), "B": (36_400, 3, 145_600), "C": (15_500, 8, 139_500)}
    cases = ALL["tillman2013-extra-blades"].cases
    assert [case.name[0] for case in cases] == list("ABCABC")
    for case in cases:
        sent, extra, made = tables[case.name[0]]
        own, others = (case.scene(name) for name in ("expanded-roots[storage=texture-array]", "visibility-buffer"))
        assert (_roots(own), _roots(others)) == (sent, made)
        assert own.ground.size_m == others.ground.size_m
        settings = drawn_by("expanded-roots", own, case.settings).technique.model_extra
        assert (settings["extra_blades"], settings["levels_m"], case.size) == (extra, [8.0, 16.0, 32.0], (1680, 1050))
        assert _no_other_level_of_detail(own)
        assert bool(own.simulation) == case.name.endswith("simulated")


_LEVELS = {  # tables 2 to 5: levels of both sets, vertices sent
    "low": ([4, 8, 16], [16, 16, 16], 50_700),
    "normal": ([8, 16, 32], [32, 32, 32], 139_800),
    "high": ([16, 32, 64], [64, 64, 64], 480_000),
    "ultra": ([32, 64, 128], [128, 128, 128], 1_786_300),
}


def test_the_levels_of_the_thesis_are_those_of_its_tables():
    cases = {case.name: case for case in ALL["tillman2013-lod"].cases}
    assert len(cases) == 8
    for name, (first, second, sent) in _LEVELS.items():
        for number, levels in ((1, first), (2, second)):
            case = cases[f"{name}, set {number}"]
            assert (case.size, case.settings["levels_m"], case.settings["fade"]) == ((1680, 1050), levels, 0.0)
            assert _roots(case.build()) == sent
            assert _no_other_level_of_detail(case.build())


def test_the_thesis_resolutions_are_drawn_with_the_values_of_its_table_1():
    cases = ALL["tillman2013-resolution"].cases
    assert [case.size for case in cases] == [
        (1, 1),
        (640, 480),
        (800, 600),
        (1024, 768),
        (1280, 1024),
        (1680, 1050),
        (1920, 1080),
        (1920, 1200),
        (2560, 1600),
    ]
    for case in cases:
        assert _roots(case.build()) == 139_800, "about 140,000"
        assert case.settings == {"levels_m": [8.0, 16.0, 32.0], "fade": 0.0}
    assert [case.published for case in cases] == [""] * 8 + ["texture-array: 1,224 frames per second on average"]


def test_half_a_screen_takes_5_steps_through_three_grids():
    """Habel, Wimmer & Jeschke 2007: half the screen, 5 iterations, 90 to 300 frames per second; cost is no matter of
    the number of billboards, of which there are a tenth and ten times as many."""
    cases = {case.name: case for case in ALL["habel2007-half-screen"].cases}
    spacing = {"half the screen": 0.5, "0.1 times the billboards": 5.0, "10 times the billboards": 0.05}
    assert set(cases) == set(spacing)
    for name, case in cases.items():
        assert case.settings == {"steps": 5, "spacing": pytest.approx(spacing[name])}
        assert case.size == (1024, 768)
    assert [case.published for case in cases.values()] == ["90 to 300 frames per second", "", ""]
    camera = cases["half the screen"].build().camera
    assert camera.position_m[1] == camera.target_m[1], "the horizon is in the middle"


def test_workloads_of_our_own_have_the_sizes_that_their_names_say():
    counts = {"10k": 10_000, "100k": 100_000, "1M": 1_000_000, "10M": 10_000_000, "30M": 30_000_000}
    for case in ALL["blade-count"].cases:
        assert _roots(case.build()) == counts[case.name]
        assert _no_other_level_of_detail(case.build())
    simulated = {case.name: case.build() for case in ALL["responsive-10m"].cases}
    assert {name: _roots(scene) for name, scene in simulated.items()} == {
        f"{name} simulated": counts[name] for name in ("100k", "1M", "10M")
    }
    for scene in simulated.values():
        assert (scene.simulation.form, scene.simulation.within_m) == ("yan2024", 1000)
        assert [wind.kind for wind in scene.wind] == ["strong"]
    edges = {"hectare": 100.0, "square-km": 1000.0, "square-km, traced from 40 m": 1000.0}
    for case in ALL["field-scale"].cases:
        scene = case.build()
        assert scene.ground.size_m == (edges[case.name],) * 2
        assert (scene.sowing.density_per_m2, scene.sowing.stored_m) == (1000, 0)
        assert scene.sowing.traced_m == (40 if "traced" in case.name else None)
    flights = [(case.name, case.flight_mps, case.frames) for case in ALL["flight"].cases]
    assert flights == [
        (f"{name}, {speed:g} m/s", speed, 900)
        for name in ("meadow", "yan2024-strong", "ryegrass")
        for speed in (1.4, 8.0, 30.0)
    ]
    assert [(case.still, case.flight_mps, case.frames) for case in ALL["derstroff2024"].cases] == [
        (True, 0.0, None),
        (False, 8.0, 300),
    ]


def test_workloads_of_our_own_are_measured_on_these_fields():
    """Figures of one machine and another, or of one year and the next, are of the same fields."""
    even = ALL["blade-count"].cases[0].build()
    assert even.ground.size_m == (120.0, 120.0)
    assert (even.camera.position_m, even.camera.target_m) == ((0, 1.7, 55), (0, 0.9, 0))
    assert [case.quick for case in ALL["blade-count"].cases] == [True, True, True, False, False]
    assert [case.quick for case in ALL["responsive-10m"].cases] == [True, False, False]
    square = ALL["field-scale"].cases[0].build()
    assert square.sowing.reach_m == 700
    assert (square.camera.position_m, square.camera.target_m) == ((0, 1.7, 0), (0, 0.9, -55))
    dense = ALL["flight"].cases[-1].build()
    assert (dense.sowing.density_per_m2, [grass.species for grass in dense.grass]) == (8000, ["ryegrass"])
    assert [case.quick for case in ALL["flight"].cases] == 6 * [True] + 3 * [False]
    hills = ALL["ablation"].cases[0].build()
    assert (hills.ground.size_m, hills.ground.height_m, hills.ground.wavelength_m) == ((120.0, 120.0), 8, 45)
    assert (hills.sowing.density_per_m2, hills.sowing.drift, hills.sowing.full_density_m) == (600, 0, 8.0)
    assert (hills.camera.position_m, hills.camera.target_m) == ((0, 1.7, 50), (0, 0.9, 0))
    whole = {case.name: case.build() for case in ALL["ablation"].cases}
    for name in ("every blade sown", "no test, no level of detail"):
        assert whole[name].sowing.full_density_m == 1000.0
    assert all(case.settings.get("error_px", 1e-6) == 1e-6 for case in ALL["ablation"].cases)
    for name in ("tillman2013-resolution", "tillman2013-lod", "tillman2013-extra-blades"):
        for case in ALL[name].cases:
            camera = case.build().camera
            assert (camera.position_m, camera.target_m) == ((0, 2.5, 0), (0, 1.0, -10)), case.name
    for case in ALL["tillman2013-lod"].cases:
        assert ("set 2" in case.name) == (case.settings.get("error_px") == 1e-6), case.name
        assert ("set 2" in case.name) == (case.settings.get("max_level") == 3), case.name
    for case in ALL["tillman2013-extra-blades"].cases:
        simulation = case.build().simulation
        assert (simulation is not None) == ("simulated" in case.name)
        assert simulation is None or (simulation.within_m, simulation.settle_s) == (1000, 0.0)
    assert {_roots(case.build()) for case in ALL["habel2007-half-screen"].cases} == {400_000}
    limit = ALL["tillman2013-limit"].cases[0].build().camera
    assert (limit.position_m, limit.target_m) == ((0, 12, 310), (0, 0, 200))
    assert [case.size for case in ALL["tillman2013-resolution"].cases if case.quick] == [
        (1, 1), (640, 480), (800, 600), (1024, 768), (1280, 1024),
    ]  # fmt: skip


def test_the_quick_rows_of_table_1_are_one_size_of_each_scene():
    quick = [case.name for case in ALL["jahrmann2013-table1"].cases if case.quick]
    assert quick == [
        f"{name}, effects {effects}"
        for name in ("Oasis 160x160", "Meadow 300x300, objects", "Instance 2000x2000, flowers")
        for effects in ("on", "off")
    ]
    instance = {case.name: case.build() for case in ALL["jahrmann2013-table1"].cases}
    samples = [
        instance[f"Instance {edge}x{edge}{added}, effects on"].ground.samples
        for edge, added in ((300, ""), (600, ""), (90_000, ", flowers"))
    ]
    meadow = instance["Meadow 600x600, objects, effects on"].ground
    assert meadow.samples == 2 * (load("jahrmann2013-meadow").ground.samples - 1) + 1
    preset = load("jahrmann2013-instance").ground
    assert samples == [
        min(round((preset.samples - 1) * edge / preset.size_m[0]) + 1, 4096) for edge in (300, 600, 90_000)
    ]


def test_the_ablation_leaves_out_one_test_at_a_time():
    for case in ALL["ablation"].cases:
        name = case.name.removeprefix("without ")
        if name != case.name:
            culling = case.build().culling.model_dump()
            assert [key for key, on in culling.items() if not on and key != "behind_grass"] == [name]


def test_names_are_checked():
    assert [each.name for each in chosen_workloads(())] == list(QUICK)
    assert len(chosen_workloads(("all",))) == len(ALL)
    assert chosen_techniques(("bezier-blades", STRIPS, "expanded-roots[fade=0.5]"))[1] == STRIPS
    with pytest.raises(InputError, match=r"workload: must be one of .*\(got \"blade-cuont\"\).*blade-count"):
        chosen_workloads(("blade-cuont",))
    with pytest.raises(InputError, match=r"--techniques: must be one of .*instanced-strips"):
        chosen_techniques(("strips",))


def test_settings_make_variants_of_a_technique():
    given = ["bezier-blades, expanded-roots[storage=texture-array,levels_m=[4,8,16]]", "visibility-buffer"]
    names = split_names(given)
    assert names == ("bezier-blades", "expanded-roots[storage=texture-array,levels_m=[4,8,16]]", "visibility-buffer")
    assert chosen_techniques(names) == names
    settings = {"storage": "texture-array", "levels_m": [4, 8, 16]}
    assert variant_of(names[1]) == ("expanded-roots", settings)
    assert variant_of("bezier-blades") == ("bezier-blades", {})
    scene = drawn_by(names[1], load("meadow"), {"levels_m": [1.0, 2.0, 3.0], "fade": 0.5, "error_px": 1.0})
    assert scene.technique.model_extra == {**settings, "fade": 0.5}


def test_a_variant_keeps_what_a_scene_says_of_its_technique():
    scene = drawn_by("expanded-roots[extra_blades=1]", load("tillman2013-vertex-buffer"), {})
    assert scene.technique.model_extra["levels_m"] == [16.0, 32.0, 300.0]
    assert scene.technique.model_extra["extra_blades"] == 1


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "expanded-roots[storage=buffers]",
            r"--techniques: expanded-roots: storage: must be one of vertex-buffer, tex",
        ),
        (
            "expanded-roots[extra_blades=9]",
            r"--techniques: expanded-roots: extra_blades: must be at most 8 \(got 9\)",
        ),
        ("expanded-roots[storag=x]", r"--techniques: expanded-roots: storag: unknown key; did you mean storage\?"),
        ("expanded-roots[storage]", r"--techniques: must be a name, or name\[setting=value\] such as .*\(got"),
        ("expanded-roots[fade=0", r"--techniques: must be a name, or name\[setting=value\]"),
        (
            "expanded-rots[fade=0]",
            r"--techniques: must be one of .*\(got \"expanded-rots\"\); did you mean expanded-roots",
        ),
        ("instanced-strips[fade=0]", r"--techniques: instanced-strips has no settings .*; leave out the brackets"),
    ],
)
def test_variants_that_cannot_be_are_refused(name, message):
    with pytest.raises((InputError, SceneError), match=message):
        chosen_techniques((name,))
