"""Views of a scene's camera: matrices and rays of the picture."""

import numpy as np
import numpy.typing as npt

from greensward.gpu.view import View, look_at, perspective
from greensward.ground import HeightField
from greensward.scene import Camera, InputError


def place(camera: Camera, heights: HeightField) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
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


def camera_view(camera: Camera, heights: HeightField, size_px: tuple[int, int]) -> View:
    """View of a camera for a picture of this size."""
    position, target = place(camera, heights)
    view_from_world = look_at(position, target)
    clip_from_view = perspective(camera.fov_y_deg, size_px[0] / size_px[1], camera.near_m, camera.far_m)
    axis = -view_from_world[2, :3]
    half_height = np.tan(np.radians(camera.fov_y_deg) / 2.0)
    half_width = half_height * size_px[0] / size_px[1]
    return View(
        purpose="picture",
        clip_from_world=clip_from_view @ view_from_world,
        eye_ws=np.array([*position, 1.0]),
        axis_ws=np.array([*axis, -axis @ position]),
        camera_ws=position,
        size_px=size_px,
        pixel_m=(2.0 * half_height / size_px[1], 0.0),
        camera_pixel_m=2.0 * half_height / size_px[1],
        rays_ws=np.array([axis, half_width * view_from_world[0, :3], half_height * view_from_world[1, :3]]),
    )


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
