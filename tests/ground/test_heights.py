"""The height raster, alike in Python and GLSL, on the edge and mirrored beyond it."""

import warnings

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from greensward.ground import HeightField
from greensward.ground.ground_gpu import GroundGpu
from greensward.scene import InputError
from shader_calls import shader_call
from small_scenes import NOISE, small_scene, with_pictures

_RANDOM = np.random.default_rng(2)


def _field(rows: int = 5, columns: int = 9, size: tuple[float, float] = (16.0, 6.0)) -> HeightField:
    return HeightField(_RANDOM.uniform(-2, 3, (rows, columns)).astype(np.float32), size)


def _points(count: int, size: tuple[float, float], factor: float) -> np.ndarray:
    return _RANDOM.uniform(-0.5, 0.5, (count, 2)) * np.array(size) * factor


def test_samples_are_met_and_corners_lie_on_corners():
    field = _field()
    x, z = np.linspace(-8, 8, 9), np.linspace(-3, 3, 5)
    assert np.allclose(field.height(x[None, :], z[:, None]), field.heights, atol=1e-6)
    assert field.lowest_m == field.heights.min()
    assert field.highest_m == field.heights.max()
    assert field.cell_m() == (2.0, 1.5)


def test_bilinear_between_samples():
    field = _field()
    p = _points(500, field.size_m, 1.0)
    oracle = RegularGridInterpolator((np.linspace(-3, 3, 5), np.linspace(-8, 8, 9)), field.heights.astype(float))
    assert np.allclose(field.height(p[:, 0], p[:, 1]), oracle(p[:, ::-1]), atol=1e-9)


@pytest.mark.parametrize("times", [1, 2, 3, -2])
def test_mirrored_beyond_the_edge(times):
    field = _field()
    p = _points(200, field.size_m, 1.0)
    folded = p[:, 0] if times % 2 == 0 else -p[:, 0]
    assert np.allclose(field.height(p[:, 0] + 16.0 * times, p[:, 1]), field.height(folded, p[:, 1]))


def test_normal_is_the_slope():
    tilted = HeightField(np.add.outer(np.arange(5) * 0.5, np.arange(9) * 2.0).astype(np.float32), (8.0, 4.0))
    expected = np.array([-2.0, 1.0, -0.5]) / np.sqrt(5.25)
    assert np.allclose(tilted.normal(np.zeros(3), np.array([-0.4, 0.0, 0.7])), expected)


@pytest.mark.parametrize("factor", [1.0, 5.0])
def test_glsl_agrees(device, factor):
    scene = small_scene(ground={**NOISE, "size_m": [70.0, 40.0]})
    field = HeightField.of(scene)
    ground = GroundGpu(device, scene, field)
    p = _points(3000, field.size_m, factor).astype(np.float32)
    height = shader_call(device, "ground/ground.glsl", "groundHeight(p)", {"p": p}, "float", bindings=ground.bindings)
    x, z = p.astype(np.float64).T
    assert np.abs(height - field.height(x, z)).max() < 1e-4 * factor
    normal = shader_call(device, "ground/ground.glsl", "groundNormal(p)", {"p": p}, "vec3", bindings=ground.bindings)
    assert np.abs(normal - field.normal(x, z)).max() < 1e-3 * factor
    assert np.ptp(field.height(x, z)) > 2.0
    ground.release()


def test_maps_cover_the_ground_and_go_on_mirrored(device):
    scene = small_scene(ground={"size_m": [40.0, 20.0]})
    ground = GroundGpu(device, scene, HeightField.of(scene))
    p = np.array([[-20, -10], [20, 10], [0, 0], [22, 0], [-24, 12], [60, 0]], np.float32)
    uv = shader_call(device, "ground/ground.glsl", "mapUv(p)", {"p": p}, "vec2", bindings=ground.bindings)
    assert np.allclose(uv, [[0, 0], [1, 1], [0.5, 0.5], [0.95, 0.5], [0.1, 0.9], [0, 0.5]], atol=1e-6)
    ground.release()


def test_height_range_bounds_what_the_raster_does():
    field = HeightField.of(small_scene(ground=NOISE))
    for size in (0.5, 3.0, 10.0, 10.0):
        corner = _points(2000, field.size_m, 1.5)
        low, high = field.height_range(*corner.T, np.full(len(corner), size))
        inside = np.linspace(0, size, 41)
        heights = field.height(
            corner[:, 0, None, None] + inside[None, None, :], corner[:, 1, None, None] + inside[None, :, None]
        )
        assert (heights.min(axis=(1, 2)) >= low - 1e-6).all()
        assert (heights.max(axis=(1, 2)) <= high + 1e-6).all()


def test_noise_ground_follows_its_settings():
    flat = HeightField.of(small_scene(ground={**NOISE, "height_m": 0.0}))
    assert flat.lowest_m == flat.highest_m == 0.0
    one, same, other = (HeightField.of(small_scene(ground=NOISE, seed=seed)).heights.tobytes() for seed in (5, 5, 6))
    assert one == same != other
    doubled = HeightField.of(small_scene(ground={**NOISE, "height_m": 16.0}))
    assert np.allclose(doubled.heights, 2 * np.frombuffer(one, np.float32).reshape(65, 65))
    assert HeightField.of(small_scene(ground={**NOISE, "size_m": [80.0, 20.0]})).heights.shape == (17, 65)


def test_a_map_beyond_the_driver_is_refused(device):
    scene = small_scene()
    limit = device.limits.texture_px
    wide = HeightField(np.zeros((2, limit + 1), np.float32), (10.0, 10.0))
    with pytest.raises(InputError, match=rf"{limit + 1} × 2 is beyond this driver's {limit}"):
        GroundGpu(device, scene, wide)


def test_mean_density_is_that_of_the_map(device, tmp_path):
    pixels = np.zeros((4, 8, 3), np.uint8)
    pixels[:, :2] = 255
    scene = with_pictures(tmp_path, {"d.png": pixels}, sowing={"density_map": "d.png"})
    ground = GroundGpu(device, scene, HeightField.of(scene))
    assert ground.mean_density == pytest.approx(0.25)
    ground.release()


ENDLESS = {"kind": "endless", "size_m": [60.0, 40.0], "samples": 97, "height_m": 6.0, "wavelength_m": 17.0}


def _both(device, scene, p):
    field = HeightField.of(scene)
    ground = GroundGpu(device, scene, field)
    got = shader_call(device, "ground/ground.glsl", "groundHeight(p)", {"p": p}, "float", bindings=ground.bindings)
    ground.release()
    return field, got


@pytest.mark.parametrize("ground", [ENDLESS, {**NOISE, "beyond": "repeat"}], ids=["endless", "noise"])
def test_repeated_land_is_the_same_again_and_has_no_seam(device, ground):
    scene = small_scene(ground=ground)
    p = _points(400, (60.0, 40.0), 0.5).astype(np.float32)
    field, got = _both(device, scene, p)
    x, z = p.astype(np.float64).T
    size_x, size_z = field.size_m
    heights = field.height(x, z)
    assert np.abs(got - heights).max() < 1e-3
    for k in (-3, 1, 20):
        assert np.allclose(field.height(x + k * size_x, z - k * size_z), heights, atol=1e-9)
    # as steep across the edge as within
    along = np.linspace(-0.5, 0.5, 400)
    steps = np.abs(np.diff(field.height(along * size_x * 0.9, 3.0))).max()
    across = np.abs(np.diff(field.height(0.5 * size_x + along * size_x * 0.9, 3.0))).max()
    assert across < 2.0 * steps
    assert 0.5 * field.heights.max() > 0.2, "it is not flat"


def test_noise_that_repeats_varies_as_much_as_noise_that_does_not():
    plain, repeated = (
        HeightField.of(small_scene(ground={**NOISE, "size_m": [400.0, 400.0], "samples": 257, "beyond": beyond}))
        for beyond in ("mirror", "repeat")
    )
    assert repeated.heights.std() == pytest.approx(plain.heights.std(), rel=0.15)


def test_a_height_map_repeats_by_its_own_number_of_samples(tmp_path, device):
    """A seamless map's last column is one before its first, not the same."""
    wave = 2.0 + np.sin(2 * np.pi * np.arange(32) / 32)
    np.save(tmp_path / "h.npy", np.add.outer(wave, wave).astype(np.float32))
    scene = small_scene(ground={"kind": "heightmap", "file": "h.npy", "size_m": [32.0, 32.0], "beyond": "repeat"})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        p = np.random.default_rng(3).uniform(-80, 80, (300, 2)).astype(np.float32)
        field, got = _both(device, scene.in_folder(tmp_path), p)
    expected = 4.0 + np.sin(2 * np.pi * (p + 16.0) / 32).sum(axis=1)
    assert np.abs(field.height(*p.T.astype(np.float64)) - expected).max() < 0.02
    assert np.abs(got - expected).max() < 0.02


def test_a_seam_is_told_in_metres(tmp_path):
    np.save(tmp_path / "h.npy", np.tile(np.linspace(0.0, 9.0, 64, dtype=np.float32), (64, 1)))
    scene = small_scene(ground={"kind": "heightmap", "file": "h.npy", "beyond": "repeat"}).in_folder(tmp_path)
    with pytest.warns(UserWarning, match=r"^ground: the height map has a seam of 9\.00 m .* west and east") as told:
        HeightField.of(scene)
    assert len(told) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        HeightField.of(scene.model_copy(update={"ground": scene.ground.model_copy(update={"beyond": "mirror"})}))
