#!/usr/bin/env python3
"""Plant faults into the techniques of three papers one at a time, and say which tests notice.

    PYTHONPATH=src .venv/bin/python scripts/mutate.py --list
    PYTHONPATH=src .venv/bin/python scripts/mutate.py -j 2 -o tests/faults.json [--only PATTERN] [--again]

A rule chooses the faults: in each function that a source is cited for, one of each of two kinds of change; the
channels of each picture that is read; each setting ignored; a number of each line of the benchmark's workloads. Each
runs in a copy of the tree, first the tests that belong to its file, and where these pass the wider list. Results are
kept as JSON: the fault, and the first test that failed, or a reason why none does. A fault that is in the file
already is not run again unless asked.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue

ROOT = Path(__file__).resolve().parents[1]
SOURCE = "src/greensward/"
SUFFIXES = {".glsl", ".comp", ".vert", ".frag", ".tesc", ".tese", ".geom"}
EACH_FUNCTION = 2
LIMIT_S = 900

_QUADS = (
    "tests/techniques/test_drawn_quads.py",
    "tests/techniques/test_tessellated_quads.py",
    "tests/techniques/test_contract.py::test_what_culling_leaves_out_does_not_show",
    "tests/test_precision.py::test_at_a_border_the_picture_is_the_same_from_either_anchor",
)
_GRID = (
    "tests/techniques/test_billboard_grid.py",
    "tests/techniques/test_contract.py::test_grass_casts_shadows",
    "tests/motion/test_force_map.py::test_pressed_grass_is_low_in_the_picture",
    "tests/techniques/test_identity.py",
)
_BLADES = ("tests/techniques/test_blade_shapes.py", "tests/techniques/test_visibility_buffer.py")
_EVERY_SETTING = "tests/techniques/test_contract.py::test_every_setting_changes_the_picture"
_KEYS = "tests/scene/test_keys_show.py"
_MOTION = ("tests/motion/test_papers_forms.py", "tests/motion", "tests/test_update.py")
_PASSES = "tests/passes/test_pictures_of_passes.py"
_LOOK = "tests/test_pictures.py"
_TERRAIN = (_PASSES, _LOOK, "tests/passes/test_terrain.py", "tests/ground")
TESTS: dict[str, tuple[str, ...]] = {
    "techniques/tessellated_quads/settings.py": (f"{_EVERY_SETTING}[tessellated-quads]", *_QUADS),
    "techniques/billboard_grid/settings.py": (f"{_EVERY_SETTING}[billboard-grid]", *_GRID),
    "techniques/blades/leaf.py": (_EVERY_SETTING, *_BLADES),
    "techniques/tessellated_quads/": _QUADS,
    "techniques/billboard_grid/": _GRID,
    "techniques/bezier_blades/": (*_BLADES, "tests/techniques/test_contract.py"),
    "techniques/blades/": (*_BLADES, *_QUADS, "tests/techniques/test_contract.py"),
    "motion/": _MOTION,
    "culling/": ("tests/culling",),
    "shaders/bezier.glsl": ("tests/shaders", *_BLADES, "tests/motion"),
    "passes/blur/": ("tests/passes/test_blur.py",),
    "passes/water/": ("tests/passes/test_water.py", _PASSES, _LOOK),
    "passes/flowers/": ("tests/passes/test_flowers.py",),
    "passes/terrain/": _TERRAIN,
    "passes/lighting/lighting.glsl": ("tests/passes/test_light_functions.py", _LOOK, "tests/passes"),
    "sowing/": (_LOOK, "tests/sowing"),
    "ground/": _TERRAIN,
    "bench/workloads.py": ("tests/bench/test_workloads.py",),
    "scene/wind.py": (_KEYS, "tests/motion/test_winds.py", "tests/motion/test_papers_forms.py", "tests/motion"),
    "scene/force.py": (_KEYS, "tests/motion/test_force_map.py", "tests/motion"),
    "scene/field.py": (_KEYS, "tests/sowing", "tests/culling", "tests/techniques/test_far_level.py", _PASSES),
    "scene/light.py": (_KEYS, "tests/passes"),
}
"""Tests that belong to a file, by the beginning of its path below the package. Only these files are given faults."""

WIDE = (
    "tests/techniques",
    "tests/motion",
    "tests/sowing",
    "tests/culling",
    "tests/passes",
    "tests/test_renderer.py",
    "tests/test_pictures.py",
    "tests/test_presets.py",
    "tests/test_queries.py",
)

SETTINGS = {
    "techniques/tessellated_quads/settings.py": ("Patch", "QuadSettings"),
    "techniques/billboard_grid/settings.py": ("GridSettings",),
    "techniques/blades/leaf.py": ("ThinSettings",),
    "scene/field.py": None,
    "scene/wind.py": None,
    "scene/force.py": None,
    "scene/light.py": ("Post",),
}
"""Classes whose keys are ignored one at a time; None for all of a file."""

_CITES = re.compile(
    r"[Ee]quations? \d|[Ss]ections? \d|[Ff]igure \d|Table \d|Listing \d|(?:&|[A-Z][a-z]+) \w*,? ?(?:19|20)\d\d"
    r"|Derstroff|Jahrmann|Habel|Yan, Wu"
)
_BEGINS = re.compile(r"^(?:layout.*\)\s*)?[A-Za-z_]\w* (\w+)\([^;]*\) \{")
_NUMBER = re.compile(r"(?<![\w.])\d+\.\d+(?![\w.])")
_SWIZZLES = {"x": "z", "y": "x", "z": "y", "r": "g", "g": "b", "b": "r", "a": "r", "w": "x"}


@dataclass(frozen=True, order=True)
class Fault:
    """One change of one line of a file."""

    kind: str
    path: str
    """Below the package."""
    where: str
    """Function, class or table."""
    line: int
    before: str
    after: str

    @property
    def name(self) -> str:
        """Name that stays the same while lines move."""
        if self.kind == "setting":
            return f"{self.path}: {self.where}: ignored"
        return f"{self.path}: {self.where}: {self.before.strip()} -> {self.after.strip()}"


def _chosen(options: list[str], *key: object) -> int:
    digest = hashlib.sha256(repr(key).encode()).digest()
    return int.from_bytes(digest[:4], "big") % len(options)


def _replaced(text: str, pattern: str, by: str) -> Iterator[str]:
    for found in re.finditer(pattern, text):
        yield text[: found.start()] + found.expand(by) + text[found.end() :]


def _arguments_exchanged(text: str) -> Iterator[str]:
    """First two arguments of mix, smoothstep and step; those of clamp may be exchanged."""
    for found in re.finditer(r"\b(?:mix|smoothstep|step)\(", text):
        commas, depth = [], 1
        for at in range(found.end(), len(text)):
            depth += {"(": 1, ")": -1}.get(text[at], 0)
            if depth == 1 and text[at] == ",":
                commas.append(at)
            if depth == 0:
                first, second = text[found.end() : commas[0]], text[commas[0] + 1 : (*commas, at)[1]]
                rest = text[(*commas, at)[1] :]
                yield f"{text[: found.end()]}{second.strip()}, {first.strip()}{rest}"
                break


def _is_bound(text: str, end: int) -> bool:
    """Return whether a number that ends there is the last or the only argument of clamp, min or max."""
    depth = 0
    if not re.match(r"\s*\)", text[end:]):
        return False
    for at in range(end - 1, -1, -1):
        depth += {")": 1, "(": -1}.get(text[at], 0)
        if depth < 0:
            return bool(re.search(r"\b(?:clamp|min|max)$", text[:at]))
    return False


def _changes(text: str) -> dict[str, list[str]]:
    """Changed lines, by kind of change."""
    found = {
        "sign": [*_replaced(text, r" \+ ", " - "), *_replaced(text, r"(?<=\w|\)) - ", " + ")],
        "sign of a term": [*_replaced(text, r"(?<=[(=,] )-(?=\w)|(?<=\()-(?=\w)|(?<=return )-(?=\w)", "")],
        "factor": [*_replaced(text, r" \* ", " / "), *_replaced(text, r" / ", " * ")],
        "constant": [
            text[: n.start()]
            + f"{1.5 * float(n[0]):g}".rstrip(".")
            + (".0" if (1.5 * float(n[0])).is_integer() else "")
            + text[n.end() :]
            for n in _NUMBER.finditer(text)
            # a bound beyond which nothing lies may be anywhere
            if float(n[0]) > 1e-5 and not _is_bound(text, n.end())
        ],
        "axis": [
            *_replaced(text, r"\.x\b", ".z"),
            *_replaced(text, r"\.z\b", ".x"),
            *_replaced(text, r"\.xz\b", ".zx"),
            *_replaced(text, r"\.y\b", ".x"),
        ],
        "extreme": [*_replaced(text, r"\bmin\(", "max("), *_replaced(text, r"\bmax\(", "min(")],
        "comparison": [*_replaced(text, r" < ", " >= "), *_replaced(text, r" > ", " <= ")],
        "ends": [*_arguments_exchanged(text)],
        "function": [*_replaced(text, r"\bsin\(", "cos("), *_replaced(text, r"\bcos\(", "sin(")],
        "dropped": [re.sub(r"\S.*;", ";", text)] if re.match(r"\s+[\w.\[\]]+ [-+*/]= .*;\s*$", text) else [],
    }
    return {kind: changed for kind, changed in found.items() if changed}


def _functions(lines: list[str]) -> Iterator[tuple[str, range, bool]]:
    """Name, lines and whether a source is cited, above it or within."""
    header = []
    for text in lines:
        if not text.startswith(("//", "#")):
            break
        header.append(text)
    whole = bool(_CITES.search(" ".join(header)))
    at = 0
    while at < len(lines):
        begins = _BEGINS.match(lines[at])
        if not begins:
            at += 1
            continue
        one_line = _code(lines[at]).endswith("}")
        end = at if one_line else next(k for k in range(at, len(lines)) if lines[k].startswith("}"))
        above = at
        while above > 0 and lines[above - 1].startswith("//"):
            above -= 1
        cited = whole or bool(_CITES.search(" ".join(lines[above : end + 1])))
        yield begins[1], range(at, end + 1), cited
        at = end + 1


def _code(text: str) -> str:
    return text.split("//")[0].rstrip()


def _formulas(path: str, lines: list[str]) -> Iterator[Fault]:
    for name, span, cited in _functions(lines):
        if not cited:
            continue
        by_kind: dict[str, list[tuple[int, str]]] = {}
        for k in span:
            if "#" in lines[k]:
                continue
            code = _code(lines[k])
            head = code.find("{") + 1 if k == span[0] else 0
            for kind, changed in _changes(code[head:]).items():
                by_kind.setdefault(kind, []).extend((k, code[:head] + each) for each in changed)
        kinds = sorted(by_kind, key=lambda kind: hashlib.sha256(f"{path} {name} {kind}".encode()).digest())
        for kind in kinds[:EACH_FUNCTION]:
            options = by_kind[kind]
            k, after = options[_chosen([each for _, each in options], path, name, kind)]
            yield Fault("formula", path, name, k, lines[k], after)


def _channels(path: str, lines: list[str]) -> Iterator[Fault]:
    """A picture's channel read as the next."""
    for name, span, _ in _functions(lines):
        for k in span:
            code = _code(lines[k])
            for found in re.finditer(r"(?:texture\w*|texelFetch|imageLoad)\([^;]*?\)\.([rgbaxyzw]+)\b", code):
                swapped = _SWIZZLES[found[1]] if len(found[1]) == 1 else found[1][::-1]
                yield Fault(
                    "channel", path, name, k, lines[k], code[: found.start(1)] + swapped + code[found.end(1) :]
                )


def _settings(path: str, text: str, classes: tuple[str, ...] | None) -> Iterator[Fault]:
    """A key that is read and then has its default."""
    lines = text.splitlines()
    for node in ast.parse(text).body:
        if not isinstance(node, ast.ClassDef) or (classes and node.name not in classes):
            continue
        fields = [each for each in node.body if isinstance(each, ast.AnnAssign) and isinstance(each.target, ast.Name)]
        for each in fields:
            assert isinstance(each.target, ast.Name)
            key = each.target.id
            if key.startswith("_") or key in ("kind", "name") or each.value is None:
                continue
            first = fields[0].lineno - 1
            default = f"type(self).model_fields[{key!r}].get_default(call_default_factory=True)"
            planted = f"    def model_post_init(self, _): object.__setattr__(self, {key!r}, {default})"
            yield Fault("setting", path, f"{node.name}.{key}", first, lines[first], f"{planted}\n\n{lines[first]}")


def _workloads(path: str, text: str) -> Iterator[Fault]:
    """A number of each line that has one, half as large again."""
    lines = text.splitlines()
    for node in ast.parse(text).body:
        name = getattr(node, "name", None) or (
            ast.unparse(node).split(" ")[0] if isinstance(node, ast.Assign | ast.AnnAssign) else None
        )
        if name is None or name.startswith(("toy", "TOY", "CPU", "GPU")) or isinstance(node, ast.ClassDef):
            continue
        by_line: dict[int, list[ast.Constant]] = {}
        for each in ast.walk(node):
            if isinstance(each, ast.Constant) and type(each.value) in (int, float) and each.value:
                by_line.setdefault(each.lineno - 1, []).append(each)
        for k, numbers in sorted(by_line.items()):
            each = numbers[_chosen([str(n.value) for n in numbers], path, name, lines[k])]
            assert isinstance(each.value, int | float)
            value = type(each.value)(1.5 * each.value) if each.value != 1 else 2
            after = lines[k][: each.col_offset] + str(value) + lines[k][each.end_col_offset :]
            yield Fault("workload", path, name, k, lines[k], after)


def faults() -> list[Fault]:
    """All of them, in a fixed order."""
    result: list[Fault] = []
    base = ROOT / SOURCE
    for file in sorted(base.rglob("*")):
        path = file.relative_to(base).as_posix()
        if file.suffix in SUFFIXES and any(path.startswith(each) for each in TESTS):
            lines = file.read_text().splitlines()
            result += [*_formulas(path, lines), *_channels(path, lines)]
    for path, classes in SETTINGS.items():
        result += _settings(path, (base / path).read_text(), classes)
    result += _workloads("bench/workloads.py", (base / "bench/workloads.py").read_text())
    return list({each.name: each for each in result}.values())


def _run(tree: Path, tests: tuple[str, ...], *more: str) -> str:
    """Id of the first test that fails, if any."""
    there = [each for each in tests if (tree / each.split("::")[0]).exists()]
    command = [sys.executable, "-m", "pytest", "-x", "-q", "--no-header", "-p", "no:cacheprovider", *more, *there]
    paths = [str(tree / "src"), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        done = subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True, timeout=LIMIT_S)
    except subprocess.TimeoutExpired:
        return "ran out of time"
    failed: list[str] = re.findall(r"^(?:FAILED|ERROR) (\S+)", done.stdout, re.M)
    if done.returncode in (0, 5):
        return ""
    return (failed or [f"exit code {done.returncode}"])[0]


def _tests_of(fault: Fault) -> tuple[str, ...]:
    return next(tests for begin, tests in TESTS.items() if fault.path.startswith(begin))


def _noticed(fault: Fault, tree: Path, wide: bool) -> str:
    file = tree / SOURCE / fault.path
    original = file.read_text()
    lines = original.splitlines()
    assert lines[fault.line] == fault.before
    lines[fault.line] = fault.after
    file.write_text("\n".join(lines) + "\n")
    try:
        return _run(tree, _tests_of(fault)) or (_run(tree, WIDE) if wide else "")
    finally:
        file.write_text(original)


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-j", dest="jobs", type=int, default=1, metavar="N", help="how many run at a time")
    parser.add_argument("-o", dest="output", type=Path, default=ROOT / "tests/faults.json")
    parser.add_argument("--only", default="", help="regular expression that the name of a fault matches")
    parser.add_argument("--list", action="store_true", help="print the faults and run none")
    parser.add_argument("--again", action="store_true", help="run survivors of the file again")
    parser.add_argument("--unchecked", action="store_true", help="do not run the tests without a fault first")
    parser.add_argument("--narrow", action="store_true", help="only the tests that belong to the file")
    arguments = parser.parse_args()
    every = faults()
    chosen = [each for each in every if re.search(arguments.only, each.name)]
    if arguments.list:
        for each in chosen:
            print(f"{each.kind:9} {each.name}")
        print(f"{len(chosen)} faults")
        return
    known = (
        {each["name"]: each for each in json.loads(arguments.output.read_text())} if arguments.output.exists() else {}
    )
    open_faults = [
        each for each in chosen if each.name not in known or (arguments.again and not known[each.name]["noticed_by"])
    ]
    if open_faults and not arguments.unchecked:
        sound = tuple(dict.fromkeys(test for each in open_faults for test in _tests_of(each)))
        if failed := _run(ROOT, sound, "-n", str(arguments.jobs)):
            sys.exit(f"{failed} fails without a fault")
    trees: SimpleQueue[Path] = SimpleQueue()
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(arguments.jobs) as pool:
        for k in range(arguments.jobs):
            tree = Path(folder) / str(k)
            shutil.copytree(ROOT, tree, ignore=shutil.ignore_patterns(".git", ".venv", ".gl", ".whl", "__pycache__"))
            trees.put(tree)

        def tried(fault: Fault) -> str:
            tree = trees.get()
            try:
                return _noticed(fault, tree, not arguments.narrow)
            finally:
                trees.put(tree)

        names = {each.name for each in every}
        running = {pool.submit(tried, each): each for each in open_faults}
        for done in as_completed(running):
            fault, noticed = running[done], done.result()
            reason = known.get(fault.name, {}).get("reason", "")
            known[fault.name] = {"name": fault.name, "kind": fault.kind, "noticed_by": noticed}
            if not noticed:
                known[fault.name]["reason"] = reason
            print(f"{noticed or 'SURVIVED'}  {fault.name}", flush=True)
            kept = [known[name] for name in sorted(known) if name in names]
            arguments.output.write_text(json.dumps(kept, indent=1, ensure_ascii=False) + "\n")
    survivors = [each for each in known.values() if not each["noticed_by"]]
    print(f"{len(known)} faults, {len(survivors)} survive")


if __name__ == "__main__":
    main()
