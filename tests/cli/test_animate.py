"""Clips: which instants are drawn, how a run goes on from another, and what an interrupt or a mistake leaves."""

import json
import os
import signal
import subprocess
import sys
import threading
import types

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from greensward.cli import main
from greensward.scene import InputError

TINY = """
title = "tiny"
ground = {kind = "flat", size_m = [200.0, 200.0]}
sowing = {density_per_m2 = 40.0, full_density_m = 5.0, reach_m = 12.0}
shadows = {size_px = 64, cascades = 1}
[[grass]]
species = "fescue"
[[wind]]
kind = "gusts"
speed_mps = 8.0
"""


class FakeRenderer:
    """Its grass remembers: every instant that it is moved to changes the grey of all pictures after it.

    With `temporal` so does every picture, until the grass moves on without one.
    """

    drawn: list = []  # noqa: RUF012
    moved: list = []  # noqa: RUF012
    cameras: list = []  # noqa: RUF012
    fails_at: tuple[int, BaseException] | None = None
    driver = "llvmpipe"
    last: "FakeRenderer"

    def __init__(self, scene, *, size, samples, temporal, device):
        self.scene, self.size, self.samples, self.device = scene, size, samples, device
        self.temporal, self.blended, self._history = temporal, 0, 0
        FakeRenderer.last = self
        self.technique_name, self.seconds, self._state, self._time_s = scene.technique.name, {"draw": 9.0}, 0, 0.0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def advance(self, time_s, *, camera):
        FakeRenderer.cameras.append(camera)
        self._move(time_s)
        self.blended = self._history = 0

    def _move(self, time_s):
        FakeRenderer.moved.append(time_s)
        self._time_s, self._state = time_s, (self._state * 3 + round(time_s * 1000)) % 241

    def camera_matrices(self, camera):
        if camera.position_m[1] <= 0.0:
            raise InputError("camera.position_m: must be above the ground")

    def render(self, *, time_s, camera, progress):
        FakeRenderer.cameras.append(camera)
        if self.fails_at and len(self.drawn) == self.fails_at[0]:
            raise self.fails_at[1]
        self._move(time_s)
        if self.temporal:
            self.blended, self._history = self.blended + 1, (self._history * 5 + self._state) % 239
        FakeRenderer.drawn.append(time_s)
        for sample in range(self.samples):
            progress(sample + 1, self.samples)
        width, height = self.size
        grey = self._history if self.temporal else self._state
        return types.SimpleNamespace(image=np.full((height, width, 3), grey, np.uint8))

    def checkpoint(self):
        state = {"time_s": np.array(self._time_s), "grass": np.array([self._state])}
        return {**state, "history": np.array([self.blended, self._history])} if self.temporal else state

    def resume(self, state):
        assert {"time_s", "grass"} <= set(state) <= {"time_s", "grass", "history"}
        if state["grass"].shape != (1,):
            raise InputError("is of another field of grass")
        self._time_s, self._state = float(state["time_s"]), int(state["grass"][0])
        if self.temporal and "history" in state:
            self.blended, self._history = (int(value) for value in state["history"])


@pytest.fixture
def greensward(monkeypatch, capsys, tmp_path):
    """Runs the command line in a folder of its own: exit code, standard output, standard error.

    It draws 4 samples a frame, unless `over_time`.
    """
    fake = types.ModuleType("greensward.renderer")
    fake.Renderer = FakeRenderer
    monkeypatch.setitem(sys.modules, "greensward.renderer", fake)
    for name, value in {"drawn": [], "moved": [], "cameras": [], "fails_at": None, "driver": "llvmpipe"}.items():
        monkeypatch.setattr(FakeRenderer, name, value)
    monkeypatch.chdir(tmp_path)

    def run(*args, over_time=False):
        FakeRenderer.drawn.clear()
        FakeRenderer.moved.clear()
        FakeRenderer.cameras.clear()
        with pytest.raises(SystemExit) as left:
            main(["animate", "meadow", "--size", "32x18", *([] if over_time else ["--samples", "4"]), *args])
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return left.value.code, out, err

    return run


def frames_of(path):
    frames = imageio_ffmpeg.read_frames(path, pix_fmt="rgb24")
    width, height = next(frames)["size"]
    return [np.frombuffer(frame, np.uint8).reshape(height, width, 3) for frame in frames]


def greys(folder):
    return {path.name: int(np.asarray(Image.open(path))[0, 0, 0]) for path in sorted(folder.glob("*.png"))}


@pytest.mark.parametrize("name", ["clip.mp4", "clip.webm", "clip.gif"])
def test_a_clip_is_drawn_at_exact_instants(greensward, tmp_path, name):
    code, out, err = greensward("-o", name, "--seconds", "1.5", "--fps", "12", "--time", "2.5")
    assert (code, err) == (0, "")
    assert FakeRenderer.drawn == [2.5 + index / 12 for index in range(18)]
    assert out.startswith(f"{name}: 18 frames, 1.5 s at 12 a second, 32×18, visibility-buffer on llvmpipe in ")
    assert "draw 9.0" in out
    assert len(frames_of(tmp_path / name)) == 18
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_the_pictures_of_a_video_and_of_a_sequence_are_the_same(greensward, tmp_path):
    greensward("-o", "clip.mp4", "--seconds", "0.2")
    greensward("-o", "frames/", "--seconds", "0.2")
    still = greys(tmp_path / "frames")
    assert list(still) == [f"frame_{index:04}.png" for index in range(6)]
    for frame, grey in zip(frames_of(tmp_path / "clip.mp4"), still.values(), strict=True):
        assert abs(frame.mean() - grey) < 2


def test_json_tells_what_was_done(greensward):
    code, out, err = greensward("-o", "f/%d.png", "--seconds", "0.1", "--checkpoint", "a.npz", "--json")
    assert (code, err) == (0, "")
    answer = json.loads(out)
    assert list(answer.pop("seconds")) == ["load", "draw", "write", "total"]
    assert answer == {
        "output": "f/%d.png",
        "frames": 3,
        "drawn": 3,
        "fps": 30,
        "start_s": 0,
        "length_s": 0.1,
        "checkpoint": "a.npz",
        "width": 32,
        "height": 18,
        "technique": "visibility-buffer",
        "driver": "llvmpipe",
    }


def test_defaults(greensward):
    code, out, _ = greensward("-o", "f/", "--json")
    answer = json.loads(out)
    assert (code, answer["frames"], answer["fps"], answer["length_s"]) == (0, 120, 30, 4)


def test_help_shows_examples(greensward):
    code, out, _ = greensward("--help")
    assert code == 0
    assert "greensward animate meadow -o frames/%04d.png" in out


def test_every_option_reaches_the_scene_and_the_codec(greensward, tmp_path):
    code, _, _ = greensward(
        "-o", "a.mp4", "--codec", "h265", "--seconds", "0.1", "--samples", "2", "--seed", "9", "--set",
        "wind.0.speed_mps=12", "--camera", "1,2,3:0,0,0:35", "--technique", "bezier-blades", "--device", "cpu",
    )  # fmt: skip
    assert code == 0
    assert next(imageio_ffmpeg.read_frames(tmp_path / "a.mp4"))["codec"] == "hevc"
    asked = FakeRenderer.last
    assert (asked.samples, asked.device, asked.size) == (2, "cpu", (32, 18))
    assert (asked.scene.seed, asked.scene.wind[0].speed_mps, asked.scene.camera.fov_y_deg) == (9, 12, 35)


@pytest.mark.parametrize(
    ("args", "told"),
    [
        (["--seconds", "0"], "'--seconds': must be a number of seconds above 0, at most 1,000,000,000 (got 0)"),
        (["--seconds", "-1"], "(got -1)"),
        (["--seconds", "nan"], "(got nan)"),
        (
            ["--seconds", "1e6"],
            "1,000,000 s at 30 a second are 30,000,000 frames; a clip has at most 1,000,000",
        ),
        (["--fps", "0"], "'--fps': must be a number of frames a second above 0, at most 240 (got 0)"),
        (["--fps", "nan"], "(got nan)"),
        (["--fps", "241"], "(got 241)"),
        (["--time", "inf"], "must be a finite number of seconds (got inf)"),
        (["--time", "1e12"], "--time: all frames must lie within a billion seconds (got one at 1e+12)"),
        (["--codec", "vp9"], "a.mp4: the codec for .mp4 must be one of h264, h265, av1 (got vp9)"),
        (["-o", "f/", "--codec", "h264"], "--codec: goes with a video, and f/ is a PNG sequence"),
        (["--size", "33x18"], "a.mp4: the width and height of video must be even (got 33x18); the nearest is 32x18"),
        (["-o", "a.avi"], "a.avi: must end in .mp4, .webm, .gif for a video"),
        (["-o", "a.png"], "a.png: is the name of one picture; number the frames, as in frames/%04d.png"),
        (["-o", "%d%d.png"], "%d%d.png: must have one number"),
        (["-o", "no/a.mp4"], "no/a.mp4: there is no folder no; make it first"),
        (["--checkpoint", "a.zip"], "a.zip: the file's name must end in one of .npz"),
        (["--from", "no.npz"], "no.npz: no such file"),
        (["--set", "wind.0.sped=1"], "did you mean speed_mps?"),
    ],
)
def test_a_wrong_option_is_told_before_anything_is_drawn(greensward, tmp_path, args, told):
    code, out, err = greensward(*([] if "-o" in args else ["-o", "a.mp4"]), *args)
    assert (code, out) == (2, "")
    assert told in err
    assert FakeRenderer.drawn == []
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("output", ["%04d.png", "."])
@pytest.mark.usefixtures("greensward")
def test_what_the_scene_reads_is_not_overwritten(tmp_path, output):
    name = {"%04d.png": "0007.png", ".": "frame_0007.png"}[output]
    Image.new("L", (4, 4)).save(tmp_path / name)
    (tmp_path / "scene.toml").write_text(f"sowing.density_map = '{name}'")
    with pytest.raises(SystemExit) as left:
        main(["animate", ".", "-o", output, "--size", "8x8", "--overwrite"])
    assert left.value.code == 2
    assert (tmp_path / name).is_file()


# Sequences that go on ---------------------------------------------------------------------------------------


def test_a_sequence_goes_on_from_the_frames_that_are_there(greensward, tmp_path):
    args = ("-o", "f/%03d.png", "--seconds", "0.4", "--fps", "20")
    greensward(*args)
    whole = greys(tmp_path / "f")
    assert len(set(whole.values())) > 5
    for index in (2, 5, 6, 7):
        (tmp_path / f"f/{index:03}.png").unlink()
    code, out, _ = greensward(*args)
    assert (code, greys(tmp_path / "f")) == (0, whole)
    assert FakeRenderer.drawn == [index / 20 for index in (2, 5, 6, 7)]
    assert FakeRenderer.moved == [index / 20 for index in range(8)]
    assert out.endswith("; 4 of them were there\n")
    greensward(*args)
    assert FakeRenderer.moved == []
    greensward(*args, "--checkpoint", "a.npz")
    assert FakeRenderer.moved == [index / 20 for index in range(8)]
    greensward("-o", "f/###.png", "--seconds", "0.5", "--fps", "20")
    assert FakeRenderer.drawn == [8 / 20, 9 / 20]


@pytest.mark.parametrize(
    ("args", "told"),
    [
        (["--size", "16x8"], "f: holds frames made with size 32x18, not 16x8; choose another folder, or"),
        (["--samples", "2"], "made with samples 4, not 2"),
        (["--fps", "25"], "made with fps 30.0, not 25.0"),
        (["--time", "1"], "made with start_s 0.0, not 1.0"),
        (["--set", "wind.0.speed_mps=9"], "made with another scene"),
        (["--seed", "77"], "made with another scene"),
    ],
)
def test_frames_made_otherwise_are_refused_unless_overwritten(greensward, tmp_path, args, told):
    greensward("-o", "f/", "--seconds", "0.2")
    before = greys(tmp_path / "f")
    code, out, err = greensward("-o", "f/", "--seconds", "0.1", *args)
    assert (code, out, FakeRenderer.moved) == (2, "", [])
    assert told in err
    assert greys(tmp_path / "f") == before
    assert greensward("-o", "f/", "--seconds", "0.1", *args, "--overwrite")[0] == 0
    assert len(greys(tmp_path / "f")) == len(FakeRenderer.drawn) < len(before)


def test_frames_of_another_driver_version_or_map_are_refused(greensward, tmp_path, monkeypatch):
    greensward("-o", "f/", "--seconds", "0.1")
    monkeypatch.setattr(FakeRenderer, "driver", "H200")
    code, _, err = greensward("-o", "f/", "--seconds", "0.1")
    assert (code, FakeRenderer.moved) == (2, [])
    assert "made with driver llvmpipe, not H200" in err
    monkeypatch.setattr("greensward.__version__", "9.9")
    assert "not 9.9" in greensward("-o", "f/", "--seconds", "0.1")[2]
    (tmp_path / "f/.greensward-frame_%04d.json").unlink()
    assert "holds frames of unknown origin" in greensward("-o", "f/", "--seconds", "0.1")[2]


@pytest.mark.usefixtures("greensward")
def test_the_content_of_the_scenes_files_tells_scenes_apart(tmp_path, capsys):
    def draw(level):
        Image.new("L", (4, 4), level).save(tmp_path / "map.png")
        with pytest.raises(SystemExit) as left:
            main(["animate", "scene.toml", "-o", "f/", "--size", "8x8", "--seconds", "0.1"])
        return left.value.code, capsys.readouterr().err

    (tmp_path / "scene.toml").write_text("sowing.density_map = 'map.png'")
    assert draw(100) == draw(100) == (0, "")
    assert draw(200)[0] == 2


@pytest.mark.parametrize("output", ["f/%d.png", "clip.mp4"])
def test_a_full_disk(greensward, tmp_path, monkeypatch, output):
    saves = []

    def save(_self, stream, *_args, **_options):
        saves.append(stream)
        stream.write(b"half")
        raise OSError(28, "No space left on device")

    if output == "clip.mp4":
        program = tmp_path / "ffmpeg"
        program.write_text("#!/bin/sh\nhead -c 5000 > /dev/null\necho No space left on device >&2\nexit 228\n")
        program.chmod(0o755)
        monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(program))
    else:
        greensward("-o", output, "--seconds", "0.1")
        monkeypatch.setattr(Image.Image, "save", save)
    code, out, err = greensward("-o", output, "--seconds", "9")
    assert (code, out) == (1, "")
    assert "No space left on device" in err
    assert err.count("\n") == 1
    left = sorted(path.name for path in tmp_path.glob("**/*") if path.is_file() and path.name != "ffmpeg")
    assert left == ([] if output == "clip.mp4" else [".greensward-%01d.json", "0.png", "1.png", "2.png"])


def test_without_the_extra_there_are_sequences_still(greensward, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    code, _, err = greensward("-o", "a.mp4")
    assert (code, FakeRenderer.drawn) == (1, [])
    assert 'pip install "greensward[video]"' in err
    assert greensward("-o", "f/", "--seconds", "0.1")[0] == 0


# Edges over time ----------------------------------------------------------------------------------------------


def test_edges_are_smoothed_over_time_unless_samples_are_asked_for(greensward):
    assert greensward("-o", "f/", "--seconds", "0.1", over_time=True)[0] == 0
    assert (FakeRenderer.last.temporal, FakeRenderer.last.samples) == (True, 1)
    # the first picture is as clean as the others
    assert FakeRenderer.drawn == [0.0] * 8 + [0 / 30, 1 / 30, 2 / 30]
    code, _, err = greensward("-o", "f/", "--seconds", "0.1")
    assert (code, FakeRenderer.moved) == (2, [])
    assert "made with samples over time, not 4" in err
    assert greensward("-o", "g/", "--seconds", "0.1", "--samples", "1", over_time=True)[0] == 0
    assert (FakeRenderer.last.temporal, FakeRenderer.last.samples) == (False, 1)
    assert len(FakeRenderer.drawn) == 3


def test_an_interrupted_sequence_over_time_is_that_of_one_run(greensward, tmp_path):
    args = ("-o", "f/###.png", "--seconds", "0.4", "--fps", "20")
    greensward(*args, over_time=True)
    whole = greys(tmp_path / "f")
    assert len(set(whole.values())) > 5
    untouched = (tmp_path / "f/004.png").stat().st_mtime_ns
    for index in (2, 5, 6):
        (tmp_path / f"f/{index:03}.png").unlink()
    code, out, _ = greensward(*args, over_time=True)
    assert (code, greys(tmp_path / "f")) == (0, whole)
    assert FakeRenderer.drawn == [0.0] * 8 + [index / 20 for index in range(7)]
    assert (tmp_path / "f/004.png").stat().st_mtime_ns == untouched
    assert out.endswith("; 5 of them were there\n")
    greensward(*args, over_time=True)
    assert FakeRenderer.moved == []


def test_two_runs_over_time_with_a_checkpoint_are_one(greensward, tmp_path):
    greensward("-o", "whole/", "--seconds", "0.4", over_time=True)
    greensward("-o", "parts/", "--seconds", "0.2", "--checkpoint", "a.npz", over_time=True)
    assert greensward("-o", "parts/", "--from", "a.npz", "--seconds", "0.2", over_time=True)[0] == 0
    assert FakeRenderer.drawn == [index / 30 for index in range(6, 12)]
    assert greys(tmp_path / "parts") == greys(tmp_path / "whole")
    greensward("-o", "s/", "--seconds", "0.2", "--checkpoint", "b.npz")
    assert greensward("-o", "t/", "--from", "b.npz", "--seconds", "0.1", over_time=True)[0] == 0
    assert FakeRenderer.drawn[:8] == [6 / 30] * 8  # no history to go on from


# Checkpoints ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("fps", ["24", "29.97"])
def test_two_runs_with_a_checkpoint_are_one(greensward, tmp_path, fps):
    start = ("--fps", fps, "--time", "0.3")
    greensward("-o", "whole/", "--seconds", "1", *start)
    instants, whole = list(FakeRenderer.drawn), greys(tmp_path / "whole")
    greensward("-o", "parts/", "--seconds", "0.5", *start, "--checkpoint", "a.npz")
    first = list(FakeRenderer.drawn)
    assert greensward("-o", "parts/", "--from", "a.npz", "--seconds", "0.5", "--checkpoint", "a.npz")[0] == 0
    assert first + FakeRenderer.drawn == instants
    assert greys(tmp_path / "parts") == whole
    with np.load(tmp_path / "a.npz") as state:
        assert int(state["clip_following"]) == len(instants)
    code, out, _ = greensward("-o", "more.mp4", "--from", "a.npz", "--seconds", "0.5", "--fps", fps, "--json")
    assert (code, json.loads(out)["start_s"]) == (0, 0.3 + len(instants) / float(fps))


def test_a_checkpoint_that_does_not_fit_is_refused(greensward, tmp_path):
    greensward("-o", "f/", "--seconds", "0.1", "--checkpoint", "a.npz")
    before = ("-o", "g/", "--from", "a.npz")
    for args, told in (
        (["--fps", "25"], "--fps: must be that of a.npz, which is 30 (got 25)\n"),
        (["--time", "0"], "--time: cannot be given with --from, which continues where the checkpoint ends\n"),
        (["--seed", "5"], "a.npz: was saved from another scene; continue with the same one, and the same options\n"),
    ):
        assert greensward(*before, *args) == (2, "", told)
    with np.load(tmp_path / "a.npz") as known:
        state = dict(known)
    np.savez(tmp_path / "a.npz", **{**state, "grass": np.zeros(3)})
    assert greensward(*before) == (2, "", "a.npz: is of another field of grass\n")
    content = (tmp_path / "a.npz").read_bytes()
    no_checkpoint = "a.npz: is damaged or no checkpoint; `greensward animate --checkpoint` writes one\n"
    for wrong in (b"text", content[: len(content) // 2], b"\x93NUMPY"):
        (tmp_path / "a.npz").write_bytes(wrong)
        assert greensward(*before) == (2, "", no_checkpoint)
    for key, value in {"clip_fps": 0, "clip_following": 1.5, "clip_start_s": np.nan, "clip_scene": ""}.items():
        np.savez(tmp_path / "a.npz", **{**state, key: value})
        assert greensward(*before) == (2, "", no_checkpoint)
    np.savez(tmp_path / "a.npz", depth=np.zeros(3))
    assert greensward(*before) == (2, "", no_checkpoint)
    (tmp_path / "a.npz").unlink()
    (tmp_path / "a.npz").mkdir()
    assert greensward(*before) == (2, "", "a.npz: is a folder, not a file\n")
    assert not (tmp_path / "g").exists()


# Interrupts -------------------------------------------------------------------------------------------------


def test_an_interrupted_video_holds_the_frames_so_far(greensward, tmp_path, monkeypatch):
    monkeypatch.setattr(FakeRenderer, "fails_at", (7, KeyboardInterrupt()))
    told = "clip.mp4: interrupted; it holds the first 7 of 120 frames\n"
    assert greensward("-o", "clip.mp4", "--checkpoint", "a.npz") == (130, "", told)
    assert len(frames_of(tmp_path / "clip.mp4")) == 7
    assert [path.name for path in tmp_path.iterdir()] == ["clip.mp4"]


@pytest.mark.parametrize("output", ["clip.mp4", "f/%d.png"])
def test_an_interrupt_before_the_first_frame(greensward, tmp_path, monkeypatch, output):
    monkeypatch.setattr(FakeRenderer, "fails_at", (0, KeyboardInterrupt()))
    code, out, err = greensward("-o", output)
    assert (code, out) == (130, "")
    assert err.startswith(f"{output}: interrupted; ")
    assert [path.name for path in tmp_path.glob("**/*") if path.is_file()] == (
        [] if output == "clip.mp4" else [".greensward-%01d.json"]
    )


def test_an_interrupted_sequence_tells_how_to_go_on(greensward, tmp_path, monkeypatch):
    monkeypatch.setattr(FakeRenderer, "fails_at", (7, KeyboardInterrupt()))
    told = "f/: interrupted; 7 of 120 frames are there, and the same command goes on from them\n"
    assert greensward("-o", "f/") == (130, "", told)
    monkeypatch.setattr(FakeRenderer, "fails_at", None)
    assert greensward("-o", "f/")[0] == 0
    assert len(FakeRenderer.drawn) == 113
    assert len(greys(tmp_path / "f")) == 120


CHILD = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from greensward.io import video
def told(add):
    def tell(*args):
        add(*args)
        print("frame", flush=True)
    return tell
video.VideoWriter.add = told(video.VideoWriter.add)
video.FrameFiles.write = told(video.FrameFiles.write)
from greensward.cli import main
main(sys.argv[1:])
"""


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="sends signals")
@pytest.mark.parametrize("output", ["clip.mp4", "clip.webm", "clip.gif", "f/"])
def test_ctrl_c_in_a_terminal(tmp_path, output):
    (tmp_path / "tiny.toml").write_text(TINY)
    options = ("--size", "64x36", "--samples", "1", "--device", "cpu", "--seconds", "1000")
    with (tmp_path.parent / f"{tmp_path.name}.err").open("w+") as said:
        child = subprocess.Popen(
            [sys.executable, "-c", CHILD, "animate", "tiny.toml", "-o", output, *options],
            cwd=tmp_path, stdout=subprocess.PIPE, stderr=said, text=True, start_new_session=True,
        )  # fmt: skip
        late = threading.Timer(120, child.kill)
        late.start()
        for _ in range(5):
            assert child.stdout.readline() == "frame\n"
        os.killpg(child.pid, signal.SIGINT)  # as a terminal does: to the whole group
        drawn = 5 + child.stdout.read().count("frame")
        assert child.wait() == 130
        late.cancel()
        said.seek(0)
        (told,) = said.readlines()
    assert told.startswith(f"{output}: interrupted; ")
    (tmp_path / "tiny.toml").unlink()
    if output == "f/":
        pictures = sorted((tmp_path / "f").glob("*.png"))
        assert len({Image.open(path).tobytes() for path in pictures}) == len(pictures) in (drawn, drawn + 1)
        assert len(list((tmp_path / "f").iterdir())) == len(pictures) + 1
    else:
        assert [path.name for path in tmp_path.iterdir()] == [output]
        assert len(frames_of(tmp_path / output)) in (drawn, drawn + 1)


def test_a_terminal_shows_progress_and_a_pipe_does_not(greensward, monkeypatch):
    assert greensward("-o", "f/", "--seconds", "0.1")[2] == ""
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    code, _, err = greensward("-o", "g/", "--seconds", "0.1")
    assert code == 0
    assert "Drawing" in err


@pytest.mark.slow
@pytest.mark.parametrize("edges", [(), ("--samples", "1")], ids=["over time", "samples"])
def test_grass_with_a_memory_goes_on_bit_for_bit(tmp_path, monkeypatch, capsys, edges):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tiny.toml").write_text("simulation = {settle_s = 0.2}\n" + TINY)

    def draw(output, *args):
        options = ("--size", "64x36", *edges, "--device", "cpu", "--seconds", "0.5")
        with pytest.raises(SystemExit) as left:
            main(["animate", "tiny.toml", "-o", output, *options, *args])
        assert (left.value.code, capsys.readouterr().err) == (0, "")
        return {path.name: path.read_bytes() for path in (tmp_path / output).glob("*.png")}

    whole = draw("whole/", "--fps", "10", "--seconds", "1")
    draw("parts/", "--fps", "10", "--checkpoint", "a.npz")
    assert draw("parts/", "--from", "a.npz") == whole
    for index in (0, 3, 4, 9):
        (tmp_path / f"parts/frame_{index:04}.png").unlink()
    assert draw("parts/", "--fps", "10", "--seconds", "1") == whole
    afresh = draw("afresh/", "--fps", "10", "--time", "0.5")
    assert afresh["frame_0000.png"] != whole["frame_0005.png"]  # or the memory does not matter, and this test is none


# A camera path ----------------------------------------------------------------------------------------------

WALK = """
key = [
  { time_s = 0.0, position_m = [0, 1, 0], target_m = [0, 1, -9] },
  { time_s = 0.5, position_m = [0, 2, -1], target_m = [0, 1, -9] },
]
"""


def test_the_camera_follows_a_path_to_its_end(greensward, tmp_path):
    (tmp_path / "walk.toml").write_text(WALK, encoding="utf-8")
    code, out, err = greensward("-o", "walk/", "--camera-path", "walk.toml", "--fps", "10")
    assert (code, err) == (0, "")
    assert "5 frames, 0.5 s" in out
    heights = [camera.position_m[1] for camera in FakeRenderer.cameras]
    assert heights == pytest.approx([1.0, 1.2, 1.4, 1.6, 1.8])
    assert FakeRenderer.cameras[0].fov_y_deg == FakeRenderer.last.scene.camera.fov_y_deg

    # the scene's clock is the path's: what is drawn later is seen from farther on
    assert greensward("-o", "later.gif", "--camera-path", "walk.toml", "--fps", "10", "--time", "0.3")[0] == 0
    assert [camera.position_m[1] for camera in FakeRenderer.cameras] == pytest.approx([1.6, 1.8])
    assert greensward("-o", "after.gif", "--camera-path", "walk.toml", "--fps", "1", "--time", "3")[0] == 0
    assert len(FakeRenderer.drawn) == 4, "beyond its end it lasts as long as without one"
    assert greensward("-o", "smooth.gif", "--camera-path", "walk.toml", "--fps", "10", over_time=True)[0] == 0
    assert [camera.position_m[1] for camera in FakeRenderer.cameras[:10]] == [1.0] * 9 + [pytest.approx(1.2)]


def test_frames_along_one_path_are_not_mixed_with_others(greensward, tmp_path):
    (tmp_path / "walk.toml").write_text(WALK, encoding="utf-8")
    asked = ("-o", "walk/", "--fps", "10", "--seconds", "0.2")
    assert greensward(*asked, "--camera-path", "walk.toml")[0] == 0
    assert greensward(*asked, "--camera-path", "walk.toml")[0] == 0
    assert FakeRenderer.drawn == []
    (tmp_path / "walk.toml").write_text(WALK.replace("[0, 2, -1]", "[0, 3, -1]"), encoding="utf-8")
    for other in (("--camera-path", "walk.toml"), ()):
        code, _, err = greensward(*asked, *other)
        assert (code, "--overwrite" in err) == (2, True), err


@pytest.mark.parametrize(
    ("text", "args", "told"),
    [
        (WALK, ("--camera", "0,1,0:0,0,1"), "--camera-path: must stand without --camera"),
        (None, (), "walk.toml: no such file"),
        (
            WALK.replace("0, 2, -1", "0, -2, -1"),
            (),
            "walk.toml: at 0.2 s: camera.position_m: must be above the ground",
        ),
        (WALK.replace("key", "kye"), (), "walk.toml: kye: unknown key; did you mean key?"),
    ],
)
def test_a_wrong_path_is_refused_before_anything_is_drawn(greensward, tmp_path, text, args, told):
    if text:
        (tmp_path / "walk.toml").write_text(text, encoding="utf-8")
    code, out, err = greensward("-o", "a.gif", "--camera-path", "walk.toml", "--fps", "10", *args)
    assert (code, out) == (2, "")
    assert told in err
    assert not FakeRenderer.drawn
    assert not (tmp_path / "a.gif").exists()
