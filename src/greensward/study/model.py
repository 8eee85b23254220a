"""A study: its texts, pictures and questions, read from `study.toml`."""

import datetime
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, Strict, ValidationError, model_validator

from greensward.scene.base import Count, FileName, Flag, Many, Model, Number, Text, default
from greensward.scene.errors import SceneError
from greensward.scene.files import is_there
from greensward.scene.load import read_table
from greensward.scene.problems import MOST_TOLD, sentences

_STUDIES = Path(str(files("greensward.study") / "studies"))
LANGUAGES = {"en": "English", "de": "Deutsch", "sv": "Svenska"}
"""Languages in which the page itself speaks, by their code."""


def _known_languages(words: str | dict[str, str]) -> str | dict[str, str]:
    if isinstance(words, dict) and not words:
        raise ValueError("must hold a text for each language")
    return words


Name = Annotated[str, Strict(), Field(pattern=r"^[a-z0-9][a-z0-9-]{0,39}$")]
"""A name that is also part of an address: small letters, digits and hyphens."""
Words = Annotated[
    Annotated[str, Strict(), Field(max_length=10_000)]
    | Annotated[dict[str, Annotated[str, Strict(), Field(max_length=10_000)]], Field(max_length=20)],
    AfterValidator(_known_languages),
]
"""A text, or a table of it by language: `{ en = "Grass", de = "Gras" }`."""
Names = Annotated[Many[Name], Field(max_length=64)]


class Line(Model):
    """A line across a picture, to which questions can point."""

    at: Number = Field(ge=0, le=1)
    """Height in the picture: 0 is its top, 1 its bottom."""
    colour: Annotated[str, Strict(), Field(pattern=r"^#[0-9a-fA-F]{6}$")] = "#c02020"
    """sRGB of the line."""


class Picture(Model):
    """A picture or a clip: drawn from a scene, or a file of its own."""

    name: Name
    scene: Text = ""
    """Preset, scene file or folder that it is drawn from, relative to the study's folder."""
    file: FileName | None = None
    """Picture or clip that is there already, such as a photograph, instead of a scene."""
    set: dict[Annotated[str, Strict()], Any] = default({})
    """Settings that differ from the scene's, by their keys: `{ "wind.0.speed_mps" = 6 }`."""
    technique: Text = ""
    """Technique that draws it. Left out, it is the scene's."""
    time_s: Number = Field(default=0.0, ge=-1e6, le=1e6)
    """Instant that it shows, or at which a clip begins."""
    seconds: Number = Field(default=0.0, ge=0, le=60)
    """Length of a clip. 0 makes a picture."""
    samples: Count = Field(default=8, ge=1, le=64)
    """Samples of each pixel."""
    lines: Annotated[Many[Line], Field(max_length=8)] = default(())
    """Lines across it."""
    caption: Words = ""
    """Caption below it. Left out, those that are shown together are numbered."""
    alt: Words = ""
    """Description for those who cannot see it. It must not tell what is asked."""

    @model_validator(mode="after")
    def _has_one_source(self) -> Self:
        if bool(self.scene) == (self.file is not None):
            raise ValueError("must have either scene or file")
        if self.file is not None and (self.set or self.technique or self.seconds):
            raise ValueError("set, technique and seconds are for a scene, and this picture is a file")
        return self


class Option(Model):
    """An answer that a person can choose."""

    value: Name
    """The name that answers are kept under."""
    text: Words


class _Question(Model):
    """Base of all questions."""

    name: Name
    text: Words
    """The question."""
    note: Words = ""
    """Explanation, in smaller letters."""
    page: Text = ""
    """Questions beside each other with the same page are asked on one. Left out, it has a page of its own."""
    required: Flag = True
    """True if nobody goes on without an answer."""


class _Shown(_Question):
    show: Names = default(())
    """Pictures above the question, such as references."""


class Choice(_Shown):
    """A choice among options, which may stand for pictures that are shown."""

    kind: Literal["choice"] = "choice"
    options: Annotated[Many[Option], Field(min_length=2, max_length=40)]
    many: Flag = False
    """True if several may be chosen."""
    other: Flag = False
    """True if there is room for an answer in own words."""
    correct: Name | None = None
    """Option that everybody chooses who reads the question. The report leaves out who does not."""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        values = [option.value for option in self.options]
        if twice := next((value for value in values if values.count(value) > 1), None):
            raise ValueError(f'options must have values that differ (got "{twice}" twice)')
        if self.correct is not None and self.correct not in values:
            raise ValueError(f'correct must be the value of an option (got "{self.correct}")')
        return self


class Score(_Shown):
    """A score on a scale whose ends have names."""

    kind: Literal["score"] = "score"
    least: Count = Field(default=1, ge=0, le=10)
    most: Count = Field(default=5, ge=1, le=10)
    least_text: Words = ""
    """Meaning of the lowest score."""
    most_text: Words = ""
    """Meaning of the highest score."""

    @model_validator(mode="after")
    def _has_a_range(self) -> Self:
        if self.least >= self.most:
            raise ValueError(f"most must be above least (got {self.least} and {self.most})")
        return self


class Quantity(_Shown):
    """A whole number, such as an age."""

    kind: Literal["number"] = "number"
    least: Count = Field(default=0, ge=-1_000_000, le=1_000_000)
    most: Count = Field(1_000_000, ge=-1_000_000, le=1_000_000)

    @model_validator(mode="after")
    def _has_a_range(self) -> Self:
        if self.least >= self.most:
            raise ValueError(f"most must be above least (got {self.least} and {self.most})")
        return self


class Comment(_Shown):
    """An answer in own words."""

    kind: Literal["text"] = "text"
    long: Flag = False
    """True if it has room for several lines."""


class Pairs(_Question):
    """Blind pairs: of two pictures that stand beside each other, which one? Order and sides are random."""

    kind: Literal["pairs"] = "pairs"
    pictures: Annotated[Many[Name], Field(min_length=2, max_length=24)]
    """Pictures that are compared, each with each."""
    per_person: Count | None = Field(default=None, ge=1, le=500)
    """Pairs that each person sees, chosen at random. Left out, all."""
    ties: Flag = False
    """True if "no difference" is an answer."""
    repeats: Count = Field(default=0, ge=0, le=50)
    """Pairs that are shown once more, with the sides changed."""
    catches: Annotated[Many[tuple[Name, Name]], Field(max_length=50)] = default(())
    """Pairs whose answer is plain, the better picture first: they find those who do not look."""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if twice := next((name for name in self.pictures if self.pictures.count(name) > 1), None):
            raise ValueError(f'pictures must differ (got "{twice}" twice)')
        pairs = len(self.pictures) * (len(self.pictures) - 1) // 2
        for key, count in (("per_person", self.per_person or 1), ("repeats", self.repeats)):
            if count > min(pairs, self.per_person or pairs) and count > pairs:
                raise ValueError(f"{key} must be at most {pairs}, the number of pairs (got {count})")
        return self


class Staircase(_Question):
    """A just-noticeable difference: of two pictures, one of which is the reference, which one differs?

    Levels come closer to the reference after `down` correct answers in a row, and farther from it after a wrong one
    (Levitt 1971, "Transformed up-down methods in psychoacoustics").
    """

    kind: Literal["staircase"] = "staircase"
    reference: Name
    levels: Annotated[Many[Name], Field(min_length=2, max_length=64)]
    """Pictures from the one nearest to the reference to the one farthest from it."""
    sizes: Annotated[Many[Number], Field(max_length=64)] = default(())
    """The difference of each level, for the report, in a unit of your own. Left out, they count from 1."""
    down: Count = Field(default=2, ge=1, le=4)
    """Correct answers in a row before the next nearer level: 2 finds what 71 % see, 3 what 79 % see."""
    reversals: Count = Field(default=6, ge=2, le=30)
    """Turns from nearer to farther or back after which it ends."""
    most: Count = Field(default=40, ge=4, le=200)
    """Trials after which it ends in any case."""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.sizes and len(self.sizes) != len(self.levels):
            raise ValueError(f"sizes must hold {len(self.levels)} values, one for each level (got {len(self.sizes)})")
        if list(self.sizes) != sorted(set(self.sizes)):
            raise ValueError("sizes must rise")
        if twice := next((n for n in self.levels if self.levels.count(n) > 1 or n == self.reference), None):
            raise ValueError(f'levels must differ from each other and from the reference (got "{twice}" twice)')
        return self


Question = Choice | Score | Quantity | Comment | Pairs | Staircase


class Attention(Model):
    """Rules, said before anybody answers, of whom the report leaves out."""

    most_caught: Number = Field(default=0.25, ge=0, le=1)
    """Greatest share of wrong answers to catch trials."""
    least_repeated: Number = Field(default=0.0, ge=0, le=1)
    """Least share of repeated pairs that are answered alike."""
    least_s: Number = Field(default=0.0, ge=0, le=3600)
    """Least time from the first answer to the last."""


class Study(Model):
    """A study: texts, pictures and questions."""

    title: Words
    introduction: Words = ""
    """Text of the first page; an empty line begins a new paragraph."""
    consent: Words
    """Statement that people agree to before the first question."""
    thanks: Words = ""
    """Text of the last page."""
    based_on: Literal["", "tillman2013-first", "tillman2013-second"] = ""
    """Published study with the same questions, whose figures the report shows beside its own."""
    contact: Text = ""
    """Name and address of those who answer for the study."""
    closes: datetime.date | None = None
    """Last day on which answers are taken."""
    languages: Annotated[Many[Literal["en", "de", "sv"]], Field(min_length=1)] = default(("en",))
    """Languages of the page; people start with that of their browser, or the first."""
    size: tuple[Annotated[Count, Field(ge=64, le=7680)], Annotated[Count, Field(ge=64, le=4320)]] = (1280, 720)
    """Width and height of all pictures that are drawn."""
    scaled: Literal["never", "alike"] = "alike"
    """`never` shows pictures pixel by pixel, and says so where a screen is too small; `alike` scales all of a page by
    one factor, to fit."""
    seed: Count = Field(default=1, ge=0, le=2**32 - 1)
    """Seed of orders and sides, together with each person's own."""
    attention: Attention = Attention()
    picture: Annotated[Many[Picture], Field(max_length=1000)] = default(())
    question: Annotated[Many[Annotated[Question, Field(discriminator="kind")]], Field(min_length=1, max_length=500)]

    @model_validator(mode="after")
    def _names_fit(self) -> Self:
        for what, named in (("picture", self.picture), ("question", self.question)):
            names = [each.name for each in named]
            if twice := next((name for name in names if names.count(name) > 1), None):
                raise ValueError(f'{what}: names must differ (got "{twice}" twice)')
        known = {picture.name for picture in self.picture}
        for i, question in enumerate(self.question):
            if missing := next((name for name in shown_in(question) if name not in known), None):
                raise ValueError(f'question[{i}]: no picture has the name "{missing}"; add a [[picture]] for it')
        for where, words in self._words():
            if isinstance(words, dict) and (lacks := [each for each in self.languages if each not in words]):
                raise ValueError(
                    f"{where}: has no text for the language {lacks[0]}; add it, or take it off languages"
                )
        return self

    def _words(self) -> list[tuple[str, str | dict[str, str]]]:
        found = [(name, getattr(self, name)) for name in ("title", "introduction", "consent", "thanks")]
        found += [
            (f"picture[{i}].{key}", getattr(picture, key))
            for i, picture in enumerate(self.picture)
            for key in ("caption", "alt")
        ]
        for i, question in enumerate(self.question):
            keys = [key for key in ("text", "note", "least_text", "most_text") if hasattr(question, key)]
            found += [(f"question[{i}].{key}", getattr(question, key)) for key in keys]
            if isinstance(question, Choice):
                found += [(f"question[{i}].options[{k}].text", each.text) for k, each in enumerate(question.options)]
        return found

    def question_of(self, name: str) -> Question:
        """The question of a name. Raises `KeyError`."""
        return {question.name: question for question in self.question}[name]


def shown_in(question: Question) -> tuple[str, ...]:
    """Names of all pictures that a question may show."""
    match question:
        case Pairs():
            return (*question.pictures, *(name for pair in question.catches for name in pair))
        case Staircase():
            return (question.reference, *question.levels)
        case _:
            return question.show


def say(words: str | dict[str, str], language: str) -> str:
    """A text in a language."""
    return words if isinstance(words, str) else words[language]


def shipped() -> dict[str, Path]:
    """Files of the studies that come with the program, by name."""
    return {path.stem: path for path in sorted(_STUDIES.glob("*.toml"))}


def study_file(folder: Path) -> Path:
    """The file of a study: `study.toml` of a folder, or the file itself. Raises `SceneError`."""
    file = folder / "study.toml" if folder.is_dir() else folder
    if not is_there(file):
        raise SceneError([f"{folder}: holds no study.toml; `greensward study new` writes one to start from"])
    return file


def load_study(folder: Path) -> Study:
    """Read the study of a folder, or of a file. Raises `SceneError`, which holds all problems."""
    file = study_file(folder)
    label = str(file)
    table = read_table(file, label, "a study")
    try:
        return Study.model_validate(table)
    except ValidationError as error:
        found = sentences(error, Study, lambda _: label)
        raise SceneError(dict.fromkeys(found), max(error.error_count() - MOST_TOLD, 0)) from None
