"""`greensward check`."""

import json
import sys
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from greensward.cli.options import named

EXAMPLES = """\b
Examples:
  greensward check hill/scene.toml
  greensward check meadow --json
"""


def check(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="A preset's name, a TOML file or its folder.")],
    as_json: Annotated[bool, typer.Option("--json", help='Print {"ok": …, "errors": […], "warnings": […]}.')] = False,
) -> None:
    """Report every error in a scene and its files, and warn of what is probably not meant."""
    from greensward.ground import HeightField
    from greensward.lens import refuse_lens
    from greensward.scene.colour import GroundColour
    from greensward.scene.errors import InputError, SceneError
    from greensward.scene.load import load, named_files
    from greensward.sowing.colour import green_pictures
    from greensward.techniques import SETTINGS, chosen
    from greensward.viewpoint import place

    problems: tuple[str, ...] = ()
    with warnings.catch_warnings(record=True) as doubts:
        warnings.simplefilter("always", UserWarning)
        try:
            loaded = load(scene, technique_settings=SETTINGS, read_file=_read)
            with named(scene):
                if isinstance(loaded.colour, GroundColour):
                    green_pictures(loaded, loaded.colour)
                chosen(loaded)
                position, _ = place(loaded.camera, HeightField.of(loaded))
                if loaded.water:
                    loaded.water.refuse_below(float(position[1]))
                if not loaded.camera.is_straight:
                    refuse_lens(loaded.camera, loaded.camera.calibrated_px or (1280, 720))
        except InputError as error:
            if not as_json:
                raise
            problems = error.problems if isinstance(error, SceneError) else (str(error),)
    said = [str(each.message) for each in doubts]
    if as_json:
        print(json.dumps({"ok": not problems, "errors": problems, "warnings": said}, indent=2))
        raise typer.Exit(2 if problems else 0)
    for each in said:
        print(f"warning: {each}", file=sys.stderr)
    count = {0: "no files", 1: "1 file"}.get(files := len(named_files(loaded, SETTINGS)), f"{files} files")
    title = loaded.title or "untitled"
    print(f"{scene}: valid: “{title}”, {loaded.ground.kind} ground, {len(loaded.grass)} species, {count}")


def _read(key: str, path: Path, table: Mapping[str, Any]) -> None:
    """Read a file that a scene names as drawing it would; raises `InputError`."""
    from pydantic import ValidationError

    from greensward.ground.height_field import height_map, height_map_size_m, seamless_map, warn_of_seam
    from greensward.io.masks import read_mask
    from greensward.io.meshes import read_mesh
    from greensward.io.rasters import read_rgba
    from greensward.motion.outlines import read_outline
    from greensward.scene.errors import InputError
    from greensward.scene.ground import EndlessGround, HeightMapGround

    if key.startswith("object") and key.endswith(".file"):
        mesh, fur = read_mesh(path, painted=table.get("colour") is None), table.get("grass")
        if isinstance(fur, dict) and fur.get("density_from") == "colours" and mesh.colours is None:
            raise InputError(f"{path}: has no vertex colours for grass.density_from")
        if isinstance(fur, dict) and fur.get("density_map") and mesh.uv is None:
            raise InputError(f"{path}: has no texture coordinates for grass.density_map")
        return
    if key.endswith("density_map"):
        read_mask(path, with_heights=key.startswith("sowing"))
        return
    if key.startswith("force") and key.endswith(".outline"):
        read_outline(path)
        return
    if key != "ground.file":
        read_rgba(path, coloured=key.startswith("force"))
        return
    try:
        if table.get("kind") == "endless":
            warn_of_seam(seamless_map(EndlessGround.model_validate(table), path))
            return
        ground = HeightMapGround.model_validate(table)
    except ValidationError:
        return  # reported already; how to read the file is not known until that is fixed
    heights = height_map(ground, path)
    if ground.beyond == "repeat":
        warn_of_seam(heights)
    height_map_size_m(ground, path)
