"""The workloads: what their sources say, in scenes that load."""

import math

import pytest

from greensward.bench.workloads import (
    AWAITED,
    QUICK,
    STRIPS,
    chosen_techniques,
    chosen_workloads,
    drawn_by,
    toy,
    workloads,
)
from greensward.library import load
from greensward.scene import InputError
from greensward.scene.load import dump
from greensward.techniques import SETTINGS

ALL = workloads()
CASES = [pytest.param(each, case, id=f"{name}: {case.name}") for name, each in ALL.items() for case in each.cases]


@pytest.mark.parametrize(("workload", "case"), CASES)
def test_every_case_is_a_scene_for_its_techniques(workload, case):
    scene = case.build()
    known = [name for name in workload.techniques if name in SETTINGS]
    assert known
    for technique in known:
        drawn = drawn_by(technique, scene, case.settings)
        assert drawn.technique.name == technique
        SETTINGS[technique].model_validate(drawn.technique.model_extra)
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


def test_the_thesis_limit_has_its_roots():
    (case,) = ALL["tillman2013-limit"].cases
    scene = case.build()
    assert case.size == (1680, 1050)
    assert math.isclose(scene.ground.size_m[0] ** 2 * scene.sowing.density_per_m2, 9_144_576)


def test_the_thesis_resolutions_span_one_pixel_to_2560x1600():
    sizes = [case.size for case in ALL["tillman2013-resolution"].cases]
    assert (sizes[0], sizes[-1]) == ((1, 1), (2560, 1600))


def test_the_ablation_leaves_out_one_test_at_a_time():
    for case in ALL["ablation"].cases:
        name = case.name.removeprefix("without ")
        if name != case.name:
            culling = case.build().culling.model_dump()
            assert [key for key, on in culling.items() if not on and key != "behind_grass"] == [name]


def test_names_are_checked():
    assert [each.name for each in chosen_workloads(())] == list(QUICK)
    assert len(chosen_workloads(("all",))) == len(ALL)
    assert chosen_techniques(("bezier-blades", STRIPS, *AWAITED))[1] == STRIPS
    with pytest.raises(InputError, match=r"workload: must be one of .*\(got \"blade-cuont\"\).*blade-count"):
        chosen_workloads(("blade-cuont",))
    with pytest.raises(InputError, match=r"--techniques: must be one of .*instanced-strips"):
        chosen_techniques(("strips",))
