"""Species of grass and flowers: named starting points, each key of which a scene may override."""

import tomllib
from functools import cache
from importlib.resources import files
from typing import Annotated, Any, Literal, get_args

from pydantic import Field, field_validator, model_validator
from pydantic_core import PydanticCustomError

from greensward.scene.base import Amount, Colour, Model, Number, OptionalFileName, Range, Text, default

MOST_SPECIES = 16

Shape = Literal["quad", "triangle", "quadratic", "quadratic-3d", "minimum-width", "triangle-tip", "dandelion"]
SHAPES: tuple[str, ...] = get_args(Shape)
Head = Literal["none", "panicle", "spike", "daisy", "cup", "globe"]
HEADS: tuple[str, ...] = get_args(Head)

_Part = Annotated[Number, Field(ge=0, le=1)]
Length = Annotated[Number, Field(ge=0.001, le=20)]
Width = Annotated[Number, Field(ge=0.0001, le=2)]
_HeadSize = Annotated[Number, Field(ge=0.001, le=2)]
_Tilt = Annotated[Number, Field(ge=0, le=85)]


@cache
def species_table() -> dict[str, dict[str, Any]]:
    """Named species and the keys that each sets, from `scene/species.toml`."""
    return tomllib.loads((files("greensward.scene") / "species.toml").read_text(encoding="utf-8"))


class Grass(Model):
    """A species: size, shape, colours and share of the field."""

    species: Text = "meadow-grass"
    """Named starting point; the keys below override it."""
    share: Amount = Field(default=1.0, ge=0, le=1e6)
    """Share of the blades, relative to the other species."""
    patchiness: Number = Field(default=0.4, ge=0, le=1)
    """0 mixes the species evenly; 1 gathers it in drifts."""
    height_m: Range[Length] = default((0.25, 0.6))
    """Length of a blade from root to tip, measured along it."""
    width_m: Range[Width] = default((0.003, 0.006))
    """Greatest width."""
    stiffness: Range[_Part] = default((0.4, 0.8))
    """Resistance to wind: 0 follows it, 1 hardly moves."""
    mass_kg_per_m2: Number = Field(default=0.2, ge=0.001, le=100)
    """Fresh mass of a blade for the area of one of its sides; it matters with `[mass]`."""
    tilt_deg: Range[_Tilt] = default((8.0, 40.0))
    """Lean of the line from root to tip."""
    bend: Range[_Part] = default((0.1, 0.5))
    """Arch of the blade out of that line; 0 is straight."""
    shape: Shape = "quadratic"
    """Outline of the blade."""
    alpha_texture: OptionalFileName = default(None)
    """Image of the outline, root at the bottom, for techniques that draw blades as textured quads: its alpha, or
    where that is opaque all over, its brightness. Without one, the outline of `shape`."""
    diffuse_texture: OptionalFileName = default(None)
    """Image of a blade's colours for the same techniques, root at the bottom. Without one, the colours below."""
    root_colour: Colour = "#3d4f1e"
    """sRGB at the root."""
    tip_colour: Colour = "#7f9a3c"
    """sRGB at the tip."""
    dry_colour: Colour = "#b39a58"
    """sRGB of a dry blade."""
    dryness: Range[_Part] = default((0.0, 0.35))
    """Dryness of the blades, from root and tip colour (0) to dry colour (1); it drifts over the field."""
    transmittance: Number = Field(default=0.55, ge=0, le=1)
    """Light that passes through the blade, relative to what it reflects."""
    roughness: Number = Field(default=0.45, ge=0.05, le=1)
    """Gloss: low is shiny."""
    head: Head = "none"
    """Flower or seed head at the tip."""
    head_share: Number = Field(default=1.0, ge=0, le=1)
    """Fraction of the blades with a head."""
    head_size_m: Range[_HeadSize] = default((0.012, 0.018))
    """Length of a seed head, width of a flower."""
    head_colour: Colour = "#e9e4d8"
    """sRGB of petals or seeds."""
    heart_colour: Colour = "#d8a520"
    """sRGB of the middle of a flower."""

    @model_validator(mode="before")
    @classmethod
    def _start_from_species(cls, values: Any) -> Any:
        if not isinstance(values, dict):
            return values
        name = values.get("species", cls.model_fields["species"].default)
        # An unknown name is refused below, by the field itself, so that the other keys are checked too.
        return {**species_table().get(name, {}), **values} if isinstance(name, str) else values

    @field_validator("species")
    @classmethod
    def _is_known(cls, name: str) -> str:
        if name not in species_table():
            expected = ", ".join(f"'{known}'" for known in species_table())
            raise PydanticCustomError("unknown_species", "must be one of {expected}", {"expected": expected})
        return name
