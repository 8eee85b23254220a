"""Views of a scene's camera: poses, lenses, matrices and rays of the picture."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from greensward.gpu.view import View, look_at, rolled
from greensward.ground import HeightField
from greensward.scene import Camera, InputError

Matrix = npt.NDArray[np.float64]
_RIGID = 1e-4  # a rotation may differ from one by so much, as single precision and text make it
_TARGET_M = 100.0
_NEAREST_M, _FARTHEST_M = 1e3, 1e6
_FROM_OPENCV = np.diag([1.0, -1.0, -1.0, 1.0])


def place(camera: Camera, heights: HeightField) -> tuple[Matrix, Matrix]:
    """Resolve position and target in world space, each (3,), with heights above ground resolved.

    Raises `InputError` for a camera inside the ground.
    """
    position, target = np.array(camera.position_m), np.array(camera.target_m)
    below = float(heights.height(position[0], position[2]))
    if camera.height_above_ground:
        position[1] += below
        target[1] += float(heights.height(target[0], target[2]))
    if heights.exists and position[1] <= below:
        raise InputError(
            f"camera.position_m: must be above the ground, which is {below:.2f} m high there "
            f"(got {position[1]:.2f} m); raise y, or set camera.height_above_ground = true"
        )
    if np.allclose(position, target):
        raise InputError("camera.target_m: must differ from position_m")
    return position, target


@dataclass(frozen=True)
class Intrinsics:
    """Lens of a camera for pictures of one size, in pixels; their centres lie at whole numbers, as in OpenCV."""

    fx: float
    fy: float
    cx: float
    cy: float

    @property
    def matrix(self) -> Matrix:
        """The camera matrix K, (3, 3)."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])


def intrinsics(camera: Camera, size_px: tuple[int, int]) -> Intrinsics:
    """Resolve the lens of a camera for pictures of this size.

    Raises `InputError` for a size of another shape than that which it was calibrated for.
    """
    width, height = size_px
    middle = 0.5 * (width - 1), 0.5 * (height - 1)
    if camera.fx_px is None:
        if camera.projection == "orthographic":
            f = height / camera.view_height_m
        elif camera.projection == "fisheye":
            f = height / float(np.radians(camera.fov_y_deg))
        else:
            f = 0.5 * height / float(np.tan(np.radians(camera.fov_y_deg) / 2.0))
        return Intrinsics(f, f, *middle)
    calibrated = camera.calibrated_px or size_px
    larger = height / calibrated[1]
    if abs(calibrated[0] * larger - width) > 1.0:
        raise InputError(
            f"camera.calibrated_px: pictures must have the shape of {calibrated[0]}x{calibrated[1]} "
            f"(got {width}x{height}); choose another size, or leave calibrated_px out"
        )
    fy = camera.fx_px if camera.fy_px is None else camera.fy_px
    # the middle of a pixel lies half a pixel from its edge at any size
    cx, cy = (
        middle[i] if c is None else (c + 0.5) * larger - 0.5 for i, c in enumerate((camera.cx_px, camera.cy_px))
    )
    return Intrinsics(camera.fx_px * larger, fy * larger, cx, cy)


def camera_view(camera: Camera, heights: HeightField, size_px: tuple[int, int]) -> View:
    """View of a camera whose lens is straight, for a picture of this size."""
    position, target = place(camera, heights)
    return pinhole_view(
        position,
        rolled(look_at(position, target), camera.roll_deg),
        intrinsics(camera, size_px),
        size_px,
        (camera.near_m, camera.far_m),
        parallel=camera.projection == "orthographic",
    )


def depth_row(near_m: float, far_m: float, *, parallel: bool) -> tuple[float, float]:
    """Last two numbers of the row of `clip_from_view` that clip z, −1 to 1, follows from."""
    if parallel:
        return -2.0 / (far_m - near_m), -(far_m + near_m) / (far_m - near_m)
    return (far_m + near_m) / (near_m - far_m), 2.0 * far_m * near_m / (near_m - far_m)


def matrices_of(camera: Camera, heights: HeightField, size_px: tuple[int, int]) -> tuple[Matrix, Matrix]:
    """`view_from_world` and `clip_from_view`, (4, 4); of a bent lens, those of the pinhole with its focal length."""
    view_from_world = rolled(look_at(*place(camera, heights)), camera.roll_deg)
    view = camera_view(camera, heights, size_px)
    return view_from_world, view.clip_from_world @ np.linalg.inv(view_from_world)


def pinhole_view(
    position: Matrix,
    view_from_world: Matrix,
    lens: Intrinsics,
    size_px: tuple[int, int],
    range_m: tuple[float, float],
    *,
    parallel: bool = False,
) -> View:
    """View from a position (3,), which the pose has as well but for rounding, through a lens without distortion."""
    (width, height), (near, far) = size_px, range_m
    clip_from_view = np.zeros((4, 4))
    half_width, half_height = 0.5 * width / lens.fx, 0.5 * height / lens.fy
    clip_from_view[0, 0], clip_from_view[1, 1] = 1.0 / half_width, 1.0 / half_height
    # clip coordinates of the principal point
    centre = 2.0 * (lens.cx + 0.5) / width - 1.0, 1.0 - 2.0 * (lens.cy + 0.5) / height
    clip_from_view[2, 2:] = depth_row(near, far, parallel=parallel)
    if parallel:
        clip_from_view[:2, 3] = centre
        clip_from_view[3, 3] = 1.0
    else:
        clip_from_view[:2, 2] = -centre[0], -centre[1]
        clip_from_view[3, 2] = -1.0
    rotation = view_from_world[:3, :3]
    axis = -rotation[2]
    aside = np.array([half_width * rotation[0], half_height * rotation[1]])
    fan = np.array([-(centre[0] * aside[0] + centre[1] * aside[1]), *aside])
    pixel = float(np.sqrt(4.0 * half_width * half_height / (width * height)))
    along = np.array([axis, np.zeros(3), np.zeros(3)])
    start = np.array([position, np.zeros(3), np.zeros(3)])
    return View(
        purpose="picture",
        clip_from_world=clip_from_view @ view_from_world,
        eye_ws=np.array([*(-axis), 0.0]) if parallel else np.array([*position, 1.0]),
        axis_ws=np.array([*axis, -axis @ position]),
        camera_ws=position,
        size_px=size_px,
        pixel_m=(0.0, pixel) if parallel else (pixel, 0.0),
        camera_pixel_m=(0.0, pixel) if parallel else (pixel, 0.0),
        rays_ws=along if parallel else along + fan,
        starts_ws=start + fan if parallel else start,
    )


# Cameras from matrices ----------------------------------------------------------------------------------------


def camera_from_matrices(
    view_from_world: npt.ArrayLike,
    clip_from_view: npt.ArrayLike,
    size_px: tuple[int, int],
    *,
    zero_to_one: bool = False,
) -> Camera:
    """The camera of a program's own matrices, (4, 4) each for column vectors: x right, y up, −z forward.

    Any pinhole or parallel projection: with roll, off-axis, unequal focal lengths, depth reversed or without a far
    plane. Clip z is −1 to 1, or with `zero_to_one` 0 to 1. Heights are those of the world. Raises `InputError` for
    matrices that are no pose or no such projection.
    """
    pose = _pose(view_from_world, "view_from_world")
    projection = _matrix(clip_from_view, (4, 4), "clip_from_view")
    (width, height), place = size_px, "clip_from_view"
    if abs(np.linalg.det(projection)) < 1e-30:
        raise InputError(f"{place}: must be a projection, which can be inverted (got a singular matrix)")
    parallel = not projection[3, :3].any()
    scale = projection[3, 3] if parallel else -projection[3, 2]
    rest = projection[3, :2] if parallel else projection[3, [0, 1, 3]]
    if not scale or np.abs(rest).max() > 1e-6 * abs(scale):
        raise InputError(
            f"{place}: its last row must be 0 0 -1 0, or 0 0 0 1 if parallel (got {_row(projection[3])})"
        )
    projection = projection / scale
    if np.abs(projection[[0, 1], [1, 0]]).max() > 1e-6 * np.abs(projection[[0, 1], [0, 1]]).max():
        raise InputError(f"{place}: pixels must be upright rectangles, without shear (got {_row(projection[0])})")
    if np.abs(projection[2, :2]).max() > 1e-6 * np.abs(projection[2, 2:]).max():
        raise InputError(
            f"{place}: depth must not depend on x and y, as in an oblique one (got {_row(projection[2])})"
        )
    if min(projection[0, 0], projection[1, 1]) <= 0.0:
        raise InputError(
            f"{place}: must not mirror the picture: x must grow to the right and y upwards "
            f"(got {projection[0, 0]:g} and {projection[1, 1]:g} on the diagonal)"
        )
    near, far = _range_m(projection, parallel, -1.0 if not zero_to_one else 0.0)
    if not parallel and near > _NEAREST_M:
        raise InputError(f"{place}: its near plane must be at most {_NEAREST_M:g} m away (got {near:g} m)")
    position = -pose[:3, :3].T @ pose[:3, 3]
    if parallel and near <= 0.0:
        # what lies behind the camera shows as well: from farther back it is before it
        back = 1.0 - near
        position, near, far = position + back * pose[2, :3], 1.0, far + back
    if parallel and near > 1.0:
        # likewise nearer, as the near plane of a camera is not farther than a kilometre
        position, near, far = position - (near - 1.0) * pose[2, :3], 1.0, far - (near - 1.0)
    far = min(far, _FARTHEST_M)
    centre = projection[:2, 3] if parallel else -projection[:2, 2]
    return _camera(
        pose,
        position,
        projection="orthographic" if parallel else "perspective",
        fx_px=0.5 * width * float(projection[0, 0]),
        fy_px=0.5 * height * float(projection[1, 1]),
        cx_px=0.5 * width * (1.0 + float(centre[0])) - 0.5,
        cy_px=0.5 * height * (1.0 - float(centre[1])) - 0.5,
        near_m=near,
        far_m=far,
    )


def camera_from_opencv(
    camera_matrix: npt.ArrayLike,
    camera_from_world: npt.ArrayLike,
    *,
    distortion: npt.ArrayLike = (),
    fisheye: bool = False,
    size_px: tuple[int, int] | None = None,
    near_m: float = 0.1,
    far_m: float = 5000.0,
) -> Camera:
    """The camera of a calibration: K (3, 3), and the pose (3, 4) or (4, 4) with x right, y down, z forward.

    The world is greensward's, y up. `distortion` holds up to five coefficients k1, k2, p1, p2, k3, and `size_px` is
    the size that was calibrated. Raises `InputError` for what is no camera matrix and no pose.
    """
    k = _matrix(camera_matrix, (3, 3), "camera_matrix")
    if np.abs(k[[0, 1, 2, 2], [1, 0, 0, 1]]).max() > 1e-6 * abs(k[0, 0]) or abs(k[2, 2] - 1.0) > 1e-6:
        raise InputError(f"camera_matrix: must be fx 0 cx / 0 fy cy / 0 0 1, without skew (got {_row(k.ravel())})")
    place = "camera_from_world"
    given = _numbers(camera_from_world, place)
    pose = _FROM_OPENCV @ _pose(
        np.concatenate([given, [[0.0, 0.0, 0.0, 1.0]]]) if given.shape == (3, 4) else given, place
    )
    return _camera(
        pose,
        -pose[:3, :3].T @ pose[:3, 3],
        projection="fisheye" if fisheye else "perspective",
        fx_px=float(k[0, 0]),
        fy_px=float(k[1, 1]),
        cx_px=float(k[0, 2]),
        cy_px=float(k[1, 2]),
        calibrated_px=size_px,
        distortion=tuple(_numbers(distortion, "distortion").ravel().tolist()),
        near_m=near_m,
        far_m=far_m,
    )


def _camera(pose: Matrix, position: Matrix, **lens: Any) -> Camera:
    forward = -pose[2, :3]
    target = position + _TARGET_M * forward
    level = look_at(position, target)
    # turn of the pose's axes against those of a level camera
    roll = float(np.degrees(np.arctan2(-pose[0, :3] @ level[1, :3], pose[0, :3] @ level[0, :3])))
    return Camera(
        position_m=(float(position[0]), float(position[1]), float(position[2])),
        target_m=(float(target[0]), float(target[1]), float(target[2])),
        height_above_ground=False,
        roll_deg=roll,
        **lens,
    )


def _range_m(projection: Matrix, parallel: bool, lowest: float) -> tuple[float, float]:
    """Depths of the near and the far plane, whichever end of clip space each is at."""
    # clip z is b - a · depth, and is divided by depth, or by 1 if parallel
    a, b = projection[2, 2], projection[2, 3]
    found = []
    for z in (lowest, 1.0):
        over, under = (b - z, a) if parallel else (b, a + z)
        # without a far plane a depth without end lands there
        found.append(float(over / under) if abs(under) > 1e-7 * abs(over) else np.inf)
    near, far = min(found, key=abs), max(found, key=abs)
    if parallel:
        near, far = min(found), max(found)
    if not far > 0.0 or far == near or (near <= 0.0 and not parallel):
        raise InputError(
            "clip_from_view: its near and far planes must lie before the eye, the near one nearer "
            f"(got {near:g} m and {far:g} m)"
        )
    return near, far


def _pose(given: npt.ArrayLike, place: str) -> Matrix:
    pose = _matrix(given, (4, 4), place)
    turn = pose[:3, :3]
    if np.abs(pose[3] - (0.0, 0.0, 0.0, 1.0)).max() > 1e-9:
        raise InputError(
            f"{place}: its last row must be 0 0 0 1 (got {_row(pose[3])}); transpose a row-vector matrix"
        )
    if np.abs(turn @ turn.T - np.eye(3)).max() > _RIGID:
        raise InputError(
            f"{place}: must be rigid, a rotation and a translation without scale or shear "
            f"(got a first row of length {np.linalg.norm(turn[0]):g})"
        )
    if np.linalg.det(turn) < 0.0:
        raise InputError(f"{place}: must not mirror (got a determinant of {np.linalg.det(turn):g})")
    # the nearest rotation: what single precision left must not shear the picture
    u, _, v = np.linalg.svd(turn)
    result = pose.copy()
    result[:3, :3] = u @ v
    return result


def _numbers(given: npt.ArrayLike, place: str) -> Matrix:
    try:
        return np.array(given, np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{place}: must be a matrix of numbers (got {type(given).__name__})") from None


def _matrix(given: npt.ArrayLike, shape: tuple[int, int], place: str) -> Matrix:
    matrix = _numbers(given, place)
    if matrix.shape != shape:
        raise InputError(f"{place}: must be a matrix of shape {shape} (got {matrix.shape})")
    if not np.isfinite(matrix).all():
        raise InputError(f"{place}: must be finite (got {_row(matrix[~np.isfinite(matrix)])})")
    return matrix


def _row(values: Matrix) -> str:
    return " ".join(f"{value:g}" for value in values)


def jitter(sample: int) -> tuple[float, float]:
    """Offset of a sub-sample from the pixel's centre, in pixels; the first is the centre itself (Halton 2, 3)."""
    if sample == 0:
        return 0.0, 0.0
    return _radical_inverse(sample, 2) - 0.5, _radical_inverse(sample, 3) - 0.5


def _radical_inverse(index: int, base: int) -> float:
    result, fraction = 0.0, 1.0 / base
    while index:
        index, digit = divmod(index, base)
        result += digit * fraction
        fraction /= base
    return result
