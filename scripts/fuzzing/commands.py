"""Options of the command line, missing, repeated, bad and combined."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

from PIL import Image

from fuzzing import schemas
from fuzzing.case import Case, Finding, cut, heard
from fuzzing.files import others
from fuzzing.scenes import furnish

SMALL = """title = "Small"
[sowing]
density_per_m2 = 20
reach_m = 30
[shadows]
size_px = 256
[[force]]
kind = "tracks"
path = [[0, 0], [2, 5]]
[simulation]
"""
_BASES: dict[str, list[list[str]]] = {
    "render": [["small.toml", "-o", "out/p.png", "--size", "32x18", "--samples", "1"]],
    "animate": [
        ["small.toml", "-o", output, "--size", "32x18", "--seconds", "0.1", "--fps", "20"]
        for output in ("out/f/%04d.png", "out/", "out/clip.gif", "out/clip.mp4")
    ],
    "view": [["small.toml"]],
    "scenes": [[]],
    "new": [["out/new"]],
    "check": [["small.toml"], ["meadow"]],
    "info": [[]],
    "stamp": [["picture.png", "-o", "out/force.png", "--impact", "4"]],
    "bench": [
        ["blade-count", "--scale", "toy", "--frames", "1", "--no-quality", "--json", "out/b.json"],
        ["--from", "bench.json"],
        ["--from", "bench.json", "--report", "out/r", "--json", "out/b.json"],
        ["--compare", "bench.json", "bench.json"],
        ["--list"],
    ],
    "study new": [["out/study"], ["out/study", "--like", "tillman2013-first"]],
    "study list": [[]],
    "study render": [["study"]],
    "study serve": [
        ["study", "--export-static", "out/site", "--endpoint", "https://x.org/a"]
    ],  # else it does not end
    "study import": [["study", "messages.jsonl"]],
    "study report": [["study", "-o", "out/report"]],
    "study export": [["study", "-o", "out/answers.csv"]],
}
STUDY = """title = "Small"
consent = "Yes."
[[picture]]
name = "p"
file = "../picture.png"
[[question]]
name = "q"
kind = "text"
text = "What?"
show = ["p"]
"""
_DEAR = {
    "--size",
    "--seconds",
    "--samples",
    "--scale",
    "--frames",
    "--no-quality",
    "--fps",
    "--list",
    "--from",
    "--compare",
}
"""Options without which a command takes long."""
_NUMBERS = (
    "0",
    "1",
    "2",
    "-1",
    "1.5",
    "nan",
    "inf",
    "-inf",
    "1e9",
    "1e10",
    "1e309",
    "",
    "x",
    "٣",
    "1_0",
    " 1",
    "0x1",
    "+1",
)
_INPUTS = (
    "missing",
    "folder",
    "fifo",
    "/dev/zero",
    "/dev/null",
    "loop.png",
    "picture.png",
    "empty.png",
    "",
    "x" * 5000,
)
_OUTPUTS = (
    *(
        "out/p.png",
        "out/p.jpg",
        "out/p.tif",
        "out/p.webp",
        "out/p",
        "out",
        "out/",
        "missing/p.png",
        "/dev/full",
        ".png",
    ),
    *(
        "out/x.gif",
        "out/x.mp4",
        "out/x.webm",
        "out/%d.png",
        "out/%d/%d.png",
        "out/####.png",
        "out/%d%d.png",
        "out/%99d.png",
    ),
    *(
        "small.toml",
        "picture.png",
        "fifo",
        "loop.png",
        "out/" + "x" * 300 + ".png",
        "",
        "-",
        "out/\x1b.png",
        "out/é.png",
    ),
    *(
        "out/p.npz",
        "out/p.json",
        "/proc/x.png",
        "out/../out/p.png",
        "out/p.PNG",
        "~/x.png",
        "/dev/null/p.png",
        "folder/p.png",
    ),
)
_VALUES: dict[str, tuple[str, ...]] = {
    "--size": (
        "32x18",
        "1x1",
        "2x2",
        "33x17",
        "0x0",
        "-1x5",
        "16385x1",
        "16384x1",
        "x",
        "32X18",
        "16×9",
        "32",
        "9999999999x1",
    ),
    "--samples": (*_NUMBERS[:7], "4097", "x"),
    "--seconds": ("0.05", "0.1", "0", "-1", "nan", "1e10", "1e9", "1e-9", "x"),
    "--fps": ("20", "0", "241", "nan", "0.5", "50", "51", "-1"),
    "--codec": ("h264", "h265", "av1", "vp9", "gif", "x", ""),
    "--set": (
        *(
            "sowing.density_per_m2=10",
            "wind.0.speed_mps=nan",
            "a=b",
            "=",
            "a",
            ".=1",
            "wind.9.x=1",
            "grass[0].share=0",
        ),
        *(
            "grass=[]",
            "seed=-1",
            "title=",
            "wind.0=5",
            "wind=1",
            "camera.position_m=[0,1",
            "wind.0.kind=wake",
            "=" * 100,
        ),
        *(
            "a." * 500 + "b=1",
            "x" * 100_000 + "=1",
            "wind.-1.speed_mps=1",
            "wind[99999999999999999999].x=1",
            "ground.kind=noise",
        ),
        *(
            "technique.name=bezier-blades",
            "sowing.stored_m=5",
            "post.blur=x",
            "object.0.kind=box",
            "é=1",
            "ground.file=fifo",
        ),
        *("ground.file=picture.png", "title=" + "[" * 5000, "seed=" + "9" * 5000),
    ),
    "--seed": (*_NUMBERS, "4294967295", "4294967296"),
    "--camera": (
        *(
            "0,1,5:0,0,0",
            "0,1,5:0,0,0:35",
            "0,1,5:0,1,5",
            "nan,0,0:0,0,0",
            "1e9,1,1:0,0,0",
            "0,1,5",
            "0,1,5:0,0,0:999",
            "",
        ),
        *("camera.toml", "walk.toml", "0,-5,0:0,0,0", "a,b,c:d,e,f", "1e308,0,0:0,0,0", "0,0,0:0,1,0", *_INPUTS),
    ),
    "--camera-path": ("walk.toml", "camera.toml", "small.toml", *_INPUTS),
    "--aov": ("depth", "depth,class", "all", "", ",", "depth,depth", "blade_id", "motion,normal,albedo", "x" * 500),
    "--device": ("cpu", "auto", "0", "9", "999", "-1", "x", "", "1000", "٣"),
    "--time": _NUMBERS,
    "--checkpoint": ("out/c.npz", "out/c.txt", "out", "missing/c.npz", "/dev/full", "out/p.png", "small.toml", ""),
    "--from": ("bench.json", "state.npz", "plain.npz", "small.toml", *_INPUTS),
    "--compare": ("bench.json", "small.toml", *_INPUTS),
    "--report": ("out/r", "small.toml", "/dev/null/x", "folder", "", "/proc/x", "missing/r"),
    "--protocol": ("quick", "thorough", ""),
    "--scale": ("toy", "tiny", ""),
    "--frames": ("1", "2", *_NUMBERS[3:9]),
    "--sizes": ("32x18", "32x18,16x9", "0x0", "x", "", ","),
    "--techniques": (
        "bezier-blades",
        "x",
        "",
        "bezier-blades[",
        "bezier-blades[x=1]",
        "visibility-buffer[storage=1],",
        ",",
    ),
    "--impact": (*_NUMBERS, "512", "513", "1e-300", "0.5"),
    "--pressure": (*_NUMBERS, "0.5", "1.0001"),
    "--technique": (*("bezier-blades", "visibility-buffer", "billboard-grid", "x", "", "Bezier-Blades"),),
    "--output": (*_OUTPUTS, "out/a.csv", "out/a.parquet"),
    "--json": _OUTPUTS,
    "--export-static": ("out/site", "out", "missing/a/b", "small.toml", "", "/proc/x", "/dev/null/x"),
    "--endpoint": ("https://x.org", "ftp://x", "", "https://", "https://x y", "http://[::1", "https://x.org/a?b#c"),
    "--like": ("tillman2013-second", "x", ""),
    "--database": ("postgresql://127.0.0.1:1/none", "sqlite:///x.db", "x", "", "mysql://u:p@h/d"),
}
_POSITIONS: dict[str, tuple[str, ...]] = {
    "new": (
        "out/new",
        "out",
        "small.toml",
        "missing/a/b",
        "",
        "/proc/x",
        "/dev/null/x",
        "x" * 300,
        "out/é",
        ".",
        "~nobody",
    ),
    **dict.fromkeys(
        ("study new", "study render", "study serve", "study import", "study report", "study export"),
        ("study", "study/study.toml", "tillman2013-first", "out/study", "tillman", *_INPUTS),
    ),
    "bench": ("blade-count", "x", "blade-count,blade-count", "Blade-Count", "blade-count,"),
    "stamp": ("picture.png", "rgba.png", "small.toml", *_INPUTS),
}
_SCENES = ("small.toml", "meadow", "meadw", "./meadow", "bench.json", "out", "football", *_INPUTS)


@cache
def commands() -> dict[str, Any]:
    """Commands by name, with their options, as the command line has them."""
    import typer

    from greensward.cli.app import app

    found = dict(typer.main.get_command(app).commands)  # type: ignore[attr-defined]
    parts = found.pop("study").commands
    return found | {f"study {name}": part for name, part in parts.items()}


def run(case: Case) -> str:
    """Run one command with odd options; it must leave as documented, with nothing half done."""
    furnish(case.folder)
    for name, content in {**others(), "small.toml": SMALL.encode()}.items():
        (case.folder / name).write_bytes(content)
    (case.folder / "out").mkdir()
    (case.folder / "study").mkdir()
    (case.folder / "study" / "study.toml").write_text(STUDY, encoding="utf-8")
    (case.folder / "messages.jsonl").write_text("{}\n", encoding="utf-8")
    arguments = [each.replace("\0", "") for each in _arguments(case)]  # no system hands that on
    case.note(" ".join(map(_shown, arguments)))
    case.limit(90)
    before = _listed(case.folder)
    if case.chance(0.05) and max(map(len, arguments), default=0) < 120_000:
        case.note("as a process")
        code, out, err = _as_process(arguments)
    else:
        code, out, err = _inside(arguments)
    after = _listed(case.folder)
    _judge(arguments, code, out, err)
    _judge_files(arguments, code, before, after)
    known = [name for name in commands() if name.split() == arguments[: len(name.split())]]
    return f"{known[0] if known else 'none'} {code}"


def _arguments(case: Case) -> list[str]:
    rng = case.rng
    if case.chance(0.02):
        return rng.choice(
            [[], ["--version"], ["--help"], ["x"], ["--x"], [""], ["render", "--help"], ["rendr", "meadow"]]
        )
    name = rng.choice(["render", "render", "animate", "animate", *commands()])
    found = list(rng.choice(_BASES[name]))
    for _ in range(rng.choice([0, 1, 1, 2, 3])):
        found = _changed(case, name, found)
    return [*name.split(), *found]


def _changed(case: Case, name: str, given: list[str]) -> list[str]:
    rng = case.rng
    action = rng.choice(["add", "add", "add", "replace", "replace", "drop", "position", "odd"])
    at = [k for k, each in enumerate(given) if each.startswith("-") and len(each) > 1]
    options = [each for each in commands()[name].params if each.param_type_name == "option"]
    if action == "add" and options:
        return given + list(_option(case, rng.choice(options)))
    if action == "replace" and at:
        k = rng.choice(at)
        key = {"-o": "--output"}.get(given[k], given[k])
        if k + 1 < len(given) and key in _VALUES:
            return [*given[: k + 1], rng.choice(_VALUES[key]), *given[k + 2 :]]
    if action == "drop" and given:
        k = rng.randrange(len(given))
        if not {given[k], given[k - 1]} & {*_DEAR, "bench.json"} and given[k] != "blade-count":
            return given[:k] + given[k + 1 :]
    if action == "position":
        values = _POSITIONS.get(name, _SCENES)
        if given and not given[0].startswith("-") and case.chance(0.7):
            return [rng.choice(values), *given[1:]]
        return [*given, rng.choice(values)]
    if action == "odd":
        return [
            *given,
            rng.choice(
                ["--x", "-x", "--", "--size", "-o", "--set", "--json=1", "--no-json", "-", rng.choice(schemas.TEXTS)]
            ),
        ]
    return given


def _option(case: Case, option: Any) -> Iterator[str]:
    key = max(option.opts, key=len)
    if option.is_flag:
        yield case.rng.choice([key, *option.secondary_opts])
        return
    for _ in range(case.rng.choice([1, 1, 1, 2])):
        values = [case.rng.choice(_VALUES.get(key, schemas.TEXTS)) for _ in range(option.nargs)]
        if case.chance(0.2) and len(values) == 1:
            yield f"{key}={values[0]}"
        else:
            yield from (key, *values)


def _shown(argument: str) -> str:
    return (
        cut(argument, 60) if argument.isprintable() and " " not in argument and argument else repr(cut(argument, 60))
    )


def _inside(arguments: list[str]) -> tuple[Any, str, str]:
    from greensward.cli import main

    code: Any = None
    with heard() as said:
        try:
            main(arguments)
        except SystemExit as left:
            code = left.code
    return 0 if code is None else code, said.out, said.err


def _as_process(arguments: list[str]) -> tuple[int, str, str]:
    ended = subprocess.run(
        [sys.executable, "-m", "greensward.cli", *arguments],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
    )
    return ended.returncode, ended.stdout, ended.stderr


def _listed(folder: Path) -> dict[str, tuple[int, int]]:
    """Every file below a folder, with its size and time of change."""
    found = {}
    for path in folder.rglob("*"):
        if not path.is_dir():
            state = path.lstat()
            found[str(path.relative_to(folder))] = state.st_size, state.st_mtime_ns
    return found


def _judge(arguments: list[str], code: Any, out: str, err: str) -> None:
    if code not in (0, 1, 2, 130):
        raise Finding(f"exit code {code}: {cut(err)}")
    if "Traceback" in out + err:
        raise Finding(f"a traceback: {cut(err, 900)}")
    if code and not err.strip() and "--json" not in arguments and arguments[:1] != ["info"]:
        raise Finding(f"exit code {code} without a word")
    for line in err.splitlines():
        if len(line) > 2000 + max(map(len, arguments), default=0):
            raise Finding(f"a line of {len(line):,} characters: {cut(line)}")
        for word in ("Errno", "object has no", "pydantic", "NoneType", "unexpected keyword"):
            if word in line:
                raise Finding(f"a library's words: {cut(line)}")
        if any(ord(sign) < 32 and sign != "\t" for sign in line):
            raise Finding(f"control characters on the terminal: {cut(line)!r}")


def _judge_files(
    arguments: list[str], code: int, before: dict[str, tuple[int, int]], after: dict[str, tuple[int, int]]
) -> None:
    made = sorted(after.keys() - before.keys())
    changed = sorted(name for name in before if before[name] != after.get(name))
    if hidden := [name for name in made if name.endswith(".part") or "/.new-" in name]:
        raise Finding(f"exit code {code} left {hidden[0]}")
    name = arguments[0] if arguments else ""
    if code:
        kept = name in ("animate", "bench") and code == 1
        if (made or changed) and not kept:
            raise Finding(f"exit code {code} made {made[:3]} and changed {changed[:3]}")
        return
    if {"--help", "-h", "--version"} & set(arguments):
        return
    wanted = {
        "render": {"-o", "--output"},
        "animate": {"-o", "--output", "--checkpoint"},
        "stamp": {"-o", "--output"},
    }
    given = dict(pairwise(arguments))
    for key in wanted.get(name, ()):
        output = given.get(key)
        if output and not output.startswith("/dev/") and not made and not changed:
            raise Finding(f"exit code 0, and {output} is not there")
    for file in {*made, *changed}:
        if file.lower().endswith((".png", ".jpg", ".tif", ".webp", ".gif")):
            with Image.open(file) as picture:
                picture.load()
    if name == "new" and not any(each.endswith("scene.toml") for each in made):
        raise Finding("exit code 0, and there is no scene.toml")
