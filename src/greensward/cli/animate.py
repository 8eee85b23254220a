"""`greensward animate`."""

import contextlib
import hashlib
import json
import math
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from greensward.cli.moving_camera import cameras, read_path
from greensward.cli.options import (
    AsJson,
    CameraFile,
    Device,
    FrameSamples,
    Overrides,
    SceneName,
    Seed,
    Size,
    Technique,
    View,
    above_zero,
    finite,
    load_scene,
    named,
    progress,
    spare_what_is_read,
)

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from greensward.io.camera_path import CameraPath
    from greensward.io.checkpoints import Checkpoint
    from greensward.io.video import FrameFiles
    from greensward.renderer import Renderer
    from greensward.scene.errors import GreenswardError
    from greensward.scene.light import Camera
    from greensward.scene.scene import Scene

EXAMPLES = """\b
Examples:
  greensward animate meadow -o clip.mp4
  greensward animate meadow -o loop.gif --size 480x270 --seconds 2 --fps 25
  greensward animate meadow -o clip.webm --codec av1 --set wind.0.speed_mps=12
  greensward animate meadow -o frames/%04d.png --seconds 10
  greensward animate meadow -o fine.mp4 --samples 16
  greensward animate meadow -o walk.mp4 --camera-path walk.toml
  greensward animate meadow -o first.mp4 --checkpoint first.npz
  greensward animate meadow -o second.mp4 --from first.npz
"""
_MOST_FRAMES = 1_000_000
_LONGEST_S = 1e9
_SETTLED = 8
"""Frames that the first one's edges are smoothed over, where none came before."""


@dataclass(frozen=True)
class _Clip:
    """Range of the frames that are drawn, counted from a start that a checkpoint preserves."""

    start_s: float
    fps: float
    first: int
    count: int

    @property
    def indices(self) -> range:
        return range(self.first, self.first + self.count)

    def time_s(self, index: int) -> float:
        return self.start_s + index / self.fps  # never a sum of steps: no error adds up


def animate(
    scene: SceneName,
    output: Annotated[
        str,
        typer.Option(
            "--output", "-o", metavar="OUT", help="A .mp4, .webm or .gif; frames/%04d.png; or a folder, ending in /."
        ),
    ],
    seconds: Annotated[
        Any,
        typer.Option(
            parser=above_zero(1e9, "seconds"),
            metavar="SECONDS",
            help="Length of the clip; 4, or until the camera's path ends.",
            show_default=False,
        ),
    ] = None,
    fps: Annotated[
        Any,
        typer.Option(
            parser=above_zero(240, "frames a second"),
            metavar="N",
            help="Frames a second; 30, or the checkpoint's.",
            show_default=False,
        ),
    ] = None,
    start_s: Annotated[
        Any,
        typer.Option("--time", parser=finite, metavar="SECONDS", help="The first instant; 0, or the checkpoint's."),
    ] = None,
    codec: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="h264, h265 or av1 for .mp4; vp9 or av1 for .webm; the first if none is named."
        ),
    ] = None,
    size: Size = "1280x720",
    samples: FrameSamples = None,
    overrides: Overrides = None,
    seed: Seed = None,
    technique: Technique = None,
    camera: View = None,
    camera_path: CameraFile = None,
    device: Device = "auto",
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Restart a PNG sequence, removing its frames.")
    ] = False,
    checkpoint: Annotated[
        Path | None, typer.Option(metavar="FILE.npz", help="Save the simulation state after the last frame.")
    ] = None,
    before: Annotated[
        Path | None, typer.Option("--from", metavar="FILE.npz", help="Continue from a checkpoint.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Draw a clip of a scene: a video, a GIF, or numbered pictures."""
    begin = time.perf_counter()
    from greensward.io.checkpoints import Checkpoint, read_checkpoint, write_checkpoint
    from greensward.scene.errors import InputError

    known = read_checkpoint(before) if before else None
    path = read_path(camera_path, camera)
    clip = _clip(seconds, fps, start_s, before, known, path)
    files = _output(output, size, clip.fps, codec)
    loaded = load_scene(scene, overrides, seed, technique, camera)
    _spare(loaded, output, files, checkpoint)
    made_with = _made_with(loaded, size, samples, clip, path)
    if known and known.scene != made_with["scene"]:
        raise InputError(f"{before}: was saved from another scene; continue with the same one, and the same options")
    if files:
        files.check(made_with, overwrite)

    from greensward.renderer import Renderer

    spent = {"write": 0.0}
    loading_s = time.perf_counter() - begin
    with (
        _interruptible(output),
        named(scene),
        Renderer(loaded, size=size, samples=samples or 1, temporal=samples is None, device=device) as renderer,
        progress() as notify,
    ):
        if before and known:
            _resume(renderer, before, known)
        job = _Job(
            renderer, clip, notify, spent, cameras(renderer, map(clip.time_s, clip.indices), path, camera_path)
        )
        if files:
            drawn = job.write_files(output, files, made_with, overwrite, to_the_end=checkpoint is not None)
        else:
            drawn = job.write_video(output, codec)
        after = renderer.checkpoint() if checkpoint else {}
        done = _done(output, clip, drawn, renderer, checkpoint)
        spent = {"load": loading_s, **renderer.seconds, **spent}
    if checkpoint:
        following = clip.first + clip.count
        handed_on = Checkpoint(clip.start_s, clip.fps, following, str(made_with["scene"]), after)
        write_checkpoint(checkpoint, handed_on)
    _report(done, spent | {"total": time.perf_counter() - begin}, as_json)


def _interrupted(message: str) -> "GreenswardError":
    from greensward.scene.errors import GreenswardError

    error = GreenswardError(message)
    error.exit_code = 130
    return error


@contextlib.contextmanager
def _interruptible(output: str) -> Iterator[None]:
    try:
        yield
    except KeyboardInterrupt:
        raise _interrupted(f"{output}: interrupted") from None


def _done(output: str, clip: _Clip, drawn: int, renderer: "Renderer", checkpoint: Path | None) -> dict[str, Any]:
    return {
        "output": output,
        "frames": clip.count,
        "drawn": drawn,
        "fps": clip.fps,
        "start_s": clip.time_s(clip.first),
        "length_s": clip.count / clip.fps,
        "checkpoint": str(checkpoint) if checkpoint else None,
        "width": renderer.size[0],
        "height": renderer.size[1],
        "technique": renderer.technique_name,
        "driver": renderer.driver,
    }


def _report(done: Mapping[str, Any], seconds: Mapping[str, float], as_json: bool) -> None:
    if as_json:
        rounded = {stage: round(value, 6) for stage, value in seconds.items()}
        print(json.dumps({**done, "seconds": rounded}, indent=2))
        return
    stages = ", ".join(f"{stage} {value:.1f}" for stage, value in seconds.items() if stage != "total")
    there = done["frames"] - done["drawn"]
    print(
        f"{done['output']}: {done['frames']:,} frames, {done['length_s']:g} s at {done['fps']:g} a second, "
        f"{done['width']}×{done['height']}, {done['technique']} on {done['driver']} "
        f"in {seconds['total']:.1f} s ({stages})"
        + (f"; {there:,} of them were there" if there else "")
        + (f"; checkpoint in {done['checkpoint']}" if done["checkpoint"] else "")
    )


# Before anything is drawn -----------------------------------------------------------------------------------


def _clip(
    seconds: float | None,
    fps: float | None,
    start_s: float | None,
    before: Path | None,
    known: "Checkpoint | None",
    path: "CameraPath | None",
) -> _Clip:
    from greensward.scene.errors import InputError

    if known:
        if fps not in (None, known.fps):
            raise InputError(f"--fps: must be that of {before}, which is {known.fps:g} (got {fps:g})")
        if start_s is not None:
            raise InputError("--time: cannot be given with --from, which continues where the checkpoint ends")
        fps, start_s = known.fps, known.start_s
    fps = 30.0 if fps is None else fps
    if seconds is None:
        first_s = (start_s or 0.0) + (known.following / fps if known else 0.0)
        seconds = path.end_s - first_s if path and path.end_s > first_s else 4.0
    count = max(1, math.floor(seconds * fps + 0.5))
    if count > _MOST_FRAMES:
        raise InputError(
            f"--seconds: {seconds:,.10g} s at {fps:g} a second are {count:,} frames; "
            f"a clip has at most {_MOST_FRAMES:,}"
        )
    clip = _Clip(start_s or 0.0, fps, known.following if known else 0, count)
    for time_s in (clip.time_s(clip.indices[0]), clip.time_s(clip.indices[-1])):
        if abs(time_s) > _LONGEST_S:
            raise InputError(f"--time: all frames must lie within a billion seconds (got one at {time_s:g})")
    return clip


def _output(output: str, size: tuple[int, int], fps: float, codec: str | None) -> "FrameFiles | None":
    """The files of a sequence, or None for a video that can be written."""
    from greensward.io.video import FrameFiles, check_video, find_ffmpeg, is_video
    from greensward.scene.errors import InputError

    if is_video(output):
        check_video(Path(output), size, fps, codec)
        find_ffmpeg()
        return None
    files = FrameFiles(output)
    if codec is not None:
        raise InputError(f"--codec: goes with a video, and {output} is a PNG sequence")
    return files


def _spare(scene: "Scene", output: str, files: "FrameFiles | None", checkpoint: Path | None) -> None:
    video = Path(output).resolve()
    spare_what_is_read(scene, output, files.holds if files else lambda path: path == video)
    if checkpoint:
        from greensward.scene.files import check_writable

        check_writable(checkpoint, (".npz",))
        written = checkpoint.resolve()
        spare_what_is_read(scene, checkpoint, lambda path: path == written)


def _hash(scene: "Scene") -> str:
    """Hash of a scene and of the content of its files."""
    from greensward.scene.files import open_file
    from greensward.scene.load import dump, named_files
    from greensward.techniques import SETTINGS

    scene_hash = hashlib.sha256(dump(scene).encode())
    for _, path in named_files(scene, SETTINGS):
        with open_file(path) as stream:
            digest = hashlib.file_digest(stream, "sha256")  # type: ignore[arg-type]  # what typeshed asks for, it has
            scene_hash.update(digest.digest())
    return scene_hash.hexdigest()


def _made_with(
    scene: "Scene", size: tuple[int, int], samples: int | None, clip: _Clip, path: "CameraPath | None"
) -> dict[str, object]:
    """Options that all frames of a sequence share: a later run continues only frames that it would draw."""
    from greensward import __version__

    return {
        "version": __version__,
        "size": f"{size[0]}x{size[1]}",
        "samples": samples or "over time",
        "fps": clip.fps,
        "start_s": clip.start_s,
        "technique": scene.technique.name,
        "scene": _hash(scene),
        "camera_path": path.digest if path else "none",
    }


# Drawing ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Job:
    renderer: "Renderer"
    clip: _Clip
    notify: Callable[[int, int], None]
    spent: dict[str, float]
    camera_at: "Callable[[float], Camera | None]"

    def write_video(self, output: str, codec: str | None) -> int:
        """Draw the clip into a video, which ends with the last whole frame if interrupted; the number drawn."""
        from greensward.io.video import VideoWriter

        with VideoWriter(output, self.renderer.size, self.clip.fps, codec) as video:
            try:
                self._draw(self.clip.indices, (), lambda _, image: video.add(image))
                with self._writing():
                    video.finish()
            except KeyboardInterrupt:
                if not video.frames:
                    raise _interrupted(f"{output}: interrupted; nothing was written") from None
                video.finish()
                raise _interrupted(
                    f"{output}: interrupted; it holds the first {video.frames:,} of {self.clip.count:,} frames"
                ) from None
        return self.clip.count

    def write_files(
        self, output: str, files: "FrameFiles", made_with: dict[str, object], overwrite: bool, to_the_end: bool
    ) -> int:
        """Draw what is missing of a sequence; the number drawn."""
        present = files.start({**made_with, "driver": self.renderer.driver}, overwrite)
        missing = [index for index in self.clip.indices if index not in present]
        last = self.clip.indices[-1] if to_the_end else missing[-1] if missing else self.clip.first - 1
        try:
            self._draw(range(self.clip.first, last + 1), present, files.write)
        except KeyboardInterrupt:
            there = len(files.present().intersection(self.clip.indices))
            raise _interrupted(
                f"{output}: interrupted; {there:,} of {self.clip.count:,} frames are there, "
                "and the same command goes on from them"
            ) from None
        return len(missing)

    def _draw(
        self, indices: range, present: Collection[int], add: "Callable[[int, npt.NDArray[np.uint8]], None]"
    ) -> None:
        """Draw frames and pass them on. Those that are present only advance the simulation, or temporal pictures."""
        temporal, samples = self.renderer.temporal, self.renderer.samples
        settling = list(indices[:1]) * max(0, _SETTLED - self.renderer.blended) if temporal else []
        total = len(settling) + sum(1 if index in present else samples for index in indices)
        done = 0

        def notify(sample: int, _: int) -> None:
            self.notify(done + sample, total)

        for index in settling:
            time_s = self.clip.time_s(index)
            self.renderer.render(time_s=time_s, camera=self.camera_at(time_s), progress=notify)
            done += 1
        for index in indices:
            time_s = self.clip.time_s(index)
            if index in present and not temporal:
                self.renderer.advance(time_s, camera=self.camera_at(time_s))
                done += 1
                self.notify(done, total)
                continue
            frame = self.renderer.render(time_s=time_s, camera=self.camera_at(time_s), progress=notify)
            done += samples
            if index not in present:
                with self._writing():
                    add(index, frame.image)

    @contextlib.contextmanager
    def _writing(self) -> Iterator[None]:
        began = time.perf_counter()
        yield
        self.spent["write"] += time.perf_counter() - began


def _resume(renderer: "Renderer", path: Path, known: "Checkpoint") -> None:
    from greensward.scene.errors import InputError

    try:
        renderer.resume(known.state)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
