"""Objects among the grass: they hide it, press it down, move, and may bear grass themselves."""

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from greensward.scene.base import Colour, FileName, Flag, Model, Number, Point, Text

_Extent = Annotated[Number, Field(gt=0, le=10_000)]
_Angle = Annotated[Number, Field(ge=-360_000, le=360_000)]
_Time = Annotated[Number, Field(ge=0, le=1e6)]


class Path(Model):
    """Where an object is when: keys of time, place and turn."""

    times_s: Annotated[tuple[_Time, ...], Field(min_length=2, max_length=10_000)]
    """Times of the keys, rising."""
    positions_m: tuple[Point, ...]
    """Centre of the object's base at each time; y is above the ground."""
    yaws_deg: tuple[_Angle, ...] = ()
    """Turn about the vertical at each time, added to the object's own; none need be given."""
    smooth: Flag = True
    """Whether it goes through the keys in curves, or straight from each to the next."""
    after: Literal["stop", "repeat", "return"] = "stop"
    """After the last key: stay there, start again, or go back the same way."""
    rolls: Flag = False
    """Whether it rolls along the ground as a ball of its own height would."""

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
    """Grass on an object's own surface, along its normals: up walls, under ceilings, and while it moves."""

    density_per_m2: Number = Field(600.0, ge=0, le=1_000_000)
    """Blades on a square metre of surface."""
    density_from: Literal["everywhere", "colours"] = "everywhere"
    """`colours` takes the red of the mesh's vertex colours as its density."""
    density_map: FileName | None = None
    """Picture laid out by the mesh's texture coordinates; its red is density."""


class _Object(Model):
    """What every object has."""

    name: Text = ""
    """A name for people and for programs that move it."""
    position_m: Point
    """Centre of its base; y is above the ground."""
    yaw_deg: Number = Field(0.0, ge=-360, le=360)
    """Turn about the vertical."""
    lean_deg: Number = Field(0.0, ge=-180, le=180)
    """Lean from the vertical, towards its own x."""
    colour: Colour = "#8a8378"
    """sRGB of its surface."""
    roughness: Number = Field(0.9, ge=0.05, le=1)
    """Gloss: low is shiny."""
    drawn: Flag = True
    """Whether it is seen."""
    collides: Flag = True
    """Whether it presses simulated grass down."""
    path: Path | None = None
    """How it moves. Without one it stays."""
    grass: Fur | None = None
    """Grass on its surface. Without it, it has none."""

    @model_validator(mode="after")
    def _has_colours(self) -> Self:
        if self.grass and self.grass.density_from == "colours" and not isinstance(self, Mesh):
            raise ValueError('grass.density_from = "colours" needs a mesh, which may have vertex colours')
        return self


class _Solid(_Object):
    size_m: tuple[_Extent, _Extent, _Extent] = (1.0, 1.0, 1.0)
    """Extent along its own x, y and z."""


class Box(_Solid):
    """A box."""

    kind: Literal["box"]


class Sphere(_Solid):
    """A sphere, or an ellipsoid where its extents differ."""

    kind: Literal["sphere"]


class Cylinder(_Solid):
    """An upright cylinder."""

    kind: Literal["cylinder"]


class Capsule(_Object):
    """An upright cylinder with round ends."""

    kind: Literal["capsule"]
    radius_m: _Extent = 0.25
    """Radius of the cylinder and of its ends."""
    length_m: _Extent = 1.0
    """From end to end; at least twice the radius."""

    @model_validator(mode="after")
    def _is_long_enough(self) -> Self:
        if self.length_m < 2.0 * self.radius_m:
            raise ValueError(
                f"length_m must be at least twice radius_m, {2.0 * self.radius_m:g} (got {self.length_m:g})"
            )
        return self


class Mesh(_Object):
    """A triangle mesh from a file. Needs the extra `mesh`: `pip install greensward[mesh]`."""

    kind: Literal["mesh"]
    file: FileName
    """glTF (`.glb`, `.gltf`), `.obj`, `.ply` or `.stl`; y is up. Its base is the lowest point."""
    scale: Number = Field(1.0, gt=0, le=1_000_000)
    """Metres for one unit of the file."""

    @model_validator(mode="after")
    def _does_not_roll(self) -> Self:
        if self.path and self.path.rolls:
            raise ValueError("path.rolls is for solids: a mesh may have any shape")
        return self


Object = Annotated[Box | Sphere | Cylinder | Capsule | Mesh, Field(discriminator="kind")]
