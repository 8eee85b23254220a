"""Comparison of two runs: ratios with their spread, and which of them are noise."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import quantiles
from typing import Any

from greensward.bench.record import Record
from greensward.bench.tables import Table

_FEW = 5
_SAME_WORK = "blades_drawn", "blade_pixels", "primitives_in_view", "width", "height"


_NOISE = (
    "Noise: the middle halves of the two runs overlap, or the times differ by no more than those of the floor, "
    "which is the same bare work in both: {:.0f} %."
)


@dataclass(frozen=True)
class Ratio:
    """Ratio of the second time to the first, with its interquartile range."""

    middle: float
    low: float
    high: float
    verdict: str


def drift(pairs: Sequence[tuple[dict[str, Any], dict[str, Any]]]) -> float:
    """Drift of the machine between two runs: the 90th percentile of the floors' ratios, as a factor.

    The floor of a row is the same bare work in both runs, if both drew as much.
    """
    drifts = [
        abs(math.log(second["floor_ms"] / first["floor_ms"]))
        for first, second in pairs
        if first.get("floor_ms")
        and second.get("floor_ms")
        and all(first.get(name) == second.get(name) for name in _SAME_WORK)
    ]
    if not drifts:
        return 1.0
    return math.exp(drifts[0] if len(drifts) == 1 else quantiles(drifts, n=10, method="inclusive")[-1])


def ratio(first: dict[str, Any], second: dict[str, Any], drifted: float = 1.0) -> Ratio:
    """Ratio of the second row to the first. It is noise where the quartiles overlap or within the drift."""
    least = 1e-9
    a, b = (max(row["frame_ms_median"], least) for row in (first, second))
    low = second.get("frame_ms_p25", b) / max(first.get("frame_ms_p75", a), least)
    high = second.get("frame_ms_p75", b) / max(first.get("frame_ms_p25", a), least)
    if min(first["frames"], second["frames"]) < _FEW:
        verdict = "too few frames"
    elif low <= 1.0 <= high or 1.0 / drifted <= b / a <= drifted:
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
    drifted = drift([(known[key], row) for key, row in others.items() if key in known])
    for key, row in others.items():
        if key not in known:
            continue
        compared = ratio(known[key], row, drifted)
        changed = known[key].get("scene_hash") != row.get("scene_hash")
        table.add(
            *key[:3],
            f"{row['width']}×{row['height']}",
            f"{known[key]['frame_ms_median']:.3f}",
            f"{row['frame_ms_median']:.3f}",
            f"{compared.middle:.3f}",
            f"{compared.low:.3f}–{compared.high:.3f}",
            compared.verdict + ("; another scene" if changed else ""),
        )
    lines = [f"First: {names[0]}, {_origin(first)}", f"Second: {names[1]}, {_origin(second)}", ""]
    if first["machine"].get("driver") != second["machine"].get("driver"):
        lines.insert(2, "The machines differ, so the ratios compare them as much as greensward.")
    if table.rows:
        lines += [table.markdown(), _NOISE.format((drifted - 1.0) * 100.0)]
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
