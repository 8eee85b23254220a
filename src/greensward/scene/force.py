"""What presses grass down or pushes it aside, as layers over the ground. They add up."""

from itertools import pairwise
from math import hypot
from typing import Annotated, Literal, Self, TypeAlias

from pydantic import Field, model_validator

from greensward.scene.base import FileName, Model, Number, Place, Size, Spot

MOST_TEXELS = 2048
"""Of a layer's picture, a side."""
LEAST_TEXELS = {"foot": 12, "tyre": 4, "stamp": 24}
"""Along a foot, across a tyre, along the longer side of a stamp; where the layer is small, there are more."""
Curve: TypeAlias = list[tuple[Spot, Spot, Spot, Spot]]

_Part = Annotated[Number, Field(ge=0, le=1)]
_Width = Annotated[Number, Field(gt=0, le=100)]
_Instant = Annotated[Number, Field(ge=-1e6, le=1e6)]
_Angle = Annotated[Number, Field(ge=-360, le=360)]
_Line = Annotated[tuple[Spot, ...], Field(min_length=2, max_length=256)]


def curve(path: tuple[Spot, ...]) -> Curve:
    """Cubic Bézier pieces through all points of a path, smooth: Catmull & Rom 1974, by the lengths of its chords."""
    points = [point for i, point in enumerate(path) if not i or point != path[i - 1]]
    spans = [hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(points)]
    ways = [
        ((b[0] - a[0]) / span, (b[1] - a[1]) / span) for (a, b), span in zip(pairwise(points), spans, strict=True)
    ]
    slopes = ways[:1]
    for i in range(1, len(ways)):
        part = spans[i] / (spans[i - 1] + spans[i])
        before, after = ways[i - 1], ways[i]
        slopes.append((before[0] * part + after[0] * (1 - part), before[1] * part + after[1] * (1 - part)))
    slopes += ways[-1:]
    return [
        (
            points[i],
            (points[i][0] + slopes[i][0] * span / 3, points[i][1] + slopes[i][1] * span / 3),
            (points[i + 1][0] - slopes[i + 1][0] * span / 3, points[i + 1][1] - slopes[i + 1][1] * span / 3),
            points[i + 1],
        )
        for i, span in enumerate(spans)
    ]


def _widest(spots: list[Spot]) -> float:
    """The longer side of the box around these points."""
    return max(float(max(axis) - min(axis)) for axis in zip(*spots, strict=True))


def _check_span(span_m: float, finest_m: float, what: str, cure: str) -> None:
    limit_m = (MOST_TEXELS - 4) * finest_m
    if span_m > limit_m:
        raise ValueError(f"{what} may span at most {limit_m:.3g} m with all around them (got {span_m:.4g}); {cure}")


class ForceMap(Model):
    """A picture of forces: red pushes east (+x), green up (+y), blue south (+z); 128 of 255 is none, 0 down to −1."""

    kind: Literal["map"]
    file: FileName
    """The picture, in colours; its alpha scales the force. Row 0 is the north edge (smallest z)."""
    centre_m: Spot = (0.0, 0.0)
    """Where its middle lies: x and z."""
    size_m: Size = (10.0, 10.0)
    """Extent on the ground along its own x and z. Outside there is no force."""
    yaw_deg: _Angle = 0.0
    """Turn about the vertical."""
    strength: _Part = 1.0
    """Factor on all forces."""


class _Press(Model):
    """What everything has that presses grass down."""

    impact_m: Annotated[Number, Field(ge=0, le=100)] = 0.15
    """Width of the surroundings that are pushed aside."""
    pressure: _Part = 1.0
    """1 presses flat, 0 not at all."""
    fades_s: Annotated[Number, Field(gt=0, le=1e6)] | None = None
    """Time after which the grass has risen again: at first fast, then ever slower, as e^(−3 t / `fades_s`) less what
    that is at the end. Left out, it stays down."""


class _Way(_Press):
    """What moves along a path while it presses."""

    path: _Line
    """Points [x, z] that it passes, in smooth curves."""
    start_s: _Instant = 0.0
    """When it sets out; without speed, from when on `fades_s` counts."""
    speed_mps: Annotated[Number, Field(ge=0, le=1000)] = 0.0
    """How fast it moves. At 0, all has been there from the beginning."""

    @model_validator(mode="after")
    def _has_length(self) -> Self:
        if not curve(self.path):
            raise ValueError("path must lead from one point to another (all its points are the same)")
        return self

    def _span_m(self, aside_m: float) -> float:
        return _widest([spot for piece in curve(self.path) for spot in piece]) + 2.0 * aside_m


class Footprints(_Way):
    """Someone walks along a path."""

    kind: Literal["footprints"]
    step_m: Annotated[Number, Field(ge=0.01, le=100)] = 0.75
    """From one print to the next, left and right in turn."""
    gauge_m: Annotated[Number, Field(ge=0, le=100)] = 0.22
    """Between the lines of left and right prints."""
    foot_m: tuple[_Width, _Width] = (0.29, 0.11)
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


class Tracks(_Way):
    """A vehicle drives along a path."""

    kind: Literal["tracks"]
    impact_m: Annotated[Number, Field(ge=0, le=100)] = 0.2
    """Width of the surroundings that are pushed aside."""
    gauge_m: Annotated[Number, Field(ge=0, le=100)] = 1.6
    """From the middle of the left track to that of the right; 0 leaves a single one."""
    tyre_m: _Width = 0.25
    """Width of each track."""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        span_m = self._span_m(0.5 * self.gauge_m + self.tyre_m + self.impact_m)
        what = f"tracks of {self.tyre_m:g} m"
        _check_span(span_m, self.tyre_m / LEAST_TEXELS["tyre"], what, "shorten path, or drive it in several tables")
        return self


class Stamp(_Press):
    """The outline of anything, pressed into the grass in any number of places."""

    kind: Literal["stamp"]
    outline: FileName
    """Picture of what pressed: dark on light, or opaque where it has transparent parts. Its top lies north."""
    places: Annotated[tuple[Place, ...], Field(min_length=1, max_length=1000)]
    """Where: [x, z, turn about the vertical in degrees] of its middle."""
    size_m: Size = (1.0, 1.0)
    """Extent of the picture on the ground, along its width and height."""
    at_s: _Instant | None = None
    """When it comes down. Left out, it has been there from the beginning, and `fades_s` counts from 0."""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        longest, reach_m = max(self.size_m), 0.5 * hypot(*self.size_m) + self.impact_m
        span_m = _widest([(x, z) for x, z, _ in self.places]) + 2.0 * reach_m
        what = f"stamps of {longest:g} m"
        _check_span(span_m, longest / LEAST_TEXELS["stamp"], what, "put places closer, or into several tables")
        return self


Force = Annotated[ForceMap | Footprints | Tracks | Stamp, Field(discriminator="kind")]
