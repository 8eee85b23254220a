"""Fences: posts along a path, and rails between them."""

from itertools import pairwise
from math import hypot
from typing import Annotated, Self

from pydantic import Field, model_validator

from greensward.scene.base import Colour, Flag, GroundPoints, Many, Model, Number, Pair, Triple, default

MOST_FENCES = 100
_MOST_POSTS = 2000
_Length = Annotated[Number, Field(ge=0.002, le=100)]


class Fence(Model):
    """A fence: upright posts along a path, and rails from post to post, which follow the ground."""

    path: Annotated[GroundPoints, Field(min_length=2, max_length=256)]
    """Points that it leads through, x and z."""
    smooth: Flag = True
    """True for a smooth curve through the points of the path, false for straight lines between them."""
    spacing_m: Number = Field(default=2.6, ge=0.05, le=1000)
    """Distance between posts along the path, at most."""
    post_m: Triple[_Length] = default((0.1, 1.25, 0.1))
    """Width along the fence, height above the ground, and thickness of a post."""
    rails_m: Annotated[Many[_Length], Field(max_length=20)] = default((0.55, 0.95))
    """Heights of the rails above the ground; none for posts alone."""
    rail_m: Pair[_Length] = default((0.09, 0.035))
    """Height and thickness of a rail."""
    weathered: Number = Field(default=0.3, ge=0, le=1)
    """0 is straight and new; 1 leans, varies in size and colour, is streaked, and has lost some of its rails."""
    colour: Colour = "#857766"
    """sRGB of the wood."""
    roughness: Number = Field(default=0.9, ge=0.05, le=1)
    """Gloss: low is shiny."""
    collides: Flag = True
    """True if it presses simulated grass down."""
    clears: Flag = True
    """True if no grass of the ground grows where its posts stand."""

    @model_validator(mode="after")
    def _has_a_number_of_posts(self) -> Self:
        length_m = sum(hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(self.path))
        if not length_m:
            raise ValueError("path must lead from one point to another (all its points are the same)")
        if length_m > _MOST_POSTS * self.spacing_m:
            raise ValueError(
                f"a path of {length_m:.5g} m has more than {_MOST_POSTS:,} posts with spacing_m {self.spacing_m:g}; "
                "raise spacing_m, or have several fences"
            )
        return self
