"""Functions of `shaders/` against their float64 twins."""

import numpy as np
import pytest

from greensward.ground.noise import hash3 as product_hash3
from greensward.ground.noise import octaves, simplex
from oracles import bezier, hashing, octahedral
from shader_calls import shader_call

_RANDOM = np.random.default_rng(3)


def _words(count: int = 400) -> np.ndarray:
    words = _RANDOM.integers(0, 2**32, (count, 3), dtype=np.uint32)
    words[:4] = [[0, 0, 0], [2**32 - 1] * 3, [2**32 - 1, 0, 1], [1, 2, 2**31]]
    return words


def _unit_vectors(count: int = 500) -> np.ndarray:
    n = _RANDOM.normal(size=(count, 3))
    n[:6] = np.repeat(np.eye(3), 2, axis=0) * np.tile([1.0, -1.0], 3)[:, None]
    return n / np.linalg.norm(n, axis=1, keepdims=True)


def _curves(count: int = 300) -> dict[str, np.ndarray]:
    return {name: _RANDOM.normal(size=(count, 3)).astype(np.float32) for name in ("v0", "v1", "v2")}


def test_hash_is_pcg3d_bit_for_bit(device):
    words = _words()
    expected = hashing.hashes(words)
    assert np.array_equal(shader_call(device, "shaders/hash.glsl", "hash3(v)", {"v": words}, "uvec3"), expected)
    assert np.array_equal(np.stack(product_hash3(*words.T), 1), expected)


def test_unit_is_exact_and_below_one(device):
    words = _words()
    got = shader_call(device, "shaders/hash.glsl", "unit(v)", {"v": words}, "vec3")
    assert np.array_equal(got, hashing.unit(words))
    assert got.max() < 1.0
    single = shader_call(device, "shaders/hash.glsl", "unit(v.x)", {"v": words}, "float")
    assert np.array_equal(single, got[:, 0])


@pytest.mark.parametrize("seed", [0, 1, 4_294_967_295])
@pytest.mark.parametrize("extent", [3.0, 300.0])
def test_simplex_noise(device, seed, extent):
    p = _RANDOM.uniform(-extent, extent, (2000, 2)).astype(np.float32)
    got = shader_call(device, "shaders/noise.glsl", f"simplex(p, {seed}u)", {"p": p}, "float")
    expected = simplex(p[:, 0], p[:, 1], seed)
    assert np.abs(got - expected).max() < 2e-5 * extent
    assert expected.std() > 0.2


@pytest.mark.parametrize(("count", "gain", "lacunarity"), [(1, 0.5, 2.0), (3, 0.6, 2.7), (5, 0.42, 2.1)])
def test_octaves(device, count, gain, lacunarity):
    p = _RANDOM.uniform(-8, 8, (2000, 2)).astype(np.float32)
    call = f"octaves(p, 11u, {count}, {gain}, {lacunarity})"
    got = shader_call(device, "shaders/noise.glsl", call, {"p": p}, "float")
    assert np.abs(got - octaves(p[:, 0], p[:, 1], 11, count, gain, lacunarity)).max() < 2e-3


def test_octahedral_code(device):
    n = _unit_vectors().astype(np.float32)
    coded = shader_call(device, "shaders/octahedral.glsl", "octahedralEncode(n)", {"n": n}, "vec2")
    assert np.abs(coded - octahedral.encode(n.astype(np.float64))).max() < 1e-6
    e = _RANDOM.uniform(-1, 1, (500, 2)).astype(np.float32)
    got = shader_call(device, "shaders/octahedral.glsl", "octahedralDecode(e)", {"e": e}, "vec3")
    assert np.abs(got - octahedral.decode(e.astype(np.float64))).max() < 1e-6
    assert np.abs(octahedral.decode(octahedral.encode(n.astype(np.float64))) - n).max() < 1e-6


def test_bezier_curve(device):
    inputs = _curves() | {"t": _RANDOM.uniform(0, 1, 300).astype(np.float32)}
    exact = [inputs[name].astype(np.float64) for name in ("v0", "v1", "v2", "t")]
    for call, oracle in (("bezierPoint", bezier.point), ("bezierTangent", bezier.tangent)):
        got = shader_call(device, "shaders/bezier.glsl", f"{call}(v0, v1, v2, t)", inputs, "vec3")
        assert np.abs(got - oracle(*exact)).max() < 2e-6


def test_bezier_length_and_keeping_it(device):
    inputs = _curves() | {"height": _RANDOM.uniform(0.1, 2, 300).astype(np.float32)}
    v0, v1, v2, height = (inputs[name].astype(np.float64) for name in ("v0", "v1", "v2", "height"))
    got = shader_call(device, "shaders/bezier.glsl", "bezierLength(v0, v1, v2)", inputs, "float")
    assert np.allclose(got, bezier.approximate_length(v0, v1, v2), rtol=2e-6)
    control, tip = bezier.keep_length(v0, v1, v2, height)
    for name, expected in (("v1", control), ("v2", tip)):
        body = f"correctLength(v0, v1, v2, height); result = {name};"
        got = shader_call(device, "shaders/bezier.glsl", body, inputs, "vec3")
        assert np.abs(got - expected).max() < 1e-4
    assert np.allclose(bezier.true_length(v0, control, tip), height)


def test_keep_length_survives_a_blade_of_no_length(device):
    zero = np.zeros((1, 3), np.float32)
    inputs = {"v0": zero, "v1": zero, "v2": zero}
    body = "correctLength(v0, v1, v2, 0.5); result = v2;"
    assert np.isfinite(shader_call(device, "shaders/bezier.glsl", body, inputs, "vec3")).all()


def test_blade_frame_is_a_right_handed_frame_that_turns_once(device):
    up = _unit_vectors().astype(np.float32)
    facing = _RANDOM.uniform(0, 2 * np.pi, len(up)).astype(np.float32)
    axes = []
    for name in ("front", "side"):
        body = f"vec3 front, side; bladeFrame(up, facing, front, side); result = {name};"
        axes.append(shader_call(device, "shaders/blade.glsl", body, {"up": up, "facing": facing}, "vec3"))
    front, side = axes
    frame = np.stack([side, up, -front], 1)
    assert np.abs(frame @ frame.transpose(0, 2, 1) - np.eye(3)).max() < 1e-5
    assert np.abs(np.cross(up, front) - side).max() < 1e-5
    turned = shader_call(
        device,
        "shaders/blade.glsl",
        "vec3 front, side; bladeFrame(up, facing + 1.0, front, side); result = front;",
        {"up": up, "facing": facing},
        "vec3",
    )
    assert np.abs((turned * front).sum(1) - np.cos(1.0)).max() < 1e-5


def test_pose_survives_its_packing(device):
    inputs = {name: _RANDOM.uniform(-2, 2, (300, 3)).astype(np.float32) for name in ("root", "c", "t")}
    for name, whole in (("control", "c"), ("tip", "t")):
        body = f"vec3 control, tip; unpackPose(packPose(c, t), root, control, tip); result = {name} - root;"
        got = shader_call(device, "shaders/blade.glsl", body, inputs, "vec3")
        assert np.abs(got - inputs[whole]).max() < 2.0 / 1024
        assert np.abs(got).max() > 1.0


def test_surface_colour_has_its_root_taken_and_squared_again():
    """What `emitSurface` codes and `read_truth` decodes; dark greens keep more steps than in linear 8 bits."""
    dark = np.linspace(0.0, 0.02, 50)
    coded = np.round(np.sqrt(dark) * 255) / 255
    assert np.abs(coded**2 - dark).max() < 0.6 / 255 * 2 * np.sqrt(0.02)
    assert len(np.unique(coded)) > len(np.unique(np.round(dark * 255))) * 4
