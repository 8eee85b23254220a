"""Wind, and how blades stand in it: formulas, and what must hold for every blade at every instant."""

import numpy as np
import pytest

from blades import points, read_blades, read_poses, up_of
from greensward.motion.winds import WINDS_BLOCK, wind_values
from greensward.scene import Gusts
from oracles import bezier, wind
from shader_calls import shader_call
from small_scenes import GRASS, NOISE, small_scene

_RANDOM = np.random.default_rng(6)
_GUSTY = {"direction_deg": 250.0, "speed_mps": 6.0, "gustiness": 0.8, "gust_m": 4.0, "turbulence": 0.6}


def _points(count: int = 800, extent: float = 30.0) -> np.ndarray:
    return _RANDOM.uniform(-extent, extent, (count, 3)).astype(np.float32)


def _wind_at(device, winds: list[dict[str, float]], p: np.ndarray, time_s: float, seed: int = 5) -> np.ndarray:
    block = {WINDS_BLOCK: wind_values(tuple(Gusts(**w) for w in winds), seed)}
    return shader_call(device, "motion/wind.glsl", f"windAt(p, 0.0, {time_s}).wind", {"p": p}, "vec4", blocks=block)


@pytest.mark.parametrize("time_s", [0.0, 7.3, -4.0, 300.0])
@pytest.mark.parametrize("change", [{}, {"direction_deg": 0.0}, {"gustiness": 0.0}, {"turbulence": 0.0}])
def test_gusts(device, change, time_s):
    p = _points()
    got = _wind_at(device, [{**_GUSTY, **change}], p, time_s)
    expected = wind.gusts({**_GUSTY, **change}, 5, p.astype(np.float64), time_s)
    assert np.abs(got - expected).max() < 2e-3 * (1 + abs(time_s))
    assert np.abs(expected).max() > 3


def test_winds_add_up(device):
    p, breeze = _points(), {**_GUSTY, "direction_deg": 90.0, "speed_mps": 2.0}
    both = _wind_at(device, [_GUSTY, breeze], p, 2.0)
    expected = wind.gusts(_GUSTY, 5, p.astype(np.float64), 2.0) + wind.gusts(
        breeze, 5 + 97, p.astype(np.float64), 2.0
    )
    assert np.abs(both - expected).max() < 2e-3
    assert (_wind_at(device, [], p, 2.0) == 0).all()


@pytest.mark.parametrize(("from_deg", "towards"), [(0, (0, 1)), (90, (-1, 0)), (180, (0, -1)), (270, (1, 0))])
def test_wind_comes_from_where_a_weather_report_says(device, from_deg, towards):
    calm = {"direction_deg": float(from_deg), "speed_mps": 5.0, "gustiness": 0.0, "turbulence": 0.0}
    got = _wind_at(device, [calm], _points(), 1.0)
    assert np.allclose(got[:, [0, 2]], 5.0 * np.array(towards), atol=1e-4)
    assert (got[:, [1, 3]] == 0).all()


def test_gusts_travel_downwind(device):
    p, step_s = _points(4000), 0.25
    travelled = 6.0 * step_s * np.array([np.sin(np.radians(70)), 0, -np.cos(np.radians(70))], np.float32)
    before = np.linalg.norm(_wind_at(device, [_GUSTY], p, 1.0)[:, :3], axis=1)
    after = {
        shift: np.linalg.norm(
            _wind_at(device, [_GUSTY], (p + shift * travelled).astype(np.float32), 1.0 + step_s)[:, :3], axis=1
        )
        for shift in (-1, 0, 1)
    }
    alike = {shift: np.corrcoef(before, speed)[0, 1] for shift, speed in after.items()}
    assert alike[1] > 0.95
    assert alike[1] > alike[0] + 0.05 > alike[-1]


def test_mean_speed_and_steadiness(device):
    p = _points(20_000, 300.0)
    speed = {
        gustiness: np.linalg.norm(
            _wind_at(device, [{**_GUSTY, "gustiness": gustiness, "turbulence": 0.0}], p, 0.0)[:, :3], axis=1
        )
        for gustiness in (0.0, 0.5, 1.0)
    }
    assert np.ptp(speed[0.0]) < 1e-4
    assert 0.0 < speed[0.5].std() < speed[1.0].std()
    for each in speed.values():
        assert each.mean() == pytest.approx(6.0, rel=0.15)


def test_lean(device):
    speed = np.tile(np.linspace(0, 100, 60, dtype=np.float32), 3)
    stiffness = np.repeat(np.array([0.0, 0.5, 1.0], np.float32), 60)
    inputs = {"speed": speed, "stiffness": stiffness}
    got = shader_call(device, "motion/pose.glsl", "leanAt(speed, stiffness)", inputs, "float")
    assert np.allclose(got, wind.lean(speed.astype(np.float64), stiffness.astype(np.float64)), atol=1e-5)
    by_stiffness = got.reshape(3, 60)
    assert (np.diff(by_stiffness, axis=1) > 0).all()
    assert (np.diff(by_stiffness[:, 1:], axis=0) < 0).all()
    assert by_stiffness[:, 0] == pytest.approx(0.0)
    assert got.max() < np.pi / 2


@pytest.fixture
def stand(renderer):
    """Rest blades, and their poses in a wind at a time as the package computes them."""

    def at(time_s: float, winds: list[dict[str, object]], **tables):
        scene = small_scene(wind=winds, sowing={"full_density_m": 12.0, "density_per_m2": 20.0}, **tables)
        # from above the whole field is seen, and so every blade has a pose
        high = scene.camera.model_copy(
            update={"position_m": (0.0, 11.0, 0.1), "target_m": (0.0, 0.0, 0.0), "fov_y_deg": 120.0}
        )
        drawn = renderer(scene.model_copy(update={"camera": high}))
        drawn.render(time_s)
        (page,) = drawn._world.field.pages
        blades, poses = read_blades(drawn._world.field), read_poses(page)
        below = np.linalg.norm(blades["root"][:, [0, 2]], axis=1) < 4.0
        assert below.sum() > 500
        return blades[below], poses[below]

    return at


@pytest.mark.parametrize("time_s", [0.0, 3.7, 1e5])
def test_without_wind_every_blade_rests(stand, time_s):
    blades, poses = stand(time_s, [])
    root, control, tip = points(blades)
    rest = np.stack([control - root, tip - root], 1)[:, None]
    # half floats of what is at most 0.6
    assert np.abs(poses - rest).max() < 3e-4


@pytest.mark.parametrize("time_s", [0.5, 12.0])
def test_pose_is_the_formula(stand, time_s):
    blades, poses = stand(time_s, [_GUSTY], ground=NOISE)
    root, control, tip = points(blades)
    there = wind.gusts(_GUSTY, 5, root, time_s)
    values = (blades["height"], blades["stiffness"], blades["random"] / 65535.0)
    v1, v2 = wind.stand(root, control, tip, up_of(blades), *(v.astype(np.float64) for v in values), there, time_s)
    expected = np.stack([v1 - root, v2 - root], 1)
    # the random phase has 16 bits, and a blade at the turning point of its clearance may go either way
    assert np.quantile(np.abs(poses[:, 0] - expected), 0.99) < 2e-3
    assert np.abs(poses[:, 0] - expected).max() < 0.02
    assert np.abs(v2 - tip).max() > 0.1


@pytest.mark.parametrize("speed", [0.0, 1.0, 10.0, 100.0, 200.0])
@pytest.mark.parametrize("wild", [False, True])
def test_length_is_kept_and_no_tip_is_below_its_ground(stand, speed, wild):
    wildest = {"stiffness": [0.0, 1.0], "tilt_deg": [0.0, 85.0], "bend": [0.0, 1.0]}
    grass = [{**GRASS, **wildest} if wild else GRASS]
    blades, poses = stand(77.0, [{**_GUSTY, "speed_mps": speed, "turbulence": 1.0}], ground=NOISE, grass=grass)
    assert np.isfinite(poses).all()
    up = up_of(blades)
    origin = np.zeros((len(blades), 3))
    for when in (0, 1):
        v1, v2 = poses[:, when, 0], poses[:, when, 1]
        assert ((v2 * up).sum(1) > 0).all()
        assert ((v1 * up).sum(1) > 0).all()
        ratio = bezier.true_length(origin, v1, v2) / blades["height"]
        assert np.abs(ratio - 1).max() < 0.01


def test_blades_lean_downwind_and_more_in_a_storm(stand):
    towards = np.array([np.sin(np.radians(70)), 0, -np.cos(np.radians(70))])
    lean = []
    for speed in (0.0, 4.0, 40.0):
        blades, poses = stand(1.0, [{**_GUSTY, "speed_mps": speed}])
        lean.append((poses[:, 0, 1] @ towards / blades["height"]).mean())
    assert lean[0] + 0.05 < lean[1] < lean[2] - 0.1


def test_previous_pose_is_that_of_the_previous_instant(renderer):
    drawn = renderer(small_scene(wind=[_GUSTY | {"kind": "gusts"}]))
    drawn.render(1.0)
    (page,) = drawn._world.field.pages
    first = read_poses(page)
    drawn.render(1.5)
    second = read_poses(page)
    seen = np.abs(first[:, 0]).sum((1, 2)) > 0
    assert seen.sum() > 500
    assert np.array_equal(second[seen, 1], first[seen, 0])
    assert np.abs(second[seen, 0] - second[seen, 1]).max() > 0.005


@pytest.mark.parametrize("time_s", [1e6, -1e9])
def test_far_instants_are_drawn_too(stand, time_s):
    _, poses = stand(time_s, [_GUSTY])
    assert np.isfinite(poses).all()
