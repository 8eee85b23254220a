"""`greensward new`."""

import contextlib
from importlib.resources import files
from pathlib import Path
from typing import Annotated

import typer

EXAMPLES = """\b
Example:
  greensward new hill
"""


def new(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A folder that is new or empty.")],
) -> None:
    """Make a folder with a commented scene file to start from."""
    scene = write_into_new(folder, "scene.toml", (files("greensward.scene") / "template.toml").read_bytes())
    print(f"Wrote {scene}. Change it, then: greensward render {scene} -o {folder.name or 'scene'}.png")


def write_into_new(folder: Path, name: str, content: bytes) -> Path:
    """Write a file into a folder that is new or empty; returns its path. Raises `InputError`."""
    from greensward.scene.errors import GreenswardError, InputError
    from greensward.scene.files import check_new_folder, written_aside

    file = folder / name
    try:
        check_new_folder(folder)
        made = not folder.exists()
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise InputError(f"{folder}: cannot be made: {getattr(error, 'strerror', None) or error}") from None
    try:
        with written_aside(file) as stream:
            stream.write(content)
    except GreenswardError:
        if made:
            with contextlib.suppress(OSError):
                folder.rmdir()
        raise
    return file
