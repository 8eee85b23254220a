"""Base of every scene model: strict numbers, units in the key, help on the field."""

import re
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Generic, Self, TypeAlias, TypeVar, get_args, overload

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    Strict,
    ValidationError,
    ValidatorFunctionWrapHandler,
    WithJsonSchema,
    WrapValidator,
    model_validator,
)
from pydantic.fields import FieldInfo

from greensward.scene.errors import SceneError
from greensward.scene.problems import sentences
from greensward.scene.raster import Array, Raster, picture_in

_NAMES_A_FILE = "names a file"
_IN_PYTHON = "given in Python alone"
_OR_ARRAY = "takes an array"


def _ordered(pair: tuple[float, float]) -> tuple[float, float]:
    if pair[0] > pair[1]:
        raise ValueError("must be [low, high] with low at most high")
    return pair


def _none_or_some(amount: float) -> float:
    if 0.0 < amount < 1e-6:
        raise ValueError("must be 0, or at least 1e-6")
    return amount


def _hex_colour(text: str) -> str:
    if not re.fullmatch(r"#[0-9a-fA-F]{6}", text):
        raise ValueError('must be an sRGB colour such as "#7d9a45"')
    return text.lower()


def _as_text(path: Any) -> Any:
    return path.as_posix() if isinstance(path, Path) else path


_PLAIN = frozenset({bool, int, float, str, type(None)})


def _without_arrays(value: Any) -> Any:
    """The value with lists and numbers in the place of NumPy's arrays and scalars."""
    if type(value) in _PLAIN or isinstance(value, BaseModel):
        return value
    if isinstance(value, tuple) and all(type(item) in _PLAIN or isinstance(item, BaseModel) for item in value):
        return value
    if hasattr(value, "tolist"):
        return value.tolist()
    return [_without_arrays(item) for item in value] if isinstance(value, list | tuple) else value


def _not_one_table(values: Any) -> Any:
    if isinstance(values, BaseModel):  # which can be iterated over, key by key
        raise ValueError(f"must be a list, so put the {type(values).__name__} into brackets")
    return values


def _or_picture(value: Any, handler: ValidatorFunctionWrapHandler) -> Any:
    return picture_in(value) or handler(value)


def _as_it_is(value: Any) -> Any:
    return value


_T = TypeVar("_T")
_Given = TypeVar("_Given", contravariant=True)
_Held = TypeVar("_Held", covariant=True)
Number = Annotated[float, Strict()]
Amount = Annotated[Number, AfterValidator(_none_or_some)]
"""Amount, such as blades on an area: 0, or one that is not lost in single precision."""
Count = Annotated[int, Strict()]
Flag = Annotated[bool, Strict()]
Text = Annotated[str, Strict()]
Colour = Annotated[str, Strict(), AfterValidator(_hex_colour)]
_Coordinate = Annotated[float, Strict(), Field(ge=-1_000_000, le=1_000_000)]
_Turn = Annotated[float, Strict(), Field(ge=-360, le=360)]
MOST_EXTENT_M = 200_000
LEAST_EXTENT_M = 0.001
_Extent = Annotated[float, Strict(), Field(ge=LEAST_EXTENT_M, le=MOST_EXTENT_M)]

if TYPE_CHECKING:

    class Converted(Generic[_Given, _Held]):
        """Field whose constructor takes more types than the model holds, as type checkers see it."""

        @overload
        def __get__(self, model: None, owner: Any) -> Self: ...
        @overload
        def __get__(self, model: object, owner: Any) -> _Held: ...
        def __get__(self, model: object, owner: Any) -> Any: ...
        def __set__(self, model: object, value: _Given) -> None: ...

    _Two: TypeAlias = tuple[_T, _T] | list[_T] | Array
    _Three: TypeAlias = tuple[_T, _T, _T] | list[_T] | Array
    Pair: TypeAlias = Converted[_Two[_T], tuple[_T, _T]]
    Range: TypeAlias = Pair[_T]
    OptionalPair: TypeAlias = Converted[_Two[_T] | None, tuple[_T, _T] | None]
    OptionalRange: TypeAlias = OptionalPair[_T]
    Triple: TypeAlias = Converted[_Three[_T], tuple[_T, _T, _T]]
    Point: TypeAlias = Triple[float]
    OptionalPoint: TypeAlias = Converted[_Three[float] | None, tuple[float, float, float] | None]
    Many: TypeAlias = Converted[Sequence[_T] | Array, tuple[_T, ...]]
    GroundPoints: TypeAlias = Converted[Sequence[_Two[float]] | Array, tuple[tuple[float, float], ...]]
    Points: TypeAlias = Converted[Sequence[_Three[float]] | Array, tuple[tuple[float, float, float], ...]]
    Places: TypeAlias = Points
    FileName: TypeAlias = Converted[str | Path, str]
    OptionalFileName: TypeAlias = Converted[str | Path | None, str | None]
    FileNames: TypeAlias = Converted[Sequence[str | Path], tuple[str, ...]]
    OptionalMap: TypeAlias = Converted[str | Path | Raster | Array | None, str | Raster | None]
    OptionalArray: TypeAlias = Converted[Raster | Array | None, Raster | None]
else:
    Pair = tuple[_T, _T]
    Range = Annotated[Pair[_T], AfterValidator(_ordered)]
    """`[low, high]` that blades vary over."""
    OptionalPair = Pair[_T] | None
    OptionalRange = Range[_T] | None
    Triple = tuple[_T, _T, _T]
    Point = Triple[_Coordinate]
    OptionalPoint = Point | None
    Many = Annotated[tuple[_T, ...], BeforeValidator(_not_one_table)]
    GroundPoints = Many[Pair[_Coordinate]]
    Points = Many[Point]
    Places = Many[tuple[_Coordinate, _Coordinate, _Turn]]
    """On the ground: x, z and a turn in degrees."""
    FileName = Annotated[str, Strict(), Field(min_length=1), BeforeValidator(_as_text), _NAMES_A_FILE]
    OptionalFileName = FileName | None
    FileNames = Many[FileName]
    OptionalMap = Annotated[FileName, WrapValidator(_or_picture), PlainSerializer(_as_it_is), _OR_ARRAY] | None
    """Name of a picture, or in Python an array with its pixels."""
    OptionalArray = Annotated[Raster, _IN_PYTHON, WithJsonSchema({"type": "array"})] | None

GroundPoint: TypeAlias = Pair[_Coordinate]
"""Point on the ground: x and z."""
Size: TypeAlias = Pair[_Extent]
OptionalSize: TypeAlias = OptionalPair[_Extent]


def default(value: Any) -> Any:
    """Return a field's default, typed so that it fits a field of other types in the constructor than in the model."""
    return value


class Model(BaseModel):
    """A frozen part of a scene. Unknown keys, strings for numbers, NaN and infinity are refused.

    NumPy's arrays and scalars count as lists and numbers. Raises `SceneError`, one sentence for each problem.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, validate_default=True, use_attribute_docstrings=True
    )

    if not TYPE_CHECKING:  # type checkers derive the constructor from the fields

        def __init__(self, /, *values: Any, **keys: Any) -> None:
            name = type(self).__name__
            if values:
                first = next(iter(type(self).model_fields), "key")
                raise SceneError([f"{name}: takes values by key only, such as {name}({first}=…)"])
            try:
                super().__init__(**keys)
            except ValidationError as error:
                raise _told(error, type(self)) from None

        # pydantic validates inner tables without their constructors, so that one error holds all problems
        __init__.__pydantic_base_init__ = True

        def __setattr__(self, key: str, value: Any) -> None:
            if not key.startswith("_"):
                name = type(self).__name__
                cure = f'make a copy with model_copy(update={{"{key}": …}})'
                raise SceneError([f"{name}: {key}: cannot change, as a scene and its parts are frozen; {cure}"])
            super().__setattr__(key, value)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return a copy with these keys changed, validated like a new one. Raises `SceneError`."""
        if not update:
            return super().model_copy(deep=deep)
        made = type(self)(**{**dict(self), **(self.model_extra or {}), **update})
        return super().model_copy(update={key: getattr(made, key) for key in update}, deep=deep)

    @model_validator(mode="before")
    @classmethod
    def _holds_no_arrays(cls, values: Any) -> Any:
        if not isinstance(values, dict):
            return values
        kept = _fields_of_arrays(cls)
        return {key: value if key in kept else _without_arrays(value) for key, value in values.items()}


@cache
def _fields_of_arrays(model: type[BaseModel]) -> frozenset[str]:
    return frozenset(key for key, field in model.model_fields.items() if takes_an_array(field))


def _told(error: ValidationError, model: type[BaseModel]) -> SceneError:
    return SceneError(dict.fromkeys(sentences(error, model, lambda _: model.__name__)))


class Area(Model):
    """A part of the ground."""

    from_m: GroundPoint
    """Its north-west corner: x and z."""
    to_m: GroundPoint
    """Its south-east corner."""

    @model_validator(mode="after")
    def _has_an_area(self) -> Self:
        if not all(low < high for low, high in zip(self.from_m, self.to_m, strict=True)):
            raise ValueError(f"to_m must be south-east of from_m (got {list(self.from_m)} and {list(self.to_m)})")
        return self


def linear(colour: str) -> tuple[float, float, float]:
    """Linear-light RGB in 0..1 of an sRGB colour `#rrggbb` (IEC 61966-2-1)."""

    def decode(c: float) -> float:
        return c / 12.92 if c <= 0.04045 else float(((c + 0.055) / 1.055) ** 2.4)

    red, green, blue = (decode(int(colour[i : i + 2], 16) / 255.0) for i in (1, 3, 5))
    return red, green, blue


def names_a_file(field: FieldInfo) -> bool:
    """Return whether the field holds the name of a file, which is relative to the scene's folder."""
    return _is_marked(field, _NAMES_A_FILE)


def is_for_python(field: FieldInfo) -> bool:
    """Return whether the field can only be given in Python, and not in TOML."""
    return _is_marked(field, _IN_PYTHON)


def takes_an_array(field: FieldInfo) -> bool:
    """Return whether the field may hold an array, which Python gives."""
    return is_for_python(field) or _is_marked(field, _OR_ARRAY)


def _is_marked(field: FieldInfo, mark: str) -> bool:
    return mark in field.metadata or any(mark in get_args(part) for part in get_args(field.annotation))
