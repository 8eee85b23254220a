"""Force layers: footprints, tracks, stamps and maps that press grass down, drawn as maps of forces; no GPU."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from greensward.io.rasters import read_rgba
from greensward.motion.outlines import (
    forces_around,
    from_picture,
    normals,
    read_outline,
    resized,
    rim_of,
    signed_distance,
)
from greensward.scene import Footprints, ForceMap, Stamp, Tracks
from greensward.scene.force import LEAST_TEXELS, MOST_TEXELS, Force, curve

LATEST_S = 60_000.0  # half floats hold a little more
_FINER = {"foot": 24, "tyre": 12, "stamp": 96}  # texels where there is room, as LEAST_TEXELS
_TOES_OUT = np.radians(7.0)
_HEEL = 0.76  # of the width of the ball
Floats = npt.NDArray[np.floating]
Resolve = Callable[[str], Path]


@dataclass(frozen=True)
class ForceLayer:
    """Forces over a part of the ground, and when they begin."""

    texels: npt.NDArray[np.float16]
    """x, up, z, and seconds from the start until that place is pressed: (rows, columns, 4), row 0 at the lowest z."""
    centre_m: tuple[float, float]
    size_m: tuple[float, float]
    yaw_deg: float = 0.0
    start_s: float = 0.0
    always: bool = True
    """There from the beginning; only what fades counts from the start."""
    fades_s: float | None = None


def layer_of(force: Force, resolve: Resolve) -> ForceLayer:
    """The picture of one force. Raises `InputError` for a file that cannot be read or holds none."""
    match force:
        case ForceMap():
            return _painted(force, resolve)
        case Footprints():
            return _walked(force)
        case Tracks():
            return _driven(force)
        case Stamp():
            return _stamped(force, resolve)


def _painted(force: ForceMap, resolve: Resolve) -> ForceLayer:
    forces = from_picture(read_rgba(resolve(force.file), coloured=True))
    rows, columns = (min(side, MOST_TEXELS) for side in forces.shape[:2])
    if forces.shape[:2] != (rows, columns):
        forces = resized(forces, (columns, rows))
    texels = np.concatenate([force.strength * forces, np.zeros((rows, columns, 1))], axis=-1)
    return ForceLayer(texels.astype(np.float16), force.centre_m, force.size_m, force.yaw_deg)


# A footprint ---------------------------------------------------------------------------------------------------


class _Footprint:
    """A part of the ground in texels, and the forces that objects exert on it, one after another."""

    def __init__(self, samples: Floats, reach_m: float, finest_m: float, coarsest_m: float) -> None:
        """Cover points (n, 2), with this much to each side."""
        low, high = samples.min(axis=0) - reach_m, samples.max(axis=0) + reach_m
        # two texels without force all around
        self.texel_m = float(np.clip((high - low).max() / (MOST_TEXELS - 4), finest_m, coarsest_m))
        columns, rows = np.minimum(np.ceil((high - low) / self.texel_m).astype(int) + 4, MOST_TEXELS)
        self.size_m = columns * self.texel_m, rows * self.texel_m
        self.centre_m = tuple(float(c) for c in 0.5 * (low + high))
        self._low = np.array(self.centre_m) - 0.5 * np.array(self.size_m)
        self._forces = np.zeros((rows, columns, 3), np.float32)
        self._when_s = np.zeros((rows, columns), np.float32)
        self._near_m = np.full((rows, columns), np.inf, np.float32)
        self._along_m = np.full((rows, columns), -np.inf, np.float32)

    def window(self, low: Floats, high: Floats) -> tuple[tuple[slice, slice], Floats, Floats]:
        """The texels of a box, and the x and z of their middles."""
        ends = np.stack([np.floor((low - self._low) / self.texel_m), np.ceil((high - self._low) / self.texel_m)])
        (left, top), (right, bottom) = np.clip(ends, 0, self._near_m.shape[::-1]).astype(int)
        x = self._low[0] + (np.arange(left, right) + 0.5) * self.texel_m
        z = self._low[1] + (np.arange(top, bottom) + 0.5) * self.texel_m
        return (slice(top, bottom), slice(left, right)), x[None, :], z[:, None]

    def apply(
        self,
        at: tuple[slice, slice],
        distance_m: Floats,
        when_s: Floats | float,
        rim_m: float,
        impact_m: float,
        along_m: float = 0.0,
        same_m: float = 0.0,
    ) -> None:
        """Press where these distances to an outline are within the impact; call in the order of time.

        What is nearer wins, and where both pressed fully the later. What lies within `same_m` along the path is one
        press, of which the nearest part counts inside too.
        """
        near, along = self._near_m[at], self._along_m[at]
        same = np.abs(along_m - along) < same_m
        wins = np.where(same, distance_m < near, np.maximum(distance_m, 0.0) <= np.maximum(near, 0.0))
        # farther than the forces, as their times are blended with those next to them
        wins &= distance_m < impact_m + 3.0 * self.texel_m
        forces = forces_around(distance_m, normals(distance_m), max(rim_m, self.texel_m), impact_m)
        self._forces[at][wins] = forces[wins]
        self._when_s[at][wins] = np.broadcast_to(when_s, wins.shape)[wins]
        near[wins], along[wins] = distance_m[wins], along_m

    def texels(self, pressure: float) -> npt.NDArray[np.float16]:
        """Forces and times."""
        when_s = np.clip(self._when_s, 0.0, LATEST_S)[..., None]
        return np.concatenate([pressure * self._forces, when_s], axis=-1).astype(np.float16)


# Along a path -----------------------------------------------------------------------------------------------


class _Line:
    """A path as a curve by its length."""

    def __init__(self, path: tuple[tuple[float, float], ...]) -> None:
        pieces = np.array(curve(path))
        t = np.linspace(0.0, 1.0, 65)[:, None]
        weights = (1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3
        points = [sum(w * corner for w, corner in zip(weights, piece, strict=True)) for piece in pieces]
        samples = np.concatenate([points[0][:1], *(piece[1:] for piece in points)])
        self._length_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(samples, axis=0).T))])
        self._samples = samples
        self.length_m = float(self._length_m[-1])

    def at(self, along_m: Floats) -> tuple[Floats, Floats]:
        """Places (n, 2) and unit directions (n, 2) at lengths along it."""
        here, before, after = (
            np.stack([np.interp(along_m + step, self._length_m, axis) for axis in self._samples.T], -1)
            for step in (0.0, -0.02, 0.02)
        )
        direction = after - before
        return here, direction / np.maximum(np.hypot(*direction.T), 1e-9)[:, None]


def _walked(force: Footprints) -> ForceLayer:
    line, (length, width) = _Line(force.path), force.foot_m
    count = max(1, round(line.length_m / force.step_m))
    along = (np.arange(count) + 0.5) * line.length_m / count
    places, directions = line.at(along)
    side = np.where(np.arange(count) % 2, 1.0, -1.0)  # left first
    places = places + 0.5 * force.gauge_m * side[:, None] * np.stack([-directions[:, 1], directions[:, 0]], -1)
    angles = np.arctan2(directions[:, 1], directions[:, 0]) + side * _TOES_OUT
    when_s = along / force.speed_mps if force.speed_mps else 0.0 * along
    reach = 0.5 * length + force.impact_m
    footprint = _Footprint(places, reach, length / _FINER["foot"], length / LEAST_TEXELS["foot"])
    for place, angle, when in zip(places, angles, when_s, strict=True):
        at, x, z = footprint.window(place - reach, place + reach)
        ahead = np.cos(angle) * (x - place[0]) + np.sin(angle) * (z - place[1])
        aside = -np.sin(angle) * (x - place[0]) + np.cos(angle) * (z - place[1])
        footprint.apply(at, _sole(ahead, aside, length, width), float(when), 0.15 * width, force.impact_m)
    return _layer(footprint, force, not force.speed_mps)


def _sole(ahead: Floats, aside: Floats, length: float, width: float) -> Floats:
    """Signed distance to a foot about the origin: a heel, a ball of the foot, and the straight lines around both."""
    ball, heel = 0.5 * width, 0.5 * width * _HEEL
    apart = max(length - ball - heel, 1e-6)
    x, y = np.abs(aside), ahead + 0.5 * length - heel
    slope = np.clip((heel - ball) / apart, -1.0, 1.0)
    rise = np.sqrt(1.0 - slope * slope)
    where = rise * y - slope * x
    side = rise * x + slope * y - heel
    # of a round cone in the plane: nearest to the heel, to the ball, or to the line between
    side = np.where(where > rise * apart, np.hypot(x, y - apart) - ball, side)
    distance: Floats = np.where(where < 0.0, np.hypot(x, y) - heel, side)
    return distance


def _driven(force: Tracks) -> ForceLayer:
    line, half = _Line(force.path), 0.5 * force.tyre_m
    steps = max(2, int(np.ceil(line.length_m / (0.5 * half))) + 1)
    along = np.linspace(0.0, line.length_m, steps)
    places, directions = line.at(along)
    right = np.stack([-directions[:, 1], directions[:, 0]], -1)
    sides = (-0.5, 0.5) if force.gauge_m else (0.0,)
    wheels = [places + aside * force.gauge_m * right for aside in sides]
    reach = half + force.impact_m
    finest, coarsest = (force.tyre_m / texels for texels in (_FINER["tyre"], LEAST_TEXELS["tyre"]))
    footprint = _Footprint(np.concatenate(wheels), reach, finest, coarsest)
    pace = 1.0 / force.speed_mps if force.speed_mps else 0.0
    same = 4.0 * (reach + force.tyre_m)
    for i in range(steps - 1):
        for wheel in wheels:
            a, direction = wheel[i], wheel[i + 1] - wheel[i]
            ends = np.stack([a, a + direction])
            at, x, z = footprint.window(ends.min(0) - reach, ends.max(0) + reach)
            x, z = x - a[0], z - a[1]
            t = np.clip((x * direction[0] + z * direction[1]) / max(direction @ direction, 1e-12), 0.0, 1.0)
            distance = np.hypot(x - t * direction[0], z - t * direction[1]) - half
            when = pace * (along[i] + t * (along[i + 1] - along[i]))
            footprint.apply(at, distance, when, 0.3 * half, force.impact_m, float(along[i]), same)
    return _layer(footprint, force, not force.speed_mps)


def _stamped(force: Stamp, resolve: Resolve) -> ForceLayer:
    picture = read_outline(resolve(force.outline))
    longest = max(force.size_m)
    fine_m = longest / min(max(*picture.shape, 32), 384)
    columns, rows = (max(2, round(side / fine_m)) for side in force.size_m)
    pressed = resized(picture, (columns, rows)) > 0.5
    margin = int(np.ceil(force.impact_m / fine_m)) + 4
    distance = fine_m * signed_distance(np.pad(pressed, margin), margin)
    rim_m = rim_of(distance / fine_m) * fine_m
    reach = 0.5 * float(np.hypot(*force.size_m)) + force.impact_m
    places = np.array(force.places)
    finest, coarsest = (longest / texels for texels in (_FINER["stamp"], LEAST_TEXELS["stamp"]))
    footprint = _Footprint(places[:, :2], reach, finest, coarsest)
    for place_x, place_z, yaw_deg in places:
        place, turn = np.array([place_x, place_z]), np.radians(yaw_deg)
        at, x, z = footprint.window(place - reach, place + reach)
        x, z = x - place_x, z - place_z
        own_x, own_z = np.cos(turn) * x - np.sin(turn) * z, np.sin(turn) * x + np.cos(turn) * z
        row = own_z / fine_m + 0.5 * (distance.shape[0] - 1)
        column = own_x / fine_m + 0.5 * (distance.shape[1] - 1)
        footprint.apply(at, _sampled(distance, row, column), 0.0, rim_m, force.impact_m)
    return _layer(footprint, force, force.at_s is None)


def _sampled(field: Floats, row: Floats, column: Floats) -> Floats:
    """A field between its cells, linearly; far beyond where it ends."""
    rows, columns = field.shape
    i, j = np.clip(np.floor(row).astype(int), 0, rows - 2), np.clip(np.floor(column).astype(int), 0, columns - 2)
    s, t = np.clip(row - i, 0, 1), np.clip(column - j, 0, 1)
    near = (1 - s) * ((1 - t) * field[i, j] + t * field[i, j + 1]) + s * (
        (1 - t) * field[i + 1, j] + t * field[i + 1, j + 1]
    )
    out = (row < 0) | (column < 0) | (row > rows - 1) | (column > columns - 1)
    return np.where(out, 1e6, near)


def _layer(footprint: _Footprint, force: Footprints | Tracks | Stamp, always: bool) -> ForceLayer:
    start_s = (force.at_s or 0.0) if isinstance(force, Stamp) else force.start_s
    texels = footprint.texels(force.pressure)
    x, z = footprint.centre_m
    return ForceLayer(texels, (x, z), footprint.size_m, 0.0, start_s, always, force.fades_s)
