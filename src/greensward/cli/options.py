"""Options of the commands that draw, their parsing, and the progress bar."""

import contextlib
import math
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

if TYPE_CHECKING:
    from greensward.scene.scene import Scene

LARGEST_SIDE = 16384


def size_of(text: str) -> tuple[int, int]:
    """Width and height in pixels."""
    match = re.fullmatch(r"(\d{1,9})[x×X](\d{1,9})", text.strip())
    size = (int(match[1]), int(match[2])) if match else (0, 0)
    if not match or min(size) < 1 or max(size) > LARGEST_SIDE:
        raise typer.BadParameter(
            f"must be WIDTHxHEIGHT, such as 1280x720, each from 1 to {LARGEST_SIDE} (got {text})"
        )
    return size


def finite(text: str) -> float:
    """A finite number of seconds."""
    with contextlib.suppress(ValueError):
        if math.isfinite(value := float(text)):
            return value
    raise typer.BadParameter(f"must be a finite number of seconds (got {text})")


def above_zero(highest: float, what: str) -> Callable[[str], float]:
    """A parser of numbers above 0, up to a highest, of what they are."""

    def parse(text: str) -> float:
        with contextlib.suppress(ValueError):
            if 0 < (value := float(text)) <= highest:
                return value
        raise typer.BadParameter(f"must be a number of {what} above 0, at most {highest:,.10g} (got {text})")

    return parse


def whole(lowest: int, highest: int) -> Callable[[str], int]:
    """A parser of whole numbers in a range."""

    def parse(text: str) -> int:
        if not re.fullmatch(r"[+-]?\d{1,18}", text) or not lowest <= int(text) <= highest:
            raise typer.BadParameter(f"must be a whole number from {lowest} to {highest} (got {text})")
        return int(text)

    return parse


def _device(text: str) -> str:
    if not re.fullmatch(r"auto|cpu|\d{1,3}", text):
        raise typer.BadParameter(f"must be auto, cpu, or the number of a GPU from 0 (got {text})")
    return text


SceneName: TypeAlias = Annotated[
    str, typer.Argument(metavar="SCENE", help="A preset's name, a TOML file or its folder.")
]
Size: TypeAlias = Annotated[Any, typer.Option(parser=size_of, metavar="WIDTHxHEIGHT", help="Pixels of the picture.")]
Samples: TypeAlias = Annotated[
    Any, typer.Option(parser=whole(1, 4096), metavar="N", help="Samples for each pixel: more, cleaner edges.")
]
FrameSamples: TypeAlias = Annotated[
    Any,
    typer.Option(
        parser=whole(1, 4096),
        metavar="N",
        help="Samples for each pixel of each frame; if not given, one, and edges are smoothed over the frames.",
        show_default=False,
    ),
]
Overrides: TypeAlias = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change one key of the scene; may be repeated."),
]
Seed: TypeAlias = Annotated[
    Any,
    typer.Option(parser=whole(0, 2**32 - 1), metavar="N", help="Seed: another field of the same kind."),
]
Technique: TypeAlias = Annotated[
    str | None, typer.Option(metavar="NAME", help="Technique that draws the grass, as listed by `info`.")
]
View: TypeAlias = Annotated[
    str | None,
    typer.Option(metavar="VIEW", help="x,y,z:tx,ty,tz[:fov] in metres and degrees, or a TOML file with [camera]."),
]
CameraFile: TypeAlias = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Path of the camera: a TOML file of keys.")
]
Device: TypeAlias = Annotated[
    str, typer.Option(parser=_device, metavar="auto|cpu|N", help="Device to draw on: N is a GPU, from 0.")
]
AsJson: TypeAlias = Annotated[bool, typer.Option("--json", help="Print what was done as JSON.")]


def load_scene(
    name: str, overrides: Sequence[str] | None, seed: int | None, technique: str | None, camera: str | None
) -> "Scene":
    """The scene that the options ask for."""
    from greensward.scene.load import load
    from greensward.techniques import SETTINGS

    return load(
        name,
        overrides=overrides or (),
        seed=seed,
        technique=technique,
        camera=camera,
        technique_settings=SETTINGS,
    )


def spare_what_is_read(scene: "Scene", output: object, is_written: Callable[[Path], bool]) -> None:
    """Raise `InputError` if a file that the scene reads would be written."""
    from greensward.scene.errors import InputError
    from greensward.scene.load import named_files
    from greensward.techniques import SETTINGS

    for key, path in named_files(scene, SETTINGS):
        if is_written(path.resolve()):
            raise InputError(f"{output}: would overwrite what the scene reads as {key}; choose another name")


@contextlib.contextmanager
def named(scene: str) -> Iterator[None]:
    """Name the scene in the `InputError` of what draws or checks it, which knows keys only."""
    from greensward.scene.errors import InputError, SceneError

    try:
        yield
    except SceneError as error:
        raise SceneError(_named(scene, problem) for problem in error.problems) from None
    except InputError as error:
        raise InputError(_named(scene, str(error))) from None


def _named(scene: str, problem: str) -> str:
    from greensward.scene.scene import Scene

    rule = problem.removeprefix("scene: ")
    key = re.match(r"\w+(?=[.:\[])", rule)
    return f"{scene}: {rule}" if key and key[0] in Scene.model_fields else problem


@contextlib.contextmanager
def progress() -> Iterator[Callable[[int, int], None]]:
    """Show progress: a bar and the time left on a terminal, nothing in a pipe."""
    if not sys.stderr.isatty():
        yield lambda _done, _total: None
        return
    from rich.console import Console
    from rich.progress import Progress

    # a frame may take a minute, and the time left is judged by the last few
    with Progress(console=Console(stderr=True), transient=True, speed_estimate_period=300) as bar:
        task = bar.add_task("Drawing", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
