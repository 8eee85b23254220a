"""Two runs beside each other: ratios with their spread, and which of them are noise."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from greensward.bench.record import Record
from greensward.bench.tables import Table

_FEW = 5


@dataclass(frozen=True)
class Ratio:
    """The second time to the first, from quartile to quartile."""

    middle: float
    low: float
    high: float
    verdict: str


def ratio(first: dict[str, Any], second: dict[str, Any]) -> Ratio:
    """How the second row compares. It is noise where the quartiles of the two overlap."""
    least = 1e-9
    a, b = (max(row["frame_ms_median"], least) for row in (first, second))
    low = second.get("frame_ms_p25", b) / max(first.get("frame_ms_p75", a), least)
    high = second.get("frame_ms_p75", b) / max(first.get("frame_ms_p25", a), least)
    if min(first["frames"], second["frames"]) < _FEW:
        verdict = "too few frames to tell"
    elif low <= 1.0 <= high:
        verdict = "noise"
    else:
        verdict = "faster" if b < a else "slower"
    return Ratio(b / a, low, high, verdict)


def _key(row: dict[str, Any]) -> tuple[Any, ...]:
    return row["workload"], row["technique"], row["case"], row["width"], row["height"]


def compare(first: Record, second: Record, names: tuple[Path, Path]) -> str:
    """Markdown: a line for each measurement that both have, and what only one of them has."""
    known = {_key(row): row for row in first["rows"]}
    others = {_key(row): row for row in second["rows"]}
    table = Table(["workload", "technique", "case", "size", "first, ms", "second, ms", "ratio", "spread", ""])
    for key, row in others.items():
        if key not in known:
            continue
        told = ratio(known[key], row)
        changed = known[key].get("scene_hash") != row.get("scene_hash")
        table.add(
            *key[:3],
            f"{row['width']}×{row['height']}",
            f"{known[key]['frame_ms_median']:.3f}",
            f"{row['frame_ms_median']:.3f}",
            f"{told.middle:.3f}",
            f"{told.low:.3f}–{told.high:.3f}",
            told.verdict + ("; another scene" if changed else ""),
        )
    lines = [f"First: {names[0]}, {_origin(first)}", f"Second: {names[1]}, {_origin(second)}", ""]
    if first["machine"].get("driver") != second["machine"].get("driver"):
        lines.insert(2, "The machines differ: a ratio tells of them as much as of greensward.")
    if table.rows:
        lines += [table.markdown(), "Noise: the middle halves of the two runs overlap."]
    else:
        lines.append("The two have no measurement in common.")
    for name, mine, theirs in ((names[0], known, others), (names[1], others, known)):
        if only := [key for key in mine if key not in theirs]:
            lines.append(f"Only in {name}: {len(only)} ({', '.join(map(str, only[0][:3]))}{', …' * (len(only) > 1)})")
    return "\n".join(lines) + "\n"


def _origin(record: Record) -> str:
    machine = record["machine"]
    unfinished = f"; INCOMPLETE: {machine['incomplete']}" if machine.get("incomplete") else ""
    return (
        f"{machine.get('driver')}, greensward {machine.get('greensward')} ({machine.get('commit') or 'no commit'})"
        + unfinished
    )
