"""The commands, with a renderer that draws nothing: what they print, where, and how they leave."""

import json
import re
import subprocess
import sys
import types

import numpy as np
import pytest
from PIL import Image

from greensward.cli import main
from greensward.scene import GreenswardError
from greensward.scene.load import presets


class FakeRenderer:
    """Keeps what it was asked for, and answers with a grey picture."""

    asked: dict = {}  # noqa: RUF012
    fails: BaseException | None = None
    stored = 212345

    def __init__(self, scene, *, size, samples, device):
        self.scene, self.size, self.technique_name = scene, size, scene.technique.name
        FakeRenderer.asked = {"scene": scene, "size": size, "samples": samples, "device": device}
        self.seconds = {"sow": 1.06, "draw": 9.0}
        self.blades, self.driver = FakeRenderer.stored, "llvmpipe"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        FakeRenderer.asked["left"] = True

    def render(self, *, time_s, aovs, progress):
        FakeRenderer.asked |= {"time_s": time_s, "aovs": aovs}
        for done in range(3):
            progress(done, 3)
        if self.fails:
            raise self.fails
        width, height = self.size
        truth = {name: np.zeros((height, width)) for name in aovs} | {"camera": "{}"}
        counts = types.SimpleNamespace(considered=9, simulated=0, drawn=7, pixels=5)
        return types.SimpleNamespace(image=np.full((height, width, 3), 128, np.uint8), truth=truth, counts=counts)


@pytest.fixture
def greensward(monkeypatch, capsys, tmp_path):
    """Runs the command line in a folder of its own: exit code, standard output, standard error."""
    fake = types.ModuleType("greensward.renderer")
    fake.Renderer = FakeRenderer
    monkeypatch.setitem(sys.modules, "greensward.renderer", fake)
    monkeypatch.setattr(FakeRenderer, "fails", None)
    monkeypatch.setattr(FakeRenderer, "asked", {})
    monkeypatch.chdir(tmp_path)

    def run(*args):
        with pytest.raises(SystemExit) as left:
            main(list(args))
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return left.value.code, out, err

    return run


def test_render_does_not_count_blades_that_a_technique_does_not_store(greensward, monkeypatch):
    monkeypatch.setattr(FakeRenderer, "stored", 0)
    _, out, _ = greensward(*RENDER, "--technique", "geometry-billboards")
    assert out.startswith("a.png: 32×18, geometry-billboards on llvmpipe in 0.")


RENDER = ("render", "meadow", "-o", "a.png", "--size", "32x18")


def test_render_writes_the_picture_and_tells_what_it_took(greensward, tmp_path):
    code, out, err = greensward(*RENDER)
    assert (code, err) == (0, "")
    assert out.startswith("a.png: 32×18, 212,345 blades of visibility-buffer on llvmpipe in 0.")
    assert "sow 1.1, draw 9.0, write 0.0)" in out
    assert out.count("\n") == 1
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size == (32, 18)
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]
    assert FakeRenderer.asked["left"]


def test_render_hands_every_option_on(greensward, tmp_path):
    code, out, _ = greensward(
        *RENDER, "--time", "-2.5", "--samples", "16", "--seed", "9", "--technique", "bezier-blades",
        "--set", "wind.0.speed_mps=12", "--set", "post.exposure_ev=0.5", "--camera", "1,2,3:0,0,0:35",
        "--device", "cpu", "--aov", "depth,blade_id", "--aov", "class", "--json",
    )  # fmt: skip
    assert code == 0
    asked = FakeRenderer.asked
    assert (asked["time_s"], asked["samples"], asked["size"], asked["device"]) == (-2.5, 16, (32, 18), "cpu")
    assert asked["aovs"] == ("depth", "blade_id", "class")
    scene = asked["scene"]
    assert (scene.seed, scene.wind[0].speed_mps, scene.post.exposure_ev) == (9, 12, 0.5)
    assert (scene.camera.position_m, scene.camera.fov_y_deg) == ((1, 2, 3), 35)
    answer = json.loads(out)
    seconds = answer.pop("seconds")
    assert list(seconds) == ["load", "sow", "draw", "write", "total"]
    assert answer == {
        "output": "a.png",
        "truth": "a.npz",
        "width": 32,
        "height": 18,
        "technique": "bezier-blades",
        "driver": "llvmpipe",
        "blades": 212345,
        "counts": {"considered": 9, "simulated": 0, "drawn": 7, "pixels": 5},
    }
    with np.load(tmp_path / "a.npz") as truth:
        assert set(truth) == {"depth", "blade_id", "class", "camera"}


@pytest.mark.parametrize(
    ("args", "expected"),
    [
        (["--size", "0x0"], "must be WIDTHxHEIGHT, such as 1280x720, each from 1 to 16384 (got 0x0)"),
        (["--size", "-3x4"], "(got -3x4)"),
        (["--size", "16385x4"], "(got 16385x4)"),
        (["--size", "9" * 5000 + "x4"], "must be WIDTHxHEIGHT"),
        (["--size", "big"], "(got big)"),
        (["--samples", "0"], "'--samples': must be a whole number from 1 to 4096 (got 0)"),
        (["--samples", "4097"], "(got 4097)"),
        (["--samples", "1.5"], "(got 1.5)"),
        (["--seed", "-1"], "'--seed': must be a whole number from 0 to 4294967295 (got -1)"),
        (["--time", "nan"], "'--time': must be a finite number of seconds (got nan)"),
        (["--time", "inf"], "(got inf)"),
        (["--time", "noon"], "(got noon)"),
        (["--device", "gpu"], "'--device': must be auto, cpu, or the number of a GPU from 0 (got gpu)"),
        (["--aov", "depth,blade-id"], "'--aov': unknown output blade-id; did you mean blade_id?"),
        (["--aov", "x"], "unknown output x; choose from depth, normal, class, blade_id, motion, albedo"),
        (["--aov", ""], "unknown output without a name; choose from"),
        (["--sed", "1"], "--seed"),
        (["-o", "a.gif"], "a.gif: the file's name must end in one of .png"),
        (["-o", "no/a.png"], "no/a.png: there is no folder no; make it first"),
        (["--set", "wind.0.sped=1"], "--set: wind[0].sped: unknown key; did you mean speed_mps?"),
        (["--camera", "up"], "--camera: must be x,y,z:tx,ty,tz"),
        (["--technique", "bezier"], "--technique: technique.name: must be one of bezier-blades, billboard-grid"),
    ],
)
def test_a_wrong_option_is_told_before_anything_is_drawn(greensward, tmp_path, args, expected):
    code, out, err = greensward(*RENDER, *args)
    assert (code, out) == (2, "")
    assert expected in err
    assert "Input should" not in err
    assert FakeRenderer.asked == {}
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("failure", "code", "told"),
    [
        (GreenswardError("The driver was lost."), 1, "The driver was lost.\n"),
        (MemoryError(), 1, "There is not enough memory for this.\n"),
        (OSError(28, "No space left"), 1, "The system refused: [Errno 28] No space left\n"),
        (KeyboardInterrupt(), 130, ""),
    ],
)
def test_a_failure_leaves_no_file_and_its_own_exit_code(greensward, tmp_path, monkeypatch, failure, code, told):
    monkeypatch.setattr(FakeRenderer, "fails", failure)
    assert greensward(*RENDER) == (code, "", told)
    assert list(tmp_path.iterdir()) == []


def test_a_defect_of_the_program_is_not_hidden(greensward, monkeypatch):
    monkeypatch.setattr(FakeRenderer, "fails", ZeroDivisionError())
    with pytest.raises(ZeroDivisionError):
        main(list(RENDER))
    assert greensward("--version")[0] == 0


def test_the_truth_must_be_writable_too(greensward, tmp_path):
    (tmp_path / "a.npz").mkdir()
    code, _, err = greensward(*RENDER, "--aov", "depth")
    assert (code, err) == (2, "a.npz: is a folder, and the output must be a file\n")


def test_what_the_scene_reads_is_not_overwritten(greensward, tmp_path):
    Image.new("L", (4, 4)).save(tmp_path / "a.png")
    (tmp_path / "scene.toml").write_text("sowing.density_map = 'a.png'")
    code, _, err = greensward("render", ".", "-o", "a.png")
    assert code == 2
    assert err == "a.png: would overwrite what the scene reads as sowing.density_map; choose another name\n"


def test_a_terminal_shows_progress(greensward, monkeypatch):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    assert greensward(*RENDER)[0] == 0


def test_scenes_lists_every_preset(greensward):
    code, out, _ = greensward("scenes")
    assert code == 0
    assert len(out.splitlines()) == len(presets())
    code, out, _ = greensward("scenes", "--json")
    listed = {item["name"]: (item["title"], item["summary"]) for item in json.loads(out)}
    assert (code, listed) == (0, presets())


def test_a_new_scene_passes_check_as_it_is(greensward, tmp_path):
    code, out, _ = greensward("new", "deep/hill")
    assert (code, out.split()[1]) == (0, "deep/hill/scene.toml.")
    assert [path.name for path in (tmp_path / "deep/hill").iterdir()] == ["scene.toml"]
    code, out, err = greensward("check", "deep/hill")
    assert (code, err) == (0, "")
    assert out == "deep/hill: valid: “My meadow”, noise ground, 3 species, no files\n"
    assert greensward("render", "deep/hill", "-o", "a.png", "--size", "8x8")[0] == 0


def test_what_the_template_suggests_in_comments_is_valid_too(greensward, tmp_path):
    greensward("new", "hill")
    file = tmp_path / "hill/scene.toml"
    text = re.sub(r"^# (?=\w+ = |\[)", "", file.read_text(encoding="utf-8"), flags=re.MULTILINE)
    first, *_, landscape = text.partition("# A real landscape instead:\n")
    maps = "".join(re.findall(r"^(?:texture|terrain).*\n", first, re.MULTILINE))
    file.write_text(landscape.replace("[ground]\n", "[ground]\n" + maps, 1), encoding="utf-8")
    for name in ("soil", "fields", "elevation", "density", "colours"):
        Image.new("L", (4, 4)).save(tmp_path / f"hill/{name}.png")
    assert "5 files" in greensward("check", "hill")[1]


def test_new_touches_nothing_that_is_there(greensward, tmp_path):
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "notes").touch()
    (tmp_path / "file").touch()
    (tmp_path / "empty").mkdir()
    assert greensward("new", "full")[::2] == (2, "full: is not empty; name a folder that is new or empty\n")
    assert greensward("new", "file")[::2] == (2, "file: is a file; name a folder that is new or empty\n")
    assert greensward("new", "file/in")[::2] == (2, "file/in: cannot be made: Not a directory\n")
    assert greensward("new", "empty")[0] == 0
    assert [path.name for path in (tmp_path / "full").iterdir()] == ["notes"]


def test_check_reads_what_forces_name(greensward, tmp_path):
    Image.new("L", (4, 4), 255).save(tmp_path / "light.png")
    (tmp_path / "a.toml").write_text(
        "[[force]]\nkind = 'map'\nfile = 'light.png'\n"
        "[[force]]\nkind = 'stamp'\noutline = 'light.png'\nplaces = [[0, 0, 0]]\n"
    )
    code, _, err = greensward("check", "a.toml")
    assert code == 2
    assert err.splitlines() == [
        "a.toml: force[0].file: light.png: is a grey picture, and it needs red, green and blue; save it in colours",
        "a.toml: force[1].outline: light.png: nothing in it is dark, so nothing would press",
    ]


def _disc(path, side=64):
    x = np.arange(side) - 0.5 * (side - 1)
    Image.fromarray(np.where(np.hypot(x[None], x[:, None]) < 0.25 * side, 0, 255).astype(np.uint8)).save(path)


def test_stamp_makes_a_force_map_of_an_outline(greensward, tmp_path):
    _disc(tmp_path / "disc.png")
    code, out, err = greensward("stamp", "disc.png", "-o", "force.png", "--impact", "10")
    assert (code, err) == (0, "")
    assert out == 'force.png: 64×64; name it as file of a [[force]] with kind = "map"\n'
    with Image.open(tmp_path / "force.png") as picture:
        assert picture.mode == "RGB"
        pixels = np.array(picture)
    assert pixels[32, 32].tolist() == [128, 1, 128]  # down
    assert pixels[1, 1].tolist() == [128, 128, 128]  # none
    assert pixels[32, 48, 0] > 230 > 140 > pixels[32, 52, 0] - 60  # eastwards at its east border, and less beyond
    assert pixels[32, 60].tolist() == [128, 128, 128]
    assert pixels[48, 32, 2] > 230
    assert pixels[15, 32, 2] < 30
    greensward("stamp", "disc.png", "-o", "half.tif", "--impact", "10", "--pressure", "0.5")
    with Image.open(tmp_path / "half.tif") as picture:
        assert np.array(picture)[32, 32].tolist() == [128, 64, 128]
    (tmp_path / "a.toml").write_text("[[force]]\nkind = 'map'\nfile = 'force.png'\n")
    assert greensward("check", "a.toml")[0] == 0


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("light.png", "-o", "f.png", "--impact", "9"), "light.png: nothing in it is dark, so nothing would press\n"),
        (("no.png", "-o", "f.png", "--impact", "9"), "no.png: no such file\n"),
        (("disc.png", "-o", "f.jpg", "--impact", "9"), "f.jpg: the file's name must end in one of .png, .tif, .tiff"),
        (("disc.png", "-o", "no/f.png", "--impact", "9"), "no/f.png: there is no folder no; make it first\n"),
        (("disc.png", "-o", "disc.png", "--impact", "9"), "disc.png: would overwrite the outline; choose another"),
        (("disc.png", "-o", "f.png", "--impact", "0"), "must be a number of pixels above 0, at most 512 (got 0)"),
        (("disc.png", "-o", "f.png", "--impact", "nan"), "must be a number of pixels above 0, at most 512 (got nan)"),
        (("disc.png", "-o", "f.png", "--impact", "9", "--pressure", "2"), "must be a number from 0 to 1 (got 2)"),
        (("disc.png", "-o", "f.png"), "--impact"),
        (("line.png", "-o", "f.png", "--impact", "9"), "line.png: must be 2 to 4096 pixels a side (got 8×1)\n"),
    ],
)
def test_stamp_refuses_in_one_sentence(greensward, tmp_path, arguments, told):
    _disc(tmp_path / "disc.png")
    Image.new("L", (8, 8), 255).save(tmp_path / "light.png")
    Image.new("L", (8, 1), 0).save(tmp_path / "line.png")
    before = sorted(tmp_path.iterdir())
    code, out, err = greensward("stamp", *arguments)
    assert (code, out) == (2, "")
    assert told in err
    assert sorted(tmp_path.iterdir()) == before


def test_check_tells_all_problems_at_once_also_of_files(greensward, tmp_path):
    Image.new("RGB", (4, 4), "red").save(tmp_path / "red.png")
    (tmp_path / "short.png").write_bytes((tmp_path / "red.png").read_bytes()[:40])
    (tmp_path / "a.toml").write_text(
        "seed = -1\nsowing = {density_map = 'short.png', vegetation_map = 'red.png'}\n"
        "[ground]\nkind = 'heightmap'\nfile = 'red.png'\ntexture = 'no.png'\n"
    )
    code, out, err = greensward("check", "a.toml")
    assert (code, out) == (2, "")
    told = err.splitlines()
    assert told[0] == "a.toml: ground.texture: no such file: no.png"
    assert told[1].startswith("a.toml: ground.file: red.png: must be a grey picture")
    assert told[2].startswith("a.toml: sowing.density_map: short.png: is ")
    assert told[3:] == ["a.toml: seed: must be at least 0 (got -1)"]
    code, out, err = greensward("check", "a.toml", "--json")
    assert (code, err) == (2, "")
    assert json.loads(out) == {"ok": False, "errors": told, "warnings": []}
    (tmp_path / "b.toml").write_text("ground = {terrain_map = 'red.png'}\ncolour = {kind = 'ground'}\n")
    code, out, _ = greensward("check", "b.toml", "--json")
    (error,) = json.loads(out)["errors"]
    assert error.startswith("b.toml: ground.terrain_map: red.png: must have a texel of greenness 0.05")
    code, out, _ = greensward("check", "meadow", "--json")
    assert (code, json.loads(out)) == (0, {"ok": True, "errors": [], "warnings": []})


def test_check_warns_of_what_is_probably_not_meant(greensward, tmp_path):
    red = np.zeros((4, 4, 3), np.uint8)
    red[..., 0] = 255
    Image.fromarray(red).save("red.png")
    (tmp_path / "a.toml").write_text('[sowing]\ndensity_map = "red.png"\n')
    code, out, err = greensward("check", "a.toml")
    assert code == 0
    assert ": valid: " in out
    assert err.startswith("warning: red.png: blue, the height of the grass, is 0")
    code, out, err = greensward("check", "a.toml", "--json")
    told = json.loads(out)
    assert (code, err, told["ok"], len(told["warnings"])) == (0, "", True, 1)


@pytest.mark.parametrize("command", [(), ("render",), ("scenes",), ("new",), ("check",), ("info",), ("stamp",)])
def test_help_shows_examples(greensward, command):
    code, out, _ = greensward(*command, "--help")
    assert code == 0
    assert "greensward " + " ".join(command) in out
    assert "Example" in out


def test_usage(greensward):
    assert greensward("--version")[1].startswith("greensward ")
    code, out, err = greensward()
    assert code == 2
    assert "render" in out + err
    code, _, err = greensward("rendr")
    assert code == 2
    assert "rendr" in err


def test_help_comes_fast_without_arrays_or_graphics():
    script = (
        "import sys\nfrom greensward.cli import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit:\n    pass\n"
        "print([name for name in ('numpy', 'moderngl', 'PIL', 'greensward.scene') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
