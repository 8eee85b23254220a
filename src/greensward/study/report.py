"""The report of a study: one HTML page that needs nothing else, Markdown with its plots, and the raw answers."""

import importlib.util
import re
import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import singledispatch
from html import escape
from itertools import groupby
from pathlib import Path

from greensward.scene import GreenswardError
from greensward.scene.files import written_aside
from greensward.study import plots, statistics
from greensward.study.export import export_answers
from greensward.study.model import (
    LANGUAGES, Choice, Comment, Pairs, Quantity, Question, Score, Staircase, Study, say,
)  # fmt: skip
from greensward.study.plan import Answer, Person, Trial, problem_of
from greensward.study.statistics import Estimate

_NONE = "–"
_MOST_ROWS = 100
_MOST_LETTERS = 300
_RULES: dict[statistics.Rule, str] = {
    "catch trials": "more than {most_caught:.0%} of the catch trials wrong",
    "repeated pairs": "less than {least_repeated:.0%} of the repeated pairs answered alike",
    "time": "less than {least_s:.0f} s from the first answer to the last",
    "control": "a control question answered wrongly",
}
_METHODS = (
    "Intervals hold 95 %. Shares have Wilson's interval, means the BCa bootstrap's, medians the percentile "
    "bootstrap's. A dash stands for an interval that the answers do not give: there is one, or all are alike.",
    "Scores of pairs are those of greatest likelihood in the model of Bradley and Terry with ties (Davidson 1970), on "
    "a logarithmic scale with mean 0: of two pictures that differ by 1, the better is preferred 2.7 times as often. "
    "Their intervals are percentiles over resampled people. Catch trials and repeats do not enter.",
    "Agreement is Krippendorff's α: 1 is full agreement, 0 that of chance. It takes questions with the same answers "
    "together. Each pair enters in both orders, so that the order of pictures in the study does not matter.",
    "Each question counts all who answered it, also those who did not finish the study.",
)


@dataclass(frozen=True)
class Printed:
    """What a source printed of its answers, for a table beside ours."""

    source: str
    people: int
    answers: dict[str, str | dict[str, str]]
    """Figures as they stand there, by question: a mean, or shares by option."""
    notes: dict[str, str]
    """Remarks on the figures, by question."""


@dataclass(frozen=True)
class _Table:
    head: tuple[str, ...]
    rows: list[tuple[str, ...]]
    caption: str = ""
    bars: list[Estimate] = field(default_factory=list)
    """Shares that a page draws beside the rows."""


@dataclass(frozen=True)
class _Plot:
    svg: str
    alt: str


@dataclass(frozen=True)
class _Part:
    title: str
    name: str = ""
    """Of the question."""
    asked: str = ""
    """How it was asked."""
    notes: list[str] = field(default_factory=list)
    tables: list[_Table] = field(default_factory=list)
    plot: _Plot | None = None


def printed_tables() -> dict[str, Printed]:
    """Sources whose printed answers ship with the study of the same name, from `published.toml`."""
    text = Path(__file__).with_name("published.toml").read_text(encoding="utf-8")
    return {name: Printed(**table) for name, table in tomllib.loads(text).items()}


def write_report(
    study: Study,
    people: Sequence[Person],
    answers: Iterable[Answer],
    folder: Path,
    printed: Printed | None = None,
) -> list[Path]:
    """Write `report.html`, `report.md` with its plots, `answers.csv` and, with pyarrow, `answers.parquet`.

    The folder is made where it is missing. The same answers give the same files. With `printed`, a source's figures
    stand beside ours. Raises `GreenswardError`.
    """
    came = {person.number for person in people}
    answers = [answer for answer in answers if answer.person in came]
    parts = _parts(study, people, answers, printed)
    title = _said(study, study.title)
    files = {"report.html": _html(title, parts), "report.md": _markdown(title, parts)}
    files |= {_plot_file(part): part.plot.svg for part in parts if part.plot}
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GreenswardError(f"{folder}: cannot be made: {error.strerror or error}") from None
    for name, text in files.items():
        with written_aside(folder / name) as stream:
            stream.write(text.encode("utf-8", "replace"))
    raw = ["answers.csv", *(["answers.parquet"] if importlib.util.find_spec("pyarrow") else [])]
    for name in raw:
        export_answers(answers, people, folder / name)
    return [folder / name for name in (*files, *raw)]


def _parts(study: Study, people: Sequence[Person], answers: Sequence[Answer], printed: Printed | None) -> list[_Part]:
    sound = [answer for answer in answers if _is_sound(study, answer)]
    out = statistics.left_out(study, sound)
    counted = [answer for answer in sound if answer.person not in out]
    parts = [_people(study, people, answers, out, len(answers) - len(sound)), *_rules(study, out)]
    if printed:
        parts.append(_beside(study, counted, printed))
    for question in study.question:
        mine = [answer for answer in counted if answer.question == question.name]
        if mine:
            parts.append(_result(question, study, mine))
        else:
            parts.append(_Part(_said(study, question.text), question.name, notes=["Nobody answered."]))
    if agreed := statistics.agreements(study, counted):
        rows = [(", ".join(each.questions), each.level, str(each.raters), _figure(each.alpha, 3)) for each in agreed]
        parts.append(_Part("Agreement", tables=[_Table(("Questions", "Scale", "People", "α"), rows)]))
    return [*parts, _Part("Methods", notes=list(_METHODS))]


def _is_sound(study: Study, answer: Answer) -> bool:
    """False for an answer to what the study does not, or no longer, ask."""
    try:
        question = study.question_of(answer.question)
    except KeyError:
        return False
    trial = Trial(question, answer.trial, answer.role, answer.shown)
    if isinstance(question, Pairs | Staircase) and (
        len(set(answer.shown)) != 2 or not {*answer.shown} <= _pictures(question, answer)
    ):
        return False
    skipped = answer.value in (None, "", []) and not answer.other.strip()
    return skipped or not problem_of(trial, answer.value, answer.other)


def _pictures(question: Pairs | Staircase, answer: Answer) -> set[str]:
    if isinstance(question, Staircase):
        return {question.reference, *question.levels}
    return {name for pair in question.catches for name in pair} if answer.role == "catch" else {*question.pictures}


def _people(
    study: Study,
    people: Sequence[Person],
    answers: Sequence[Answer],
    out: Mapping[int, object],
    unsound: int,
) -> _Part:
    by_person = groupby(sorted(answers, key=lambda each: each.person), key=lambda each: each.person)
    taken = {person: statistics.time_taken(given) for person, given in by_person}
    finished = {person.number for person in people if person.finished}
    minutes = [seconds / 60 for person, seconds in taken.items() if person in finished and seconds is not None]
    days = sorted(person.begun[:10] for person in people)
    spoken = Counter(person.language for person in people).most_common()
    languages = ", ".join(f"{LANGUAGES.get(code, code)} {count}" for code, count in spoken)
    rows = [
        ("Began", str(len(people))),
        ("Answered something", str(len(taken))),
        ("Finished", str(len(finished))),
        ("Left out", str(len(out))),
        ("Counted", str(len(taken.keys() - out.keys()))),
        ("First and last day", " to ".join(dict.fromkeys((days[0], days[-1]))) if days else _NONE),
        ("Languages", languages or _NONE),
        ("Median time of those who finished", _with_interval(statistics.median_of(minutes, study.seed), 1, " min")),
    ]
    notes = [f"{unsound} answers to what the study no longer asks are left out."] if unsound else []
    return _Part("Who answered", notes=notes, tables=[_Table(("People", ""), rows)])


def _rules(study: Study, out: Mapping[int, Mapping[statistics.Rule, str]]) -> list[_Part]:
    attention = study.attention
    choices = [question for question in study.question if isinstance(question, Choice)]
    pairs = [question for question in study.question if isinstance(question, Pairs)]
    applies: dict[statistics.Rule, bool] = {
        "catch trials": any(each.catches for each in pairs),
        "repeated pairs": attention.least_repeated > 0 and any(each.repeats for each in pairs),
        "time": attention.least_s > 0,
        "control": any(each.correct for each in choices),
    }
    rows = [
        (_RULES[rule].format(**dict(attention)), str(sum(rule in broken for broken in out.values())))
        for rule, used in applies.items()
        if used
    ]
    if not rows:
        return [_Part("Who is left out", notes=["Nobody: the study has no rule for it."])]
    note = "Rules of the study, said before anybody answered. Who breaks one is in no figure below."
    tables = [_Table(("Rule", "People"), rows)]
    if out:
        told = [(str(person), "; ".join(broken.values())) for person, broken in out.items()]
        tables.append(_Table(("Person", "What they did"), *_bounded(told)))
    return [_Part("Who is left out", notes=[note], tables=tables)]


def _beside(study: Study, counted: Sequence[Answer], printed: Printed) -> _Part:
    """The source's table and ours; ours has as many decimals as the source's."""
    rows, notes = [], []
    for question in study.question:
        figures = printed.answers.get(question.name)
        if figures is None:
            continue
        mine = [answer for answer in counted if answer.question == question.name]
        asked = _brief(_said(study, question.text))
        if isinstance(figures, str):
            numbers = _numbers(mine) if isinstance(question, Score | Quantity) else []
            ours = statistics.mean_of(numbers, study.seed)
            told = "mean" if isinstance(question, Score | Quantity) else ""
            rows.append((asked, told, figures, _with_interval(ours, _decimals(figures))))
        elif isinstance(question, Choice):
            parts, whole = _tally(question, mine)
            for option in question.options:
                if figure := figures.get(option.value):
                    share = statistics.share_of(parts[option.value], whole)
                    text = _percent(share, _decimals(figure))
                    rows.append((asked, _brief(_said(study, option.text)), figure, text))
        if note := printed.notes.get(question.name):
            notes.append(f"{asked} {note}")
    head = ("Question", "Answer", f"Source ({printed.people} people)", "Here, with interval")
    return _Part(f"Beside {printed.source}", notes=notes, tables=[_Table(head, rows)])


def _decimals(figure: str) -> int:
    found = re.search(r"\d+\.?(\d*)", figure)
    return len(found[1]) if found else 1


# Results of each kind of question --------------------------------------------------------------------------


@singledispatch
def _result(question: Question, study: Study, mine: Sequence[Answer]) -> _Part:
    raise TypeError(question)


@_result.register
def _(question: Choice, study: Study, mine: Sequence[Answer]) -> _Part:
    parts, whole = _tally(question, mine)
    named = [(option.value, _said(study, option.text)) for option in question.options]
    if question.other:
        named.append(("", "in own words"))
    rows, bars = [], []
    for value, text in named:
        if share := statistics.share_of(parts[value], whole):
            mark = " (correct)" if value == question.correct else ""
            interval = f"{100 * (share.low or 0):.1f} to {100 * (share.high or 0):.1f}"
            rows.append((_brief(text) + mark, str(parts[value]), f"{100 * share.value:.1f}", interval))
            bars.append(share)
    tables = [_Table(("Answer", "People", "Share, %", "Interval, %"), rows, bars=bars)] if rows else []
    if words := [answer.other for answer in mine if answer.other.strip()]:
        tables.append(_words(words))
    several = "several answers of each; shares are of all who were asked" if question.many else "one answer of each"
    return _Part(_said(study, question.text), question.name, f"{whole} people, {several}", tables=tables)


def _tally(question: Choice, mine: Sequence[Answer]) -> tuple[Counter[str], int]:
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


@_result.register
def _(question: Score, study: Study, mine: Sequence[Answer]) -> _Part:
    ends = [
        f"{question.least} {_said(study, question.least_text)}",
        f"{question.most} {_said(study, question.most_text)}",
    ]
    asked = f"score from {ends[0].strip()} to {ends[1].strip()}"
    return _distribution(question, study, _numbers(mine), asked, "score", (question.least, question.most))


@_result.register
def _(question: Quantity, study: Study, mine: Sequence[Answer]) -> _Part:
    return _distribution(question, study, _numbers(mine), "a whole number", "number", None)


@_result.register
def _(question: Staircase, study: Study, mine: Sequence[Answer]) -> _Part:
    found = statistics.thresholds(question, mine)
    values = [value for value in found.values() if value is not None]
    asked = f"staircase, {question.down} right answers in a row before a nearer level; the difference just noticed"
    unit = "size of the difference" if question.sizes else "level, 1 being the nearest to the reference"
    part = _distribution(question, study, values, asked, unit, None)
    if too_few := len(found) - len(values):
        part.notes.append(f"{too_few} people turned too seldom for a threshold.")
    return part


def _distribution(
    question: Score | Quantity | Staircase,
    study: Study,
    values: Sequence[float],
    asked: str,
    unit: str,
    scale: tuple[int, int] | None,
) -> _Part:
    title = _said(study, question.text)
    mean, median = statistics.mean_of(values, study.seed), statistics.median_of(values, study.seed)
    if mean is None or median is None:
        return _Part(title, question.name, asked, ["No values."])
    rows = [("Mean", *_value_and_interval(mean, 2)), ("Median", *_value_and_interval(median, 2))]
    if len(values) > 1:
        spread = (sum((value - mean.value) ** 2 for value in values) / (len(values) - 1)) ** 0.5
        rows.append(("Standard deviation", f"{spread:.2f}", _NONE))
    alt = f"Histogram of {len(values)} people: mean {_with_interval(mean, 2)}"
    plot = _Plot(plots.histogram(values, mean, unit, scale), alt)
    table = _Table((f"{len(values)} people", "Value", "Interval"), rows)
    return _Part(title, question.name, asked, tables=[table], plot=plot)


@_result.register
def _(question: Pairs, study: Study, mine: Sequence[Answer]) -> _Part:
    found = statistics.ranking(question, mine, study.seed)
    scored = {name: score for name, score in found.scores.items() if score}
    people = max((score.count for score in scored.values()), default=0)
    rows = []
    for name, score in found.scores.items():
        told = _value_and_interval(score, 2) if score else (_NONE, _NONE)
        rows.append((name, *told, *map(str, found.counts[name])))
    head = ("Picture", "Score", "Interval", "Preferred", "No difference", "Not preferred")
    notes = []
    if found.tie:
        equal = found.tie / (2 + found.tie)
        notes.append(f"ν = {found.tie:.2f}: of two pictures of one score, {100 * equal:.0f} % see no difference.")
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
        svg = plots.intervals(list(scored), list(scored.values()), "score (logarithm of odds, mean 0)", zero=True)
        plot = _Plot(svg, alt)
    asked = f"pairs, {people} people"
    return _Part(_said(study, question.text), question.name, asked, notes, [_Table(head, rows)], plot)


@_result.register
def _(question: Comment, study: Study, mine: Sequence[Answer]) -> _Part:
    words = [str(answer.value) for answer in mine if answer.value is not None and str(answer.value).strip()]
    title, asked = _said(study, question.text), f"in own words, {len(words)} people"
    return _Part(title, question.name, asked, tables=[_words(words)] if words else [])


# Words and figures ------------------------------------------------------------------------------------------


def _said(study: Study, words: str | dict[str, str]) -> str:
    """A text in English where the study has it, or in its first language."""
    return say(words, "en" if "en" in study.languages else study.languages[0])


def _numbers(mine: Sequence[Answer]) -> list[float]:
    return [float(answer.value) for answer in mine if isinstance(answer.value, int)]


def _words(words: Sequence[str]) -> _Table:
    return _Table(("In own words",), *_bounded([(_brief(text, _MOST_LETTERS),) for text in words]))


def _bounded(rows: list[tuple[str, ...]]) -> tuple[list[tuple[str, ...]], str]:
    """The first rows, and a caption that tells of the rest."""
    more = len(rows) - _MOST_ROWS
    return rows[:_MOST_ROWS], f"and {more} more, which answers.csv holds" if more > 0 else ""


def _brief(text: str, letters: int = 160) -> str:
    text = " ".join(re.sub(r"[\x00-\x1f\x7f-\x9f]", " ", text).split())
    return text if len(text) <= letters else text[: letters - 1] + "…"


def _figure(value: float | None, decimals: int) -> str:
    return _NONE if value is None else f"{value:.{decimals}f}".replace("-", "−")


def _value_and_interval(estimate: Estimate, decimals: int) -> tuple[str, str]:
    low, high = _figure(estimate.low, decimals), _figure(estimate.high, decimals)
    return _figure(estimate.value, decimals), _NONE if estimate.low is None else f"{low} to {high}"


def _with_interval(estimate: Estimate | None, decimals: int, unit: str = "") -> str:
    if estimate is None:
        return _NONE
    value, interval = _value_and_interval(estimate, decimals)
    return f"{value}{unit}" + ("" if interval == _NONE else f" ({interval})")


def _percent(share: Estimate | None, decimals: int) -> str:
    if share is None:
        return _NONE
    return f"{100 * share.value:.{decimals}f} % ({100 * (share.low or 0):.0f} to {100 * (share.high or 0):.0f})"


# The page and Markdown --------------------------------------------------------------------------------------


def _plot_file(part: _Part) -> str:
    return f"plot-{part.name}.svg"


def _html(title: str, parts: Sequence[_Part]) -> str:
    jinja: Callable[..., object]
    statistics.import_extra("jinja2")
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    pages = Path(__file__).with_name("pages")
    environment = Environment(
        loader=FileSystemLoader(pages),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )

    def inlined(part: _Part) -> Markup:
        assert part.plot
        svg = plots.inlined(part.plot.svg, part.name)
        return Markup(svg.replace("<svg", f'<svg role="img" aria-label="{escape(part.plot.alt)}"', 1))

    return environment.get_template("report.html.j2").render(title=title, parts=parts, inlined=inlined)


def _markdown(title: str, parts: Sequence[_Part]) -> str:
    lines = [f"# {_marked(title)}"]
    for part in parts:
        lines += ["", f"## {_marked(part.title)}"]
        told = ([f"`{part.name}`"] if part.name else []) + ([_marked(part.asked)] if part.asked else [])
        lines += ["", ": ".join(told)] if told else []
        for note in part.notes:
            lines += ["", _marked(note)]
        if part.plot:
            lines += ["", f"![{_marked(part.plot.alt)}]({_plot_file(part)})"]
        for table in part.tables:
            lines += ["", _row(table.head), _row(["---"] * len(table.head), plain=True)]
            lines += [_row(row) for row in table.rows]
            lines += ["", _marked(table.caption)] if table.caption else []
    return "\n".join(lines) + "\n"


def _row(cells: Iterable[str], plain: bool = False) -> str:
    return "| " + " | ".join(cell if plain else _marked(cell) for cell in cells) + " |"


def _marked(text: str) -> str:
    """A text in which nothing is a mark of Markdown or HTML."""
    text = " ".join(text.split()).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return re.sub(r"([\\`*_{}\[\]#|~!])", r"\\\1", text)
