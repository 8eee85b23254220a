"""Scenes in and out of TOML, and what a user is told about a wrong one."""

import os
import re
import warnings
from pathlib import Path

import pytest

from greensward.scene import Box, Camera, Grass, Gusts, HeightMapGround, NoiseGround, Scene, SceneError, Sky
from greensward.scene.grass import species_table
from greensward.scene.load import dump, load, named_files, presets

SETTINGS = {"visibility-buffer": Sky, "billboards": Camera}


def problems(*args, **options):
    with pytest.raises(SceneError) as caught:
        load(*args, technique_settings=SETTINGS, **options)
    assert all("\n" not in problem and "Input should" not in problem for problem in caught.value.problems)
    return caught.value.problems


@pytest.fixture
def wrong(tmp_path, monkeypatch):
    """The problems of a scene with this text, written to `scene.toml` in the current folder."""
    monkeypatch.chdir(tmp_path)

    def find(text, **options):
        Path("a.toml").write_text(text, encoding="utf-8")
        return problems("a.toml", **options)

    return find


@pytest.mark.parametrize("name", presets())
def test_every_preset_loads_and_has_a_title(name):
    assert load(name).title == presets()[name][0] != ""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("seed = -1", "seed: must be at least 0 (got -1)"),
        ("seed = 1.5", "seed: must be a whole number (got 1.5)"),
        ("seed = true", "seed: must be a whole number (got true)"),
        ("seed = 0x" + "f" * 5000, "seed: must be at most 4294967295 (got a number of 20000 bits)"),
        ("title = 3", "title: must be text in quotes (got 3)"),
        ("title = 2020-01-01", "title: must be text in quotes (got 2020-01-01)"),
        ("titel = 'x'", "titel: unknown key; did you mean title?"),
        ("'a b' = 1", '"a b": unknown key; known here are title, seed, ground,'),
        ("sun.azimuth_deg = nan", "sun.azimuth_deg: must be a finite number (got nan)"),
        ("sun.azimuth_deg = -inf", "sun.azimuth_deg: must be a finite number (got -inf)"),
        ("sun.azimuth_deg = 'east'", 'sun.azimuth_deg: must be a number (got "east")'),
        ("sun = 3", "sun: must be a table (got 3)"),
        ("[[sun]]", "sun: must be a table (got [a table])"),
        ("[grass]", "grass: must be a list of tables, each under its own [[grass]] (got a table)"),
        ("grass = [3]", "grass[0]: must be a table (got 3)"),
        ("grass = [{height_m = [-1.0, 2.0]}]", "grass[0].height_m[0]: must be at least 0.001 (got -1.0)"),
        (
            "grass = [{height_m = [2, 1]}]",
            "grass[0].height_m: must be [low, high] with low at most high (got [2, 1])",
        ),
        ("grass = [{height_m = 1}]", "grass[0].height_m: must be a list (got 1)"),
        ("grass = [{height_m = [1, 2, 3]}]", "grass[0].height_m: must hold at most 2 values (got 3)"),
        ("grass = [{heigth_m = [1, 2]}]", "grass[0].heigth_m: unknown key; did you mean height_m?"),
        ("grass = [{species = 'fescu'}]", 'cornflower (got "fescu"); did you mean fescue?'),
        ("grass = [{species = 3}]", "grass[0].species: must be text in quotes (got 3)"),
        ("grass = [{shape = 'quadd'}]", 'dandelion (got "quadd"); did you mean quad?'),
        ("grass = [{tip_colour = 'green'}]", 'must be an sRGB colour such as "#7d9a45" (got "green")'),
        ("grass = [" + "{}," * 17 + "]", "grass: must hold at most 16 values (got 17)"),
        (
            "ground = {kind = 'hill'}",
            'ground.kind: must be one of flat, heightmap, noise, endless, none (got "hill")',
        ),
        ("ground = {kind = []}", "ground.kind: must be one of flat, heightmap, noise, endless, none (got [])"),
        (
            "object = [{kind = 'box', position_m = [0, 0, 0], rotation_deg = 3}]",
            "rotation_deg: unknown key; did you mean yaw_deg?",
        ),
        (
            "object = [{kind = 'box', position_m = [0, 0, 0], color = '#ffffff'}]",
            "color: unknown key; did you mean colour?",
        ),
        ("sowing = {density = 3}", "sowing.density: unknown key; did you mean density_per_m2?"),
        ("sowing = {reach_km = 3}", "sowing.reach_km: unknown key; did you mean reach_m?"),
        ("sun = {pitch_deg = 3}", "sun.pitch_deg: unknown key; did you mean elevation_deg?"),
        ("object = [{file = 'a.glb', position_m = [0, 0, 0]}]", 'mesh (got ""); only "mesh" has all keys given'),
        ("colour = {}", 'colour.kind: must be one of noise, ground (got "")'),
        (
            "colour = {kind = 'ground'}",
            'colour.kind: must be "noise" on ground without a picture (got "ground"), or set ground.texture or '
            "ground.terrain_map",
        ),
        (
            "colour = {kind = 'noise', neighbours = 2}",
            'colour.neighbours: belongs to kind "ground", but the kind here is "noise"',
        ),
        (
            "colour = {kind = 'noise', noise = [{octaves = 12, wavelength_m = 0.5}]}",
            "colour.noise[0]: octaves must leave the finest a wavelength of 0.001 m or more (got 0.00014 m for 12); "
            "lower octaves or lacunarity, or raise wavelength_m",
        ),
        (
            "colour = {kind = 'noise', noise = [{octaves = 0}]}",
            "colour.noise[0].octaves: must be at least 1 (got 0)",
        ),
        (
            "colour = {kind = 'noise', noise = [{weight = 0.0}]}",
            "colour.noise[0].weight: must be at least 0.001 (got 0.0)",
        ),
        (
            "colour = {kind = 'noise', noise = [{channel = 'alpha'}]}",
            'colour.noise[0].channel: must be one of red, green, blue, all (got "alpha")',
        ),
        (
            "colour = {kind = 'noise', noise = [" + "{}," * 13 + "]}",
            "colour.noise: must hold at most 12 values (got 13)",
        ),
        ("phong = {shininess = 0.5}", "phong.shininess: must be at least 1 (got 0.5)"),
        ("phong = {diffuse = 1.5}", "phong.diffuse: must be at most 1 (got 1.5)"),
        ("phong = {specular = nan}", "phong.specular: must be a finite number (got nan)"),
        (
            "phong = {ambient = 0.0, diffuse = 0.0, specular = 0.0}",
            "phong: ambient, diffuse or specular must be above 0, or all is black (got 0 for each)",
        ),
        ("ground = 1", "ground: must be a table (got 1)"),
        ("ground = {kind = 'heightmap'}", "ground: file: is missing and has no default"),
        (
            "ground = {octaves = 3}",
            'ground.octaves: belongs to kind "noise" or "endless", but the kind here is "flat"',
        ),
        ("ground = {kind = 'noise', size_m = [0, 1]}", "ground.size_m[0]: must be at least 0.001 (got 0)"),
        ("ground = {kind = 'noise', octave = 3}", "ground.octave: unknown key; did you mean octaves?"),
        ("sowing.density_map = ''", 'sowing.density_map: must not be empty (got "")'),
        ("sowing.density_map = 'no.png'", "sowing.density_map: no such file: no.png"),
        ("sowing.density_map = '.'", "sowing.density_map: is not a file: ."),
        (
            "sowing.density_map = '~nobody-here/x'",
            'density_map: cannot be a file\'s name (got "~nobody-here/x")',
        ),
        (r'sowing.density_map = "\u0000"', "sowing.density_map: "),
        (
            "wind = [{kind = 'calm'}]",
            "wind[0].kind: must be one of gusts, strong, helicopter, random, waves, blast, whirl, texture, ripples, "
            'idle, wake (got "calm")',
        ),
        ("wind = [{kind = 'wake', cells = 64}]", "wind[0].cells: must be odd, so that the camera has a cell"),
        ("wind = [{kind = 'wake', cells = 259}]", "wind[0].cells: must be at most 257 (got 259)"),
        (
            "wind = [{kind = 'wake'}, {}, {kind = 'wake'}]",
            "wind[2]: a scene has at most one wake, and wind[0] is one",
        ),
        (
            "object = [{kind = 'box', position_m = [0, 0, 0], grass = {density_from = 'colours'}}]",
            'object[0]: grass.density_from = "colours" needs a mesh',
        ),
        (
            "object = [{kind = 'box', position_m = [0, 0, 0], path = {times_s = [1], positions_m = [[0, 0, 0]]}}]",
            "object[0].path.times_s: must hold at least 2 values (got 1)",
        ),
        (
            "object = [{kind = 'box', position_m = [0, 0, 0], "
            "path = {times_s = [2, 1], positions_m = [[0, 0, 0], [1, 0, 0]]}}]",
            "object[0].path: times_s must rise from key to key (got 1 after 2)",
        ),
        (
            "object = [{kind = 'capsule', position_m = [0, 0, 0], radius_m = 0}]",
            "object[0].radius_m: must be at least 0.001 (got 0)",
        ),
        (
            "object = [{kind = 'capsule', position_m = [0, 0, 0], radius_m = 1e9}]",
            "object[0].radius_m: must be at most 10000",
        ),
        ("wind = [{kind = 'texture', files = []}]", "wind[0].files: must hold at least 1 value"),
        ("force = [{kind = 'wind'}]", 'force[0].kind: must be one of map, footprints, tracks, stamp (got "wind")'),
        ("force = [{}]", 'force[0].kind: must be one of map, footprints, tracks, stamp (got "")'),
        ("force = [{kind = 'map'}]", "force[0].file: is missing and has no default"),
        ("force = [{kind = 'map', file = 'no.png'}]", "force[0].file: no such file: no.png"),
        ("force = [{kind = 'tracks'}]", "force[0].path: is missing and has no default"),
        ("force = [{kind = 'tracks', path = [[0, 0]]}]", "force[0].path: must hold at least 2 values (got 1)"),
        (
            "force = [{kind = 'footprints', path = [[1, 2], [1, 2]]}]",
            "force[0]: path must lead from one point to another (all its points are the same)",
        ),
        (
            "force = [{kind = 'footprints', path = [[0, 0], [90, 0]]}]",
            "force[0]: footprints of 0.29 m may span at most 49.4 m with all around them (got 91.1); shorten path",
        ),
        (
            "force = [{kind = 'tracks', path = [[0, 0], [0, 900]]}]",
            "force[0]: tracks of 0.25 m may span at most 128 m",
        ),
        (
            "force = [{kind = 'footprints', path = [[0, 0], [9, 0]], foot_m = [0.1, 0.3]}]",
            "force[0]: foot_m must be [length, width], width at most length (got [0.1, 0.3])",
        ),
        (
            "force = [{kind = 'tracks', path = [[0, 0], [9, 0]], foot_m = [0.3, 0.1]}]",
            'force[0].foot_m: belongs to kind "footprints", but the kind here is "tracks"',
        ),
        (
            "force = [{kind = 'tracks', path = [[0, 0], [9, 0]], pressure = 2}]",
            "force[0].pressure: must be at most 1 (got 2)",
        ),
        ("force = [" + "{kind = 'tracks', path = [[0, 0], [9, 0]]}," * 9 + "]", "force: must hold at most 8 values"),
        ("growth = {height = [[0.5, 1], [0.2, 1]]}", "growth.height: must hold [age, factor] pairs with rising ages"),
        ("simulation = {step_s = 1.0}", "simulation.step_s: must be at most 0.1 (got 1.0)"),
        ("object = [{kind = 'box', position_m = [1]}]", "object[0].position_m: must hold 3 values (got 1)"),
        ("camera = {near_m = 10, far_m = 1}", "camera: far_m must be above near_m"),
        ("camera.target_m = [0, 1e7, 0]", "camera.target_m[1]: must be at most 1000000 (got 10000000.0)"),
        ("camera.fov_y_deg = 170", 'camera: fov_y_deg must be below 170 (got 170), or projection = "fisheye"'),
        ("shadows.enabled = 1", "shadows.enabled: must be true or false (got 1)"),
        (
            "technique.name = 'bilboards'",
            'visibility-buffer, billboards (got "bilboards"); did you mean billboards?',
        ),
        ("technique.name = 3", "technique.name: must be text in quotes (got 3)"),
        ("technique.haze = -1", "technique.haze: must be at least 0 (got -1)"),
        ("technique.haez = 1", "technique.haez: unknown key; did you mean haze?"),
        ("technique = 1", "technique: must be a table (got 1)"),
    ],
)
def test_a_wrong_value_is_told_with_place_rule_value_and_cure(wrong, text, expected):
    (problem,) = wrong(text)
    assert problem.startswith("a.toml: ")
    assert expected in problem


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"a = 1\nseed 3", "a.toml: line 2, column 6: expected '='"),
        (b"a =", "a.toml: end of document: invalid value"),
        (b"\nseed = \xff", "a.toml: line 2: is not UTF-8 text"),
        (b"a = " + b"[" * 5000, "a.toml: is nested too deeply"),
        (b"a = 1" + b"0" * 5000, "a.toml: TOML: a number has too many digits"),
        (b"a = 1\na = 2", "a.toml: end of document: cannot overwrite a value"),
        (b"#" * (16 * 2**20 + 1), "a.toml: is larger than a scene can be (16 MiB)"),
    ],
)
def test_text_that_is_no_toml_is_told_with_its_line(tmp_path, monkeypatch, content, expected):
    monkeypatch.chdir(tmp_path)
    Path("a.toml").write_bytes(content)
    (problem,) = problems("a.toml")
    assert problem.startswith(expected)


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("medow", "medow: no preset has this name and no file is there; did you mean meadow?"),
        ("qqqq", "; presets are "),
        ("hill.toml", "hill.toml: no such file or folder"),
        ("./hill", "./hill: no such file or folder"),
        (".", ".: the folder holds no scene.toml"),
        ("", ": the folder holds no scene.toml"),
        ("a\0b", '"a\\u0000b": no preset'),
        ("x" * 5000, "x…: no preset"),
        (os.devnull, f"{os.devnull}: is not a file"),
    ],
)
def test_a_source_that_is_no_scene_is_told(tmp_path, monkeypatch, source, expected):
    monkeypatch.chdir(tmp_path)
    (problem,) = problems(source)
    assert expected in problem
    assert len(problem) < 600


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read everything")
def test_an_unreadable_file_is_told(tmp_path):
    file = tmp_path / "a.toml"
    file.touch(mode=0)
    assert "cannot be read: Permission denied" in problems(file)[0]


def test_all_problems_come_at_once(wrong):
    found = wrong(
        "titel=1\nground.texture='no.png'\ngrass=[{species='x', height_m=[1]}]\ntechnique.name='y'",
        overrides=["seed=-1", "wnd=2", "nonsense"],
        camera="askew",
    )
    text = "\n".join(found)
    assert len(found) == 9
    for part in ("titel", "ground.texture", "grass[0].species", "grass[0].height_m", "technique.name"):
        assert f"a.toml: {part}: " in text
    assert "--set: seed: must be at least 0 (got -1)" in text
    assert "--set: wnd: unknown key; did you mean wind?" in text
    assert '--set: must be key=value, such as wind.0.speed_mps=12 (got "nonsense")' in text
    assert "--camera: must be x,y,z:tx,ty,tz" in text


def test_a_folder_holds_its_scene_and_the_files_it_names(tmp_path):
    (tmp_path / "scene.toml").write_text("sowing.density_map = 'd.png'", encoding="utf-8-sig")
    (tmp_path / "d.png").touch()
    scene = load(tmp_path)
    assert named_files(scene, {}) == [("sowing.density_map", tmp_path / "d.png")]
    (tmp_path / "d.png").unlink()
    with pytest.raises(SceneError, match=f"sowing.density_map: no such file: {re.escape(str(tmp_path / 'd.png'))}"):
        load(tmp_path)


def test_read_file_is_asked_about_each_file_and_may_refuse(wrong):
    def read(key, path, table):
        raise SceneError([f"{path} is no good as {key} of {table['kind']}"])

    Path("e.png").touch()
    found = wrong("seed = -1\nground = {kind = 'heightmap', file = 'e.png', texture = 'no.png'}", read_file=read)
    assert found == (
        "a.toml: ground.texture: no such file: no.png",
        "a.toml: ground.file: e.png is no good as ground.file of heightmap",
        "a.toml: seed: must be at least 0 (got -1)",
    )


def test_overrides_reach_keys_that_the_file_leaves_out(tmp_path):
    (tmp_path / "scene.toml").write_text("[[grass]]\nspecies = 'reed'", encoding="utf-8")
    scene = load(
        tmp_path,
        overrides=[
            "wind.0.speed_mps=12",
            "grass[0].height_m.1=3.5",
            "post.exposure_ev = 0.5",
            "title=Two words",
            "object=[{kind='box', position_m=[0, 0, 0]}]",
            "camera.position_m.1=9",
        ],
    )
    assert scene.wind == (Gusts(speed_mps=12),)
    assert scene.grass == (Grass(species="reed", height_m=(1.2, 3.5)),)
    assert scene.post.exposure_ev == 0.5
    assert scene.title == "Two words"
    assert scene.object == (Box(kind="box", position_m=(0, 0, 0)),)
    assert scene.camera == Camera(position_m=(0, 9, 8))
    assert load(tmp_path, overrides={"seed": 3, "post.saturation": "0.5"}).seed == 3
    begun = load(
        tmp_path, overrides=["simulation.form=yan2024", "growth.age=0.5", "water.level_m=-1", "mass.reference_kg=2"]
    )
    assert begun.simulation.form == "yan2024"
    assert begun.growth.age == 0.5
    assert begun.water.level_m == -1
    assert begun.mass.reference_kg == 2


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("wind.7.speed_mps=1", "--set: wind: has no item 7 (1 in all, counted from 0)"),
        (
            "wind.x.speed_mps=1",
            "--set: wind: is a list, so the number of an item must follow, as in wind.0.speed_mps",
        ),
        ("object.0.kind=box", "--set: object: has no item 0 (it is empty)"),
        ("seed.x=1", "--set: seed: holds a single value, so it has no key x"),
        ("grass.0.heigth_m=1", "--set: grass[0].heigth_m: unknown key; did you mean height_m?"),
        ("post.exposure_ev=bright", '--set: post.exposure_ev: must be a number (got "bright")'),
        ("ground.kind=heightmap", "--set: ground: file: is missing and has no default"),
        ("title=1\nseed = 2", ""),
        ("=1", "--set: must be key=value"),
        ("a..b=1", "--set: must be key=value"),
        ("", "--set: must be key=value"),
    ],
)
def test_a_wrong_override_is_blamed_on_the_option(wrong, override, expected):
    if expected:
        (problem,) = wrong("", overrides=[override])
        assert problem.startswith(expected)
    else:
        assert load("meadow", overrides=[override]).title == "1\nseed = 2"


def test_a_preset_takes_overrides_of_its_species_seed_and_technique():
    scene = load(
        "meadow",
        seed=9,
        technique="billboards",
        overrides=["technique.far_m=9.0"],
        technique_settings=SETTINGS,
    )
    assert scene.seed == 9
    assert scene.technique.name == "billboards"
    assert scene.technique.model_extra == {"far_m": 9.0}


def test_another_technique_drops_the_settings_of_the_first(tmp_path):
    file = tmp_path / "a.toml"
    file.write_text("technique = {name = 'visibility-buffer', haze = 3.0}", encoding="utf-8")
    assert load(file, technique="visibility-buffer", technique_settings=SETTINGS).technique.model_extra == {
        "haze": 3.0
    }
    assert load(file, technique="billboards", technique_settings=SETTINGS).technique.model_extra == {}


def test_the_camera_comes_from_numbers_or_a_file(tmp_path):
    camera = load("meadow", camera="1,2.5,-3:0,0,0:35").camera
    assert (camera.position_m, camera.target_m, camera.fov_y_deg) == ((1, 2.5, -3), (0, 0, 0), 35)
    file = tmp_path / "view.toml"
    file.write_text("[camera]\nposition_m = [7, 8, 9]", encoding="utf-8")
    assert load("meadow", camera=str(file)).camera == Camera(position_m=(7, 8, 9))
    file.write_text("[camera]\nfov = 3", encoding="utf-8")
    assert problems("meadow", camera=str(file))[0].startswith(f"{file}: camera.fov: unknown key")
    file.write_text("x = 3", encoding="utf-8")
    assert problems("meadow", camera=str(file)) == (f"{file}: has no [camera] table",)
    file.write_text("x 3", encoding="utf-8")
    assert problems("meadow", camera=str(file))[0].startswith(f"{file}: line 1")
    assert problems("meadow", camera="1,2,3:4,5,nan") == (
        "--camera: camera.target_m[2]: must be a finite number (got nan)",
    )
    assert problems("meadow", camera="1,2,3:1,2,3") == ("--camera: camera: target_m must differ from position_m",)
    assert problems("meadow", camera="\0" * 9)[0].startswith("--camera: must be")


def test_a_scene_survives_toml(tmp_path):
    scene = Scene(
        title='Ünder the "oak"\n,',
        ground=HeightMapGround(file="e.npz", key="a", no_data=-9999, height_m=(1, 2)),
        grass=(Grass(species="reed", share=0.1, height_m=(1, 2)), Grass(species="lawn"), Grass()),
        wind=(),
        object=(Box(kind="box", position_m=(1, 2, 3)),),
        camera=Camera(position_m=(1e-7, 1e6, -0.0)),
        technique={"name": "x", "depth": [1, 2.5], "words": ["a,", "[\n"], "inner": {"deep": [True]}},
    ).in_folder(tmp_path)
    (tmp_path / "e.npz").touch()
    (tmp_path / "a.toml").write_text(dump(scene), encoding="utf-8")
    assert load(tmp_path / "a.toml") == scene
    assert load(tmp_path / "a.toml") != scene.model_copy(update={"seed": 2})


def test_dump_writes_only_what_does_not_go_without_saying():
    assert dump(Scene()) == ""
    text = dump(Scene(ground=NoiseGround(octaves=3), grass=(Grass(species="reed", height_m=(1, 2)),) * 3))
    assert text.startswith('[ground]\nkind = "noise"\noctaves = 3\n')
    assert text.count('[[grass]]\nspecies = "reed"\nheight_m = [1.0, 2.0]\n') == 3


def test_every_species_is_valid_and_every_problem_of_an_unknown_one_is_told(wrong):
    for name in species_table():
        Grass(species=name)
    assert len(wrong("grass = [{species = 'x', share = -1}]")) == 2


@pytest.mark.slow
def test_no_word_of_the_validator_reaches_a_user():
    """Every part of a scene is replaced by a value of each wrong type."""
    for key in Scene.model_fields:
        for value in (3, "x", [], {}, True, None, [3], [[]], {"": 1}):
            try:
                load("meadow", overrides={key: value})
                told = ""
            except SceneError as error:
                told = str(error)
            assert not re.search("Input|pydantic|valid |Value error", told), (key, value)


@pytest.mark.parametrize(
    ("camera", "warned"),
    [
        ("fov_y_deg = 40\nfx_px = 900.0", "camera.fov_y_deg: does not count, but fx_px with"),
        ('fov_y_deg = 40\nprojection = "orthographic"', "camera.fov_y_deg: does not count, but view_height_m with"),
        ("view_height_m = 4.0", "camera.view_height_m: does not count, but fov_y_deg with"),
        ("fov_y_deg = 40", None),
        ('projection = "orthographic"\nview_height_m = 4.0', None),
    ],
)
def test_keys_of_a_lens_that_do_not_count_are_warned_of(tmp_path, camera, warned):
    (tmp_path / "a.toml").write_text(f"[camera]\n{camera}\n")
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        load(tmp_path / "a.toml")
    assert [str(each.message).startswith(warned or "") for each in told] == ([True] if warned else [])
