"""Where blades grow and how they age, which of them are drawn, and how."""

from itertools import pairwise
from typing import Annotated, Self

from pydantic import AfterValidator, ConfigDict, Field, model_validator

from greensward.scene.base import Count, FileName, Flag, Model, Number, Text


class Sowing(Model):
    """Where blades grow: density, maps, slope, clumps and drifts."""

    density_per_m2: Number = Field(600.0, ge=0, le=100_000)
    """Blades on a square metre where nothing thins them."""
    density_map: FileName | None = None
    """Picture over the whole ground: red is density, green the low-detail subset, blue the height."""
    vegetation_map: FileName | None = None
    """Picture over the whole ground that colours the grass; its alpha says how much."""
    max_slope_deg: Number = Field(60.0, ge=0, le=90)
    """No blade grows where the ground is steeper."""
    clump_m: Number = Field(0.35, gt=0, le=100)
    """Size of clumps, in which blades lean and colour alike."""
    clumping: Number = Field(0.5, ge=0, le=1)
    """0 has no clumps; 1 pulls every blade into one, the less the shorter it is for the size of a clump."""
    drift_m: Number = Field(12.0, gt=0, le=10_000)
    """Distance over which height, density, dryness and species drift."""
    drift: Number = Field(0.6, ge=0, le=1)
    """Strength of those drifts."""
    full_density_m: Number = Field(8.0, gt=0, le=100_000)
    """Every blade is kept up to this distance from the camera; beyond, fewer and wider ones stand for them."""
    reach_m: Number = Field(300.0, gt=0, le=100_000)
    """No grass is drawn beyond this distance from the camera; the ground takes its colour."""
    traced_m: Number | None = Field(None, gt=0, le=100_000)
    """No blades are drawn beyond this distance from the camera; from there to `reach_m` rays are followed through
    pictures of grass, as `billboard-grid` does. Left out, blades go as far. Not for `billboard-grid` itself."""
    stored_m: Number | None = Field(None, ge=0, le=100_000)
    """Blades of the ground farther away than this take no memory: they grow from the seed in every frame, and have
    neither flowers nor seed heads nor simulation. 0 stores none; left out, all are. For `visibility-buffer` only."""

    @model_validator(mode="after")
    def _is_traced_within_reach(self) -> Self:
        if self.traced_m is not None and self.traced_m >= self.reach_m:
            raise ValueError(f"traced_m must be below reach_m, {self.reach_m:g} (got {self.traced_m:g})")
        return self

    @property
    def blades_m(self) -> float:
        """How far from the camera there are blades."""
        return self.reach_m if self.traced_m is None else self.traced_m


_Part = Annotated[Number, Field(ge=0, le=1)]
_Factor = Annotated[Number, Field(ge=0, le=10)]


def _from_seed_to_ripe(curve: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    ages = [age for age, _ in curve]
    if any(later <= earlier for earlier, later in pairwise(ages)):
        raise ValueError("must hold [age, factor] pairs with rising ages")
    return curve


Curve = Annotated[
    tuple[tuple[_Part, _Factor], ...], Field(min_length=1, max_length=8), AfterValidator(_from_seed_to_ripe)
]
"""`[age, factor]` pairs, straight between them and level outside."""


class Growth(Model):
    """Grass that grows: from `age` at time 0 on, 1 being full-grown."""

    age: Number = Field(0.0, ge=0, le=1)
    """Age at time 0; 0 is a seed."""
    time_s: Number = Field(60.0, gt=0, le=1e9)
    """Time from seed to full-grown."""
    spread: Number = Field(0.25, ge=0, le=1)
    """How much later than the first the last blades come up, as a part of `time_s`."""
    height: Curve = ((0.0, 0.0), (0.5, 0.75), (1.0, 1.0))
    """Factor on the height by age."""
    width: Curve = ((0.0, 0.2), (0.4, 0.7), (1.0, 1.0))
    """Factor on the width by age."""
    stiffness: Curve = ((0.0, 0.5), (1.0, 1.0))
    """Factor on the stiffness by age."""


class Culling(Model):
    """Tests on the GPU that leave out blades which would not show. Each may be switched off to compare."""

    orientation: Flag = True
    """Blades seen so edge-on that their technique gives them no width."""
    frustum: Flag = True
    """Blades outside the view."""
    distance: Flag = True
    """Ever more blades with distance; those that stay are wider. This alone changes the picture."""
    occlusion: Flag = True
    """Blades behind ground and objects."""
    behind_grass: Flag = False
    """Blades behind nearer grass too, with `visibility-buffer`: worth it where the camera is down in the grass."""


class TechniqueChoice(Model):
    """Which technique draws the grass; its settings are the other keys of the table."""

    model_config = ConfigDict(extra="allow")

    name: Text = "visibility-buffer"
    """One of the techniques listed by `greensward info`."""


class Shadows(Model):
    """Shadow maps of the sun: nested squares around the view, the first the sharpest."""

    enabled: Flag = True
    """Whether anything casts a shadow."""
    cascades: Count = Field(3, ge=1, le=4)
    """How many nested maps."""
    size_px: Count = Field(1024, ge=64, le=8192)
    """Edge of each map."""
    nearest_m: Number = Field(7.0, gt=0, le=10_000)
    """How far from the camera the first reaches."""
    furthest_m: Number = Field(700.0, gt=0, le=100_000)
    """How far the last reaches."""
    density: Number = Field(0.5, ge=0, le=1)
    """Part of the blades that cast shadows; they are wider, to stand for the others."""
