"""Edits of a session: changing, painting, undoing, opening and saving."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import greensward as gs
from greensward.scene.load import preset_file
from greensward.techniques import TECHNIQUES
from greensward.viewer.brushes import MOWN, Brush, paint, paintable_map, simplified, track
from greensward.viewer.saving import free_name
from greensward.viewer.session import Session


@pytest.fixture
def session():
    made = Session("field", gs.Scene(ground=gs.grounds.FlatGround(size_m=(40, 40))))
    yield made
    made.close()


def _stroke(session, tool, *points, **brush):
    session.tool, session.brush = tool, Brush(**brush)
    for point in points:
        session.extend_stroke(point)
    session.end_stroke()


def _map(session):
    return np.asarray(Image.open(session.scene.resolve(session.scene.sowing.density_map)))


def test_a_change_is_validated_reported_and_undone(session):
    assert session.change(("sun", "elevation_deg"), 40.0)
    assert session.unsaved
    assert not session.change(("sun", "elevation_deg"), 400.0)
    assert session.messages.pop().text == "sun.elevation_deg: must be at most 90 (got 400.0)"
    assert session.scene.sun.elevation_deg == 40.0
    session.undo()
    assert not session.unsaved
    assert session.messages.pop().text == "Undone: sun, elevation"


def test_every_technique_and_back_keeps_its_settings(session):
    for number, technique in enumerate(TECHNIQUES, start=1):
        assert session.use_nth_technique(number)
        assert session.scene.technique.name == technique.name
    assert not session.use_nth_technique(9)
    session.use_technique("bezier-blades")
    session.change(("technique", "roundness"), 0.2)
    session.use_technique("visibility-buffer")
    assert session.scene.technique.model_extra == {}
    session.use_technique("bezier-blades")
    assert session.scene.technique.model_extra == {"roundness": 0.2}


def test_a_technique_that_cannot_draw_the_scene_is_reported_and_not_used(session):
    session.change(("sowing", "stored_m"), 20.0)
    assert not session.use_technique("bezier-blades")
    assert "sowing.stored_m" in session.messages.pop().text
    assert session.scene.technique.name == "visibility-buffer"


def test_an_invalid_setting_is_reported(session):
    assert not session.change(("technique", "roundness"), 7.0)
    assert "technique.roundness: must be at most 1" in session.messages.pop().text


def test_tables_come_and_go(session):
    assert session.add(("wind",), gs.winds.Whirl)
    assert session.add(("object",), gs.objects.Box)
    assert session.add(("simulation",), gs.Simulation)
    assert [wind.kind for wind in session.scene.wind] == ["gusts", "whirl"]
    assert session.scene.simulation is not None
    assert session.remove(("wind", 0))
    assert session.remove(("simulation",))
    assert [wind.kind for wind in session.scene.wind] == ["whirl"]
    assert session.scene.simulation is None
    for _ in range(7):
        assert session.add(("wind",), gs.winds.Gusts)
    assert not session.add(("wind",), gs.winds.Gusts)
    assert "at most 8" in session.messages.pop().text


def test_mowing_lowers_the_blue_of_the_density_map_along_the_path(session):
    _stroke(session, "mow", (0.0, -5.0), (0.0, 5.0), radius_m=1.0)
    pixels = _map(session)
    rows, columns = pixels.shape[:2]
    assert pixels[rows // 2, columns // 2, 2] == round(255 * MOWN)
    assert (pixels[..., :2] == 255).all()
    mown = (pixels[..., 2] < 200).sum() * 40.0 / rows * 40.0 / columns
    assert mown == pytest.approx(10 * 2 + np.pi, rel=0.15)
    assert session.history.undo_label == "mow"
    _stroke(session, "thin", (8.0, 8.0), radius_m=2.0)
    assert _map(session)[round(28 / 40 * rows), round(28 / 40 * columns), 0] == 0
    _stroke(session, "sow", (8.0, 8.0), (0.0, 0.0), radius_m=40.0)
    assert (_map(session)[5:-5, 5:-5] > 250).mean() > 0.5
    session.undo()
    session.undo()
    session.undo()
    assert session.scene.sowing.density_map is None


def test_sowing_a_full_field_says_how_to_have_more(session):
    _stroke(session, "sow", (0.0, 0.0))
    assert "density_per_m2" in session.messages.pop().text
    assert session.scene.sowing.density_map is None


def test_a_stroke_off_the_ground_changes_nothing(session):
    _stroke(session, "mow", (500.0, 500.0))
    assert session.scene.sowing.density_map is None


def test_pressing_lays_one_track_a_stroke(session):
    _stroke(session, "press", (0.0, 0.0), (1.0, 0.0), (2.0, 0.5), radius_m=0.5)
    (force,) = session.scene.force
    assert (force.kind, force.gauge_m, force.tyre_m) == ("tracks", 0.0, 1.0)
    assert force.path[-1] == (2.0, 0.5)
    _stroke(session, "press", (5.0, 0.0))
    assert len(session.scene.force) == 2
    session.undo()
    session.undo()
    assert session.scene.force == ()
    for i in range(9):
        _stroke(session, "press", (float(i), 0.0), (float(i), 1.0))
    assert len(session.scene.force) == 8
    assert "at most 8" in session.messages[-1].text


def test_long_strokes_fit_into_a_table():
    points = [(0.01 * i, 0.0) for i in range(20_000)]
    assert len(simplified(points, 0.0)) <= 256
    assert simplified(points, 0.0)[0] == points[0]
    assert track([(1.0, 2.0)], Brush()).path[0] == (1.0, 2.0)


def test_a_paintable_map_keeps_the_existing_one():
    scene = gs.load("jahrmann2013-oasis")
    density_map = paintable_map(scene)
    assert density_map.shape[0] >= 1024
    there = np.asarray(Image.open(scene.resolve(scene.sowing.density_map)).convert("RGB"))
    assert abs(density_map[..., 0].mean() - there[..., 0].mean()) < 1.0
    before = density_map.copy()
    assert paint(density_map, scene.ground.size_m, [(-70.0, -70.0)], "thin", Brush(2.0, 0.5))
    changed = (density_map != before).any(axis=-1)
    assert 0 < changed.mean() < 0.01


def test_scenes_without_ground_cannot_be_painted():
    session = Session("planet")
    _stroke(session, "mow", (0.0, 0.0))
    assert "no ground" in session.messages.pop().text
    session.close()


def test_a_saved_scene_keeps_comments_and_loads_the_same(tmp_path):
    file = tmp_path / "hill.toml"
    file.write_text('# My hill.\ntitle = "Hill"  # a name\n\n[sun]\nelevation_deg = 30  # low\n')
    session = Session(str(file))
    session.change(("sun", "elevation_deg"), 50.0)
    session.change(("sowing", "density_per_m2"), 700.0)
    assert session.save()
    text = file.read_text()
    assert "# My hill." in text
    assert "elevation_deg = 50" in text
    assert "# low" in text
    assert gs.load(file) == session.scene
    assert not session.unsaved
    session.close()


def test_painted_maps_are_saved_beside_the_scene(tmp_path, session):
    _stroke(session, "mow", (0.0, -5.0), (0.0, 5.0))
    assert session.save(tmp_path / "mown.toml")
    name = tomllib.loads((tmp_path / "mown.toml").read_text())["sowing"]["density_map"]
    assert not Path(name).is_absolute()
    session.close()
    again = gs.load(tmp_path / "mown.toml")
    assert np.asarray(Image.open(again.resolve(name)))[..., 2].min() < 100


def test_the_first_brush_shows_in_the_map_of_any_ground(session):
    large = Session("meadow")
    assert session.brush.radius_m == 0.8
    assert 1.5 < large.brush.radius_m < 2.0
    _stroke(large, "mow", (0.3, -8.0), (0.3, 8.0), radius_m=large.brush.radius_m)
    assert paintable_map(large.scene)[..., 2].min() < 90
    large.close()


def test_painting_undone_and_saved(tmp_path):
    file = tmp_path / "a.toml"
    file.write_text("# mine\nseed = 3\n")
    session = Session(str(file))
    _stroke(session, "mow", (0.0, -5.0), (0.0, 5.0))
    assert session.save()
    mown = gs.load(file)
    session.undo()
    assert session.unsaved, "saving is no step of its own"
    assert session.save()
    assert file.read_text().startswith("# mine\nseed = 3\n")
    assert gs.load(file).sowing.density_map is None
    session.redo()
    assert session.save()
    session.close()
    again = gs.load(file)
    assert np.array_equal(*(np.asarray(Image.open(s.resolve(s.sowing.density_map))) for s in (mown, again)))


def test_what_ends_badly_is_rescued(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    session = Session("meadow")
    assert session.rescue() is None
    _stroke(session, "mow", (0.0, -5.0), (0.0, 5.0))
    kept = session.rescue()
    session.close()
    assert kept == Path("meadow-rescued-001.toml")
    scene = gs.load(kept)
    assert scene.resolve(scene.sowing.density_map).exists()


def test_what_could_not_be_read_again_is_not_written(tmp_path):
    file = tmp_path / "a.toml"
    file.write_text("seed = 3\n")
    session = Session(str(file))
    camera = gs.Camera.model_construct(position_m=(1e9, 0.0, 0.0))  # as no model lets through
    session.apply(session.scene.model_copy(update={"camera": camera}).in_folder(tmp_path), "somehow")
    assert not session.save()
    assert "could not be loaded again" in session.messages.pop().text
    assert file.read_text() == "seed = 3\n"
    session.close()


def test_what_is_write_protected_stays(tmp_path, monkeypatch):
    file = tmp_path / "a.toml"
    file.write_text("seed = 3\n")
    session = Session(str(file))
    session.change(("seed",), 4)
    monkeypatch.setattr("os.access", lambda *_: False)
    assert not session.save()
    assert "write-protected" in session.messages.pop().text
    assert file.read_text() == "seed = 3\n"
    session.close()


def test_a_view_from_beyond_the_world_is_kept_as_one_from_its_edge(session):
    session.controller.position_ws[:] = (1e7, 2.0, 3.0)
    session.keep_view()
    assert not any(message.error for message in session.messages)
    assert 0.999e6 < session.scene.camera.position_m[0] <= 1e6


def test_files_of_a_preset_come_along_when_it_is_saved(tmp_path):
    session = Session("jahrmann2013-oasis")
    assert not session.save()
    assert "preset" in session.messages.pop().text
    session.change(("seed",), 5)
    assert session.save(tmp_path / "mine.toml")
    assert gs.load(tmp_path / "mine.toml") == session.scene
    assert session.scene.resolve(session.scene.sowing.density_map).exists()
    assert (tmp_path / "mine-files").is_dir()
    session.close()


@pytest.mark.slow
@pytest.mark.parametrize("name", gs.presets())
def test_a_preset_that_is_saved_keeps_its_comments(tmp_path, name):
    session = Session(name)
    written = preset_file(name).read_text(encoding="utf-8").splitlines()
    comments = [line for line in written if line.startswith("#")]
    session.change(("seed",), session.scene.seed + 1)
    assert session.save(tmp_path / "mine.toml")
    saved = (tmp_path / "mine.toml").read_text(encoding="utf-8").splitlines()
    assert comments
    assert [line for line in saved if line.startswith("#")] == comments
    session.close()


@pytest.mark.parametrize("name", ["scene.png", "nowhere/scene.toml"])
def test_an_invalid_path_is_reported_and_nothing_is_written(tmp_path, session, name):
    session.change(("seed",), 5)
    assert not session.save(tmp_path / name)
    assert session.messages.pop().error
    assert session.unsaved
    assert list(tmp_path.iterdir()) == []


def test_opening_what_is_broken_keeps_what_is_open(tmp_path, session):
    (tmp_path / "bad.toml").write_text("[sun]\nelevation = 3\n")
    before = session.scene
    assert not session.open(str(tmp_path / "bad.toml"))
    assert "sun.elevation: unknown key" in session.messages.pop().text
    assert not session.open("meadwo")
    assert "did you mean meadow" in session.messages.pop().text
    assert session.scene is before
    assert session.open("yan2024-random")
    assert session.origin.file is None


def test_reading_a_file_again_can_be_undone(tmp_path):
    file = tmp_path / "a.toml"
    file.write_text("seed = 3\n")
    session = Session(str(file))
    session.change(("seed",), 4)
    file.write_text("seed = 9\n")
    assert session.reload()
    assert (session.scene.seed, session.unsaved) == (9, False)
    session.undo()
    assert session.scene.seed == 4
    session.close()


def test_the_view_can_be_kept(session):
    session.controller.position_ws[:] = (1.0, 2.0, 3.0)
    session.keep_view()
    assert session.scene.camera.position_m == (1.0, 2.0, 3.0)
    session.controller.position_ws[:] = (9.0, 2.0, 3.0)
    session.reset_camera()
    assert session.controller.position_ws == pytest.approx([1.0, 2.0, 3.0])


def test_names_of_new_files_count_on(tmp_path):
    assert free_name(tmp_path, "my scene!", ".png").name == "my-scene-001.png"
    (tmp_path / "my-scene-041.png").touch()
    assert free_name(tmp_path, "my scene!", ".png").name == "my-scene-042.png"
