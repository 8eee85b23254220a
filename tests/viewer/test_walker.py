"""Someone who walks stays on the ground and out of things."""

import math

import numpy as np
import pytest

import greensward as gs
from greensward.ground import HeightField
from greensward.viewer.obstacles import Obstacles
from greensward.viewer.walker import Intent, Walker, ground_hit

AHEAD = Intent(ahead=1.0)


def _walker(scene: gs.Scene) -> Walker:
    heights = HeightField.of(scene)
    walker = Walker(scene.camera, heights)
    water = scene.water.level_m if scene.water else -math.inf
    walker.enter(heights, Obstacles.of(scene, heights), water)
    return walker


def _go(walker: Walker, intent: Intent, seconds: float, step_s: float = 0.02) -> None:
    for _ in range(round(seconds / step_s)):
        walker.move(intent, step_s)


def _scene(**parts) -> gs.Scene:
    return gs.Scene(camera=gs.Camera(position_m=(0, 1.7, 8), target_m=(0, 1.7, -20)), **parts)


def test_it_walks_where_it_looks_and_shift_hurries():
    walker = _walker(_scene())
    _go(walker, AHEAD, 1.0)
    slow = 8.0 - walker.position_ws[2]
    assert slow == pytest.approx(1.8, abs=0.25)
    assert walker.position_ws[[0, 1]] == pytest.approx([0.0, 1.7])
    before = walker.position_ws[2]
    _go(walker, Intent(ahead=1.0, fast=True), 1.0)
    assert before - walker.position_ws[2] > 3.0 * slow


def test_it_stops_where_no_key_is_held():
    walker = _walker(_scene())
    _go(walker, AHEAD, 0.5)
    _go(walker, Intent(), 1.0)
    assert not walker.move(Intent(), 0.02)


def test_it_turns_with_the_mouse_and_never_over():
    walker = _walker(_scene())
    walker.move(Intent(turn_px=(100.0, -1e6)), 0.02)
    assert walker.yaw == pytest.approx(math.radians(18.0))
    assert walker.pitch == pytest.approx(math.radians(89.0))
    camera = walker.camera()
    assert camera.position_m != camera.target_m


def test_feet_follow_the_ground():
    scene = _scene(ground=gs.NoiseGround(height_m=20.0, wavelength_m=60.0, size_m=(200, 200)))
    walker = _walker(scene)
    for _ in range(400):
        walker.move(AHEAD, 0.05)
        x, y, z = walker.position_ws
        assert y - walker._heights.height(x, z) > 0.2
    _go(walker, Intent(), 1.0)
    x, y, z = walker.position_ws
    assert y - walker._heights.height(x, z) == pytest.approx(1.7, abs=0.02)


@pytest.mark.parametrize("kind", [gs.Box, gs.Cylinder, gs.Sphere])
@pytest.mark.parametrize("mode", ["walk", "fly"])
def test_it_does_not_walk_into_things(kind, mode):
    thing = kind(kind=kind.__name__.lower(), position_m=(0.05, 0, 0), size_m=(4, 4, 2))
    walker = _walker(_scene(object=(thing,)))
    walker.choose(mode)
    _go(walker, Intent(ahead=1.0, fast=True), 2.0, 0.05)
    if kind is gs.Box:
        assert walker.position_ws[2] >= 1.25
    own = walker.position_ws[[0, 2]] - np.array([0.05, 0.0])
    assert not (abs(own) < np.array([1.3, 0.6])).all()


def test_a_low_step_and_a_high_gate_do_not_stop_it():
    step = gs.Box(kind="box", position_m=(0, 0, 4), size_m=(9, 0.2, 0.5))
    gate = gs.Box(kind="box", position_m=(0, 2.2, 0), size_m=(9, 0.3, 0.5))
    walker = _walker(_scene(object=(step, gate)))
    _go(walker, Intent(ahead=1.0, fast=True), 3.0)
    assert walker.position_ws[2] < -2.0


def test_a_steep_bank_stops_it(tmp_path):
    heights = np.zeros((101, 101), np.float32)
    heights[:50] = 30.0  # a cliff, north of the middle
    np.save(tmp_path / "cliff.npy", heights)
    scene = _scene(ground=gs.HeightMapGround(file="cliff.npy", size_m=(100, 100))).in_folder(tmp_path)
    walker = _walker(scene)
    _go(walker, Intent(ahead=1.0, fast=True), 5.0)
    assert walker.position_ws[2] > -1.0
    assert walker.position_ws[1] < 10.0


def test_it_wades_no_deeper_than_the_water():
    scene = _scene(water=gs.Water(level_m=1.0), ground=gs.FlatGround())
    walker = _walker(scene)
    _go(walker, AHEAD, 1.0)
    assert walker.position_ws[1] > 1.0


def test_it_flies_anywhere_but_into_the_ground():
    walker = _walker(_scene())
    walker.choose("fly")
    _go(walker, Intent(up=1.0), 2.0)
    assert walker.position_ws[1] > 8.0
    _go(walker, Intent(up=-1.0, fast=True), 4.0)
    assert walker.position_ws[1] == pytest.approx(0.2, abs=0.01)


def test_it_circles_around_what_it_looked_at():
    walker = _walker(_scene())
    walker.move(Intent(turn_px=(0.0, 60.0)), 0.0)
    walker.choose("orbit")
    pivot = walker.pivot_ws.copy()
    away = np.linalg.norm(walker.position_ws - pivot)
    for _ in range(20):
        walker.move(Intent(turn_px=(20.0, 1.0)), 0.02)
        to = pivot - walker.position_ws
        assert np.linalg.norm(to) == pytest.approx(away, rel=1e-6)
        assert to / np.linalg.norm(to) == pytest.approx(walker.forward_ws, abs=1e-6)
    _go(walker, AHEAD, 0.5)
    assert np.linalg.norm(walker.position_ws - pivot) < away


def test_it_circles_with_the_mouse_and_walks_on_at_its_height():
    walker = _walker(_scene())
    walker.move(Intent(turn_px=(0.0, 60.0)), 0.0)
    walker.hold()
    pivot = walker.pivot_ws.copy()
    for _ in range(5):
        walker.circle((20.0, -2.0))
    way = pivot - walker.position_ws
    assert way / np.linalg.norm(way) == pytest.approx(walker.forward_ws, abs=1e-6)
    assert walker.mode == "walk"
    height_m = walker.position_ws[1]
    assert height_m != pytest.approx(1.7)
    _go(walker, AHEAD, 1.0)
    assert walker.position_ws[1] == pytest.approx(height_m, abs=0.02)
    walker.circle((0.0, 400.0))
    assert walker.mode == "fly", "nobody falls out of the sky"
    walker.circle((0.0, -9999.0))
    assert walker.position_ws[1] >= 0.2


@pytest.mark.parametrize("height_m", [0.3, 1.7, 3.2, 9.0])
def test_it_stays_where_the_scenes_camera_stands(height_m):
    scene = _scene().model_copy(update={"camera": gs.Camera(position_m=(0, height_m, 8), target_m=(0, 0, 0))})
    walker = _walker(scene)
    _go(walker, Intent(), 1.0)
    assert walker.position_ws == pytest.approx([0.0, height_m, 8.0])


def test_it_zooms_within_reason():
    walker = _walker(_scene())
    walker.zoom(0.5)
    assert walker.camera().fov_y_deg == pytest.approx(25.0)
    for factor, end in ((1e9, 110.0), (1e-9, 2.0)):
        walker.zoom(factor)
        assert walker.camera().fov_y_deg == end


def test_without_ground_there_is_no_walking():
    scene = gs.load("planet")
    walker = _walker(scene)
    walker.choose("walk")
    assert walker.mode != "walk"


def test_the_camera_is_one_that_can_be_drawn():
    scene = gs.load("meadow")
    walker = _walker(scene)
    camera = walker.camera()
    assert not camera.height_above_ground
    heights = HeightField.of(scene)
    x, _, z = scene.camera.position_m
    assert camera.position_m[1] == pytest.approx(float(heights.height(x, z)) + scene.camera.position_m[1], abs=1e-5)


def test_a_ray_meets_the_ground_where_it_should():
    scene = gs.Scene(ground=gs.NoiseGround(height_m=10.0))
    heights = HeightField.of(scene)
    start = np.array([0.0, float(heights.height(0, 0)) + 3.0, 0.0])
    hit = ground_hit(heights, start, np.array([0.3, -0.4, -0.866]))
    assert hit is not None
    assert hit[1] == pytest.approx(float(heights.height(hit[0], hit[2])), abs=1e-3)
    assert ground_hit(heights, start, np.array([0.0, 1.0, 0.0])) is None
