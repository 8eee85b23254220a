"""Cameras of a host: its own matrices and intrinsics, roll, off-axis and parallel pictures, bent lenses."""

import json

import numpy as np
import pytest

from greensward.gpu.view import look_at
from greensward.lens import directions, project
from greensward.scene import Camera, InputError, SceneError, SurfaceClass
from greensward.viewpoint import camera_from_matrices, camera_from_opencv, camera_view, intrinsics
from oracles import lens as oracle
from small_scenes import NOISE, small_scene

_SIZE = 160, 90
_OPENCV = np.diag([1.0, -1.0, -1.0, 1.0])


def _pose(position=(0.4, 1.6, 3.0), target=(1.0, 0.2, -3.0), roll_deg=17.0) -> np.ndarray:
    cos, sin = np.cos(np.radians(roll_deg)), np.sin(np.radians(roll_deg))
    turn = np.eye(4)
    turn[:2, :2] = [[cos, -sin], [sin, cos]]
    return turn @ look_at(position, target)


def _projection(left, right, bottom, top, near, far, zero_to_one=False, reverse=False) -> np.ndarray:
    """As glFrustum has it, at 1 m."""
    m = np.zeros((4, 4))
    m[0, 0], m[0, 2] = 2 / (right - left), (right + left) / (right - left)
    m[1, 1], m[1, 2] = 2 / (top - bottom), (top + bottom) / (top - bottom)
    m[3, 2] = -1
    if zero_to_one and np.isinf(far):
        m[2, 3] = near
    elif zero_to_one:
        m[2, 2:] = (
            (near / (far - near), far * near / (far - near))
            if reverse
            else (-far / (far - near), -far * near / (far - near))
        )
    elif np.isinf(far):
        m[2, 2:] = -1, -2 * near
    else:
        m[2, 2:] = -(far + near) / (far - near), -2 * far * near / (far - near)
    return m


def _points(truth, pixels_of, pose) -> np.ndarray:
    """World points (height, width, 3) of a pinhole's K, and depth along the axis."""
    k = np.array(json.loads(str(truth["camera"]))["camera_matrix"])
    assert np.allclose(k, pixels_of)
    height, width = truth["depth"].shape
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    rays = np.stack([(u - k[0, 2]) / k[0, 0], (v - k[1, 2]) / k[1, 1], np.ones_like(u)], -1)
    in_camera = rays * truth["depth"][..., None].astype(np.float64)
    camera_from_world = _OPENCV @ pose
    with np.errstate(invalid="ignore"):
        return (in_camera - camera_from_world[:3, 3]) @ camera_from_world[:3, :3]


@pytest.mark.parametrize("stage", ["fragment", "compute"])
@pytest.mark.parametrize("technique", ["visibility-buffer", "bezier-blades"])
def test_points_by_a_hosts_own_k_lie_on_the_ground(renderer, stage, technique):
    """Within 0.1 mm and 0.01 %: rolled, off-axis, with unequal focal lengths."""
    scene = small_scene(ground=NOISE, technique={"name": technique}, sowing={"density_per_m2": 5.0})
    heights_of = renderer(scene, size=_SIZE, stage=stage)
    ground = float(heights_of.ground_height(0.4, 3.0))
    pose = _pose((0.4, ground + 1.6, 3.0), (1.0, ground + 0.2, -3.0))
    projection = _projection(-0.7, 0.5, -0.35, 0.3, 0.1, 300.0)
    truth = heights_of.render(1.0, view_from_world=pose, clip_from_view=projection, aovs=["depth", "class"]).truth
    fx, fy = 160 / 1.2, 90 / 0.65
    k = [[fx, 0, 0.7 * fx - 0.5], [0, fy, 0.3 * fy - 0.5], [0, 0, 1]]
    points = _points(truth, k, pose)[truth["class"] == SurfaceClass.GROUND]
    depth = truth["depth"][truth["class"] == SurfaceClass.GROUND]
    assert len(points) > 2000
    off = np.abs(points[:, 1] - heights_of.ground_height(points[:, 0], points[:, 2]))
    # along the ray the error is that over its slope towards the ground
    rays = points - np.array([0.4, ground + 1.6, 3.0])
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    slant = np.abs((rays * heights_of.ground_normal(points[:, 0], points[:, 2])).sum(axis=1))
    error = off * heights_of.ground_normal(points[:, 0], points[:, 2])[:, 1] / np.maximum(slant, 0.05)
    assert (error < 1e-4 + 1e-4 * depth).mean() > 0.999


@pytest.mark.parametrize("technique", ["visibility-buffer", "bezier-blades", "billboard-grid"])
def test_parallel_pictures(renderer, technique):
    """Depth and place of flat ground and of a box, seen from above and aside, in pixels per metre."""
    box = {"kind": "box", "position_m": [0.5, 0.0, -0.5], "size_m": [1.0, 0.5, 1.0]}
    scene = small_scene(technique={"name": technique}, object=[box], sowing={"density_per_m2": 20.0})
    camera = Camera(position_m=(0, 4, 3), target_m=(0, 0, 0), projection="orthographic", fx_px=20.0, fy_px=15.0)
    drawn = renderer(scene, size=_SIZE)
    truth = drawn.render(camera=camera, aovs=["depth", "class", "blade_id"]).truth
    u, v = np.meshgrid(np.arange(160), np.arange(90))
    pose = drawn.camera_matrices(camera)[0]
    at = np.stack([(u - 79.5) / 20.0, -(v - 44.5) / 15.0, -truth["depth"]], -1) - pose[:3, 3]
    points = at @ pose[:3, :3]
    ground, solid = truth["class"] == SurfaceClass.GROUND, truth["class"] == SurfaceClass.OBJECT
    assert np.abs(points[ground][:, 1]).max() < 2e-3
    assert (truth["class"] == SurfaceClass.GRASS).mean() > 0.03
    top = points[solid & (points[..., 1] > 0.499)]
    assert len(top) == pytest.approx(20.0 * 15.0 * 0.8, rel=0.1)  # seen at a slant of 4 in 5
    assert np.abs(top[:, [0, 2]] - [0.5, -0.5]).max() < 0.51
    grass = points[truth["class"] == SurfaceClass.GRASS]
    assert grass[:, 1].min() > -0.01
    assert grass[:, 1].max() < 0.65


@pytest.mark.parametrize(
    ("matrix", "zero_to_one"),
    [
        (_projection(-0.7, 0.5, -0.3, 0.3, 0.2, 500.0), False),
        (_projection(-0.7, 0.5, -0.3, 0.3, 0.2, np.inf), False),
        (_projection(-0.7, 0.5, -0.3, 0.3, 0.2, 500.0, zero_to_one=True), True),
        (_projection(-0.7, 0.5, -0.3, 0.3, 0.2, 500.0, zero_to_one=True, reverse=True), True),
        (_projection(-0.7, 0.5, -0.3, 0.3, 0.2, np.inf, zero_to_one=True), True),
        (2.5 * _projection(-0.7, 0.5, -0.3, 0.3, 0.2, 500.0), False),
    ],
)
def test_a_projection_is_read_in_every_depth_convention(matrix, zero_to_one):
    camera = camera_from_matrices(_pose(), matrix, _SIZE, zero_to_one=zero_to_one)
    assert camera.near_m == pytest.approx(0.2, rel=1e-6)
    assert camera.far_m == pytest.approx(1e6 if np.isclose(camera.far_m, 1e6) else 500.0, rel=1e-4)
    view = camera_view(camera, _NOWHERE, _SIZE)
    world = np.random.default_rng(1).uniform((-5, -4, -11), (5, 6, -1), (50, 3))
    clip = np.c_[world, np.ones(50)] @ (matrix @ _pose()).T
    own = np.c_[world, np.ones(50)] @ view.clip_from_world.T
    assert np.allclose(own[:, :2] / own[:, 3:], clip[:, :2] / clip[:, 3:], atol=1e-9)


class _Nowhere:
    exists = False

    def height(self, x, z):
        return np.zeros(np.broadcast(x, z).shape)


_NOWHERE = _Nowhere()


@pytest.mark.parametrize("position", [(0.4, 1.6, 3.0), (0.0, 9.0, 0.0)])
@pytest.mark.parametrize("roll_deg", [0.0, 35.0, -120.0, 180.0])
def test_a_pose_comes_back_as_it_was(position, roll_deg):
    straight_down = position[0] == 0.0
    pose = _pose(position, (0.0, 0.0, 0.0) if straight_down else (1.0, 0.2, -3.0), roll_deg)
    camera = camera_from_matrices(pose.astype(np.float32), _projection(-1, 1, -1, 1, 0.1, 100), (64, 64))
    view = camera_view(camera, _NOWHERE, (64, 64))
    assert np.allclose(view.axis_ws[:3], -pose[2, :3], atol=1e-6)
    right = view.rays_ws[1] / np.linalg.norm(view.rays_ws[1])
    assert np.allclose(right, pose[0, :3], atol=1e-6)


_GOOD = _projection(-1, 1, -1, 1, 0.1, 100)


def _with(row: int, column: int, value: float) -> np.ndarray:
    changed = _GOOD.copy()
    changed[row, column] = value
    return changed


@pytest.mark.parametrize(
    ("pose", "projection", "message"),
    [
        (np.eye(3), _GOOD, r"^view_from_world: must be a matrix of shape \(4, 4\) \(got \(3, 3\)\)"),
        ("pose", _GOOD, "^view_from_world: must be a matrix of numbers"),
        (np.full((4, 4), np.nan), _GOOD, "^view_from_world: must be finite"),
        (np.diag([2.0, 2, 2, 1]), _GOOD, "^view_from_world: must be rigid"),
        (np.diag([-1.0, 1, 1, 1]), _GOOD, "^view_from_world: must not mirror"),
        (_pose().T, _GOOD, "transpose a row-vector matrix"),
        (_pose(), np.zeros((4, 4)), "^clip_from_view: must be a projection, which can be inverted"),
        (_pose(), np.diag([-1.0, 1, 1, 1]) @ _GOOD, "^clip_from_view: must not mirror the picture"),
        (_pose(), _with(3, 0, 0.5), "^clip_from_view: its last row must be 0 0 -1 0"),
        (_pose(), _with(0, 1, 0.3), "without shear"),
        (_pose(), _with(2, 0, 0.3), "depth must not depend on x and y"),
        (_pose(), _projection(-1, 1, -1, 1, -5.0, 5.0), "near and far planes must lie before the eye"),
    ],
)
def test_matrices_that_are_no_camera_are_refused(pose, projection, message):
    with pytest.raises(InputError, match=message):
        camera_from_matrices(pose, projection, (64, 64))


def test_a_camera_is_given_once(renderer):
    drawn = renderer(small_scene())
    for given in ({"view_from_world": _pose()}, {"clip_from_view": _GOOD}):
        with pytest.raises(InputError, match="give either camera, or both"):
            drawn.render(**given)
    with pytest.raises(InputError, match="give either camera, or both"):
        drawn.render(camera=Camera(), view_from_world=_pose(), clip_from_view=_GOOD)


# Intrinsics -------------------------------------------------------------------------------------------------


def test_intrinsics_grow_with_the_picture_they_were_measured_in():
    camera = Camera(fx_px=100.0, fy_px=90.0, cx_px=70.0, cy_px=40.0, calibrated_px=(160, 90))
    lens = intrinsics(camera, (320, 180))
    assert (lens.fx, lens.fy, lens.cx, lens.cy) == (200.0, 180.0, 140.5, 80.5)
    with pytest.raises(InputError, match=r"calibrated_px: pictures must have the shape of 160x90 \(got 200x90\)"):
        intrinsics(camera, (200, 90))


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"fy_px": 3.0}, "fy_px needs fx_px"),
        ({"fov_y_deg": 180.0}, 'fov_y_deg must be below 170 .got 180., or projection = "fisheye"'),
        ({"projection": "fisheye", "distortion": (0.1,)}, 'distortion is for projection = "perspective"'),
    ],
)
def test_lenses_that_contradict_themselves(keys, message):
    with pytest.raises(SceneError, match=message):
        Camera(**keys)


def test_a_calibration_of_opencv():
    k = [[120.0, 0, 75.0], [0, 110.0, 50.0], [0, 0, 1]]
    pose = (_OPENCV @ _pose())[:3]
    camera = camera_from_opencv(k, pose, distortion=(0.1, 0.02), size_px=_SIZE)
    assert intrinsics(camera, _SIZE).matrix.tolist() == k
    assert camera.distortion == (0.1, 0.02)
    assert np.allclose(camera_view(camera, _NOWHERE, _SIZE).axis_ws[:3], -_pose()[2, :3])
    with pytest.raises(InputError, match="camera_matrix: must be fx 0 cx"):
        camera_from_opencv([[120.0, 5, 75.0], [0, 110.0, 50.0], [0, 0, 1]], pose)


# Lenses that bend lines --------------------------------------------------------------------------------------

_BARREL = Camera(fx_px=90.0, fy_px=95.0, cx_px=82.0, cy_px=40.0, distortion=(-0.25, 0.06, 0.002, -0.003, 0.001))
_FISHEYE = Camera(projection="fisheye", fov_y_deg=150.0)


def test_points_are_projected_as_opencv_does():
    points = np.random.default_rng(2).uniform((-1, -0.6, 0.5), (1, 0.6, 4), (40, 3))
    barrel = [oracle.pinhole(p, 90, 95, 82, 40, _BARREL.distortion) for p in points]
    assert np.allclose(project(_BARREL, _SIZE, points), barrel)
    f = 90 / np.radians(150)
    assert np.allclose(project(_FISHEYE, _SIZE, points), [oracle.fisheye(p, f, f, 79.5, 44.5) for p in points])


@pytest.mark.parametrize("camera", [_BARREL, _FISHEYE])
def test_directions_are_those_that_land_on_the_pixels(camera):
    u, v = np.meshgrid(np.arange(160), np.arange(90))
    assert np.allclose(project(camera, _SIZE, directions(camera, _SIZE)), np.stack([u, v], -1), atol=1e-5)


def test_a_distortion_that_folds_is_refused():
    with pytest.raises(InputError, match=r"^camera\.distortion: must not fold the picture"):
        directions(Camera(distortion=(-1.5,)), _SIZE)


@pytest.mark.parametrize("camera", [_BARREL, _FISHEYE])
def test_a_lens_shows_what_lies_along_its_rays(renderer, camera):
    """Flat ground and a box: depth by the rays of the model, to a sixteenth of a pixel, and the picture with it."""
    box = {"kind": "box", "position_m": [0.0, 0.0, 0.0], "size_m": [0.8, 0.6, 0.8], "colour": "#ff0000"}
    scene = small_scene(object=[box], grass=[])
    camera = camera.model_copy(update={"position_m": (0.5, 1.3, 3.0), "target_m": (0.0, 0.3, -1.0), "far_m": 400.0})
    size = 80, 45
    camera = camera.model_copy(update={"calibrated_px": _SIZE} if camera.fx_px else {})
    drawn = renderer(scene, size=size)
    frame = drawn.render(camera=camera, aovs=["depth", "class", "normal", "motion"])
    truth = frame.truth
    rays = directions(camera, size)
    pose = _OPENCV @ drawn.camera_matrices(camera)[0]
    along = rays @ pose[:3, :3]
    # by the ray where it meets the ground, y 0, from 1.3 m
    expected = -1.3 / along[..., 1]
    depth = truth["depth"] if camera.projection == "fisheye" else truth["depth"] / rays[..., 2]
    ground = (truth["class"] == SurfaceClass.GROUND) & (along[..., 1] < -0.15)
    assert ground.sum() > 300
    # a sixteenth of a pixel off the ray
    slack = expected * 2.0 * (1 / 16) / intrinsics(camera, size).fy / -along[..., 1]
    assert (np.abs(depth - expected) < slack + 1e-3)[ground].all()
    assert (truth["class"] == SurfaceClass.SKY).any()
    red = (frame.image[..., 0] > frame.image[..., 1].astype(int) + 30) & (frame.image[..., 0] > 60)
    solid = truth["class"] == SurfaceClass.OBJECT
    assert solid.sum() > 10
    assert (red == solid).mean() > 0.97
    assert np.abs(truth["motion"]).max() < 1e-3
    moved = camera.model_copy(update={"position_m": (0.51, 1.3, 3.0), "target_m": (0.01, 0.3, -1.0)})
    motion = drawn.render(camera=moved, aovs=["motion"]).truth["motion"]
    before = np.array([0.5, 1.3, 3.0]) + 0.01 * np.array([1.0, 0, 0]) + along * expected[..., None]
    then = (before @ pose[:3, :3].T + pose[:3, 3]).reshape(-1, 3)
    there = project(camera, size, then).reshape(45, 80, 2)
    u, v = np.meshgrid(np.arange(80), np.arange(45))
    off = np.abs(np.stack([u, v], -1) - there - motion).max(axis=-1)[ground]
    assert np.quantile(off, 0.95) < 0.02


def test_sky_is_endlessly_far_at_right_angles_to_the_axis(renderer):
    camera = Camera(
        position_m=(0.0, 1.6, 3.0),
        target_m=(0.0, 0.6, -3.0),
        fx_px=0.1,
        fy_px=0.1,
        cx_px=-782106.3383820081,
        distortion=(-83.65086278012029, -75.7246049278309),
    )
    frame = renderer(small_scene(camera=camera.model_dump(exclude_defaults=True)), size=(48, 27)).render(
        aovs=("depth", "class", "motion")
    )
    assert np.isfinite(frame.truth["motion"]).all()
    sky = frame.truth["class"] == SurfaceClass.SKY
    assert sky.any()
    assert (frame.truth["depth"][sky] == np.inf).all()


def test_what_a_lens_cannot_be_used_for(ctx, renderer):
    target = ctx.simple_framebuffer((32, 18))
    with pytest.raises(InputError, match="are for render"):
        renderer(small_scene()).draw(target, camera=_FISHEYE)
    with pytest.raises(InputError, match="not for temporal pictures"):
        renderer(small_scene(), temporal=True).render(camera=_FISHEYE)
    with pytest.raises(InputError, match=r"post\.blur"):
        renderer(small_scene(post={"blur": "average"})).render(camera=_FISHEYE)
    target.release()


def test_a_refused_camera_leaves_the_next_pictures_as_they_were(renderer):
    """Also where a lens was drawn before, or is refused itself."""
    drawn = renderer(small_scene(), size=(48, 27))
    straight, wide = small_scene().camera, _FISHEYE.model_copy(update={"position_m": (0.0, 1.3, 4.0)})
    expected = drawn.render(1.0, camera=straight).image, drawn.render(1.0, camera=wide).image
    buried = {"position_m": (0.0, -1.0, 0.0)}
    for camera, picture in ((straight, expected[0]), (wide, expected[1])):
        drawn.render(1.0, camera=camera)
        for refused in (
            straight.model_copy(update=buried),
            wide.model_copy(update=buried),
            Camera(distortion=(-5.0,)),
            Camera(projection="fisheye", fx_px=10.0, cx_px=-5000.0),
        ):
            with pytest.raises(InputError):
                drawn.render(1.0, camera=refused)
            frame = drawn.render(1.0, camera=camera, aovs=["depth"])
            assert np.array_equal(frame.image, picture)
            assert frame.truth["depth"].shape == (27, 48)


def test_motion_begins_anew_with_another_lens(renderer):
    drawn = renderer(small_scene(), size=(48, 27))
    drawn.render(1.0)
    motion = drawn.render(1.1, camera=_FISHEYE, aovs=["motion"]).truth["motion"]
    assert np.abs(motion).max() < 1e-3


def test_water_is_in_the_truth_of_every_lens(renderer):
    scene = small_scene(
        ground={"kind": "flat"}, water={"level_m": 0.3, "reflections": False}, camera={"position_m": [0, 2.0, 4.0]}
    )
    drawn = renderer(scene, size=(48, 27))
    for lens in ({}, {"distortion": (-0.1,)}, {"projection": "fisheye", "fov_y_deg": 120.0}):
        kinds = drawn.render(camera=scene.camera.model_copy(update=lens), aovs=["class"]).truth["class"]
        assert (kinds == SurfaceClass.WATER).mean() > 0.2, lens


def test_a_size_that_is_none_leaves_the_renderer_usable(renderer, monkeypatch):
    drawn = renderer(small_scene(), size=(48, 27))
    expected = drawn.render(1.0).image
    with pytest.raises(InputError, match="size: must be two whole numbers"):
        drawn.resize((64.5, 36))

    def fail(*_):
        raise MemoryError

    monkeypatch.setattr(drawn._post, "resize", fail)
    with pytest.raises(MemoryError):
        drawn.resize((64, 36))
    assert np.array_equal(drawn.render(1.0).image, expected)
