"""The command line, one file per command. It imports what a command needs only once that command runs."""

import io
import sys
import warnings
from collections.abc import Sequence
from typing import Annotated

import typer

from greensward import __version__
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


def main(args: Sequence[str] | None = None) -> None:
    """Run the command line and leave: 0 done, 1 failed, 2 bad usage or bad input, 130 interrupted."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a terminal without our signs shows others, and we go on
            stream.reconfigure(errors="replace")
    warnings.formatwarning = lambda message, *_, **__: f"warning: {message}\n"
    try:
        app(args, prog_name="greensward")
    except KeyboardInterrupt:
        sys.exit(130)
    except OSError as error:  # what a command does not foresee: a full disk under its own output, say
        print(f"The system refused: {error}", file=sys.stderr)
        sys.exit(1)
    except MemoryError:
        print("There is not enough memory for this.", file=sys.stderr)
        sys.exit(1)
    except Exception as error:
        from greensward.scene.errors import GreenswardError

        if not isinstance(error, GreenswardError):
            raise
        print(error, file=sys.stderr)
        sys.exit(error.exit_code)
