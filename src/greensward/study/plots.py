"""Plots of a report, as SVG. Matplotlib is imported late: it is in the extra `study`."""

import io
import re
import warnings
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from greensward.study.statistics import Estimate, import_extra

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_INK, _ACCENT, _SECOND, _PAPER = "#222222", "#0072b2", "#d55e00", "#fffffe"
"""Blue and vermilion of Okabe and Ito, which colour-blind people tell apart. A page puts its own for them."""
_OF_THE_PAGE = {_INK: "currentColor", _ACCENT: "var(--accent)", _SECOND: "var(--second)", _PAPER: "none"}
_WIDTH_IN = 6.4
_MOST_BINS = 20


def intervals(labels: Sequence[str], estimates: Sequence[Estimate], unit: str) -> str:
    """An SVG of estimates below each other, with their intervals, and a line at 0."""

    def draw(axes: "Axes") -> None:
        for y, estimate in enumerate(estimates):
            if estimate.low is not None and estimate.high is not None:
                axes.plot([estimate.low, estimate.high], [y, y], color=_ACCENT, linewidth=2, solid_capstyle="butt")
            axes.plot(estimate.value, y, "o", color=_ACCENT, markersize=7)
        axes.axvline(0, color=_INK, linewidth=0.6, linestyle=":")
        axes.set_yticks(range(len(labels)), [_cut(label) for label in labels])
        axes.set_ylim(len(labels) - 0.5, -0.5)
        axes.tick_params(axis="y", length=0)
        axes.spines["left"].set_visible(False)
        axes.set_xlabel(unit)

    return _svg(draw, 0.8 + 0.3 * len(labels))


def histogram(values: Sequence[float], mean: Estimate, unit: str, scale: tuple[int, int] | None = None) -> str:
    """An SVG of how many people gave which value, with the mean and its interval above; `scale` shows all of it."""

    def draw(axes: "Axes") -> None:
        if scale:
            edges = np.arange(scale[0], scale[1] + 2) - 0.5
            axes.set_xticks(range(scale[0], scale[1] + 1))
        else:
            edges = np.histogram_bin_edges(values, bins="sturges")
            if all(float(value).is_integer() for value in values):
                # bins of whole numbers hold equally many of them
                wide = max(int(np.ceil((np.ptp(values) + 1) / _MOST_BINS)), 1)
                edges = np.arange(min(values), max(values) + wide + 0.5, wide) - 0.5
        counts, _ = np.histogram(values, edges)
        bars = axes.bar((edges[:-1] + edges[1:]) / 2, counts, 0.9 * np.diff(edges), color=_ACCENT)
        axes.bar_label(bars, [str(count) if count else "" for count in counts], padding=1, fontsize=8)
        top = 1.3 * max(counts.max(), 1)
        if mean.low is not None and mean.high is not None:
            axes.plot([mean.low, mean.high], [top, top], color=_SECOND, linewidth=2, solid_capstyle="butt")
        axes.plot(mean.value, top, "D", color=_SECOND, markersize=6)
        axes.set_ylim(0, 1.08 * top)
        axes.locator_params(axis="y", integer=True)
        axes.set_xlabel(unit)
        axes.set_ylabel("people")

    return _svg(draw, 2.1)


def _cut(label: str) -> str:
    return label if len(label) <= 40 else label[:39] + "…"


def _svg(draw: Callable[["Axes"], None], height_in: float) -> str:
    matplotlib, figures = import_extra("matplotlib"), import_extra("matplotlib.figure")
    settings = {
        "svg.fonttype": "none", "svg.hashsalt": "greensward", "text.parse_math": False, "font.size": 10,
        "text.color": _INK, "axes.labelcolor": _INK, "axes.edgecolor": _INK, "xtick.color": _INK,
        "ytick.color": _INK, "axes.facecolor": "none", "axes.spines.top": False, "axes.spines.right": False,
        "axes.unicode_minus": True,
    }  # fmt: skip
    file = io.StringIO()
    with matplotlib.rc_context(settings), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that letters of a label are not in the font that measures it
        figure = figures.Figure(figsize=(_WIDTH_IN, height_in), layout="constrained", facecolor=_PAPER)
        draw(figure.add_subplot())
        figure.savefig(file, format="svg", metadata={"Date": None, "Creator": None})
    return file.getvalue()


def inlined(svg: str, name: str) -> str:
    """An SVG for within a page, whose colours it takes; its ids begin with a name that is the page's only one."""
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r'\bid="', f'id="{name}-', svg)
    svg = re.sub(r'(url\(|href=")#', rf"\1#{name}-", svg)
    for colour, own in _OF_THE_PAGE.items():
        svg = svg.replace(colour, own)
    return svg
