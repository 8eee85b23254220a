"""Videos are decoded again and compared; whatever goes wrong is told in a sentence and leaves nothing behind."""

import os
import re
import subprocess
import sys

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from greensward.io import video
from greensward.io.video import CODECS, FrameFiles, VideoWriter, is_video
from greensward.scene.errors import GreenswardError, InputError

KINDS = [(f"a{ending}", codec) for ending, codecs in CODECS.items() for codec in codecs]
posix = pytest.mark.skipif(os.name != "posix", reason="the fake ffmpeg is a shell script")


def picture(step):
    """64 × 96 pixels: a ramp, saturated colours, grass green; darker with every step."""
    ramp = np.linspace(0, 255, 96)[None, :, None] * np.ones((16, 1, 3))
    blocks = [(255, 0, 0), (0, 255, 0), (0, 0, 255), (120, 145, 60)]
    colours = np.concatenate([np.full((16, 24, 3), colour, float) for colour in blocks], axis=1)
    plain = np.full((32, 96, 3), (60, 90, 30), float)
    return (np.concatenate([ramp, colours, plain]) * (1 - step / 20)).astype(np.uint8)


def decoded(path):
    """What a player shows: the size, frames a second, and the frames."""
    exactly = ["-sws_flags", "accurate_rnd+full_chroma_int+bicubic"]
    frames = imageio_ffmpeg.read_frames(path, pix_fmt="rgb24", output_params=exactly)
    about = next(frames)
    width, height = about["size"]
    return about, [np.frombuffer(frame, np.uint8).reshape(height, width, 3) for frame in frames]


def write(path, count=6, **options):
    with VideoWriter(path, (96, 64), **{"fps": 25, **options}) as clip:
        for step in range(count):
            clip.add(picture(step))


@pytest.mark.parametrize(("name", "codec"), KINDS)
def test_a_video_shows_the_frames_that_were_added(tmp_path, name, codec):
    write(tmp_path / name, codec=codec)
    about, frames = decoded(tmp_path / name)
    assert (about["size"], about["fps"], len(frames)) == ((96, 64), 25, 6)
    for step, frame in enumerate(frames):
        expected = picture(step).astype(float)
        inner = np.abs(frame - expected)[18:30].reshape(12, 4, 24, 3)[:, :, 4:20]  # away from edges of colour
        assert np.abs(frame.mean((0, 1)) - expected.mean((0, 1))).max() < 1.5
        assert np.abs(frame - expected)[36:].mean() < 1.5
        assert inner.mean() < 3
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["a.mp4", "a.webm"])
def test_players_are_told_which_colours_these_are(tmp_path, name):
    write(tmp_path / name)
    told = subprocess.run([video.find_ffmpeg(), "-i", tmp_path / name], capture_output=True, text=True).stderr
    assert re.search(r"yuv420p\(tv, bt709/bt709/iec61966-2-1", told)


def test_an_mp4_starts_before_it_is_loaded(tmp_path):
    write(tmp_path / "a.mp4")
    content = (tmp_path / "a.mp4").read_bytes()
    assert 0 < content.index(b"moov") < content.index(b"mdat")


def test_a_gif_repeats_for_ever_and_keeps_time(tmp_path):
    write(tmp_path / "a.gif", count=9, fps=30)
    with Image.open(tmp_path / "a.gif") as gif:
        durations = []
        for index in range(gif.n_frames):
            gif.seek(index)
            durations.append(gif.info["duration"])
        assert gif.info["loop"] == 0
    assert (len(durations), min(durations)) == (9, 30)
    assert abs(sum(durations) - 300) <= 10


def test_broken_frame_rates_and_odd_gifs(tmp_path):
    write(tmp_path / "a.mp4", fps=29.97)
    assert decoded(tmp_path / "a.mp4")[0]["fps"] == pytest.approx(29.97)
    with VideoWriter(tmp_path / "a.gif", (95, 63), 10) as clip:
        clip.add(picture(0)[:63, :95])
    assert decoded(tmp_path / "a.gif")[0]["size"] == (95, 63)


@pytest.mark.parametrize(
    ("name", "options", "told"),
    [
        ("a.avi", {}, "the file's name must end in one of .mp4, .webm, .gif (got .avi)"),
        ("a", {}, "the file's name must end in one of .mp4, .webm, .gif (it has none)"),
        ("no/a.mp4", {}, "there is no folder"),
        ("a.mp4", {"codec": "vp9"}, "the codec for .mp4 must be one of h264, h265, av1 (got vp9)"),
        ("a.webm", {"codec": "h264"}, "the codec for .webm must be one of vp9, av1 (got h264)"),
        ("a.gif", {"codec": "x"}, "the codec for .gif must be one of gif (got x)"),
        ("a.mp4", {"fps": 0}, "must have above 0 to 240 frames a second (got 0)"),
        ("a.mp4", {"fps": 241}, "(got 241)"),
        ("a.mp4", {"fps": float("nan")}, "(got nan)"),
        ("a.gif", {"fps": 60}, "must have above 0 to 50 frames a second (got 60)"),
        ("a.mp4", {"size": (161, 90)}, "must be even (got 161x90); the nearest is 160x90"),
        ("a.webm", {"size": (1, 91)}, "must be even (got 1x91); the nearest is 2x90"),
    ],
)
def test_what_makes_no_video_is_refused_at_once(tmp_path, name, options, told):
    with pytest.raises(InputError) as caught:
        VideoWriter(tmp_path / name, **{"size": (160, 90), "fps": 30, **options})
    assert str(caught.value).startswith(f"{tmp_path / name}: ")
    assert told in str(caught.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("wrong", [picture(0)[:-1], picture(0).astype(float), picture(0)[..., 0]])
def test_a_frame_of_another_shape_or_type_is_refused(tmp_path, wrong):
    with (
        pytest.raises(InputError, match=r"a frame must be uint8 of shape \(64, 96, 3\) \(got "),
        VideoWriter(tmp_path / "a.mp4", (96, 64), 30) as clip,
    ):
        clip.add(wrong)
    assert list(tmp_path.iterdir()) == []


def test_frames_need_not_be_contiguous(tmp_path):
    with VideoWriter(tmp_path / "a.mp4", (96, 64), 30) as clip:
        clip.add(picture(0)[::-1])
    assert np.abs(decoded(tmp_path / "a.mp4")[1][0].astype(int) - picture(0)[::-1]).mean() < 6


def test_a_video_without_frames_is_none(tmp_path):
    with pytest.raises(InputError, match="a video needs at least one frame"):
        write(tmp_path / "a.mp4", count=0)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("failure", [ZeroDivisionError, KeyboardInterrupt])
def test_an_exception_leaves_the_old_file_and_no_process(tmp_path, failure):
    (tmp_path / "a.mp4").write_text("old")
    clip = VideoWriter(tmp_path / "a.mp4", (96, 64), 30)

    def fail():
        with clip:
            clip.add(picture(0))
            raise failure

    with pytest.raises(failure):
        fail()
    assert clip._process.poll() is not None
    assert (tmp_path / "a.mp4").read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]


def test_a_frame_cut_off_by_an_interrupt_is_left_out(tmp_path):
    class Torn:
        def __init__(self, pipe):
            self.pipe = pipe
            self.close = pipe.close

        def write(self, data):
            self.pipe.write(data.cast("B")[:1000])
            raise KeyboardInterrupt

    with VideoWriter(tmp_path / "a.mp4", (96, 64), 30) as clip:
        clip.add(picture(0))
        clip.add(picture(1))
        clip._pipe = Torn(clip._pipe)
        with pytest.raises(KeyboardInterrupt):
            clip.add(picture(2))
        clip.finish()
        clip.finish()
    assert len(decoded(tmp_path / "a.mp4")[1]) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]


def test_two_videos_at_once_in_one_folder(tmp_path):
    with VideoWriter(tmp_path / "a.mp4", (96, 64), 30) as one, VideoWriter(tmp_path / "b.mp4", (96, 64), 30) as two:
        for step in range(3):
            one.add(picture(step))
            two.add(picture(10))
    assert [len(decoded(tmp_path / name)[1]) for name in ("a.mp4", "b.mp4")] == [3, 3]


def fake_ffmpeg(folder, monkeypatch, script):
    program = folder / "ffmpeg"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(program))


@posix
@pytest.mark.parametrize(
    ("script", "told"),
    [
        (
            'eval "out=\\${$#}"; head -c 99 > "${out#file:}"; '
            'echo "[mp4 @ 0x1] [out @ 0x2] No space left on device" >&2; echo Conversion failed! >&2; exit 228',
            "ffmpeg ended with code 228: No space left on device",
        ),
        ("cat > /dev/null; echo Bad trailer >&2; exit 1", "ffmpeg ended with code 1: Bad trailer"),
        ("exit 3", "ffmpeg ended with code 3: and said nothing"),
        ("head -c 99 > /dev/null; kill -9 $$", "ffmpeg was ended by signal 9: and said nothing"),
    ],
)
def test_ffmpegs_failure_is_one_sentence_and_leaves_nothing(tmp_path, monkeypatch, script, told):
    (tmp_path / "program").mkdir()
    (tmp_path / "out").mkdir()
    fake_ffmpeg(tmp_path / "program", monkeypatch, script)
    path = tmp_path / "out" / "a.mp4"
    with pytest.raises(GreenswardError) as caught:
        write(path, count=100)
    assert str(caught.value) == f"{path}: {told}"
    assert caught.value.exit_code == 1
    assert list(path.parent.iterdir()) == []


@posix
def test_ffmpegs_own_words_name_the_cause(tmp_path, monkeypatch):
    monkeypatch.setitem(video._ENCODERS, "h264", ("-c:v", "libnope"))
    with pytest.raises(GreenswardError, match=r"ended with code \d+: Unknown encoder 'libnope'$"):
        write(tmp_path / "a.mp4", count=50)
    assert list(tmp_path.iterdir()) == []


def test_without_ffmpeg_a_sentence_tells_how_to_get_it(tmp_path, monkeypatch):
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(tmp_path / "none"))
    with pytest.raises(GreenswardError, match=r"a\.mp4: ffmpeg cannot be run: .*none: No such file"):
        write(tmp_path / "a.mp4")
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(GreenswardError, match=r'pip install "greensward\[video\]"'):
        write(tmp_path / "a.mp4")
    assert list(tmp_path.iterdir()) == []


@posix
def test_a_terminals_interrupt_does_not_reach_ffmpeg(tmp_path):
    with VideoWriter(tmp_path / "a.mp4", (96, 64), 30) as clip:
        clip.add(picture(0))
        assert os.getpgid(clip._process.pid) != os.getpgid(0)


# Numbered files ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("output", "third"),
    [
        ("f/%04d.png", "f/0003.png"),
        ("f/####.png", "f/0003.png"),
        ("f/a%03d_b.PNG", "f/a003_b.PNG"),
        ("%d.png", "3.png"),
        ("take#1/%02d.png", "take#1/03.png"),
        ("new/", "new/frame_0003.png"),
        ("clip.mp4/", "clip.mp4/frame_0003.png"),
        ("there", "there/frame_0003.png"),
    ],
)
def test_outputs_that_are_sequences(tmp_path, monkeypatch, output, third):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there").mkdir()
    assert not is_video(output)
    files = FrameFiles(output)
    files.check({})
    assert files.start({"fps": 30}) == set()
    files.write(3, picture(3))
    assert (tmp_path / third).is_file()
    assert files.present() == {3}
    assert files.holds(tmp_path / third)
    assert not files.holds(tmp_path / "other" / third)
    np.testing.assert_array_equal(Image.open(tmp_path / third), picture(3))


@pytest.mark.parametrize(
    ("output", "told"),
    [
        ("a.png", "is the name of one picture; number the frames, as in frames/%04d.png, or draw one picture with"),
        ("%d_%d.png", "must have one number, in the file's name"),
        ("##_##.png", "must have one number, in the file's name"),
        ("%04d/a.png", "must have one number, in the file's name"),
        ("a.avi", "must end in .mp4, .webm, .gif for a video, be a pattern such as frames/%04d.png, or a folder"),
        ("%04d.jpg", "(got .jpg)"),
        ("new", "a folder and end in / (got no ending)"),
    ],
)
def test_outputs_that_are_neither(output, told):
    assert not is_video(output)
    with pytest.raises(InputError) as caught:
        FrameFiles(output)
    assert str(caught.value).startswith(f"{output}: ")
    assert told in str(caught.value)


def test_only_whole_frames_of_the_pattern_count(tmp_path):
    files = FrameFiles(f"{tmp_path}/a%03d.png")
    for name in ("a001.png", "a1234.png", "a01.png", "a0002.png", "a003.jpg", "b004.png", "a-05.png", "a٣٣٣.png"):
        (tmp_path / name).write_text("x")
    (tmp_path / "a007.png").touch()
    assert files.present() == {1, 1234}


def refusal(files, made_with):
    with pytest.raises(InputError) as caught:
        files.check(made_with)
    return str(caught.value)


def test_frames_made_otherwise_are_refused(tmp_path):
    files = FrameFiles(f"{tmp_path}/%03d.png")
    made_with = {"size": "96x64", "fps": 30.0, "scene": "abc"}
    files.start(made_with)
    files.check({"size": "1x1"})  # no frame is there yet
    files.start(made_with)
    files.write(0, picture(0))
    assert files.start(made_with) == {0}
    files.check({"fps": 30.0})
    fix = "; choose another folder, or start over with --overwrite"
    assert refusal(files, {**made_with, "fps": 25.0}) == f"{tmp_path}: holds frames made with fps 30.0, not 25.0{fix}"
    assert refusal(files, {**made_with, "scene": "x"}) == f"{tmp_path}: holds frames made with another scene{fix}"
    record = tmp_path / ".greensward-%03d.json"
    for damaged in ("{", "[]", "{}", "\xff"):
        record.write_text(damaged, encoding="latin-1")
        assert refusal(files, made_with) == f"{record}: is damaged, so the frames are of unknown origin{fix}"
    record.unlink()
    assert refusal(files, made_with) == f"{tmp_path}: holds frames of unknown origin{fix}"
    (tmp_path / "other_000.png").touch()
    files.check(made_with, overwrite=True)
    assert files.start(made_with, overwrite=True) == set()
    assert sorted(path.name for path in tmp_path.iterdir()) == [record.name, "other_000.png"]


def test_a_place_that_cannot_be_written_is_told_before_the_work(tmp_path):
    (tmp_path / "file").write_text("x")
    told = refusal(FrameFiles(f"{tmp_path}/file/deep/%d.png"), {})
    assert told == f"{tmp_path}/file: is no folder, and frames need one"
    (tmp_path / "0.png").mkdir()
    assert "is a folder" in refusal(FrameFiles(f"{tmp_path}/%d.png"), {})
    assert "cannot be written" in refusal(FrameFiles(f"{tmp_path}/{'x' * 300}%d.png"), {})
    with pytest.raises(GreenswardError, match="cannot be"):
        FrameFiles(f"{tmp_path}/a\0b/a%d.png").start({})


def test_a_full_disk_leaves_whole_frames_only(tmp_path, monkeypatch):
    files = FrameFiles(f"{tmp_path}/%d.png")
    files.start({})
    files.write(0, picture(0))

    def full(_self, stream, *_args, **_options):
        stream.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Image.Image, "save", full)
    with pytest.raises(GreenswardError) as caught:
        files.write(1, picture(1))
    assert str(caught.value) == f"{tmp_path}/1.png: cannot be written: No space left on device"
    assert sorted(path.name for path in tmp_path.iterdir()) == [".greensward-%01d.json", "0.png"]
