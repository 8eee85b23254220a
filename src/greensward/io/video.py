"""Output of clips: a video through ffmpeg, or numbered PNG files that a later run can continue."""

import contextlib
import json
import os
import re
import secrets
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from greensward.interrupts import held_back
from greensward.io.rasters import write_picture
from greensward.scene.errors import GreenswardError, InputError
from greensward.scene.files import check_writable, read_file, written_aside
from greensward.scene.problems import short

CODECS: Mapping[str, tuple[str, ...]] = {
    ".mp4": ("h264", "h265", "av1"),
    ".webm": ("vp9", "av1"),
    ".gif": ("gif",),
}
"""The codecs that go with each ending of a video's name; the first is used where none is named."""
FASTEST_FPS = 240.0
FASTEST_GIF_FPS = 50.0  # a shorter delay than 0.02 s is shown as 0.1 s by browsers

# The pixels are sRGB: that stays so, and is declared; only the matrix and the range are those of video.
_YUV = (
    "-vf",
    "scale=in_range=full:out_range=limited:out_color_matrix=bt709:flags=lanczos+accurate_rnd+full_chroma_int,"
    "format=yuv420p,"
    "setparams=range=limited:colorspace=bt709:color_primaries=bt709:color_trc=iec61966-2-1",
)
_ENCODERS = {
    "h264": (*_YUV, "-c:v", "libx264", "-crf", "17"),
    "h265": (*_YUV, "-c:v", "libx265", "-crf", "19", "-tag:v", "hvc1", "-x265-params", "log-level=error"),
    "vp9": (*_YUV, "-c:v", "libvpx-vp9", "-crf", "20", "-b:v", "0", "-cpu-used", "4", "-row-mt", "1"),
    "av1": (*_YUV, "-c:v", "libsvtav1", "-crf", "20", "-preset", "8"),
    # A palette for each frame: one for all of them would wait in memory for the last.
    "gif": (
        "-filter_complex",
        "split[a][b];[a]palettegen=stats_mode=single[p];[b][p]paletteuse=new=1:dither=sierra2_4a",
        *("-loop", "0"),
    ),
}


def is_video(output: str) -> bool:
    """Return whether an output is a video rather than a folder or pattern of pictures."""
    return Path(output).suffix.lower() in CODECS and not _names_a_folder(output)


def _names_a_folder(output: str) -> bool:
    return output.endswith(tuple(filter(None, (os.sep, os.altsep))))


def check_video(path: Path, size: tuple[int, int], fps: float, codec: str | None = None) -> str:
    """The codec that `VideoWriter` would use. Raises `InputError` for what it would refuse."""
    check_writable(path, tuple(CODECS))
    ending = path.suffix.lower()
    codec = codec or CODECS[ending][0]
    if codec not in CODECS[ending]:
        raise InputError(f"{path}: the codec for {ending} must be one of {', '.join(CODECS[ending])} (got {codec})")
    fastest = FASTEST_GIF_FPS if ending == ".gif" else FASTEST_FPS
    if not 0 < fps <= fastest:
        raise InputError(f"{path}: must have above 0 to {fastest:g} frames a second (got {fps:g})")
    even = tuple(max(2, side - side % 2) for side in size)
    if codec != "gif" and even != tuple(size):
        raise InputError(
            f"{path}: the width and height of video must be even (got {size[0]}x{size[1]}); "
            f"the nearest is {even[0]}x{even[1]}"
        )
    return codec


def find_ffmpeg() -> str:
    """The path of ffmpeg: that of the environment's `IMAGEIO_FFMPEG_EXE`, or the one that the extra brings."""
    try:
        return str(import_module("imageio_ffmpeg").get_ffmpeg_exe())
    except ImportError:
        raise GreenswardError(
            'video needs ffmpeg, which an extra brings: pip install "greensward[video]"; '
            "a PNG sequence, such as -o frames/%04d.png, needs nothing"
        ) from None
    except RuntimeError:
        raise GreenswardError(
            "video needs ffmpeg, and none is there; install it, or name it in IMAGEIO_FFMPEG_EXE"
        ) from None


class VideoWriter:
    """Writes frames into an `.mp4`, `.webm` or `.gif`, whose name becomes a file when all is well.

    `size` is width and height in pixels, both even except for a GIF; `fps` is frames a second, above 0 and up
    to 240, for a GIF 50; `codec` is one of `CODECS` for the ending. To be used in a `with` block, whose end
    finishes the file; left by an exception, it leaves nothing. A GIF repeats for ever.

    Raises `InputError` for arguments that do not fit, and `GreenswardError` where ffmpeg is missing or fails.
    """

    def __init__(self, path: str | Path, size: tuple[int, int], fps: float, codec: str | None = None) -> None:
        self.path = Path(path)
        self.size = size
        self.frames = 0
        """Frames added so far."""
        codec = check_video(self.path, size, fps, codec)
        self._aside = self.path.parent / f".{os.getpid()}-{secrets.token_hex(4)}.part"
        kind = self.path.suffix.lower()[1:]
        self._command = [
            find_ffmpeg(),
            *("-hide_banner", "-nostdin", "-nostats", "-loglevel", "error"),
            *("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-framerate", repr(float(fps))),
            *("-i", "pipe:0", *_ENCODERS[codec]),
            *(("-movflags", "+faststart") if kind == "mp4" else ()),
            *("-f", kind, "-y", f"file:{self._aside}"),
        ]

    def __enter__(self) -> Self:
        with held_back():
            self._said = tempfile.TemporaryFile()  # a pipe that nobody reads would fill
            self._start()
            return self

    def _start(self) -> None:
        try:
            self._process = subprocess.Popen(
                self._command,
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=self._said,
                env=os.environ | {"SVT_LOG": "1"},  # or it reports its settings as if they were errors
                **_apart(),
            )
        except OSError as error:
            self._said.close()
            raise GreenswardError(
                f"{self.path}: ffmpeg cannot be run: {self._command[0]}: {error.strerror or error}"
            ) from None
        assert self._process.stdin
        self._pipe = self._process.stdin

    def add(self, image: npt.NDArray[np.uint8]) -> None:
        """Add a frame: sRGB, uint8 of shape (height, width, 3), top row first."""
        width, height = self.size
        if image.dtype != np.uint8 or image.shape != (height, width, 3):
            raise InputError(
                f"{self.path}: a frame must be uint8 of shape {(height, width, 3)} "
                f"(got {image.dtype} of {image.shape})"
            )
        try:
            self._pipe.write(np.ascontiguousarray(image).data)
        except OSError:  # ffmpeg has ended, and has said why
            self._process.wait()
            raise self._failure() from None
        self.frames += 1

    def finish(self) -> None:
        """Finish the file with the frames so far, of which there must be one; interrupted, call it again.

        Of a frame whose `add` was interrupted, nothing gets into the file.
        """
        if self.frames == 0:
            raise InputError(f"{self.path}: a video needs at least one frame")
        with contextlib.suppress(OSError):  # its exit code says why
            self._pipe.close()
        if self._process.wait() != 0:
            raise self._failure()
        if self._aside.exists():
            try:
                self._aside.replace(self.path)
            except OSError as error:
                raise GreenswardError(f"{self.path}: cannot be written: {error.strerror or error}") from None

    def _failure(self) -> GreenswardError:
        """Error with ffmpeg's first line, which names the cause; the rest are consequences."""
        self._said.seek(0)
        lines = [line.strip() for line in self._said.read().decode(errors="replace").splitlines()]
        code = self._process.returncode
        ended = f"was ended by signal {-code}" if code < 0 else f"ended with code {code}"
        reason = next((re.sub(r"^(\[[^\]]*\] )+", "", line) for line in lines if line), "and said nothing")
        return GreenswardError(f"{self.path}: ffmpeg {ended}: {reason.replace(str(self._aside), str(self.path))}")

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self.finish()
        finally:
            with held_back():
                self._process.kill()
                self._process.wait()
                with contextlib.suppress(OSError):  # what it still held is not wanted
                    self._pipe.close()
                self._said.close()
                self._aside.unlink(missing_ok=True)


def _apart() -> dict[str, Any]:
    """Options that shield a child from a terminal's Ctrl-C: we end it when the file is complete."""
    if sys.platform == "win32":
        return {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP | subprocess.CREATE_NO_WINDOW}
    return {"start_new_session": True}


# Numbered files ---------------------------------------------------------------------------------------------

_NUMBER = re.compile(r"%(?:0(\d{1,2}))?d|(#+)")
_LARGEST_RECORD = 2**20
_FIX = "choose another folder, or start over with --overwrite"


class FrameFiles:
    """A clip as PNG files of one folder, numbered from 0, and beside them a record of what made them.

    `output` is a pattern such as `frames/%04d.png` or `frames/####.png`, or a folder, for `frame_%04d.png` in
    it. Raises `InputError` for another.
    """

    def __init__(self, output: str) -> None:
        path = Path(output)
        if _names_a_folder(output) or os.path.isdir(output):  # noqa: PTH112  # which does not raise
            path /= "frame_%04d.png"
        elif path.suffix.lower() != ".png":
            raise InputError(
                f"{output}: must end in {', '.join(CODECS)} for a video, be a pattern such as frames/%04d.png, "
                f"or a folder and end in / (got {path.suffix or 'no ending'})"
            )
        numbers = list(_NUMBER.finditer(path.name))
        if not _NUMBER.search(output) and not numbers:
            raise InputError(
                f"{output}: is the name of one picture; number the frames, as in frames/%04d.png, "
                "or draw one picture with `greensward render`"
            )
        if len(numbers) != 1:
            raise InputError(f"{output}: must have one number, in the file's name, as in frames/%04d.png")
        (found,) = numbers
        self.folder = path.parent
        self._before, self._after = path.name[: found.start()], path.name[found.end() :]
        self._digits = int(found[1] or 1) if found[2] is None else len(found[2])
        pattern = f"{self._before}%0{self._digits}d{self._after}"
        self._record = self.folder / f".greensward-{Path(pattern).stem}.json"

    def path(self, index: int) -> Path:
        """The file of a frame."""
        return self.folder / f"{self._before}{index:0{self._digits}d}{self._after}"

    def holds(self, path: Path) -> bool:
        """Return whether a file has the place and the name of a frame."""
        return path.resolve().parent == self.folder.resolve() and self._index(path.resolve().name) is not None

    def present(self) -> set[int]:
        """The numbers of the frames that are there."""
        try:
            with os.scandir(self.folder) as files:
                return {
                    index for file in files if (index := self._index(file.name)) is not None and file.stat().st_size
                }
        except FileNotFoundError:
            return set()

    def _index(self, name: str) -> int | None:
        digits = name.removeprefix(self._before).removesuffix(self._after)
        is_number = re.fullmatch(r"[0-9]{1,9}", digits) and self.path(int(digits)).name == name
        return int(digits) if is_number else None

    def check(self, made_with: Mapping[str, object], overwrite: bool = False) -> None:
        """Raise `InputError` if frames cannot be written there, or are there and were made otherwise."""
        folder = self.folder
        try:
            while not folder.exists() and folder != folder.parent:
                folder = folder.parent
            if not folder.is_dir():
                raise InputError(f"{folder}: is no folder, and frames need one")
            check_writable(folder / self.path(0).name, (".png",))
            nothing_there = not self.present()
        except (OSError, ValueError) as error:
            raise InputError(f"{self.folder}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
        if overwrite or nothing_there:
            return
        try:
            recorded = json.loads(read_file(self._record, _LARGEST_RECORD, "a record"))
            unlike = [key for key, value in made_with.items() if recorded[key] != value]
        except InputError:
            raise InputError(f"{self.folder}: holds frames of unknown origin; {_FIX}") from None
        except (ValueError, KeyError, TypeError, RecursionError):
            raise InputError(f"{self._record}: is damaged, so the frames are of unknown origin; {_FIX}") from None
        if unlike:
            key = unlike[0]
            was = "another scene" if key == "scene" else f"{key} {short(recorded[key], False)}, not {made_with[key]}"
            raise InputError(f"{self.folder}: holds frames made with {was}; {_FIX}")

    def start(self, made_with: Mapping[str, object], overwrite: bool = False) -> set[int]:
        """Make the folder and its record; the numbers of the frames that are there and stay."""
        self.check(made_with, overwrite)
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            present = self.present()
            if overwrite:
                for index in present:
                    self.path(index).unlink()
                present = set()
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise GreenswardError(f"{self.folder}: cannot be written: {reason}") from None
        with written_aside(self._record) as stream:
            stream.write(json.dumps(made_with, indent=2).encode())
        return present

    def write(self, index: int, image: npt.NDArray[np.uint8]) -> None:
        """Write a frame, uint8 of shape (height, width, 3)."""
        write_picture(self.path(index), image)
