"""Parts of the viewer without a window: history, clock, resolution, sun, keys."""

import numpy as np
import pytest

import greensward as gs
from greensward.viewer import commands
from greensward.viewer.clock import FASTEST, STEP_S, Clock
from greensward.viewer.commands import COMMANDS, TECHNIQUE_COMMANDS, command_for
from greensward.viewer.dynamic_resolution import SCALES, DynamicResolution
from greensward.viewer.file_watcher import FileWatcher, shader_files
from greensward.viewer.history import History
from greensward.viewer.input import FocusLost, Gamepad, HeldKeys, Key, MouseButton, MouseMove, events_of_frame
from greensward.viewer.preview import preview
from greensward.viewer.sun import hour_of, sun_at


def _seeds(*seeds):
    return [gs.Scene(seed=seed) for seed in seeds]


def test_undo_and_redo_go_through_all_scenes():
    one, two, three = _seeds(1, 2, 3)
    history = History(one)
    history.push(two, "two")
    history.push(three, "three")
    assert history.undo_label == "three"
    assert history.undo()
    assert history.scene == two
    assert history.undo()
    assert history.scene == one
    assert not history.undo()
    assert history.redo()
    assert history.redo_label == "three"
    history.push(one, "another branch")
    assert history.redo_label is None


def test_a_drag_is_one_step_until_it_is_sealed():
    history = History(_seeds(0)[0])
    for scene in _seeds(1, 2, 3):
        history.push(scene, "drag", drag="seed")
    history.end_drag()
    history.push(_seeds(4)[0], "drag", drag="seed")
    history.undo()
    assert history.scene.seed == 3
    history.undo()
    assert history.scene.seed == 0


def test_the_same_scene_is_no_step():
    history = History(_seeds(1)[0])
    history.push(_seeds(1)[0], "nothing")
    assert history.undo_label is None


def test_time_runs_slows_stops_and_steps():
    clock = Clock()
    clock.advance(0.1)
    clock.rate = 0.5
    clock.advance(0.1)
    assert clock.time_s == pytest.approx(0.15)
    clock.step()
    clock.step()
    assert clock.paused
    clock.advance(0.1)
    assert clock.time_s == pytest.approx(0.15 + 2 * STEP_S)
    clock.advance(5.0)
    assert clock.time_s == pytest.approx(0.15 + 2 * STEP_S)
    clock.scale_rate(1e9)
    assert clock.rate == FASTEST


def test_time_does_not_leap_when_the_window_stood_still():
    clock = Clock()
    clock.advance(60.0)
    assert clock.time_s < 0.5


def _settled(cost_ms, target_fps=20.0):
    resolution = DynamicResolution(target_fps)
    for _ in range(600):
        resolution.frame(cost_ms(resolution.scale))
    return resolution


@pytest.mark.parametrize(("fixed_ms", "pixels_ms"), [(2.0, 400.0), (30.0, 100.0), (5.0, 20.0)])
def test_the_picture_becomes_as_large_as_the_time_allows(fixed_ms, pixels_ms):
    resolution = _settled(lambda scale: fixed_ms + pixels_ms * scale**2)
    took_ms = fixed_ms + pixels_ms * resolution.scale**2
    assert took_ms <= 52.6
    if resolution.scale < 1.0:
        larger = SCALES[SCALES.index(resolution.scale) + 1]
        assert fixed_ms + pixels_ms * larger**2 > 0.8 * 50.0


def test_too_slow_is_reported_at_the_smallest_picture():
    resolution = _settled(lambda _: 200.0)
    assert resolution.scale == SCALES[0]
    assert resolution.too_slow


def test_the_scale_stays_where_someone_put_it():
    resolution = DynamicResolution(60.0)
    resolution.automatic, resolution.scale = False, 0.62
    assert not any(resolution.frame(500.0) for _ in range(50))
    assert resolution.scale == 0.6


def test_the_scale_does_not_swing():
    resolution = DynamicResolution(30.0)
    scales = []
    for _ in range(2000):
        resolution.frame(5.0 + 70.0 * resolution.scale**2)
        scales.append(resolution.scale)
    assert len(set(scales[-1000:])) == 1


@pytest.mark.parametrize("hour", [5.0, 8.25, 12.0, 16.5, 19.0])
def test_the_hour_is_found_again_from_the_sun(hour):
    assert hour_of(*sun_at(hour)) == pytest.approx(hour, abs=0.05)


def test_the_sun_rises_in_the_east_and_is_south_at_noon():
    assert sun_at(6.0)[0] < 100.0
    assert sun_at(12.0)[0] == pytest.approx(180.0, abs=0.1)
    assert sun_at(12.0)[1] > sun_at(9.0)[1] > sun_at(6.0)[1]


def test_a_preview_has_fewer_blades_and_all_else():
    scene = gs.load("yan2024-strong")
    assert preview(scene, 1.0) is scene
    half, least = preview(scene, 0.5), preview(scene, 0.0625)
    assert scene.sowing.full_density_m > half.sowing.full_density_m > least.sowing.full_density_m
    assert least.shadows.cascades == 1
    assert least.simulation.step_s == pytest.approx(1 / 30)
    assert (least.wind, least.sun) == (scene.wind, scene.sun)
    assert least.sowing.density_per_m2 == scene.sowing.density_per_m2
    assert gs.Scene.model_validate(least.model_dump()).in_folder(scene.resolve(".")) == least


def test_every_command_is_listed_and_every_chord_is_unique():
    listed = [*COMMANDS, *TECHNIQUE_COMMANDS]
    defined = [each for each in vars(commands).values() if isinstance(each, commands.Command)]
    assert all(each in listed for each in defined)
    chords = [chord for command in listed for chord in command.keys]
    assert len(chords) == len(set(chords))
    assert all(command_for(chord) in listed for chord in chords)
    assert len({command.help for command in listed}) == len(listed), "they are the ids of buttons"


@pytest.mark.parametrize(
    ("held", "key", "command"),
    [
        ([], "f", commands.FLY_OR_WALK),
        (["left_ctrl"], "z", commands.UNDO),
        (["left_ctrl", "left_shift"], "z", commands.REDO),
        (["left_shift"], "slash", commands.TOGGLE_KEY_LIST),
        ([], "_2", TECHNIQUE_COMMANDS[1]),
        ([], "period", commands.FASTER),
        (["left_shift"], "w", None),
        ([], "left_shift", None),
    ],
)
def test_keys_do_what_the_list_says(held, key, command):
    keys = HeldKeys()
    for each in held:
        keys.handle(Key(each))
    assert command_for(keys.chord(key)) is command


def test_held_keys_and_pad_add_up_to_an_intent():
    keys = HeldKeys()
    for key in ("w", "d", "left_shift"):
        keys.handle(Key(key))
    keys.handle(Gamepad(left=(-1.0, 0.0), right=(0.5, 0.0)))
    intent = keys.intent((3.0, 0.0))
    assert (intent.ahead, intent.right, intent.fast) == (1.0, 0.0, True)
    assert intent.turn_px[0] > 3.0
    keys.handle(FocusLost())
    assert keys.intent((0.0, 0.0)).ahead == 0.0


def test_control_keys_do_not_walk():
    keys = HeldKeys()
    keys.handle(Key("left_ctrl"))
    keys.handle(Key("s"))
    assert keys.intent((0.0, 0.0)).ahead == 0.0


@pytest.mark.parametrize(
    ("events", "taken"),
    [
        ([MouseMove(1, 1), MouseMove(2, 2)], 2),
        ([MouseMove(1, 1), MouseButton("left", True), MouseButton("left", False)], 1),
        ([MouseButton("left", True), MouseMove(1, 1), MouseMove(3, 1), MouseButton("left", False)], 3),
        ([MouseButton("left", True), MouseButton("right", True), MouseButton("left", False)], 2),
        ([Key("w"), Key("d"), Key("w", False)], 2),
        ([], 0),
    ],
)
def test_a_click_waits_for_what_lies_under_the_mouse(events, taken):
    assert events_of_frame(events) == taken


def test_a_key_that_is_held_does_not_hold_up_the_rest():
    held = [Key("w", repeat=True)] * 25
    assert events_of_frame([*held, Key("w", False), Key("_1")]) == 27


def test_a_change_of_a_file_is_reported_once(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("one")
    watcher = FileWatcher([path, tmp_path / "missing"])
    assert watcher.changed(1e9) == []
    path.write_text("another")
    assert watcher.changed(2e9) == [path]
    assert watcher.changed(3e9) == []
    path.unlink()
    assert watcher.changed(4e9) == []
    path.write_text("back again")
    assert watcher.changed(5e9) == [path]
    assert watcher.changed(5e9 + 1e-3) == []
    path.write_text("while others came to be watched")
    watcher.watch([path, tmp_path / "other"])
    assert watcher.changed(6e9) == [path]


def test_all_shaders_are_watched():
    assert len(shader_files()) > 80
    assert np.all([path.exists() for path in shader_files()])
