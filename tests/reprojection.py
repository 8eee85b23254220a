"""From the ground truth of a picture back to points in space."""

import numpy as np

from greensward.renderer import Renderer
from greensward.scene import Camera


def world_points(drawn: Renderer, camera: Camera, depth: np.ndarray) -> np.ndarray:
    """Points (height, width, 3) at the pixels' centres and depths."""
    view_from_world, clip_from_view = drawn.camera_matrices(camera)
    height, width = depth.shape
    x = (np.arange(width) + 0.5) / width * 2 - 1
    y = 1 - (np.arange(height) + 0.5) / height * 2
    in_view = np.stack(
        [
            x[None, :] / clip_from_view[0, 0] * depth,
            y[:, None] / clip_from_view[1, 1] * depth,
            -depth,
            np.ones_like(depth),
        ],
        -1,
    )
    with np.errstate(invalid="ignore"):
        return (in_view @ np.linalg.inv(view_from_world).T)[..., :3]
