"""Where blades grow, what moves them, and the plain objects among them."""

from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from greensward.scene.base import Colour, Count, FileName, Flag, Model, Number, Point, Text


class Sowing(Model):
    """Where blades grow: density, maps, slope, clumps and drifts."""

    density_per_m2: Number = Field(600.0, ge=0, le=100_000)
    """Blades on a square metre where nothing thins them."""
    density_map: FileName | None = None
    """Picture over the whole ground: red is density, green the low-detail subset, blue the height."""
    vegetation_map: FileName | None = None
    """Picture over the whole ground that colours the grass; its alpha says how much."""
    max_slope_deg: Number = Field(60.0, ge=0, le=90)
    """No blade grows where the ground is steeper."""
    clump_m: Number = Field(0.35, gt=0, le=100)
    """Size of clumps, in which blades lean and colour alike."""
    clumping: Number = Field(0.5, ge=0, le=1)
    """0 has no clumps; 1 pulls every blade into one."""
    drift_m: Number = Field(12.0, gt=0, le=10_000)
    """Distance over which height, density, dryness and species drift."""
    drift: Number = Field(0.6, ge=0, le=1)
    """Strength of those drifts."""
    full_density_m: Number = Field(6.0, gt=0, le=100_000)
    """Every blade is kept up to this distance from the camera; beyond, fewer and wider ones stand for them."""
    reach_m: Number = Field(300.0, gt=0, le=100_000)
    """No blades are drawn beyond this distance from the camera; the ground takes their colour."""


class Gusts(Model):
    """Gusts that travel with the wind, in closed form: no state, any instant can be drawn."""

    kind: Literal["gusts"] = "gusts"
    direction_deg: Number = Field(250.0, ge=-360, le=360)
    """Where it blows from, clockwise from north (−z), as in a weather report."""
    speed_mps: Number = Field(4.5, ge=0, le=200)
    """Mean speed."""
    gustiness: Number = Field(0.6, ge=0, le=1)
    """How much the gusts raise and lower it."""
    gust_m: Number = Field(9.0, gt=0, le=10_000)
    """Size of a gust."""
    turbulence: Number = Field(0.3, ge=0, le=1)
    """Small eddies and the flutter of each blade."""


Wind = Annotated[Gusts, Field()]


class Solid(Model):
    """A plain solid that stands in the grass, hides it and casts a shadow."""

    kind: Literal["box", "sphere", "cylinder"]
    """Shape. A cylinder stands upright."""
    position_m: Point
    """Centre of its base; y is above the ground."""
    size_m: tuple[
        Annotated[Number, Field(gt=0, le=10_000)],
        Annotated[Number, Field(gt=0, le=10_000)],
        Annotated[Number, Field(gt=0, le=10_000)],
    ] = (1.0, 1.0, 1.0)
    """Extent along its own x, y and z."""
    yaw_deg: Number = Field(0.0, ge=-360, le=360)
    """Turn about the vertical."""
    lean_deg: Number = Field(0.0, ge=-90, le=90)
    """Lean from the vertical, towards its own x."""
    colour: Colour = "#8a8378"
    """sRGB of its surface."""
    roughness: Number = Field(0.9, ge=0.05, le=1)
    """Gloss: low is shiny."""


class TechniqueChoice(Model):
    """Which technique draws the grass; its settings are the other keys of the table."""

    model_config = ConfigDict(extra="allow")

    name: Text = "bezier-blades"
    """One of the techniques listed by `greensward info`."""


class Shadows(Model):
    """Shadow maps of the sun: nested squares around the view, the first the sharpest."""

    enabled: Flag = True
    """Whether anything casts a shadow."""
    cascades: Count = Field(3, ge=1, le=4)
    """How many nested maps."""
    size_px: Count = Field(1024, ge=64, le=8192)
    """Edge of each map."""
    nearest_m: Number = Field(7.0, gt=0, le=10_000)
    """How far from the camera the first reaches."""
    furthest_m: Number = Field(700.0, gt=0, le=100_000)
    """How far the last reaches."""
    density: Number = Field(0.5, ge=0, le=1)
    """Part of the blades that cast shadows; they are wider, to stand for the others."""
