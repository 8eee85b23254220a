"""Kinds of ground."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from greensward.scene.base import (
    Area,
    Count,
    FileName,
    Many,
    Model,
    Number,
    OptionalArray,
    OptionalFileName,
    OptionalMap,
    OptionalPair,
    OptionalSize,
    Size,
    Text,
    default,
)

MOST_TILES = 8


class GroundTile(Area):
    """A part of the ground with a soil of its own."""

    texture: FileName
    """Image of its soil, repeated without visible tiling."""
    texture_m: Number = Field(default=2.0, ge=0.01, le=1000)
    """Width on the ground of one copy of the texture."""


class Surface(Model):
    """Base of all kinds of ground: its soil and what lies past its edge."""

    texture: OptionalMap = default(None)
    """Image of bare soil, repeated without visible tiling. Without one, a generated soil is used."""
    texture_m: Number = Field(default=2.0, ge=0.01, le=1000)
    """Width on the ground of one copy of the texture."""
    tile: Annotated[Many[GroundTile], Field(max_length=MOST_TILES)] = default(())
    """Parts with a soil of their own. Where several overlap, the last counts."""
    beyond: Literal["mirror", "bare", "repeat"] = "mirror"
    """Land past the edge: `mirror` continues with land and grass, mirrored; `repeat` with copies side by side, for
    which a height map should have no seam; `bare` with land alone."""
    terrain_map: OptionalMap = default(None)
    """Image over the whole ground; its alpha is how far it covers the soil."""


class _Sized(Surface):
    """Base of the grounds that know their extent."""

    size_m: Size = default((400.0, 400.0))
    """Extent along x (east) and z (south), centred on the origin. Maps cover exactly this."""


class FlatGround(_Sized):
    """A plane at height zero."""

    kind: Literal["flat"] = "flat"


class HeightMapGround(Surface):
    """Elevations read from a file, or in Python from an `array`; row 0 is the north edge (smallest z)."""

    kind: Literal["heightmap"] = "heightmap"
    file: OptionalFileName = default(None)
    """PNG (8 or 16 bit), TIFF, `.npy`, `.npz`, `.hgt` or RAW; with the extra `geo` also GeoTIFF, `.asc` and more."""
    array: OptionalArray = default(None)
    """Heights in metres, two-dimensional, in place of a file."""
    size_m: OptionalSize = default(None)
    """Extent along x (east) and z (south), centred on the origin. Maps cover exactly this. Without it, a file with a
    geographic reference has its own, and any other 400 × 400 m."""
    key: Text | None = None
    """Name of the array in an `.npz` file. Needed only if it holds several."""
    band: Annotated[Count, Field(ge=1)] | None = None
    """Band of a GeoTIFF that holds the heights, counted from 1. Needed only if it has several."""
    byte_order: Literal["little", "big"] | None = None
    """Order of the bytes in a RAW file, which does not tell it."""
    height_m: OptionalPair[Number] = default(None)
    """Heights of black and white in an image, or of the lowest and highest value of an array or GeoTIFF. Without it,
    an image spans 0 to 10 m, and the others are in metres."""
    height_scale: Number = Field(default=1.0, ge=-1000, le=1000)
    """Factor on all heights."""
    no_data: Number | None = None
    """Value that means *not measured*; NaN always does. Such holes are filled from their surroundings."""

    @model_validator(mode="after")
    def _has_heights(self) -> Self:
        if (self.file is None) == (self.array is None):
            both = "must not stand beside array" if self.file else "is missing and has no default"
            raise ValueError(f"file: {both}")
        return self


class _Noise(_Sized):
    """Base of the grounds from octaves of simplex noise."""

    height_m: Number = Field(default=12.0, ge=0, le=5000)
    """Height from valleys to tops."""
    wavelength_m: Number = Field(default=160.0, ge=0.01, le=100_000)
    """Distance between hills of the lowest octave."""
    octaves: Count = Field(default=5, ge=1, le=12)
    """Number of noises that are added, each finer than the last."""
    gain: Number = Field(default=0.42, ge=0, le=1)
    """Strength of each octave relative to the one before."""
    lacunarity: Number = Field(default=2.1, ge=1, le=4)
    """Frequency of each octave relative to the one before."""
    samples: Count = Field(default=512, ge=2, le=4096)
    """Height samples along the longer side."""


class NoiseGround(_Noise):
    """Rolling ground from octaves of simplex noise, mirrored beyond its edge."""

    kind: Literal["noise"] = "noise"


class EndlessGround(_Noise):
    """Ground without an edge: noise that closes on itself, or a seamless height map, repeated in every direction."""

    kind: Literal["endless"] = "endless"
    size_m: Size = default((1024.0, 1024.0))
    """Distance after which the land repeats along x (east) and z (south)."""
    samples: Count = Field(default=1024, ge=2, le=4096)
    """Height samples along the longer side, for noise."""
    file: OptionalFileName = default(None)
    """A seamless height map in place of noise: its black lies at 0 and its white at `height_m`."""
    beyond: Literal["repeat"] = "repeat"
    """Land past `size_m` is the same again."""


class NoGround(_Sized):
    """No ground: sky above and below, grass on objects only."""

    kind: Literal["none"] = "none"


Ground = Annotated[FlatGround | HeightMapGround | NoiseGround | EndlessGround | NoGround, Field(discriminator="kind")]
