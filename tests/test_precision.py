"""Far from the origin the picture is as still, and moves as smoothly, as near it."""

import numpy as np
import pytest

from greensward.scene import Camera
from reprojection import world_points
from small_scenes import small_scene

_FAR = 10_240.0
_STEPS = [(0.0, 0.0), (0.0004, 0.0), (0.0011, -0.0007)]  # less than a float tells apart out there


def _camera(x: float, z: float) -> Camera:
    return Camera(
        position_m=(x, 0.35, z), target_m=(x, 0.2, z - 1.0), height_above_ground=False, near_m=0.05, fov_y_deg=60.0
    )


@pytest.mark.slow
@pytest.mark.parametrize("technique", ["bezier-blades", "visibility-buffer"])
@pytest.mark.parametrize("stage", ["fragment", "compute"])
@pytest.mark.parametrize("stored_m", [None, 0.0])
def test_motion_of_still_grass_is_that_of_the_camera(renderer, technique, stage, stored_m):
    if stored_m is not None and technique == "bezier-blades":
        pytest.skip("draws stored blades only")
    sowing = {"density_per_m2": 400.0} | ({} if stored_m is None else {"stored_m": stored_m})
    scene = small_scene(technique={"name": technique}, sowing=sowing, shadows={"enabled": False})
    drawn = renderer(scene, size=(320, 180), stage=stage)
    previous = None
    for time_s, (right, ahead) in enumerate(_STEPS):
        camera = _camera(_FAR + right, -_FAR + ahead)
        truth = drawn.render(float(time_s), camera=camera, aovs=["motion", "depth", "class", "blade_id"]).truth
        if previous is not None:
            shown = truth["blade_id"] > 0
            assert shown.mean() > 0.1
            points = world_points(drawn, camera, truth["depth"])[shown]
            now, before = (_pixels(drawn, each, points) for each in (camera, previous))
            error = np.abs(truth["motion"][shown] - (now - before)).max(1)
            assert np.quantile(error, 0.99) < 0.02, "pixels"
        previous = camera


def _pixels(drawn, camera: Camera, points: np.ndarray) -> np.ndarray:
    view_from_world, clip_from_view = drawn.camera_matrices(camera)
    clip = np.concatenate([points, np.ones((len(points), 1))], 1) @ (clip_from_view @ view_from_world).T
    return clip[:, :2] / clip[:, 3:] * 0.5 * np.array(drawn.size) * (1.0, -1.0)
