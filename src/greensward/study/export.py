"""Raw answers as CSV or Parquet."""

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from greensward.scene import InputError
from greensward.scene.files import written_aside
from greensward.study.plan import TIE, Answer, Person, Value
from greensward.study.statistics import import_extra

_COLUMNS = (
    "person", "language", "begun", "finished", "question", "trial", "role", "shown", "value", "other", "seconds", "at"
)  # fmt: skip
_FORMULAS = ("=", "+", "-", "@", "＝", "＋", "－", "＠")
"""Beginnings of formulas for spreadsheets, also behind blanks, which some cut off."""


def export_answers(answers: Iterable[Answer], people: Iterable[Person], path: Path) -> None:
    """Write all answers, complete, to a `.csv` or `.parquet` file, a row for each; in order of people and instants.

    Several options, and the pictures that were shown, are names with spaces between; "=" is no difference. In CSV,
    texts that a spreadsheet would run as formulas have an apostrophe before them. Answers of unknown people are left
    out. Raises `GreenswardError`, also where pyarrow is missing.
    """
    rows = _rows(answers, people)
    match path.suffix.lower():
        case ".csv":
            data = _csv(rows)
        case ".parquet":
            data = _parquet(rows)
        case _:
            raise InputError(f"{path}: the file's name must end in .csv or .parquet")
    with written_aside(path) as stream:
        stream.write(data)


def in_order(answers: Iterable[Answer]) -> list[Answer]:
    """Answers by people, and of each by their instants."""
    return sorted(answers, key=lambda each: (each.person, each.at, each.question, each.trial))


def _rows(answers: Iterable[Answer], people: Iterable[Person]) -> list[tuple[Any, ...]]:
    known = {person.number: person for person in people}
    found = []
    for answer in in_order(answers):
        if person := known.get(answer.person):
            row = (
                person.number, person.language, person.begun, person.finished, answer.question, answer.trial,
                answer.role, " ".join(answer.shown), _plain(answer.value), answer.other, answer.seconds, answer.at,
            )  # fmt: skip
            found.append(tuple(_encodable(cell) if isinstance(cell, str) else cell for cell in row))
    return found


def _plain(value: Value) -> str | None:
    return " ".join(value) if isinstance(value, list) else None if value is None else str(value)


def _encodable(text: str) -> str:
    return text.encode("utf-8", "replace").decode("utf-8")


def _csv(rows: Sequence[tuple[Any, ...]]) -> bytes:
    file = io.StringIO(newline="")
    writer = csv.writer(file)
    writer.writerow(_COLUMNS)
    writer.writerows([_harmless(cell) for cell in row] for row in rows)
    return file.getvalue().encode()


def _harmless(cell: object) -> object:
    if not isinstance(cell, str) or cell == TIE or not cell.lstrip().startswith(_FORMULAS):
        return cell
    # a number below 0 is no formula
    return cell if cell.startswith("-") and cell[1:].isdecimal() else f"'{cell}"


def _parquet(rows: Sequence[tuple[Any, ...]]) -> bytes:
    arrow, parquet = import_extra("pyarrow"), import_extra("pyarrow.parquet")
    types = {"person": arrow.int64(), "trial": arrow.int64(), "seconds": arrow.float64()}
    columns = list(zip(*rows, strict=True)) if rows else [()] * len(_COLUMNS)
    schema = arrow.schema([(name, types.get(name, arrow.string())) for name in _COLUMNS])
    arrays = [arrow.array(column, schema.field(k).type) for k, column in enumerate(columns)]
    buffer = io.BytesIO()
    parquet.write_table(arrow.Table.from_arrays(arrays, schema=schema), buffer)
    return buffer.getvalue()
