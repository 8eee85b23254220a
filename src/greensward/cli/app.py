"""The commands, one file each. A command imports what it needs only once it runs."""

import sys
from typing import Annotated

import typer

from greensward import __version__
from greensward.cli import study
from greensward.cli.animate import animate
from greensward.cli.bench import bench
from greensward.cli.check import check
from greensward.cli.info import info
from greensward.cli.new import new
from greensward.cli.render import render
from greensward.cli.scenes import scenes
from greensward.cli.stamp import stamp
from greensward.cli.view import view

EXAMPLES = """\b
Examples:
  greensward render meadow -o meadow.png
  greensward view
  greensward new hill && greensward render hill/scene.toml -o hill.png
  greensward info
"""

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=EXAMPLES,
)
for command in (render, animate, view, scenes, new, check, info, stamp, bench):
    app.command(epilog=getattr(sys.modules[command.__module__], "EXAMPLES", None))(command)
app.add_typer(study.app, name="study", help="Ask people how grass looks.", epilog=study.EXAMPLES)


def _version(wanted: bool) -> None:
    if wanted:
        print(f"greensward {__version__}")
        raise typer.Exit


@app.callback()
def _greensward(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and leave.")
    ] = False,
) -> None:
    """Draw living grass: millions of blades, each swaying on its own."""
