"""What the grass stands on."""

from typing import Annotated, Literal

from pydantic import Field

from greensward.scene.base import Area, Count, FileName, Model, Number, Size, Text

MOST_TILES = 8


class GroundTile(Area):
    """A part of the ground with a soil of its own."""

    texture: FileName
    """Picture of its soil, repeated without visible tiling."""
    texture_m: Number = Field(2.0, gt=0, le=1000)
    """Width on the ground of one copy of the texture."""


class Surface(Model):
    """What every kind of ground has: its extent, centred on the origin, and how its soil looks."""

    size_m: Size = (400.0, 400.0)
    """Extent along x (east) and z (south), centred on the origin. Maps cover exactly this."""
    texture: FileName | None = None
    """Picture of bare soil, repeated without visible tiling. Without one, a generated soil is used."""
    texture_m: Number = Field(2.0, gt=0, le=1000)
    """Width on the ground of one copy of the texture."""
    tile: Annotated[tuple[GroundTile, ...], Field(max_length=MOST_TILES)] = ()
    """Parts with a soil of their own. Where several overlap, the last counts."""
    beyond: Literal["mirror", "bare"] = "mirror"
    """What lies past the edge: `mirror` goes on with land and grass, mirrored; `bare` with land alone."""
    terrain_map: FileName | None = None
    """Picture laid over the whole ground; its alpha says where it covers the soil."""


class FlatGround(Surface):
    """A plane at height zero."""

    kind: Literal["flat"] = "flat"


class HeightMapGround(Surface):
    """Elevations read from a picture or an array; row 0 is the north edge (smallest z)."""

    kind: Literal["heightmap"] = "heightmap"
    file: FileName
    """PNG (8 or 16 bit), TIFF, `.npy` or `.npz`."""
    key: Text | None = None
    """Which array of an `.npz` file to read. Needed only if it holds several."""
    height_m: tuple[Number, Number] | None = None
    """What black and white mean in a picture, or the lowest and highest value of an array. Without it, a picture spans 0 to 10 m and an array or a floating-point picture is in metres already."""  # noqa: E501
    height_scale: Number = Field(1.0, ge=-1000, le=1000)
    """Factor on all heights."""
    no_data: Number | None = None
    """Value that means *not measured*; NaN always does. Such holes are filled from around them."""


class NoiseGround(Surface):
    """Rolling ground from octaves of simplex noise; it repeats mirrored beyond its edge."""

    kind: Literal["noise"] = "noise"
    height_m: Number = Field(12.0, ge=0, le=5000)
    """Height from valleys to tops."""
    wavelength_m: Number = Field(160.0, gt=0, le=100_000)
    """Distance between hills of the lowest octave."""
    octaves: Count = Field(5, ge=1, le=12)
    """How many noises are added, each finer than the last."""
    gain: Number = Field(0.42, ge=0, le=1)
    """Strength of each octave relative to the one before."""
    lacunarity: Number = Field(2.1, ge=1, le=4)
    """Frequency of each octave relative to the one before."""
    samples: Count = Field(512, ge=2, le=4096)
    """Height samples along the longer side."""


class NoGround(Surface):
    """No ground at all: sky above and below, grass on objects only."""

    kind: Literal["none"]


Ground = Annotated[FlatGround | HeightMapGround | NoiseGround | NoGround, Field(discriminator="kind")]
