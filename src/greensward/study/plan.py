"""Trials of a person in their order, with random sides, repeats, catch trials and staircases."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations, groupby
from typing import Literal

import numpy as np

from greensward.study.model import Choice, Comment, Pairs, Quantity, Question, Score, Staircase, Study

TIE = "="
"""Answer to a pair that shows no difference."""
Value = str | int | list[str] | None
"""Value of an answer: names of options or pictures, a number, or a text; None where it is skipped."""


@dataclass(frozen=True)
class Person:
    """A person who takes part."""

    number: int
    """Counted from 1 in the order in which they came."""
    language: str
    begun: str
    """Instant, ISO 8601 in UTC."""
    finished: str | None = None
    own_seed: int | None = None

    @property
    def seed(self) -> int:
        """Seed of their orders and sides, together with the study's: their number, if their page had no other."""
        return self.number if self.own_seed is None else self.own_seed


@dataclass(frozen=True)
class Answer:
    """An answer to one trial of a question."""

    person: int
    question: str
    trial: int
    """Number among the question's trials, from 0."""
    role: Literal["plain", "repeat", "catch"]
    shown: tuple[str, ...]
    """Pictures, from left to right, or from top to bottom."""
    value: Value
    other: str = ""
    """Answer in own words beside the options."""
    seconds: float = 0.0
    """Time from the page's appearance to the answer."""
    at: str = ""
    """Instant, ISO 8601 in UTC."""


def alike(before: Answer | None, now: Answer) -> bool:
    """True if an answer says the same as the one before."""
    return before is not None and (before.value, before.other, before.shown) == (now.value, now.other, now.shown)


@dataclass(frozen=True)
class Trial:
    """One thing that is asked."""

    question: Question
    number: int = 0
    role: Literal["plain", "repeat", "catch"] = "plain"
    shown: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """Its name among all trials of a person."""
        return f"{self.question.name}.{self.number}"


@dataclass(frozen=True)
class Page:
    """Trials that are asked together."""

    trials: tuple[Trial, ...]


def pages(study: Study, seed: int, answers: Mapping[str, Answer]) -> list[Page]:
    """All pages of a person, in order; of a staircase those that its answers so far, by the trial's key, lead to.

    The same study, seed of the person and answers always give the same pages.
    """
    found: list[Page] = []
    for number, questions in enumerate(stages(study)):
        random = np.random.default_rng([study.seed, seed, number])
        match questions:
            case [Pairs() as pairs]:
                found += [Page((trial,)) for trial in _pair_trials(pairs, random)]
            case [Staircase() as stairs]:
                found += [Page((trial,)) for trial in _stair_trials(stairs, random, answers)]
            case _:
                found.append(Page(tuple(Trial(each, shown=each.show) for each in questions)))  # type: ignore[union-attr]
    return found


def stages(study: Study) -> list[list[Question]]:
    """Questions that are asked together, or one after the other in pairs or a staircase."""
    return [[question for _, question in group] for _, group in groupby(enumerate(study.question), _page_of)]


def stage_of(study: Study, question: Question) -> tuple[int, int]:
    """Number from 1 of the stage of a study that a question is in, and of all; a staircase is one, however long."""
    every = stages(study)
    return next(k for k, asked in enumerate(every, 1) if question in asked), len(every)


def reached(every: Sequence[Page], answers: Mapping[str, Answer]) -> int:
    """Number, from 1, of the first page that is not answered; one past the last where all are."""
    open_pages = (i for i, page in enumerate(every, 1) if any(trial.key not in answers for trial in page.trials))
    return next(open_pages, len(every) + 1)


def _page_of(numbered: tuple[int, Question]) -> tuple[str, int]:
    number, question = numbered
    alone = not question.page or isinstance(question, Pairs | Staircase)
    return ("", number) if alone else (question.page, -1)


def _pair_trials(pairs: Pairs, random: np.random.Generator) -> list[Trial]:
    every = list(combinations(pairs.pictures, 2))
    chosen = [every[i] for i in random.permutation(len(every))[: pairs.per_person]]
    trials = [("plain", pair if random.random() < 0.5 else pair[::-1]) for pair in chosen]
    # a repeat comes after all pairs, so that it is not remembered, and with its sides changed
    again = [("repeat", trials[i][1][::-1]) for i in random.permutation(len(trials))[: pairs.repeats]]
    for good, bad in pairs.catches:
        at = int(random.integers(len(trials) + 1))
        trials.insert(at, ("catch", (good, bad) if random.random() < 0.5 else (bad, good)))
    return [Trial(pairs, k, role, shown) for k, (role, shown) in enumerate(trials + again)]  # type: ignore[arg-type]


def _stair_trials(stairs: Staircase, random: np.random.Generator, answers: Mapping[str, Answer]) -> list[Trial]:
    state, sides = Stairs(stairs), _sides(stairs, random)
    trials: list[Trial] = []
    while not state.ended:
        shown = (stairs.levels[state.level], stairs.reference)
        trial = Trial(stairs, len(trials), shown=shown[::-1] if sides[len(trials)] else shown)
        trials.append(trial)
        if trial.key not in answers:
            break
        state.take(answers[trial.key].value == stairs.levels[state.level])
    return trials


def _sides(stairs: Staircase, random: np.random.Generator) -> list[int]:
    """The side of the level in each trial: 0 is left, or above."""
    return [int(draw >= 0.5) for draw in random.random(stairs.most)]


def order_of(study: Study, seed: int) -> dict[str, list[tuple[str, ...]] | list[int]]:
    """Random choices for a person, by question: pictures of its pairs, or sides of the levels of its staircase."""
    found: dict[str, list[tuple[str, ...]] | list[int]] = {}
    for number, questions in enumerate(stages(study)):
        random = np.random.default_rng([study.seed, seed, number])
        match questions:
            case [Pairs() as pairs]:
                found[pairs.name] = [trial.shown for trial in _pair_trials(pairs, random)]
            case [Staircase() as stairs]:
                found[stairs.name] = _sides(stairs, random)
    return found


@dataclass
class Stairs:
    """The state of a staircase: it begins at the level that is farthest from the reference."""

    stairs: Staircase
    level: int = -1
    turns: list[int] = field(default_factory=list)
    """Levels at which it turned."""
    trials: int = 0
    _right: int = 0
    _way: int = 0

    def __post_init__(self) -> None:
        self.level = len(self.stairs.levels) - 1

    @property
    def ended(self) -> bool:
        """True if there is nothing more to ask."""
        return len(self.turns) >= self.stairs.reversals or self.trials >= self.stairs.most

    def take(self, correct: bool) -> None:
        """Take the answer to the present level."""
        self.trials += 1
        self._right = self._right + 1 if correct else 0
        if correct and self._right < self.stairs.down:
            return
        self._right = 0
        way = -1 if correct else 1
        if self._way and way != self._way:
            self.turns.append(self.level)
        self._way = way
        self.level = min(max(self.level + way, 0), len(self.stairs.levels) - 1)


def threshold(stairs: Staircase, answers: Sequence[Answer]) -> float | None:
    """The just-noticeable difference of one person: the mean size of the levels at its turns but the first two.

    None where it turned too seldom.
    """
    state = Stairs(stairs)
    for answer in sorted(answers, key=lambda each: each.trial):
        if state.ended:
            break
        state.take(answer.value == stairs.levels[state.level])
    turns = state.turns[2:]
    if len(turns) < 2:
        return None
    sizes = stairs.sizes or tuple(range(1, len(stairs.levels) + 1))
    return float(np.mean([sizes[level] for level in turns]))


MOST_WRITTEN = 4000
"""Letters of an answer in own words, at most."""


def problem_of(trial: Trial, value: Value, other: str = "") -> str:
    """Name the fault of an answer to a trial, by a word of the page's texts; empty where it is sound."""
    question = trial.question
    if value in (None, "", []) and not other.strip():
        return "required" if question.required else ""
    if len(other) > MOST_WRITTEN or (isinstance(value, str) and len(value) > MOST_WRITTEN):
        return "too_long"
    match question:
        case Comment():
            sound = isinstance(value, str) and not other
        case Quantity() | Score():
            sound = type(value) is int and question.least <= value <= question.most and not other
        case Choice():
            known = [option.value for option in question.options]
            chosen = value if isinstance(value, list) else [] if value is None else [value]
            sound = isinstance(value, list) == question.many or (value is None and bool(other))
            sound = sound and all(each in known for each in chosen) and len(set(map(str, chosen))) == len(chosen)
            sound = sound and (question.other or not other)
        case Pairs():
            sound = (value in trial.shown or (question.ties and value == TIE)) and not other
        case Staircase():
            sound = value in trial.shown and not other
    return "" if sound else "not_offered"
