"""The report of a study: one HTML page that needs nothing else, Markdown with its plots, and the raw answers."""

import importlib.util
import re
import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from itertools import groupby
from pathlib import Path

from greensward.scene import GreenswardError
from greensward.scene.files import written_aside
from greensward.study import plots, statistics
from greensward.study.export import export_answers, in_order
from greensward.study.model import LANGUAGES, Choice, Pairs, Quantity, Question, Score, Staircase, Study
from greensward.study.plan import Answer, Person, Trial, problem_of
from greensward.study.results import (
    Part,
    Table,
    bounded,
    brief,
    figure,
    numbers,
    percent,
    result,
    said,
    tally,
    with_interval,
)  # fmt: skip

_RULES: dict[statistics.Rule, str] = {
    "catch trials": "more than {most_caught:.0f} % of the catch trials wrong",
    "repeated pairs": "less than {least_repeated:.0f} % of the repeated pairs answered alike",
    "time": "less than {least_s:.0f} s from the first answer to the last",
    "control": "a control question answered wrongly",
}
_METHODS = (
    "Intervals hold 95 %. Shares have Wilson's interval, means the BCa bootstrap's, medians the percentile "
    "bootstrap's. A dash stands for an interval that the answers do not give: there is one, or all are alike.",
    "Scores of pairs are those of greatest likelihood in the model of Bradley and Terry with ties (Davidson 1970), "
    "on a logarithmic scale with mean 0: of two pictures that differ by 1, the better is preferred 2.7 times as "
    "often. Their intervals are percentiles over resampled people. Catch trials and repeats do not enter.",
    "Agreement is Krippendorff's α: 1 is full agreement, 0 that of chance. It takes questions with the same answers "
    "together. Each pair enters in both orders, so that the order of pictures in the study does not matter.",
    "Each question counts all who answered it, also those who did not finish the study.",
)


@dataclass(frozen=True)
class Printed:
    """A source's printed answers, for a table beside ours."""

    source: str
    people: int
    answers: dict[str, str | dict[str, str]]
    """Figures as they stand there, by question: a mean, or shares by option."""
    notes: dict[str, str]
    """Remarks on the figures, by question."""


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

    The folder is made where it is missing. The same answers give the same files,
    in whatever order they come. With `printed`, a source's figures
    stand beside ours. Raises `GreenswardError`.
    """
    came = {person.number for person in people}
    answers = in_order(answer for answer in answers if answer.person in came)
    parts = _parts(study, people, answers, printed)
    title = said(study, study.title)
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


def _parts(study: Study, people: Sequence[Person], answers: Sequence[Answer], printed: Printed | None) -> list[Part]:
    asked = {question.name: question for question in study.question}
    sound = [answer for answer in answers if _is_sound(asked.get(answer.question), answer)]
    out = statistics.left_out(study, sound)
    counted = [answer for answer in sound if answer.person not in out]
    parts = [_people(study, people, answers, out, len(answers) - len(sound)), *_rules(study, out)]
    if printed:
        parts.append(_beside(study, counted, printed))
    for question in study.question:
        mine = [answer for answer in counted if answer.question == question.name]
        parts.append(result(question, study, mine))
    if agreed := statistics.agreements(study, counted):
        rows = [(", ".join(each.questions), each.level, str(each.raters), figure(each.alpha, 3)) for each in agreed]
        parts.append(Part("Agreement", tables=[Table(("Questions", "Scale", "People", "α"), rows)]))
    return [*parts, Part("Methods", notes=list(_METHODS))]


def _is_sound(question: Question | None, answer: Answer) -> bool:
    """False for an answer to what the study does not, or no longer, ask."""
    if question is None:
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
) -> Part:
    by_person = groupby(sorted(answers, key=lambda each: each.person), key=lambda each: each.person)
    taken = {person: statistics.time_taken(given) for person, given in by_person}
    finished = {person.number for person in people if person.finished}
    minutes = [seconds / 60 for person, seconds in taken.items() if person in finished and seconds is not None]
    days = sorted(person.begun[:10] for person in people)
    spoken = Counter(person.language for person in people).most_common()
    languages = ", ".join(f"{LANGUAGES.get(code, code)} ({count})" for code, count in spoken)
    rows = [
        ("Began", str(len(people))),
        ("Answered something", str(len(taken))),
        ("Finished", str(len(finished))),
        ("Left out", str(len(out))),
        ("Counted", str(len(taken.keys() - out.keys()))),
    ]
    notes = []
    if people:
        notes.append(f"{' to '.join(dict.fromkeys((days[0], days[-1])))}, in {languages}.")
    if minutes:
        took = with_interval(statistics.median_of(minutes, study.seed), 1)
        notes.append(f"Who finished took {took} minutes in the median from the first answer to the last.")
    if unsound:
        notes.append(f"{unsound} answers to what the study no longer asks are left out.")
    return Part("Who answered", notes=notes, tables=[Table(("Who", "People"), rows)])


def _rules(study: Study, out: Mapping[int, Mapping[statistics.Rule, str]]) -> list[Part]:
    attention = study.attention
    choices = [question for question in study.question if isinstance(question, Choice)]
    pairs = [question for question in study.question if isinstance(question, Pairs)]
    applies: dict[statistics.Rule, bool] = {
        "catch trials": any(each.catches for each in pairs),
        "repeated pairs": attention.least_repeated > 0 and any(each.repeats for each in pairs),
        "time": attention.least_s > 0,
        "control": any(each.correct for each in choices),
    }
    bounds = {
        "most_caught": 100 * attention.most_caught,
        "least_repeated": 100 * attention.least_repeated,
        "least_s": attention.least_s,
    }
    rows = [
        (_RULES[rule].format_map(bounds), str(sum(rule in broken for broken in out.values())))
        for rule, used in applies.items()
        if used
    ]
    if not rows:
        return [Part("Who is left out", notes=["Nobody: the study has no rule for it."])]
    note = "Rules of the study, said before anybody answered. Who breaks one is in no figure below."
    tables = [Table(("Rule", "People"), rows)]
    if out:
        told = [(str(person), "; ".join(broken.values())) for person, broken in out.items()]
        tables.append(Table(("Person", "What they did"), *bounded(told)))
    return [Part("Who is left out", notes=[note], tables=tables)]


def _beside(study: Study, counted: Sequence[Answer], printed: Printed) -> Part:
    """The source's table and ours; ours has as many decimals as the source's."""
    rows, notes = [], []
    for question in study.question:
        figures = printed.answers.get(question.name)
        if figures is None:
            continue
        mine = [answer for answer in counted if answer.question == question.name]
        told = [brief(said(study, question.text))]
        if isinstance(figures, str):
            values = numbers(mine) if isinstance(question, Score | Quantity) else []
            ours = statistics.mean_of(values, study.seed)
            of = "mean" if isinstance(question, Score | Quantity) else ""
            rows.append((told.pop(), of, figures, with_interval(ours, _decimals(figures))))
        elif isinstance(question, Choice):
            parts, whole = tally(question, mine)
            for option in question.options:
                if stands := figures.get(option.value):
                    share = statistics.share_of(parts[option.value], whole)
                    text = percent(share, _decimals(stands))
                    rows.append((told.pop() if told else "", brief(said(study, option.text)), stands, text))
        if note := printed.notes.get(question.name):
            notes.append(f"{question.name}: {note}")
    head = ("Question", "Answer", f"Source ({printed.people} people)", "Here (95 % interval)")
    if notes:
        notes.insert(0, "Remarks on what the source printed:")
    return Part(f"Beside {printed.source}", notes=notes, tables=[Table(head, rows)])


def _decimals(figure: str) -> int:
    found = re.search(r"\d+\.?(\d*)", figure)
    return len(found[1]) if found else 1


# The page and Markdown --------------------------------------------------------------------------------------


def _plot_file(part: Part) -> str:
    return f"plot-{part.name}.svg"


def _html(title: str, parts: Sequence[Part]) -> str:
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

    def inlined(part: Part) -> Markup:
        assert part.plot
        svg = plots.inlined(part.plot.svg, part.name)
        return Markup(svg.replace("<svg", f'<svg role="img" aria-label="{escape(part.plot.alt)}"', 1))

    return str(environment.get_template("report.html.j2").render(title=title, parts=parts, inlined=inlined))


def _markdown(title: str, parts: Sequence[Part]) -> str:
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
