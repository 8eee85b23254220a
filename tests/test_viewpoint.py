"""Cameras: where they stand, and what their matrices do."""

import numpy as np
import pytest

from greensward.gpu.view import look_at, parallel
from greensward.ground import HeightField
from greensward.scene import Camera, InputError
from greensward.viewpoint import camera_view, jitter, place

_FLAT = HeightField(np.zeros((2, 2), np.float32), (100.0, 100.0))
_HIGH = HeightField(np.full((2, 2), 7.0, np.float32), (100.0, 100.0))


def _camera(position=(1.0, 2.0, 3.0), target=(4.0, 0.5, -6.0), **more) -> Camera:
    return Camera(position_m=position, target_m=target, **more)


def _project(matrix: np.ndarray, *points) -> np.ndarray:
    clip = np.concatenate([np.array(points), np.ones((len(points), 1))], 1) @ matrix.T
    return clip[:, :3] / clip[:, 3:]


@pytest.mark.parametrize(("above", "expected"), [(True, 9.0), (False, 8.0)])
def test_height_above_ground(above, expected):
    camera = _camera(
        position=(0.0, expected - 7.0 * above, 0.0), target=(5.0, 8.0 - 7.0 * above, 5.0), height_above_ground=above
    )
    position, target = place(camera, _HIGH)
    assert position.tolist() == [0.0, expected, 0.0]
    assert target.tolist() == [5.0, 8.0, 5.0]


@pytest.mark.parametrize(
    "camera", [_camera((0, 0, 0)), _camera((0, -1, 0)), _camera((0, 6.9, 0), height_above_ground=False)]
)
def test_a_camera_inside_the_ground_is_refused(camera):
    with pytest.raises(
        InputError, match=r"camera\.position_m: must be above the ground, which is 7\.00 m high there"
    ) as refused:
        place(camera, _HIGH)
    assert "raise y, or set" in str(refused.value)
    assert ("height_above_ground = true" in str(refused.value)) or camera.height_above_ground


def test_a_camera_that_comes_to_look_at_itself_is_refused():
    slope = HeightField(np.array([[0, 10], [0, 10]], np.float32), (10.0, 10.0))
    beside = _camera((0.0, 1.0, 0.0), (1e-9, 1.0, 0.0))
    with pytest.raises(InputError, match=r"camera\.target_m: must differ"):
        place(beside, slope)


@pytest.mark.parametrize("target", [(4.0, 0.5, -6.0), (1.0, -50.0, 3.0), (1.0, 90.0, 3.0), (1.0, 2.0, 9.0)])
def test_matrices(target):
    camera = _camera(target=target, near_m=0.5, far_m=80.0, fov_y_deg=40.0)
    view = camera_view(camera, _FLAT, (200, 100))
    position, target = place(camera, _FLAT)
    forward = (target - position) / np.linalg.norm(target - position)
    assert _project(view.clip_from_world, target)[0, :2] == pytest.approx(0.0, abs=1e-9)
    near, far = _project(view.clip_from_world, position + 0.5 * forward, position + 80.0 * forward)
    assert (near[2], far[2]) == pytest.approx((-1.0, 1.0))
    assert view.axis_ws[:3] @ position + view.axis_ws[3] == pytest.approx(0.0)
    assert view.axis_ws[:3] @ (position + 7 * forward) + view.axis_ws[3] == pytest.approx(7.0)
    assert view.eye_ws.tolist() == [*position, 1.0]
    view_from_world = look_at(position, target)
    up = view_from_world[1, :3]
    assert up[1] >= 0
    top = position + 10 * forward + 10 * np.tan(np.radians(20)) * up
    assert _project(view.clip_from_world, top)[0, :2] == pytest.approx((0.0, 1.0), abs=1e-9)
    # one pixel up at this depth
    pixel = position + 10 * forward + 10 * view.pixel_m[0] * up
    assert _project(view.clip_from_world, pixel)[0, 1] == pytest.approx(2 / 100)


def test_rays_meet_what_the_matrices_show():
    view = camera_view(_camera(), _FLAT, (200, 100))
    for ndc in ((0, 0), (1, 0), (0, 1), (-1, -1), (0.3, -0.8)):
        ray = view.rays_ws[0] + ndc[0] * view.rays_ws[1] + ndc[1] * view.rays_ws[2]
        assert view.axis_ws[:3] @ ray == pytest.approx(1.0)
        assert _project(view.clip_from_world, view.camera_ws + 5 * ray)[0, :2] == pytest.approx(ndc, abs=1e-9)


def test_look_is_a_rotation_and_a_shift():
    matrix = look_at((1, 2, 3), (4, 0, -5))
    assert np.allclose(matrix[:3, :3] @ matrix[:3, :3].T, np.eye(3))
    assert np.linalg.det(matrix[:3, :3]) == pytest.approx(1.0)
    assert matrix @ [1, 2, 3, 1] == pytest.approx([0, 0, 0, 1])
    assert (matrix @ [4, 0, -5, 1])[:3] == pytest.approx([0, 0, -np.sqrt(77)])


def test_clip_planes_part_inside_from_outside():
    view = camera_view(_camera(), _FLAT, (200, 100))
    p = np.random.default_rng(0).uniform(-10, 10, (2000, 3))
    clip = np.concatenate([p, np.ones((2000, 1))], 1) @ view.clip_from_world.T
    planes = view.planes_ws()
    by_planes = (p @ planes[:, :3].T + planes[:, 3] >= 0).all(axis=1)
    assert np.array_equal(by_planes, (np.abs(clip[:, :3]) <= clip[:, 3:]).all(axis=1))
    assert 20 < by_planes.sum() < 1000


def test_the_projection_of_shadow_maps():
    matrix = parallel(5.0, -2.0, 8.0)
    assert _project(matrix, (5, -5, 2), (0, 0, -8)).tolist() == [pytest.approx([1, -1, -1]), pytest.approx([0, 0, 1])]


def test_jitter_starts_in_the_middle_and_covers_the_pixel():
    assert jitter(0) == (0.0, 0.0)
    offsets = np.array([jitter(i) for i in range(64)])
    assert np.abs(offsets).max() < 0.5
    assert len({tuple(o) for o in offsets.tolist()}) >= 63
    assert np.abs(offsets.mean(axis=0)).max() < 0.03
    counts, *_ = np.histogram2d(*offsets.T, bins=4, range=[[-0.5, 0.5]] * 2)
    assert counts.min() >= 2
