"""One case: its randomness, its folder, and what may be said of it."""

from __future__ import annotations

import os
import random
import re
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

LONGEST = 600
_BLAMES_A_LIBRARY = ("Traceback", "pydantic", "Input should", "Value error", "Errno", "object has no attribute")


class Finding(Exception):  # noqa: N818  # of the fuzzer, which is no error
    """What the program did and must not do."""


@dataclass
class Said:
    """What was written to standard output and to standard error."""

    out: str = ""
    err: str = ""


@dataclass
class Case:
    """A case, which depends on the seed, the kind and the number alone."""

    kind: str
    number: int
    seed: int
    folder: Path
    """Empty at first; the input goes here."""
    tell: Callable[[dict[str, Any]], None]
    """Hands something to the process that waits: `input`, `limit_s`."""
    rng: random.Random = field(init=False)
    notes: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.rng = random.Random(f"{self.seed} {self.kind} {self.number}")

    def note(self, text: str) -> None:
        """Say how the input is made."""
        self.notes.append(text)
        self.tell({"input": [cut(each) for each in self.notes]})

    def chance(self, probability: float) -> bool:
        """Draw a yes or no."""
        return self.rng.random() < probability

    def limit(self, seconds: float) -> None:
        """Let what follows take so long."""
        self.tell({"limit_s": seconds})


def cut(text: str, most: int = 240) -> str:
    """A text, shortened in its middle."""
    return text if len(text) <= most else f"{text[: most // 2]} … {text[-most // 2 :]} ({len(text):,} characters)"


@contextmanager
def heard() -> Iterator[Said]:
    """What is written inside, also by libraries of other languages; standard streams are files in a worker."""
    said = Said()
    before = _sizes()
    try:
        yield said
    finally:
        after = _sizes()
        texts = [
            os.pread(fd, end - start, start).decode(errors="replace")
            for fd, start, end in zip((1, 2), before, after, strict=True)
        ]
        said.out, said.err = texts


def _sizes() -> list[int]:
    sys.stdout.flush()
    sys.stderr.flush()
    return [os.fstat(fd).st_size for fd in (1, 2)]


@contextmanager
def quiet() -> Iterator[None]:
    """Anything that a library writes or warns of inside is a finding; the program's own warnings are not."""
    with warnings.catch_warnings(record=True) as doubts, heard() as said:
        warnings.simplefilter("always")
        yield
    for each in doubts:
        if each.category is not UserWarning or ": " not in str(each.message):
            raise Finding(f"a library's warning: {each.category.__name__}: {each.message} ({each.filename})")
    if said.out or said.err:
        raise Finding(f"written to the terminal: {cut(said.out + said.err)}")


def check_sentence(text: str, names: tuple[str, ...]) -> None:
    """Raise `Finding` unless a problem is one sentence of a bounded length that begins with one of these names."""
    name = next((each for each in names if text.startswith(each)), None)
    if name is None:
        raise Finding(f"a problem without its place: {cut(text)}")
    rule = text[len(name) :].replace("machine.libraries.pydantic: ", "")
    if len(rule) > LONGEST:
        raise Finding(f"a problem of {len(text):,} characters: {cut(text)}")
    if "\n" in rule or not rule.strip(" :"):
        raise Finding(f"a problem that is no sentence: {cut(text)!r}")
    if not all(character.isprintable() for character in rule):
        raise Finding(f"a problem with control characters: {cut(text)!r}")
    if word := next((word for word in _BLAMES_A_LIBRARY if word in rule), None):
        raise Finding(f"a problem in a library's words ({word}): {cut(text)}")


def place_in(error: BaseException) -> str:
    """The last place of the program's own that an exception came through."""
    found = ""
    trace = error.__traceback__
    while trace:
        file = trace.tb_frame.f_code.co_filename
        if match := re.search(r"greensward/(?!cli/__init__).*", file):
            found = f"{match[0]}:{trace.tb_lineno}"
        trace = trace.tb_next
    return found


def clocked(since: float) -> str:
    """Seconds since, as words."""
    return f"{time.perf_counter() - since:.1f} s"
