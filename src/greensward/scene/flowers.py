"""Plants as billboards among the blades, with every technique."""

import math
from typing import Annotated

from pydantic import Field

from greensward.scene.base import Colour, Model, Number, OptionalFileName, Range, default
from greensward.scene.classes import BLADE_NUMBER_BITS

MOST_FLOWERS = 8
MOST_PLANTS = (1 << BLADE_NUMBER_BITS) - 2


class Flowers(Model):
    """Plants of one kind, as billboards that turn to the viewer; flowers on blades are the `head` of `[[grass]]`."""

    density_per_m2: Number = Field(default=0.5, ge=0.001, le=100)
    """Plants per square metre before maps and slope thin them."""
    height_m: Range[Annotated[Number, Field(ge=0.01, le=5)]] = default((0.3, 0.5))
    """Height of the image above the ground."""
    colour: Colour = "#f2efe6"
    """sRGB of the petals, without an image."""
    heart_colour: Colour = "#e3b32c"
    """sRGB of the middle, without an image."""
    petals: Annotated[int, Field(ge=3, le=40)] = 13
    """Number of petals, without an image."""
    picture: OptionalFileName = default(None)
    """Image of the plant on transparency, its root in the middle of the lower edge. Without one, one is painted."""
    patchiness: Number = Field(default=0.6, ge=0, le=1)
    """0 spreads them evenly; 1 gathers them in drifts."""
    stiffness: Number = Field(default=0.5, ge=0, le=1)
    """Resistance to wind: 0 follows it, 1 hardly moves."""
    reach_m: Number = Field(default=60.0, ge=0.1, le=1000)
    """None are drawn beyond this distance from the camera; they shrink before it."""

    @property
    def cell_m(self) -> float:
        """Side of the square of ground in which one plant may grow."""
        return 1.0 / math.sqrt(self.density_per_m2)

    @property
    def cells(self) -> int:
        """Cells along a side of the square around the camera that holds all within reach."""
        return 2 * math.ceil(self.reach_m / self.cell_m) + 1
