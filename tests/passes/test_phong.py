"""Phong's reflection model: its functions, and every pixel that is drawn, against float64 twins."""

import numpy as np
import pytest

from greensward.passes.light import LIGHT_BLOCK, sun_at_ground, to_sun
from greensward.scene import Phong, SurfaceClass
from greensward.techniques import TECHNIQUES
from oracles import phong
from reprojection import world_points
from shader_calls import shader_call
from small_scenes import small_scene

_PHONG = "passes/lighting/phong.glsl"
_RANDOM = np.random.default_rng(18)


def _directions(count: int) -> np.ndarray:
    n = _RANDOM.normal(size=(count, 3))
    return (n / np.linalg.norm(n, axis=1, keepdims=True)).astype(np.float32)


def test_reflected_light(device):
    n, v, light = (_directions(300) for _ in range(3))
    colour, left = _RANDOM.uniform(0, 1, (300, 3)).astype(np.float32), _RANDOM.uniform(0, 1, 300).astype(np.float32)
    got = shader_call(
        device,
        _PHONG,
        "phong(colour, n, v, l, vec3(9.0, 8.0, 7.0), vec3(0.3, 0.4, 0.6), left)",
        {"colour": colour, "n": n, "v": v, "l": light, "left": left},
        "vec3",
        blocks={LIGHT_BLOCK: {"phong": (0.7, 0.9, 0.3, 11.0)}},
    )
    inputs = (each.astype(np.float64) for each in (colour, n, v, light))
    sun, sky = np.array([9.0, 8.0, 7.0]), np.array([0.3, 0.4, 0.6])
    expected = phong.reflected(*inputs, sun, sky, left.astype(np.float64), (0.7, 0.9, 0.3), 11.0)
    assert np.abs(got - expected).max() < 1e-5
    assert expected.max() > 2.0


def test_ambient_light_below_leaves(device):
    area, depth = np.meshgrid(np.linspace(0, 8, 20), np.linspace(0, 1, 20))
    inputs = {"area": area.ravel().astype(np.float32), "depth": depth.ravel().astype(np.float32)}
    blocks = {LIGHT_BLOCK: {"extinction": 0.6}}
    got = shader_call(device, _PHONG, "ambientLeft(area, depth)", inputs, "float", blocks=blocks)
    assert np.abs(got - phong.ambient_left(area.ravel(), depth.ravel(), 0.6)).max() < 1e-5
    occlusion = 0.2 + 0.8 * (1.0 - inputs["depth"] ** 2)
    got = shader_call(device, _PHONG, "depthBelowTips(open_)", {"open_": occlusion}, "float")
    assert np.abs(got - phong.depth_below_tips(occlusion.astype(np.float64))).max() < 1e-3
    assert np.abs(got - inputs["depth"]).max() < 1e-3


@pytest.mark.parametrize("technique", [each.name for each in TECHNIQUES])
def test_every_pixel_is_lit_as_the_twin_says(renderer, technique):
    """Without shadows, and with hardly any air in between."""
    numbers = {"ambient": 0.8, "diffuse": 0.9, "specular": 0.3, "shininess": 8.0, "extinction": 4.0}
    scene = small_scene(
        technique={"name": technique}, phong=numbers, shadows={"enabled": False}, sky={"haze": 0.0, "clouds": 0.0}
    )
    drawn = renderer(scene)
    truth = drawn.render(1.0, aovs=["class", "depth", "normal", "albedo"]).truth
    grass = truth["class"] == SurfaceClass.GRASS
    assert grass.mean() > 0.1

    def read(texture):
        half = np.frombuffer(texture.read(), np.float16).reshape(texture.height, texture.width, 4)
        return half[::-1][grass].astype(np.float64)

    p = world_points(drawn, scene.camera, np.where(grass, truth["depth"], 1.0))[grass]
    v = drawn._view.camera_ws - p
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    leaf_area = 60.0 * 0.45 * 0.016 / 1.5
    left = phong.ambient_left(leaf_area, phong.depth_below_tips(read(drawn._gbuffer.normal)[:, 2]), 4.0)
    sky = drawn._lighting.sky_light()["mean"][:3].astype(np.float64)
    expected = phong.reflected(
        truth["albedo"][grass].astype(np.float64),
        truth["normal"][grass].astype(np.float64),
        v,
        to_sun(scene),
        sun_at_ground(scene),
        sky,
        left,
        (0.8, 0.9, 0.3),
        8.0,
    )
    got = read(drawn._lighting._radiance)[:, :3]
    assert np.quantile(np.abs(got - expected) / (expected + 0.05), 0.99) < 0.02
    assert np.ptp(left) > 0.15


def test_denser_and_taller_grass_is_darker_at_its_roots_only(renderer):
    def ambient_alone(**sowing):
        scene = small_scene(sowing=sowing, phong={"diffuse": 0.0, "specular": 0.0, "extinction": 2.0})
        drawn = renderer(scene)
        truth = drawn.render(0.0, aovs=["class", "albedo"]).truth
        light = np.frombuffer(drawn._lighting._radiance.read(), np.float16).reshape(90, 160, 4)[::-1, :, 1]
        here = truth["class"] == SurfaceClass.GRASS
        return (light / np.maximum(truth["albedo"][..., 1], 1e-3))[here].astype(np.float64)

    thin, thick = ambient_alone(), ambient_alone(density_per_m2=400.0)
    assert np.quantile(thick, 0.02) < 0.5 * np.quantile(thin, 0.02)
    assert np.quantile(thick, 0.98) == pytest.approx(np.quantile(thin, 0.98), rel=0.1)


def test_numbers_change_in_place_and_the_model_does_not(renderer):
    scene = small_scene(phong={})
    drawn = renderer(scene)
    glossy = scene.model_copy(update={"phong": Phong(specular=1.0)})
    assert drawn.updates_in_place(glossy)
    drawn.update(glossy)
    fresh = renderer(glossy)
    assert np.array_equal(drawn.render(0.0).image, fresh.render(0.0).image)
    assert not drawn.updates_in_place(small_scene())
