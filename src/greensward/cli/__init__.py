"""The command line: `main` runs one of the commands of `cli.app` and leaves with its exit code."""

import contextlib
import io
import os
import signal
import sys
import warnings
from collections.abc import Sequence

from greensward.interrupts import handled, raised_again


def main(args: Sequence[str] | None = None) -> None:
    """Run the command line and leave: 0 done, 1 failed, 2 bad usage or bad input, 130 interrupted.

    Where SIGTERM or SIGHUP ends it, all is put away first, and it leaves as that signal does.
    """
    received: list[int] = []

    def interrupt(number: int, _: object) -> None:
        received.append(number)
        raise KeyboardInterrupt

    try:
        with handled(interrupt), raised_again():
            code = _run(args)
    except KeyboardInterrupt:
        code = 130
    except Exception:
        if not received:
            raise
        code = 130  # what a library made of the interrupt
    if not received:
        sys.exit(code)
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            stream.flush()
    if received[0] != signal.SIGINT:
        signal.signal(received[0], signal.SIG_DFL)
        signal.raise_signal(received[0])
    # the end of an interpreter whose drivers and libraries are half done may crash
    os._exit(130)


def _run(args: Sequence[str] | None) -> int:
    """Run a command; its exit code."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a terminal without our signs shows others, and we go on
            stream.reconfigure(errors="replace")
    warnings.formatwarning = lambda message, *_, **__: f"warning: {message}\n"
    from greensward.cli.app import app

    try:
        app(args, prog_name="greensward")
    except SystemExit as left:
        return left.code if isinstance(left.code, int) else 0
    except OSError as error:  # what a command does not foresee: a full disk under its own output, say
        print(f"The system refused: {error}", file=sys.stderr)
        return 1
    except MemoryError:
        print("There is not enough memory for this.", file=sys.stderr)
        return 1
    except Exception as error:
        from greensward.scene.errors import GreenswardError

        if not isinstance(error, GreenswardError):
            raise
        print(error, file=sys.stderr)
        return error.exit_code
    return 0
