"""`greensward stamp`."""

import contextlib
from pathlib import Path
from typing import Annotated, Any

import typer

from greensward.cli.options import above_zero

LARGEST_SIDE = 4096
ENDINGS = (".png", ".tif", ".tiff")
EXAMPLES = """\b
Example:
  greensward stamp boots.png -o force.png --impact 24
"""


def _pressure(text: str) -> float:
    with contextlib.suppress(ValueError):
        if 0.0 <= (value := float(text)) <= 1.0:
            return value
    raise typer.BadParameter(f"must be a number from 0 to 1 (got {text})")


def stamp(
    outline: Annotated[
        Path, typer.Argument(metavar="OUTLINE", help="Image of what presses: dark on light, or opaque.")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="The force map: .png or .tif.")],
    impact: Annotated[
        Any,
        typer.Option(
            parser=above_zero(512, "pixels"),
            metavar="PIXELS",
            help="Width of the rim that is pushed aside.",
        ),
    ],
    pressure: Annotated[
        Any, typer.Option(parser=_pressure, metavar="0..1", help="1 presses flat, 0 not at all.")
    ] = "1",
) -> None:
    """Make a force map, for `[[force]]` with `kind = "map"`, from an outline."""
    from greensward.io.rasters import write_picture
    from greensward.motion.outlines import as_picture, forces_around, normals, read_outline, rim_of, signed_distance
    from greensward.scene.errors import InputError
    from greensward.scene.files import check_writable, is_there

    check_writable(output, ENDINGS)
    if is_there(outline) and outline.resolve() == output.resolve():
        raise InputError(f"{output}: would overwrite the outline; choose another name")
    pressed = read_outline(outline) > 0.5
    height, width = pressed.shape
    if max(height, width) > LARGEST_SIDE or min(height, width) < 2:
        raise InputError(f"{outline}: must be 2 to {LARGEST_SIDE} pixels a side (got {width}×{height})")
    distance = signed_distance(pressed, impact)
    write_picture(output, as_picture(pressure * forces_around(distance, normals(distance), rim_of(distance), impact)))
    print(f'{output}: {width}×{height}; name it as file of a [[force]] with kind = "map"')
