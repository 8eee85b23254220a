"""`greensward render`."""

import contextlib
import json
import math
import re
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Any

import typer

EXAMPLES = """\b
Examples:
  greensward render meadow -o meadow.png
  greensward render meadow -o windy.png --set wind.0.speed_mps=12 --time 3.5
  greensward render hill/scene.toml -o hill.png --size 1920x1080 --samples 16
  greensward render meadow -o close.png --camera 0,0.4,2:0,0.2,-5:35
  greensward render meadow -o data.png --aov depth,class,blade-id --json
"""
AOVS = ("depth", "normal", "class", "blade-id", "motion", "albedo")
LARGEST_SIDE = 16384


def _size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,9})[x×X](\d{1,9})", text.strip())
    size = (int(match[1]), int(match[2])) if match else (0, 0)
    if not match or min(size) < 1 or max(size) > LARGEST_SIDE:
        raise typer.BadParameter(
            f"must be WIDTHxHEIGHT, such as 1280x720, each from 1 to {LARGEST_SIDE} (got {text})"
        )
    return size


def _finite(text: str) -> float:
    with contextlib.suppress(ValueError):
        if math.isfinite(value := float(text)):
            return value
    raise typer.BadParameter(f"must be a finite number of seconds (got {text})")


def _whole(lowest: int, highest: int) -> Callable[[str], int]:
    def parse(text: str) -> int:
        if not re.fullmatch(r"[+-]?\d{1,18}", text) or not lowest <= int(text) <= highest:
            raise typer.BadParameter(f"must be a whole number from {lowest} to {highest} (got {text})")
        return int(text)

    return parse


def _device(text: str) -> str:
    if not re.fullmatch(r"auto|cpu|\d{1,3}", text):
        raise typer.BadParameter(f"must be auto, cpu, or the number of a GPU from 0 (got {text})")
    return text


def _aovs(texts: list[str]) -> tuple[str, ...]:
    names = [name.strip() for text in texts for name in text.split(",")]
    for name in names:
        if name not in AOVS:
            raise typer.BadParameter(f"must be one or more of {','.join(AOVS)} (got {name or 'nothing'})")
    return tuple(dict.fromkeys(names))


def render(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="A preset's name, a TOML file or its folder.")],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE", help="The picture: .png, .jpg, .tif or .webp.")
    ],
    size: Annotated[
        Any, typer.Option(parser=_size, metavar="WIDTHxHEIGHT", help="Pixels of the picture.")
    ] = "1280x720",
    time_s: Annotated[
        Any, typer.Option("--time", parser=_finite, metavar="SECONDS", help="The instant to draw.")
    ] = "0",
    samples: Annotated[
        Any,
        typer.Option(parser=_whole(1, 4096), metavar="N", help="Samples for each pixel: more, cleaner edges."),
    ] = "8",
    overrides: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Change one key of the scene; may be repeated."),
    ] = None,
    seed: Annotated[
        Any,
        typer.Option(parser=_whole(0, 2**32 - 1), metavar="N", help="Another field of the same kind."),
    ] = None,
    technique: Annotated[
        str | None, typer.Option(metavar="NAME", help="How to draw the grass, as listed by `info`.")
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(
            metavar="VIEW", help="x,y,z:tx,ty,tz[:fov] in metres and degrees, or a TOML file with [camera]."
        ),
    ] = None,
    aov: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAMES",
            help=f"Ground truth to write beside the picture, as .npz: any of {','.join(AOVS)}.",
        ),
    ] = None,
    device: Annotated[
        str, typer.Option(parser=_device, metavar="auto|cpu|N", help="Where to draw: N is a GPU, from 0.")
    ] = "auto",
    as_json: Annotated[bool, typer.Option("--json", help="Print what was done as JSON.")] = False,
) -> None:
    """Draw one picture of a scene."""
    begin = time.perf_counter()
    try:
        aovs = _aovs(aov or [])
    except typer.BadParameter as error:
        error.param_hint = "'--aov'"
        raise
    from greensward.io.rasters import check_writable, write_npz, write_picture
    from greensward.scene.errors import InputError
    from greensward.scene.load import load, named_files
    from greensward.techniques import SETTINGS

    truth = output.with_suffix(".npz") if aovs else None
    check_writable(output)
    if truth:
        check_writable(truth, (".npz",))
    loaded = load(
        scene,
        overrides=overrides or (),
        seed=seed,
        technique=technique,
        camera=camera,
        technique_settings=SETTINGS,
    )
    for key, path in named_files(loaded):
        if path.resolve() in (output.resolve(), truth and truth.resolve()):
            raise InputError(f"{output}: would overwrite what the scene reads as {key}; choose another name")

    from greensward.renderer import Renderer

    loading_s = time.perf_counter() - begin
    with Renderer(loaded, size=size, samples=samples, device=device) as renderer, _progress() as progress:
        frame = renderer.render(time_s=time_s, aovs=aovs, progress=progress)
        seconds = {"load": loading_s, **renderer.seconds}
        blades, driver, name = renderer.blades, renderer.driver, renderer.technique_name
    writing = time.perf_counter()
    write_picture(output, frame.image)
    if truth:
        write_npz(truth, frame.truth)
    end = time.perf_counter()
    seconds |= {"write": end - writing, "total": end - begin}
    width, height = size
    if as_json:
        done = {
            "output": str(output),
            "truth": str(truth) if truth else None,
            "width": width,
            "height": height,
            "technique": name,
            "driver": driver,
            "seconds": {stage: round(value, 6) for stage, value in seconds.items()},
            "blades": blades,
        }
        print(json.dumps(done, indent=2))
        return
    stages = ", ".join(f"{stage} {value:.1f}" for stage, value in seconds.items() if stage != "total")
    beside = f"; ground truth in {truth}" if truth else ""
    print(
        f"{output}: {width}×{height}, {blades:,} blades of {name} on {driver} "
        f"in {seconds['total']:.1f} s ({stages}){beside}"
    )


@contextlib.contextmanager
def _progress() -> Iterator[Callable[[int, int], None]]:
    """Tells how far a picture is: a bar on a terminal, silence in a pipe."""
    if not sys.stderr.isatty():
        yield lambda _done, _total: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("Drawing", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
