"""Ground truth of a frame, read from its G-buffer: exact, one sample at each pixel's centre, never blended."""

import json
from collections.abc import Sequence
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.passes.gbuffer import GBuffer
from greensward.scene import Camera, InputError

AOVS = ("depth", "normal", "class", "blade-id", "motion", "albedo")
CLASSES = {"sky": 0, "ground": 1, "grass": 2, "flower": 3, "object": 4, "water": 5}

Truth = dict[str, npt.NDArray[Any]]


def read_truth(gbuffer: GBuffer, aovs: Sequence[str]) -> Truth:
    """Arrays of height × width (× channels), top row first, keyed by name with `_` for `-`.

    `depth` float32 metres along the view axis, inf for sky; `normal` float32 world space, 0 for sky; `class`
    uint8; `blade_id` uint32, 0 where no blade shows; `motion` float32 pixels (right, down) since the frame
    before; `albedo` float32 linear 0..1. Raises `InputError` for an unknown name.
    """
    unknown = [name for name in aovs if name not in AOVS]
    if unknown:
        raise InputError(f"--aov: unknown output {unknown[0]}; choose from {', '.join(AOVS)}")
    truth: Truth = {}
    depth = _read(gbuffer.depth, np.float32, 1)
    surface = np.isfinite(depth)
    for name in aovs:
        if name == "depth":
            truth["depth"] = depth[..., 0]
        elif name == "normal":
            octahedral = _read(gbuffer.normal, np.float16, 4)[..., :2].astype(np.float32)
            truth["normal"] = np.where(surface, _decode_normal(octahedral), np.float32(0.0))
        elif name == "class":
            truth["class"] = (_read(gbuffer.id, np.uint32, 1)[..., 0] >> 27).astype(np.uint8)
        elif name == "blade-id":
            truth["blade_id"] = _read(gbuffer.id, np.uint32, 1)[..., 0] & np.uint32(0x7FFFFFF)
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
    """What a reader of the arrays needs to know of the camera and the classes, as JSON."""
    return json.dumps(
        {
            "size": list(size),
            "near_m": camera.near_m,
            "far_m": camera.far_m,
            "fov_y_deg": camera.fov_y_deg,
            "view_from_world": view_from_world.tolist(),
            "clip_from_world": clip_from_world.tolist(),
            "classes": CLASSES,
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
