"""The papers' forces and state corrections in the shaders, against double precision."""

from types import SimpleNamespace

import numpy as np
import pytest

from greensward.motion.poses import MOTION_BLOCK, motion_values
from greensward.scene import Simulation
from oracles import bezier, forces
from shader_calls import cut, shader_call

_N = 500


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=1, keepdims=True)


@pytest.fixture
def some() -> SimpleNamespace:
    """Blades of all sorts, standing, leaning and lying, at float32 precision."""
    random = np.random.default_rng(8)
    up = _unit(random.normal(size=(_N, 3)))
    front = _unit(np.cross(up, random.normal(size=(_N, 3))))
    height = random.uniform(0.05, 2.0, _N)
    tip = height[:, None] * (up * random.uniform(0.05, 1, (_N, 1)) + front * random.uniform(-1, 1, (_N, 1)))
    values = {
        "up": up, "front": front, "height": height, "tip": tip,
        "wind": random.normal(size=(_N, 3)) * 8, "blast": random.normal(size=(_N, 3)) * 30,
        "bend": random.uniform(0, 1, _N), "pull": _unit(random.normal(size=(_N, 3))),
    }  # fmt: skip
    return SimpleNamespace(**{name: value.astype(np.float32).astype(np.float64) for name, value in values.items()})


def _call(device, some, names: str, body: str, output: str = "vec3", **settings):
    inputs = {name: getattr(some, name).astype(np.float32) for name in names.split()}
    block = {MOTION_BLOCK: motion_values(Simulation(**settings))}
    return shader_call(device, "motion/forces.glsl", body, inputs, output, blocks=block)


def test_gravity(device, some):
    got = _call(device, some, "pull front", "gravity2024(pull, front)", gravity_mps2=9.8, forward=0.25)
    assert np.abs(got - forces.gravity_2024(9.8, 0.25, some.pull, some.front)).max() < 1e-4
    body = "gravity2017(pull, front, height, bend)"
    got = _call(device, some, "pull front height bend", body, gravity_mps2=7.0, forward=0.3)
    assert np.abs(got - forces.gravity_2017(7.0, 0.3, some.pull, some.front, some.height, some.bend)).max() < 1e-4


def test_gravity_pulls_down_to_a_centre_or_between(device, some):
    down = _call(device, some, "tip", "pullAt(tip)")
    assert (down == [0, -1, 0]).all()
    centre = np.array([1.0, -9.0, 3.0])
    got = _call(device, some, "tip", "pullAt(tip)", gravity_centre_m=tuple(centre))
    assert np.abs(got - _unit(centre - some.tip)).max() < 1e-5
    half = _call(device, some, "tip", "pullAt(tip)", gravity_centre_m=tuple(centre), gravity_towards=0.5)
    assert np.abs(half - _unit(0.5 * (_unit(centre - some.tip) + np.array([0, -1, 0])))).max() < 1e-5


def test_recovery(device, some):
    got = _call(device, some, "bend", "recovery2024(bend)", "float", recovery_hz=40.0)
    assert np.allclose(got, some.bend * 40.0, rtol=1e-6)
    got = _call(device, some, "bend", "recovery2017(bend)", "float", recovery_hz=3.0)
    assert np.allclose(got, 3.0 - 0.75 * some.bend, rtol=1e-6)
    assert np.allclose(_call(device, some, "bend", "freedom(bend)", "float"), np.maximum(1 - some.bend, 0.1))


def test_wind_force(device, some):
    body = "windForce(Air(vec4(wind, 0.0), blast), tip, up, height)"
    got = _call(device, some, "wind blast tip up height", body)
    expected = forces.wind_force(some.wind, some.blast, some.tip, some.up, some.height)
    assert np.abs(got - expected).max() < 1e-3
    assert np.abs(expected).max() > 10
    calm = _call(device, some, "tip up height", "windForce(Air(vec4(0.0), vec3(0.0)), tip, up, height)")
    assert (calm == 0).all()


@pytest.mark.parametrize("dt", [0.0, 1e-3, 1 / 60, 1.0, 1e6])
@pytest.mark.parametrize("rate", [0.75, 60.0])
def test_recovery_is_stable_for_any_step(device, some, rate, dt):
    body = f"relaxed(tip, height * up, wind, {rate}, {dt})"
    got = _call(device, some, "tip up height wind", body)
    idle = some.height[:, None] * some.up
    expected = forces.relaxed(some.tip, idle, some.wind, np.full(_N, rate), dt)
    assert np.abs(got - expected).max() < 1e-4
    if dt == 1e-3 and rate < 1:  # for small steps it is what the papers write
        assert np.abs(got - (some.tip + dt * (some.wind + rate * (idle - some.tip)))).max() < 1e-4


_BLADE = "Blade b; b.height = height; vec3 moved = tip, control; correctState(b, up, moved, control);"


def test_state_correction(device, some):
    for part, k in (("control", 0), ("moved", 1)):
        got = _call(device, some, "tip up height", f"{_BLADE} result = {part};")
        assert np.abs(got - forces.correct(some.up, some.height, some.tip)[k]).max() < 2e-4


def test_length_is_exact_for_any_curve(device):
    random = np.random.default_rng(3)
    v1 = random.normal(size=(1000, 3)) * 10 ** random.uniform(-2, 0, (1000, 1))
    v2 = random.normal(size=(1000, 3)) * 10 ** random.uniform(-2, 1, (1000, 1))
    v2[:250] = v1[:250] * random.uniform(-0.2, 2, (250, 1))  # on one line, also folded back
    v2[250:400] = 2 * v1[250:400] + 1e-4 * v2[250:400]
    inputs = {"v1": v1.astype(np.float32), "v2": v2.astype(np.float32)}
    got = shader_call(device, "shaders/bezier.glsl", "arcLength(vec3(0.0), v1, v2)", inputs, "float")
    expected = bezier.true_length(np.zeros_like(v1), v1, v2, 2_000)
    assert np.abs(got / expected - 1).max() < 2e-3


@pytest.mark.parametrize("dt", [1 / 240, 1 / 60, 0.1, 1.0])
def test_swing_is_a_damped_spring(device, some, dt):
    random = np.random.default_rng(4)
    chance = np.round(random.uniform(0, 1, _N) * 65535) / 65535
    stiffness = random.uniform(0, 1, _N)
    source = cut("motion/simulate.comp", "swing")
    set_up = """
        Blade b; b.height = height; b.stiffness = stiffness; b.chance = packUnorm2x16(vec2(0.0, chance));
        vec3 t = tip, v = wind;"""
    inputs = {name: getattr(some, name).astype(np.float32) for name in ("tip", "up", "wind", "height")}
    inputs |= {"chance": chance.astype(np.float32), "stiffness": stiffness.astype(np.float32)}
    expected = forces.swing(some.tip, some.up, some.wind, some.height, stiffness, chance, dt)
    for result, want in zip("tv", expected, strict=True):
        body = f"{set_up} swing(b, up, {dt}, t, v); result = {result};"
        got = shader_call(
            device, "motion/forces.glsl", body, inputs, "vec3", source=f"const float DAMPING = 0.35;\n{source}"
        )
        assert np.abs(got - want).max() < 2e-3 * max(1.0, np.abs(want).max())
