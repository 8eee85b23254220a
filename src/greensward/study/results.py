"""Results of each question of a study: tables, plots and notes, without their layout."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from greensward.study import plots, statistics
from greensward.study.model import Choice, Comment, Pairs, Quantity, Question, Score, Staircase, Study, say
from greensward.study.plan import Answer
from greensward.study.statistics import Estimate

_NONE = "–"
_MOST_ROWS = 100
_MOST_LETTERS = 300


@dataclass(frozen=True)
class Table:
    """A table of words and figures."""

    head: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    caption: str = ""
    bars: list[Estimate] = field(default_factory=list)
    """Shares that a page draws beside the rows."""


@dataclass(frozen=True)
class Plot:
    """A plot, and what it shows in words."""

    svg: str
    alt: str


@dataclass(frozen=True)
class Part:
    """A part of the report under a title of its own."""

    title: str
    name: str = ""
    """The question's, if it is of one."""
    asked: str = ""
    """The way it was asked, and how many answered."""
    notes: list[str] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    plot: Plot | None = None


def result(question: Question, study: Study, mine: Sequence[Answer]) -> Part:
    """The part on a question and its answers. Raises `GreenswardError` where a library is missing."""
    match question:
        case _ if not mine:
            return Part(said(study, question.text), question.name, notes=["Nobody answered."])
        case Choice():
            return _choice(question, study, mine)
        case Score():
            return _score(question, study, mine)
        case Quantity():
            return _distribution(question, study, numbers(mine), "a whole number", "number", None)
        case Staircase():
            return _staircase(question, study, mine)
        case Pairs():
            return _pairs(question, study, mine)
        case Comment():
            return _comments(question, study, mine)


def _choice(question: Choice, study: Study, mine: Sequence[Answer]) -> Part:
    parts, whole = tally(question, mine)
    named = [(option.value, said(study, option.text)) for option in question.options]
    if question.other:
        named.append(("", "in own words"))
    rows: list[tuple[str, ...]] = []
    bars = []
    for value, text in named:
        if share := statistics.share_of(parts[value], whole):
            mark = " (correct)" if value == question.correct else ""
            interval = f"{100 * (share.low or 0):.1f} to {100 * (share.high or 0):.1f}"
            rows.append((brief(text) + mark, str(parts[value]), f"{100 * share.value:.1f}", interval))
            bars.append(share)
    tables = [Table(("Answer", "People", "Share, %", "95 % interval, %"), rows, bars=bars)] if rows else []
    if words := [answer.other for answer in mine if answer.other.strip()]:
        tables.append(_words(words))
    several = "several answers of each; shares are of all who were asked" if question.many else "one answer of each"
    return Part(said(study, question.text), question.name, f"{whole} people, {several}", tables=tables)


def tally(question: Choice, mine: Sequence[Answer]) -> tuple[Counter[str], int]:
    """People for each option, "" being own words, and all people; with several answers also those who chose none."""
    parts: Counter[str] = Counter()
    whole = 0
    for answer in mine:
        chosen = answer.value if isinstance(answer.value, list) else [str(answer.value)] if answer.value else []
        own = bool(answer.other.strip())
        parts.update(chosen)
        parts[""] += own
        whole += bool(chosen) or own or question.many
    return parts, whole


def _score(question: Score, study: Study, mine: Sequence[Answer]) -> Part:
    ends = [
        f"{question.least} {said(study, question.least_text)}",
        f"{question.most} {said(study, question.most_text)}",
    ]
    asked = f"score from {ends[0].strip()} to {ends[1].strip()}"
    return _distribution(question, study, numbers(mine), asked, "score", (question.least, question.most))


def _staircase(question: Staircase, study: Study, mine: Sequence[Answer]) -> Part:
    found = statistics.thresholds(question, mine)
    values = [value for value in found.values() if value is not None]
    asked = f"staircase, {question.down} right answers in a row before a nearer level; the difference just noticed"
    unit = "size of the difference" if question.sizes else "level, 1 being the nearest to the reference"
    part = _distribution(question, study, values, asked, unit, None)
    if too_few := len(found) - len(values):
        part.notes.append(f"People who turned too seldom for a threshold: {too_few}.")
    return part


def _distribution(
    question: Score | Quantity | Staircase,
    study: Study,
    values: Sequence[float],
    asked: str,
    unit: str,
    scale: tuple[int, int] | None,
) -> Part:
    title = said(study, question.text)
    mean, median = statistics.mean_of(values, study.seed), statistics.median_of(values, study.seed)
    if mean is None or median is None:
        return Part(title, question.name, asked, ["No values."])
    rows: list[tuple[str, ...]] = [
        ("Mean", *_value_and_interval(mean, 2)),
        ("Median", *_value_and_interval(median, 2)),
    ]
    if len(values) > 1:
        spread = (sum((value - mean.value) ** 2 for value in values) / (len(values) - 1)) ** 0.5
        rows.append(("Standard deviation", f"{spread:.2f}", _NONE))
    alt = f"Histogram of {len(values)} people: mean {with_interval(mean, 2)}"
    plot = Plot(plots.histogram(values, mean, unit, scale), alt)
    table = Table((f"{len(values)} people", "Value", "95 % interval"), rows)
    return Part(title, question.name, asked, tables=[table], plot=plot)


def _pairs(question: Pairs, study: Study, mine: Sequence[Answer]) -> Part:
    found = statistics.ranking(question, mine, study.seed)
    scored = {name: score for name, score in found.scores.items() if score}
    people = max((score.count for score in scored.values()), default=0)
    rows = []
    for name, score in found.scores.items():
        told = _value_and_interval(score, 2) if score else (_NONE, _NONE)
        rows.append((name, *told, *map(str, found.counts[name])))
    head = ("Picture", "Score", "95 % interval", "Preferred", "No difference", "Not preferred")
    notes = []
    if found.tie:
        equal = found.tie / (2 + found.tie)
        notes.append(f"ν = {found.tie:.2f}: of two pictures of equal score, {100 * equal:.0f} % see no difference.")
    if found.steadied:
        notes.append(
            "Comparisons do not bound all scores, as some pictures win or lose all, or are not connected. So each "
            "picture also has half a win and half a loss against one imaginary picture, and scores lie nearer to 0."
        )
    if len(found.groups) > 1:
        groups = "; ".join(", ".join(group) for group in found.groups)
        notes.append(f"No comparisons connect these groups, and scores say nothing between them: {groups}.")
    plot = None
    if scored:
        alt = "Scores with intervals: " + ", ".join(f"{name} {score.value:.2f}" for name, score in scored.items())
        svg = plots.intervals(list(scored), list(scored.values()), "score (logarithm of odds, mean 0)")
        plot = Plot(svg, alt)
    asked = f"pairs, {people} people"
    return Part(said(study, question.text), question.name, asked, notes, [Table(head, rows)], plot)


def _comments(question: Comment, study: Study, mine: Sequence[Answer]) -> Part:
    words = [str(answer.value) for answer in mine if answer.value is not None and str(answer.value).strip()]
    title, asked = said(study, question.text), f"in own words, {len(words)} people"
    return Part(title, question.name, asked, tables=[_words(words)] if words else [])


def said(study: Study, words: str | dict[str, str]) -> str:
    """A text in English where the study has it, or in its first language."""
    return say(words, "en" if "en" in study.languages else study.languages[0])


def numbers(mine: Sequence[Answer]) -> list[float]:
    """The values of answers that are numbers."""
    return [float(answer.value) for answer in mine if isinstance(answer.value, int)]


def _words(words: Sequence[str]) -> Table:
    return Table(("In own words",), *bounded([(brief(text, _MOST_LETTERS),) for text in words]))


def bounded(rows: Sequence[tuple[str, ...]]) -> tuple[Sequence[tuple[str, ...]], str]:
    """The first rows, and a caption that tells of the rest."""
    more = len(rows) - _MOST_ROWS
    return rows[:_MOST_ROWS], f"and {more} more, which answers.csv holds" if more > 0 else ""


def brief(text: str, letters: int = 160) -> str:
    """A text in one line of so many letters at most, without control characters."""
    text = " ".join(re.sub(r"[\x00-\x1f\x7f-\x9f]", " ", text).split())
    return text if len(text) <= letters else text[: letters - 1] + "…"


def figure(value: float | None, decimals: int) -> str:
    """A number in words, a dash for None."""
    return _NONE if value is None else f"{value:.{decimals}f}".replace("-", "−")


def _value_and_interval(estimate: Estimate, decimals: int) -> tuple[str, str]:
    low, high = figure(estimate.low, decimals), figure(estimate.high, decimals)
    return figure(estimate.value, decimals), _NONE if estimate.low is None else f"{low} to {high}"


def with_interval(estimate: Estimate | None, decimals: int) -> str:
    """A value with its interval in words."""
    if estimate is None:
        return _NONE
    value, interval = _value_and_interval(estimate, decimals)
    return value + ("" if interval == _NONE else f" ({interval})")


def percent(share: Estimate | None, decimals: int) -> str:
    """A share with its interval in words, in percent."""
    if share is None:
        return _NONE
    return f"{100 * share.value:.{decimals}f} % ({100 * (share.low or 0):.0f} to {100 * (share.high or 0):.0f})"
