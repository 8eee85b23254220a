"""Wind field with memory against its twin, cell by cell, and what it promises about time, jumps and checkpoints."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from blades import read_poses
from greensward.ground import HeightField
from greensward.motion import MotionStep
from greensward.motion.wake import CUT_M, SETTLE_STEPS, STEP_HZ, Grid, WakeLayers, WindField
from greensward.motion.winds import WINDS_BLOCK, wind_values
from greensward.objects.placing import Placing
from greensward.scene import InputError, Wake
from oracles import wake as twin
from shader_calls import shader_call
from small_scenes import NOISE, small_scene

_SMALL = {"cells": 15, "cell_m": 0.8, "reach_m": 2.0, "strength": 12.0, "damping": 0.5}
_TURNS = np.array(
    [[0.3, 1.2, 0.1], [2.0, 1.0, 0.4], [2.4, 1.6, 2.2], [1.0, 1.1, 3.6], [-1.4, 2.0, 2.5], [-1.5, 1.0, -1]]
)
_TURN_S = 1 / 6  # a whole number of frames at 30, 60 and 144 frames a second


def _path(time_s: float) -> np.ndarray:
    """A camera that turns, with straight lines between."""
    return np.array([np.interp(time_s, _TURN_S * np.arange(len(_TURNS)), _TURNS[:, axis]) for axis in range(3)])


class _Shown:
    """Layers of a wind field that are kept here in place of a GPU."""

    def show(self, before: Grid, now: Grid, times_s: tuple[float, float], _: np.ndarray) -> None:
        self.before, self.now, self.times_s = before, now.copy(), times_s


class _Flight:
    """A wind field and the frames that it is given."""

    def __init__(self, objects: tuple[Any, ...] = (), ground: dict[str, Any] | None = None, **wake: Any) -> None:
        scene = small_scene(object=list(objects), **({"ground": ground} if ground else {}))
        self.wake, self.shown = Wake(**{**_SMALL, **wake}), _Shown()
        self.heights = HeightField.of(scene)
        self.placing = Placing(scene.object, self.heights)
        self.field = WindField(self.shown, self.wake, self.heights, scene.object, self.placing.moving)
        self.previous_s: float | None = None

    def frame(self, time_s: float, camera_ws: Any) -> Grid:
        previous_s = time_s - 1 / 30 if self.previous_s is None else self.previous_s
        camera_ws = np.asarray(camera_ws, np.float64)
        self.field.advance(MotionStep(time_s, previous_s, camera_ws, self.placing.at, None, True))
        self.previous_s = time_s
        return self.shown.now

    def along(self, path: Any, fps: float, seconds: float) -> Grid:
        for k in range(round(fps * seconds) + 1):
            self.frame(k / fps, path(k / fps))
        return self.shown.now


def _as_cells(grid: Grid) -> dict[tuple[int, int], np.ndarray]:
    count = len(grid.velocities)
    return {
        (int(grid.origin[0]) + i, int(grid.origin[1]) + j): grid.velocities[j, i]
        for j in range(count)
        for i in range(count)
    }


def _expected(flight: _Flight, seconds: float) -> twin.Cells:
    cells: twin.Cells = {}
    for n in range(1, round(seconds * STEP_HZ) + 1):
        before, at = _path((n - 1) / STEP_HZ), _path(n / STEP_HZ)
        above = at[1] - float(flight.heights.height(at[0], at[2]))
        mover = (at[0], at[2], above, *((at - before)[[0, 2]] * STEP_HZ))
        cells = twin.stepped(cells, at[[0, 2]], [mover], flight.wake.model_dump(), 1 / STEP_HZ)
    return cells


def _differ(grid: Grid, cells: twin.Cells) -> float:
    found = _as_cells(grid)
    assert found.keys() == cells.keys()
    return max(float(np.abs(found[place] - v).max()) for place, v in cells.items())


@pytest.mark.parametrize("fps", [30.0, 60.0, 144.0])
def test_the_field_is_its_twin_at_every_frame_rate(fps):
    flight = _Flight(ground=NOISE)
    for seconds in (2 * _TURN_S, 5 * _TURN_S):
        grid = _Flight.along(flight, _path, fps, seconds)
        assert _differ(grid, _expected(flight, seconds)) < 1e-9
        flight = _Flight(ground=NOISE)
    assert np.abs(grid.velocities).max() > 3.0


def test_a_rate_that_no_step_fits_ends_alike():
    """At 50 frames a second most steps lie between two frames."""
    grids = [_Flight().along(lambda t: (4.0 * t, 1.0, -2.0 * t), fps, 1.0) for fps in (50.0, 60.0)]
    assert np.abs(grids[0].velocities - grids[1].velocities).max() < 1e-5


@pytest.mark.parametrize("shift", [(0, 0), (1, -1), (-3, 2), (14, 0), (15, 0), (-400, 7)])
def test_the_grid_shifts_by_whole_cells_and_what_comes_in_is_calm(shift):
    grid = Grid(15, 0.8)
    grid.follow(np.array([0.4, 9.0, 0.4]))
    assert grid.origin.tolist() == [-7, -7]
    grid.velocities = np.random.default_rng(1).normal(size=(15, 15, 2))
    before = _as_cells(grid)
    grid.follow(0.4 + 0.8 * np.array([shift[0], 0.0, shift[1]]))
    assert grid.origin.tolist() == [shift[0] - 7, shift[1] - 7]
    for place, velocity in _as_cells(grid).items():
        assert np.array_equal(velocity, before.get(place, np.zeros(2)))


def test_the_camera_stands_in_the_middle_cell():
    for camera in ((0.1, 1.0, -0.1), (-7.3, 1.0, 12.9), (1e4, 1.0, -1e4)):
        grid = _Flight().frame(0.0, camera)
        middle = (grid.origin + 7 + 0.5) * 0.8
        assert (np.abs(middle - np.array(camera)[[0, 2]]) <= 0.4 + 1e-9).all()


@pytest.mark.parametrize("fps", [24.0, 60.0])
def test_a_second_leaves_the_damped_part_of_the_speed(fps):
    flight = _Flight(damping=0.3)
    moving = flight.along(lambda t: (4.0 * t, 1.0, 0.0), fps, 0.5)
    for k in range(1, round(fps) + 1):
        after = flight.frame(0.5 + k / fps, (2.0, 1.0, 0.0))
    assert np.abs(moving.velocities).max() > 1.0
    assert np.allclose(after.velocities, 0.3 * moving.velocities, atol=1e-8)


def test_the_default_damping_is_the_published_one_at_sixty_frames_a_second():
    assert Wake().damping == pytest.approx(0.995**60, abs=0.001)


def test_air_is_pushed_only_forwards_and_away():
    flight = _Flight()
    flight.frame(0.0, (0.0, 1.0, 0.0))
    grid = flight.frame(0.1, (0.4, 1.0, 0.0))
    for (i, j), (vx, vz) in _as_cells(grid).items():
        x, z = (i + 0.5) * 0.8, (j + 0.5) * 0.8
        if x < 0.0:
            assert vx == vz == 0.0
        elif x > 0.4 and abs(z) < 2.0 and x < 3.0:
            assert vx > 0.0, "ahead"
            assert vz * z > 0.0, "to its own side"


def test_air_is_pushed_less_from_high_up():
    speeds = [
        np.abs(_Flight().along(lambda t, y=y: (4.0 * t, y, 0.0), 60.0, 0.5).velocities).max() for y in (0.0, 1.0, 2.0)
    ]
    assert speeds[1] / speeds[0] == pytest.approx(math.exp(-0.25), rel=1e-6)
    assert speeds[2] / speeds[0] == pytest.approx(math.exp(-1.0), rel=1e-6)


def test_a_default_flight_bends_grass():
    """8 m/s at eye height makes a wind in which blades bend visibly, ahead and beside."""
    flight = _Flight(**Wake().model_dump(exclude={"kind"}))
    speeds = np.hypot(*np.moveaxis(flight.along(lambda t: (8.0 * t, 1.7, 0.0), 60.0, 1.5).velocities, -1, 0))
    assert 8.0 < speeds.max() < 30.0
    z, x = np.unravel_index(speeds.argmax(), speeds.shape)
    assert speeds[z - 2, x] > 4.0
    assert speeds[z + 2, x] > 4.0


@pytest.fixture
def windy():
    flight = _Flight()
    assert np.abs(flight.along(lambda t: (4.0 * t, 1.0, 0.0), 30.0, 0.5).velocities).max() > 1.0
    return flight


@pytest.mark.parametrize("time_s", [0.4, 0.5 + SETTLE_STEPS / STEP_HZ + 0.1])
def test_back_in_time_and_after_a_gap_the_air_is_calm(windy, time_s):
    assert not windy.frame(time_s, (2.1, 1.0, 0.0)).velocities.any()


def test_after_less_than_the_gap_it_is_not(windy):
    assert windy.frame(0.5 + SETTLE_STEPS / STEP_HZ - 0.1, (2.0, 1.0, 0.0)).velocities.any()


def test_a_jump_of_the_camera_is_a_cut(windy):
    grid = windy.frame(0.6, (3.0 + CUT_M, 1.0, 0.0))
    assert not grid.velocities.any()
    assert not windy.shown.before.velocities.any(), "motion begins anew as well"
    assert not windy.frame(0.7, (3.0 + CUT_M, 1.0, 0.0)).velocities.any(), "nor is the jump made up for later"


def test_a_camera_that_moves_while_time_stands_still_pushes_no_air(windy):
    before = _as_cells(windy.shown.now)
    for x in (2.5, 4.0, 7.0):
        grid = windy.frame(0.5, (x, 1.0, 0.0))
    windy.frame(0.5 + 1 / 60, (7.0, 1.0, 0.0))
    assert all(np.array_equal(v, before.get(place, np.zeros(2))) for place, v in _as_cells(grid).items())
    later = _as_cells(windy.shown.now)
    assert all(np.linalg.norm(v) <= np.linalg.norm(before.get(place, np.zeros(2))) for place, v in later.items())


def test_teleports_each_frame_and_ten_kilometres_a_second_are_finite():
    random = np.random.default_rng(3)
    flight = _Flight(strength=1000.0)
    for k in range(30):
        assert not flight.frame(k / 30, random.uniform(-1e6, 1e6, 3)).velocities.any()
    for fps in (30.0, 240.0):  # cuts, and 42 m in a frame
        grid = _Flight(strength=1000.0).along(lambda t: (1e4 * t, 1.0, 0.0), fps, 0.5)
        assert np.isfinite(grid.velocities.astype(np.float32)).all()
        assert grid.velocities.any() == (fps == 240.0)


def test_the_field_of_the_frame_before_is_shown_too(windy):
    before = windy.shown.now
    windy.frame(0.6, (2.6, 1.0, 0.2))
    assert windy.shown.times_s == (0.5, 0.6)
    assert np.array_equal(windy.shown.before.velocities, before.velocities)
    assert np.array_equal(windy.shown.before.origin, before.origin)
    assert not np.array_equal(windy.shown.now.velocities, before.velocities)


# Objects ---------------------------------------------------------------------------------------------------------


def _ball(positions: list[list[float]], times_s: tuple[float, ...] = (0.0, 2.0), **more: Any) -> dict[str, Any]:
    path = {"times_s": list(times_s), "positions_m": positions, "smooth": False, **more}
    return {"kind": "sphere", "position_m": positions[0], "size_m": [0.6, 0.6, 0.6], "path": path}


_ROLLING = _ball([[-3.0, 0.0, 0.5], [3.0, 0.0, 0.5]], rolls=True)
_STANDING = {"kind": "box", "position_m": [0.0, 0.0, 0.0]}


@pytest.mark.parametrize("fps", [30.0, 144.0])
def test_moving_objects_push_air_as_the_twin_has_it(fps):
    """A field that begins in the middle of their way has been moved for four seconds before."""
    flight = _Flight((_STANDING, _ROLLING), by="objects", downwash_mps2=3.0)
    for k in range(round(fps * 0.5) + 1):
        grid = flight.frame(0.5 + k / fps, (0.0, 1.0, 0.0))
    cells: twin.Cells = {}
    for n in range(30 - SETTLE_STEPS + 1, 61):
        (xb, _, zb), (x, y, z) = ((-3.0 + 3.0 * max(t, 0.0), 0.3, 0.5) for t in ((n - 1) / STEP_HZ, n / STEP_HZ))
        mover = (x, z, y, (x - xb) * STEP_HZ, (z - zb) * STEP_HZ)
        cells = twin.stepped(cells, (0.0, 0.0), [mover], flight.wake.model_dump(), 1 / STEP_HZ)
    assert _differ(grid, cells) < 1e-6
    assert np.abs(grid.velocities).max() > 2.0


def test_who_moves_the_air_is_chosen():
    def flown(by: str) -> np.ndarray:
        flight = _Flight((_ROLLING,), by=by)
        flight.frame(0.0, (0.0, 1.0, 0.0))
        return flight.frame(0.5, (0.0, 1.0, -2.0)).velocities

    camera, objects, both = (flown(by) for by in ("camera", "objects", "both"))
    assert np.abs(camera).max() > 0.5
    assert np.abs(objects).max() > 0.5
    assert np.allclose(both, camera + objects, atol=1e-6)


def test_an_object_that_stands_pushes_nothing_and_one_that_jumps_does_not_either():
    assert not _Flight((_STANDING,), by="objects").frame(1.0, (0.0, 1.0, 0.0)).velocities.any()
    jumping = _ball([[500.0, 0.0, 0.0], [500.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]], (0.0, 1.0, 1.001, 3.0))
    flight = _Flight((jumping,), by="objects")
    for k in range(60):
        assert not flight.frame(0.5 + k / 30, (0.0, 1.0, 0.0)).velocities.any()


def test_downwash_blows_outwards_with_its_greatest_acceleration():
    cells = {"cell_m": 0.1, "cells": 65, "damping": 0.0}  # no memory: a step's acceleration times its time
    hovering = (_ball([[0.05, -0.3, 0.05]] * 2),)  # its middle on the ground
    flight = _Flight(hovering, by="objects", downwash_mps2=30.0, **cells)
    grid = flight.frame(1.0, (0.0, 1.0, 0.0))
    speeds = np.hypot(*np.moveaxis(grid.velocities, -1, 0))
    assert speeds.max() == pytest.approx(30.0 / STEP_HZ, rel=0.01)
    assert speeds[32, 32] < 1e-9
    for (i, j), (vx, vz) in _as_cells(grid).items():
        assert vx * i >= 0.0
        assert vz * j >= 0.0
    calm = _Flight(hovering, by="objects", downwash_mps2=0.0, **cells).frame(1.0, (0.0, 1.0, 0.0))
    assert not calm.velocities.any()


@pytest.fixture
def blown(device):
    """Two random fields a few cells apart, and the velocities that shaders find in them."""
    random = np.random.default_rng(8)
    before, now = (Grid(9, 0.7) for _ in range(2))
    for grid, camera in ((before, [0.2, 0.0, 3.1]), (now, [1.5, 0.0, 2.2])):
        grid.follow(np.array(camera))
        grid.velocities = random.normal(scale=5.0, size=(9, 9, 2))
    layers = WakeLayers(device, 9)
    layers.show(before, now, (1.0, 1.5), np.zeros(3))
    points = random.uniform([-4, 0, -2], [5, 1, 7], (500, 3)).astype(np.float32)

    def at(time_s: float) -> np.ndarray:
        block = {WINDS_BLOCK: wind_values((Wake(cells=9, cell_m=0.7),), 5)}
        call = f"windAt(p, 0.0, {time_s}).wind.xyz"
        return shader_call(
            device, "motion/wind.glsl", call, {"p": points}, "vec3", blocks=block, bindings=layers.bindings
        )

    yield at, points, before, now
    layers.release()


def test_shaders_look_it_up_bilinearly(blown):
    at, points, before, now = blown
    expected = {
        time_s: np.array(
            [twin.looked_up(grid.velocities, grid.origin, 0.7, p[0], p[2]) for p in points.astype(float)]
        )
        for time_s, grid in ((1.0, before), (1.5, now))
    }
    for time_s, velocities in expected.items():
        assert np.abs(at(time_s)[:, [0, 2]] - velocities).max() < 1e-3
    assert np.abs(at(0.5) - at(1.0)).max() == 0.0
    assert np.abs(at(9.0) - at(1.5)).max() == 0.0
    between = 0.75 * expected[1.0] + 0.25 * expected[1.5]
    assert np.abs(at(1.125)[:, [0, 2]] - between).max() < 1e-3
    beyond = (np.abs(expected[1.0]).max(1) == 0) & (np.abs(expected[1.5]).max(1) == 0)
    assert 10 < beyond.sum() < 400


_WAKE = {"kind": "wake", "by": "both", "downwash_mps2": 20.0, "cells": 25, "cell_m": 0.5}
_FLYING = _ball([[-3.0, 0.5, 0.0], [3.0, 0.5, 0.0]])


def _tables(**wake: Any) -> dict[str, Any]:
    return {"wind": [{**_WAKE, **wake}], "object": [{**_FLYING, "drawn": False, "collides": False}]}


def _cameras(scene) -> list[Any]:
    x, y, z = scene.camera.position_m
    return [scene.camera.model_copy(update={"position_m": (x, y, z - 0.2 * k)}) for k in range(8)]


def test_a_flight_bends_the_grass_that_it_passes(renderer):
    scene = small_scene(wind=[{"kind": "wake"}])
    pictures = []
    for each in (scene, scene.model_copy(update={"wind": ()})):
        drawn = renderer(each)
        for k, camera in enumerate(_cameras(scene)):
            picture = drawn.render(k / 24, camera=camera).image.astype(int)
        pictures.append(picture)
    assert (np.abs(pictures[0] - pictures[1]).max(-1) > 8).mean() > 0.05


def test_what_a_blade_did_a_frame_ago_is_what_was_drawn(renderer):
    """Motion vectors need the field of the frame before, and poses the field of their own frame."""
    drawn = renderer(small_scene(**_tables()))
    poses = []
    for time_s in (0.8, 0.9, 1.0):
        drawn.render(time_s)
        poses.append(np.concatenate([read_poses(page) for page in drawn._world.field.pages]))
    for earlier, later in pairwise(poses):
        assert np.array_equal(later[:, 1], earlier[:, 0])
        assert (later[:, 0] != earlier[:, 0]).any(axis=(1, 2)).mean() > 0.2


@pytest.mark.slow
@pytest.mark.parametrize("simulation", [None, {"settle_s": 0.1}], ids=["analytic", "simulated"])
def test_a_resumed_flight_is_the_same_to_the_byte(renderer, simulation):
    scene = small_scene(simulation=simulation, **_tables())
    cameras, drawn, other = _cameras(scene), renderer(scene), renderer(scene)
    for k in range(4):
        drawn.render(k / 24, camera=cameras[k])
    state = drawn.checkpoint()
    other.resume(state)
    for k in range(4, 8):
        pictures = [each.render(k / 24, camera=cameras[k]).image for each in (drawn, other)]
        assert np.array_equal(*pictures)
    ends = [each.checkpoint() for each in (drawn, other)]
    assert all(np.array_equal(ends[0][name], ends[1][name]) for name in ends[0] if name.startswith("wake_"))
    assert np.abs(ends[0]["wake_velocities"]).max() > 1.0
    without = {name: value for name, value in state.items() if name != "wake_cameras"}
    for wake, given in ({"cells": 27}, state), ({"cell_m": 0.6}, state), ({}, without):
        with pytest.raises(InputError, match="made of a scene without this wake"):
            renderer(small_scene(simulation=simulation, **_tables(**wake))).resume(given)


def test_other_numbers_take_effect_in_place_and_other_cells_do_not(renderer):
    drawn = renderer(small_scene(**_tables()))
    assert drawn.updates_in_place(small_scene(**_tables(strength=3.0, by="camera", reach_m=1.0, damping=0.1)))
    assert not drawn.updates_in_place(small_scene(**_tables(cells=27)))
    assert not drawn.updates_in_place(small_scene(**_tables(cell_m=0.6)))
    drawn.render(1.0)
    assert np.abs(drawn.checkpoint()["wake_velocities"]).max() > 1.0
    drawn.update(small_scene(**_tables(damping=0.0, by="camera")))
    drawn.render(1.1)
    assert not drawn.checkpoint()["wake_velocities"].any()
    drawn.update(small_scene(**_tables(cells=27)))
    drawn.render(1.1)
    assert drawn.checkpoint()["wake_velocities"].shape == (27, 27, 2)


def test_only_what_moves_near_the_field_is_worked_on(renderer, monkeypatch):
    pushed, push = [], Grid.push
    monkeypatch.setattr(Grid, "push", lambda self, mover, *a: (pushed.append(mover.at), push(self, mover, *a))[1])
    far = [_ball([[60.0 + k, 0.5, 0.0], [66.0 + k, 0.5, 0.0]]) for k in range(50)]
    high = [_ball([[-3.0, 90.0, 0.0], [3.0, 90.0, 0.0]]) for _ in range(50)]
    at_rest = [_ball([[2.0, 0.5, 0.0], [2.0, 0.5, 0.0]]) for _ in range(50)]
    objects = [{**each, "drawn": False, "collides": False} for each in (*far, *high, *at_rest, _FLYING)]
    wake = {**_WAKE, "by": "objects", "downwash_mps2": 0.0}
    renderer(small_scene(wind=[wake], object=objects)).render(1.0)
    assert 0 < len(pushed) <= SETTLE_STEPS
