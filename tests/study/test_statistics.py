"""Statistics against closed forms, SciPy and published examples."""

import numpy as np
import pytest
from scipy import optimize, stats

from greensward.study import statistics
from greensward.study.model import Study
from greensward.study.plan import TIE, Answer

MISSING = np.nan


def answer(person, question, value, shown=(), role="plain", trial=0, at=""):
    return Answer(person, question, trial, role, tuple(shown), value, at=at)


def pairs_study(names="abcd", **keys):
    pictures = [{"name": name, "file": f"{name}.png"} for name in {*names, "good", "bad"}]
    pairs = {"kind": "pairs", "name": "which", "text": "Which?", "pictures": list(names), "ties": True, **keys}
    attention = {"most_caught": 0.25, "least_repeated": 0.5, "least_s": 60}
    return Study(title="t", consent="c", attention=attention, picture=pictures, question=[pairs])


# Who is left out --------------------------------------------------------------------------------------------


def caught(person, wrong, of):
    return [answer(person, "which", "bad" if k < wrong else "good", ("good", "bad"), "catch", k) for k in range(of)]


@pytest.mark.parametrize(("wrong", "of", "out"), [(0, 4, False), (1, 4, False), (2, 4, True), (1, 3, True)])
def test_more_wrong_catch_trials_than_the_rule_leave_out(wrong, of, out):
    study = pairs_study(catches=[("good", "bad")])
    found = statistics.left_out(study, caught(7, wrong, of) + caught(8, 0, 4))
    assert found == ({7: {"catch trials": f"{wrong} of {of} catch trials wrong"}} if out else {})


def test_no_difference_is_wrong_in_a_catch_trial_and_a_skipped_one_is_no_answer():
    study = pairs_study(catches=[("good", "bad")])
    shown = ("bad", "good")
    assert 1 in statistics.left_out(study, [answer(1, "which", TIE, shown, "catch")])
    assert statistics.left_out(study, [answer(1, "which", None, shown, "catch")]) == {}


def test_repeats_answered_otherwise_leave_out():
    study = pairs_study(repeats=2)
    given = [answer(1, "which", "a", "ab"), answer(1, "which", "b", "bc", trial=1)]
    alike = answer(1, "which", "a", "ba", "repeat", 2)
    other, third = (answer(1, "which", TIE, "cb", "repeat", 3), answer(1, "which", "c", "cb", "repeat", 3))
    assert statistics.left_out(study, [*given, alike, other]) == {}
    assert statistics.left_out(study, [*given, other, third])[1] == {
        "repeated pairs": "0 of 2 repeated pairs answered alike"
    }


def test_haste_leaves_out():
    study = pairs_study()
    begin = "2026-12-01T10:00:00Z"
    assert statistics.left_out(
        study,
        [
            answer(1, "which", "a", "ab", at=begin),
            answer(1, "which", "a", "ac", at="2026-12-01T10:00:59Z"),
            answer(2, "which", "a", "ab", at=begin),
            answer(2, "which", "a", "ac", at="2026-12-01T10:01:00Z"),
        ],
    ) == {1: {"time": "59 s from the first answer to the last"}}


def test_a_control_question_leaves_out_who_answers_otherwise_or_skips_it():
    options = [{"value": value, "text": value} for value in ("3", "4", "5")]
    question = {"kind": "choice", "name": "sum", "text": "2 + 2?", "options": options, "correct": "4"}
    study = Study(title="t", consent="c", question=[question])
    given = [answer(1, "sum", "4"), answer(2, "sum", "5"), answer(3, "sum", None)]
    assert list(statistics.left_out(study, given)) == [2, 3]


# Means and shares -------------------------------------------------------------------------------------------


def test_shares_have_wilsons_interval():
    found = statistics.share_of(5, 21)
    z, p, n = stats.norm.ppf(0.975), 5 / 21, 21
    middle, half = (p + z * z / 2 / n), z * np.sqrt(p * (1 - p) / n + z * z / 4 / n**2)
    assert (found.value, found.count) == (p, 21)
    assert (found.low, found.high) == pytest.approx(
        ((middle - half) / (1 + z * z / n), (middle + half) / (1 + z * z / n))
    )
    assert statistics.share_of(0, 9).low == 0
    assert statistics.share_of(0, 0) is None


def test_means_have_the_intervals_of_scipys_bootstrap():
    values = np.random.default_rng(4).integers(1, 6, 33)
    found = statistics.mean_of(list(values), seed=3)
    theirs = stats.bootstrap((values,), np.mean, method="BCa", rng=np.random.default_rng(3)).confidence_interval
    assert (found.value, found.low, found.high) == pytest.approx((values.mean(), theirs.low, theirs.high))
    assert found == statistics.mean_of(list(values), seed=3)
    close = stats.t.interval(0.95, 32, values.mean(), stats.sem(values))
    assert (found.low, found.high) == pytest.approx(close, abs=0.08)


def test_the_interval_of_means_holds_the_truth_about_as_often_as_it_says():
    random = np.random.default_rng(0)
    held = 0
    for _ in range(200):
        found = statistics.mean_of(list(random.normal(3, 1, 30)))
        held += found.low <= 3 <= found.high
    assert 0.88 <= held / 200 <= 0.99


@pytest.mark.parametrize("of", [statistics.mean_of, statistics.median_of])
def test_one_answer_and_equal_ones_leave_no_interval(of):
    assert of([]) is None
    assert of([4]) == statistics.Estimate(4.0, None, None, 1)
    assert of([4, 4, 4]) == statistics.Estimate(4.0, None, None, 3)
    found = of([1, 1, 1, 5])
    assert found.low <= found.value <= found.high
    assert np.isfinite((found.low, found.high)).all()


# Pairs ------------------------------------------------------------------------------------------------------

TEAMS = ("milwaukee", "detroit", "toronto", "new-york", "boston", "cleveland", "baltimore")
BASEBALL = np.array([
    [0, 7, 9, 7, 7, 9, 11], [6, 0, 7, 5, 11, 9, 9], [4, 6, 0, 7, 7, 8, 12], [6, 8, 6, 0, 6, 7, 10],
    [6, 2, 6, 7, 0, 7, 12], [4, 4, 5, 6, 6, 0, 6], [2, 4, 1, 3, 1, 7, 0],
])  # fmt: skip
"""Wins of the row's team over the column's, American League 1987 (Agresti, Categorical Data Analysis, 2nd edition,
section 10.6)."""
PUDDINGS = """
0 1 19 22 16   0 2 16 19 12   1 2 19 19 10   0 3 18 23 13   1 3 23 19 9    2 3 19 20 15   0 4 13 19 18   1 4 16 20 12
2 4 16 15 17   3 4 17 14 16   0 5 18 21 12   1 5 22 20 12   2 5 13 18 10   3 5 14 19 18   4 5 11 21 12
"""
"""Two brands, preferences for the first and for the second, and ties, of Davidson 1970."""


def tallies(text, size):
    wins, ties = np.zeros((1, size, size)), np.zeros((1, size, size))
    for i, j, first, second, equal in np.array(text.split(), int).reshape(-1, 5):
        wins[0, i, j], wins[0, j, i] = first, second
        ties[0, i, j] = ties[0, j, i] = equal
    return wins, ties


def test_scores_are_those_that_agresti_prints():
    scores, nu = statistics.most_likely(BASEBALL[None].astype(float), np.zeros((1, 7, 7)))
    # table 10.11, relative to Baltimore
    assert (scores[0] - scores[0, 6]).round(2).tolist() == [1.58, 1.44, 1.29, 1.25, 1.11, 0.68, 0.0]
    assert nu[0] == 0


def test_scores_with_ties_are_those_that_davidson_prints():
    scores, nu = statistics.most_likely(*tallies(PUDDINGS, 6))
    worth = np.exp(scores[0]) / np.exp(scores[0]).sum()
    # his iterations ended a little before the maximum
    assert worth == pytest.approx([0.1388005, 0.1729985, 0.1617420, 0.1653930, 0.1586805, 0.2023855], abs=3e-5)
    assert nu[0] == pytest.approx(0.7468147, abs=3e-5)


def likelihood(x, wins, ties):
    half = (x[:-1, None] - x[None, :-1]) / 2
    whole = np.logaddexp(np.logaddexp(half, -half), x[-1])
    return (wins * (half - whole)).sum() + (ties * (x[-1] - whole)).sum() / 2


def test_scores_are_where_another_optimisation_finds_them():
    wins, ties = tallies(PUDDINGS, 6)
    theirs = optimize.minimize(lambda x: -likelihood(x, wins[0], ties[0]), np.zeros(7), tol=1e-12).x
    scores, nu = statistics.most_likely(wins, ties)
    assert scores[0] == pytest.approx(theirs[:6] - theirs[:6].mean(), abs=1e-4)
    assert np.log(nu[0]) == pytest.approx(theirs[6], abs=1e-4)


@pytest.mark.parametrize("spread", [0.3, 2.0, 6.0])
@pytest.mark.parametrize("nu", [0.2, 5.0])
def test_the_slope_is_nought_at_the_scores_of_any_tallies(spread, nu):
    random = np.random.default_rng(round(10 * spread + nu))
    wins, ties = np.zeros((40, 5, 5)), np.zeros((40, 5, 5))
    true = random.normal(0, spread, (40, 5))
    for b in range(40):
        for i in range(5):
            for j in range(i):
                odds = np.exp((true[b, i] - true[b, j]) / 2)
                chances = np.array([odds, 1 / odds, nu])
                won, lost, equal = random.multinomial(random.integers(1, 60), chances / chances.sum())
                # each picture wins once, so that finite scores exist
                wins[b, i, j], wins[b, j, i], ties[b, i, j], ties[b, j, i] = won + 1, lost + 1, equal, equal
        ties[b, 0, 1] = ties[b, 1, 0] = ties[b, 0, 1] + 1
    scores, found = statistics.most_likely(wins, ties)
    for b in range(40):
        at = np.append(scores[b], np.log(found[b]))
        slope = optimize.approx_fprime(at, likelihood, 1e-6, wins[b], ties[b])
        assert np.abs(slope).max() < 0.02
        assert scores[b].mean() == pytest.approx(0, abs=1e-12)


def given(wins, ties=None, names="abcd", people=10):
    """Answers of as many people, each of whom gives an equal part."""
    found = []
    for table, equal in ((np.asarray(wins), False), (np.triu(np.zeros(2) if ties is None else ties), True)):
        for i, j in zip(*np.nonzero(table), strict=True):
            for k in range(int(table[i, j])):
                value = TIE if equal else names[i]
                found.append(answer(k % people, "which", value, (names[i], names[j]), trial=len(found)))
    return found


def test_answers_give_the_scores_of_their_tallies_and_neither_catches_nor_repeats_enter():
    study = pairs_study(TEAMS)
    plain = given(BASEBALL, names=TEAMS)
    more = [answer(1, "which", "baltimore", ("baltimore", "boston"), role) for role in ("repeat", "catch")]
    skipped = [answer(1, "which", None, ("baltimore", "boston"))]
    found = statistics.ranking(study.question[0], plain + more + skipped)
    assert list(found.scores) == list(TEAMS)
    values = [score.value for score in found.scores.values()]
    assert np.mean(values) == pytest.approx(0, abs=1e-12)
    assert [round(value - values[-1], 2) for value in values] == [1.58, 1.44, 1.29, 1.25, 1.11, 0.68, 0.0]
    assert found.counts["boston"] == (40, 0, 38)
    assert all(score.low < score.value < score.high and score.count == 10 for score in found.scores.values())
    assert (found.steadied, found.groups) == (False, (TEAMS,))
    assert found == statistics.ranking(study.question[0], plain)


def test_intervals_are_over_people_and_not_over_answers():
    # that each of ten people answers ten times alike tells no more than that each answers once
    once = [answer(k, "which", "a" if k < 6 else "b", "ab") for k in range(10)]
    question = pairs_study("ab").question[0]
    single, often = (statistics.ranking(question, answers).scores["a"] for answers in (once, once * 10))
    assert (often.value, often.low, often.high) == pytest.approx((single.value, single.low, single.high))
    alone = statistics.ranking(question, given([[0, 6], [4, 0]], names="ab", people=1)).scores["a"]
    assert (alone.value, alone.low) == (pytest.approx(single.value), None)


def test_a_picture_that_loses_all_has_the_score_that_plackettluce_prints():
    # its overview, "Disconnected networks": A > B, C > A, A > D, B > A, B > C
    wins = [[0, 1, 0, 1], [1, 0, 1, 0], [1, 0, 0, 0], [0, 0, 0, 0]]
    found = statistics.ranking(pairs_study().question[0], given(wins))
    relative = {name: score.value - found.scores["a"].value for name, score in found.scores.items()}
    assert relative == pytest.approx({"b": 0.5184185, "a": 0.0, "c": 0.1354707, "d": -1.1537565}, abs=1e-6)
    assert found.steadied


@pytest.mark.parametrize(
    ("wins", "ties", "order"),
    [
        ([[0, 9], [0, 0]], [[0, 0], [0, 0]], "ab"),
        ([[0, 0], [9, 0]], [[0, 2], [2, 0]], "ba"),
        ([[0, 0], [0, 0]], [[0, 9], [9, 0]], "ab"),
    ],
)
def test_scores_are_finite_where_one_wins_all_or_none_wins(wins, ties, order):
    found = statistics.ranking(pairs_study("ab").question[0], given(wins, ties, "ab"))
    assert "".join(found.scores) == order
    assert found.steadied
    values = [score.value for score in found.scores.values()]
    assert np.isfinite([*values, found.tie]).all()
    assert (values[0] == pytest.approx(0, abs=1e-9)) is (not np.any(wins))


def test_pictures_that_are_not_connected_are_told_and_those_not_compared_have_no_score():
    wins = [[0, 2, 0, 0, 0], [1, 0, 0, 0, 0], [0, 0, 0, 3, 0], [0, 0, 1, 0, 0], [0, 0, 0, 0, 0]]
    found = statistics.ranking(pairs_study("abcde").question[0], given(wins, names="abcde"))
    assert sorted(found.groups) == [("a", "b"), ("c", "d"), ("e",)]
    assert found.scores["e"] is None
    assert found.scores["a"].value > found.scores["b"].value
    assert found.steadied


def test_no_answers_give_no_scores():
    found = statistics.ranking(pairs_study().question[0], [])
    assert list(found.scores.values()) == [None] * 4
    assert found.counts["a"] == (0, 0, 0)


# Agreement --------------------------------------------------------------------------------------------------

CODERS = np.array([
    [1, 2, 3, 3, 2, 1, 4, 1, 2, MISSING, MISSING, MISSING], [1, 2, 3, 3, 2, 2, 4, 1, 2, 5, MISSING, 3],
    [MISSING, 3, 3, 3, 2, 3, 4, 2, 2, 5, 1, MISSING], [1, 2, 3, 3, 2, 4, 4, 1, 2, 5, 1, MISSING],
])  # fmt: skip
"""Four observers of twelve units (Krippendorff, Computing Krippendorff's alpha-reliability, example C)."""


@pytest.mark.parametrize(("level", "alpha"), [("nominal", 0.743), ("ordinal", 0.815), ("interval", 0.849)])
def test_agreement_is_what_krippendorff_prints(level, alpha):
    assert round(statistics.krippendorff_alpha(CODERS, level), 3) == alpha


def test_agreement_is_not_defined_without_two_ratings_of_a_unit_or_two_values():
    assert statistics.krippendorff_alpha(np.array([[1.0, MISSING], [MISSING, 2.0]]), "nominal") is None
    assert statistics.krippendorff_alpha(np.full((3, 2), 4.0), "ordinal") is None
    assert statistics.krippendorff_alpha(np.empty((0, 0)), "ordinal") is None


def test_scores_of_one_scale_agree_as_krippendorff_prints():
    questions = [{"kind": "score", "name": f"u{k}", "text": "?"} for k in range(12)]
    other = {"kind": "score", "name": "long", "text": "?", "most": 9}
    study = Study(title="t", consent="c", question=[*questions, other])
    given = [
        answer(person, f"u{k}", int(value))
        for person, row in enumerate(CODERS)
        for k, value in enumerate(row)
        if np.isfinite(value)
    ]
    (found,) = statistics.agreements(study, [*given, answer(1, "long", 9)])
    assert (found.level, round(found.alpha, 3), found.raters) == ("ordinal", 0.815, 4)
    assert len(found.questions) == 12


@pytest.mark.parametrize("names", ["abc", "cab", "bca"])
def test_pairs_agree_whatever_the_order_of_pictures(names):
    question = pairs_study(names)
    alike = [
        answer(person, "which", min(pair), pair, trial=k)
        for person in range(6)
        for k, pair in enumerate([("a", "b"), ("c", "b"), ("a", "c")])
    ]
    assert statistics.agreements(question, alike)[0].alpha == pytest.approx(1)
    random = np.random.default_rng(0)
    chance = [
        answer(person, "which", str(random.choice(pair)), pair)
        for person in range(200)
        for pair in [("a", "b"), ("b", "c"), ("a", "c")]
    ]
    assert abs(statistics.agreements(question, chance)[0].alpha) < 0.02


# Thresholds -------------------------------------------------------------------------------------------------


def test_thresholds_are_those_of_each_person():
    names = ["l1", "l2", "l3", "l4"]
    stairs = {
        "kind": "staircase", "name": "jnd", "text": "?", "reference": "ref", "levels": names, "down": 1,
        "sizes": [1, 2, 4, 8],
    }  # fmt: skip
    pictures = [{"name": name, "file": "x.png"} for name in ("ref", *names)]
    study = Study(title="t", consent="c", picture=pictures, question=[stairs])
    given = []
    # person 1 sees differences from level 2 on, person 2 stops at once
    level = 3
    for trial in range(12):
        right = level >= 1
        given.append(answer(1, "jnd", names[level] if right else "ref", (names[level], "ref"), trial=trial))
        level = min(max(level + (-1 if right else 1), 0), 3)
    given.append(answer(2, "jnd", "l4", ("l4", "ref")))
    assert statistics.thresholds(study.question[0], given) == {1: 1.5, 2: None}
