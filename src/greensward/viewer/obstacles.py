"""What someone who walks runs into: boxes and rounds around the objects of a scene."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from greensward.ground import HeightField
from greensward.io.meshes import read_mesh
from greensward.objects.placing import Placing
from greensward.scene import Box, Capsule, GreenswardError, Mesh, Scene
from greensward.scene.objects import Object

Floats = npt.NDArray[np.float64]
_SHOULDER_M, _STEP_M = 0.28, 0.45
_PROBES = 6


class Obstacles:
    """The objects of a scene at an instant."""

    def __init__(
        self, things: Sequence[Object], placing: Placing | None = None, resolve: Callable[[str], Path] = Path
    ) -> None:
        solid = [i for i, thing in enumerate(things) if thing.drawn]
        self._which, self._placing = solid, placing
        boxes = [_box(things[i], resolve) for i in solid]
        self._half = np.array([half for half, _ in boxes]).reshape(-1, 3)
        self._middle = np.array([middle for _, middle in boxes]).reshape(-1, 3)
        self._round = np.array([not isinstance(things[i], Box) for i in solid], bool)
        self._tapers = np.array([things[i].kind in ("sphere", "mesh") for i in solid], bool)
        self.at(0.0)

    @classmethod
    def of(cls, scene: Scene, heights: HeightField) -> "Obstacles":
        """Those of a scene."""
        return cls(scene.object, Placing(scene.object, heights), scene.resolve)

    def at(self, time_s: float) -> None:
        """Where they are at an instant."""
        if self._placing is not None and self._which:
            self._own_from_world = np.linalg.inv(self._placing.at(time_s)[self._which])
        else:
            self._own_from_world = np.zeros((0, 4, 4))

    def push(self, eye_ws: Floats, feet_m: float) -> Floats:
        """How far, (x, z), someone whose eye is there must step aside so as to stand in nothing."""
        moved = np.zeros(2)
        if not len(self._own_from_world):
            return moved
        bottom = min(feet_m + _STEP_M, float(eye_ws[1]))
        for height_m in np.linspace(bottom, float(eye_ws[1]), _PROBES):
            at = np.array([eye_ws[0] + moved[0], height_m, eye_ws[2] + moved[1], 1.0])
            own = (self._own_from_world @ at)[:, :3] - self._middle
            level = np.abs(own[:, 1]) - self._half[:, 1]
            near = (level < 0.15) & (np.abs(own[:, [0, 2]]) < self._half[:, [0, 2]] + _SHOULDER_M).all(axis=1)
            for k in np.flatnonzero(near):
                aside = self._aside(int(k), own[k])
                # back to the world: the inverse of a rotation is its transpose
                moved += (self._own_from_world[k, :3, :3].T @ np.array([aside[0], 0.0, aside[1]]))[[0, 2]]
        return moved

    def _aside(self, k: int, own: Floats) -> Floats:
        half = self._half[k][[0, 2]]
        at = own[[0, 2]]
        if self._round[k]:
            if self._tapers[k]:
                half = half * math.sqrt(max(1.0 - min(abs(own[1]) / self._half[k, 1], 1.0) ** 2, 0.0))
            reach = half + _SHOULDER_M
            part = float(np.hypot(*(at / reach)))
            if part >= 1.0:
                return np.zeros(2)
            return at * (1.0 / part - 1.0) if part > 1e-6 else np.array([reach[0], 0.0])
        inside = half + _SHOULDER_M - np.abs(at)
        axis = int(inside.argmin())
        aside = np.zeros(2)
        aside[axis] = math.copysign(max(float(inside[axis]), 0.0), float(at[axis]))
        return aside


def _box(thing: Object, resolve: Callable[[str], Path]) -> tuple[Floats, Floats]:
    """Half extents and middle of an object in its own space, whose origin is the centre of its base."""
    match thing:
        case Capsule():
            half = np.array([thing.radius_m, 0.5 * thing.length_m, thing.radius_m])
        case Mesh():
            try:
                bounds = read_mesh(resolve(thing.file)).bounds * thing.scale
            except (GreenswardError, ImportError):
                return np.zeros(3), np.zeros(3)  # whoever draws it says what is wrong
            low, high = np.asarray(bounds, np.float64)
            return 0.5 * (high - low), np.array(
                [0.5 * (low[0] + high[0]), 0.5 * (high[1] - low[1]), 0.5 * (low[2] + high[2])]
            )
        case _:
            half = 0.5 * np.array(thing.size_m)
    return half, np.array([0.0, half[1], 0.0])
