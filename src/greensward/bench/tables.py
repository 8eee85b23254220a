"""Rows of a run as tables, in Markdown and HTML alike."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from html import escape
from typing import Any

from greensward.bench.record import Record


@dataclass
class Table:
    """Cells of text below a head."""

    head: list[str]
    rows: list[list[str]] = field(default_factory=list)

    def add(self, *cells: object) -> None:
        """Add a row."""
        self.rows.append([str(cell) for cell in cells])

    def markdown(self) -> str:
        """Markdown, with a newline at its end."""
        lines = [self.head, *self.rows]
        shown = ["| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines]
        return "\n".join([shown[0], "|---" * len(self.head) + "|", *shown[1:]]) + "\n"

    def html(self) -> str:
        """A table element."""

        def line(cells: list[str], kind: str) -> str:
            return "<tr>" + "".join(f"<{kind}>{escape(cell)}</{kind}>" for cell in cells) + "</tr>"

        body = "\n".join(line(row, "td") for row in self.rows)
        return f"<table>\n<thead>{line(self.head, 'th')}</thead>\n<tbody>\n{body}\n</tbody>\n</table>"


def number(value: float | None) -> str:
    """Milliseconds and ratios: three significant digits."""
    if value is None:
        return "–"
    return f"{value:,.0f}" if value >= 100 else f"{value:.1f}" if value >= 10 else f"{value:.2f}"


def count(value: int | None) -> str:
    """Whole numbers."""
    return "–" if value is None else f"{value:,}"


def by_workload(record: Record) -> dict[str, list[dict[str, Any]]]:
    """Rows by workload, in the order of the run."""
    groups: dict[str, list[dict[str, Any]]] = {}
    for row in record["rows"]:
        groups.setdefault(row["workload"], []).append(row)
    return groups


def times(rows: Iterable[dict[str, Any]]) -> Table:
    """Times of a frame in milliseconds."""
    head = ["case", "technique", "size", "median", "average", "p95", "best", "worst", "outliers", "whole, wall"]
    rows = list(rows)
    compared = any("flip" in row for row in rows)
    published = any(row.get("published") for row in rows)
    first = any(row.get("first_frame_s") is not None for row in rows)
    more = ["Python", "floor", "× floor", *["first, s"] * first, *["FLIP"] * compared, *["published"] * published]
    table = Table([*head, *more])
    for row in rows:
        began = [number(row.get("first_frame_s"))] if first else []
        extra = ["–" if row.get("flip") is None else f"{row['flip']:.4f}"] if compared else []
        source = [row.get("published", "")] if published else []
        table.add(
            row["case"],
            row["technique"],
            f"{row['width']}×{row['height']}",
            *(number(row.get(f"frame_ms_{name}")) for name in ("median", "mean", "p95", "min", "max")),
            f"{row.get('outliers', 0)} of {row['frames']}",
            *(number(row.get(name)) for name in ("wall_ms_median", "cpu_ms_median", "floor_ms", "over_floor")),
            *began,
            *extra,
            *source,
        )
    return table


def work(rows: Iterable[dict[str, Any]]) -> Table:
    """Counts of what a frame draws."""
    columns = {
        "considered": "blades_considered",
        "simulated": "blades_simulated",
        "drawn": "blades_drawn",
        "blade pixels": "blade_pixels",
        "vertices": "vertices",
        "primitives": "primitives",
        "draw calls": "draw_calls",
        "dispatches": "dispatches",
    }
    table = Table(["case", "technique", "size", *columns, "GPU MiB"])
    for row in rows:
        table.add(
            row["case"],
            row["technique"],
            f"{row['width']}×{row['height']}",
            *(count(row.get(name)) for name in columns.values()),
            number(row.get("gpu_bytes", 0) / 2**20),
        )
    return table


def passes(rows: Iterable[dict[str, Any]]) -> Table:
    """Milliseconds of each pass; after a stroke Python's part where it is known."""
    rows = list(rows)
    names = list(dict.fromkeys(name for row in rows for name in row.get("pass_ms", {})))
    table = Table(["case", "technique", *names])
    for row in rows:
        python = row.get("cpu_pass_ms") or {}
        cells = []
        for name in names:
            value = row["pass_ms"].get(name)
            cells.append(number(value) + (f" / {number(python[name])}" if name in python else ""))
        table.add(row["case"], row["technique"], *cells)
    return table


def origin(record: Record) -> Table:
    """The machine and all that figures depend on."""
    machine = record["machine"]
    libraries = ", ".join(f"{name} {found or 'missing'}" for name, found in machine.get("libraries", {}).items())
    table = Table(["", ""])
    for name in ("driver", "vendor", "opengl", "processor", "system", "python"):
        table.add(name, machine.get(name))
    table.add("libraries", libraries)
    table.add("greensward", f"{machine.get('greensward')}, commit {machine.get('commit') or 'unknown'}")
    table.add("clock", machine.get("clock"))
    path = "a camera path of its own" if machine.get("camera_path") else "the path"
    table.add(
        "protocol",
        f"{machine.get('protocol')}, {machine.get('scale')} scale: {machine.get('frames')} frames after "
        f"{machine.get('warm_up')} to warm up, along {path}, 1/60 s apart, without display",
    )
    hashes = {row["scene_hash"] for row in record["rows"] if row.get("scene_hash")}
    table.add("scenes", ", ".join(sorted(hashes)) if len(hashes) <= 4 else f"{len(hashes)}, by hash in the JSON")
    return table


def skipped(record: Record) -> Table:
    """Cases that were not measured: a line for each workload and reason."""
    groups: dict[tuple[str, str], tuple[dict[str, None], dict[str, None]]] = {}
    for each in record["machine"].get("skipped", []):
        techniques, cases = groups.setdefault((each.get("workload", ""), each.get("reason", "")), ({}, {}))
        techniques[each.get("technique", "")] = cases[each.get("case", "")] = None
    table = Table(["workload", "techniques", "cases", "why not"])
    for (workload, reason), (techniques, cases) in groups.items():
        table.add(workload, ", ".join(filter(None, techniques)), "; ".join(filter(None, cases)) or "all", reason)
    return table
