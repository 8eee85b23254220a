"""Signals that end a program: Ctrl+C, termination, and a terminal that closes."""

from __future__ import annotations

import contextlib
import signal
import sys
import threading

TYPE_CHECKING = False
if TYPE_CHECKING:  # without these imports, the command line handles signals sooner
    from collections.abc import Callable, Iterator
    from types import FrameType
    from typing import Any

ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


@contextlib.contextmanager
def handled(handler: Callable[[int, FrameType | None], object]) -> Iterator[None]:
    """Handle them inside, but those that are ignored; outside the main thread, none is."""
    before: dict[int, Any] = {}
    try:
        if threading.current_thread() is threading.main_thread():
            for number in ENDING:
                # None is a handler that Python did not set and cannot put back
                if (kept := signal.getsignal(number)) not in (signal.SIG_IGN, None):
                    before[number] = kept
                    signal.signal(number, handler)
        yield
    finally:
        for number, kept in before.items():
            signal.signal(number, kept)


@contextlib.contextmanager
def held_back() -> Iterator[None]:
    """Let them wait until the end of the block, in the main thread."""
    waiting: list[int] = []
    with handled(lambda number, _: waiting.append(number)):
        yield
    for number in waiting[:1]:
        signal.raise_signal(number)


@contextlib.contextmanager
def raised_again() -> Iterator[None]:
    """Raise a `KeyboardInterrupt` again that was raised where none can be, in the callback of a library, say."""
    before = sys.unraisablehook
    if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        yield
        return

    def later(unraisable: Any) -> None:
        if issubclass(unraisable.exc_type, KeyboardInterrupt):
            signal.setitimer(signal.ITIMER_REAL, 0.01)
        else:
            before(unraisable)

    alarm = signal.signal(signal.SIGALRM, lambda *_: signal.raise_signal(signal.SIGINT))
    sys.unraisablehook = later
    try:
        yield
    finally:
        sys.unraisablehook = before
        signal.signal(signal.SIGALRM, alarm)
