"""The whole user interface, driven event by event without a window."""

import os
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import moderngl
import numpy as np
import pytest
from PIL import Image

pytest.importorskip("imgui_bundle", reason="the extra viewer is not installed", exc_type=ImportError)

from driving import Driver

import greensward as gs  # isort: skip
from greensward.gpu import shader_source
from greensward.techniques import SETTINGS
from greensward.viewer import commands
from greensward.viewer import input as c
from greensward.viewer.contexts import Contexts
from greensward.viewer.dialogs import Dialog
from greensward.viewer.session import Session
from greensward.viewer.ui import pages
from greensward.viewer.ui.pages import passes_of
from greensward.viewer.ui.style import pass_colour

SCENE = """\
title = "Field"

[ground]
kind = "flat"
size_m = [60, 60]

[sowing]
density_per_m2 = 16
reach_m = 20  # near

[shadows]
enabled = false

[camera]
position_m = [0, 1.7, 8]
target_m = [0, 0.4, 0]
"""


@pytest.fixture
def drive(ctx: moderngl.Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Driver]]:
    monkeypatch.chdir(tmp_path)
    made: list[Driver] = []

    def start(text: str = SCENE, **options: object) -> Driver:
        Path("field.toml").write_text(text)
        made.append(Driver(Contexts(ctx, lambda: None), Session("field.toml"), **options))  # type: ignore[arg-type]
        made[-1].ready()
        return made[-1]

    yield start
    for each in made:
        each.release()


def test_it_shows_the_scene_and_a_panel(drive):
    d = drive()
    assert d.viewer.viewports[0].problems == ()
    picture = d.scene_part.astype(int)
    assert picture.std() > 10.0
    green = picture[-100:].mean(axis=(0, 1))
    assert green[1] > green[2]
    assert d.picture()[:, -200:].mean() < 70  # a dark panel
    d.key("h")
    d.frames(2)
    assert d.viewer.areas(d.size)[0][2] == d.size[0]


@pytest.mark.slow
def test_one_walks_and_looks_around(drive):
    d = drive()
    before, z = d.scene_part.copy(), d.session.controller.position_ws[2]
    d.frames(10, c.Key("w"))
    d.frames(1, c.Key("w", False))
    assert d.session.controller.position_ws[2] < z - 0.5
    yaw = d.session.controller.yaw
    d.drag((300, 300), (340, 310), (380, 320), button="right")
    assert d.session.controller.yaw != yaw
    assert not d.viewer.pointer.captured
    assert (d.scene_part != before).mean() > 0.5
    d.drag((300, 300), (200, 300))
    assert d.session.controller.yaw != yaw
    d.key("f")
    assert d.session.controller.mode == "fly"
    d.key("o")
    assert d.session.controller.mode == "orbit"
    d.key("home")
    assert d.session.controller.position_ws == pytest.approx([0.0, 1.7, 8.0])


def test_a_hint_stays_until_the_camera_has_moved_and_turned(drive):
    d = drive()
    assert d.viewer.shows_hint
    d.frames(2, c.Key("w"))
    d.frames(1, c.Key("w", False))
    assert d.viewer.shows_hint
    d.drag((300, 300), (340, 310), (380, 320))
    d.frames(1)
    assert not d.viewer.shows_hint


@pytest.mark.slow
def test_every_technique_by_its_number(drive):
    d = drive()
    camera = d.session.camera()
    for number, name in enumerate(SETTINGS, start=1):
        d.key(f"_{number}")
        d.ready()
        renderer = d.viewer.viewports[0].renderer
        assert renderer is not None
        assert renderer.technique_name == name
        assert d.viewer.viewports[0].problems == ()
    assert d.session.camera() == camera


@pytest.mark.slow
def test_light_and_wind_change_without_sowing_anew(drive):
    d = drive()
    renderer, before = d.viewer.viewports[0].renderer, d.scene_part.mean()
    x = d.size[0] - 356 + 240
    d.drag((x, 199), (x + 40, 199), (x + 70, 199))  # exposure
    assert d.session.scene.post.exposure_ev > 0.5
    d.frames(12)
    assert d.scene_part.mean() > before + 10
    d.drag((d.size[0] - 320, 340), (d.size[0] - 345, 315))  # the dial
    assert d.session.scene.wind[0].direction_deg != 250.0
    d.session.set_hour(8.0)
    d.frames(2)
    assert d.viewer.viewports[0].renderer is renderer
    d.key("z", "left_ctrl")
    d.key("z", "left_ctrl")
    d.key("z", "left_ctrl")
    assert not d.session.unsaved
    d.frames(12)
    assert d.scene_part.mean() == pytest.approx(before, abs=3.0)


@pytest.mark.slow
def test_mowing_and_pressing_by_hand(drive):
    d = drive()
    d.frames(4)
    d.session.clock.paused = True
    d.frames(20)
    before = d.scene_part.astype(int)
    d.drag((300, 30), (300, 30))  # the tool
    d.session.tool = "mow"
    d.drag((250, 520), (300, 450), (350, 420))
    d.ready()
    d.frames(20)
    assert d.session.history.undo_label == "mow"
    mown = d.scene_part.astype(int)
    assert np.abs(mown - before).mean() > 1.0
    d.session.tool = "press"
    d.drag((420, 520), (430, 450))
    d.drag((480, 520), (490, 450))
    d.ready()
    assert len(d.session.scene.force) == 2
    d.key("z", "left_ctrl")
    d.key("z", "left_ctrl")
    d.key("z", "left_ctrl")
    d.ready()
    assert not d.session.unsaved


def test_a_stroke_right_after_its_tool_was_chosen(drive):
    d = drive()
    tool = (263, 30)
    d.frames(2, c.MouseMove(*tool))
    d.frames(1, c.MouseButton("left", True))
    d.frames(1, c.MouseButton("left", False))
    assert d.session.tool == "mow"
    d.frames(1, c.MouseMove(250, 520))
    d.frames(1, c.MouseButton("left", True), c.MouseMove(300, 450))
    assert d.session.stroke
    d.frames(1, c.MouseButton("left", False))
    assert d.session.history.undo_label == "mow"


@pytest.mark.slow
def test_objects_are_dragged_over_the_ground(drive):
    d = drive(SCENE + '[[object]]\nkind = "sphere"\nposition_m = [0, 0, 0]\nsize_m = [1, 1, 1]\n')
    d.session.tool = "move"
    d.frames(2, c.MouseMove(400, 300))
    (handle,) = d.viewer.pointer.handles
    spot = d.viewer.picker.project(handle.position_ws)
    d.drag(spot, (spot[0] + 60, spot[1] + 40), (spot[0] + 90, spot[1] + 60))
    x, y, z = d.session.scene.object[0].position_m
    assert x > 0.3
    assert z > 0.3
    assert y == 0.0
    d.ready()
    d.key("z", "left_ctrl")
    assert d.session.scene.object[0].position_m == (0.0, 0.0, 0.0)


@pytest.mark.slow
def test_time_stops_steps_and_slows(drive):
    d = drive()
    d.key("p")
    time_s = d.session.clock.time_s
    d.frames(3)
    assert d.session.clock.time_s == time_s
    d.key("n")
    assert d.session.clock.time_s == pytest.approx(time_s + 1 / 30)
    d.frames(40)
    assert d.viewer.idle
    d.key("comma")
    assert d.session.clock.rate == 0.5


@pytest.mark.slow
def test_two_halves_one_camera(drive):
    d = drive()
    d.key("c")
    d.ready()
    d.session.set_hour(12.0)
    d.key("_1")
    d.ready()
    left, right = d.viewer.viewports
    assert left.scene.technique.name == "visibility-buffer"
    assert right.scene.technique.name == "bezier-blades"
    (x0, _, width, height), (x1, *_) = d.viewer.areas(d.size)
    picture = d.picture()[100 : height - 150].astype(int)
    assert picture[:, x0 + 20 : x0 + width - 20].std() > 5
    assert np.abs(picture[:, 20 : width - 20] - picture[:, x1 + 20 : x1 + width - 20]).mean() > 1.0
    d.key("c")
    d.frames(2)
    assert len(d.viewer.viewports) == 1
    assert d.viewer.viewports[0].scene.technique.name == "bezier-blades"


@pytest.mark.slow
def test_a_broken_shader_is_reported_with_its_line_and_the_last_valid_one_stays(drive, monkeypatch):
    d = drive()
    before = d.viewer.viewports[0].renderer
    read = shader_source.read_lines

    @cache
    def broken(path):
        lines = read(path)
        return (*lines, "this is no GLSL") if path == "passes/post/encode.glsl" else lines

    line = len(read("passes/post/encode.glsl")) + 1
    monkeypatch.setattr(shader_source, "read_lines", broken)
    d.key("r", "left_ctrl")
    d.ready()
    assert any(f"passes/post/encode.glsl:{line}" in problem for problem in d.viewer.viewports[0].problems)
    assert d.viewer.viewports[0].renderer is before
    d.frames(3)
    assert d.scene_part.std() > 10
    assert d.viewer.viewports[0].problems
    monkeypatch.undo()
    d.key("r", "left_ctrl")
    d.ready()
    assert d.viewer.viewports[0].problems == ()
    assert d.viewer.viewports[0].renderer is not before


def _disk_time_passes(d):
    d.viewer._files._asked_s -= 10.0
    d.frames(2)


def test_a_scene_file_that_breaks_while_open(drive):
    d = drive()
    file, shown = Path("field.toml"), d.session.scene
    file.write_text(SCENE.replace("reach_m = 20", "reach = 25"))
    _disk_time_passes(d)
    assert "field.toml: sowing.reach: unknown key; did you mean reach_m?" in d.viewer.problems
    assert d.session.scene == shown
    file.write_text("nonsense")
    _disk_time_passes(d)
    assert "field.toml: end of document" in d.viewer.problems[0]
    file.write_text(SCENE.replace("reach_m = 20", "reach_m = 15"))
    _disk_time_passes(d)
    assert d.viewer.problems == ()
    assert d.session.scene.sowing.reach_m == 15.0
    d.ready()
    assert d.scene_part.std() > 10


@pytest.mark.slow
def test_a_scene_that_cannot_be_drawn_leaves_the_last_one(drive):
    d = drive()
    good = d.viewer.viewports[0].renderer
    d.session.change(("sowing", "full_density_m"), 100_000.0)
    d.session.change(("sowing", "reach_m"), 100_000.0)
    d.ready()
    assert "million blades" in d.viewer.viewports[0].problems[0]
    assert d.viewer.viewports[0].renderer is good
    d.key("z", "left_ctrl")
    d.key("z", "left_ctrl")
    d.ready()
    assert d.viewer.viewports[0].problems == ()


@pytest.mark.slow
def test_saving_asks_for_a_name_where_there_is_none(drive):
    d = drive()
    d.session.change(("seed",), 7)
    d.key("s", "left_ctrl")
    assert "seed = 7" in Path("field.toml").read_text()
    assert "# near" in Path("field.toml").read_text()
    d.viewer.quality, d.viewer.resolution.scale = 1 / 64, 0.05
    d.viewer.open("yan2024-random")
    d.key("s", "left_ctrl")
    d.frames(2)
    assert d.viewer.dialogs.open
    _press_buttons_until(d, lambda: not d.viewer.dialogs.open, 125)  # Save, left of Cancel
    assert Path("yan2024-random-001.toml").exists()


def _press_buttons_until(d, done, x):
    """Click downwards at a place until something is done: buttons have no address."""
    d.session.clock.paused = True  # a picture at rest is not drawn again
    for y in range(-140, 150, 12):
        d.frames(1, c.MouseMove(d.size[0] / 2 + x, d.size[1] / 2 + y))
        d.frames(1, c.MouseButton("left", True))
        d.frames(2, c.MouseButton("left", False))
        if done():
            return
    raise AssertionError("there is no such button")


@pytest.mark.slow
def test_a_file_that_someone_else_wrote_is_not_replaced_unasked(drive):
    d = drive()
    d.session.change(("seed",), 7)
    Path("field.toml").write_text("broken = ")
    _disk_time_passes(d)
    assert d.viewer.problems
    d.key("s", "left_ctrl")
    d.frames(2)
    assert d.viewer.dialogs.open
    assert Path("field.toml").read_text() == "broken = "
    _press_buttons_until(d, lambda: not d.viewer.dialogs.open, -220)  # Replace
    assert "seed = 7" in Path("field.toml").read_text()
    _disk_time_passes(d)
    assert d.viewer.problems == (), "a fixed error is no longer shown"


def test_a_change_on_disk_is_seen_while_something_is_dragged(drive):
    d = drive()
    d.session.change(("seed",), 7)
    Path("field.toml").write_text(SCENE + "[post]\nexposure_ev = 1\n")
    d.session.change(("post", "exposure_ev"), 0.5)
    d.frames(1)
    _disk_time_passes(d)
    assert d.session.scene.post.exposure_ev == 1.0
    d.key("z", "left_ctrl")
    assert (d.session.scene.seed, d.session.scene.post.exposure_ev) == (7, 0.5)


@pytest.mark.slow
def test_a_deleted_file_is_reported_on_leaving_and_can_be_saved_again(drive):
    d = drive()
    Path("field.toml").unlink()
    _disk_time_passes(d)
    d.frames(2, c.CloseRequest())
    assert not d.viewer.done
    assert "no longer exists" in d.viewer.would_be_lost[0]
    _press_buttons_until(d, lambda: d.viewer.done, -220)  # Save
    assert gs.load("field.toml") == d.session.scene


@pytest.mark.slow
def test_leaving_by_saving_a_preset_leaves(drive):
    d = drive()
    d.viewer.quality, d.viewer.resolution.scale = 1 / 64, 0.05
    d.viewer.open("yan2024-random")
    d.session.change(("seed",), 7)
    d.frames(2, c.CloseRequest())
    _press_buttons_until(d, lambda: d.viewer.dialogs.shown is Dialog.SAVE_AS, -220)
    d.frames(2)
    _press_buttons_until(d, lambda: not d.viewer.dialogs.open, 125)
    assert d.viewer.done
    assert gs.load("yan2024-random-001.toml").seed == 7


@pytest.mark.slow
@pytest.mark.parametrize("name", ["", "/", ".", "..", "~", "~nobody-of-this-name/x", "x" * 5000, "a\0b", "/etc/"])
@pytest.mark.parametrize("command", [commands.SAVE_AS, commands.SAVE_PICTURE, commands.OPEN], ids=lambda c: c.help)
def test_whatever_is_typed_as_a_file(drive, command, name):
    d = drive()
    command.run(d.viewer)
    d.viewer.dialogs.text = name
    d.frames(3)
    assert d.viewer.dialogs.open
    if command is commands.OPEN:
        d.viewer.dialogs.close()
        d.viewer.open(name)
        d.frames(2)
        assert d.viewer.messages[-1].error


def test_names_of_files_that_are_no_text(drive):
    d = drive()
    name = os.fsdecode(b"w\xffld.toml")
    Path(name).write_text("seed = 2\n[sowing]\ndensity_per_m2 = 5\nreach_m = 5\n")
    d.viewer.ask_open()
    d.frames(3)
    d.viewer.dialogs.close()
    d.viewer.open(name)
    d.session.notify(f"{name} %s%n", error=True)
    d.viewer.ask_save_as()
    d.frames(3)
    assert d.session.scene.seed == 2


def test_pictures_in_a_row_have_names_of_their_own(drive):
    d = drive()
    d.viewer.save_picture(Path("field-001.png"), (640, 480), 4096)
    assert not d.viewer.save_picture(Path("field-001.png"), (96, 64), 1)
    d.viewer.ask_picture()
    assert d.viewer.dialogs.text == "field-002.png"
    d.viewer.dialogs.close()


@pytest.mark.slow
def test_what_is_dragged_may_vanish(drive):
    d = drive(SCENE + '[[object]]\nkind = "sphere"\nposition_m = [0, 0, 0]\nsize_m = [1, 1, 1]\n')
    for again in (True, False):
        d.session.tool = "move"
        d.frames(2, c.MouseMove(400, 300))
        spot = d.viewer.picker.project(d.viewer.pointer.handles[0].position_ws)
        d.frames(2, c.MouseMove(*spot))
        d.frames(1, c.MouseButton("left", True))
        assert d.viewer.pointer.held
        d.key("z", "left_ctrl")  # waits for the hand
        d.session.remove(("object", 0))
        if again:
            d.frames(2, c.MouseMove(spot[0] + 40, spot[1]))
        d.frames(2, c.MouseButton("left", False))
        assert d.session.scene.object == ()
        d.session.undo()
        d.ready()


def test_the_lens_follows_the_scene_on_any_page(drive):
    d = drive()
    d.ui.go_to("Scene")
    d.frames(2)
    d.session.change(("camera", "fov_y_deg"), 20.0)
    d.frames(1)
    assert d.session.camera().fov_y_deg == 20.0


def test_a_camera_path_that_cannot_be_written_goes_on(drive, monkeypatch, tmp_path):
    d = drive()
    d.key("f5")
    d.frames(6, c.Key("w"), seconds=0.1)
    with monkeypatch.context() as failing:
        failing.setattr(gs.CameraPath, "write", _refused)
        d.key("f5")
        assert "disk is full" in d.message_text()
        assert d.viewer.recorder.recording_path
    d.key("f5")
    assert (tmp_path / "field-path-001.toml").exists()


def _refused(*_):
    raise gs.GreenswardError("the disk is full")


def test_an_error_of_the_driver_leaves_the_last_picture(drive, monkeypatch):
    d = drive()
    renderer = d.viewer.viewports[0].renderer

    def lost(_):
        raise ValueError("device lost")

    monkeypatch.setattr(renderer, "update", lost)
    d.session.change(("post", "exposure_ev"), 1.0)
    d.frames(3)
    assert "device lost" in d.viewer.viewports[0].problems[0]
    d.key("z", "left_ctrl")
    d.frames(2)
    assert d.scene_part.std() > 10


def test_leaving_with_changes_asks(drive):
    d = drive()
    d.frames(1, c.CloseRequest())
    assert d.viewer.done
    d.viewer.done = False
    d.session.change(("seed",), 7)
    d.frames(2, c.CloseRequest())
    assert not d.viewer.done
    assert "not saved" in d.viewer.would_be_lost[0]
    d.key("escape")
    d.frames(2)
    assert not d.viewer.dialogs.open
    assert not d.viewer.done
    d.frames(1, c.FileDrop("yan2024-strong"))
    assert d.viewer.dialogs.open
    assert d.session.origin.name == "field"


@pytest.mark.slow
@pytest.mark.parametrize("size", [(1, 1), (2, 700), (333, 222), (1500, 300)])
def test_any_size_of_window(drive, size):
    d = drive()
    d.resize(size)
    d.frames(3)
    d.key("c")
    d.ready()
    d.resize((1024, 640))
    d.frames(3)
    assert d.viewer.viewports[0].problems == ()
    assert d.scene_part.std() > 5


@pytest.mark.slow
def test_a_picture_of_any_size_is_drawn_beside(drive):
    d = drive()
    d.key("f12")
    d.frames(2)
    assert d.viewer.dialogs.open
    d.viewer.dialogs.close()
    assert not d.viewer.save_picture(Path("a.doc"), (96, 64), 2)
    assert d.viewer.save_picture(Path("a.png"), (96, 64), 2)
    while d.viewer.recorder.progress:
        d.frames(1)
    assert Image.open("a.png").size == (96, 64)
    assert "Saved a.png" in d.message_text()


def test_leaving_stops_what_is_still_drawn(drive):
    d = drive()
    d.viewer.save_picture(Path("large.png"), (640, 480), 4096)
    d.frames(1, c.CloseRequest())
    assert not d.viewer.done
    assert "still being rendered" in d.viewer.would_be_lost[0]
    d.viewer.recorder.stop()
    assert not Path("large.png").exists()
    assert list(Path().glob(".*.part")) == []


@pytest.mark.slow
def test_a_camera_path_is_recorded_played_and_written(drive):
    d = drive()
    d.key("f5")
    d.frames(12, c.Key("w"), seconds=0.1)
    d.frames(1, c.Key("w", False))
    d.key("f5")
    path = gs.CameraPath.read("field-path-001.toml")
    assert path.end_s == pytest.approx(1.2, abs=0.35)
    assert path.at(1.0).position_m[2] < path.at(0.0).position_m[2] - 0.5
    d.key("f7")
    assert d.session.controller.position_ws[2] == pytest.approx(8.0, abs=0.3)
    d.frames(20, seconds=0.1)
    assert d.session.controller.position_ws[2] == pytest.approx(path.at(9.0).position_m[2], abs=1e-3)


def test_a_video_of_what_is_seen(drive):
    pytest.importorskip("imageio_ffmpeg", reason="the extra video is not installed")
    d = drive()
    d.key("f6")
    d.frames(10)
    d.key("f6")
    assert Path("field-001.mp4").stat().st_size > 1000
    assert "field-001.mp4" in d.message_text()


def test_typing_into_the_panel_is_not_a_command(drive):
    d = drive()
    d.ui.go_to("Scene")
    d.frames(3)
    mode, z = d.session.controller.mode, d.session.controller.position_ws[2]
    d.drag((d.size[0] - 180, 140), (d.size[0] - 180, 140))
    d.frames(1)
    assert d.ui.wants_text
    for character in "wof":
        d.frames(2, c.Key(character), c.Character(character))
        d.frames(1, c.Key(character, False))
    assert d.ui.scene_page.search == "wof"
    assert (d.session.controller.mode, d.session.controller.position_ws[2]) == (mode, z)


def test_a_huge_paste_into_a_number_is_refused(drive):
    d = drive()
    x = d.size[0] - 356 + 240
    d.frames(2, c.MouseMove(x, 199))
    d.frames(1, c.Key("left_ctrl"), c.MouseButton("left", True))
    d.frames(2, c.MouseButton("left", False), c.Key("left_ctrl", False))
    assert d.ui.wants_text
    d.write("9" * 500)
    d.frames(2, c.Key("enter"))
    d.frames(2, c.Key("enter", False))
    assert abs(d.session.scene.post.exposure_ev) <= 20.0


def test_every_pass_that_is_timed_is_shown(drive, monkeypatch):
    frames = [{"grass": 2.0, "far": 1.0}, {"grass": 2.0, "a pass of tomorrow": 3.0}]
    assert passes_of(frames) == ["grass", "far", "a pass of tomorrow"]
    assert len({pass_colour(name) for name in passes_of(frames)}) == 3
    shown: dict[str, str] = {}
    monkeypatch.setattr(pages, "figure", lambda name, value, _="": shown.update({name: value}))
    d = drive()
    d.ui.go_to("Frame")
    d.frames(2)
    d.viewer.pass_times.extend(frames)
    d.session.clock.paused = True
    d.viewer.timing = False
    d.ui.draw(d.viewer, 0.05, d.size, d.target, 1.0)
    assert (shown["a pass of tomorrow"], shown["frame"]) == ("3.0 ms", "5.0 ms")


@pytest.mark.slow
@pytest.mark.usefixtures("coarse_far")
def test_far_blades_are_timed_and_shown(drive):
    d = drive(SCENE.replace("reach_m = 20  # near", "reach_m = 20\ntraced_m = 15"))
    d.ui.go_to("Frame")
    d.frames(3)
    assert "far" in passes_of(d.viewer.pass_times)


@pytest.mark.slow
def test_every_page_and_table_can_be_shown(drive):
    d = drive(
        '[[wind]]\nkind = "blast"\n[[wind]]\nkind = "gusts"\n[water]\nlevel_m = -5\n[simulation]\n[growth]\n'
        '[[object]]\nkind = "sphere"\nposition_m = [0, 0, 0]\n[object.grass]\n[[force]]\nkind = "tracks"\n'
        "path = [[0, 0], [1, 2]]\n[shadows]\nsize_px = 64\n[[flowers]]\n[sowing]\ndensity_per_m2 = 20\nreach_m = 10\n"
    )
    d.ui.go_to("Scene")
    d.frames(2)
    d.ui.unfolded = True
    d.frames(4)
    d.ui.unfolded = False
    for word in ("m", "deg", "wind", "colour", "file", "path", "zzz"):
        d.ui.scene_page.search = word
        d.frames(2)
    d.ui.go_to("Frame")
    d.frames(10)
    assert sum(d.viewer.viewports[0].pass_ms.values()) > 0
    assert d.viewer.counts.drawn > 0
    d.key("slash", "left_shift")
    d.frames(2)
    assert d.viewer.dialogs.key_list
    d.key("escape")
    d.key("o", "left_ctrl")
    d.frames(2)
    d.key("escape")
    d.frames(2)
    assert not d.viewer.dialogs.open
    assert not d.session.unsaved
