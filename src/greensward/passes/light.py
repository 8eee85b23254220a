"""Sun, sky and air as one uniform block."""

import math

import numpy as np
import numpy.typing as npt

from greensward.gpu.layouts import block
from greensward.scene import Fog, NoGround, Phong, Scene
from greensward.scene.base import linear

LIGHT_BLOCK = block(
    "Light",
    ("to_sun", "vec4"),
    ("sun_outside", "vec4"),  # irradiance above the air
    ("sun_here", "vec4"),  # irradiance at the ground, facing the sun
    ("shadow_from_world", "mat4", 4),
    ("shadow_texel_m", "vec4"),
    ("caster_m", "float"),  # half the width of what casts the shadow of a broad blade
    ("haze", "float"),
    ("clouds", "float"),
    ("overcast", "float"),
    ("cloud_shadows", "float"),
    ("cloud_scale", "float"),  # from metres to the pattern of single clouds
    ("cloud_origin", "vec2"),  # of the camera in that pattern
    ("sky_strength", "float"),
    ("fog_away", "vec4"),  # colours
    ("fog_towards", "vec4"),
    ("fog_per_m", "float"),
    ("fog_level_m", "float"),
    ("fog_scale_m", "float"),
    ("fog_sharpness", "float"),
    ("cascades", "int"),
    ("exposure_ev", "float"),
    ("saturation", "float"),
    ("vignette", "float"),
    ("filmic", "int"),
    ("sample_index", "int"),
    ("bloom", "float"),
    ("bloom_threshold", "float"),
    ("blur", "int"),
    ("blur_near_m", "float"),
    ("blur_far_m", "float"),
    ("darkening", "float"),
    ("darkening_m", "float"),
    ("open_below", "int"),  # no ground: sky below the horizon too
    ("phong", "vec4"),  # coefficients of ambient, diffuse and specular light; shininess
    ("extinction", "float"),
)
_SUN = np.array([1.0, 0.97, 0.93]) * 20.0  # irradiance above the air of a sun of strength 1


def to_sun(scene: Scene) -> npt.NDArray[np.float64]:
    """Unit vector towards the sun; north is −z, east +x."""
    azimuth, elevation = math.radians(scene.sun.azimuth_deg), math.radians(scene.sun.elevation_deg)
    return np.array(
        [math.cos(elevation) * math.sin(azimuth), math.sin(elevation), -math.cos(elevation) * math.cos(azimuth)]
    )


def light_values(scene: Scene) -> dict[str, object]:
    """Members of the `Light` block that follow from the scene alone."""
    sun, sky, post, fog, phong = scene.sun, scene.sky, scene.post, scene.fog or Fog(), scene.phong or Phong()
    return {
        "to_sun": (*to_sun(scene), 0.0),
        "sun_outside": (*(_SUN * sun.strength), 0.0),
        "sun_here": (*sun_at_ground(scene), 0.0),
        "caster_m": _caster_m(scene),
        "haze": sky.haze,
        "clouds": sky.clouds,
        "overcast": sky.overcast,
        "cloud_shadows": sky.cloud_shadows,
        "cloud_scale": _cloud_scale(scene),
        "sky_strength": sky.strength,
        "fog_away": (*linear(fog.away), 0.0),
        "fog_towards": (*linear(fog.towards), 0.0),
        "fog_per_m": fog.density_per_m if scene.fog else 0.0,
        "fog_level_m": fog.level_m,
        "fog_scale_m": fog.scale_m,
        "fog_sharpness": fog.sharpness,
        "exposure_ev": post.exposure_ev,
        "saturation": post.saturation,
        "vignette": post.vignette,
        "bloom": post.bloom,
        "bloom_threshold": post.bloom_threshold,
        "blur": ("off", "average", "gaussian").index(post.blur),
        "blur_near_m": post.blur_near_m,
        "blur_far_m": max(scene.camera.far_m, 2.0 * post.blur_near_m),
        "darkening": post.darkening,
        "darkening_m": post.darkening_m,
        "filmic": int(post.tone_map == "filmic"),
        "open_below": int(isinstance(scene.ground, NoGround)),
        "phong": (phong.ambient, phong.diffuse, phong.specular, phong.shininess),
        "extinction": phong.extinction,
    }


def cloud_origin(scene: Scene, camera_ws: npt.NDArray[np.float64], time_s: float) -> npt.NDArray[np.float64]:
    """Place (2,) of a camera in the pattern of single clouds, which their speed shifts; 0 while they stand still."""
    sky = scene.sky
    if sky.cloud_shadows == sky.cloud_speed_mps == 0.0:
        return np.zeros(2)
    angle = math.radians(sky.cloud_direction_deg)
    come_from = np.array([math.sin(angle), -math.cos(angle)])
    shifted: npt.NDArray[np.float64] = camera_ws[[0, 2]] + come_from * sky.cloud_speed_mps * time_s
    return shifted * _cloud_scale(scene)


def _cloud_scale(scene: Scene) -> float:
    return 0.55 / scene.sky.cloud_height_m


def _caster_m(scene: Scene) -> float:
    """Half the width at which the broadest blade is drawn in the first shadow map, at most 4 cm."""
    broadest = max((each.width_m[1] for each in scene.grass), default=0.0)
    return min(0.5 * broadest / max(scene.shadows.density, 0.1), 0.04)


def sun_at_ground(scene: Scene) -> npt.NDArray[np.float64]:
    """Irradiance (3,) of the sun at the ground, facing it; the twin of `sunThroughAir` in passes/sky/air.glsl."""
    earth, air = 6360.0, 6460.0
    direction = to_sun(scene)
    p = np.array([0.0, earth + 0.3, 0.0])
    b = float(p @ direction)
    if b < 0.0 and b * b - p @ p + earth * earth > 0.0:
        return np.zeros(3)
    span = -b + math.sqrt(b * b - float(p @ p) + air * air)
    along = (np.arange(64) + 0.5) / 64.0 * span
    height = np.linalg.norm(p + along[:, None] * direction, axis=1) - earth
    step = span / 64.0
    rayleigh, mie = np.exp(-height / 8.0).sum() * step, np.exp(-height / 1.2).sum() * step
    ozone = np.maximum(0.0, 1.0 - np.abs(height - 25.0) / 15.0).sum() * step
    depth = (
        np.array([5.802e-3, 13.558e-3, 33.1e-3]) * rayleigh
        + 3.996e-3 * 1.11 * scene.sky.haze * mie
        + np.array([0.650e-3, 1.881e-3, 0.085e-3]) * ozone
    )
    result: npt.NDArray[np.float64] = _SUN * (scene.sun.strength * (1.0 - scene.sky.overcast)) * np.exp(-depth)
    return result
