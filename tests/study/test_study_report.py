"""The report: what it says of known answers, what it makes of strangers' texts, and the source's figures."""

import csv
import dataclasses
import io
import re
import sys
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from greensward.scene import GreenswardError, InputError
from greensward.study import plots, report, statistics
from greensward.study.export import export_answers
from greensward.study.model import Study
from greensward.study.plan import TIE, Answer, Person, Stairs
from greensward.study.report import printed_tables, write_report

HOSTILE = '<script>alert(1)</script> & "quotes" | `code` *bold* [x](y) ![z](w)\n=1+1'


def options(*values):
    return [{"value": value, "text": f"{value} it is"} for value in values]


def study(**keys):
    names = ["meadow", "plain", "flat", "good", "bad", "ref", "l1", "l2", "l3", "l4", "l5"]
    questions = [
        {"kind": "choice", "name": "sum", "text": "How much is two plus two?", "options": options("3", "4"),
         "correct": "4"},
        {"kind": "number", "name": "age", "text": "Age", "most": 150},
        {"kind": "choice", "name": "best", "text": {"en": "Which image is best?", "de": "Welches Bild?"},
         "options": options("image-1", "image-2", "image-3")},
        {"kind": "choice", "name": "kinds", "text": "Which patterns?", "many": True, "other": True,
         "options": options("rotation", "colour"), "required": False},
        {"kind": "score", "name": "close", "text": "How does the grass look in close view?",
         "least_text": "very bad", "most_text": "very good"},
        {"kind": "score", "name": "far", "text": "How does the grass look in the distance?"},
        {"kind": "pairs", "name": "which", "text": "Which is more like a photograph?", "ties": True, "repeats": 1,
         "pictures": ["meadow", "plain", "flat"], "catches": [["good", "bad"]]},
        {"kind": "staircase", "name": "jnd", "text": "Which one differs?", "reference": "ref",
         "levels": ["l1", "l2", "l3", "l4", "l5"], "sizes": [0.5, 1, 2, 4, 8]},
        {"kind": "text", "name": "comments", "text": "Other feedback", "required": False},
    ]  # fmt: skip
    attention = {"most_caught": 0.25, "least_repeated": 0.5}
    pictures = [{"name": name, "file": f"{name}.png"} for name in names]
    made = {"title": {"en": "Grass & <ground>", "de": "Gras"}, "consent": "c", "languages": ["de", "en"]}
    return Study(**(made | {"attention": attention, "picture": pictures, "question": questions} | keys))


def simulated(count=40, careless=3):
    """People who prefer meadow to plain to flat, and the last of whom do not look."""
    random = np.random.default_rng(5)
    worth = {"meadow": 1.2, "plain": 0.2, "flat": -1.4, "good": 6.0, "bad": -6.0}
    people, answers = [], []
    asked = study()
    for number in range(1, count + 1):
        looks = number <= count - careless
        done = number % 10 != 0
        begun = f"2026-11-{1 + number % 20:02}T10:00:00Z"
        people.append(Person(number, "de" if number % 4 == 0 else "en", begun, begun if done else None))

        def give(question, value, shown=(), role="plain", trial=0, other="", number=number):
            at = f"2026-12-01T10:{number % 60:02}:{len(answers) % 60:02}Z"
            answers.append(Answer(number, question, trial, role, tuple(shown), value, other, 2.0, at))

        give("sum", "4" if number != 1 else "3")
        give("age", int(random.integers(18, 60)))
        give("best", f"image-{random.choice([1, 2, 2, 2, 3])}")
        ticked = [name for name in ("rotation", "colour") if random.random() < 0.4]
        give("kinds", ticked or None, other=HOSTILE if number == 3 else "")
        give("close", int(random.integers(2, 6)))
        if not done:
            continue
        give("far", int(np.clip(random.normal(3.8, 1), 1, 5)))
        for trial, pair in enumerate([("meadow", "plain"), ("flat", "plain"), ("meadow", "flat")]):
            odds = np.exp((worth[pair[0]] - worth[pair[1]]) / 2)
            chances = np.array([odds, 1 / odds, 0.5])
            drawn = random.choice([*pair, TIE], p=chances / chances.sum())
            give("which", str(drawn), pair, trial=trial)
            if trial == 0:
                give("which", str(drawn), pair[::-1], "repeat", 3)
        give("which", "good" if looks else "bad", ("bad", "good"), "catch", 4)
        state = Stairs(asked.question_of("jnd"))
        trial = 0
        while not state.ended:
            seen = random.random() < 0.5 + 0.5 / (1 + np.exp(-2 * (state.level - 1.5)))
            shown = (f"l{state.level + 1}", "ref")
            give("jnd", shown[0] if seen else "ref", shown, trial=trial)
            state.take(bool(seen))
            trial += 1
        give("comments", HOSTILE * 40 if number == 2 else None if number % 3 else f"Nice grass, {number}.")
    return people, answers


class Page(HTMLParser):
    """Elements of a page, and its text."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.text, self.attributes, self.ids = [], "", [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [name for name, _ in attrs]
        self.ids += [value for name, value in attrs if name == "id"]

    def handle_data(self, data):
        self.text += data


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report") / "new"
    people, answers = simulated()
    return folder, write_report(study(), people, answers, folder)


def test_a_report_is_a_page_markdown_plots_and_raw_answers(made):
    folder, written = made
    names = [path.name for path in written]
    plots = ["plot-age.svg", "plot-close.svg", "plot-far.svg", "plot-which.svg", "plot-jnd.svg"]
    assert names == ["report.html", "report.md", *plots, "answers.csv", "answers.parquet"]
    assert {path.name for path in folder.iterdir()} == set(names)
    markdown = (folder / "report.md").read_text(encoding="utf-8")
    assert all(f"]({name})" in markdown for name in plots)


def test_the_page_needs_nothing_else_and_strangers_texts_are_only_texts(made):
    text = (made[0] / "report.html").read_text(encoding="utf-8")
    page = Page(text)
    assert not {"script", "img", "link", "iframe", "b"} & set(page.tags)
    assert not [name for name in page.attributes if name.startswith("on") or name == "src"]
    assert all(found.startswith("#") for found in re.findall(r'href="([^"]*)"', text))
    assert '<script>alert(1)</script> & "quotes"' in page.text
    assert "<h1>Grass &amp; &lt;ground&gt;</h1>" in text
    assert len(page.ids) == len(set(page.ids))
    assert page.tags.count("svg") - text.count('class="bar"') == 5


def test_markdown_has_no_marks_of_strangers(made):
    text = (made[0] / "report.md").read_text(encoding="utf-8")
    assert "<script" not in text
    assert r"\*bold\* \[x\](y) \!\[z\](w) =1+1" in text
    for line in text.splitlines():
        if line.startswith("|"):
            assert line.startswith("| ")
            assert line.endswith(" |")


def test_long_answers_are_cut_in_the_page_and_complete_in_the_file(made):
    page = (made[0] / "report.html").read_text(encoding="utf-8")
    assert "…" in page
    assert page.count("alert(1)") < 20
    with (made[0] / "answers.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert HOSTILE * 40 in [row["value"] for row in rows]
    assert len(rows) == len(simulated()[1])


def test_it_says_who_answered_and_who_is_left_out_by_which_rule(made):
    text = (made[0] / "report.md").read_text(encoding="utf-8")
    # the three careless are 38 to 40, and 40 did not come to the catch trial; 1 got the sum wrong
    for line in (
        "| Began | 40 |", "| Finished | 36 |", "| Left out | 3 |", "| Counted | 37 |",
        "2026-11-01 to 2026-11-20, in English (30), Deutsch (10).",
        "| more than 25 % of the catch trials wrong | 2 |", "| a control question answered wrongly | 1 |",
        "| less than 50 % of the repeated pairs answered alike | 0 |",
        "| 1 | sum not answered by 4 |", "| 38 | 1 of 1 catch trials wrong |",
    ):  # fmt: skip
        assert line in text


def test_its_figures_are_those_of_the_answers(made):
    text = (made[0] / "report.md").read_text(encoding="utf-8")
    _, answers = simulated()
    counted = [answer for answer in answers if answer.person not in (1, 38, 39)]
    close = [answer.value for answer in counted if answer.question == "close"]
    assert f"| Mean | {np.mean(close):.2f} |" in text
    assert f"| Standard deviation | {np.std(close, ddof=1):.2f} |" in text
    best = [answer.value for answer in counted if answer.question == "best"]
    two = best.count("image-2")
    assert f"| image-2 it is | {two} | {100 * two / 37:.1f} |" in text
    order = [text.index(f"\n| {name} |") for name in ("meadow", "plain", "flat")]
    assert order == sorted(order)
    kinds = [answer for answer in counted if answer.question == "kinds"]
    colour = sum("colour" in (answer.value or []) for answer in kinds)
    assert f"| colour it is | {colour} | {100 * colour / 37:.1f} |" in text
    assert "| in own words | 1 | 2.7 |" in text


def test_the_same_answers_give_the_same_bytes(made, tmp_path):
    people, answers = simulated()
    for name in [path.name for path in write_report(study(), people[::-1], answers[::-1], tmp_path)]:
        assert (tmp_path / name).read_bytes() == (made[0] / name).read_bytes()


def test_nobody_yet_is_a_report_too(tmp_path):
    write_report(study(), [], [], tmp_path)
    assert "Nobody answered." in (tmp_path / "report.md").read_text(encoding="utf-8")
    write_report(study(), [Person(1, "sv", "2026-01-01T00:00:00Z")], [], tmp_path)
    text = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert "2026-01-01, in Svenska (1)." in text
    assert (tmp_path / "answers.csv").read_text(encoding="utf-8").count("\n") == 1


def test_one_person_and_all_alike_leave_dashes(tmp_path):
    person = Person(1, "en", "2026-01-01T00:00:00Z")
    given = [
        Answer(1, "sum", 0, "plain", (), "4"), Answer(1, "close", 0, "plain", (), 3),
        Answer(1, "which", 0, "plain", ("meadow", "flat"), TIE),
        Answer(1, "jnd", 0, "plain", ("l5", "ref"), "l5"), Answer(1, "kinds", 0, "plain", (), None),
    ]  # fmt: skip
    write_report(study(), [person], given, tmp_path)
    text = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert "| Mean | 3.00 | – |" in text
    assert "No values." in text
    assert "turned too seldom for a threshold: 1." in text
    assert "No comparisons connect these groups" in text
    assert "nan" not in text


def test_numbers_far_apart_are_drawn_in_few_bars():
    values = [0.0, 1.0, 2.0, 1_000_000.0]
    svg = plots.histogram(values, statistics.mean_of(values), "number")
    assert len(svg) < 30_000


def test_answers_to_what_is_not_asked_are_told_and_not_counted(tmp_path):
    person = Person(1, "en", "2026-01-01T00:00:00Z")
    given = [
        Answer(1, "close", 0, "plain", (), 3), Answer(1, "close", 0, "plain", (), 99),
        Answer(1, "gone", 0, "plain", (), "x"), Answer(1, "which", 0, "plain", ("meadow", "unknown"), "unknown"),
        Answer(1, "which", 0, "plain", ("meadow",), "meadow"), Answer(1, "best", 0, "plain", (), "image-9"),
        Answer(2, "close", 0, "plain", (), 5),
    ]  # fmt: skip
    write_report(study(), [person], given, tmp_path)
    text = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert "5 answers to what the study no longer asks are left out." in text
    assert "| Mean | 3.00 | – |" in text
    # the deleted person's answer is nowhere
    assert "2," not in [line[:2] for line in (tmp_path / "answers.csv").read_text(encoding="utf-8").splitlines()]


def test_letters_that_no_file_can_hold_stop_nothing(tmp_path):
    person = Person(1, "en", "2026-01-01T00:00:00Z")
    write_report(study(), [person], [Answer(1, "comments", 0, "plain", (), "a\ud800b\x00\x1bc")], tmp_path)
    assert "a?b c" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_a_folder_that_cannot_be_made_is_told(tmp_path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(GreenswardError, match="cannot be made"):
        write_report(study(), [], [], tmp_path / "file" / "report")


@pytest.mark.parametrize("name", ["scipy.stats", "matplotlib", "jinja2", "krippendorff"])
def test_a_missing_library_is_told_and_nothing_is_written(name, tmp_path, monkeypatch):
    for each in [known for known in sys.modules if known == name or known.startswith(f"{name}.")]:
        monkeypatch.delitem(sys.modules, each)
    monkeypatch.setitem(sys.modules, name, None)
    people, answers = simulated()
    with pytest.raises(GreenswardError, match=rf'needs {name.split(".")[0]}.*pip install "greensward\[study\]"'):
        write_report(study(), people, answers, tmp_path / "new")
    assert not (tmp_path / "new").exists()


# Raw answers ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("text", ["=1+1", "+1", "-cmd|' /C calc'!A0", "@SUM(A1)", "\t=1", "\r\n=1", "  =1", "＝1"])
def test_csv_holds_no_formulas(text, tmp_path):
    person = Person(1, "en", "2026-01-01T00:00:00Z")
    given = [Answer(1, "q", 0, "plain", (), text, other=text)]
    export_answers(given, [person], tmp_path / "a.csv")
    (row,) = csv.DictReader(io.StringIO((tmp_path / "a.csv").read_bytes().decode(), newline=""))
    assert row["value"] == row["other"] == f"'{text}"


def test_csv_keeps_what_is_no_formula(tmp_path):
    person = Person(1, "en", "2026-01-01T00:00:00Z", "2026-01-01T00:05:00Z")
    given = [
        Answer(1, "a", 0, "plain", ("x", "y"), TIE), Answer(1, "b", 1, "plain", (), -5),
        Answer(1, "c", 2, "plain", (), None),
        Answer(1, "d", 3, "plain", (), ["p", "q"], 'say "hi", you', 1.5, ""),
    ]  # fmt: skip
    export_answers(given, [person], tmp_path / "a.csv")
    rows = list(csv.DictReader(io.StringIO((tmp_path / "a.csv").read_bytes().decode(), newline="")))
    assert [row["value"] for row in rows] == [TIE, "-5", "", "p q"]
    assert (rows[0]["shown"], rows[3]["other"], rows[3]["seconds"]) == ("x y", 'say "hi", you', "1.5")
    assert rows[0]["finished"] == "2026-01-01T00:05:00Z"


def test_parquet_holds_the_same_without_apostrophes(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    people, answers = simulated(6, 0)
    answers.append(Answer(1, "comments", 9, "plain", (), "=1"))
    export_answers(answers, people, tmp_path / "a.parquet")
    table = parquet.read_table(tmp_path / "a.parquet").to_pylist()
    assert len(table) == len(answers)
    assert {row["value"] for row in table} > {"=1", "4", None}
    assert type(table[0]["person"]) is int
    export_answers([], [], tmp_path / "none.parquet")
    assert parquet.read_table(tmp_path / "none.parquet").num_rows == 0


def test_a_file_of_another_kind_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"must end in \.csv or \.parquet"):
        export_answers([], [], tmp_path / "a.xlsx")


# The source's printed answers -------------------------------------------------------------------------------

COUNTS = {
    "tillman2013-first": {
        "gender": {"male": 20, "female": 1},
        "best": {"image-1": 5, "image-2": 9, "image-3": 7},
        "pattern-1": {"yes": 4, "no": 17},
        "pattern-2": {"yes": 4, "no": 17},
        "colour": {"darker": 9, "lighter": 1, "no": 11},
        "colour-variation": {"yes": 14, "no": 7},
        "width": {"thinner": 18, "wider": 0, "no": 3},
        "height": {"shorter": 5, "taller": 3, "no": 13},
        "height-variation": {"yes": 15, "no": 6},
        "variety": {"both": 16, "density": 2, "species": 1, "no": 2},
        # their lower ends add up to 280 and 203 hours
        "hours": {"h0": 1, "h1-5": 1, "h6-10": 1, "h11-15": 3, "h16": 15},
        "grass-hours": {"h0": 3, "h1-5": 3, "h6-10": 4, "h11-15": 0, "h16": 11},
    },
    "tillman2013-second": {
        "gender": {"male": 23, "female": 10},
        "pattern": {"near": 12, "far": 2, "between": 5, "no": 14},
        "pattern-kind": {"rotation": 15, "position": 7, "colour": 7, "height": 9},
        "colour-variation": {"yes": 14, "no": 19},
        "height-variation": {"yes": 18, "no": 15},
        "width": {"thinner": 27, "wider": 0, "no": 6},
        "colour": {"darker": 2, "lighter": 5, "no": 26},
        "height": {"shorter": 7, "taller": 3, "no": 23},
        "variety": {"both": 20, "density": 4, "species": 3, "no": 6},
    },
}
"""Whole people behind the printed percentages: those whose shares are nearest, and who together are all."""
CUT = {
    ("tillman2013-first", "colour", "lighter"): "4.7 %",
    ("tillman2013-first", "colour-variation", "yes"): "66.66 %",
    ("tillman2013-second", "pattern", "between"): "15.1 %",
    ("tillman2013-second", "colour", "lighter"): "15.1 %",
}
"""Printed figures that are cut and not rounded."""
IMPOSSIBLE = {
    ("tillman2013-first", "height", "taller"): "14.38 %",
    ("tillman2013-first", "height-variation", "yes"): "71.2 %",
    ("tillman2013-second", "gender", "male"): "70.0 %",
    ("tillman2013-second", "gender", "female"): "30.0 %",
    ("tillman2013-second", "pattern-kind", "rotation"): "44.5 %",
    ("tillman2013-second", "pattern-kind", "colour"): "22.2 %",
}
"""Printed figures that no whole number of people gives, rounded or cut."""


def decimals(figure):
    return len(figure.split()[0].partition(".")[2])


def number(figure):
    return float(figure.split()[0])


def source_study(name):
    """Questions of the source's names, and answers that give its figures."""
    printed, counts = printed_tables()[name], COUNTS[name]
    questions, answers = [], []

    def give(question, values):
        answers.extend(Answer(1 + k, question, 0, "plain", (), value) for k, value in enumerate(values))

    for question, figures in printed.answers.items():
        if question in counts:
            many = question == "pattern-kind"
            questions.append(
                {"kind": "choice", "name": question, "text": question, "many": many,
                 "options": [{"value": value, "text": value} for value in counts[question]]}
            )  # fmt: skip
            if many:
                ticked = [
                    [value for value, count in counts[question].items() if k < count] for k in range(printed.people)
                ]
                give(question, ticked)
            else:
                give(question, [value for value, count in counts[question].items() for _ in range(count)])
        else:
            most = 120 if question == "age" else 5
            questions.append(
                {"kind": "number" if most == 120 else "score", "name": question, "text": question, "most": most}
            )
            total = round(number(figures) * printed.people)
            low, more = divmod(total, printed.people)
            give(question, [low + (k < more) for k in range(printed.people)])
    people = [Person(1 + k, "en", "2013-05-01T00:00:00Z") for k in range(printed.people)]
    return Study(title=name, consent="c", question=questions), people, answers, printed


@pytest.mark.parametrize("name", COUNTS)
def test_the_sources_answers_fed_in_give_its_printed_tables(name, tmp_path):
    asked, people, answers, printed = source_study(name)
    write_report(asked, people, answers, tmp_path, printed)
    text = (tmp_path / "report.md").read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in line[1:-1].split(" | ")] for line in text.splitlines()]
    ours, question = {}, ""
    for row in [row for row in rows if len(row) == 4]:
        question = row[0] or question
        ours[question, row[1]] = row[2], row[3]
    told = 0
    for question, figures in printed.answers.items():
        for option, figure in figures.items() if isinstance(figures, dict) else [("mean", figures)]:
            if figure.startswith("mean "):
                continue
            stands, here = ours[question, option]
            assert stands == figure
            rounded = here.split(" (")[0]
            if (name, question, option) not in CUT | IMPOSSIBLE:
                assert rounded == figure
            else:
                assert rounded != figure
                assert question in printed.notes
            told += 1
    assert told == {"tillman2013-first": 25, "tillman2013-second": 34}[name]
    for note in printed.notes.values():
        assert note in text


@pytest.mark.parametrize(("where", "figure"), IMPOSSIBLE.items())
def test_no_number_of_people_gives_the_figures_that_contradict_themselves(where, figure):
    printed = printed_tables()[where[0]]
    assert printed.answers[where[1]][where[2]] == figure
    wholes = {printed.people, 19} if where[1] == "pattern-kind" else {printed.people}
    for whole in wholes:
        for part in range(whole + 1):
            assert abs(100 * part / whole - number(figure)) > 0.5 * 10.0 ** -decimals(figure)


@pytest.mark.parametrize(("where", "figure"), CUT.items())
def test_figures_that_are_cut_are_those_of_whole_people(where, figure):
    share = 100 * COUNTS[where[0]][where[1]][where[2]] / printed_tables()[where[0]].people
    assert np.trunc(share * 10 ** decimals(figure)) / 10 ** decimals(figure) == pytest.approx(number(figure))


@pytest.mark.parametrize("name", COUNTS)
def test_the_counts_behind_the_figures_are_all_people(name):
    people = printed_tables()[name].people
    assert {sum(each.values()) for key, each in COUNTS[name].items() if key != "pattern-kind"} == {people}


@pytest.mark.parametrize(("question", "hours"), [("hours", 13.33), ("grass-hours", 9.66)])
def test_lower_ends_of_classes_can_give_the_printed_hours(question, hours):
    ends = {"h0": 0, "h1-5": 1, "h6-10": 6, "h11-15": 11, "h16": 16}
    total = sum(ends[value] * count for value, count in COUNTS["tillman2013-first"][question].items())
    assert np.trunc(100 * total / 21) / 100 == hours


def test_sources_are_complete():
    for printed in printed_tables().values():
        assert printed.notes.keys() <= printed.answers.keys()
        assert dataclasses.asdict(printed)["people"] > 0
    assert report.printed_tables()["tillman2013-second"].answers["far"] == "3.70"


@pytest.mark.parametrize("name", COUNTS)
def test_the_documentation_shows_what_the_report_says(name, tmp_path):
    asked, people, answers, printed = source_study(name)
    write_report(asked, people, answers, tmp_path, printed)
    page = (Path(__file__).parents[2] / "docs" / "study.md").read_text(encoding="utf-8")
    assert documented(printed, (tmp_path / "report.md").read_text(encoding="utf-8")) in page


def documented(printed, report):
    """A report's table beside the source, without intervals: those of made answers mean nothing."""
    lines = report[report.index("## Beside ") :].splitlines()
    rows = [[cell.strip() for cell in line[1:-1].split(" | ")] for line in lines if line.startswith("| ")]
    rows = rows[: next((k for k, row in enumerate(rows) if len(row) != 4), None)]
    rows[0][2:] = [f"{printed.source}, {printed.people} people", "report"]
    shown = [row if row[3] == "–" else [*row[:3], row[3].split(" (")[0]] for row in rows]
    return "\n".join("| " + " | ".join(row) + " |" for row in shown).replace("|  |", "| |")
