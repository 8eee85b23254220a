"""Colour of the grass by place, in place of that of its species."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from greensward.scene.base import Colour, Count, Many, Model, Number, default

MOST_NOISES = 12
FINEST_M = 0.001


class ChannelNoise(Model):
    """Octaves of simplex noise in one channel or in all; those of a channel are blended by their weights."""

    channel: Literal["red", "green", "blue", "all"] = "all"
    """Channel that it varies."""
    wavelength_m: Number = Field(default=10.0, ge=0.01, le=100_000)
    """Wavelength of the lowest octave."""
    octaves: Count = Field(default=4, ge=1, le=12)
    """Number of noises that are added, each finer than the last."""
    gain: Number = Field(default=0.5, ge=0, le=1)
    """Strength of each octave relative to the one before."""
    lacunarity: Number = Field(default=2.1, ge=1, le=4)
    """Frequency of each octave relative to the one before."""
    weight: Number = Field(default=1.0, ge=0.001, le=1000)
    """Weight in the blend of its channel."""

    @model_validator(mode="after")
    def _is_of_the_size_of_grass(self) -> Self:
        finest_m = self.wavelength_m / self.lacunarity ** (self.octaves - 1)
        if finest_m < FINEST_M:
            raise ValueError(
                f"octaves must leave the finest a wavelength of {FINEST_M:g} m or more (got {finest_m:.2g} m for "
                f"{self.octaves}); lower octaves or lacunarity, or raise wavelength_m"
            )
        return self


class NoiseColour(Model):
    """Colours from blended octaves of noise, each channel with noises of its own (Tillman 2013, section 2.1.5)."""

    kind: Literal["noise"] = "noise"
    low_colour: Colour = "#47551f"
    """sRGB at the tips, each channel where its noise is lowest."""
    high_colour: Colour = "#9aa14f"
    """sRGB at the tips, each channel where its noise is highest."""
    noise: Annotated[Many[ChannelNoise], Field(max_length=MOST_NOISES)] = default(
        (
            ChannelNoise(channel="all", wavelength_m=19.0, octaves=5),
            ChannelNoise(channel="all", wavelength_m=1.3, octaves=3, weight=0.7),
            ChannelNoise(channel="red", wavelength_m=27.0, weight=0.8),
            ChannelNoise(channel="red", wavelength_m=4.1, weight=0.4),
            ChannelNoise(channel="green", wavelength_m=37.0, weight=0.4),
            ChannelNoise(channel="blue", wavelength_m=13.0, weight=0.6),
        )
    )
    """Noises, blended in each channel. A channel without any lies midway."""
    strength: Number = Field(default=1.0, ge=0, le=1)
    """Part that it has in the colour; the rest is the species' own."""


class GroundColour(Model):
    """Colours from the ground's picture at each root: `texture`, `tile` and `terrain_map` of `[ground]`.

    No blade grows where neither the texel at its root nor any near it is green (Tillman 2013, section 2.1.2).
    """

    kind: Literal["ground"] = "ground"
    greenness: Number = Field(default=0.05, ge=-1, le=2)
    """Excess green from which on a texel is green: (2 g − r − b) / (r + g + b) of its sRGB values (Woebbecke et al.
    1995)."""
    neighbours: Count = Field(default=2, ge=0, le=16)
    """Texels to each side that are asked where one is not green: the mean of the nearest green ones counts."""
    strength: Number = Field(default=1.0, ge=0, le=1)
    """Part that it has in the colour; the rest is the species' own."""


GrassColour = Annotated[NoiseColour | GroundColour, Field(discriminator="kind")]
