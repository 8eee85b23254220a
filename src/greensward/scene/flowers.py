"""Plants that are pictures: billboards among the blades, with every technique."""

from typing import Annotated

from pydantic import Field

from greensward.scene.base import Colour, FileName, Model, Number, span

MOST_FLOWERS = 8


class Flowers(Model):
    """Whole plants as pictures that turn to the viewer. Flowers on blades are the `head` of a `[[grass]]` table."""

    density_per_m2: Number = Field(0.5, gt=0, le=100)
    """Plants on a square metre where nothing thins them."""
    height_m: span(0.01, 5.0) = (0.3, 0.5)  # type: ignore[valid-type]
    """From the ground to the top of the picture."""
    colour: Colour = "#f2efe6"
    """sRGB of the petals, without a picture."""
    heart_colour: Colour = "#e3b32c"
    """sRGB of the middle, without a picture."""
    petals: Annotated[int, Field(ge=3, le=40)] = 13
    """How many there are, without a picture."""
    picture: FileName | None = None
    """The plant on a transparent ground, its root in the middle of the lower edge. Without one, one is painted."""
    patchiness: Number = Field(0.6, ge=0, le=1)
    """0 strews them evenly; 1 gathers them in drifts."""
    stiffness: Number = Field(0.5, ge=0, le=1)
    """Resistance to wind, as that of grass."""
    reach_m: Number = Field(60.0, gt=0, le=1000)
    """None are drawn beyond this distance from the camera; they shrink before it."""
