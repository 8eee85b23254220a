"""Forces that press grass down or push it aside, as layers over the ground. They add up."""

from collections.abc import Sequence
from itertools import pairwise
from math import hypot
from typing import Annotated, Literal, Self, TypeAlias

from pydantic import Field, model_validator

from greensward.scene.base import FileName, GroundPoint, GroundPoints, Model, Number, Pair, Places, Size, default

MOST_FORCES = 8
MOST_TEXELS = 2048
"""Texels of a layer along each side, at most."""
LEAST_TEXELS = {"foot": 12, "tyre": 4, "stamp": 24}
"""Texels along a foot, across a tyre, along the longer side of a stamp; where the layer is small, there are more."""
_XZ: TypeAlias = tuple[float, float]
Curve: TypeAlias = list[tuple[_XZ, _XZ, _XZ, _XZ]]

_Part = Annotated[Number, Field(ge=0, le=1)]
_Width = Annotated[Number, Field(ge=0.001, le=100)]
_Instant = Annotated[Number, Field(ge=-1e6, le=1e6)]
_Angle = Annotated[Number, Field(ge=-360, le=360)]
_Line = Annotated[GroundPoints, Field(min_length=2, max_length=256)]


def curve(path: Sequence[_XZ]) -> Curve:
    """Catmull-Rom spline through all points of a path, parametrised by chord length, as cubic Bézier segments."""
    points = [point for i, point in enumerate(path) if not i or point != path[i - 1]]
    spans = [hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(points)]
    directions = [
        ((b[0] - a[0]) / span, (b[1] - a[1]) / span) for (a, b), span in zip(pairwise(points), spans, strict=True)
    ]
    slopes = directions[:1]
    for i in range(1, len(directions)):
        part = spans[i] / (spans[i - 1] + spans[i])
        before, after = directions[i - 1], directions[i]
        slopes.append((before[0] * part + after[0] * (1 - part), before[1] * part + after[1] * (1 - part)))
    slopes += directions[-1:]
    return [
        (
            points[i],
            (points[i][0] + slopes[i][0] * span / 3, points[i][1] + slopes[i][1] * span / 3),
            (points[i + 1][0] - slopes[i + 1][0] * span / 3, points[i + 1][1] - slopes[i + 1][1] * span / 3),
            points[i + 1],
        )
        for i, span in enumerate(spans)
    ]


def _widest(points: list[_XZ]) -> float:
    """The longer side of the bounding box of these points."""
    return max(float(max(axis) - min(axis)) for axis in zip(*points, strict=True))


def _check_span(span_m: float, finest_m: float, what: str, fix: str) -> None:
    limit_m = (MOST_TEXELS - 4) * finest_m
    if span_m > limit_m:
        raise ValueError(f"{what} may span at most {limit_m:.3g} m with all around them (got {span_m:.4g}); {fix}")


class ForceMap(Model):
    """An image of forces: red pushes east (+x), green up (+y), blue south (+z); 128 of 255 is none, 0 is −1."""

    kind: Literal["map"] = "map"
    file: FileName
    """The image, in colours; its alpha scales the force. Row 0 is the north edge (smallest z)."""
    centre_m: GroundPoint = default((0.0, 0.0))
    """Centre: x and z."""
    size_m: Size = default((10.0, 10.0))
    """Extent on the ground along its own x and z. Outside there is no force."""
    yaw_deg: _Angle = 0.0
    """Turn about the vertical."""
    strength: _Part = 1.0
    """Factor on all forces."""


class _Pressing(Model):
    """Base of all forces that press grass down."""

    impact_m: Annotated[Number, Field(ge=0, le=100)] = 0.15
    """Width of the rim that is pushed aside."""
    pressure: _Part = 1.0
    """1 presses flat, 0 not at all."""
    fades_s: Annotated[Number, Field(ge=0.001, le=1e6)] | None = None
    """Time after which the grass has risen again: fast at first, then slower, as (e^(−3 t / `fades_s`) − e^−3) /
    (1 − e^−3). Left out, it stays down."""


class _OnPath(_Pressing):
    """Base of forces that move along a path."""

    path: _Line
    """Points [x, z] of a smooth curve."""
    start_s: _Instant = 0.0
    """Time of departure; without speed, the time from which `fades_s` counts."""
    speed_mps: Annotated[Number, Field(ge=0, le=1000)] = 0.0
    """Speed along the path. At 0, the whole path is pressed from the beginning."""

    @model_validator(mode="after")
    def _has_length(self) -> Self:
        if not curve(self.path):
            raise ValueError("path must lead from one point to another (all its points are the same)")
        return self

    def _span_m(self, aside_m: float) -> float:
        return _widest([point for piece in curve(self.path) for point in piece]) + 2.0 * aside_m


class Footprints(_OnPath):
    """Footprints of a person along a path."""

    kind: Literal["footprints"] = "footprints"
    step_m: Annotated[Number, Field(ge=0.01, le=100)] = 0.75
    """Distance from one print to the next, left and right in turn."""
    gauge_m: Annotated[Number, Field(ge=0, le=100)] = 0.22
    """Distance between the lines of left and right prints."""
    foot_m: Pair[_Width] = default((0.29, 0.11))
    """Length and width of a print."""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        length, width = self.foot_m
        if width > length:
            raise ValueError(f"foot_m must be [length, width], width at most length (got [{length:g}, {width:g}])")
        span_m = self._span_m(0.5 * self.gauge_m + length + self.impact_m)
        what = f"footprints of {length:g} m"
        _check_span(span_m, length / LEAST_TEXELS["foot"], what, "shorten path, or walk it in several tables")
        return self


class Tracks(_OnPath):
    """Tracks of a vehicle along a path."""

    kind: Literal["tracks"] = "tracks"
    impact_m: Annotated[Number, Field(ge=0, le=100)] = 0.2
    """Width of the rim that is pushed aside."""
    gauge_m: Annotated[Number, Field(ge=0, le=100)] = 1.6
    """Distance from the middle of the left track to that of the right; 0 leaves a single track."""
    tyre_m: _Width = 0.25
    """Width of each track."""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        span_m = self._span_m(0.5 * self.gauge_m + self.tyre_m + self.impact_m)
        what = f"tracks of {self.tyre_m:g} m"
        _check_span(span_m, self.tyre_m / LEAST_TEXELS["tyre"], what, "shorten path, or drive it in several tables")
        return self


class Stamp(_Pressing):
    """An outline, pressed into the grass in any number of places."""

    kind: Literal["stamp"] = "stamp"
    outline: FileName
    """Image of the outline: dark on light, or opaque where it has transparent parts. Its top points north."""
    places: Annotated[Places, Field(min_length=1, max_length=1000)]
    """Places: [x, z, turn about the vertical in degrees] of the centre."""
    size_m: Size = default((1.0, 1.0))
    """Extent of the image on the ground, along its width and height."""
    at_s: _Instant | None = None
    """Time of the press. Left out, the grass is pressed from the beginning, and `fades_s` counts from 0."""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        longest, reach_m = max(self.size_m), 0.5 * hypot(*self.size_m) + self.impact_m
        span_m = _widest([(x, z) for x, z, _ in self.places]) + 2.0 * reach_m
        what = f"stamps of {longest:g} m"
        _check_span(span_m, longest / LEAST_TEXELS["stamp"], what, "put places closer, or into several tables")
        return self


Force = Annotated[ForceMap | Footprints | Tracks | Stamp, Field(discriminator="kind")]
