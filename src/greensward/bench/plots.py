"""Plots of a run as PNG. Matplotlib is imported late: it is in the extra `bench`."""

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from greensward.bench.tables import by_workload
from greensward.scene import GreenswardError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from greensward.bench.record import Record

_COLOURS = ("#2f6b2f", "#c8742a", "#4a6fa5", "#8a4f7d", "#8a8a3a", "#555555", "#b03a3a")
_MOST_CASES = 24
_WIDE = 12.0  # times the quickest, beyond which bars from zero would hide it
_MANY_DECADES = 1e4


def plots(record: "Record") -> dict[str, bytes]:
    """WebP files by name: frame times of each workload, and cost against quality. Raises `GreenswardError`."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise GreenswardError('plots need matplotlib: pip install "greensward[bench]"') from None

    def webp(draw: Any, height: float) -> bytes:
        figure = Figure(figsize=(8.0, height), layout="constrained")
        axes = figure.add_subplot()
        draw(axes)
        axes.spines[["top", "right"]].set_visible(False)
        file = io.BytesIO()
        figure.savefig(file, format="webp", dpi=90, pil_kwargs={"lossless": True, "method": 6})
        return file.getvalue()

    made = {}
    for name, rows in by_workload(record).items():
        compared = [row for row in rows if row.get("flip") is not None]
        if compared:
            made["cost-quality.webp"] = webp(lambda axes, rows=compared: _cost(axes, rows), 4.2)
        elif "flip" not in rows[0]:
            cases = list(dict.fromkeys(_case(row, rows) for row in rows))[:_MOST_CASES]
            techniques = len({row["technique"] for row in rows})
            height = 1.3 + 0.2 * len(cases) * (techniques + 0.6)
            made[f"{name}.webp"] = webp(lambda axes, rows=rows, cases=cases: _bars(axes, rows, cases), height)
    return made


def _case(row: dict[str, Any], rows: Sequence[dict[str, Any]]) -> str:
    """The case's name; with the size where the same case comes in several."""
    sizes = {(each["width"], each["height"]) for each in rows if each["case"] == row["case"]}
    return str(row["case"]) + (f"\n{row['width']}×{row['height']}" if len(sizes) > 1 else "")


def _logarithmic(axes: "Axes") -> None:
    """Milliseconds on a logarithmic axis, in plain numbers."""
    from matplotlib.ticker import LogLocator, NullFormatter

    axes.set_xscale("log")
    low, high = axes.get_xlim()
    # where more decades are shown than that, numbers between them would run into each other
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0,) if high > _MANY_DECADES * low else (1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())


def _bars(axes: "Axes", rows: Sequence[dict[str, Any]], cases: Sequence[str]) -> None:
    techniques = list(dict.fromkeys(row["technique"] for row in rows))
    thick = 0.8 / len(techniques)
    for index, technique in enumerate(techniques):
        mine = [row for row in rows if row["technique"] == technique and _case(row, rows) in cases]
        at = [cases.index(_case(row, rows)) + (index + 0.5) * thick - 0.4 for row in mine]
        middle = [row["frame_ms_median"] for row in mine]
        reach = [
            [max(row["frame_ms_median"] - row.get("frame_ms_min", row["frame_ms_median"]), 0.0) for row in mine],
            [max(row.get("frame_ms_p95", row["frame_ms_median"]) - row["frame_ms_median"], 0.0) for row in mine],
        ]
        axes.barh(at, middle, 0.9 * thick, color=_COLOURS[index % len(_COLOURS)], label=technique, xerr=reach,
                  error_kw={"elinewidth": 0.8, "ecolor": "#222222"})  # fmt: skip
        floors = [row.get("floor_ms") or 0.0 for row in mine]
        axes.plot(floors, at, "|", color="black", markersize=7, label="floor" if index == 0 else None)
    axes.set_yticks(range(len(cases)), cases)
    axes.set_ylim(len(cases) - 0.5, -0.5)
    shown = [row["frame_ms_median"] for row in rows]
    if max(shown) > _WIDE * max(min(shown), 1e-6):
        _logarithmic(axes)
    axes.set_xlabel("milliseconds for a frame: median, from the best to the 95th percentile")
    axes.figure.legend(loc="outside lower center", ncols=4, fontsize=8, frameon=False)


def _cost(axes: "Axes", rows: Sequence[dict[str, Any]]) -> None:
    for index, technique in enumerate(dict.fromkeys(row["technique"] for row in rows)):
        mine = sorted((row for row in rows if row["technique"] == technique), key=lambda row: row["samples"])
        costs, flips = [row["frame_ms_median"] for row in mine], [row["flip"] for row in mine]
        axes.plot(costs, flips, "o-", color=_COLOURS[index % len(_COLOURS)], label=technique)
        for row, cost, flip in zip(mine, costs, flips, strict=True):
            axes.annotate(f"{row['samples']}×", (cost, flip), textcoords="offset points", xytext=(5, 5), fontsize=8)
    _logarithmic(axes)
    axes.margins(x=0.15, y=0.15)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("milliseconds for a picture of so many samples for each pixel")
    axes.set_ylabel("FLIP distance to the reference")
    axes.legend(fontsize=8, frameon=False)
