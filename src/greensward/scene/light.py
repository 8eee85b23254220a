"""Sun, sky, camera and what happens to the picture afterwards."""

from typing import Literal, Self

from pydantic import Field, model_validator

from greensward.scene.base import Flag, Model, Number, Point


class Sun(Model):
    """Where the sun stands; its colour follows from the air it shines through."""

    azimuth_deg: Number = Field(235.0, ge=-360, le=360)
    """Clockwise from north (−z): 90 is east, 180 south."""
    elevation_deg: Number = Field(18.0, ge=-10, le=90)
    """Above the horizon."""
    strength: Number = Field(1.0, ge=0, le=100)
    """Factor on its light."""


class Sky(Model):
    """The air: how clear it is and what floats in it."""

    haze: Number = Field(1.0, ge=0, le=50)
    """Dust and moisture: 0 is pure air, 1 a clear day, 10 very hazy."""
    clouds: Number = Field(0.35, ge=0, le=1)
    """Part of the sky that clouds cover. They are far off: the sun shines on the grass all the same."""
    strength: Number = Field(1.0, ge=0, le=100)
    """Factor on the light of the sky."""


class Camera(Model):
    """A pinhole camera."""

    position_m: Point = (0.0, 1.7, 8.0)
    """Where it is."""
    target_m: Point = (0.0, 1.0, -20.0)
    """What it looks at."""
    height_above_ground: Flag = True
    """Whether the y of position and target is counted from the ground below each."""
    fov_y_deg: Number = Field(50.0, gt=0.1, lt=170)
    """Vertical field of view."""
    near_m: Number = Field(0.1, gt=0, le=1000)
    """Nothing nearer is drawn."""
    far_m: Number = Field(5000.0, gt=0, le=1_000_000)
    """Nothing farther is drawn but the sky."""

    @model_validator(mode="after")
    def _sees_something(self) -> Self:
        if self.far_m <= self.near_m:
            raise ValueError("far_m must be above near_m")
        if self.position_m == self.target_m:
            raise ValueError("target_m must differ from position_m")
        return self


class Post(Model):
    """From light to picture."""

    exposure_ev: Number = Field(0.0, ge=-20, le=20)
    """Stops brighter or darker than the scene's own light suggests."""
    tone_map: Literal["filmic", "linear"] = "filmic"
    """How bright light is fitted into the picture."""
    saturation: Number = Field(1.0, ge=0, le=2)
    """1 leaves colours as they are, 0 is grey."""
    vignette: Number = Field(0.15, ge=0, le=1)
    """Darkening towards the corners."""
    blur: Literal["off", "average", "gaussian"] = "off"
    """Blurs what is far, over seven by seven pixels (Jahrmann & Wimmer 2013); what is much nearer does not spread."""
    blur_near_m: Number = Field(2.0, gt=0, le=1000)
    """Nothing nearer is blurred; at seven times this distance the blur is nearly full."""
    darkening: Number = Field(0.0, ge=0, le=1)
    """How much darker grass, flowers and ground are at `darkening_m`; less nearer, in proportion to the distance."""
    darkening_m: Number = Field(300.0, gt=0, le=100_000)
    """Distance at which they are darkest."""
