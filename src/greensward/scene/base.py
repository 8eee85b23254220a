"""What every scene model shares: strict numbers, units in the key, help on the field."""

import re
from typing import Annotated, Any, Self, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, Strict, model_validator
from pydantic.fields import FieldInfo

_NAMES_A_FILE = "names a file"

Number = Annotated[float, Strict()]
Count = Annotated[int, Strict()]
Flag = Annotated[bool, Strict()]
Text = Annotated[str, Strict()]
FileName = Annotated[str, Strict(), Field(min_length=1), _NAMES_A_FILE]


def _ordered(pair: tuple[float, float]) -> tuple[float, float]:
    if pair[0] > pair[1]:
        raise ValueError("must be [low, high] with low at most high")
    return pair


def _hex_colour(text: str) -> str:
    if not re.fullmatch(r"#[0-9a-fA-F]{6}", text):
        raise ValueError('must be an sRGB colour such as "#7d9a45"')
    return text.lower()


def span(low: float, high: float) -> Any:
    """A `[low, high]` range that blades vary over, both ends within these limits."""
    bounded = Annotated[float, Strict(), Field(ge=low, le=high)]
    return Annotated[tuple[bounded, bounded], AfterValidator(_ordered)]


Colour = Annotated[str, Strict(), AfterValidator(_hex_colour)]
_Coordinate = Annotated[float, Strict(), Field(ge=-1_000_000, le=1_000_000)]
Point = tuple[_Coordinate, _Coordinate, _Coordinate]
Spot = tuple[_Coordinate, _Coordinate]
"""On the ground: x and z."""
Place = tuple[_Coordinate, _Coordinate, Annotated[float, Strict(), Field(ge=-360, le=360)]]
"""On the ground: x, z and a turn in degrees."""
Size = tuple[Annotated[float, Strict(), Field(gt=0, le=100_000)], Annotated[float, Strict(), Field(gt=0, le=100_000)]]


class Model(BaseModel):
    """A frozen part of a scene. Unknown keys, strings for numbers, NaN and infinity are refused."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, validate_default=True, use_attribute_docstrings=True
    )


class Area(Model):
    """A part of the ground."""

    from_m: tuple[Number, Number]
    """Its north-west corner: x and z."""
    to_m: tuple[Number, Number]
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
    """Whether the field holds the name of a file, which is relative to the scene's folder."""
    return _NAMES_A_FILE in field.metadata or any(
        _NAMES_A_FILE in get_args(part) for part in get_args(field.annotation)
    )


def models_in(annotation: Any) -> tuple[type[BaseModel], ...]:
    """The models that a field of this type may hold; several where `kind` chooses among them."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return (annotation,)
    return tuple(model for part in get_args(annotation) for model in models_in(part))


def kind_of(model: type[BaseModel]) -> str | None:
    """The `kind` by which a scene file chooses this model, where it does."""
    kinds = get_args(model.model_fields["kind"].annotation) if "kind" in model.model_fields else ()
    return kinds[0] if len(kinds) == 1 else None
