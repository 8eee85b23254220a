"""Every kind of wind against its formula in double precision, alone and added up."""

import numpy as np
import pytest
from PIL import Image
from pydantic import TypeAdapter

from greensward.ground import HeightField
from greensward.motion import winds as winds_module
from greensward.motion.winds import KINDS, ROWS, WINDS_BLOCK, Winds, absent_kinds, wind_values
from greensward.scene.wind import Wind
from oracles import wind_kinds
from shader_calls import shader_call
from small_scenes import NOISE, small_scene

_RANDOM = np.random.default_rng(16)
_STRONG = {
    "kind": "strong", "direction_deg": 200.0, "power_mps": 9.0, "speed_mps": 5.0, "interval_m": 2.5,
    "steadiness": 0.2,
}  # fmt: skip
_HELICOPTER = {
    "kind": "helicopter", "centre_m": [2.0, -3.0], "radius_m": 5.0, "period_s": 9.0, "rotor_m": 4.0,
    "power_mps": 18.0, "speed_mps": 6.0, "interval_m": 0.8, "steadiness": 0.5,
}  # fmt: skip
_RANDOM_WIND = {"kind": "random", "power_mps": 4.0, "period_s": 3.0}
_WAVES = {"kind": "waves", "direction_deg": 75.0, "speed_mps": 7.0, "rate_hz": 0.3}
_BLAST = {"kind": "blast", "centre_m": [1.0, 2.0, -4.0], "power_mps": 90.0, "rate": 4.0}
_RIPPLES = {
    "kind": "ripples", "direction_deg": 200.0, "speed_mps": 8.0, "wave_m": 5.0, "swell_m": 23.0, "front_m": 9.0,
    "epsilon": 0.1, "rate_hz": 0.4,
}  # fmt: skip
_IDLE = {"kind": "idle", "direction_deg": 300.0, "speed_mps": 2.0, "period_s": 2.6}
_WHIRL = {"kind": "whirl", "centre_m": [-3.0, 1.5, 2.0], "power_mps": 40.0, "swirl_mps": 6.0, "rate": 1.5}


def _points(count: int = 600) -> np.ndarray:
    return _RANDOM.uniform(-15, 15, (count, 3)).astype(np.float32)


def _air(device, winds, p, time_s, part: str = "wind.xyz", seed: int = 5) -> np.ndarray:
    models = tuple(TypeAdapter(Wind).validate_python(w) for w in winds)
    block = {WINDS_BLOCK: wind_values(models, seed)}
    inputs = {"p": p, "phase": _phases(p)}
    return shader_call(device, "motion/wind.glsl", f"windAt(p, phase, {time_s}).{part}", inputs, "vec3", blocks=block)


def _phases(p: np.ndarray) -> np.ndarray:
    return (np.arange(len(p)) / len(p)).astype(np.float32)


def _without_kind(wind: dict[str, object], *names: str) -> list[object]:
    return [wind[name] for name in names]


def _expected(kind: str, p: np.ndarray, t: float) -> np.ndarray:
    match kind:
        case "strong":
            return wind_kinds.strong(
                p, t, *_without_kind(_STRONG, "direction_deg", "power_mps", "speed_mps", "interval_m", "steadiness")
            )
        case "helicopter":
            names = (
                "centre_m", "radius_m", "period_s", "rotor_m", "power_mps", "speed_mps", "interval_m", "steadiness",
            )  # fmt: skip
            return wind_kinds.helicopter(p, t, *_without_kind(_HELICOPTER, *names))
        case "random":
            return wind_kinds.random(p, t, 5, 4.0, 3.0)
        case "waves":
            return wind_kinds.waves(p, t, 75.0, 7.0, 0.3)
        case "ripples":
            return wind_kinds.ripples(p, t, *(value for name, value in _RIPPLES.items() if name != "kind"))
        case "idle":
            return wind_kinds.idle(_phases(p), t, 300.0, 2.0, 2.6)
        case "whirl":
            return wind_kinds.whirl(p, t, _WHIRL["centre_m"], 40.0, 6.0, 1.5)
        case _:
            return wind_kinds.blast(p, t, _BLAST["centre_m"], 90.0, 4.0)


_KINDS = {
    wind["kind"]: wind for wind in (_STRONG, _HELICOPTER, _RANDOM_WIND, _WAVES, _BLAST, _WHIRL, _RIPPLES, _IDLE)
}


@pytest.mark.parametrize("time_s", [0.0, 2.7, -5.0, 100.0])
@pytest.mark.parametrize("kind", _KINDS)
def test_a_wind_is_its_formula(device, kind, time_s):
    p = _points()
    got = _air(device, [_KINDS[kind]], p, time_s, "blast" if kind == "blast" else "wind.xyz")
    expected = _expected(kind, p.astype(np.float64), time_s)
    assert np.abs(got - expected).max() < 1e-3 * max(np.abs(expected).max(), 1.0) * (1 + 0.1 * abs(time_s))
    if not (kind == "random" and time_s == 0):
        assert np.abs(expected).max() > 0.5


@pytest.mark.parametrize("time_s", [0.0, 2.7, 100.0])
def test_the_helicopter_as_published(device, time_s):
    p = _points()
    wind = {**_HELICOPTER, "published": True, "power_mps": 1.5, "interval_m": 20.0}
    names = ("centre_m", "radius_m", "period_s", "power_mps", "speed_mps", "interval_m", "steadiness")
    expected = wind_kinds.helicopter_as_published(p.astype(np.float64), time_s, *_without_kind(wind, *names))
    assert np.abs(_air(device, [wind], p, time_s) - expected).max() < 5e-3 * (1 + 0.02 * time_s)
    assert np.abs(expected).max() > 15.0


def test_ripples_are_as_published_along_the_axes(device):
    """With the formula's own constants c1 = 0.5, c2 = 0.25, c3 = 0.125, eps = 0.1 and t = 0.8 at 1 s."""
    wind = {"kind": "ripples", "speed_mps": 1.0, "wave_m": 4.0, "swell_m": 16.0, "front_m": 4.0, "epsilon": 0.1}
    p = _points()
    x, _, z = p.astype(np.float64).T
    a = np.pi * x + 0.8 + np.pi / 4 / (np.abs(np.cos(0.25 * np.pi * z)) + 0.1)
    got = _air(device, [{**wind, "rate_hz": 0.8 * 0.5 / (2 * np.pi)}], p, 1.0)
    assert np.abs(-got[:, 0] - np.sin(0.5 * a) * np.cos(0.125 * a)).max() < 1e-4
    assert np.abs(got[:, 1:]).max() < 1e-6


def test_ripples_run_with_the_wind(device):
    wind = {**_RIPPLES, "swell_m": 10_000.0}
    p = _points()
    step = (0.5 * 0.4 * 5.0 * wind_kinds.towards(200.0)).astype(np.float32)  # of half a second
    before, after = _air(device, [wind], p, 0.0), _air(device, [wind], p + step, 0.5)
    assert np.abs(before - after).max() < 0.02


def test_ripples_are_as_smooth_far_from_the_origin(device):
    p = np.zeros((2000, 3), np.float32)
    p[:, 0] = 10_240.0 + np.linspace(0, 20, 2000)
    p[:, 2] = -10_240.0
    expected = _expected("ripples", p.astype(np.float64), 3.0)
    assert np.abs(_air(device, [_RIPPLES], p, 3.0) - expected).max() < 0.02


@pytest.mark.parametrize("rides", [False, True])
def test_a_blade_keeps_its_phase(device, rides):
    """Root, tile and rank have no part in the phase; on an object the direction has none either."""
    flags = 64 if rides else 0  # `BladeFlag.ON_OBJECT`
    body = (
        "Blade b = Blade(p.x, p.y, p.z, facing, p.x, p.y, p.z, 1.0, p.x, p.y, p.z, 0.01, 0u, 0.5, "
        f"{flags}u, chance); result = ownPhase(b);"
    )
    random = np.arange(200, dtype=np.uint32) * np.uint32(321)
    facing = np.linspace(0.0, 6.0, 200, dtype=np.float32)

    def phases(rank: int, turned: float) -> np.ndarray:
        inputs = {"p": _points(200), "chance": random << np.uint32(16) | np.uint32(rank), "facing": facing}
        inputs["facing"] = facing + np.float32(turned)
        return shader_call(device, "motion/pose.glsl", body, inputs, "float", defines={"FORM": 0})

    first = phases(7, 0.0)
    assert len(np.unique(first)) == 200
    assert (np.histogram(first, 4, (0, 1))[0] > 25).all()
    assert np.array_equal(first, phases(7, 0.5)) == rides
    if not rides:
        assert np.array_equal(first, phases(900, 0.0))
        assert np.array_equal(first, wind_kinds.phase(random, facing))


@pytest.mark.parametrize("time_s", [0.3, 3e4 + 1 / 3, 1e6 / 3, 2e6 + 0.9])
def test_idle_wind_is_as_exact_as_its_time(device, time_s):
    """It errs by no more than single precision does in the time."""
    p, step_s = _points(100), float(np.spacing(np.float32(time_s)))
    time_s, period = (float(np.float32(value)) for value in (time_s, 2.6))
    expected = wind_kinds.idle(_phases(p), time_s, 300.0, 2.0, period)
    assert np.abs(_air(device, [_IDLE], p, time_s) - expected).max() < 2.0 * 2.0 * np.pi / period * step_s + 1e-4


def test_by_default_idle_wind_blows_as_published():
    row = np.asarray(wind_values((TypeAdapter(Wind).validate_python({"kind": "idle"}),), 1)["rows"])[0]
    assert np.allclose(row[1:3], np.sqrt(0.5))  # along (1, 0, 1)


def test_only_a_blast_pushes_whatever_the_blade_does(device):
    p = _points(50)
    for kind, wind in _KINDS.items():
        blast = np.abs(_air(device, [wind], p, 1.0, "blast")).max()
        assert (blast > 1.0) == (kind == "blast")


def test_all_kinds_add_up(device):
    p = _points()
    winds = [_STRONG, _HELICOPTER, _WAVES, _WHIRL]
    expected = sum(_expected(str(wind["kind"]), p.astype(np.float64), 1.5) for wind in winds)
    assert np.abs(_air(device, winds, p, 1.5) - expected).max() < 0.05


@pytest.mark.parametrize("kind", KINDS)
def test_a_struct_has_a_member_for_each_number(kind):
    """A number that does not fit would be read from the next wind's rows."""
    wind = kind(files=("a.png",)) if kind.__name__ == "Texture" else kind()
    _, _, members = winds_module._GLSL[kind]
    width = sum(1 if of == "float" else int(of[-1]) for _, of in members)
    assert len(winds_module._numbers(wind, None, 0, np.zeros(3))) == width < 4 * ROWS


@pytest.mark.parametrize("kind", _KINDS)
def test_kinds_that_a_scene_has_not_are_left_out_and_the_others_stay(device, kind):
    p, model = _points(50), TypeAdapter(Wind).validate_python(_KINDS[kind])
    results = [
        shader_call(
            device,
            "motion/wind.glsl",
            "windAt(p, 0.0, 1.0).wind.xyz + windAt(p, 0.0, 1.0).blast",
            {"p": p},
            "vec3",
            blocks={WINDS_BLOCK: wind_values((model,), 5)},
            defines=absent_kinds(present),
        )
        for present in (([model]), [each() for each in KINDS if each.__name__ != "Texture"], [])
    ]
    assert np.array_equal(results[0], results[1])
    assert np.abs(results[0]).max() > 0.5
    assert not results[2].any()


def test_centres_stand_above_the_ground():
    scene = small_scene(ground=NOISE, wind=[_BLAST])
    heights = HeightField.of(scene)
    rows = np.asarray(wind_values(scene.wind, 1, heights)["rows"])
    assert rows[0, 2] == pytest.approx(2.0 + float(heights.height(1.0, -4.0)), abs=1e-4)


@pytest.fixture(params=[{}])
def painted(device, tmp_path, request):
    """Velocities (n, 3) of a wind of two pictures, the second half the size of the first."""
    first, second = np.full((4, 8, 3), 128, np.uint8), np.full((2, 4, 3), 128, np.uint8)
    first[:, 4:, 0] = 255  # the eastern half blows east
    second[..., 1] = 1  # blows north
    for name, picture in (("a.png", first), ("b.png", second)):
        Image.fromarray(picture).save(tmp_path / name)
    wind = {"kind": "texture", "files": ["a.png", "b.png"], "size_m": [16.0, 8.0], "speed_mps": 6.0, "rate_hz": 2.0}
    scene = small_scene(wind=[{**wind, **request.param}]).in_folder(tmp_path)
    winds = Winds(device, scene, HeightField.of(scene))

    def at(p: np.ndarray, time_s: float) -> np.ndarray:
        call = f"windAt(p, 0.0, {time_s}).wind.xyz"
        return shader_call(device, "motion/wind.glsl", call, {"p": p}, "vec3", bindings=winds.bindings)

    yield at
    winds.release()


@pytest.mark.parametrize("painted", [{"moves_mps": [3.0, -1.0], "rate_hz": 1e-6}], indirect=True)
def test_painted_wind_moves_over_the_ground(painted):
    """The wind at the edge of the eastern half is found again where that has moved."""
    edge = np.array([[0.7, 0, 0.1], [-0.7, 0, 0.1]], np.float32)
    moved = edge + np.array([6.0, 0, -2.0], np.float32)
    assert painted(edge, 0.0)[0, 0] > painted(edge, 0.0)[1, 0] + 3.0
    assert np.allclose(painted(moved, 2.0), painted(edge, 0.0), atol=0.01)


def test_painted_wind_blows_where_it_is_painted(painted):
    east, west = np.array([[3.0, 0, 0]], np.float32), np.array([[-5.0, 0, 1.0]], np.float32)
    assert np.allclose(painted(east, 0.0), [[6.0, 0, 0]], atol=0.01)
    assert np.allclose(painted(west, 0.0), [[0, 0, 0]], atol=0.01)
    assert np.allclose(painted(west, 0.5), [[0, 0, -6.0]], atol=0.01)
    assert np.allclose(painted(east, 0.25), [[3.0, 0, -3.0]], atol=0.02)  # half-way from one to the next
    assert np.allclose(painted(east, 7.0), painted(east, 0.0))  # over and over
    assert np.allclose(
        painted(east + np.float32(16) * np.array([1, 0, 0], np.float32), 0.0), [[6.0, 0, 0]], atol=0.01
    )
