"""Settings of blades that the geometry stage makes of stored roots."""

import math
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from greensward.scene.base import Count, Number, Range, Triple, default
from greensward.techniques.blades.leaf import ThinSettings

MOST_EXTRA = 8
MOST_POINTS = 7
_Angle = Annotated[Number, Field(ge=0.1, le=90)]
_Distance = Annotated[Number, Field(ge=0, le=10_000)]


def _rising(distances: tuple[float, float, float]) -> tuple[float, float, float]:
    if sorted(distances) != list(distances):
        raise ValueError("must not fall from one level to the next; sort them")
    if distances[-1] == 0.0:
        raise ValueError("must end above 0, or nothing is drawn; raise the last")
    return distances


def _outlines(points: tuple[int, int, int]) -> tuple[int, int, int]:
    if any(count % 2 == 0 for count in points):
        raise ValueError("must be odd: two for each point of the trajectory, and the tip")
    if sorted(points, reverse=True) != list(points):
        raise ValueError("must not rise from one level to the next; sort them")
    return points


class RootSettings(ThinSettings):
    """Storage of the roots, blades of each of them, their trajectory and their levels of detail."""

    storage: Literal["vertex-buffer", "texture-array"] = "vertex-buffer"
    """Storage that the pipeline reads roots from: a vertex buffer, or an array of textures by the vertex's number."""
    extra_blades: Count = Field(0, ge=0, le=MOST_EXTRA)
    """Blades made of a root besides its own. `sowing.density_per_m2` counts roots. With `texture-array` they are
    interpolated between neighbouring roots."""
    expansion: Literal["loop", "invocations"] = "loop"
    """A geometry shader makes all blades of a root one after the other, or each in an invocation of its own."""
    levels_m: Annotated[Triple[_Distance], AfterValidator(_rising)] = default((8.0, 16.0, 10_000.0))
    """Distances from the camera at which each level of detail ends, the finest first; from the last on, nothing is
    drawn."""
    fade: Number = Field(0.2, ge=0, le=1)
    """Part of the last of `levels_m` over which blades shrink; at 0 they end at once."""
    points: Annotated[Triple[Annotated[Count, Field(ge=3, le=MOST_POINTS)]], AfterValidator(_outlines)] = default(
        (7, 5, 3)
    )
    """Vertices of a blade's outline, by level: two for each point of the trajectory but the last, the tip."""
    speed_mps: Number = Field(2.0, ge=0.001, le=1000)
    """Launch speed of the particle whose trajectory is the middle line of a blade, scaled to the blade's length."""
    angle_deg: Range[_Angle] = default((48.0, 84.0))
    """Launch angle above the ground, from the least to the greatest of all blades."""
    gravity_mps2: Number = Field(9.81, ge=0, le=1000)
    """Gravity on the particle."""
    interval_s: Number = Field(0.06, ge=0.001, le=1000)
    """Time between two points of the trajectory, at the finest level."""
    root_width: Number = Field(1.0, ge=0.01, le=10)
    """Width at the root, in widths of the species."""
    top_width: Number = Field(0.75, ge=0, le=10)
    """Width at the last point below the tip, in widths of the species."""

    @property
    def flight_s(self) -> float:
        """Time from the root to the tip."""
        return (self.points[0] // 2) * self.interval_s

    @model_validator(mode="after")
    def _leaves_the_ground(self) -> Self:
        angle = self.angle_deg[0]
        rise = self.speed_mps * math.sin(math.radians(angle)) * self.flight_s
        tip = rise - 0.5 * self.gravity_mps2 * self.flight_s**2
        if tip < 1e-12:
            raise ValueError(
                f"the trajectory must leave the ground: launched at {self.speed_mps:g} m/s and {angle:g} degrees, "
                f"its tip is at {tip:.3g} m after {self.flight_s:g} s; raise speed_mps or angle_deg, or lower "
                "gravity_mps2 or interval_s"
            )
        return self
