"""Ground truth of a frame, read from its G-buffer: exact, one sample at each pixel's centre, never blended."""

import json
from collections.abc import Callable, Sequence
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.passes.gbuffer import GBuffer
from greensward.scene import Camera
from greensward.scene.classes import SurfaceClass
from greensward.sowing.identity import Ids
from greensward.viewpoint import intrinsics

Truth = dict[str, npt.NDArray[Any]]


def read_truth(gbuffer: GBuffer, aovs: Sequence[str], identify: Callable[..., Ids]) -> Truth:
    """Arrays of height × width (× channels), top row first, keyed by name.

    `depth` float32 metres along the view axis, inf for sky; `normal` float32 world space, 0 for sky; `class`
    uint8, a `SurfaceClass`; `blade_id` uint64, 0 where no blade shows; `motion` float32 pixels (right, down) since
    the previous frame; `albedo` float32 linear 0..1. `identify` finds ids by class and number.
    """
    truth: Truth = {}
    kinds, numbers, depth = gbuffer.read_surface()
    surface = np.isfinite(depth)[..., None]
    for name in aovs:
        if name == "depth":
            truth["depth"] = depth
        elif name == "normal":
            octahedral = _read(gbuffer.normal, np.float16, 4)[..., :2].astype(np.float32)
            truth["normal"] = np.where(surface, _decode_normal(octahedral), np.float32(0.0))
        elif name == "class":
            truth["class"] = kinds
        elif name == "blade_id":
            truth["blade_id"] = identify(kinds, numbers)
        elif name == "motion":
            # rows run down in a picture and up in OpenGL
            motion = _read(gbuffer.motion, np.float32, 2) * np.array([1.0, -1.0], np.float32)
            truth["motion"] = np.where(surface, motion, np.float32(0.0))
        else:
            coded = _read(gbuffer.colour, np.uint8, 4)[..., :3].astype(np.float32) / np.float32(255.0)
            truth["albedo"] = np.where(surface, coded * coded, np.float32(0.0))
    return truth


def camera_record(
    camera: Camera,
    clip_from_world: npt.NDArray[np.float64],
    view_from_world: npt.NDArray[np.float64],
    size: tuple[int, int],
) -> str:
    """Return the camera and the classes as JSON, for a reader of the arrays."""
    return json.dumps(
        {
            "size": list(size),
            "near_m": camera.near_m,
            "far_m": camera.far_m,
            "fov_y_deg": camera.fov_y_deg,
            "projection": camera.projection,
            "camera_matrix": intrinsics(camera, size).matrix.tolist(),
            "distortion": list(camera.distortion),
            "view_from_world": view_from_world.tolist(),
            "clip_from_world": clip_from_world.tolist(),
            "classes": {kind.name.lower(): int(kind) for kind in SurfaceClass},
        }
    )


def _read(texture: moderngl.Texture, dtype: Any, channels: int) -> npt.NDArray[Any]:
    flat = np.frombuffer(texture.read(), dtype)
    return flat.reshape(texture.height, texture.width, channels)[::-1].copy()


def _decode_normal(e: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """The twin of `octahedralDecode` in shaders/octahedral.glsl."""
    x, z = e[..., 0], e[..., 1]
    y = 1.0 - np.abs(x) - np.abs(z)
    below = np.maximum(-y, 0.0)
    n = np.stack([x - np.where(x >= 0, below, -below), y, z - np.where(z >= 0, below, -below)], -1)
    result: npt.NDArray[np.float32] = (n / np.linalg.norm(n, axis=-1, keepdims=True)).astype(np.float32)
    return result
