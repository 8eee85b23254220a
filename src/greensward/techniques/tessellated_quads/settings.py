"""Settings of tessellated quads."""

from typing import Annotated, Literal

from pydantic import Field

from greensward.scene.base import Area, Count, Many, Number, OptionalRange, default
from greensward.scene.grass import Length, Width
from greensward.techniques.blades.leaf import ThinSettings

Level = Annotated[Count, Field(ge=1, le=64)]


class Patch(Area):
    """Patches of the grid whose blades differ from the others': those with their centre in this area."""

    density: Number = Field(1.0, ge=0, le=16)
    """Factor on `sowing.density_per_m2`. The greatest of all is sown, and patches with less leave out blades at
    random."""
    width_m: OptionalRange[Width] = default(None)
    """Width of its blades, even over this range (equation 2). Without it, that of their species."""
    height_m: OptionalRange[Length] = default(None)
    """Height of its blades, likewise."""
    bending_m: Annotated[Number, Field(ge=0, le=10)] | None = None
    """Its own `bending_m`."""
    smoothness: Level | None = None
    """Its own `smoothness`."""


class QuadSettings(ThinSettings):
    """Storage, tessellation, thinning with distance and outlines of blades."""

    mode: Literal["basic", "instanced"] = "basic"
    """`basic` draws the stored blades of the field; `instanced` stores one patch and draws it everywhere."""
    patch_m: Number = Field(8.0, ge=1, le=200)
    """Edge of the patches of the grid, and so of the one that `instanced` stores."""
    densities: Count = Field(6, ge=1, le=10)
    """Number of densities of the stored patch, each half of the one before; far patches take lower ones."""
    variation: Literal["hash", "ratio", "share", "sine"] = "hash"
    """Variation of the stored patch's random values by place: a hash, or equation 10, 11 or 12."""
    level: Literal["distance", "size", "length"] = "distance"
    """Measure of a blade's tessellation: its distance, equation 4; its height on the screen, equation 5, which culls
    blades that point down there; or its length on the screen, which culls none."""
    smoothness: Level = 8
    """Quads of a blade that is cut finest."""
    px_per_quad: Number = Field(6.0, ge=1, le=200)
    """Pixels that a quad takes along the blade, with `level = "size"` or `"length"`."""
    quads: Literal["sown", "random"] = "sown"
    """Width, height and lean of the quads: of the blades as sown, or random by equations 2 and 3: width and height
    even over the range of the species, and the tip offset from above the root."""
    bending_m: Number = Field(0.15, ge=0, le=10)
    """Largest offset of a tip along x and along z, with `quads = "random"`."""
    thinning: Number = Field(0.0, ge=0, le=1)
    """Part of the blades that is left out at random at `sowing.reach_m`; less nearer, in proportion to distance."""
    shrinking: Number = Field(0.0, ge=0, le=1)
    """Part of their height that blades lose at `sowing.reach_m`; less nearer, in proportion to the distance."""
    shading: Literal["sward", "blade"] = "sward"
    """Colours and normals: as other techniques have them, for a blade in the sward; or for a blade alone, as in the
    source: the colour darker in proportion to the height on the blade, the normal that of equation 8."""
    alpha: Literal["test", "hashed"] = "test"
    """Alpha test of the outline: one threshold, or one for each point of the blade, for soft outlines."""
    patch: Many[Patch] = default(())
    """Patches with blades of their own. Where several areas overlap, the last counts."""

    @property
    def most_density(self) -> float:
        """Greatest factor on the density of any patch."""
        return max(1.0, *(each.density for each in self.patch), 1.0)
