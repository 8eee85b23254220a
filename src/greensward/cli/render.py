"""`greensward render`."""

import json
import time
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from greensward.aovs import AOVS, Aov, unknown_aov
from greensward.cli.options import (
    AsJson,
    Device,
    Overrides,
    Samples,
    SceneName,
    Seed,
    Size,
    Technique,
    View,
    finite,
    load_scene,
    named,
    progress,
    spare_what_is_read,
)

EXAMPLES = """\b
Examples:
  greensward render meadow -o meadow.png
  greensward render meadow -o windy.png --set wind.0.speed_mps=12 --time 3.5
  greensward render hill/scene.toml -o hill.png --size 1920x1080 --samples 16
  greensward render meadow -o close.png --camera 0,0.4,2:0,0.2,-5:35
  greensward render meadow -o data.png --aov depth,class,blade_id --json
"""


def _aovs(texts: list[str]) -> tuple[Aov, ...]:
    names = [name.strip() for text in texts for name in text.split(",")]
    if unknown := unknown_aov(names):
        raise typer.BadParameter(unknown, param_hint="'--aov'")
    return cast(tuple[Aov, ...], tuple(dict.fromkeys(names)))


def render(
    scene: SceneName,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE", help="The picture: .png, .jpg, .tif or .webp.")
    ],
    size: Size = "1280x720",
    time_s: Annotated[
        Any, typer.Option("--time", parser=finite, metavar="SECONDS", help="The instant to draw.")
    ] = "0",
    samples: Samples = "8",
    overrides: Overrides = None,
    seed: Seed = None,
    technique: Technique = None,
    camera: View = None,
    aov: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAMES",
            help=f"Ground truth to write beside the picture, as .npz: any of {','.join(AOVS)}.",
        ),
    ] = None,
    device: Device = "auto",
    as_json: AsJson = False,
) -> None:
    """Draw one picture of a scene."""
    begin = time.perf_counter()
    aovs = _aovs(aov or [])
    from greensward.io.rasters import PICTURES, write_picture, write_picture_and_truth
    from greensward.scene.files import check_writable

    truth = output.with_suffix(".npz") if aovs else None
    check_writable(output, tuple(PICTURES))
    if truth:
        check_writable(truth, (".npz",))
    loaded = load_scene(scene, overrides, seed, technique, camera)
    written = (output.resolve(), truth and truth.resolve())
    spare_what_is_read(loaded, output, lambda path: path in written)

    from greensward.renderer import Renderer

    loading_s = time.perf_counter() - begin
    with (
        named(scene),
        Renderer(loaded, size=size, samples=samples, device=device) as renderer,
        progress() as notify,
    ):
        frame = renderer.render(time_s=time_s, aovs=aovs, progress=notify)
        seconds = {"load": loading_s, **renderer.seconds}
        blades, driver, name = renderer.blades, renderer.driver, renderer.technique_name
    writing = time.perf_counter()
    if truth:
        write_picture_and_truth(output, frame.image, truth, frame.truth)
    else:
        write_picture(output, frame.image)
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
            "counts": vars(frame.counts),
        }
        print(json.dumps(done, indent=2))
        return
    stages = ", ".join(f"{stage} {value:.1f}" for stage, value in seconds.items() if stage != "total")
    beside = f"; ground truth in {truth}" if truth else ""
    grass = f"{blades:,} blades of {name}" if blades else name  # some techniques store none
    print(f"{output}: {width}×{height}, {grass} on {driver} in {seconds['total']:.1f} s ({stages}){beside}")
