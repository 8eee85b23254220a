"""Simulated blades: stable at any extreme, pressed by what rolls over them, and the same bits every time."""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
import pytest

from blades import points, poses_of, read_blades, read_poses, read_states, up_of
from greensward.renderer import Renderer
from greensward.scene import InputError, Scene
from oracles import bezier
from small_scenes import BREEZE, GRASS, small_scene

FORMS = ("natural", "yan2024", "jahrmann2017")
_STORM = {"kind": "gusts", "speed_mps": 100.0, "gustiness": 1.0, "turbulence": 1.0}
_NOTHING: Mapping[str, object] = {}
_WIND = {"natural": BREEZE, "yan2024": {"kind": "strong"}, "jahrmann2017": {"kind": "waves"}}
_UPRIGHT = {**GRASS, "tilt_deg": [0.0, 5.0], "bend": [0.0, 0.1]}


def _field(
    form: str = "natural", *, settle_s: float = 0.3, simulation: Mapping[str, object] = _NOTHING, **tables
) -> Scene:
    """A thousand blades or so, all seen from above."""
    return small_scene(
        **{
            "sowing": {"full_density_m": 12.0, "density_per_m2": 30.0, "reach_m": 9.0},
            "simulation": {"form": form, "settle_s": settle_s, **simulation},
            "camera": {"position_m": [0.0, 7.0, 0.1], "target_m": [0.0, 0.0, 0.0], "fov_y_deg": 100.0},
            "shadows": {"enabled": False},
            **tables,
        }
    )


def _ball(**keys: object) -> dict[str, object]:
    return {"kind": "sphere", "position_m": [0.0, 0.0, 0.0], "size_m": [1.0, 1.0, 1.0], **keys}


def _check_shapes(drawn: Renderer) -> None:
    """Every blade is finite, as long as it grew, and above its ground."""
    world = drawn._world
    blades = read_blades(world.field)
    poses = np.concatenate([read_poses(page) for page in world.field.pages])
    assert np.isfinite(poses).all()
    states = read_states(world)
    assert all(np.isfinite(states[name]).all() for name in ("tip", "velocity", "pressed"))
    up, origin = up_of(blades), np.zeros((len(blades), 3))
    for when in (0, 1):
        v1, v2 = poses[:, when, 0], poses[:, when, 1]
        assert ((v2 * up).sum(1) > -2e-3).all()
        ratio = bezier.true_length(origin, v1, v2) / blades["height"]
        assert np.abs(ratio - 1).max() < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    "winds",
    [
        [_STORM],
        [{"kind": "strong", "power_mps": 200.0, "steadiness": 1.0}],
        [{"kind": "blast", "power_mps": 200.0}, {"kind": "whirl"}],
        [],
    ],
)
def test_nothing_explodes(renderer, form, winds):
    wild = {**GRASS, "stiffness": [0.0, 1.0], "tilt_deg": [0.0, 85.0], "bend": [0.0, 1.0]}
    scene = _field(form, wind=winds, grass=[wild], object=[_ball()], simulation={"step_s": 0.1})
    drawn = renderer(scene)
    for time_s in (0.0, 0.01, 1.01, 3.5):
        drawn.advance(time_s)
        _check_shapes(drawn)


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMS)
def test_state_does_not_depend_on_the_frame_rate(renderer, form):
    scene = _field(form, wind=[_WIND[form]], simulation={"step_s": 0.02})
    states = []
    for frames in (1, 3, 50):
        drawn = renderer(scene)
        drawn.advance(0.0)
        for i in range(frames):
            drawn.advance((i + 1) / frames)
        states.append(read_states(drawn._world))
    for other in states[1:]:
        assert np.abs(states[0]["tip"] - other["tip"]).max() < 1e-4
    assert np.abs(states[0]["tip"]).max() > 0.1


def test_between_two_steps_the_grass_moves_on(renderer):
    drawn = renderer(_field(wind=[BREEZE], simulation={"step_s": 0.1}))
    seen = []
    for time_s in (0.0, 0.03, 0.06, 0.09):
        drawn.advance(time_s)
        seen.append(read_poses(drawn._world.field.pages[0])[:, 0, 1])
    steps = [np.abs(b - a).mean() for a, b in pairwise(seen)]
    assert min(steps) > 1e-5
    assert max(steps) < 4 * min(steps)


@pytest.mark.parametrize("form", FORMS)
def test_the_same_frames_twice(renderer, form):
    scene = _field(form, wind=[_WIND[form]], object=[_ball(path=_PATH)])
    runs = []
    for _ in range(2):
        drawn = renderer(scene)
        runs.append([drawn.render(t).image for t in (0.0, 0.1, 0.4)])
    for a, b in zip(*runs, strict=True):
        assert np.array_equal(a, b)
    assert not np.array_equal(runs[0][0], runs[0][2])


_PATH = {"times_s": [0.0, 1.0], "positions_m": [[-3.0, 0.0, 0.0], [3.0, 0.0, 0.0]], "smooth": False}


def _under(drawn: Renderer, x: float) -> np.ndarray:
    """Blades whose roots a ball of radius 0.5 has rolled over that passed along the x axis, near x."""
    root, _, _ = points(read_blades(drawn._world.field))
    return (np.abs(root[:, 2]) < 0.3) & (np.abs(root[:, 0] - x) < 0.7)


def test_a_trail_stays_and_closes(renderer):
    scene = _field(wind=[], grass=[_UPRIGHT], object=[_ball(path=_PATH)], simulation={"rise_s": 2.0})
    drawn = renderer(scene)
    blades = read_blades(drawn._world.field) if drawn.blades else None
    drawn.advance(0.0)
    blades = read_blades(drawn._world.field)
    under = _under(drawn, 0.0)
    assert under.sum() > 15

    def height() -> np.ndarray:
        tips = read_poses(drawn._world.field.pages[0])[:, 0, 1]
        return (tips * up_of(blades)).sum(1) / blades["height"]

    standing = height()[under].mean()
    for frame in range(1, 31):
        drawn.advance(frame / 30)
    pressed = height()[under].mean()
    drawn.advance(1.5)
    soon = height()[under].mean()
    for frame in range(46, 30 * 9, 5):
        drawn.advance(frame / 30)
    late = height()[under].mean()
    assert standing > 0.85
    assert pressed < 0.65 * standing
    assert soon < 0.8 * standing
    assert late > 0.95 * standing
    far = np.abs(points(blades)[0][:, 2]) > 2.0
    assert np.abs(height()[far].mean() - standing) < 0.05


@pytest.mark.parametrize("form", FORMS)
def test_no_tip_stays_inside_a_ball(renderer, form):
    drawn = renderer(_field(form, wind=[], object=[_ball(position_m=[0.5, 0.0, 0.0], clears=False)], settle_s=2.0))
    drawn.render(0.0)
    blades = read_blades(drawn._world.field)
    tips = points(blades)[0] + read_poses(drawn._world.field.pages[0])[:, 0, 1]
    depth = 0.5 - np.linalg.norm(tips - [0.5, 0.5, 0.0], axis=1)
    rest = 0.5 - np.linalg.norm(points(blades)[2] - [0.5, 0.5, 0.0], axis=1)
    assert (rest > 0.05).sum() > 5
    # the blade's own length may hold the last of them back
    assert (depth > 0.05).sum() < 0.25 * (rest > 0.05).sum()


@pytest.mark.slow
@pytest.mark.parametrize(
    "thing",
    [
        {"kind": "capsule", "radius_m": 0.4, "length_m": 2.0, "roll_deg": 90.0},
        {"kind": "box", "size_m": [1.0, 0.5, 1.0]},
        {"kind": "cylinder", "size_m": [1.0, 0.5, 1.0]},
    ],
)
def test_every_solid_presses(renderer, thing):
    def heights(**tables: object) -> np.ndarray:
        drawn = renderer(_field(wind=[], grass=[_UPRIGHT], settle_s=1.0, **tables))
        drawn.render(0.0)
        return read_poses(drawn._world.field.pages[0])[:, 0, 1, 1]

    free, pressed = heights(), heights(object=[{**thing, "position_m": [0.0, 0.1, 0.0], "clears": False}])
    assert (pressed < 0.8 * free).sum() > 10
    ignored = heights(object=[{**thing, "position_m": [0.0, 0.1, 0.0], "clears": False, "collides": False}])
    assert np.array_equal(ignored, free)


def test_many_colliders_in_one_cell_are_all_felt(renderer):
    """Forty boxes of 64 balls each, that reach beside the ground but not above it, leave time for the last ball."""
    crowd = [_ball(kind="box", size_m=[0.6, 0.6, 0.6], position_m=[0.3, -0.9, 0.0]) for _ in range(40)]
    last = _ball(size_m=[0.6, 0.6, 0.6], position_m=[0.3, 0.0, 0.0])
    poses = []
    for things in ([last], [*crowd, last]):
        drawn = renderer(_field(wind=[], object=things, settle_s=1.0))
        drawn.render(0.0)
        poses.append(read_poses(drawn._world.field.pages[0])[:, 0])
    colliders = drawn._world._colliders
    assert colliders.count > 1000
    assert colliders.most_steps < 30
    assert np.array_equal(*poses)


def test_state_survives_a_field_that_is_sown_anew(renderer):
    scene = _field(wind=[], grass=[_UPRIGHT], object=[_ball(path=_PATH)], simulation={"rise_s": 100.0})
    drawn = renderer(scene)
    for frame in range(31):
        drawn.advance(frame / 30)
    before, was = read_blades(drawn._world.field), read_states(drawn._world)
    moved = scene.camera.model_copy(update={"position_m": (2.5, 7.0, 0.1), "target_m": (2.5, 0.0, 0.0)})
    drawn.advance(1.0, camera=moved)
    after, now = read_blades(drawn._world.field), read_states(drawn._world)
    where = {root.tobytes(): i for i, root in enumerate(before["root"])}
    pairs = np.array([(where[r.tobytes()], i) for i, r in enumerate(after["root"]) if r.tobytes() in where])
    assert len(before) - 50 > len(pairs) > 0.4 * len(before)
    pressed = was["pressed"][pairs[:, 0]] > 0.2
    assert pressed.sum() > 10
    assert np.array_equal(now["tip"][pairs[:, 1]][pressed], was["tip"][pairs[:, 0]][pressed])


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMS)
def test_a_checkpoint_continues_bit_for_bit(renderer, form):
    scene = _field(form, wind=[_WIND[form]], object=[_ball(path=_PATH)])
    whole = renderer(scene)
    frames = [whole.render(i / 30).image for i in range(12)]
    first = renderer(scene)
    for i in range(6):
        first.render(i / 30)
    saved = first.checkpoint()
    assert saved["time_s"] == 5 / 30
    second = renderer(scene)
    second.resume(saved)
    for i in range(6, 12):
        assert np.array_equal(second.render(i / 30).image, frames[i])
    fresh = renderer(scene)
    assert not np.array_equal(fresh.render(6 / 30).image, frames[6]) or form == "yan2024"


def test_a_checkpoint_of_another_scene_is_refused(renderer):
    saved = renderer(_field()).checkpoint()
    with pytest.raises(InputError, match="checkpoint"):
        renderer(_field()).resume({})
    with pytest.raises(InputError, match="without simulation"):
        renderer(_field()).resume(saved)
    drawn = renderer(_field())
    drawn.render(0.0)
    other = renderer(_field(seed=99))
    with pytest.raises(InputError, match="another field"):
        other.resume(drawn.checkpoint())


def test_beyond_its_reach_grass_stands_in_analytic_motion(renderer):
    tables = {"sowing": {"full_density_m": 12.0, "density_per_m2": 30.0, "reach_m": 9.0}, "wind": [BREEZE]}
    near = {"position_m": [0.0, 2.0, 5.0], "target_m": [0.0, 0.0, -3.0], "fov_y_deg": 100.0}
    tips = []
    for simulation in ({"within_m": 5.0, "settle_s": 0.4}, None):
        drawn = renderer(small_scene(**tables, simulation=simulation, camera=near))
        drawn.render(2.0)
        blades = read_blades(drawn._world.field)
        tips.append(read_poses(drawn._world.field.pages[0])[:, 0, 1])
    away = np.linalg.norm(points(blades)[0] - [0.0, 2.0, 5.0], axis=1)
    seen = np.abs(tips[1]).sum(1) > 0
    beyond = seen & (away > 5.0)
    assert beyond.sum() > 100
    assert np.abs(tips[0] - tips[1])[beyond].max() < 1e-3  # half floats
    assert np.abs(tips[0] - tips[1])[seen & (away < 3.5)].mean() > 1e-3


@pytest.mark.parametrize("form", ["yan2024", "jahrmann2017"])
def test_the_papers_forms_stand_where_forces_balance_without_state(renderer, form):
    """Grass at rest in a steady wind is where analytic motion puts it."""
    steady = {"kind": "strong", "power_mps": 3.0, "steadiness": 1.0}
    gravity = {"gravity_mps2": 1.0, "within_m": 0.01}
    closed = renderer(_field(form, wind=[steady], simulation=gravity))
    closed.render(0.0)
    settled = renderer(_field(form, wind=[steady], settle_s=20.0, simulation={**gravity, "within_m": 60.0}))
    settled.render(0.0)
    tips = [read_poses(r._world.field.pages[0])[:, 0, 1] for r in (closed, settled)]
    height = read_blades(closed._world.field)["height"]
    seen = np.abs(tips[0]).sum(1) > 0
    assert seen.sum() > 500
    assert np.quantile((np.abs(tips[0] - tips[1]).max(1) / height)[seen], 0.9) < 0.25


def test_blades_that_come_into_simulation_have_not_leapt(renderer):
    """What a turn of the camera brings in moves no farther in its first frame than in its second."""
    away = {"position_m": [0.0, 2.0, 14.0], "target_m": [0.0, 1.0, 30.0]}
    scene = _field(wind=[BREEZE], simulation={"within_m": 6.0}, camera=away)
    drawn = renderer(scene)
    drawn.advance(0.0)
    back = scene.camera.model_copy(update={"position_m": (0.0, 2.0, 9.0), "target_m": (0.0, 0.0, 0.0)})
    moves = []
    for frame in (1, 2, 3):
        drawn.advance(frame / 30, camera=back)
        poses = poses_of(drawn._world.field)
        near = np.linalg.norm(points(read_blades(drawn._world.field))[0] - [0.0, 2.0, 9.0], axis=1) < 5.0
        assert near.sum() > 300
        # the median: those that blended into analytic motion for the old camera do leap, as the camera did
        moves.append(np.median(np.abs(poses[near, 0] - poses[near, 1]).max(axis=(1, 2))))
    assert 0.0 < moves[0] < 2 * moves[2]
    assert 0.0 < moves[1] < 2 * moves[2]


@pytest.mark.slow
def test_lag_on_a_moving_object_does_not_depend_on_the_frame_rate(renderer):
    path = {"times_s": [0.0, 10.0], "positions_m": [[-10.0, 0.0, 0.0], [10.0, 0.0, 0.0]], "smooth": False}
    box = {
        "kind": "box",
        "position_m": [0, 0, 0],
        "size_m": [1.0, 0.2, 1.0],
        "path": path,
        "grass": {"density_per_m2": 200},
    }
    scene = _field(wind=[], grass=[_UPRIGHT], object=[box], ground={"kind": "none"}, settle_s=2.0)
    leans = {}
    for rate in (15, 60):
        drawn = renderer(scene)
        for frame in range(rate + 1):
            drawn.advance(frame / rate)
        tips = read_poses(drawn._world.field.pages[0])[:, 0, 1]
        leans[rate] = float(tips[:, 0].mean())
    jumped = renderer(scene)
    jumped.advance(1.0)
    leans[0] = float(read_poses(jumped._world.field.pages[0])[:, 0, 1, 0].mean())
    assert leans[60] < -0.02
    assert all(abs(lean - leans[60]) < 0.1 * abs(leans[60]) for lean in leans.values())


@pytest.mark.slow
def test_a_checkpoint_continues_grass_on_a_moving_object(renderer):
    box = {"kind": "box", "position_m": [0, 0, 0], "path": _PATH, "grass": {"density_per_m2": 200}}
    scene = _field(wind=[BREEZE], object=[box])
    whole = renderer(scene)
    frames = [whole.render(i / 30).image for i in range(8)]
    first = renderer(scene)
    for i in range(4):
        first.render(i / 30)
    second = renderer(scene)
    second.resume(first.checkpoint())
    for i in range(4, 8):
        assert np.array_equal(second.render(i / 30).image, frames[i])


def test_states_that_were_out_of_reach_begin_anew(renderer):
    """Pressed grass has risen where the camera comes back to after a minute."""
    scene = _field(wind=[], grass=[_UPRIGHT], object=[_ball(path=_PATH)], simulation={"rise_s": 1.0, "within_m": 8.0})
    drawn = renderer(scene)
    for frame in range(31):
        drawn.advance(frame / 30)
    assert (read_states(drawn._world)["pressed"] > 0.2).sum() > 10
    gone = scene.camera.model_copy(update={"position_m": (60.0, 7.0, 0.1), "target_m": (60.0, 0.0, 0.0)})
    for second in range(2, 8):
        drawn.advance(float(second), camera=gone)
    drawn.advance(8.0)
    trail = points(read_blades(drawn._world.field))[0][:, 0] < 1.5  # the ball lies where its path ends
    assert (read_states(drawn._world)["pressed"][trail] > 0.2).sum() == 0
