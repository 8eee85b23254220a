"""Forms of the page: the fields that it sends, read into answers."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from urllib.parse import parse_qsl

from greensward.study.model import Choice, Pairs, Quantity, Score, Staircase
from greensward.study.plan import Answer, Page, Trial, Value, problem_of

MOST_BYTES, _MOST_FIELDS = 65_536, 400
"""Bytes of a form, at most."""
_LONGEST_S = 86_400.0
_OTHERS = {"key", "seconds", "go"}


class FormError(Exception):
    """A form that the page does not send."""


@dataclass
class Filled:
    """A form's answers, and what is wrong with them."""

    answers: list[Answer] = field(default_factory=list)
    problems: dict[str, str] = field(default_factory=dict)
    """Word of the page's texts for each fault, by the trial's key."""
    given: dict[str, tuple[Sequence[str], str]] = field(default_factory=dict)
    """Fields as they were sent, by the trial's key: values, and the answer in own words."""


def fields_of(body: bytes) -> dict[str, list[str]]:
    """Fields of a form by name. Raises `FormError`."""
    try:
        pairs = parse_qsl(
            body.decode("utf-8"),
            keep_blank_values=True,
            strict_parsing=bool(body),
            errors="strict",
            max_num_fields=_MOST_FIELDS,
        )
    except ValueError:
        raise FormError("is no form") from None
    found: dict[str, list[str]] = {}
    for name, value in pairs:
        found.setdefault(name, []).append(value.replace("\0", "").replace("\r\n", "\n"))
    return found


def filled(page: Page, person: int, fields: Mapping[str, Sequence[str]]) -> Filled:
    """Answers that a form gives to a page. Raises `FormError` for fields that the page does not have."""
    known = _OTHERS | {f"{letter}.{trial.key}" for trial in page.trials for letter in "ao"}
    if strange := next((name for name in fields if name not in known), None):
        raise FormError(f"has a field {strange[:60]!r} that the page does not have")
    seconds = _seconds(fields)
    result = Filled()
    for trial in page.trials:
        values, others = fields.get(f"a.{trial.key}", ()), fields.get(f"o.{trial.key}", ())
        if len(others) > 1:
            raise FormError("has a field twice")
        other = (others[0] if others else "").strip()
        value = _value(trial, values)
        result.given[trial.key] = values, other
        if problem := problem_of(trial, value, other):
            result.problems[trial.key] = problem
        question = trial.question.name
        result.answers.append(Answer(person, question, trial.number, trial.role, trial.shown, value, other, seconds))
    return result


def _value(trial: Trial, values: Sequence[str]) -> Value:
    question = trial.question
    if isinstance(question, Choice) and question.many:
        return list(values)
    if len(values) > 1:
        raise FormError("has a field twice")
    text = values[0].strip() if values else ""
    if not text:
        return None
    if isinstance(question, Pairs | Staircase) and text in ("0", "1"):
        # by its side, as the page does not tell which picture stands there
        return trial.shown[int(text)]
    if isinstance(question, Quantity | Score):
        # a number that is none is kept as text, and refused as such
        return int(text) if text.lstrip("+-").isdecimal() and len(text) < 12 else text
    return text


def _seconds(fields: Mapping[str, Sequence[str]]) -> float:
    try:
        value = float(fields.get("seconds", ["0"])[0])
    except (ValueError, IndexError):
        return 0.0
    return round(value, 3) if math.isfinite(value) and 0.0 <= value <= _LONGEST_S else 0.0
