"""Signals that end a program wait where they must, are never lost, and leave an exit code that tells of them."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from greensward.interrupts import handled, held_back, raised_again

_ENDED_BY = """
import signal, sys
import greensward.cli.app
from greensward import cli
def end(args, prog_name):
    try:
        signal.raise_signal(getattr(signal, sys.argv[1]))
        print("went on")
    finally:
        print("put away")
greensward.cli.app.app = end
cli.main([])
"""


def test_an_interrupt_waits_until_the_block_ends():
    done = []

    def interrupted() -> None:
        with held_back():
            with held_back():
                signal.raise_signal(signal.SIGINT)
                done.append("inner")
            done.append("outer")

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert done == ["inner", "outer"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_an_ignored_signal_stays_ignored():
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        with handled(lambda *_: pytest.fail("it was to be ignored")):
            signal.raise_signal(signal.SIGTERM)
    finally:
        signal.signal(signal.SIGTERM, before)


def test_other_threads_handle_none():
    found = []

    def run() -> None:
        with held_back():
            found.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert found == [signal.default_int_handler]


class _Interrupted:
    def __del__(self) -> None:
        raise KeyboardInterrupt


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="this system has no timers of signals")
def test_an_interrupt_where_none_can_be_raised_is_raised_again():
    def interrupted() -> None:
        with raised_again():
            _Interrupted()
            for _ in range(500):
                time.sleep(0.01)

    with pytest.raises(KeyboardInterrupt):
        interrupted()


@pytest.mark.skipif(sys.platform == "win32", reason="signals are those of POSIX")
@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", -15), ("SIGHUP", -1)])
def test_a_command_that_a_signal_ends_puts_away_and_says_so_by_its_code(name, code):
    ended = subprocess.run(
        [sys.executable, "-c", _ENDED_BY, name],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (ended.returncode, ended.stdout, ended.stderr) == (code, "put away\n", "")
