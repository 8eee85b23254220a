"""Where every object is at an instant: as the scene has it, along its path, or as a program says."""

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from greensward.ground import HeightField
from greensward.scene import InputError, Path
from greensward.scene.objects import Object

Floats = npt.NDArray[np.float64]
Script = Callable[[float], npt.ArrayLike]
"""Time in seconds to the centre of an object's base, (3,) with y above the ground, or to its whole matrix, (4, 4)."""
_STEPS = 32  # per key, in which the rolling of a ball is added up


def turn(yaw_deg: float, lean_deg: float) -> Floats:
    """Rotation (3, 3): lean from the vertical towards local x, then turn about the vertical."""
    yaw, lean = math.radians(yaw_deg), math.radians(-lean_deg)
    about_y = np.array([[math.cos(yaw), 0, math.sin(yaw)], [0, 1, 0], [-math.sin(yaw), 0, math.cos(yaw)]])
    about_z = np.array([[math.cos(lean), -math.sin(lean), 0], [math.sin(lean), math.cos(lean), 0], [0, 0, 1]])
    result: Floats = about_y @ about_z
    return result


def about(axis: Floats, angle: float) -> Floats:
    """Rotation (3, 3) by an angle about a unit axis (Rodrigues)."""
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    result: Floats = np.eye(3) + math.sin(angle) * k + (1.0 - math.cos(angle)) * (k @ k)
    return result


class Track:
    """A path through its keys."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._times = np.array(path.times_s)
        yaws = path.yaws_deg or (0.0,) * len(path.times_s)
        self._keys = np.column_stack([np.array(path.positions_m), np.array(yaws)])
        # tangents of a curve through all keys: Catmull & Rom 1974, for times that need not be even
        self._slopes = np.gradient(self._keys, self._times, axis=0) if path.smooth else None

    def within(self, time_s: float) -> float:
        """The time on the path, between its first and last key, that an instant means."""
        first, last = self._times[0], self._times[-1]
        span = last - first
        match self._path.after:
            case "repeat":
                return float(first + (time_s - first) % span) if time_s > first else float(first)
            case "return":
                return float(first + span - abs(span - (time_s - first) % (2.0 * span))) if time_s > first else first
            case _:
                return float(np.clip(time_s, first, last))

    def at(self, time_s: float) -> Floats:
        """Position and yaw in degrees, (4,), at a time on the path."""
        i = int(np.clip(np.searchsorted(self._times, time_s, side="right") - 1, 0, len(self._times) - 2))
        span = self._times[i + 1] - self._times[i]
        t = (time_s - self._times[i]) / span
        a, b = self._keys[i], self._keys[i + 1]
        result: Floats = a + t * (b - a)
        if self._slopes is not None:
            # cubic Hermite
            result += (
                t
                * (1.0 - t)
                * ((1.0 - t) * (self._slopes[i] * span - b + a) - t * (self._slopes[i + 1] * span - b + a))
            )
        return result


class Placing:
    """The matrices of a scene's objects over time."""

    def __init__(
        self, things: Sequence[Object], heights: HeightField, scripts: Mapping[str, Script] | None = None
    ) -> None:
        self._things, self._heights = things, heights
        names = {thing.name for thing in things if thing.name}
        for name in scripts or {}:
            if name not in names:
                raise InputError(f"scripts: no object of the scene is named {name!r}; named are {sorted(names)}")
        self._scripts = [(scripts or {}).get(thing.name) if thing.name else None for thing in things]
        self._tracks = [Track(thing.path) if thing.path else None for thing in things]
        self._rolled = {i: self._rolling(i) for i, thing in enumerate(things) if thing.path and thing.path.rolls}
        self.moving = [
            script is not None or track is not None for script, track in zip(self._scripts, self._tracks, strict=True)
        ]
        self._still = np.stack([self._place(i, 0.0) for i in range(len(things))]) if things else np.zeros((0, 4, 4))

    def at(self, time_s: float) -> Floats:
        """World from own space of every object, (objects, 4, 4)."""
        placed = self._still.copy()
        for i, moves in enumerate(self.moving):
            if moves:
                placed[i] = self._place(i, time_s)
        return placed

    def _place(self, i: int, time_s: float) -> Floats:
        thing, script, track = self._things[i], self._scripts[i], self._tracks[i]
        matrix = np.eye(4)
        matrix[:3, :3] = turn(thing.yaw_deg, thing.lean_deg)
        position = np.array(thing.position_m)
        if script is not None:
            given = np.asarray(script(time_s), np.float64)
            if given.shape not in ((3,), (4, 4)) or not np.isfinite(given).all():
                raise InputError(
                    f"scripts: {thing.name}: must return 3 finite numbers or a 4 × 4 matrix (got {given.tolist()})"
                )
            if given.shape == (4, 4):
                return given
            position = given
        elif track is not None:
            on_path = track.within(time_s)
            *position, yaw = track.at(on_path)  # type: ignore[assignment]
            matrix[:3, :3] = turn(thing.yaw_deg + float(yaw), thing.lean_deg)
            if i in self._rolled:
                matrix[:3, :3] = self._rolled[i](on_path) @ matrix[:3, :3]
        x, y, z = (float(v) for v in position)
        matrix[:3, 3] = x, y + float(self._heights.height(x, z)), z
        if i in self._rolled:
            # it turns about its middle, not about its base
            middle = np.array([0.0, 0.5 * _height_of(thing), 0.0])
            matrix[:3, 3] += middle - matrix[:3, :3] @ middle
        return matrix

    def _rolling(self, i: int) -> Callable[[float], Floats]:
        """How far a ball has rolled at a time on its path, added up along it."""
        track = self._tracks[i]
        assert track is not None
        times = np.concatenate(
            [np.linspace(a, b, _STEPS, endpoint=False) for a, b in zip(track._times, track._times[1:], strict=False)]
            + [track._times[-1:]]
        )
        places = np.stack([track.at(t)[[0, 2]] for t in times])
        radius = 0.5 * _height_of(self._things[i])
        turns = [np.eye(3)]
        for step in np.diff(places, axis=0):
            turns.append(_rolled(step, radius) @ turns[-1])

        def at(time_s: float) -> Floats:
            k = int(np.clip(np.searchsorted(times, time_s, side="right") - 1, 0, len(times) - 1))
            return _rolled(track.at(time_s)[[0, 2]] - places[k], radius) @ turns[k]

        return at


def _rolled(step: Floats, radius: float) -> Floats:
    """How a ball turns that rolls by a step (x, z)."""
    way = float(np.hypot(*step))
    if way < 1e-12:
        return np.eye(3)
    return about(np.array([step[1], 0.0, -step[0]]) / way, way / radius)


def _height_of(thing: Object) -> float:
    """Height of a solid; a mesh rolls as a ball of one metre times its scale."""
    if hasattr(thing, "size_m"):
        return float(thing.size_m[1])
    return float(getattr(thing, "length_m", 0.0) or getattr(thing, "scale", 1.0))
