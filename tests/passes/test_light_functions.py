"""Sky, light and tone: the shaders' functions against their float64 twins."""

import math

import numpy as np
import pytest

from greensward.passes.light import LIGHT_BLOCK, sun_at_ground, to_sun
from greensward.passes.sky import SKY_LIGHT_BLOCK, sh_basis
from oracles import air, harmonics, light, tone
from shader_calls import shader_call
from small_scenes import small_scene

_AIR = "passes/sky/air.glsl"
_RANDOM = np.random.default_rng(4)


def _directions(count: int = 60) -> np.ndarray:
    n = _RANDOM.normal(size=(count, 3))
    return (n / np.linalg.norm(n, axis=1, keepdims=True)).astype(np.float32)


@pytest.mark.parametrize("name", ["rayleigh", "mie"])
def test_phase(device, name):
    mu = np.linspace(-1, 1, 101, dtype=np.float32)
    oracle = {"rayleigh": air.rayleigh_phase, "mie": air.mie_phase}[name]
    got = shader_call(device, _AIR, f"{name}Phase(mu)", {"mu": mu}, "float")
    assert np.allclose(got, oracle(mu.astype(np.float64)), rtol=1e-4)
    fine = np.linspace(-1, 1, 20_001)
    assert np.trapezoid(oracle(fine), fine) * 2 * np.pi == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("haze", [0.0, 1.0, 5.0])
@pytest.mark.parametrize("elevation_deg", [1.0, 5.0, 18.0, 60.0, 90.0])
def test_sun_through_air(device, elevation_deg, haze):
    expected = air.transmittance(0.3, math.sin(math.radians(elevation_deg)), haze)
    scene = small_scene(sun={"elevation_deg": elevation_deg, "azimuth_deg": 0.0}, sky={"haze": haze})
    product = sun_at_ground(scene) / (np.array([1.0, 0.97, 0.93]) * 20.0)
    assert np.abs(product - expected).max() < 0.02
    shader = shader_call(
        device,
        _AIR,
        "sunThroughAir(vec3(0.0, EARTH_KM + 0.3, 0.0), d)",
        {"d": to_sun(scene)[None].astype(np.float32)},
        "vec3",
        blocks={LIGHT_BLOCK: {"haze": haze}},
    )
    assert np.abs(shader[0] - expected).max() < 0.02


def test_no_sun_through_the_earth(device):
    scene = small_scene(sun={"elevation_deg": -8.0})
    assert (sun_at_ground(scene) == 0).all()
    got = shader_call(
        device,
        _AIR,
        "sunThroughAir(vec3(0.0, EARTH_KM + 0.3, 0.0), d)",
        {"d": to_sun(scene)[None].astype(np.float32)},
        "vec3",
        blocks={LIGHT_BLOCK: {"haze": 1.0}},
    )
    assert (got == 0).all()


@pytest.mark.parametrize(
    ("azimuth", "expected"), [(0, (0, 0, -1)), (90, (1, 0, 0)), (180, (0, 0, 1)), (270, (-1, 0, 0))]
)
def test_azimuth_is_clockwise_from_north(azimuth, expected):
    assert to_sun(small_scene(sun={"azimuth_deg": azimuth, "elevation_deg": 0.0})) == pytest.approx(expected)


def test_harmonics_are_orthonormal_and_as_the_paper_has_them():
    directions, solid = light.sphere()
    basis = sh_basis(directions)
    assert np.abs(basis - harmonics.basis(directions)).max() < 1e-5
    assert np.abs((basis * solid[:, None]).T @ basis - np.eye(9)).max() < 1e-3


def test_sky_irradiance(device):
    coefficients = _RANDOM.uniform(-0.3, 0.3, (9, 3))
    coefficients[0] = 3.0
    normals = _directions()
    got = shader_call(
        device,
        "passes/lighting/lighting.glsl",
        "skyIrradiance(n)",
        {"n": normals},
        "vec3",
        blocks={SKY_LIGHT_BLOCK: {"sh": np.pad(coefficients, ((0, 0), (0, 1)))}},
    )
    expected = light.irradiance(coefficients, normals.astype(np.float64))
    assert np.abs(got - expected).max() < 2e-3 * expected.max()
    assert np.ptp(expected) > 0.2


def test_gloss(device):
    n, v = _directions(200), _directions(200)
    v *= np.sign((n * v).sum(1, keepdims=True))
    sun = _directions(200)
    roughness = _RANDOM.uniform(0.1, 1.0, 200).astype(np.float32)
    inputs = {"n": n, "v": v, "l": sun, "roughness": roughness}
    got = shader_call(device, "passes/lighting/lighting.glsl", "gloss(n, v, l, roughness)", inputs, "float")
    expected = light.ggx(*(a.astype(np.float64) for a in (n, v, sun, roughness)))
    assert np.allclose(got, expected, rtol=2e-3, atol=1e-5)
    assert (got[(n * sun).sum(1) < 0] == 0).all()


def test_filmic_curve(device):
    x = np.linspace(0, 40, 400, dtype=np.float32)[:, None] * np.ones(3, np.float32)
    got = shader_call(device, "passes/post/tone.glsl", "hable(x)", {"x": x}, "vec3")
    assert np.abs(got - tone.hable(x.astype(np.float64))).max() < 1e-5
    assert (np.diff(got[:, 0]) > 0).all()
    assert got[0, 0] == pytest.approx(0.0, abs=1e-6)


def _exposure(device, elevation_deg, strength, sky, exposure_ev=0.0):
    scene = small_scene(sun={"elevation_deg": elevation_deg, "strength": strength})
    values = {"to_sun": (*to_sun(scene), 0.0), "sun_here": (*sun_at_ground(scene), 0.0), "exposure_ev": exposure_ev}
    up = {"up": np.array([sky], np.float32)}
    return shader_call(
        device, "passes/sky/ambient.comp", "exposureFor(up)", up, "float", blocks={LIGHT_BLOCK: values}
    )[0]


@pytest.mark.parametrize("elevation_deg", [2.0, 18.0, 60.0])
def test_exposure_adapts_to_the_light_but_not_wholly(device, elevation_deg):
    """Ten times the light: the picture gets brighter, but by far less than ten times."""
    sky = np.array([0.5, 0.6, 0.9])
    dim, bright = (_exposure(device, elevation_deg, strength, strength * sky) for strength in (1.0, 10.0))
    assert 1.2 < 10.0 * bright / dim < 2.5
    assert _exposure(device, elevation_deg, 1.0, sky, 2.0) == pytest.approx(4 * dim)
    sun = sun_at_ground(small_scene(sun={"elevation_deg": elevation_deg}))
    assert dim == pytest.approx(light.exposure(sun, sky, elevation_deg), rel=1e-4)


def test_exposure_without_any_light_is_finite(device):
    assert 0 < _exposure(device, -10.0, 1.0, np.zeros(3)) < 1e9


def test_the_light_of_the_sky_is_that_of_its_table(renderer):
    drawn = renderer(small_scene())
    sky = drawn._lighting._sky
    table = np.frombuffer(sky._table.read(), np.float32).reshape(128, 256, 4)[..., :3].astype(np.float64)
    v = (np.arange(128) + 0.5) / 64.0 - 1.0
    elevation, azimuth = np.sign(v) * v * v * np.pi / 2.0, (np.arange(256) + 0.5) / 128.0 * np.pi
    level, up = np.cos(elevation)[:, None], np.sin(elevation)[:, None] * np.ones(256)
    directions = np.stack([level * np.cos(azimuth), up, level * np.sin(azimuth)], -1)
    solid = np.cos(elevation) * np.abs(v) * np.pi * (2.0 / 128.0) * (2.0 * np.pi / 256.0)
    expected = np.einsum("hwk,hwc,h->kc", sh_basis(directions), table, solid)
    assert np.abs(drawn.light().sky_harmonics - expected).max() < 2e-4 * np.abs(expected).max()
    up = drawn.light().sky_irradiance([[0.0, 1.0, 0.0]])[0]
    assert np.allclose(up, light.irradiance(expected, np.array([[0.0, 1.0, 0.0]]))[0], rtol=1e-3)
    assert np.allclose(sky.read()["mean"][:3] * np.pi, up, rtol=1e-3)
