"""Weather: a closed layer of cloud, single clouds, and their shadows on the land."""

import math

import numpy as np
import pytest

from greensward.passes.light import LIGHT_BLOCK, cloud_origin, sun_at_ground, to_sun
from greensward.scene.errors import SceneError
from greensward.scene.light import _WEATHERS, Sky
from oracles import air
from shader_calls import shader_call
from small_scenes import small_scene

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_BOX = {"kind": "box", "position_m": [0.0, 1.0, 0.0], "size_m": [2.0, 2.0, 2.0], "colour": "#808080"}
_PLAIN = {
    "ground": {"kind": "flat", "size_m": [4000.0, 4000.0]},
    "grass": [],
    "shadows": {"enabled": False},
    "sun": {"elevation_deg": 60.0, "azimuth_deg": 90.0},
}


@pytest.mark.parametrize("elevation_deg", [1.0, 20.0, 60.0, 90.0])
def test_an_overcast_sky_is_the_cies(device, elevation_deg):
    scene = small_scene(sun={"elevation_deg": elevation_deg})
    outside = np.array([20.0, 19.4, 18.6])
    sine = np.linspace(0.0, 1.0, 33, dtype=np.float32)
    blocks = {LIGHT_BLOCK: {"to_sun": (*to_sun(scene), 0.0), "sun_outside": (*outside, 0.0), "sky_strength": 1.0}}
    got = shader_call(device, "passes/sky/air.glsl", "overcastRadiance(s)", {"s": sine}, "vec3", blocks=blocks)
    expected = air.overcast_radiance(sine.astype(np.float64), math.sin(math.radians(elevation_deg)), outside)
    assert np.allclose(got @ _LUMINANCE, expected, rtol=0.01)
    assert got[-1] == pytest.approx(3.0 * got[0])


def test_an_overcast_sky_lights_the_ground_as_krochmann_measured(renderer):
    light = renderer(small_scene(sky={"overcast": 1.0}, sun={"elevation_deg": 40.0}), size=(64, 36)).light()
    assert (light.sun_irradiance == 0.0).all()
    up = light.sky_irradiance([0.0, 1.0, 0.0]) @ _LUMINANCE
    outside = np.array([20.0, 19.4, 18.6]) @ _LUMINANCE
    assert up / outside == pytest.approx((0.3 + 21.0 * math.sin(math.radians(40.0))) / 133.8, rel=0.04)


def test_the_sun_loses_what_the_layer_takes():
    clear, half = (sun_at_ground(small_scene(sky={"overcast": part})) for part in (0.0, 0.5))
    assert half == pytest.approx(0.5 * clear)


def test_nothing_has_a_shadow_with_an_edge_below_a_closed_layer(renderer):
    sun = {"elevation_deg": 35.0, "azimuth_deg": 90.0}
    camera = {"position_m": [0.0, 12.0, 0.01], "target_m": [0.0, 0.0, 0.0]}

    def contrast(overcast: float) -> float:
        tables = {**_PLAIN, "shadows": {"enabled": True}, "sun": sun, "camera": camera, "sky": {"overcast": overcast}}
        with_box, bare = (
            renderer(small_scene(**tables, object=each), size=(96, 54)).render(0.0).image[24:30, 30:36].mean()
            for each in ([_BOX], [])
        )
        return abs(with_box / bare - 1.0)

    assert contrast(0.0) > 0.3
    assert contrast(1.0) < 0.04


def _from_above(renderer, time_s: float, **sky) -> np.ndarray:
    """Luminance of bare ground, 2,560 × 1,440 m, seen from straight above; north is up."""
    camera = {"position_m": [0.0, 900.0, 0.0], "target_m": [0.0, 0.0, -0.001], "projection": "orthographic",
              "view_height_m": 1440.0, "far_m": 2000.0}  # fmt: skip
    scene = small_scene(
        **_PLAIN, sky={"clouds": 0.5, "cloud_height_m": 200.0, **sky}, camera=camera, post={"vignette": 0.0}
    )
    return renderer(scene, size=(256, 144)).render(time_s).image.astype(float) @ _LUMINANCE


def test_shadows_of_clouds_lie_on_the_land_and_travel(renderer):
    sky = {"cloud_shadows": 1.0, "cloud_speed_mps": 10.0, "cloud_direction_deg": 270.0}
    plain, first = _from_above(renderer, 0.0), _from_above(renderer, 0.0, **sky)
    share = first / plain
    assert 0.2 < (share < 0.6).mean() < 0.8  # some of the land is shaded, and some is not
    assert (share > 0.97).mean() > 0.1
    later = _from_above(renderer, 20.0, **sky) / plain
    # they come from the west: 200 m to the east in 20 s, at 10 m a pixel
    assert np.abs(later[:, 20:] - share[:, :-20]).mean() < 0.02
    assert np.abs(later - share).mean() > 0.08


def test_clouds_stand_still_unless_they_are_told_to_move(renderer):
    assert (_from_above(renderer, 0.0, cloud_shadows=1.0) == _from_above(renderer, 50.0, cloud_shadows=1.0)).all()
    at = np.array([1e6, 2.0, -3e5])
    assert (cloud_origin(small_scene(), at, 9.0) == 0.0).all()
    moving = small_scene(sky={"cloud_speed_mps": 5.0, "cloud_direction_deg": 0.0})
    gone = cloud_origin(moving, at, 2.0) - cloud_origin(moving, at, 0.0)
    assert gone == pytest.approx([0.0, -10.0 * 0.55 / 1200.0])  # from the north: what is above came from there


_KEYS = {
    "haze": 5.0, "clouds": 0.7, "overcast": 0.5, "cloud_shadows": 0.3, "cloud_height_m": 400.0,
    "cloud_speed_mps": 90.0, "cloud_direction_deg": 10.0, "strength": 0.5,
}  # fmt: skip


def test_every_key_of_the_sky_changes_the_picture(renderer):
    usual = {"clouds": 0.5, "cloud_shadows": 0.8, "cloud_height_m": 100.0, "cloud_speed_mps": 10.0}

    def drawn(**sky) -> bytes:
        return renderer(small_scene(sky=sky, grass=[]), size=(96, 54)).render(9.0).image.tobytes()

    assert _KEYS.keys() == Sky.model_fields.keys() - {"weather"}
    base = drawn(**usual)
    for key, value in _KEYS.items():
        assert drawn(**{**usual, key: value}) != base, key


@pytest.mark.parametrize("weather", _WEATHERS)
def test_weather_is_a_starting_point(weather):
    sky = Sky(weather=weather)
    for key, value in _WEATHERS[weather].items():
        assert getattr(sky, key) == value
    assert Sky(weather=weather, haze=3.25).haze == 3.25
    assert Sky.model_validate(sky.model_dump()) == sky


@pytest.mark.parametrize(
    ("keys", "problem"),
    [
        ({"clouds": 0.0, "cloud_shadows": 0.5}, "cloud_shadows needs clouds above 0"),
        ({"weather": "overcast", "cloud_shadows": 0.5}, "overcast must be below 1"),
        ({"weather": "storm"}, "weather"),
        ({"overcast": 1.5}, "overcast"),
        ({"cloud_height_m": 0.0}, "cloud_height_m"),
    ],
)
def test_parts_that_contradict_each_other_are_refused(keys, problem):
    with pytest.raises(SceneError, match=problem):
        Sky(**keys)
