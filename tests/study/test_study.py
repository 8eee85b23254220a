"""Studies: what a file may say, what a person is asked, and how pictures are drawn."""

import json
import re

import numpy as np
import pytest
from PIL import Image

from greensward.scene import SceneError
from greensward.study.model import Study, load_study, say, shipped
from greensward.study.pictures import draw, missing_pictures, to_draw
from greensward.study.plan import TIE, Answer, Stairs, Trial, pages, problem_of, threshold

_PICTURES = [{"name": f"p{i}", "scene": "meadow"} for i in range(6)]
_OPTIONS = [{"value": "a", "text": "A"}, {"value": "b", "text": "B"}]


def _study(*questions, **keys):
    return Study(title="T", consent="C", picture=_PICTURES, question=list(questions), **keys)


def _question(kind, **keys):
    return {"name": "q", "kind": kind, "text": "?", **keys}


def _answer(trial, value):
    return Answer(1, trial.question.name, trial.number, trial.role, trial.shown, value)


# Files ------------------------------------------------------------------------------------------------------


def test_the_shipped_studies_are_the_sources_questionnaires():
    studies = {name: load_study(file) for name, file in shipped().items()}
    first, second = (studies[f"tillman2013-{which}"] for which in ("first", "second"))
    assert len(first.question) == 22
    assert len(second.question) == 17
    for study in (first, second):
        assert study.languages == ("en", "de", "sv")
        assert all(say(question.text, "sv") != say(question.text, "en") for question in study.question)
        assert to_draw(study, shipped()["tillman2013-first"].parent)  # each scene and setting is known
    assert first.question_of("sum").correct == "4"


@pytest.mark.parametrize(
    ("question", "problem"),
    [
        (_question("choice", options=[_OPTIONS[0]] * 2), 'question[0]: options must have values that differ'),
        (_question("choice", options=_OPTIONS, correct="c"), 'correct must be the value of an option (got "c")'),
        (_question("choice", options=_OPTIONS[:1]), "question[0].options: must hold at least 2 values (got 1)"),
        (_question("score", least=5, most=5), "question[0]: most must be above least (got 5 and 5)"),
        (_question("score", show=["nothing"]), 'question[0]: no picture has the name "nothing"; add'),
        (_question("pairs", pictures=["p0", "p0"]), 'pictures must differ (got "p0" twice)'),
        (_question("pairs", pictures=["p0", "p1"], repeats=2), "repeats must be at most 1, the number of pairs"),
        (_question("staircase", reference="p0", levels=["p0", "p1"]), "levels must differ from each other and from"),
        (_question("staircase", reference="p0", levels=["p1", "p2"], sizes=[2.0, 1.0]), "sizes must rise"),
        (_question("guess"), 'question[0].kind: must be one of choice, score'),
        ({**_question("text"), "text": {"de": "?"}}, "question[0].text: has no text for the language en"),
        ({**_question("text"), "name": "Q 1"}, "question[0].name:"),
        ({**_question("text"), "colour": 1}, "question[0].colour: unknown key"),
    ],
)  # fmt: skip
def test_a_wrong_study_is_refused_in_a_sentence(tmp_path, question, problem):
    tomli_w = pytest.importorskip("tomli_w")
    file = tmp_path / "study.toml"
    file.write_text(tomli_w.dumps({"title": "T", "consent": "C", "picture": _PICTURES, "question": [question]}))
    with pytest.raises(SceneError, match=f"^{re.escape(str(file))}: .*{re.escape(problem)}"):
        load_study(tmp_path)


def test_names_differ():
    with pytest.raises(SceneError, match='question: names must differ \\(got "q" twice\\)'):
        _study(_question("text"), _question("text"))
    with pytest.raises(SceneError, match='picture: names must differ \\(got "p0" twice\\)'):
        Study(title="T", consent="C", picture=[_PICTURES[0]] * 2, question=[_question("text")])


def test_a_folder_without_a_study_says_how_to_begin(tmp_path):
    with pytest.raises(SceneError, match=r"holds no study\.toml; `greensward study new` writes one"):
        load_study(tmp_path)


# What is asked ----------------------------------------------------------------------------------------------


def test_questions_of_one_page_are_asked_together():
    placed = {"a": "x", "b": "x", "c": "", "d": "x"}
    study = _study(*({"kind": "text", "text": "?", "name": name, "page": page} for name, page in placed.items()))
    found = [[trial.question.name for trial in page.trials] for page in pages(study, 1, {})]
    assert found == [["a", "b"], ["c"], ["d"]]


def test_pairs_come_in_an_order_of_the_persons_own():
    question = _question("pairs", pictures=["p0", "p1", "p2", "p3"], repeats=2, catches=[("p4", "p5")])
    study = _study(question)
    asked = {person: [page.trials[0] for page in pages(study, person, {})] for person in range(1, 200)}
    for trials in asked.values():
        assert [trial.number for trial in trials] == list(range(9))
        roles = [trial.role for trial in trials]
        assert (roles.count("plain"), roles.count("catch"), roles[-2:]) == (6, 1, ["repeat", "repeat"])
        assert len({frozenset(trial.shown) for trial in trials if trial.role == "plain"}) == 6
        before = {frozenset(trial.shown): trial.shown for trial in trials if trial.role == "plain"}
        for trial in trials[-2:]:
            assert trial.shown == before[frozenset(trial.shown)][::-1]
    first = [trials[0].shown for trials in asked.values()]
    assert len(set(first)) > 10
    left = np.mean([shown[0] < shown[1] for trials in asked.values() for shown in [trial.shown for trial in trials]])
    assert 0.45 < left < 0.55
    assert pages(study, 5, {}) == pages(study, 5, {})


def test_each_person_sees_some_of_the_pairs():
    study = _study(_question("pairs", pictures=["p0", "p1", "p2", "p3"], per_person=2))
    assert {len(pages(study, person, {})) for person in range(20)} == {2}


_STAIRS = _question(
    "staircase", reference="p0", levels=["p1", "p2", "p3", "p4"], sizes=[1.0, 2.0, 4.0, 8.0], reversals=4
)


def _climbed(study, sees, person=1):
    """Answers of a person who sees levels from a size on, and else takes the left."""
    answers = {}
    while True:
        trial = pages(study, person, answers)[-1].trials[0]
        if trial.key in answers:
            return answers
        level = next(name for name in trial.shown if name != "p0")
        answers[trial.key] = _answer(trial, level if sees(level, len(answers)) else "p0")


def test_a_staircase_comes_to_what_a_person_just_sees():
    study = _study(_STAIRS)
    (stairs,) = study.question
    answers = list(_climbed(study, lambda level, _: level >= "p3").values())
    levels = [next(name for name in answer.shown if name != "p0") for answer in answers]
    assert levels == ["p4", "p4", "p3", "p3", "p2", "p3", "p3", "p2", "p3", "p3"]
    assert threshold(stairs, answers) == 3.0  # turns at p2 and p3: 2 and 4
    assert threshold(stairs, answers[:5]) is None
    everything = list(_climbed(study, lambda *_: True).values())
    assert len(everything) == stairs.most  # it never turns, and ends
    assert threshold(stairs, everything) is None


def test_a_staircase_of_chance_finds_the_share_that_levitt_names():
    """Of a person with a psychometric function, 2 down and 1 up end where 71 % are right (Levitt 1971, table I)."""
    levels = [f"l{i:02}" for i in range(40)]
    pictures = [{"name": name, "scene": "meadow"} for name in ["p0", *levels]]
    question = _question("staircase", reference="p0", levels=levels, reversals=30, most=200)
    study = Study(title="T", consent="C", picture=pictures, question=[question])
    random, found = np.random.default_rng(3), []
    for _ in range(40):
        state = Stairs(study.question[0])
        while not state.ended:
            state.take(random.random() < 0.5 + 0.5 / (1.0 + np.exp(-(state.level - 20.0) / 3.0)))
        found.append(np.mean(state.turns[2:]))
    at = float(np.mean(found))
    assert 0.5 + 0.5 / (1.0 + np.exp(-(at - 20.0) / 3.0)) == pytest.approx(0.707, abs=0.03)


@pytest.mark.parametrize(
    ("question", "shown", "good", "bad"),
    [
        (_question("number", least=1, most=9), (), [1, 9], [0, 10, "1", 1.0, True, [1]]),
        (_question("score"), (), [1, 5], [0, 6, "3"]),
        (_question("choice", options=_OPTIONS), (), ["a"], ["c", ["a"], 1]),
        (_question("choice", options=_OPTIONS, many=True), (), [["a"], ["a", "b"]], ["a", ["c"], ["a", "a"], [1]]),
        (_question("text"), (), ["x"], [1, ["x"]]),
        (_question("pairs", pictures=["p0", "p1", "p2"]), ("p0", "p1"), ["p0", "p1"], ["p2", TIE, 1, ["p0"]]),
        (_question("pairs", pictures=["p0", "p1"], ties=True), ("p0", "p1"), [TIE], ["left"]),
        (_STAIRS, ("p0", "p1"), ["p0", "p1"], ["p2", TIE]),
    ],
)
def test_only_what_was_offered_is_an_answer(question, shown, good, bad):
    trial = Trial(_study(question).question[0], shown=shown)
    assert {problem_of(trial, value) for value in good} == {""}
    assert {problem_of(trial, value) for value in bad} == {"not_offered"}
    assert problem_of(trial, None) == "required"
    assert problem_of(trial, good[0], "more") == "not_offered"


def test_words_beside_the_options():
    question = _question("choice", options=_OPTIONS, many=True, other=True)
    trial = Trial(_study(question).question[0])
    assert problem_of(trial, None, "moss") == ""
    assert problem_of(trial, ["a"], "moss") == ""
    assert problem_of(trial, ["a"], "m" * 4001) == "too_long"
    assert problem_of(Trial(_study(_question("text", required=False)).question[0]), None) == ""


# Pictures ---------------------------------------------------------------------------------------------------

_SMALL = """
title = "T"
consent = "C"
size = [64, 64]
[[picture]]
name = "hill"
scene = "small.toml"
samples = 1
lines = [{ at = 0.5, colour = "#ff0000" }]
[[picture]]
name = "photograph"
file = "photo.jpg"
[[question]]
name = "good"
kind = "score"
text = "Is it?"
show = ["hill", "photograph"]
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "study.toml").write_text(_SMALL)
    (tmp_path / "small.toml").write_text("[sowing]\ndensity_per_m2 = 5\nreach_m = 10\n[shadows]\nenabled = false\n")
    Image.new("RGB", (64, 64), (9, 90, 9)).save(tmp_path / "photo.jpg")
    return tmp_path


def test_pictures_are_drawn_once_and_again_when_they_change(folder):
    study = load_study(folder)
    assert missing_pictures(study, folder) == ["hill"]
    for each in to_draw(study, folder):
        draw(study, folder, each, device="cpu")
    assert missing_pictures(study, folder) == []
    image = np.asarray(Image.open(folder / "pictures" / "hill.png"))
    assert image.shape == (64, 64, 3)
    assert (image[31:33] == (255, 0, 0)).all()
    assert json.loads((folder / "pictures" / "made.json").read_text()).keys() == {"hill.png"}
    assert to_draw(study, folder) == []
    assert len(to_draw(study, folder, again=True)) == 1
    with (folder / "small.toml").open("a") as file:
        file.write("[sky]\nclouds = 0.9\n")
    assert len(to_draw(study, folder)) == 1


def test_a_clip_is_drawn_into_a_new_folder(folder):
    pytest.importorskip("imageio_ffmpeg")
    with (folder / "study.toml").open("a") as file:
        file.write('[[picture]]\nname = "wind"\nscene = "small.toml"\nsamples = 1\nseconds = 0.1\n')
    study = load_study(folder)
    for each in to_draw(study, folder):
        draw(study, folder, each, device="cpu")
    assert (missing_pictures(study, folder), to_draw(study, folder)) == ([], [])
    assert (folder / "pictures" / "wind.mp4").stat().st_size > 500


def test_all_that_is_wrong_with_pictures_is_said_before_any_is_drawn(folder):
    (folder / "small.toml").write_text("[sky]\ncloud = 1\n")
    (folder / "photo.jpg").unlink()
    with pytest.raises(SceneError) as caught:
        to_draw(load_study(folder), folder)
    first, second = caught.value.problems
    assert first.startswith(f"picture[0]: {folder / 'small.toml'}: sky.cloud: unknown key; did you mean clouds?")
    assert second == f"picture[1].file: no file photo.jpg is in {folder}"
