"""Sun, sky, camera and post-processing."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from greensward.scene.base import Colour, Count, Flag, Many, Model, Number, OptionalPair, Point, default


class Sun(Model):
    """Position of the sun; its colour follows from the air that it shines through."""

    azimuth_deg: Number = Field(default=235.0, ge=-360, le=360)
    """Direction of the sun, clockwise from north (−z): 90 is east, 180 south."""
    elevation_deg: Number = Field(default=18.0, ge=-10, le=90)
    """Angle above the horizon."""
    strength: Number = Field(default=1.0, ge=0, le=100)
    """Factor on its light."""


_WEATHERS: dict[str, dict[str, float]] = {
    "clear": {"haze": 0.6, "clouds": 0.0},
    "hazy": {"haze": 6.0, "clouds": 0.15, "overcast": 0.1},
    "fair": {"clouds": 0.4, "cloud_shadows": 0.85, "cloud_speed_mps": 8.0},
    "broken": {"haze": 1.5, "clouds": 0.62, "overcast": 0.15, "cloud_shadows": 0.95, "cloud_speed_mps": 12.0},
    "overcast": {"haze": 2.0, "clouds": 0.7, "overcast": 1.0, "cloud_speed_mps": 6.0},
}


class Sky(Model):
    """Atmosphere: haze and clouds."""

    weather: Literal["clear", "hazy", "fair", "broken", "overcast"] | None = None
    """Starting point: values of the keys of this table that are not given."""
    haze: Number = Field(default=1.0, ge=0, le=50)
    """Dust and moisture: 0 is pure air, 1 a clear day, 10 very hazy."""
    clouds: Number = Field(default=0.35, ge=0, le=1)
    """Fraction of the sky that single clouds cover."""
    overcast: Number = Field(default=0.0, ge=0, le=1)
    """Part of the sun that a closed layer of cloud takes away. At 1 the sky is the overcast sky of the CIE, and
    nothing has a shadow with an edge."""
    cloud_shadows: Number = Field(default=0.0, ge=0, le=1)
    """Part of the sun that single clouds take away where their shadows lie."""
    cloud_height_m: Number = Field(default=1200.0, ge=50, le=20_000)
    """Height of single clouds above the ground; higher ones are larger."""
    cloud_speed_mps: Number = Field(default=0.0, ge=0, le=200)
    """Speed of clouds and their shadows."""
    cloud_direction_deg: Number = Field(default=250.0, ge=-360, le=360)
    """Direction that clouds come from, clockwise from north (−z)."""
    strength: Number = Field(default=1.0, ge=0, le=100)
    """Factor on the light of the sky."""

    @model_validator(mode="after")
    def _begins_with_weather(self) -> Self:
        given = self.model_fields_set
        for key, value in _WEATHERS.get(self.weather or "", {}).items():
            if key not in given:
                self.__dict__[key] = value  # not as given: another weather changes it again
        if "cloud_shadows" in given and self.cloud_shadows > 0.0:
            if self.clouds == 0.0:
                raise ValueError("cloud_shadows needs clouds above 0 (got 0)")
            if self.overcast == 1.0:
                raise ValueError("cloud_shadows needs a sun, and overcast must be below 1 for it (got 1)")
        return self


class Fog(Model):
    """Fog that thins with height, tinted towards the sun (Derstroff, "Realtime grass", section 3.3)."""

    density_per_m: Number = Field(default=0.02, ge=0, le=10)
    """Extinction of a metre of it at `level_m`: what is 1 / `density_per_m` away keeps 37 % of its light."""
    level_m: Number = Field(default=0.0, ge=-1e5, le=1e5)
    """Height, as the ground's heights are counted, at which it has this density."""
    scale_m: Number = Field(default=20.0, ge=0.1, le=1e6)
    """Height over which its density falls to 37 %."""
    away: Colour = "#c0cddd"
    """Its colour away from the sun."""
    towards: Colour = "#ffe3ad"
    """Its colour in the direction of the sun."""
    sharpness: Number = Field(default=8.0, ge=0, le=1000)
    """Exponent of the tint: the higher it is, the smaller the part that is tinted by the sun."""


_Coefficient = Annotated[Number, Field(ge=0, le=1)]


class Phong(Model):
    """Phong's reflection model, with less ambient light towards the roots of tall and dense grass (Tillman 2013)."""

    ambient: _Coefficient = 1.0
    """Coefficient of the ambient light, which is the mean light of the sky."""
    diffuse: _Coefficient = 1.0
    """Coefficient of the sunlight that a surface scatters."""
    specular: _Coefficient = 0.06
    """Coefficient of the sun's highlights."""
    shininess: Number = Field(default=12.0, ge=1, le=1000)
    """Exponent of the highlights: higher ones are smaller."""
    extinction: Number = Field(default=0.5, ge=0, le=10)
    """Extinction of ambient light by a unit of leaf area index; 0 leaves it the same from tip to root."""

    @model_validator(mode="after")
    def _reflects_something(self) -> Self:
        if self.ambient == self.diffuse == self.specular == 0.0:
            raise ValueError("ambient, diffuse or specular must be above 0, or all is black (got 0 for each)")
        return self


_Focal = Annotated[Number, Field(ge=0.1, le=1e7)]
_Pixels = Annotated[Count, Field(ge=1, le=1_000_000)]
_Principal = Annotated[Number, Field(ge=-1e6, le=1e6)]
_WIDEST_PINHOLE_DEG = 170.0
INTRINSICS = "fx_px", "fy_px", "cx_px", "cy_px", "calibrated_px"
"""Keys that stand for a field of view."""


class Camera(Model):
    """A camera. Fisheyes and distortion are for `render` and `animate` with samples; a window shows a pinhole."""

    position_m: Point = default((0.0, 1.7, 8.0))
    """Position."""
    target_m: Point = default((0.0, 1.0, -20.0))
    """Point that it looks at."""
    height_above_ground: Flag = True
    """True if the y of position and target is above the ground below each."""
    roll_deg: Number = Field(default=0.0, ge=-360, le=360)
    """Turn about the line of sight, clockwise as the camera sees it; 0 is level."""
    projection: Literal["perspective", "orthographic", "fisheye"] = "perspective"
    """`perspective` is a pinhole, `orthographic` has parallel rays, and in a `fisheye` the distance from the middle
    grows with the angle (equidistant)."""
    fov_y_deg: Number = Field(default=50.0, gt=0.1, le=360)
    """Vertical field of view; below 170 unless it is a fisheye."""
    view_height_m: Number = Field(default=20.0, ge=0.001, le=100_000)
    """Height of what an orthographic picture shows."""
    fx_px: _Focal | None = None
    """Focal length along x, in pixels; of a fisheye in pixels per radian, of an orthographic picture in pixels per
    metre. It replaces `fov_y_deg` and `view_height_m`."""
    fy_px: _Focal | None = None
    """The same along y. Left out, it is that of `fx_px`."""
    cx_px: _Principal | None = None
    """Principal point, from the centre of the leftmost pixels to the right. Left out, it is the middle."""
    cy_px: _Principal | None = None
    """Principal point, from the centre of the topmost pixels down. Left out, it is the middle."""
    calibrated_px: OptionalPair[_Pixels] = default(None)
    """Width and height of the pictures that these four were measured in; in a larger picture of the same shape they
    grow with it. Left out, they are of the picture that is drawn."""
    distortion: Annotated[Many[Number], Field(max_length=5)] = default(())
    """Distortion of the lens, k1, k2, p1, p2, k3, as OpenCV has them. Those left out are 0."""
    near_m: Number = Field(default=0.1, ge=0.001, le=1000)
    """Nothing nearer is drawn."""
    far_m: Number = Field(default=5000.0, ge=0.01, le=1_000_000)
    """Nothing farther is drawn but the sky."""

    @model_validator(mode="after")
    def _sees_something(self) -> Self:
        if self.far_m <= self.near_m:
            raise ValueError("far_m must be above near_m")
        if self.position_m == self.target_m:
            raise ValueError("target_m must differ from position_m")
        return self

    @model_validator(mode="after")
    def _has_one_lens(self) -> Self:
        if self.projection == "perspective" and self.fov_y_deg >= _WIDEST_PINHOLE_DEG:
            raise ValueError(
                f'fov_y_deg must be below {_WIDEST_PINHOLE_DEG:g} (got {self.fov_y_deg:g}), or projection = "fisheye"'
            )
        others = {name for name in ("fy_px", "cx_px", "cy_px", "calibrated_px") if getattr(self, name) is not None}
        if others and self.fx_px is None:
            raise ValueError(f"{min(others)} needs fx_px")
        if any(self.distortion) and self.projection != "perspective":
            raise ValueError(f'distortion is for projection = "perspective" (got "{self.projection}")')
        return self

    @property
    def is_straight(self) -> bool:
        """True if straight lines are straight in its pictures: it is no fisheye and does not distort."""
        return self.projection != "fisheye" and not any(self.distortion)


class Post(Model):
    """Post-processing: from light to picture."""

    exposure_ev: Number = Field(default=0.0, ge=-20, le=20)
    """Stops above or below automatic exposure for the scene's light."""
    tone_map: Literal["filmic", "linear"] = "filmic"
    """Tone mapping: how bright light is fitted into the picture."""
    saturation: Number = Field(default=1.0, ge=0, le=2)
    """Saturation of colours: 1 leaves them as they are, 0 is grey."""
    vignette: Number = Field(default=0.15, ge=0, le=1)
    """Darkening towards the corners."""
    bloom: Number = Field(default=0.0, ge=0, le=10)
    """Part of the light of bright pixels that the lens spreads over those around them; 0 is none."""
    bloom_threshold: Number = Field(default=1.0, ge=0, le=1000)
    """Luminance after exposure from which a pixel is bright; 1 is about the white of a sunlit cloud."""
    bloom_size: Number = Field(default=0.02, ge=0.001, le=0.2)
    """Standard deviation of the spread, as a part of the picture's height."""
    blur: Literal["off", "average", "gaussian"] = "off"
    """Blur of distant pixels, seven by seven wide (Jahrmann & Wimmer 2013); much nearer ones do not spread."""
    blur_near_m: Number = Field(default=2.0, ge=0.001, le=1000)
    """Nothing nearer is blurred; at seven times this distance the blur is nearly full."""
    darkening: Number = Field(default=0.0, ge=0, le=1)
    """Darkening of grass, flowers and ground at `darkening_m`; proportional to the distance up to there."""
    darkening_m: Number = Field(default=300.0, ge=0.1, le=100_000)
    """Distance of the full darkening."""
