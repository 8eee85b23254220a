"""Runs of the command that signals end at random moments."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import zipfile
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from PIL import Image

from fuzzing.case import Case, Finding, cut
from fuzzing.commands import SMALL
from fuzzing.files import others
from fuzzing.scenes import furnish

_SMALL = ("--size", "96x54", "--device", "auto")
_CLIP = ("animate", "small.toml", *_SMALL, "--seconds", "0.4")
_COMMANDS: dict[str, tuple[str, ...]] = {
    "render": ("render", "small.toml", "-o", "out/p.png", *_SMALL, "--samples", "4", "--aov", "depth,blade_id"),
    "sequence": (*_CLIP, "-o", "out/f/%04d.png"),
    "checkpoint": (*_CLIP, "-o", "out/%02d.png", "--checkpoint", "out/c.npz"),
    "video": (*_CLIP, "-o", "out/clip.mp4"),
    "gif": (*_CLIP, "-o", "out/clip.gif"),
    "bench": ("bench", "blade-count", "--scale", "toy", "--frames", "1", "--no-quality", "--json", "out/b.json"),
    "report": ("bench", "--from", "bench.json", "--report", "out/r", "--json", "out/b.json"),
    "check": ("check", "small.toml"),
    "stamp": ("stamp", "picture.png", "-o", "out/force.png", "--impact", "4"),
    "new": ("new", "out/new"),
}
_SIGNALS = (signal.SIGINT, signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
_WAIT_S = 60.0
_lengths: dict[tuple[str, bool], tuple[float, dict[str, str]]] = {}


@cache
def _known() -> list[str]:
    has_video = find_spec("imageio_ffmpeg") is not None
    return [name for name in _COMMANDS if has_video or name not in ("video", "gif")]


def run(case: Case) -> str:
    """End one run at a random moment, and judge what it says and leaves; then the same command must succeed."""
    rng = case.rng
    name = rng.choice([*_known(), "render", "sequence", "video" if "video" in _known() else "sequence"])
    cold, ending = case.chance(0.3), rng.choice(_SIGNALS)
    part = rng.uniform(*(0.8, 1.05) if case.chance(0.3) else (0.0, 1.0))  # files are written at the end
    twice = ending == signal.SIGINT and case.chance(0.2)
    case.note(f"{name}{' without compiled programs' * cold}: {signal.Signals(ending).name}{' twice' * twice}")
    case.limit(400)
    length_s, sound = _length(case, name, cold)
    case.note(f"after {part * length_s:.2f} of {length_s:.2f} s: {' '.join(_COMMANDS[name])}")
    folder = _prepared(case.folder / "run")
    process = _started(folder, name, cold)
    time.sleep(part * length_s)
    process.send_signal(ending)
    if twice:
        time.sleep(0.05)
        process.send_signal(ending)
    try:
        _, said = process.communicate(timeout=_WAIT_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        raise Finding(f"goes on for {_WAIT_S:g} s after the signal") from None
    _judge(ending, process.returncode, said.decode(errors="replace"))
    _judge_files(folder, ending, sound)
    if process.returncode and name not in ("check", "new"):
        _judge_again(folder, name, sound)
    return f"{signal.Signals(ending).name} {process.returncode}"


def _prepared(folder: Path) -> Path:
    folder.mkdir()
    furnish(folder)
    for name, content in {**others(), "small.toml": SMALL.encode()}.items():
        (folder / name).write_bytes(content)
    (folder / "out").mkdir()
    return folder


def _started(folder: Path, name: str, cold: bool) -> subprocess.Popen[bytes]:
    environment = {**os.environ, "PYTHONFAULTHANDLER": "1"}
    if cold:
        environment["GREENSWARD_PROGRAM_CACHE"] = str(folder / "programs")
    return subprocess.Popen(
        [sys.executable, "-m", "greensward.cli", *_COMMANDS[name]],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )


def _length(case: Case, name: str, cold: bool) -> tuple[float, dict[str, str]]:
    """Seconds of a run that nothing ends, and the digests of its files."""
    if (name, cold) not in _lengths:
        if not cold:
            _ended(_prepared(case.folder / "warm"), name, cold)  # compiles what is missing
        folder, begin = _prepared(case.folder / "sound"), time.perf_counter()
        _ended(folder, name, cold)
        _lengths[name, cold] = time.perf_counter() - begin, _digests(folder / "out")
        shutil.rmtree(folder)
    return _lengths[name, cold]


def _ended(folder: Path, name: str, cold: bool) -> None:
    process = _started(folder, name, cold)
    _, said = process.communicate()
    if process.returncode:
        raise Finding(
            f"exit code {process.returncode}, though nothing ended it: {cut(said.decode(errors='replace'))}"
        )


def _digests(folder: Path) -> dict[str, str]:
    """Digests of files by their names; of those whose bytes tell the time, only that they are there."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        if path.suffix in (".png", ".toml")
        else ""
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def _judge(ending: int, code: int, said: str) -> None:
    if code in (-signal.SIGSEGV, -signal.SIGABRT, -signal.SIGBUS, -signal.SIGILL) or "Fatal Python error" in said:
        raise Finding(f"crash: code {code}: {cut(said, 1200)}")
    if re.search(r'greensward/[^"]*", line \d+, in (?!<module>)', said):  # before `main` runs, Python says its own
        raise Finding(f"code {code}, a traceback: {cut(said, 1200)}")
    allowed = {
        signal.SIGINT: {0, 130, -signal.SIGINT} | ({1} if "Traceback" in said else set()),
        signal.SIGTERM: {0, 130, 143, -signal.SIGTERM},
        signal.SIGKILL: {0, -signal.SIGKILL},
    }[signal.Signals(ending)]
    if code not in allowed:
        raise Finding(f"code {code}: {cut(said, 600)}")
    if code == 130 and len(said.strip().splitlines()) > 1:
        raise Finding(f"more than a sentence: {cut(said, 600)}")


def _judge_files(folder: Path, ending: int, sound: dict[str, str]) -> None:
    if ending != signal.SIGKILL:
        deadline = time.perf_counter() + 5.0
        while orphans := _others_of(folder):
            if time.perf_counter() > deadline:
                raise Finding(f"processes go on: {orphans[0]}")
            time.sleep(0.1)
    for path in sorted((folder / "out").rglob("*")):
        name = str(path.relative_to(folder / "out"))
        if path.is_dir():
            continue
        if path.name.endswith(".part") or path.name.startswith(".new-"):
            if ending != signal.SIGKILL:
                raise Finding(f"left {name}")
            continue
        if name not in sound and not path.name.startswith(".greensward-"):
            raise Finding(f"left {name}, which no sound run makes")
        _judge_whole(path)
    programs = folder / "programs"
    if ending != signal.SIGKILL and programs.is_dir() and any(programs.rglob(".new-*")):
        raise Finding("left .new-* among the compiled programs")


def _others_of(folder: Path) -> list[str]:
    """Command lines of processes that write into a folder."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdecimal():
            try:
                line = (entry / "cmdline").read_bytes()
                at = (entry / "cwd").readlink()
            except OSError:
                continue
            if line and at == folder:
                found.append(line.replace(b"\0", b" ").decode(errors="replace")[:100])
    return found


def _judge_whole(path: Path) -> None:
    """Raise `Finding` for half a file."""
    try:
        if path.suffix in (".png", ".gif"):
            with Image.open(path) as picture:
                picture.load()
        elif path.suffix == ".npz":
            with zipfile.ZipFile(path) as archive:
                if archive.testzip() is not None:
                    raise ValueError("damaged")
        elif path.suffix == ".mp4" and b"moov" not in path.read_bytes():
            raise ValueError("no moov")
        elif path.suffix in (".json", ".toml", ".md", ".html") and not path.read_bytes().strip():
            raise ValueError("empty")
    except Exception as error:
        raise Finding(f"half a file: {path.name}: {error}") from None


def _judge_again(folder: Path, name: str, sound: dict[str, str]) -> None:
    try:
        _ended(folder, name, cold=False)
    except Finding as finding:
        raise Finding(f"the same command again: {finding}") from None
    found = {each: digest for each, digest in _digests(folder / "out").items() if not each.endswith(".part")}
    if lacking := sorted(sound.keys() - found.keys()):
        raise Finding(f"the same command again does not make {lacking[0]}")
    if differs := [each for each in sound if found[each] != sound[each]]:
        raise Finding(f"the same command again makes another {differs[0]} ({len(differs)} of {len(sound)} files)")
