"""Objects among the grass: they hide it, press it down, move, and may carry grass themselves."""

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from greensward.scene.base import (
    Amount,
    Colour,
    FileName,
    Flag,
    Many,
    Model,
    Number,
    OptionalMap,
    Point,
    Points,
    Text,
    Triple,
    default,
)

_Extent = Annotated[Number, Field(ge=0.001, le=10_000)]
_Angle = Annotated[Number, Field(ge=-360_000, le=360_000)]
_Time = Annotated[Number, Field(ge=-1e6, le=1e6)]


MOST_OBJECTS = 4096
"""Objects of a scene; ids of blades tell so many apart."""
PLAIN_COLOUR = "#8a8378"
"""Colour of objects that have none of their own."""


class Path(Model):
    """Path of an object: keys of time, position and turn."""

    times_s: Annotated[Many[_Time], Field(min_length=2, max_length=10_000)]
    """Times of the keys, rising. Before 0 an object moves while the simulation settles."""
    positions_m: Points
    """Centre of the object's base at each time; y is above the ground."""
    yaws_deg: Many[_Angle] = default(())
    """Turn about the vertical at each time, added to the object's own; may be left out."""
    smooth: Flag = True
    """True for a smooth curve through the keys, false for straight lines between them."""
    after: Literal["stop", "repeat", "return"] = "stop"
    """Behaviour past the last key: stay there, start again, or return along the path."""
    rolls: Flag = False
    """True if it rolls along the ground as a ball of its own height would."""

    @model_validator(mode="after")
    def _keys_fit(self) -> Self:
        for name in ("positions_m", "yaws_deg"):
            count = len(getattr(self, name))
            if count != len(self.times_s) and (count or name == "positions_m"):
                raise ValueError(f"{name} must hold one for each of the {len(self.times_s)} times_s (got {count})")
        for earlier, later in pairwise(self.times_s):
            if later <= earlier:
                raise ValueError(f"times_s must rise from key to key (got {later:g} after {earlier:g})")
        return self


class Fur(Model):
    """Grass on the surface of an object, along its normals, moving with it."""

    density_per_m2: Amount = Field(default=600.0, ge=0, le=1_000_000)
    """Blades on a square metre of surface."""
    density_from: Literal["everywhere", "colours"] = "everywhere"
    """`colours` takes the red of the mesh's vertex colours as its density."""
    density_map: OptionalMap = default(None)
    """Image laid out by the mesh's texture coordinates; its red is density."""


class _Object(Model):
    """Base of all objects."""

    name: Text = ""
    """A name for people, and for scripts that move it."""
    position_m: Point
    """Centre of its base; y is above the ground."""
    yaw_deg: Number = Field(default=0.0, ge=-360, le=360)
    """Turn about the vertical, counter-clockwise from above."""
    pitch_deg: Number = Field(default=0.0, ge=-180, le=180)
    """Turn about its own x: its front, own -z, rises. It comes before `yaw_deg`."""
    roll_deg: Number = Field(default=0.0, ge=-180, le=180)
    """Turn about its own z: it leans towards its own x. It comes before `pitch_deg`."""
    colour: Colour | None = None
    """sRGB of its surface. Without it, a mesh has the colours of its file, and what has none is `#8a8378`."""
    roughness: Number = Field(default=0.9, ge=0.05, le=1)
    """Gloss: low is shiny."""
    weathered: Number = Field(default=0.0, ge=0, le=1)
    """Streaks and blotches on its surface, as on old wood; 0 has none."""
    drawn: Flag = True
    """True if it is visible."""
    collides: Flag = True
    """True if it presses simulated grass down."""
    clears: Flag = True
    """True if no grass of the ground grows where it stands; for an object that is drawn and never moves."""
    path: Path | None = None
    """Path that it moves along. Without one it stays."""
    grass: Fur | None = None
    """Grass on its surface."""

    @model_validator(mode="after")
    def _has_colours(self) -> Self:
        if self.grass and self.grass.density_from == "colours" and not isinstance(self, Mesh):
            raise ValueError('grass.density_from = "colours" needs a mesh, which may have vertex colours')
        return self


class _Solid(_Object):
    size_m: Triple[_Extent] = default((1.0, 1.0, 1.0))
    """Extent along its own x, y and z."""


class Box(_Solid):
    """A box."""

    kind: Literal["box"] = "box"


class Sphere(_Solid):
    """A sphere, or an ellipsoid where its extents differ."""

    kind: Literal["sphere"] = "sphere"


class Cylinder(_Solid):
    """An upright cylinder."""

    kind: Literal["cylinder"] = "cylinder"


class Capsule(_Object):
    """An upright cylinder with round ends."""

    kind: Literal["capsule"] = "capsule"
    radius_m: _Extent = 0.25
    """Radius of the cylinder and of its ends."""
    length_m: _Extent = 1.0
    """Length from end to end; at least twice the radius."""

    @model_validator(mode="after")
    def _is_long_enough(self) -> Self:
        if self.length_m < 2.0 * self.radius_m:
            raise ValueError(
                f"length_m must be at least twice radius_m, {2.0 * self.radius_m:g} (got {self.length_m:g})"
            )
        return self


class Mesh(_Object):
    """A triangle mesh from a file."""

    kind: Literal["mesh"] = "mesh"
    file: FileName
    """glTF (`.glb`, `.gltf`), `.obj`, `.ply` or `.stl`. Its base is the lowest point."""
    up: Literal["y", "z"] = "y"
    """Axis of the file that points up: y of glTF, often z of CAD and of scanned meshes."""
    scale: Number = Field(default=1.0, ge=1e-6, le=1_000_000)
    """Metres for one unit of the file."""

    @model_validator(mode="after")
    def _does_not_roll(self) -> Self:
        if self.path and self.path.rolls:
            raise ValueError("path.rolls is for solids: a mesh may have any shape")
        return self


Object = Annotated[Box | Sphere | Cylinder | Capsule | Mesh, Field(discriminator="kind")]
