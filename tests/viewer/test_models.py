"""What a person at the controls has before them, without a window: history, time, pace, sun, keys."""

import numpy as np
import pytest

import greensward as gs
from greensward.viewer.clock import FASTEST, STEP_S, Clock
from greensward.viewer.controls import ACTIONS, Blur, Click, Held, Move, Pad, Press, action_for, one_by_one
from greensward.viewer.draft import drafted
from greensward.viewer.history import History
from greensward.viewer.pacing import SCALES, Pacing
from greensward.viewer.sun import hour_of, sun_at
from greensward.viewer.viewer import Viewer
from greensward.viewer.watching import Watch, shader_files


def _seeds(*seeds):
    return [gs.Scene(seed=seed) for seed in seeds]


def test_undo_and_redo_go_through_all_scenes():
    one, two, three = _seeds(1, 2, 3)
    history = History(one)
    history.put(two, "two")
    history.put(three, "three")
    assert history.undoes == "three"
    assert history.undo()
    assert history.scene == two
    assert history.undo()
    assert history.scene == one
    assert not history.undo()
    assert history.redo()
    assert history.redoes == "three"
    history.put(one, "another way")
    assert history.redoes is None


def test_a_drag_is_one_step_until_it_is_sealed():
    history = History(_seeds(0)[0])
    for scene in _seeds(1, 2, 3):
        history.put(scene, "drag", drag="seed")
    history.seal()
    history.put(_seeds(4)[0], "drag", drag="seed")
    history.undo()
    assert history.scene.seed == 3
    history.undo()
    assert history.scene.seed == 0


def test_the_same_scene_is_no_step():
    history = History(_seeds(1)[0])
    history.put(_seeds(1)[0], "nothing")
    assert history.undoes is None


def test_time_runs_slows_stops_and_steps():
    clock = Clock()
    clock.advance(0.1)
    clock.pace = 0.5
    clock.advance(0.1)
    assert clock.time_s == pytest.approx(0.15)
    clock.step()
    clock.step()
    assert clock.paused
    clock.advance(0.1)
    assert clock.time_s == pytest.approx(0.15 + 2 * STEP_S)
    clock.advance(5.0)
    assert clock.time_s == pytest.approx(0.15 + 2 * STEP_S)
    clock.faster(1e9)
    assert clock.pace == FASTEST


def test_time_does_not_leap_when_the_window_stood_still():
    clock = Clock()
    clock.advance(60.0)
    assert clock.time_s < 0.5


def _settled(cost_ms, target_fps=20.0):
    pacing = Pacing(target_fps)
    for _ in range(600):
        pacing.frame(cost_ms(pacing.scale))
    return pacing


@pytest.mark.parametrize(("fixed_ms", "pixels_ms"), [(2.0, 400.0), (30.0, 100.0), (5.0, 20.0)])
def test_the_picture_becomes_as_large_as_the_time_allows(fixed_ms, pixels_ms):
    pacing = _settled(lambda scale: fixed_ms + pixels_ms * scale**2)
    took_ms = fixed_ms + pixels_ms * pacing.scale**2
    assert took_ms <= 52.6
    if pacing.scale < 1.0:
        larger = SCALES[SCALES.index(pacing.scale) + 1]
        assert fixed_ms + pixels_ms * larger**2 > 0.8 * 50.0


def test_too_slow_is_told_at_the_smallest_picture():
    pacing = _settled(lambda _: 200.0)
    assert pacing.scale == SCALES[0]
    assert pacing.too_slow


def test_the_scale_stays_where_someone_put_it():
    pacing = Pacing(60.0)
    pacing.automatic, pacing.scale = False, 0.62
    assert not any(pacing.frame(500.0) for _ in range(50))
    assert pacing.scale == 0.6


def test_the_scale_does_not_swing():
    pacing = Pacing(30.0)
    scales = []
    for _ in range(2000):
        pacing.frame(5.0 + 70.0 * pacing.scale**2)
        scales.append(pacing.scale)
    assert len(set(scales[-1000:])) == 1


@pytest.mark.parametrize("hour", [5.0, 8.25, 12.0, 16.5, 19.0])
def test_the_hour_is_found_again_from_the_sun(hour):
    assert hour_of(*sun_at(hour)) == pytest.approx(hour, abs=0.05)


def test_the_sun_rises_in_the_east_and_is_south_at_noon():
    assert sun_at(6.0)[0] < 100.0
    assert sun_at(12.0)[0] == pytest.approx(180.0, abs=0.1)
    assert sun_at(12.0)[1] > sun_at(9.0)[1] > sun_at(6.0)[1]


def test_a_draft_has_fewer_blades_and_all_else():
    scene = gs.load("yan2024-strong")
    assert drafted(scene, 1.0) is scene
    half, least = drafted(scene, 0.5), drafted(scene, 0.0625)
    assert scene.sowing.full_density_m > half.sowing.full_density_m > least.sowing.full_density_m
    assert least.shadows.cascades == 1
    assert least.simulation.step_s == pytest.approx(1 / 30)
    assert (least.wind, least.sun) == (scene.wind, scene.sun)
    assert least.sowing.density_per_m2 == scene.sowing.density_per_m2
    assert gs.Scene.model_validate(least.model_dump()).in_folder(scene.resolve(".")) == least


def test_every_action_is_a_method_and_every_chord_is_its_own():
    chords = [chord for action in ACTIONS for chord in action.keys]
    assert len(chords) == len(set(chords))
    for action in ACTIONS:
        assert callable(getattr(Viewer, action.name))


@pytest.mark.parametrize(
    ("held", "key", "action"),
    [
        ([], "f", "fly_or_walk"),
        (["left_ctrl"], "z", "undo"),
        (["left_ctrl", "left_shift"], "z", "redo"),
        (["left_shift"], "slash", "toggle_help"),
        ([], "_2", "technique 2"),
        ([], "period", "faster"),
        (["left_shift"], "w", None),
        ([], "left_shift", None),
    ],
)
def test_keys_do_what_the_list_says(held, key, action):
    keys = Held()
    for each in held:
        keys.take(Press(each))
    assert action_for(keys.chord(key)) == action


def test_held_keys_and_pad_add_up_to_an_intent():
    keys = Held()
    for key in ("w", "d", "left_shift"):
        keys.take(Press(key))
    keys.take(Pad(left=(-1.0, 0.0), right=(0.5, 0.0)))
    intent = keys.intent((3.0, 0.0))
    assert (intent.ahead, intent.right, intent.fast) == (1.0, 0.0, True)
    assert intent.turn_px[0] > 3.0
    keys.take(Blur())
    assert keys.intent((0.0, 0.0)).ahead == 0.0


def test_control_keys_do_not_walk():
    keys = Held()
    keys.take(Press("left_ctrl"))
    keys.take(Press("s"))
    assert keys.intent((0.0, 0.0)).ahead == 0.0


@pytest.mark.parametrize(
    ("events", "taken"),
    [
        ([Move(1, 1), Move(2, 2)], 2),
        ([Move(1, 1), Click("left", True), Click("left", False)], 1),
        ([Click("left", True), Move(1, 1), Move(3, 1), Click("left", False)], 3),
        ([Click("left", True), Click("right", True), Click("left", False)], 2),
        ([Press("w"), Press("d"), Press("w", False)], 2),
        ([], 0),
    ],
)
def test_a_click_waits_for_what_lies_under_the_mouse(events, taken):
    assert one_by_one(events) == taken


def test_a_key_that_is_held_does_not_hold_up_the_rest():
    held = [Press("w", again=True)] * 25
    assert one_by_one([*held, Press("w", False), Press("_1")]) == 27


def test_a_file_that_changes_is_told_of_once(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("one")
    watch = Watch([path, tmp_path / "missing"])
    assert watch.changed(1e9) == []
    path.write_text("another")
    assert watch.changed(2e9) == [path]
    assert watch.changed(3e9) == []
    path.unlink()
    assert watch.changed(4e9) == []
    path.write_text("back again")
    assert watch.changed(5e9) == [path]
    assert watch.changed(5e9 + 1e-3) == []
    path.write_text("while others came to be watched")
    watch.put([path, tmp_path / "other"])
    assert watch.changed(6e9) == [path]


def test_all_shaders_are_watched():
    assert len(shader_files()) > 80
    assert np.all([path.exists() for path in shader_files()])
