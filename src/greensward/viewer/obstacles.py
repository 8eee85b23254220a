"""Collision of the camera with the objects of a scene: bounding boxes and elliptic cylinders."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from greensward.ground import HeightField
from greensward.objects.fences import all_objects
from greensward.objects.meshes import Shape, mesh_of, unit_shape
from greensward.objects.placing import Placing
from greensward.scene import Box, Capsule, GreenswardError, Mesh, Scene
from greensward.scene.objects import Object

Floats = npt.NDArray[np.float64]
_SHOULDER_M, _STEP_M = 0.28, 0.45
_PROBES = 6


class Obstacles:
    """Obstacles at one time."""

    def __init__(
        self, objects: Sequence[Object], placing: Placing | None = None, resolve: Callable[[str], Path] = Path
    ) -> None:
        solid = [i for i, each in enumerate(objects) if each.drawn]
        self._indices, self._placing = solid, placing
        boxes: dict[Shape, Floats] = {}
        shapes = [unit_shape(objects[i]) for i in solid]
        for shape, _ in shapes:
            boxes[shape] = boxes[shape] if shape in boxes else _half_extents(shape, resolve)
        self._half = np.array([boxes[shape] * size for shape, size in shapes]).reshape(-1, 3)
        self._centre = self._half * [0.0, 1.0, 0.0]
        self._round = np.array([not isinstance(objects[i], Box) for i in solid], bool)
        self._tapers = np.array([objects[i].kind in ("sphere", "mesh") for i in solid], bool)
        self.at(0.0)

    @classmethod
    def of(cls, scene: Scene, heights: HeightField) -> "Obstacles":
        """Return the obstacles of a scene."""
        objects = all_objects(scene, heights)
        return cls(objects, Placing(objects, heights), scene.resolve)

    def at(self, time_s: float) -> None:
        """Move the obstacles to their positions at a time."""
        if self._placing is not None and self._indices:
            self._object_from_world = np.linalg.inv(self._placing.at(time_s)[self._indices])
        else:
            self._object_from_world = np.zeros((0, 4, 4))

    def push(self, eye_ws: Floats, feet_m: float) -> Floats:
        """Return the offset, (x, z), that moves the camera out of all obstacles."""
        moved = np.zeros(2)
        if not len(self._object_from_world):
            return moved
        bottom = min(feet_m + _STEP_M, float(eye_ws[1]))
        for height_m in np.linspace(bottom, float(eye_ws[1]), _PROBES):
            at = np.array([eye_ws[0] + moved[0], height_m, eye_ws[2] + moved[1], 1.0])
            local = (self._object_from_world @ at)[:, :3] - self._centre
            level = np.abs(local[:, 1]) - self._half[:, 1]
            near = (level < 0.15) & (np.abs(local[:, [0, 2]]) < self._half[:, [0, 2]] + _SHOULDER_M).all(axis=1)
            for k in np.flatnonzero(near):
                offset = self._offset(int(k), local[k])
                # back to the world: the inverse of a rotation is its transpose
                moved += (self._object_from_world[k, :3, :3].T @ np.array([offset[0], 0.0, offset[1]]))[[0, 2]]
        return moved

    def _offset(self, k: int, local: Floats) -> Floats:
        half = self._half[k][[0, 2]]
        at = local[[0, 2]]
        if self._round[k]:
            if self._tapers[k]:
                half = half * math.sqrt(max(1.0 - min(abs(local[1]) / self._half[k, 1], 1.0) ** 2, 0.0))
            reach = half + _SHOULDER_M
            radius = float(np.hypot(*(at / reach)))  # 1 on the ellipse
            if radius >= 1.0:
                return np.zeros(2)
            return at * (1.0 / radius - 1.0) if radius > 1e-6 else np.array([reach[0], 0.0])
        inside = half + _SHOULDER_M - np.abs(at)
        axis = int(inside.argmin())
        offset = np.zeros(2)
        offset[axis] = math.copysign(max(float(inside[axis]), 0.0), float(at[axis]))
        return offset


def _half_extents(shape: Shape, resolve: Callable[[str], Path]) -> Floats:
    match shape:
        case Capsule():
            return np.array([shape.radius_m, 0.5 * shape.length_m, shape.radius_m])
        case Mesh():
            try:
                low, high = mesh_of(shape, resolve).bounds
            except GreenswardError:
                return np.zeros(3)  # the renderer reports it
            return np.array(0.5 * (high - low))
        case _:
            return 0.5 * np.array(shape.size_m)
