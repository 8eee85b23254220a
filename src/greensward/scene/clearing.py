"""Clearings: areas of the ground without grass."""

from itertools import combinations
from typing import Annotated, Self, TypeAlias

from pydantic import Field, model_validator

from greensward.scene.base import Flag, GroundPoints, Model, Number, default

MOST_CLEARINGS = 1000
_XZ: TypeAlias = tuple[float, float]


class Clearing(Model):
    """An area without grass: along a path, around a point, or inside an outline. The soil shows there."""

    path: Annotated[GroundPoints, Field(max_length=256)] = default(())
    """Points that it leads through, x and z; one alone is the centre of a disc."""
    width_m: Number | None = Field(default=None, ge=0.001, le=10_000)
    """Width of the path, or diameter of the disc."""
    smooth: Flag = True
    """True for a smooth curve through the points of the path, false for straight lines between them."""
    outline: Annotated[GroundPoints, Field(max_length=256)] = default(())
    """Corners of the area, x and z, in either direction; its sides may not cross. In place of `path`."""
    edge_m: Number = Field(default=0.1, ge=0, le=1000)
    """Distance from its border outward over which grass becomes as dense as elsewhere."""

    @model_validator(mode="after")
    def _is_one_shape(self) -> Self:
        if bool(self.path) == bool(self.outline):
            both = "both" if self.path else "neither"
            raise ValueError(f"must have path, with width_m, or outline (got {both})")
        if self.path and self.width_m is None:
            raise ValueError("width_m is missing, the width of the path")
        if self.outline and self.width_m is not None:
            raise ValueError("width_m is for a path; leave it out beside outline")
        return self

    @model_validator(mode="after")
    def _has_an_area(self) -> Self:
        if not self.outline:
            return self
        if len(set(self.outline)) != len(self.outline) or len(self.outline) < 3:
            raise ValueError(
                f"outline must have three corners at least, all different (got {len(self.outline)}, "
                f"{len(set(self.outline))} of them different); it is closed without the first one again"
            )
        sides = list(zip(self.outline, (*self.outline[1:], self.outline[0]), strict=True))
        for (i, first), (j, second) in combinations(enumerate(sides), 2):
            if j - i not in (1, len(sides) - 1) and _meet(*first, *second):
                raise ValueError(f"outline must not cross itself, and its sides {i} and {j}, counted from 0, meet")
        if not any(_turn(self.outline[0], self.outline[1], corner) for corner in self.outline):
            raise ValueError("outline must enclose an area (all its corners lie on a line)")
        return self


def _turn(a: _XZ, b: _XZ, c: _XZ) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _meet(a: _XZ, b: _XZ, c: _XZ, d: _XZ) -> bool:
    """Return whether two sides without a common corner have a common point."""
    apart = any(max(a[k], b[k]) < min(c[k], d[k]) or max(c[k], d[k]) < min(a[k], b[k]) for k in (0, 1))
    return not apart and _turn(a, b, c) * _turn(a, b, d) <= 0.0 and _turn(c, d, a) * _turn(c, d, b) <= 0.0
