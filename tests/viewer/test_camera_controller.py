"""Camera controller: it stays on the ground and out of objects."""

import math

import numpy as np
import pytest

import greensward as gs
from greensward.ground import HeightField
from greensward.viewer.camera_controller import CameraController, Intent, ground_hit
from greensward.viewer.obstacles import Obstacles

AHEAD = Intent(ahead=1.0)


def _controller(scene: gs.Scene) -> CameraController:
    heights = HeightField.of(scene)
    controller = CameraController(scene.camera, heights)
    water = scene.water.level_m if scene.water else -math.inf
    controller.set_world(heights, Obstacles.of(scene, heights), water)
    return controller


def _go(controller: CameraController, intent: Intent, seconds: float, step_s: float = 0.02) -> None:
    for _ in range(round(seconds / step_s)):
        controller.move(intent, step_s)


def _scene(**parts) -> gs.Scene:
    return gs.Scene(camera=gs.Camera(position_m=(0, 1.7, 8), target_m=(0, 1.7, -20)), **parts)


def test_it_walks_forwards_and_faster_with_shift():
    controller = _controller(_scene())
    _go(controller, AHEAD, 1.0)
    slow = 8.0 - controller.position_ws[2]
    assert slow == pytest.approx(1.8, abs=0.25)
    assert controller.position_ws[[0, 1]] == pytest.approx([0.0, 1.7])
    before = controller.position_ws[2]
    _go(controller, Intent(ahead=1.0, fast=True), 1.0)
    assert before - controller.position_ws[2] > 3.0 * slow


def test_it_stops_where_no_key_is_held():
    controller = _controller(_scene())
    _go(controller, AHEAD, 0.5)
    _go(controller, Intent(), 1.0)
    assert not controller.move(Intent(), 0.02)


def test_it_turns_with_the_mouse_and_never_over():
    controller = _controller(_scene())
    controller.move(Intent(turn_px=(100.0, -1e6)), 0.02)
    assert controller.yaw == pytest.approx(math.radians(18.0))
    assert controller.pitch == pytest.approx(math.radians(89.0))
    camera = controller.camera()
    assert camera.position_m != camera.target_m


def test_feet_follow_the_ground():
    scene = _scene(ground=gs.grounds.NoiseGround(height_m=20.0, wavelength_m=60.0, size_m=(200, 200)))
    controller = _controller(scene)
    for _ in range(400):
        controller.move(AHEAD, 0.05)
        x, y, z = controller.position_ws
        assert y - controller._heights.height(x, z) > 0.2
    _go(controller, Intent(), 1.0)
    x, y, z = controller.position_ws
    assert y - controller._heights.height(x, z) == pytest.approx(1.7, abs=0.02)


@pytest.mark.parametrize("kind", [gs.objects.Box, gs.objects.Cylinder, gs.objects.Sphere])
@pytest.mark.parametrize("mode", ["walk", "fly"])
def test_it_does_not_walk_into_objects(kind, mode):
    item = kind(kind=kind.__name__.lower(), position_m=(0.05, 0, 0), size_m=(4, 4, 2))
    controller = _controller(_scene(object=(item,)))
    controller.choose(mode)
    _go(controller, Intent(ahead=1.0, fast=True), 2.0, 0.05)
    if kind is gs.objects.Box:
        assert controller.position_ws[2] >= 1.25
    own = controller.position_ws[[0, 2]] - np.array([0.05, 0.0])
    assert not (abs(own) < np.array([1.3, 0.6])).all()


def test_a_low_step_and_a_high_gate_do_not_stop_it():
    step = gs.objects.Box(kind="box", position_m=(0, 0, 4), size_m=(9, 0.2, 0.5))
    gate = gs.objects.Box(kind="box", position_m=(0, 2.2, 0), size_m=(9, 0.3, 0.5))
    controller = _controller(_scene(object=(step, gate)))
    _go(controller, Intent(ahead=1.0, fast=True), 3.0)
    assert controller.position_ws[2] < -2.0


def test_a_steep_bank_stops_it(tmp_path):
    heights = np.zeros((101, 101), np.float32)
    heights[:50] = 30.0  # a cliff, north of the middle
    np.save(tmp_path / "cliff.npy", heights)
    scene = _scene(ground=gs.grounds.HeightMapGround(file="cliff.npy", size_m=(100, 100))).in_folder(tmp_path)
    controller = _controller(scene)
    _go(controller, Intent(ahead=1.0, fast=True), 5.0)
    assert controller.position_ws[2] > -1.0
    assert controller.position_ws[1] < 10.0


def test_it_wades_no_deeper_than_the_water():
    scene = _scene(water=gs.Water(level_m=1.0), ground=gs.grounds.FlatGround())
    controller = _controller(scene)
    _go(controller, AHEAD, 1.0)
    assert controller.position_ws[1] > 1.0


def test_it_flies_anywhere_but_into_the_ground():
    controller = _controller(_scene())
    controller.choose("fly")
    _go(controller, Intent(up=1.0), 2.0)
    assert controller.position_ws[1] > 8.0
    _go(controller, Intent(up=-1.0, fast=True), 4.0)
    assert controller.position_ws[1] == pytest.approx(0.2, abs=0.01)


def test_it_circles_around_what_it_looked_at():
    controller = _controller(_scene())
    controller.move(Intent(turn_px=(0.0, 60.0)), 0.0)
    controller.choose("orbit")
    pivot = controller.pivot_ws.copy()
    away = np.linalg.norm(controller.position_ws - pivot)
    for _ in range(20):
        controller.move(Intent(turn_px=(20.0, 1.0)), 0.02)
        to = pivot - controller.position_ws
        assert np.linalg.norm(to) == pytest.approx(away, rel=1e-6)
        assert to / np.linalg.norm(to) == pytest.approx(controller.forward_ws, abs=1e-6)
    _go(controller, AHEAD, 0.5)
    assert np.linalg.norm(controller.position_ws - pivot) < away


def test_it_circles_with_the_mouse_and_walks_on_at_its_height():
    controller = _controller(_scene())
    controller.move(Intent(turn_px=(0.0, 60.0)), 0.0)
    controller.set_pivot()
    pivot = controller.pivot_ws.copy()
    for _ in range(5):
        controller.orbit((20.0, -2.0))
    direction = pivot - controller.position_ws
    assert direction / np.linalg.norm(direction) == pytest.approx(controller.forward_ws, abs=1e-6)
    assert controller.mode == "walk"
    height_m = controller.position_ws[1]
    assert height_m != pytest.approx(1.7)
    _go(controller, AHEAD, 1.0)
    assert controller.position_ws[1] == pytest.approx(height_m, abs=0.02)
    controller.orbit((0.0, 400.0))
    assert controller.mode == "fly", "nobody falls out of the sky"
    controller.orbit((0.0, -9999.0))
    assert controller.position_ws[1] >= 0.2


@pytest.mark.parametrize("height_m", [0.3, 1.7, 3.2, 9.0])
def test_it_stays_where_the_scenes_camera_stands(height_m):
    scene = _scene().model_copy(update={"camera": gs.Camera(position_m=(0, height_m, 8), target_m=(0, 0, 0))})
    controller = _controller(scene)
    _go(controller, Intent(), 1.0)
    assert controller.position_ws == pytest.approx([0.0, height_m, 8.0])


def test_it_zooms_within_reason():
    controller = _controller(_scene())
    controller.zoom(0.5)
    assert controller.camera().fov_y_deg == pytest.approx(25.0)
    for factor, end in ((1e9, 110.0), (1e-9, 2.0)):
        controller.zoom(factor)
        assert controller.camera().fov_y_deg == end


def test_without_ground_there_is_no_walking():
    scene = gs.load("planet")
    controller = _controller(scene)
    controller.choose("walk")
    assert controller.mode != "walk"


def test_the_camera_is_one_that_can_be_drawn():
    scene = gs.load("meadow")
    controller = _controller(scene)
    camera = controller.camera()
    assert not camera.height_above_ground
    heights = HeightField.of(scene)
    x, _, z = scene.camera.position_m
    assert camera.position_m[1] == pytest.approx(float(heights.height(x, z)) + scene.camera.position_m[1], abs=1e-5)


def test_a_ray_meets_the_ground_where_it_should():
    scene = gs.Scene(ground=gs.grounds.NoiseGround(height_m=10.0))
    heights = HeightField.of(scene)
    start = np.array([0.0, float(heights.height(0, 0)) + 3.0, 0.0])
    hit = ground_hit(heights, start, np.array([0.3, -0.4, -0.866]))
    assert hit is not None
    assert hit[1] == pytest.approx(float(heights.height(hit[0], hit[2])), abs=1e-3)
    assert ground_hit(heights, start, np.array([0.0, 1.0, 0.0])) is None


def test_zooming_changes_every_kind_of_lens():
    flat = HeightField(np.zeros((2, 2), np.float32), (100.0, 100.0))
    measured = CameraController(gs.Camera(fx_px=100.0, fy_px=90.0), flat)
    measured.zoom(0.5)
    assert (measured.camera().fx_px, measured.camera().fy_px) == (200.0, 180.0)
    parallel = CameraController(gs.Camera(projection="orthographic", view_height_m=8.0), flat)
    parallel.zoom(0.5)
    assert parallel.camera().view_height_m == 4.0


@pytest.mark.parametrize("lens", [{"projection": "fisheye", "fov_y_deg": 180.0}, {"distortion": (-0.2,)}])
def test_a_window_shows_straight_lines(lens):
    flat = HeightField(np.zeros((2, 2), np.float32), (100.0, 100.0))
    assert CameraController(gs.Camera(**lens), flat).camera().is_straight
