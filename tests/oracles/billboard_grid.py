"""Rays through a grid of billboards on level ground (Habel, Wimmer & Jeschke 2007), in float64."""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from oracles import hashing

Floats = npt.NDArray[np.float64]


def stands_at(plane: npt.NDArray[np.int64], axis: int, spacing_m: float, irregularity: float, seed: int) -> Floats:
    """Where a plane stands on its axis, in metres: off a regular place by up to half the irregularity."""
    words = np.stack([plane & 0xFFFFFFFF, np.full(plane.shape, axis), np.full(plane.shape, seed ^ 0x2545F491)], -1)
    chance = hashing.unit(hashing.hashes(words.astype(np.uint32)))[..., 0]
    return (plane + irregularity * (chance - 0.5)) * spacing_m


def first_met(
    eye: Floats, rays: Floats, spacing_m: float, turn: float, irregularity: float, tall_m: float, seed: int
) -> tuple[Floats, Floats]:
    """Share of each ray to the first billboard between ground and `tall_m`, and how high it is met, (n,) each.

    Infinite where there is none.
    """
    grid = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    start, way = grid @ eye[[0, 2]], rays[:, [0, 2]] @ grid.T
    best = np.full(len(rays), np.inf)
    reach = 2.0 + np.abs(start).max() + np.abs(way).max()
    for axis in (0, 1):
        planes = np.arange(-int(reach / spacing_m), int(reach / spacing_m) + 1)
        for at in stands_at(planes, axis + 1, spacing_m, irregularity, seed):
            with np.errstate(divide="ignore", invalid="ignore"):
                share = (at - start[axis]) / way[:, axis]
                high = eye[1] + share * rays[:, 1]
            met = (share > 0.0) & (high > 0.0) & (high < 0.97 * tall_m) & (share < best)
            best = np.where(met, share, best)
    return best, np.where(np.isfinite(best), eye[1] + np.where(np.isfinite(best), best, 0.0) * rays[:, 1], np.inf)


ALONG_X, ALONG_Z, FROM_ABOVE, CLOSING = range(4)
FILLED = 0.35
"""Part of the contrast between blades that the filling of a ray keeps."""


def picture(pixels: npt.NDArray[np.uint8]) -> Floats:
    """Rows from the ground up of a picture with transparency: linear colour times opacity, opacity."""
    coded = pixels[::-1].astype(np.float64) / 255.0
    linear = np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)
    return np.concatenate([linear[..., :3] * coded[..., 3:], coded[..., 3:]], -1)


def closed(side: Floats, slabs: int = 8) -> Floats:
    """A picture over shifted copies of itself."""
    columns, result = side.shape[1], side.copy()
    for k in range(1, slabs):
        result += (1.0 - result[..., 3:]) * np.roll(side, columns * (2 * k - 1) // (2 * slabs), axis=1)
    return result


def texel(values: Floats, u: float, v: float, repeat_v: bool = False) -> Floats:
    """Bilinear look-up, u repeated."""
    rows, columns = values.shape[:2]
    x, y = u * columns - 0.5, v * rows - 0.5
    i, j = int(np.floor(x)), int(np.floor(y))
    js = [(j + k) % rows if repeat_v else min(max(j + k, 0), rows - 1) for k in (0, 1)]
    low, high = (values[row, i % columns] * (1 - x + i) + values[row, (i + 1) % columns] * (x - i) for row in js)
    return low * (1 - y + j) + high * (y - j)


@dataclass
class Ray:
    """One ray, in depths, through a grid on level ground (Habel, Wimmer & Jeschke 2007): what a pixel shows.

    `side` and `top` are `picture`s, `mean` the grass's mean colour, `v1` and `v2` the control point and tip of a
    blade that leans as all do. Ids are (kind, plane, copy along it, number of the texel's column from 1), of
    upright ones only.
    """

    eye: Floats
    ray: Floats
    spacing_m: float
    turn: float
    irregularity: float
    tall_m: float
    steps: int
    seed: int
    side: Floats
    top: Floats
    mean: Floats
    v1: Floats
    v2: Floats
    carrier: bool = False
    shear: bool = False
    middle: bool = True
    fill: str = "texture"
    opacity: float = 0.5
    billboard_m: float = 1.0
    height: float = 1.0
    colour: Floats = field(default_factory=lambda: np.zeros(4))
    normal: Floats = field(default_factory=lambda: np.zeros(3))
    depth: float = np.inf
    id: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        c, s = np.cos(self.turn), np.sin(self.turn)
        self.to_grid = np.array([[c, s], [-s, c]])
        self.start, self.way = self.to_grid @ self.eye[[0, 2]], self.to_grid @ self.ray[[0, 2]]
        self.v1, self.v2 = self.v1 * self.height, self.v2 * self.height

    def trace(self) -> "Ray":
        """Follow it from the tips to the ground."""
        fall = -self.ray[1]
        entry, ground = (self.eye[1] - self.tall_m) / fall, self.eye[1] / fall
        planes = sorted(self._planes(entry, ground))
        second = max(self.steps // 2, 1)
        crossed = 0.0 if self.carrier else (ground - entry) * np.abs(self.way).sum() / self.spacing_m
        leap = max(int(np.ceil((crossed - (self.steps - second)) / second)), 1)
        before = entry
        for k in range(self.steps):
            at, axis, plane = planes[0] if planes else (ground, 2, 0)
            self._level(before, at, 0.5 * (self.tall_m * self.height if self.carrier else self.v2[1]))
            if axis == 2:
                self._top(0.0, ground, (self.eye[1] - before * fall) / (self.tall_m * self.height))
                break
            many = 1 if k < self.steps - second else leap
            self._side(axis, plane, at, many, closing=k == self.steps - 1)
            if self.colour[3] > 0.99:
                break
            gone = [i for i, each in enumerate(planes) if each[1] == axis][:many]
            planes, before = [each for i, each in enumerate(planes) if i not in gone], at
        return self

    def shown(self, blade: int) -> tuple[Floats, Floats]:
        """Colour but for a factor, and unit normal, of a blade's id: what fills the rest shows blades apart."""
        colour, normal = self.colour[:3] / self.colour[3], self.normal / np.linalg.norm(self.normal)
        if len(self.id) == 4 and self.id[0] >= CLOSING:
            words = np.array([[blade & 0xFFFFFFFF, blade >> 32, self.seed]], np.uint64)
            tint, turn, tilt = hashing.unit(hashing.hashes(words))[0] - 0.5
            colour = colour * (1.0 + FILLED * tint * np.array([0.55, 0.38, 0.1]))
            back = -self.ray * [1.0, 0.0, 1.0] / np.hypot(self.ray[0], self.ray[2])
            up, around, tilt = np.array([0.0, 1.0, 0.0]), np.pi * turn, 2.1 * tilt
            own = np.cos(tilt) * (np.cos(around) * back + np.sin(around) * np.cross(up, back)) + np.sin(tilt) * up
            normal = (1.0 - FILLED) * normal + FILLED * own
        return colour, np.asarray(normal / np.linalg.norm(normal))

    def _planes(self, entry: float, ground: float) -> list[tuple[float, int, int]]:
        found = []
        for axis in (0, 1):
            ends = [(self.start[axis] + at * self.way[axis]) / self.spacing_m for at in (entry, ground)]
            planes = np.arange(int(np.floor(min(ends))) - 2, int(np.ceil(max(ends))) + 3)
            stand = stands_at(planes, axis + 1, self.spacing_m, self.irregularity, self.seed)
            depths = (stand - self.start[axis]) / self.way[axis]
            found += [(float(d), axis, int(p)) for d, p in zip(depths, planes, strict=True) if entry < d < ground]
        return found

    def _over(self, colour: Floats, normal: Floats, depth: float, name: tuple[int, ...]) -> None:
        through = 1.0 - self.colour[3]
        self.colour = self.colour + through * colour
        self.normal = self.normal + through * colour[3] * normal
        if self.depth == np.inf and self.colour[3] > self.opacity:
            self.depth, self.id = depth, name

    def _lean(self, rest: float) -> Floats:
        bent = rest * self.v2 if self.shear else 2.0 * rest * (1.0 - rest) * self.v1 + rest**2 * self.v2
        return np.asarray(self.to_grid @ bent[[0, 2]])

    def _rest(self, above_m: float) -> float:
        if self.shear:
            return above_m / (self.tall_m * self.height)
        roots = np.roots([self.v2[1] - 2.0 * self.v1[1], 2.0 * self.v1[1], -above_m])
        return float(min((r.real for r in roots if r.real >= 0.0 and abs(r.imag) < 1e-9), default=2.0))

    def _fill(self, colour: Floats, rest: float) -> Floats:
        if self.fill == "colour":
            return np.array([*self.mean, 1.0])
        left = 1.0 - colour[3]
        return np.array([*(colour[:3] + left * (0.5 + 0.5 * rest) * self.mean), 1.0])

    def _side(self, axis: int, plane: int, depth: float, many: int, closing: bool) -> None:
        rest = self._rest(self.eye[1] + depth * self.ray[1])
        if closing:
            rest = 0.3 + 0.5 * min(rest, 1.0)
        if rest > 1.0:
            return
        # planes of one x, on which z runs, are told from those of one z
        random = hashing.hashes(np.array([[plane & 0xFFFFFFFF, 2 - axis, self.seed]], np.uint32))
        mirror, offset = bool(random[0, 2] & 1), hashing.unit(random)[0, 1]
        place = self.start + depth * self.way - self._lean(rest)
        u = place[1 - axis] / self.billboard_m + offset
        u = -u if mirror else u
        colour = texel(closed(self.side) if closing else self.side, u, rest)
        if closing:
            colour = self._fill(colour, rest)
        elif colour[3] < 0.004:
            return
        else:
            colour = colour * (1.0 - (1.0 - colour[3]) ** many) / colour[3]
        back = -self.ray[[0, 2]] / np.hypot(self.ray[0], self.ray[2])
        facing = np.zeros(2)
        facing[axis] = -np.sign(self.way[axis])
        across = back if closing else 0.5 * (self.to_grid.T @ facing) + 0.4 * back
        column = int(np.floor(u % 1.0 * self.side.shape[1]))
        number = column * 128 // self.side.shape[1] + 1
        kind = (ALONG_Z if axis == 0 else ALONG_X) + (CLOSING if closing else 0)
        normal = np.array([across[0], 0.0, across[1]])
        if closing and self.fill == "colour":
            normal = 0.8 * normal + [0.0, 0.6, 0.0]
        self._over(colour, normal, depth, (kind, plane, int(np.floor(u)), number))

    def _level(self, before: float, at: float, middle_m: float) -> None:
        depth = (self.eye[1] - middle_m) / -self.ray[1]
        if self.middle and before < depth < at:
            self._top(0.5, depth, 0.0)

    def _top(self, at: float, depth: float, unmet: float) -> None:
        far, across = np.linalg.norm(self.ray), np.hypot(self.ray[0], self.ray[2])
        steep, lowest = -self.ray[1] / (far + across), 0.5 if self.middle else 1.0
        t = min(max((unmet - 0.3) / 0.5, 0.0), 1.0) if at == 0.0 else 0.0
        part = (0.5 if at else lowest) * steep
        part = max(part, t * t * (3.0 - 2.0 * t) * far / max(-self.ray[1], 0.25 * far) - (1.0 - lowest) * steep)
        uv = (self.start + depth * self.way - self._lean(at)) / self.billboard_m
        colour = texel(self.top, uv[0], uv[1], repeat_v=True)
        if at == 0.0 and self.carrier:
            colour = self._fill(colour, 0.0)
        part *= 1.0 + 2.0 * min(float(np.hypot(self.v2[0], self.v2[2])) / (self.height * self.tall_m), 1.0)
        shown = 1.0 - (1.0 - colour[3]) ** part
        self._over(colour * shown / colour[3], np.array([0.0, 1.0, 0.0]), depth, (FROM_ABOVE,))
