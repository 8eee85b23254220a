"""Models of the field: sowing, growth, culling, technique and shadows."""

from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, Self, TypeAlias

from pydantic import AfterValidator, ConfigDict, Field, model_validator

from greensward.scene.base import Amount, Count, Flag, GroundPoints, Model, Number, OptionalMap, Text, default

MOST_KEYS = 8
MOST_CASCADES = 4


class Sowing(Model):
    """Sowing of the blades: density, maps, slope, clumps and drifts."""

    density_per_m2: Amount = Field(default=600.0, ge=0, le=100_000)
    """Blades per square metre before maps, slope and distance thin them."""
    density_map: OptionalMap = default(None)
    """Image over the whole ground: red is density, green the low-detail subset, blue the height."""
    vegetation_map: OptionalMap = default(None)
    """Image over the whole ground that colours the grass; its alpha is the strength."""
    max_slope_deg: Number = Field(default=60.0, ge=0, le=90)
    """No blade grows where the ground is steeper."""
    along_normal: Number = Field(default=0.35, ge=0, le=1)
    """Direction in which blades of the ground grow: 0 straight up, 1 along the normal of the land. The billboards of
    `billboard-grid` and `geometry-billboards` stand upright."""
    clump_m: Number = Field(default=0.35, ge=0.01, le=100)
    """Size of clumps, whose blades share lean and colour."""
    clumping: Number = Field(default=0.5, ge=0, le=1)
    """Strength of clumps: 0 has none; 1 pulls every blade into one, short blades less."""
    drift_m: Number = Field(default=12.0, ge=0.1, le=10_000)
    """Distance over which height, density, dryness and species drift."""
    drift: Number = Field(default=0.6, ge=0, le=1)
    """Strength of those drifts."""
    full_density_m: Number = Field(default=8.0, ge=0.01, le=100_000)
    """Every blade is drawn up to this distance from the camera; beyond, fewer and wider blades represent them."""
    reach_m: Number = Field(default=300.0, ge=0.1, le=100_000)
    """No grass is drawn beyond this distance from the camera; the ground takes its colour."""
    traced_m: Number | None = Field(default=None, ge=0.1, le=100_000)
    """No blades are drawn beyond this distance from the camera; from there to `reach_m` the grass is ray-marched
    billboards, as of `billboard-grid`. Left out, blades reach as far. Not for `billboard-grid` itself."""
    stored_m: Number | None = Field(default=None, ge=0, le=100_000)
    """Blades of the ground farther away than this take no memory: they grow from the seed in every frame, and have
    neither flowers nor seed heads nor simulation. 0 stores none; left out, all are. For `visibility-buffer` only."""

    @model_validator(mode="after")
    def _is_traced_within_reach(self) -> Self:
        if self.traced_m is not None and self.traced_m >= self.reach_m:
            raise ValueError(f"traced_m must be below reach_m, {self.reach_m:g} (got {self.traced_m:g})")
        return self

    @property
    def blades_m(self) -> float:
        """Distance from the camera to which blades are drawn."""
        return self.reach_m if self.traced_m is None else self.traced_m


_Part = Annotated[Number, Field(ge=0, le=1)]
_Factor = Annotated[Number, Field(ge=0, le=10)]


def _from_seed_to_ripe(curve: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    ages = [age for age, _ in curve]
    if any(later <= earlier for earlier, later in pairwise(ages)):
        raise ValueError("must hold [age, factor] pairs with rising ages")
    return curve


if TYPE_CHECKING:
    _Keys: TypeAlias = GroundPoints
else:
    _Keys = tuple[tuple[_Part, _Factor], ...]
Curve: TypeAlias = Annotated[_Keys, Field(min_length=1, max_length=MOST_KEYS), AfterValidator(_from_seed_to_ripe)]
"""`[age, factor]` pairs, interpolated linearly and constant outside."""


class Growth(Model):
    """Growth over time, from `age` at time 0; at age 1 the grass is full-grown."""

    age: Number = Field(default=0.0, ge=0, le=1)
    """Age at time 0; 0 is a seed."""
    time_s: Number = Field(default=60.0, ge=0.001, le=1e9)
    """Time from seed to full-grown."""
    spread: Number = Field(default=0.25, ge=0, le=1)
    """Delay between the first and the last blade to come up, as a fraction of `time_s`."""
    height: Curve = default(((0.0, 0.0), (0.5, 0.75), (1.0, 1.0)))
    """Factor on the height by age."""
    width: Curve = default(((0.0, 0.2), (0.4, 0.7), (1.0, 1.0)))
    """Factor on the width by age."""
    stiffness: Curve = default(((0.0, 0.5), (1.0, 1.0)))
    """Factor on the stiffness by age."""


class Culling(Model):
    """Culling on the GPU of blades that would not show. Each test may be switched off to compare."""

    orientation: Flag = True
    """Blades seen so edge-on that their technique gives them no width."""
    frustum: Flag = True
    """Blades outside the view."""
    distance: Flag = True
    """More blades with growing distance; those that remain are wider. The only test that changes the picture."""
    occlusion: Flag = True
    """Blades behind ground and objects."""
    behind_grass: Flag = False
    """Blades behind nearer grass too, with `visibility-buffer`: pays off where the camera is down in the grass."""


class TechniqueChoice(Model):
    """Technique that draws the grass; its settings are the other keys of the table."""

    model_config = ConfigDict(extra="allow")

    name: Text = "visibility-buffer"
    """One of the techniques listed by `greensward info`."""

    if TYPE_CHECKING:

        def __init__(self, *, name: str = ..., **settings: Any) -> None: ...


class Shadows(Model):
    """Cascaded shadow maps of the sun: nested squares around the view, the first the sharpest."""

    enabled: Flag = True
    """Shadows of grass, objects and ground on or off."""
    cascades: Count = Field(default=3, ge=1, le=MOST_CASCADES)
    """Number of cascades."""
    size_px: Count = Field(default=1024, ge=64, le=8192)
    """Edge of each map."""
    nearest_m: Number = Field(default=7.0, ge=0.01, le=10_000)
    """Distance from the camera to which the first cascade reaches."""
    furthest_m: Number = Field(default=700.0, ge=0.01, le=100_000)
    """Distance to which the last cascade reaches."""
    density: Number = Field(default=0.5, ge=0, le=1)
    """Fraction of the blades that cast shadows; they are wider, to represent the others."""
