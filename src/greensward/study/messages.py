"""Messages of pages that stand elsewhere: each holds all answers of a person so far, and is checked as a form is."""

import hashlib
import json
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field, ValidationError

from greensward.scene.errors import InputError
from greensward.scene.files import open_file
from greensward.study.forms import FormError, filled
from greensward.study.model import Staircase, Study
from greensward.study.plan import MOST_WRITTEN, Answer, alike, pages, reached
from greensward.study.store import CODE, Store

MOST_MESSAGE_BYTES = 1 << 20
"""Bytes of a message, at most."""
_NO_TIME = timedelta()
_EARLIEST = datetime(2020, 1, 1, tzinfo=UTC)
_Written = Annotated[str, Field(max_length=MOST_WRITTEN)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class Given(_Strict):
    """Fields that answer a trial."""

    values: Annotated[list[_Written], Field(max_length=100)]
    other: _Written = ""
    seconds: float = Field(0.0, ge=0, le=86_400)
    at: AwareDatetime
    """Instant of the answer, by the clock of the person's device."""


class Message(_Strict):
    """All that a person has answered so far; a later message of the same code takes the place of an earlier one."""

    plan: str
    """`plan_of` the study that the page was made from."""
    code: Annotated[str, Field(pattern=f"^{CODE}$")]
    """Code of the person, made by its browser, which nobody else knows."""
    seed: int = Field(ge=1, le=2**32 - 1)
    language: Literal["en", "de", "sv"]
    begun: AwareDatetime
    sent: AwareDatetime
    """Instant of sending, by the same clock."""
    answers: Annotated[dict[Annotated[str, Field(max_length=50)], Given], Field(max_length=50_000)]


class Deletion(_Strict):
    """Wish to delete all answers of a person."""

    plan: str
    code: Annotated[str, Field(pattern=f"^{CODE}$")]
    delete: Literal[True]


class OtherPlanError(Exception):
    """A message of a page that was made from another version of the study."""


def plan_of(study: Study) -> str:
    """Digest of all that decides which questions are asked, and in which order."""
    keys = study.model_dump(mode="json", include={"seed", "question"})
    return hashlib.sha256(json.dumps(keys, sort_keys=True).encode()).hexdigest()[:16]


def message_of(text: bytes) -> Message | Deletion:
    """Read a message. Raises `FormError`."""
    try:
        table = json.loads(text)
        kind: type[Message | Deletion] = Deletion if isinstance(table, dict) and "delete" in table else Message
        return kind.model_validate_json(text)
    except (ValueError, RecursionError) as error:
        at: Any = error.errors()[0] if isinstance(error, ValidationError) else {}
        where = ".".join(map(str, at.get("loc", ())))[:80]
        raise FormError(
            f"is not one of a page ({where + ': ' if where else ''}{at.get('msg', 'too deep')})"
        ) from None


def take(study: Study, store: Store, message: Message | Deletion, arrived: datetime | None = None) -> int:
    """Keep what a message says; returns how many answers of it are new or have changed.

    Instants are corrected by the difference of the clocks where the arrival is known. Raises `FormError` for
    answers that the page does not give, and `OtherPlanError`.
    """
    late = arrived - message.sent if arrived and isinstance(message, Message) else _NO_TIME
    answers = check(study, message, late)
    if isinstance(message, Deletion):
        store.delete(message.code)
        return 0
    person = store.of_code(message.code)
    if person and person.seed != message.seed:
        raise FormError("has another seed than before")
    if not answers:
        return 0
    if person is None:
        begun = _instant(message.begun, late)
        person = store.begin_elsewhere(message.language, message.code, begun, message.seed)
    answers = [replace(answer, person=person.number) for answer in answers]
    before = store.answers_of(person)
    stairs = {question.name for question in study.question if isinstance(question, Staircase)}
    changed, ends = list[Answer](), dict[str, int]()
    for each in answers:
        # what follows in a staircase is kept anew, as keeping an answer drops what came after it
        if each.question in ends or not alike(before.get(f"{each.question}.{each.trial}"), each):
            changed.append(each)
            ends |= {each.question: each.trial} if each.question in stairs else {}
    if changed:
        store.save(changed, ends)
    known = {f"{each.question}.{each.trial}": each for each in answers}
    every = pages(study, person.seed, known)
    if reached(every, known) > len(every):
        store.finish(person)
    return len(changed)


def check(study: Study, message: Message | Deletion, late: timedelta = _NO_TIME) -> list[Answer]:
    """Answers of a message, of nobody yet, each of them one that the page offers.

    Raises `FormError`, and `OtherPlanError` for a page that was made from another version of the study.
    """
    if message.plan != plan_of(study):
        raise OtherPlanError("is from a page of another version of this study; export its pages again")
    if isinstance(message, Deletion):
        return []
    left, known = dict(message.answers), dict[str, Answer]()
    every, index = pages(study, message.seed, known), 0
    while index < len(every):
        page = every[index]
        index += 1
        given = {trial.key: left.pop(trial.key) for trial in page.trials if trial.key in left}
        if not given:
            continue
        fields = {f"a.{key}": each.values for key, each in given.items()}
        fields |= {f"o.{key}": [each.other] for key, each in given.items() if each.other}
        sent = filled(page, 0, fields)
        if sent.problems:
            raise FormError(f"has an answer that is not offered: {next(iter(sent.problems))}")
        for trial, answer in zip(page.trials, sent.answers, strict=True):
            if each := given.get(trial.key):
                known[trial.key] = replace(answer, seconds=each.seconds, at=_instant(each.at, late))
        if isinstance(page.trials[0].question, Staircase):
            every = pages(study, message.seed, known)
    if left:
        raise FormError(f"has an answer that belongs to no page: {next(iter(left))}")
    return list(known.values())


def read_messages(file: Path) -> Iterator[tuple[int, Message | Deletion]]:
    """Messages of a file that holds one a line, with the number of the line. Raises `InputError`."""
    with open_file(file) as stream:
        number = 0
        while line := stream.readline(MOST_MESSAGE_BYTES + 1):
            number += 1
            if len(line) > MOST_MESSAGE_BYTES:
                raise InputError(f"{file}: line {number}: is longer than a message can be")
            if line.strip():
                try:
                    yield number, message_of(line)
                except FormError as error:
                    raise InputError(f"{file}: line {number}: the message {error}") from None


def _instant(at: datetime, late: timedelta) -> str:
    """An instant in UTC, by the clock here; the present where it cannot be."""
    now = datetime.now(UTC)
    try:
        here = at.astimezone(UTC) + late
    except OverflowError:
        here = now
    return (here if _EARLIEST <= here <= now + timedelta(days=1) else now).isoformat(timespec="milliseconds")
