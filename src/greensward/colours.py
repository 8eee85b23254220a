"""Kinds of colour by place: `Scene(colour=colours.NoiseColour())`."""

from greensward.scene.colour import ChannelNoise, GroundColour, NoiseColour

__all__ = ["ChannelNoise", "GroundColour", "NoiseColour"]
