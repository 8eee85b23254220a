"""Processes in which cases run, watched: their time, their memory, and how they end."""

from __future__ import annotations

import faulthandler
import json
import os
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from fuzzing import commands, files, kills, scenes
from fuzzing.case import Case, Finding, cut, place_in

KINDS = {"scenes": scenes.run, "files": files.run, "commands": commands.run, "kills": kills.run}
MOST_BYTES = {"scenes": 4 << 30, "files": 2 << 30, "commands": 4 << 30, "kills": 4 << 30}
"""Memory that a case may take beside what its process had."""
LIMIT_S = 20.0
_PAGE = os.sysconf("SC_PAGE_SIZE")


def work(answers: int) -> None:
    """Run the cases that standard input names, one a line, and answer in lines of JSON."""
    # a shell starts what runs in the background with interrupts ignored, and so would be what is started here
    signal.signal(signal.SIGINT, signal.default_int_handler)
    faulthandler.enable(all_threads=False)
    faulthandler.register(signal.SIGUSR1, all_threads=False)
    with os.fdopen(answers, "w", buffering=1) as stream:

        def tell(answer: dict[str, Any]) -> None:
            stream.write(json.dumps(answer) + "\n")

        for line in sys.stdin:
            asked = json.loads(line)
            case = Case(asked["kind"], asked["number"], asked["seed"], Path(asked["folder"]), tell)
            os.chdir(case.folder)
            try:
                outcome, seen = KINDS[case.kind](case), None
            except Finding as finding:
                outcome, seen = "finding", str(finding)
            except BaseException as error:
                outcome = "finding"
                place = place_in(error) or cut(traceback.format_exc(limit=-3), 600)
                seen = f"{type(error).__name__}: {cut(str(error))} at {place}"
            tell({"outcome": outcome, "seen": seen})


class Worker:
    """A process that runs cases; a new one where it ended."""

    def __init__(self, script: Path) -> None:
        self._script = script
        self._process: subprocess.Popen[bytes] | None = None
        self._home = Path(tempfile.mkdtemp(prefix="greensward-fuzz-"))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end()
        shutil.rmtree(self._home, ignore_errors=True)

    def run(self, kind: str, number: int, seed: int, keep: Path | None = None) -> dict[str, Any]:
        """Run a case: its outcome, what was seen of a finding, its input and its seconds."""
        process = self._started()
        folder = keep or Path(tempfile.mkdtemp(dir=self._home, prefix="case-"))
        before, begin = _resident(process.pid), time.perf_counter()
        asked = {"kind": kind, "number": number, "seed": seed, "folder": str(folder)}
        assert process.stdin
        process.stdin.write(json.dumps(asked).encode() + b"\n")
        process.stdin.flush()
        answer = self._awaited(process, before, MOST_BYTES[kind])
        if answer.get("seen"):
            answer["seen"] = answer["seen"].replace(str(folder), "FOLDER")
        answer["input"] = [text.replace(str(folder), "FOLDER") for text in answer.get("input", [])]
        if not keep:
            shutil.rmtree(folder, ignore_errors=True)
        return answer | {"seconds": round(time.perf_counter() - begin, 2)}

    def _awaited(self, process: subprocess.Popen[bytes], before: int, most: int) -> dict[str, Any]:
        answer: dict[str, Any] = {}
        deadline = time.perf_counter() + LIMIT_S
        while True:
            ready, _, _ = select.select([self._answers], [], [], 0.05)
            if ready:
                line = self._answers.readline()
                if not line:
                    code = process.wait()
                    ended = f"signal {signal.Signals(-code).name}" if code < 0 else f"code {code}"
                    self._process = None
                    return answer | {"outcome": "finding", "seen": f"crash: {ended}: {self._last_words()}"}
                answer |= json.loads(line)
                if "limit_s" in answer:
                    deadline = time.perf_counter() + answer.pop("limit_s")
                if "outcome" in answer:
                    return answer
                continue
            taken = _resident(process.pid) - before
            late = time.perf_counter() > deadline
            if late or taken > most:
                process.send_signal(signal.SIGUSR1)
                time.sleep(0.5)
                self._end()
                what = "time" if late else f"memory ({taken >> 20:,} MiB)"
                return answer | {"outcome": "finding", "seen": f"too much {what}, in: {self._last_words()}"}

    def _last_words(self) -> str:
        """The lines of the program in the last trace of the stack, innermost first."""
        lines = (self._home / "err").read_text(errors="replace").splitlines()
        files = [line.strip().partition("/src/")[2] or line.strip() for line in lines if line.startswith("  File")]
        ours = [each for each in files if each.startswith("greensward/")]
        return " < ".join(ours[:4] or files[:6]) or " ".join(lines[-5:])

    def _started(self) -> subprocess.Popen[bytes]:
        if self._process and self._process.poll() is None:
            for name in ("out", "err"):
                os.truncate(self._home / name, 0)
            return self._process
        read, write = os.pipe()
        environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
        for name in ("DISPLAY", "WAYLAND_DISPLAY"):  # no window is to open
            environment.pop(name, None)
        with (self._home / "out").open("a+b") as out, (self._home / "err").open("a+b") as err:
            self._process = subprocess.Popen(
                [sys.executable, self._script, "--worker", str(write)],
                stdin=subprocess.PIPE,
                stdout=out,
                stderr=err,
                pass_fds=(write,),
                env=environment,
                start_new_session=True,
            )
        os.close(write)
        for name in ("out", "err"):
            os.truncate(self._home / name, 0)
        self._answers = os.fdopen(read, "rb", buffering=0)
        return self._process

    def _end(self) -> None:
        if self._process:
            os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
            self._process = None


def _resident(process: int) -> int:
    """Memory of a process in bytes; 0 where it has ended."""
    try:
        return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * _PAGE
    except (OSError, IndexError):
        return 0
