"""Settings of tessellated quads."""

from typing import Annotated, Literal

from pydantic import Field

from greensward.scene.base import Area, Count, Number, OptionalRange, default
from greensward.scene.grass import Length, Width
from greensward.techniques.blades.leaf import ThinSettings

MOST_PATCHES = 32
Level = Annotated[Count, Field(ge=1, le=64)]


class Patch(Area):
    """Blades of a part of the ground that differ from the others."""

    density: Number = Field(1.0, ge=0, le=1)
    """Part of the blades that stay."""
    width_m: OptionalRange[Width] = default(None)
    """Width of its blades. Without it, that of their species."""
    height_m: OptionalRange[Length] = default(None)
    """Height of its blades. Without it, that of their species."""
    bending_m: Annotated[Number, Field(ge=0, le=10)] | None = None
    """Its own `bending_m`."""
    smoothness: Level | None = None
    """Its own `smoothness`."""


class QuadSettings(ThinSettings):
    """Storage, tessellation, thinning with distance and outlines of blades."""

    mode: Literal["basic", "instanced"] = "basic"
    """`basic` draws the stored blades of the field; `instanced` stores one patch and draws it everywhere."""
    patch_m: Number = Field(8.0, ge=1, le=200)
    """Edge of the stored patch."""
    densities: Count = Field(6, ge=1, le=10)
    """Number of densities of the stored patch, each half of the one before; far patches take lower ones."""
    variation: Literal["ratio", "share", "sine"] = "sine"
    """Variation of the stored patch's random values by place: equation 10, 11 or 12."""
    level: Literal["distance", "size"] = "distance"
    """Measure of a blade's tessellation: its distance, equation 4, or its size on the screen, equation 5."""
    smoothness: Level = 8
    """Quads of a blade that is cut finest."""
    px_per_quad: Number = Field(6.0, ge=1, le=200)
    """Pixels that a quad takes along the blade, with `level = "size"`."""
    lean: Literal["own", "random"] = "own"
    """Lean of a blade: as it was sown, or by the random offset of equation 3."""
    bending_m: Number = Field(0.15, ge=0, le=10)
    """Largest offset of a tip to each side, with `lean = "random"`."""
    thinning: Number = Field(0.0, ge=0, le=1)
    """Part of the blades that is left out at random at `sowing.reach_m`; less nearer, in proportion to distance."""
    shrinking: Number = Field(0.0, ge=0, le=1)
    """Part of their height that blades lose at `sowing.reach_m`; less nearer, in proportion to the distance."""
    alpha: Literal["test", "hashed"] = "test"
    """Alpha test of the outline: one threshold, or one for each point of the blade, for soft outlines."""
    patch: Annotated[tuple[Patch, ...], Field(max_length=MOST_PATCHES)] = ()
    """Parts of the ground with blades of their own. Where several overlap, the last counts."""
