"""Matrices of all objects at an instant: as the scene has them, along their paths, or scripted."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from greensward.ground import HeightField
from greensward.scene import Capsule, InputError, Mesh, Path
from greensward.scene.objects import Object

Floats = npt.NDArray[np.float64]
Script = Callable[[float], npt.ArrayLike]
"""Time in seconds to the centre of an object's base, (3,) with y above the ground, or to its whole matrix, (4, 4)."""
_STEPS = 32  # per key, in which the rolling of a ball is added up
_MOST_ROLLING_KEYS = 100_000


def about(axis: Floats, angle: float) -> Floats:
    """Rotation (3, 3) by an angle about a unit axis (Rodrigues)."""
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    result: Floats = np.eye(3) + math.sin(angle) * k + (1.0 - math.cos(angle)) * (k @ k)
    return result


def tilt(pitch_deg: float, roll_deg: float) -> Floats:
    """Rotation (3, 3): about own z, which leans towards own x, then about own x, which lifts own -z."""
    pitch, roll = about(np.array([1.0, 0.0, 0.0]), math.radians(pitch_deg)), math.radians(-roll_deg)
    result: Floats = pitch @ about(np.array([0.0, 0.0, 1.0]), roll)
    return result


def about_y(angle: Floats) -> Floats:
    """Rotations (n, 3, 3) about the vertical by angles (n,)."""
    result = np.zeros((len(angle), 3, 3))
    result[:, 0, 0] = result[:, 2, 2] = np.cos(angle)
    result[:, 0, 2], result[:, 1, 1] = np.sin(angle), 1.0
    result[:, 2, 0] = -result[:, 0, 2]
    return result


def finite_vector(name: str, given: npt.ArrayLike) -> Floats:
    """Three finite numbers, float64 (3,). Raises `InputError` with the name of what was given."""
    try:
        vector = np.array(given, np.float64)
    except (TypeError, ValueError):
        vector = np.zeros(0)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise InputError(f"{name}: must be three finite numbers (got {given!r})")
    return vector


def refuse_unknown(wanted: Iterable[str], objects: Sequence[Object], place: str) -> None:
    """Raise `InputError` for a name that no object has."""
    names = {each.name for each in objects if each.name}
    own = sorted(name for name in names if not name.startswith("wind["))
    for name in wanted:
        if name not in names:
            named = f"; named are {', '.join(own)}" if own else ""
            raise InputError(f"{place}: no object of the scene is named {name!r}{named}")


def placed_at(name: str, given: npt.ArrayLike) -> Floats:
    """Centre of an object's base, (3,), or its rigid matrix, (4, 4). Raises `InputError` for anything else."""
    try:
        placed = np.array(given, np.float64)
    except (TypeError, ValueError):
        placed = np.zeros(0)
    if placed.shape not in ((3,), (4, 4)) or not np.isfinite(placed).all():
        raise InputError(f"{name}: must be 3 finite numbers or a 4 × 4 matrix (got {placed.tolist() or given!r})")
    if placed.shape == (4, 4):
        turned = placed[:3, :3]
        rigid = np.allclose(turned @ turned.T, np.eye(3), atol=1e-4) and np.linalg.det(turned) > 0.0
        if not rigid or not np.array_equal(placed[3], (0.0, 0.0, 0.0, 1.0)):
            raise InputError(
                f"{name}: must be a matrix that only turns and moves, for column vectors "
                f"(got {placed.round(4).tolist()})"
            )
    return placed


class Placed:
    """Place of an object that a host moves from frame to frame: a script that moves evenly from one to the next.

    Places are matrices, (4, 4), but for that of an object that the scene does not have yet, which may be (3,).
    """

    def __init__(self) -> None:
        self._wanted: Floats | None = None
        self._before: tuple[float, Floats] | None = None
        self._now: tuple[float, Floats] | None = None

    def begin(self, time_s: float, where: Floats) -> None:
        """Have been there at an instant."""
        self._now = time_s, where

    def put(self, where: Floats) -> None:
        """Be there at the next frame: (3,) or (4, 4)."""
        self._wanted = where

    def arrive(self, time_s: float) -> None:
        """Be there at this instant."""
        if self._wanted is None:
            return
        if self._now is not None and self._now[0] < time_s and self._now[1].shape == self._wanted.shape:
            self._before = self._now
        else:
            self._before = None if self._now is None or self._now[0] != time_s else self._before
        self._now = time_s, self._wanted

    @property
    def is_placed(self) -> bool:
        """True once it has been put anywhere."""
        return self._wanted is not None

    def __call__(self, time_s: float) -> Floats:
        """Return where it is at an instant between the last two frames."""
        assert self._wanted is not None
        if self._now is None:
            return self._wanted
        if self._before is None or time_s >= self._now[0]:
            return self._now[1]
        (start_s, start), (end_s, end) = self._before, self._now
        part = max((time_s - start_s) / (end_s - start_s), 0.0)
        result: Floats = start + part * (end - start)
        if result.shape == (4, 4):
            # the rotation that is nearest to the mean of both
            u, _, v = np.linalg.svd(result[:3, :3])
            result[:3, :3] = u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v
        return result


class Tracks:
    """All paths of a scene at once: keys one after the other, those of one path after those of another."""

    def __init__(self, paths: Sequence[Path]) -> None:
        counts = np.array([len(path.times_s) for path in paths], np.int64)
        self._start = np.cumsum(counts) - counts
        self._last = self._start + counts - 1
        self._times = np.concatenate([np.array(path.times_s) for path in paths] or [np.zeros(0)])
        self._keys = np.concatenate(
            [
                np.column_stack([np.array(path.positions_m), np.array(path.yaws_deg or [0.0] * len(path.times_s))])
                for path in paths
            ]
            or [np.zeros((0, 4))]
        )
        # tangents of a Catmull-Rom spline with non-uniform knots
        self._slopes = np.concatenate(
            [
                np.gradient(self._keys[a : b + 1], self._times[a : b + 1], axis=0)
                for a, b in zip(self._start, self._last, strict=True)
            ]
            or [np.zeros((0, 4))]
        )
        self._smooth = np.array([[path.smooth] for path in paths], bool).reshape(-1, 1)
        after = np.array([("stop", "repeat", "return").index(path.after) for path in paths], np.int64)
        self._repeats, self._returns = after == 1, after == 2
        # so that one search finds the segment of every path
        self._shift = np.arange(len(paths)) * (float(np.ptp(self._times)) + 1.0 if paths else 0.0)
        self._search = self._times + np.repeat(self._shift, counts)

    def within(self, time_s: float) -> Floats:
        """The time on each path, between its first and last key, that an instant means."""
        first, last = self._times[self._start], self._times[self._last]
        since, span = np.maximum(time_s - first, 0.0), last - first
        again = np.where(self._returns, span - np.abs(span - since % (2.0 * span)), since % span)
        result: Floats = first + np.where(self._repeats | self._returns, again, np.minimum(since, span))
        return result

    def at(self, on_path: Floats) -> Floats:
        """Position and yaw in degrees, (paths, 4), at a time on each path."""
        i = np.searchsorted(self._search, on_path + self._shift, side="right") - 1
        i = np.clip(i, self._start, self._last - 1)
        span = (self._times[i + 1] - self._times[i])[:, None]
        t = (on_path - self._times[i])[:, None] / span
        a, chord = self._keys[i], self._keys[i + 1] - self._keys[i]
        # cubic Hermite, as what it adds to the straight line
        bow = (
            t * (1.0 - t) * ((1.0 - t) * (self._slopes[i] * span - chord) - t * (self._slopes[i + 1] * span - chord))
        )
        result: Floats = a + t * chord + np.where(self._smooth, bow, 0.0)
        return result


class Placing:
    """The matrices of a scene's objects over time."""

    def __init__(
        self, objects: Sequence[Object], heights: HeightField, scripts: Mapping[str, Script] | None = None
    ) -> None:
        self._heights = heights
        refuse_unknown(scripts or (), objects, "scripts")
        self._names = [each.name for each in objects]
        self._scripts = {
            i: (each.name, scripts[each.name]) for i, each in enumerate(objects) if scripts and each.name in scripts
        }
        self._on_path = np.array(
            [i for i, each in enumerate(objects) if each.path and i not in self._scripts], np.int64
        )
        self.moving = [i in self._scripts or each.path is not None for i, each in enumerate(objects)]
        self._tilt = np.array([tilt(each.pitch_deg, each.roll_deg) for each in objects]).reshape(-1, 3, 3)
        self._yaw = np.radians([each.yaw_deg for each in objects])
        paths = [path for i in self._on_path if (path := objects[i].path)]
        self._tracks = Tracks(paths)
        self._middle = np.array([[0.0, 0.5 * height_of(objects[i]), 0.0] for i in self._on_path]).reshape(-1, 3)
        self._rolls = np.array([k for k, path in enumerate(paths) if path.rolls], np.int64)
        rolling_keys = sum(len(paths[k].times_s) for k in self._rolls)
        if rolling_keys > _MOST_ROLLING_KEYS:
            raise InputError(
                f"object: paths that roll must have at most {_MOST_ROLLING_KEYS:,} keys together "
                f"(got {rolling_keys:,}); use fewer times_s, or rolls = false"
            )
        self._rolling = _Rolling([paths[k] for k in self._rolls], self._middle[self._rolls, 1])
        self._still = np.tile(np.eye(4), (len(objects), 1, 1))
        self._stand(slice(None), np.array([each.position_m for each in objects]).reshape(-1, 3), self._still)
        self._still[:, :3, :3] = about_y(self._yaw) @ self._tilt

    def index(self, name: str) -> int | None:
        """Number of the object with a name; None where there is none."""
        return next((i for i, each in enumerate(self._names) if each == name), None)

    def matrix(self, index: int, where: Floats) -> Floats:
        """Matrix (4, 4) of an object in a place: its own, or that of the centre of its base, (3,)."""
        if where.shape == (4, 4):
            return where
        placed = self._still[[index]].copy()
        self._stand([0], where[None], placed)
        result: Floats = placed[0]
        return result

    def _stand(self, at: slice | list[int] | npt.NDArray[np.int64], positions: Floats, matrices: Floats) -> None:
        """Put objects at positions whose y counts from the ground."""
        matrices[at, :3, 3] = positions
        matrices[at, 1, 3] += self._heights.height(positions[:, 0], positions[:, 2])

    def at(self, time_s: float) -> Floats:
        """World from own space of every object, (objects, 4, 4)."""
        placed = self._still.copy()
        if len(self._on_path):
            on_path = self._tracks.within(time_s)
            keys = self._tracks.at(on_path)
            turns = about_y(self._yaw[self._on_path] + np.radians(keys[:, 3])) @ self._tilt[self._on_path]
            rolls = self._rolls
            if len(rolls):
                turns[rolls] = self._rolling.at(on_path[rolls], keys[rolls][:, [0, 2]]) @ turns[rolls]
            placed[self._on_path, :3, :3] = turns
            self._stand(self._on_path, keys[:, :3], placed)
            # what rolls turns about its middle, not about its base
            middle = self._middle[rolls]
            placed[self._on_path[rolls], :3, 3] += middle - np.einsum("nij,nj->ni", turns[rolls], middle)
        for i, (name, script) in self._scripts.items():
            if isinstance(script, Placed) and not script.is_placed:
                continue  # where the scene has it, until a host says otherwise
            given = placed_at(f"scripts: {name}", script(time_s))
            if given.shape == (4, 4):
                placed[i] = given
            else:
                self._stand([i], given[None], placed)
        return placed


class _Rolling:
    """Rotations of balls that roll along their paths, integrated in small steps: those of one after another's."""

    def __init__(self, paths: Sequence[Path], radii: Floats) -> None:
        times = [_finely(np.array(path.times_s)) for path in paths]
        counts = np.array([len(each) for each in times], np.int64)
        self._start, self._radii = np.cumsum(counts) - counts, radii
        self._places = np.concatenate(
            [Tracks([path]).at(each)[:, [0, 2]] for path, each in zip(paths, times, strict=True)]
            or [np.zeros((0, 2))]
        )
        # so that one search finds the step of every path
        joined = np.concatenate(times or [np.zeros(0)])
        self._shift = np.arange(len(paths)) * (float(np.ptp(joined)) + 1.0 if paths else 0.0)
        self._search = joined + np.repeat(self._shift, counts)
        self._turns = np.tile(np.eye(3), (len(joined), 1, 1))
        steps = _rolled(np.diff(self._places, axis=0, append=0.0), np.repeat(radii, counts))
        for k in range(1, int(counts.max(initial=0))):
            now = self._start[counts > k] + k
            self._turns[now] = steps[now - 1] @ self._turns[now - 1]

    def at(self, on_path: Floats, places: Floats) -> Floats:
        """Rotations (n, 3, 3) at a time on each path, where the balls are at `places`, (n, 2)."""
        k = np.searchsorted(self._search, on_path + self._shift, side="right") - 1
        k = np.maximum(k, self._start)
        result: Floats = _rolled(places - self._places[k], self._radii) @ self._turns[k]
        return result


def _finely(times: Floats) -> Floats:
    """The times, and more between them."""
    steps = np.arange(_STEPS) * (np.diff(times) / _STEPS)[:, None]
    return np.append((times[:-1, None] + steps).ravel(), times[-1])


def _rolled(steps: Floats, radii: Floats) -> Floats:
    """Rotations (n, 3, 3) of balls that roll by steps, x and z, (n, 2), about a horizontal axis (Rodrigues)."""
    length = np.hypot(*steps.T)
    axis = steps / np.maximum(length, 1e-12)[:, None]
    k = np.zeros((len(steps), 3, 3))
    k[:, 1, 0], k[:, 1, 2] = -axis[:, 0], -axis[:, 1]
    k[:, 0, 1], k[:, 2, 1] = axis[:, 0], axis[:, 1]
    angle = (length / radii)[:, None, None]
    result: Floats = np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * (k @ k)
    return result


def height_of(shape: Object) -> float:
    """Height of a solid in its own space; 0 of a mesh, which does not roll."""
    match shape:
        case Mesh():
            return 0.0
        case Capsule():
            return shape.length_m
        case _:
            return shape.size_m[1]
