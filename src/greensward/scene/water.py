"""A lake or a pond: a plane that reflects its surroundings."""

from pydantic import Field

from greensward.scene.base import Colour, Flag, Model, Number
from greensward.scene.errors import InputError


class Water(Model):
    """Still or rippled water up to a level, wherever the ground lies lower."""

    level_m: Number = Field(default=0.0, ge=-10_000, le=10_000)
    """Height of its surface in the world; the camera must be above it."""
    colour: Colour = "#23413a"
    """sRGB of deep water."""
    clarity_m: Number = Field(default=1.2, ge=0.01, le=1000)
    """Attenuation length: distance through the water after which 1/e of the light from below is left."""
    ripple: Number = Field(default=0.35, ge=0, le=1)
    """Steepness of the ripples: 0 is a mirror."""
    ripple_m: Number = Field(default=0.9, ge=0.01, le=100)
    """Length of the longest of them."""
    reflections: Flag = True
    """True if it reflects ground, objects and the low-detail grass of the density map; if false, the sky alone."""
    reflection_scale: Number = Field(default=0.5, ge=0.1, le=1)
    """Resolution of the reflection, as a fraction of the picture's."""

    def refuse_below(self, height_m: float) -> None:
        """Raise `InputError` for a camera at a height that is not above the water."""
        if height_m <= self.level_m:
            raise InputError(
                f"camera.position_m: must be above the water, whose level is {self.level_m:g} m "
                f"(got {height_m:.2f} m); raise y or lower water.level_m"
            )
