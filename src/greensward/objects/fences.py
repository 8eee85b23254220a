"""Fences as boxes: one for each post and rail."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from greensward.ground import HeightField
from greensward.objects.paths import line_of
from greensward.scene import Box, Fence, InputError, Scene
from greensward.scene.objects import Object

_MOST_BOXES = 50_000
_SUNK_M = 0.1
"""Depth of posts in the ground, so that none floats on a slope."""
_LEAN_DEG, _YAW_DEG, _PART, _ASKEW_M, _LOST, _BRIGHTNESS = 6.0, 24.0, 0.08, 0.06, 0.12, 0.14
"""Greatest lean, turn, change of size, displacement of rails, share of lost rails, and change of colour."""
Floats = npt.NDArray[np.float64]


def all_objects(scene: Scene, heights: HeightField) -> tuple[Object, ...]:
    """The objects of a scene as they are listed, and then the boxes of its fences.

    Raises `InputError` for more boxes than there is room for.
    """
    posts = [_evenly(line_of(fence.path, fence.smooth), fence.spacing_m) for fence in scene.fence]
    count = sum(len(at) + (len(at) - 1) * len(fence.rails_m) for fence, at in zip(scene.fence, posts, strict=True))
    if count > _MOST_BOXES:
        raise InputError(
            f"fence: must have at most {_MOST_BOXES:,} posts and rails together (got {count:,}); raise spacing_m, "
            "or have fewer or shorter fences"
        )
    fences = [
        _boxes(fence, at, heights, scene.seed, i)
        for i, (fence, at) in enumerate(zip(scene.fence, posts, strict=True))
    ]
    return (*scene.object, *(box for boxes in fences for box in boxes))


def _boxes(fence: Fence, at: Floats, heights: HeightField, seed: int, index: int) -> list[Box]:
    random, worn = np.random.default_rng([seed, 7919, index]), fence.weathered
    ways = np.gradient(at, axis=0)
    names = ("roughness", "weathered", "collides", "clears")
    same: dict[str, Any] = {name: getattr(fence, name) for name in names}

    def varied(shape: int | tuple[int, ...], most: float) -> Floats:
        return worn * most * random.uniform(-1.0, 1.0, shape)

    sizes = np.array(fence.post_m) * (1.0 + varied((len(at), 3), _PART)) + [0.0, _SUNK_M, 0.0]
    yaws = np.degrees(np.arctan2(-ways[:, 1], ways[:, 0])) + varied(len(at), _YAW_DEG)
    boxes = [
        Box(
            position_m=(x, -_SUNK_M, z), size_m=size, yaw_deg=yaw, roll_deg=lean,
            colour=_shaded(fence.colour, shade), **same,
        )
        for (x, z), size, yaw, lean, shade in zip(
            at, sizes, yaws, varied(len(at), _LEAN_DEG), varied(len(at), _BRIGHTNESS), strict=True
        )
    ]  # fmt: skip
    ground = heights.height(*at.T)
    for rail_m in fence.rails_m:
        tops = rail_m + varied(len(at), _ASKEW_M)
        lost = random.random(len(at)) < _LOST * worn
        shades = varied(len(at), _BRIGHTNESS)
        for k, (a, b) in enumerate(pairwise(at)):
            way = np.array([b[0] - a[0], ground[k + 1] + tops[k + 1] - ground[k] - tops[k], b[1] - a[1]])
            length_m = float(np.linalg.norm(way))
            if lost[k]:
                continue
            boxes.append(
                Box(
                    position_m=(a[0], tops[k], a[1]),
                    size_m=(fence.rail_m[0], length_m + 0.5 * fence.post_m[0], fence.rail_m[1]),
                    yaw_deg=math.degrees(math.atan2(-way[2], way[0])),
                    roll_deg=math.degrees(math.acos(way[1] / length_m)),
                    colour=_shaded(fence.colour, shades[k]),
                    **same,
                )
            )
    return boxes


def _evenly(line: Floats, spacing_m: float) -> Floats:
    """Points at equal distances along a line, (n, 2), no farther apart than that."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    at = np.linspace(0.0, along[-1], max(math.ceil(along[-1] / spacing_m - 1e-6), 1) + 1)
    return np.stack([np.interp(at, along, line[:, axis]) for axis in (0, 1)], axis=-1)


def _shaded(colour: str, by: float) -> str:
    """An sRGB colour, lighter or darker by a part."""
    parts: Sequence[int] = [round(min(max(int(colour[i : i + 2], 16) * (1.0 + by), 0), 255)) for i in (1, 3, 5)]
    return "#" + "".join(f"{part:02x}" for part in parts)
