"""Storage of people and answers: SQLite in the study's folder, or PostgreSQL by an address."""

import contextlib
import hashlib
import hmac
import json
import re
import secrets
import threading
from collections.abc import Iterable, Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Self

import sqlalchemy as sql
from sqlalchemy.exc import SQLAlchemyError

from greensward.scene.errors import GreenswardError, InputError
from greensward.study.plan import Answer, Person

DATABASE = "answers.db"
"""File of the answers, in the study's folder."""
LETTERS = "ABCDEFGHJKMNPQRSTVWXYZ23456789"
"""Letters of codes: none that look alike."""
_GROUPS, _GROUP = 4, 4
CODE = "-".join([f"[{LETTERS}]{{{_GROUP}}}"] * _GROUPS)
"""Pattern of a code."""
_WAIT_S = 10.0

_tables = sql.MetaData()
_about = sql.Table("about", _tables, sql.Column("name", sql.Text, primary_key=True), sql.Column("value", sql.Text))
_people = sql.Table(
    "people",
    _tables,
    sql.Column("number", sql.Integer, primary_key=True, autoincrement=True),
    sql.Column("language", sql.Text, nullable=False),
    sql.Column("begun", sql.Text, nullable=False),
    sql.Column("finished", sql.Text),
    sql.Column("token", sql.Text, nullable=False, unique=True),
    sql.Column("code", sql.Text, nullable=False, unique=True),
    sql.Column("own_seed", sql.BigInteger),
    sqlite_autoincrement=True,  # so that the number of somebody who is deleted is not given again
)
_answers = sql.Table(
    "answers",
    _tables,
    sql.Column("person", sql.Integer, sql.ForeignKey("people.number", ondelete="CASCADE"), primary_key=True),
    sql.Column("question", sql.Text, primary_key=True),
    sql.Column("trial", sql.Integer, primary_key=True, autoincrement=False),
    sql.Column("role", sql.Text, nullable=False),
    sql.Column("shown", sql.Text, nullable=False),
    sql.Column("value", sql.Text, nullable=False),
    sql.Column("other", sql.Text, nullable=False),
    sql.Column("seconds", sql.Float, nullable=False),
    sql.Column("at", sql.Text, nullable=False),
)


class Store:
    """People and their answers. An answer that was saved survives a kill of the process.

    Raises `GreenswardError` where the database fails, of which nothing is kept then.
    """

    def __init__(self, address: str, label: str) -> None:
        self._label = label
        try:
            is_file = address.startswith("sqlite:")
            self._engine = sql.create_engine(address, pool_size=20, max_overflow=30, pool_pre_ping=not is_file)
        except (SQLAlchemyError, ImportError, ValueError) as error:
            raise InputError(f"{label}: is no address of a database ({_words(error)})") from None
        self._is_file = self._engine.dialect.name == "sqlite"
        self._writing = threading.Lock()
        if self._is_file:
            sql.event.listen(self._engine, "connect", _prepare_file)
        with self._working(writing=True) as connection:
            _tables.create_all(connection)
            if all(column["name"] != "own_seed" for column in sql.inspect(connection).get_columns("people")):
                connection.execute(sql.text("ALTER TABLE people ADD COLUMN own_seed BIGINT"))  # of an older version
            row = connection.execute(sql.select(_about.c.value).where(_about.c.name == "secret")).first()
            secret = row[0] if row else secrets.token_hex(32)
            if not row:
                connection.execute(_about.insert().values(name="secret", value=secret))
        self._secret = bytes.fromhex(secret)

    @classmethod
    @contextlib.contextmanager
    def open(cls, folder: Path, address: str | None = None) -> Iterator[Self]:
        """Open the database of a study: `answers.db` of its folder, or the one at an address."""
        file = folder / DATABASE
        if address and address.startswith(("postgres://", "postgresql://")):
            address = "postgresql+psycopg://" + address.partition("://")[2]
        elif address:
            given = _without_password(address)
            raise InputError(f"--database: must be an address such as postgresql://user@host/name (got {given})")
        store = cls(address or f"sqlite:///{file}", _without_password(address) if address else str(file))
        try:
            yield store
        finally:
            store._engine.dispose()

    # People -------------------------------------------------------------------------------------------------

    def begin(self, language: str) -> tuple[Person, str, str]:
        """Add a person; returns it, its token for a session, and its code to come back or to delete everything."""
        token, code = secrets.token_urlsafe(24), _new_code()
        return self._begin(language, token, code, _now(), None), token, code

    def begin_elsewhere(self, language: str, code: str, begun: str, seed: int) -> Person:
        """Add a person whose page stands elsewhere, and made its code and chose its order."""
        return self._begin(language, secrets.token_urlsafe(24), plain_code(code), begun, seed)

    def _begin(self, language: str, token: str, code: str, begun: str, seed: int | None) -> Person:
        row = {"language": language, "begun": begun, "token": _hashed(token), "code": _hashed(code), "own_seed": seed}
        with self._working(writing=True) as connection:
            number = connection.execute(_people.insert().values(**row)).inserted_primary_key
            assert number
        return Person(number[0], language, begun, own_seed=seed)

    def of_code(self, code: str) -> Person | None:
        """The person of a code."""
        return self._person(_people.c.code == _hashed(plain_code(code)))

    def of_token(self, token: str) -> Person | None:
        """The person of a session."""
        return self._person(_people.c.token == _hashed(token))

    def is_code_of(self, code: str, person: Person) -> bool:
        """True if the code is that of a person."""
        found = self.of_code(code)
        return found is not None and found.number == person.number

    def come_back(self, code: str) -> tuple[Person, str] | None:
        """Find a person by the code, and give it a new token, after which the old one is void."""
        person = self.of_code(code)
        if not person:
            return None
        token = secrets.token_urlsafe(24)
        with self._working(writing=True) as connection:
            connection.execute(_people.update().where(_people.c.number == person.number).values(token=_hashed(token)))
        return person, token

    def finish(self, person: Person) -> None:
        """Note that a person has answered everything."""
        where = (_people.c.number == person.number) & _people.c.finished.is_(None)
        with self._working(writing=True) as connection:
            connection.execute(_people.update().where(where).values(finished=_now()))

    def delete(self, code: str) -> bool:
        """Delete a person and all its answers; False where nobody has the code."""
        with self._working(writing=True) as connection:
            person = self.of_code(code)
            if not person:
                return False
            connection.execute(_answers.delete().where(_answers.c.person == person.number))
            connection.execute(_people.delete().where(_people.c.number == person.number))
        return True

    def people(self) -> list[Person]:
        """Everybody who has begun, in the order in which they came."""
        with self._working() as connection:
            return [_person_of(row) for row in connection.execute(_people.select().order_by(_people.c.number))]

    def _person(self, where: sql.ColumnElement[bool]) -> Person | None:
        with self._working() as connection:
            row = connection.execute(_people.select().where(where)).first()
        return _person_of(row) if row else None

    # Answers ------------------------------------------------------------------------------------------------

    def save(self, answers: Iterable[Answer], ends: Mapping[str, int] | None = None) -> None:
        """Keep the answers of a page, all or none; an answer that was there already is replaced.

        `ends` holds, by question, the trial after which answers are dropped, as they followed from an earlier one.
        """
        rows = [
            {
                **vars(answer),
                "shown": json.dumps(answer.shown),
                "value": json.dumps(answer.value),
                "at": answer.at or _now(),
            }
            for answer in answers
        ]
        with self._working(writing=True) as connection:
            for row in rows:
                of = (
                    (_answers.c.person == row["person"])
                    & (_answers.c.question == row["question"])
                    & (_answers.c.trial == row["trial"])
                )
                connection.execute(_answers.delete().where(of))
                connection.execute(_answers.insert().values(**row))
                if row["question"] in (ends or {}):
                    later = (_answers.c.question == row["question"]) & (_answers.c.trial > row["trial"])
                    connection.execute(_answers.delete().where((_answers.c.person == row["person"]) & later))

    def answers_of(self, person: Person) -> dict[str, Answer]:
        """Answers of a person by the key of their trial."""
        return {f"{each.question}.{each.trial}": each for each in self._read(_answers.c.person == person.number)}

    def answers(self) -> list[Answer]:
        """Answers of everybody."""
        return self._read(sql.true())

    def _read(self, where: sql.ColumnElement[bool]) -> list[Answer]:
        query = _answers.select().where(where).order_by(_answers.c.person, _answers.c.at, _answers.c.trial)
        with self._working() as connection:
            rows = connection.execute(query).mappings().all()
        try:
            return [
                Answer(**{**row, "shown": tuple(json.loads(row["shown"])), "value": json.loads(row["value"])})
                for row in rows
            ]
        except ValueError:
            raise GreenswardError(f"{self._label}: holds damaged answers; take a copy that is whole") from None

    # Addresses ----------------------------------------------------------------------------------------------

    def hidden(self, text: str) -> str:
        """A name that stands for a text, from which nobody learns it."""
        return hmac.new(self._secret, text.encode(), hashlib.sha256).hexdigest()[:24]

    @contextlib.contextmanager
    def _working(self, writing: bool = False) -> Iterator[sql.Connection]:
        """A transaction; those that write a file wait for each other here, as SQLite's own waiting is slow."""
        lock = self._writing if writing and self._is_file else contextlib.nullcontext()
        try:
            with lock, self._engine.begin() as connection:
                yield connection
        except SQLAlchemyError as error:
            words = _words(error)
            cure = "; take a copy that is whole" if re.search("malformed|not a database", words) else ""
            raise GreenswardError(f"{self._label}: the database failed: {words}{cure}") from None


def plain_code(code: str) -> str:
    """A code as it was given, whatever a person has typed between its letters."""
    letters = [letter for letter in code.upper()[:100] if letter.isalnum()]
    return "-".join("".join(letters[i : i + _GROUP]) for i in range(0, len(letters), _GROUP))


def _new_code() -> str:
    return plain_code("".join(secrets.choice(LETTERS) for _ in range(_GROUPS * _GROUP)))


def _hashed(secret: str) -> str:
    # secrets of so many random bits need no slow hash
    return hashlib.sha256(secret.encode()).hexdigest()


def _person_of(row: Any) -> Person:
    return Person(row.number, row.language, row.begun, row.finished, row.own_seed)


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds")


def _words(error: BaseException) -> str:
    """The database's own words, on one line."""
    said = str(getattr(error, "orig", None) or error).strip().splitlines()
    return _without_password(said[0])[:300] if said else type(error).__name__


def _without_password(text: str) -> str:
    return re.sub(r"(//[^:/@\s]*):[^@\s]*@", r"\1:…@", text)


def _prepare_file(connection: Any, _: object) -> None:
    """Set up a connection to a file: readers do not wait for the writer, and a commit is on the disk."""
    cursor = connection.cursor()
    for setting in (
        "journal_mode = WAL",
        "synchronous = FULL",
        "foreign_keys = ON",
        f"busy_timeout = {_WAIT_S * 1e3:.0f}",
    ):
        cursor.execute(f"PRAGMA {setting}")
    cursor.close()
