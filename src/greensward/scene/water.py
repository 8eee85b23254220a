"""A lake or a pond: a plane that mirrors what stands around it."""

from pydantic import Field

from greensward.scene.base import Colour, Flag, Model, Number


class Water(Model):
    """Still or rippled water up to a level, wherever the ground lies lower."""

    level_m: Number = Field(0.0, ge=-10_000, le=10_000)
    """Height of its surface in the world; the camera must be above it."""
    colour: Colour = "#23413a"
    """sRGB of deep water."""
    clarity_m: Number = Field(1.2, gt=0, le=1000)
    """Way through the water after which two thirds of what lies below are lost."""
    ripple: Number = Field(0.35, ge=0, le=1)
    """Steepness of the ripples: 0 is a mirror."""
    ripple_m: Number = Field(0.9, gt=0, le=100)
    """Length of the longest of them."""
    reflections: Flag = True
    """Whether it mirrors ground, objects and the low-detail grass of the density map; if not, the sky alone."""
    reflection_scale: Number = Field(0.5, ge=0.1, le=1)
    """Size of the mirrored picture, as a part of the picture's."""
