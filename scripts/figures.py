#!/usr/bin/env python3
"""Write the figures of README.md and docs/*.md from kept results: `.venv/bin/python scripts/figures.py`.

A page names in a comment what it shows, and what stands between that and the next `<!-- / -->` is written here:

    A frame takes <!-- ms: cpu / blade-count / visibility-buffer / 1M -->191 ms<!-- / -->.

The word is a function below, and the rest is what it is given. A table's comment begins a line, no other does.
"""

import argparse
import json
import re
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from greensward.bench.record import read
from greensward.bench.tables import Table, count, number
from greensward.bench.workloads import STRIPS
from greensward.scene import GreenswardError, InputError

MACHINES = {"cpu": "llvmpipe", "gpu": "nvidia-"}
"""Prefix of the names of a machine's files: in docs/benchmarks those of `greensward bench`;
in docs/performance, after `limits-`, `motion-`, `update-` or `viewer-`, those of the script of that name."""
BLADES = {"1M": "a million", "10M": "ten million", "30M": "thirty million"}

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
FIELDS, TABLE_1 = ("blade-count", "field-scale", "presets"), "jahrmann2013-table1"
FILLED, QUADS = "visibility-buffer", "tessellated-quads"
OPEN = r"<!-- (\w+)(?:: ([^>]+))? -->"
FIGURE, STRAY = re.compile(OPEN + "(.*?)<!-- / -->", re.DOTALL), re.compile(rf"<!-- / -->|{OPEN}")
Row = dict[str, Any]


def files(machine: str, kind: str = "") -> list[Path]:
    where = f"performance/{kind}-" if kind else "benchmarks/"
    return sorted(DOCS.glob(f"{where}{MACHINES[machine]}*.json"), key=lambda path: path.stem)


def file_names(paths: list[Path]) -> str:
    return ", ".join(str(path.relative_to(ROOT)) for path in paths)


@cache
def bench(machine: str) -> tuple[Row, dict[tuple[str, str, str], Row]]:
    """Return the machine and its rows; of rows that were measured twice, those of the last file."""
    records = [read(path) for path in files(machine)]
    if len({record["machine"]["driver"] for record in records}) != 1:
        raise InputError(f"docs/benchmarks/{MACHINES[machine]}*.json: must be of one machine; keep the files of one")
    rows: dict[tuple[str, str, str], Row] = {}
    for row in (row for record in records for row in record["rows"]):
        key = row["workload"], row["technique"], row["case"]
        rows.pop(key, None)  # so that the order is that of the last file as well
        rows[key] = row
    return records[-1]["machine"], rows


def row_of(machine: str, workload: str, technique: str, case: str) -> Row:
    if row := bench(machine)[1].get((workload, technique, case)):
        return row
    row_is = f"workload {workload}, technique {technique}, case {case}"
    raise InputError(f"{row_is}: is not in {file_names(files(machine))}; measure it with greensward bench")


def rows_of(machine: str, *workloads: str) -> list[Row]:
    """Return the rows of greensward's own techniques, case by case."""
    rows = [row for row in bench(machine)[1].values() if row["workload"] in workloads and row["technique"] != STRIPS]
    if not rows:
        raise InputError(f"workload {' or '.join(workloads)}: is not in {file_names(files(machine))}")
    cases = list(dict.fromkeys((row["workload"], row["case"]) for row in rows))
    return sorted(
        rows, key=lambda row: (workloads.index(row["workload"]), cases.index((row["workload"], row["case"])))
    )


def result_files(kind: str) -> dict[str, Path]:
    """Return the result file of this kind for each machine that has one."""
    found = {machine: paths for machine in MACHINES if (paths := files(machine, kind))}
    if many := next((paths for paths in found.values() if len(paths) > 1), None):
        raise InputError(f"{file_names(many)}: must be one file; keep one")
    if not found:
        raise InputError(f"docs/performance/{kind}-*.json: there is none; keep what scripts/measure_{kind}.py prints")
    return {machine: paths[0] for machine, paths in found.items()}


def results(kind: str) -> dict[str, Row]:
    return {machine: json.loads(path.read_text(encoding="utf-8")) for machine, path in result_files(kind).items()}


def with_title(title: str, more: str, table: Table) -> str:
    return f"**{title}**, {more}\n\n{table.markdown()}"


def measurements(machine: str, rows: list[Row], what: str, table: Table) -> str:
    sizes = ", ".join(dict.fromkeys(f"{row['width']} × {row['height']}" for row in rows))
    return with_title(bench(machine)[0]["driver"], f"{sizes}, {what}", table)


def milliseconds(row: Row, part: str = "") -> float:
    """Return the milliseconds of a frame, of one of its passes, or of its Python code (`python`)."""
    time_ms: float = (
        row["cpu_ms_median"] if part == "python" else row["pass_ms"][part] if part else row["frame_ms_median"]
    )
    return time_ms


# Figures in sentences


def origin(machine: str, what: str = "driver") -> str:
    return str(bench(machine)[0][what])


def ms(machine: str, workload: str, technique: str, case: str, part: str = "") -> str:
    return f"{number(milliseconds(row_of(machine, workload, technique, case), part))} ms"


def ratio(machine: str, workload: str, case: str, part: str, technique: str, other: str) -> str:
    """Return the time of the first technique divided by that of the second."""
    first, second = (milliseconds(row_of(machine, workload, each, case), part) for each in (technique, other))
    return number(first / second)


def drawn(machine: str, technique: str, *cases: str) -> str:
    """Return count and time of the first of these cases of `blade-count` that was measured."""
    case = next((each for each in cases if ("blade-count", technique, each) in bench(machine)[1]), cases[0])
    row = row_of(machine, "blade-count", technique, case)
    whole = f" of GPU time, {number(row['wall_ms_median'])} ms including Python"
    return f"{BLADES[case]} blades in {number(milliseconds(row))} ms{whole * (row['cpu_ms_median'] is not None)}"


def frame_times(machine: str, workload: str, technique: str, case: str) -> str:
    """Return the number of frames, and the best, mean and worst of their times."""
    row = row_of(machine, workload, technique, case)
    best, average, worst = (number(row[f"frame_ms_{name}"]) for name in ("min", "mean", "max"))
    return f"{row['frames']:,} frames: {best} ms at best, {average} on average and {worst} at worst"


def drawn_of(machine: str, workload: str, technique: str, case: str) -> str:
    return count(row_of(machine, workload, technique, case)["blades_drawn"])


def ratio_of(machine: str, workload: str, technique: str, case: str, other: str) -> str:
    """Return the time of the grass pass in the first case divided by that in the second."""
    first, second = (milliseconds(row_of(machine, workload, technique, each), "grass") for each in (case, other))
    return number(first / second)


def remaining(machine: str, case: str) -> str:
    """Return the share of the grass pass that remains where a part of it is left out."""
    times = results("limits")[machine]["grass_ms"]
    return f"{100 * times[case] / times['nothing']:.0f} %"


def links(machine: str) -> str:
    """Return links to the rows and their report, from a page in docs."""
    reports = {path.with_suffix("") / "report.md": f"report of {path.stem}" for path in files(machine)}
    named = {path: text for path, text in reports.items() if path.is_file()} | {
        path: path.name for path in files(machine)
    }
    return ", ".join(f"[{text}]({path.relative_to(DOCS)})" for path, text in named.items())


# Tables


def fields(machine: str) -> str:
    rows = rows_of(machine, *FIELDS)
    queried = any(row["cpu_ms_median"] is not None for row in rows)
    first = any(row.get("first_frame_s") is not None for row in rows)
    more = [*["with Python", "Python"] * queried, *["first picture, s"] * first]
    table = Table(["", "technique", "blades sown", "in view", "drawn", "frame", *more])
    for row in rows:
        blades = (count(row[f"blades_{key}"]) for key in ("sown", "considered", "drawn"))
        python = [number(row[key]) for key in ("wall_ms_median", "cpu_ms_median")] * queried
        began = [number(row.get("first_frame_s"))] * first
        table.add(row["case"], f"`{row['technique']}`", *blades, number(milliseconds(row)), *python, *began)
    return measurements(machine, rows, "milliseconds", table)


def passes(machine: str) -> str:
    rows = rows_of(machine, *FIELDS)
    names = list(dict.fromkeys(name for row in rows for name in row["pass_ms"]))
    table = Table(["", "technique", *names])
    for row in rows:
        table.add(row["case"], f"`{row['technique']}`", *(number(row["pass_ms"].get(name)) for name in names))
    return measurements(machine, rows, "milliseconds of each pass", table)


def grass_pass(*machines: str) -> str:
    """Return the times of the grass pass, and their ratios to that of `visibility-buffer`."""
    others = STRIPS, "bezier-blades", QUADS
    table = Table(["machine", "blades", f"`{FILLED}`", *(cell for name in others for cell in (f"`{name}`", "ratio"))])
    for machine in machines:
        grass = {key: milliseconds(row, "grass") for key, row in bench(machine)[1].items() if key[0] == "blade-count"}
        for (_, technique, case), base in grass.items():
            if technique == FILLED:
                times = [grass.get(("blade-count", name, case)) for name in others]
                cells = [(number(time), "–" if time is None else f"{time / base:.1f}") for time in times]
                table.add(origin(machine), case, number(base), *(cell for pair in cells for cell in pair))
    return table.markdown()


def table1(machine: str) -> str:
    """Return the rows of Table 1 beside the values that the paper prints."""
    rows = [row for row in rows_of(machine, TABLE_1) if row["technique"] == QUADS]
    head = ["scene", "blades drawn", f"`{QUADS}`", "grass", f"`{FILLED}`", "grass", "paper: blades", "paper: frame"]
    table = Table(head)
    for row in rows:
        pair = row, row_of(machine, TABLE_1, FILLED, row["case"])
        times = (number(milliseconds(each, part)) for each in pair for part in ("", "grass"))
        fps, blades = re.findall(r"\d[\d,]*\d", row["published"])
        table.add(row["case"], count(row["blades_drawn"]), *times, blades, f"{1000 / int(fps):.1f}")
    return measurements(machine, rows, "milliseconds of a frame and of its grass pass", table)


def flight(machine: str) -> str:
    """Return the spread of the frames of straight flights, Python and all."""
    rows = rows_of(machine, "flight")
    table = Table(["", "median", "99 of 100 below", "slowest", "99 of 100 / median", "slowest / median"])
    for row in rows:
        middle, most, worst = (row[f"wall_ms_{name}"] for name in ("median", "p99", "max"))
        table.add(row["case"], *map(number, (middle, most, worst)), f"{most / middle:.2f}", f"{worst / middle:.2f}")
    return measurements(machine, rows, f"milliseconds with Python, {rows[0]['frames']} frames", table)


def side_by_side(machine: str, workload: str, *techniques: str) -> str:
    """Return frame and grass pass of each case by each technique, the floor, and the source's figure."""
    rows = bench(machine)[1]
    cases = list(dict.fromkeys(case for name, _, case in rows if name == workload))
    heads = (cell for name in techniques for cell in (f"`{name}`", "grass"))
    published = any(rows[workload, techniques[0], case]["published"] for case in cases)
    table = Table(["", *heads, "floor", *["source"] * published])
    for case in cases:
        those = [row_of(machine, workload, name, case) for name in techniques]
        times = (number(milliseconds(row, part)) for row in those for part in ("", "grass"))
        table.add(case, *times, number(those[0]["floor_ms"]), *[those[0]["published"] or "–"] * published)
    return with_title(bench(machine)[0]["driver"], "milliseconds of a frame and of its grass pass", table)


def limits() -> str:
    parts = []
    for was in results("limits").values():
        rows = [[name, number(time)] for name, time in was["grass_ms"].items()]
        more = f"{was['size'].replace('x', ' × ')}, {was['in_view']:,} blades in view"
        parts.append(with_title(was["driver"], more, Table(["omitted, or segments", "grass, ms"], rows)))
    return "\n".join(parts)


def motion() -> str:
    parts = []
    for was in results("motion").values():
        table = Table(["form, wind", "blades", "greensward", "plain forces", "ratio", "plain visibility", "GB/s"])
        for row in was["rows"]:
            step, plain, seen = (row[f"{key}_ms"] for key in ("step", "plain_forces", "plain_visibility"))
            times = f"{step:.3f}", f"{plain:.3f}", f"{step / plain:.2f}", f"{seen:.3f}"
            table.add(row["workload"], count(row["blades"]), *times, f"{row['gb_per_s']:,.0f}")
        parts.append(with_title(was["machine"]["driver"], "milliseconds for one step", table))
    return "\n".join(parts)


def soak() -> str:
    parts = []
    for machine, was in results("soak").items():
        on_gpu = machine == "gpu"
        free = ["free GPU MiB"] * on_gpu
        table = Table(["frames", "median, ms", "99 %, ms", "process MiB", *free, "files", "mean", "contrast"])
        for row in was["rows"]:
            times = number(row["frame_ms"]), number(row["frame_ms_p99"])
            memory = count(row["process_mib"]), *[count(row["gpu_free_mib"])] * on_gpu
            picture = f"{row['mean']:.4f}", f"{row['contrast']:.4f}"
            table.add(f"to {row['to_frame']:,}", *times, *memory, count(row["open_files"]), *picture)
        beside = f", {was['processes']} processes, {was['at_once']} at once" if was["processes"] > 1 else ""
        what = f"{was['blades']:,} blades, {was['size'].replace('x', ' × ')}{beside}"
        parts.append(with_title(was["machine"]["driver"], what, table))
    return "\n".join(parts)


def fuzz() -> str:
    was = json.loads((DOCS / "performance" / "fuzz.json").read_bytes())
    table = Table(["cases", "number", "outcomes"])
    for kind, counts in sorted(was["counts"].items()):
        told: dict[str, int] = {}
        for outcome, number_of in counts.items():
            name = re.sub(r"^.* (read|refused)$", r"\1", outcome)
            name = re.sub(r"^.* (-?[0-9]+)$", r"exit code \1", name)
            told[name] = told.get(name, 0) + number_of
        outcomes = ", ".join(f"{number_of:,} {name}" for name, number_of in sorted(told.items()))
        table.add(kind, f"{sum(counts.values()):,}", outcomes)
    return table.markdown()


def starts() -> str:
    parts = []
    for was in results("update").values():
        rows = [[row["start"], number(row["picture_ms"]), number(row["shaders_ms"])] for row in was["starts"]]
        table = Table(["start", "first picture, ms", "shaders, ms"], rows)
        parts.append(with_title(was["machine"]["driver"], was["size"].replace("x", " × "), table))
    return "\n".join(parts)


def updates() -> str:
    parts = []
    for was in results("update").values():
        rows = [
            [
                row["change"],
                "yes" if row["in_place"] else "no",
                number(row["update_ms"]),
                number(row["next_frame_ms"]),
            ]
            for row in was["updates"]
        ]
        table = Table(["change", "in place", "update, ms", "next frame, ms"], rows)
        parts.append(with_title(was["machine"]["driver"], was["size"].replace("x", " × "), table))
    return "\n".join(parts)


def viewer() -> str:
    parts = []
    for path in result_files("viewer").values():
        seen = [f"{what}, {key}" for what in ("at rest", "moving") for key in ("fps", "95th percentile")]
        table = Table(["preset", "first picture", *seen])
        lines = path.read_text(encoding="utf-8").splitlines()
        for row in (json.loads(line) for line in lines if line.startswith("{")):
            pace = [
                (f"{row[f'{what}_fps']:.0f}", f"{row[f'{what}_p95_ms']:.0f} ms") for what in ("standing", "walking")
            ]
            table.add(
                f"`{row['preset']}`", f"{row['first_frame_s']:.1f} s", *(cell for pair in pace for cell in pair)
            )
        rows = f"[rows]({path.relative_to(DOCS)})"
        parts.append(with_title(path.stem.removeprefix("viewer-"), rows, table))
    return "\n".join(parts)


SENTENCES: tuple[Callable[..., str], ...] = (
    origin,
    ms,
    ratio,
    ratio_of,
    drawn,
    drawn_of,
    frame_times,
    remaining,
    links,
)
TABLES: tuple[Callable[..., str], ...] = (
    fields,
    passes,
    grass_pass,
    table1,
    flight,
    side_by_side,
    limits,
    motion,
    soak,
    fuzz,
    starts,
    updates,
    viewer,
)
FIGURES = {function.__name__: function for function in (*SENTENCES, *TABLES)}


def with_figures(text: str) -> str:
    """Return a page's text with its figures brought up to date. Raises `InputError`."""

    def figure(found: re.Match[str]) -> str:
        word, given, body = found.groups()
        mark = found[0][: found.start(3) - found.start()]
        begins = not found.string[: found.start()].rpartition("\n")[2].strip(" -*")
        try:
            if STRAY.search(body):
                raise InputError("is not closed by <!-- / -->")
            if begins != (FIGURES[word] in TABLES):
                raise InputError(f"must {'not ' * begins}begin a line, as {'only ' * begins}tables do")
            shown = FIGURES[word](*re.split(" +/ +", given) if given else ())
        except (KeyError, TypeError) as error:
            raise InputError(f"{mark}: {error!r}; scripts/figures.py has what there is") from None
        except GreenswardError as error:
            raise InputError(f"{mark}: {error}") from None
        return mark + (f"\n\n{shown}\n" if begins else shown) + "<!-- / -->"

    if stray := STRAY.search(FIGURE.sub("", text)):
        raise InputError(f"{stray[0]}: has no other end")
    return FIGURE.sub(figure, text)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="write nothing; 1 if a page would change")
    check = parser.parse_args().check
    pages = {page: page.read_text(encoding="utf-8") for page in (ROOT / "README.md", *sorted(DOCS.glob("*.md")))}
    changed = {}
    for page, text in pages.items():
        try:
            if (new := with_figures(text)) != text:
                changed[page] = new
        except InputError as error:
            print(f"{file_names([page])}: {error}", file=sys.stderr)
            return 2
    for page, new in changed.items():
        if check:
            print(f"{file_names([page])}: is not what scripts/figures.py writes; run it", file=sys.stderr)
        else:
            page.write_text(new, encoding="utf-8")
            print(file_names([page]))
    return int(check and bool(changed))


if __name__ == "__main__":
    sys.exit(main())
