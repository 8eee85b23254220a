"""Fog: its functions against float64 twins, and what it does to a picture."""

import numpy as np
import pytest

from greensward.passes.light import LIGHT_BLOCK
from greensward.passes.sky import SKY_LIGHT_BLOCK
from greensward.scene import Fog, SceneError
from oracles import fog
from shader_calls import shader_call
from small_scenes import small_scene

_GLSL = "passes/lighting/lighting.glsl"


@pytest.mark.parametrize(("per_m", "level_m", "scale_m"), [(0.02, 0.0, 20.0), (0.3, 5.0, 3.0), (1e-3, -40.0, 1e5)])
def test_extinction_is_the_sum_along_the_ray(device, per_m, level_m, scale_m):
    cases = [(y, rise, far) for y in (0.0, 2.0, 9.0) for rise in (-0.1, 0.0, 1e-4, 0.05, 0.9) for far in (1.0, 60.0)]
    got = shader_call(
        device,
        _GLSL,
        "fogDepth(c.x, vec3(0.0, c.y, 0.0), c.z)",
        {"c": np.array(cases, np.float32)},
        "float",
        blocks={LIGHT_BLOCK: {"fog_per_m": per_m, "fog_level_m": level_m, "fog_scale_m": scale_m}},
    )
    expected = [min(fog.depth(per_m, level_m, scale_m, *case), 80.0) for case in cases]
    assert np.allclose(got, expected, rtol=3e-3)


def test_extinction_stays_finite(device):
    cases = np.array([(-1e5, -1.0, 1e6), (0.0, -1.0, 1e6), (0.0, 1.0, 1e6), (1e5, 0.0, 1e6)], np.float32)
    values = {"fog_per_m": 10.0, "fog_level_m": 0.0, "fog_scale_m": 1.0}
    got = shader_call(
        device, _GLSL, "fogDepth(c.x, vec3(0.0, c.y, 0.0), c.z)", {"c": cases}, "float", blocks={LIGHT_BLOCK: values}
    )
    assert np.isfinite(got).all()
    assert got == pytest.approx([80.0, 80.0, 10.0, 0.0], rel=1e-3)


def test_tint_goes_from_away_to_towards_the_sun(device):
    cosine = np.linspace(-1.0, 1.0, 41)
    rays = np.stack([np.sqrt(1.0 - cosine**2), cosine, 0.0 * cosine], -1)
    away, towards, sky, sun = (np.array(each) for each in ((0.4, 0.5, 0.7), (1.0, 0.8, 0.4), (1, 2, 3), (9, 8, 7)))
    blocks = {
        LIGHT_BLOCK: {
            "to_sun": (0.0, 1.0, 0.0, 0.0),
            "fog_away": (*away, 0.0),
            "fog_towards": (*towards, 0.0),
            "fog_sharpness": 5.0,
            "sun_here": (*sun, 0.0),
        },
        SKY_LIGHT_BLOCK: {"mean": (*sky, 0.0)},
    }
    got = shader_call(device, _GLSL, "fogLight(d)", {"d": rays.astype(np.float32)}, "vec3", blocks=blocks)
    assert np.allclose(got, fog.tint(away, towards, 5.0, cosine, sky, sun), rtol=1e-3)


_KEYS = {
    "density_per_m": 0.2, "level_m": 4.0, "scale_m": 2.0, "away": "#204060", "towards": "#ff2000", "sharpness": 1.0,
}  # fmt: skip


def test_every_key_of_fog_changes_the_picture_and_none_its_truth(renderer):
    towards_sun = {"position_m": [0.0, 1.3, 4.0], "target_m": [6.0, 1.6, 7.0], "far_m": 400.0}

    def drawn(**tables):
        return renderer(small_scene(camera=towards_sun, **tables), size=(96, 54)).render(
            1.0, aovs=["depth", "albedo"]
        )

    base, clear = drawn(fog={"density_per_m": 0.05}), drawn()
    assert _KEYS.keys() == Fog.model_fields.keys()
    for key, value in _KEYS.items():
        other = drawn(fog={"density_per_m": 0.05, key: value})
        assert other.image.tobytes() != base.image.tobytes(), key
        for name in ("depth", "albedo"):
            assert np.array_equal(other.truth[name], clear.truth[name])
    assert drawn(fog={"density_per_m": 0.0}).image.tobytes() == clear.image.tobytes()


def test_fog_hides_the_distance_and_not_what_is_near(renderer):
    frames = [
        renderer(small_scene(sowing={"reach_m": 60.0}, fog=each), size=(160, 90)).render(aovs=["depth"])
        for each in (None, {"density_per_m": 0.025, "scale_m": 1000.0})
    ]
    depth = frames[0].truth["depth"]
    contrast = [np.array([frame.image[where].std() for where in (depth < 3.0, (depth > 60.0) & np.isfinite(depth))])
                for frame in frames]  # fmt: skip
    near, far = contrast[1] / contrast[0]
    assert near > 0.8
    assert far < 0.4


def test_fog_is_as_bright_as_the_light_that_falls_on_it(renderer):
    def shown(elevation_deg: float) -> float:
        scene = small_scene(
            sun={"elevation_deg": elevation_deg}, fog={"density_per_m": 5.0, "scale_m": 1e5}, grass=[]
        )
        made = renderer(scene, size=(32, 18))
        made.render(0.0)
        radiance = np.frombuffer(made._lighting._radiance.read(), np.float16).reshape(-1, 4)[:, :3].astype(float)
        sky = made.light().sky_irradiance([0.0, 1.0, 0.0]).mean() / np.pi
        assert radiance.mean() < 3.0 * sky
        return radiance.mean()

    assert shown(-6.0) < 0.2 * shown(10.0) < 0.2 * shown(50.0)


def test_a_renderer_takes_fog_in_place(renderer):
    drawn = renderer(small_scene(), size=(96, 54))
    scene = small_scene(fog={"density_per_m": 0.1})
    assert drawn.updates_in_place(scene)
    drawn.update(scene)
    assert np.array_equal(drawn.render(1.0).image, renderer(scene, size=(96, 54)).render(1.0).image)


@pytest.mark.parametrize(
    ("keys", "problem"),
    [
        ({"density_per_m": -0.1}, "density_per_m: must be at least 0"),
        ({"scale_m": 0.0}, "scale_m: must be at least 0.1"),
        ({"away": "blue"}, "away: "),
        ({"colour": "#ffffff"}, "colour: unknown key"),
    ],
)
def test_fog_that_cannot_be_is_refused(keys, problem):
    with pytest.raises(SceneError, match=problem):
        Fog(**keys)
