"""Statistics of answers: means, shares, scores of pairs, agreement and thresholds, with their intervals.

Intervals hold 95 %. SciPy and krippendorff are imported late: they are in the extra `study`.
"""

import datetime
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from greensward.scene import GreenswardError
from greensward.study.model import Choice, Pairs, Score, Staircase, Study
from greensward.study.plan import TIE, Answer, threshold

Rule = Literal["catch trials", "repeated pairs", "time", "control"]
_Array = NDArray[np.float64]
_LEVEL = 0.95
_RESAMPLES = 9999
_RESAMPLES_OF_PEOPLE = 2000
_AT_ONCE = 500  # fits in one go, for their memory


@dataclass(frozen=True)
class Estimate:
    """A value and its interval, in the unit of what was asked."""

    value: float
    low: float | None
    """None, as `high`, where the answers leave no interval: one answer, or all alike."""
    high: float | None
    count: int
    """Answers, or people, that it is made of."""


@dataclass(frozen=True)
class Ranking:
    """Scores of pictures from pairs."""

    scores: dict[str, Estimate | None]
    """Log-scores with mean 0, best first; None for a picture that nobody compared. Its count is that of people."""
    counts: dict[str, tuple[int, int, int]]
    """Number of times that each was preferred, equal, and not preferred."""
    tie: float
    """Davidson's ν: of two equal pictures, "no difference" is ν / (2 + ν) of all answers."""
    groups: tuple[tuple[str, ...], ...]
    """Pictures that comparisons connect. Between groups, scores say nothing."""
    steadied: bool
    """True if no finite scores are most likely, so that the imaginary picture of `ranking` had to enter."""


@dataclass(frozen=True)
class Agreement:
    """Agreement of people in questions that have the same answers."""

    questions: tuple[str, ...]
    level: Literal["nominal", "ordinal"]
    alpha: float | None
    """1 is full agreement, 0 that of chance; None where all answers are alike or none can be compared."""
    raters: int


def import_extra(name: str) -> Any:
    """A module of the extra `study`. Raises `GreenswardError` where it is missing."""
    import importlib

    try:
        return importlib.import_module(name)
    except ImportError:
        raise GreenswardError(
            f'the study\'s report needs {name.split(".")[0]}, which an extra brings: pip install "greensward[study]"'
        ) from None


def left_out(study: Study, answers: Iterable[Answer]) -> dict[int, dict[Rule, str]]:
    """People who break the study's rules of attention: what they did, by their number and the rule.

    A rule of which a person has met nothing, such as catch trials that were not reached, is not broken.
    """
    found: dict[int, dict[Rule, str]] = {}
    for person, mine in sorted(_by_person(answers).items()):
        if broken := _broken(study, mine):
            found[person] = broken
    return found


def _by_person(answers: Iterable[Answer]) -> dict[int, list[Answer]]:
    by_person: dict[int, list[Answer]] = defaultdict(list)
    for answer in answers:
        by_person[answer.person].append(answer)
    return by_person


def _broken(study: Study, mine: Sequence[Answer]) -> dict[Rule, str]:
    broken: dict[Rule, str] = {}
    caught: list[bool] = []
    alike: list[bool] = []
    for question in study.question:
        given = [answer for answer in mine if answer.question == question.name]
        if isinstance(question, Pairs):
            given = [answer for answer in given if answer.value is not None]
            better = {frozenset(pair): pair[0] for pair in reversed(question.catches)}
            caught += [
                answer.value != better[frozenset(answer.shown)]
                for answer in given
                if answer.role == "catch" and frozenset(answer.shown) in better
            ]
            first = {frozenset(answer.shown): answer.value for answer in given if answer.role == "plain"}
            alike += [
                answer.value == first[frozenset(answer.shown)]
                for answer in given
                if answer.role == "repeat" and frozenset(answer.shown) in first
            ]
        elif isinstance(question, Choice) and question.correct is not None:
            right = (question.correct, [question.correct])
            if any(answer.value not in right for answer in given):
                broken["control"] = f"{question.name} not answered by {question.correct}"
    rules = study.attention
    if caught and sum(caught) > rules.most_caught * len(caught):
        broken["catch trials"] = f"{sum(caught)} of {len(caught)} catch trials wrong"
    if alike and sum(alike) < rules.least_repeated * len(alike):
        broken["repeated pairs"] = f"{sum(alike)} of {len(alike)} repeated pairs answered alike"
    taken = time_taken(mine)
    if taken is not None and taken < rules.least_s:
        broken["time"] = f"{taken:.0f} s from the first answer to the last"
    return broken


def time_taken(answers: Iterable[Answer]) -> float | None:
    """Seconds from the first answer to the last of one person; None where no instants are known."""
    instants = [datetime.datetime.fromisoformat(answer.at) for answer in answers if answer.at]
    return (max(instants) - min(instants)).total_seconds() if instants else None


def mean_of(values: Sequence[float], seed: int = 1) -> Estimate | None:
    """The mean with its BCa bootstrap interval (Efron 1987); None where there are no values."""
    return _bootstrapped(values, np.mean, "BCa", seed)


def median_of(values: Sequence[float], seed: int = 1) -> Estimate | None:
    """The median with its percentile bootstrap interval; None where there are no values."""
    # BCa takes its acceleration from medians that leave one value out, which are all but alike
    return _bootstrapped(values, np.median, "percentile", seed)


def _bootstrapped(values: Sequence[float], statistic: Callable[..., Any], method: str, seed: int) -> Estimate | None:
    if not values:
        return None
    sample = np.asarray(values, dtype=np.float64)
    value = float(statistic(sample))
    if np.ptp(sample) == 0:
        return Estimate(value, None, None, len(sample))
    bootstrap = import_extra("scipy.stats").bootstrap
    for how in (method, "percentile"):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that BCa is not defined, which shows in its interval
            found = bootstrap(
                (sample,), statistic, confidence_level=_LEVEL, n_resamples=_RESAMPLES, method=how,
                batch=max(4_000_000 // len(sample), 1), rng=np.random.default_rng(seed),
            ).confidence_interval  # fmt: skip
        if np.isfinite(found).all():
            break
    return Estimate(value, float(found.low), float(found.high), len(sample))


def share_of(part: int, whole: int) -> Estimate | None:
    """The share of a part in 0…1 with Wilson's interval (Wilson 1927, without correction); None of nothing."""
    if not whole:
        return None
    found = import_extra("scipy.stats").binomtest(part, whole).proportion_ci(_LEVEL, "wilson")
    return Estimate(part / whole, float(found.low), float(found.high), whole)


def ranking(pairs: Pairs, answers: Iterable[Answer], seed: int = 1) -> Ranking:
    """Bradley–Terry scores with ties (Davidson 1970) of greatest likelihood.

    Catch trials and repeats do not enter. Intervals are percentiles over resampled people, as answers of one person
    hang together. Where a picture wins or loses all, or comparisons do not connect all pictures, no finite scores are
    the most likely. Then each picture also has half a win and half a loss against one imaginary picture, as in
    PlackettLuce (Turner, van Etten, Firth and Kosmidis 2020); the same holds for each resample by itself.
    """
    wins, ties = _tallies(pairs, answers)
    every, equal = wins.sum(axis=0), ties.sum(axis=0)
    compared = np.flatnonzero((every + every.T + equal).sum(axis=1))
    names = [pairs.pictures[i] for i in compared]
    wins, ties = wins[:, compared][:, :, compared], ties[:, compared][:, :, compared]
    people = len(wins)
    scores: dict[str, Estimate | None] = {}
    nu, steadied = 0.0, False
    if names:
        fitted, nus, steady = _fitted(wins.sum(axis=0)[None], ties.sum(axis=0)[None])
        nu, steadied = float(nus[0]), bool(steady[0])
        low, high = _interval_over_people(wins, ties, seed) if people > 1 else (None, None)
        for k in np.argsort(-fitted[0], kind="stable"):
            least, most = (None, None) if low is None or high is None else (float(low[k]), float(high[k]))
            scores[names[k]] = Estimate(float(fitted[0, k]), least, most, people)
    scores |= {name: None for name in pairs.pictures if name not in scores}
    tally = [(int(every[i].sum()), int(equal[i].sum()), int(every[:, i].sum())) for i in range(len(every))]
    counts = dict(zip(pairs.pictures, tally, strict=True))
    reach = _closure((every + every.T + equal)[None] > 0)[0]
    groups = {tuple(n for n, there in zip(pairs.pictures, row, strict=True) if there) for row in reach}
    return Ranking(scores, counts, nu, tuple(sorted(groups, key=len, reverse=True)), steadied)


def _tallies(pairs: Pairs, answers: Iterable[Answer]) -> tuple[_Array, _Array]:
    """Number of times that a person preferred picture i to j, and found them equal: (people, K, K) each."""
    at = {name: i for i, name in enumerate(pairs.pictures)}
    plain = [
        answer
        for answer in answers
        if answer.question == pairs.name and answer.role == "plain" and answer.value is not None
    ]
    rows = {person: k for k, person in enumerate(sorted({answer.person for answer in plain}))}
    wins = np.zeros((len(rows), len(at), len(at)))
    ties = np.zeros_like(wins)
    for answer in plain:
        person, (i, j) = rows[answer.person], (at[name] for name in answer.shown)
        if answer.value == TIE:
            ties[person, [i, j], [j, i]] += 1
        else:
            wins[(person, i, j) if answer.value == answer.shown[0] else (person, j, i)] += 1
    return wins, ties


def _interval_over_people(wins: _Array, ties: _Array, seed: int) -> tuple[_Array, _Array]:
    random = np.random.default_rng(seed)
    people = len(wins)
    found = []
    for start in range(0, _RESAMPLES_OF_PEOPLE, _AT_ONCE):
        size = min(_AT_ONCE, _RESAMPLES_OF_PEOPLE - start)
        drawn = random.multinomial(people, np.full(people, 1 / people), size=size).astype(np.float64)
        found.append(_fitted(np.tensordot(drawn, wins, 1), np.tensordot(drawn, ties, 1))[0])
    low, high = np.quantile(np.concatenate(found), [(1 - _LEVEL) / 2, (1 + _LEVEL) / 2], axis=0)
    return low, high


def _closure(edges: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """True where j is reached from i along edges, for a batch (B, K, K) of graphs."""
    reach = edges | np.eye(edges.shape[-1], dtype=bool)
    for _ in range(max(edges.shape[-1] - 1, 1).bit_length()):
        reach = (reach.astype(np.float32) @ reach.astype(np.float32)) > 0
    return reach


def _fitted(wins: _Array, ties: _Array) -> tuple[_Array, _Array, NDArray[np.bool_]]:
    """Scores (B, K), ν (B) and whether the imaginary picture entered (B), of tallies (B, K, K)."""
    # with ties, Ford's condition on wins alone is enough for finite scores, though not always needed
    steadied = np.array([not reach.all() for reach in _closure(wins > 0)])
    scores: _Array = np.zeros(wins.shape[:2])
    nu: _Array = np.zeros(len(wins))
    if (~steadied).any():
        scores[~steadied], nu[~steadied] = most_likely(wins[~steadied], ties[~steadied])
    if steadied.any():
        more = ((0, 0), (0, 1), (0, 1))
        with_it = np.pad(wins[steadied], more)
        with_it[:, -1, :-1] = with_it[:, :-1, -1] = 0.5
        found, nu[steadied] = most_likely(with_it, np.pad(ties[steadied], more))
        scores[steadied] = found[:, :-1] - found[:, :-1].mean(axis=1, keepdims=True)
    return scores, nu, steadied


def most_likely(wins: _Array, ties: _Array) -> tuple[_Array, _Array]:
    """Davidson's log-scores (B, K) with mean 0 and ν (B) of tallies (B, K, K), by Newton's method.

    `wins[b, i, j]` is how often i was preferred to j; `ties` is symmetric. Finite scores must exist.
    Of i and j, i is preferred with π_i / D, and they are equal with ν √(π_i π_j) / D, where
    D = π_i + π_j + ν √(π_i π_j) (Davidson 1970, "On extending the Bradley-Terry model to accommodate ties in paired
    comparison experiments"). In log π and log ν the likelihood is concave.
    """
    size, free = wins.shape[-1], ties.any(axis=(1, 2))
    trials = wins + wins.swapaxes(1, 2) + ties
    tied, decided = ties.sum(axis=(1, 2)) / 2, wins.sum(axis=(1, 2))
    won = (wins + ties / 2).sum(axis=2)
    scores = np.zeros(wins.shape[:2])
    log_nu = np.log(np.where(free, 2 * tied / decided, 1.0))
    information = np.zeros((len(wins), size + 1, size + 1))
    slope = np.zeros((len(wins), size + 1))
    for _ in range(200):
        odds = np.exp(np.clip((scores[:, :, None] - scores[:, None, :]) / 2, -100, 100))
        nu = np.where(free, np.exp(log_nu), 0.0)[:, None, None]
        whole = odds + 1 / odds + nu
        equal = nu / whole
        mean = odds / whole + equal / 2  # of 1 for preferred, 1/2 for equal, 0 for not preferred
        variance = trials * (odds / whole + equal / 4 - mean**2)
        slope[:, :size] = won - (trials * mean).sum(axis=2)
        slope[:, size] = np.where(free, tied - (trials * equal).sum(axis=(1, 2)) / 2, 0.0)
        # scores are known but for a sum, which the added ones hold at 0
        information[:, :size, :size] = 1.0 - variance
        information[:, range(size), range(size)] += variance.sum(axis=2)
        information[:, size, :size] = (trials * equal * (0.5 - mean)).sum(axis=2)
        information[:, :size, size] = information[:, size, :size]
        information[:, size, size] = np.where(free, (trials * equal * (1 - equal)).sum(axis=(1, 2)) / 2, 1.0)
        step = np.linalg.solve(information, slope[..., None])[..., 0]
        step *= np.minimum(1.0, 2.0 / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-300))
        scores += step[:, :size]
        log_nu += step[:, size]
        if np.abs(step).max() < 1e-10:
            break
    return scores - scores.mean(axis=1, keepdims=True), np.where(free, np.exp(log_nu), 0.0)


def krippendorff_alpha(ratings: _Array, level: Literal["nominal", "ordinal", "interval"]) -> float | None:
    """Krippendorff's alpha of ratings (raters, units), NaN where one is missing; None where it is not defined.

    It is not where no unit has two ratings, or all ratings that can be compared are alike.
    """
    ratings = ratings[:, np.isfinite(ratings).sum(axis=0) > 1]
    if not ratings.size or len(np.unique(ratings[np.isfinite(ratings)])) < 2:
        return None
    return float(import_extra("krippendorff").alpha(reliability_data=ratings, level_of_measurement=level))


def agreements(study: Study, answers: Iterable[Answer]) -> list[Agreement]:
    """Agreement in each question of pairs, and in questions that share a scale or options, where they are several.

    Scores are ordinal, options and pairs nominal. Each pair enters in both orders, or alpha would hang on the order
    in which the study happens to list its pictures.
    """
    groups: dict[Any, list[str]] = defaultdict(list)
    codes: dict[str, dict[Any, int]] = {}
    for question in study.question:
        if isinstance(question, Score):
            groups["ordinal", question.least, question.most].append(question.name)
        elif isinstance(question, Choice) and not question.many and question.correct is None:
            options = sorted(option.value for option in question.options)
            codes[question.name] = {value: k for k, value in enumerate(options)}
            groups["nominal", *options].append(question.name)
        elif isinstance(question, Pairs):
            groups["nominal", question.name].append(question.name)
    plain = [answer for answer in answers if answer.role == "plain" and answer.value not in (None, [])]
    found = []
    for (level, *_), names in groups.items():
        paired = isinstance(study.question_of(names[0]), Pairs)
        if len(names) < 2 and not paired:
            continue
        rated: dict[tuple[int, Any], float] = {}
        for answer in plain:
            if answer.question not in names:
                continue
            if paired:
                first, second = sorted(answer.shown)
                side = {first: -1.0, second: 1.0, TIE: 0.0}[str(answer.value)]
                rated[answer.person, (first, second)], rated[answer.person, (second, first)] = side, -side
            else:
                code = codes[answer.question][answer.value] if level == "nominal" else answer.value
                rated[answer.person, answer.question] = float(code)  # type: ignore[arg-type]
        raters, units = ({key[k]: None for key in rated} for k in (0, 1))
        table = np.full((len(raters), len(units)), np.nan)
        rows, columns = ({each: k for k, each in enumerate(keys)} for keys in (raters, units))
        for (rater, unit), value in rated.items():
            table[rows[rater], columns[unit]] = value
        found.append(Agreement(tuple(names), level, krippendorff_alpha(table, level), len(raters)))
    return found


def thresholds(stairs: Staircase, answers: Iterable[Answer]) -> dict[int, float | None]:
    """The just-noticeable difference of each person who met a staircase, in the unit of its sizes."""
    mine = _by_person(answer for answer in answers if answer.question == stairs.name)
    return {person: threshold(stairs, given) for person, given in sorted(mine.items())}
