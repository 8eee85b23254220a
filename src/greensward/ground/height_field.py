"""Heights of the ground as a raster, the same for every kind: bilinear height and normal."""

import warnings
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from greensward.ground.noise import octaves
from greensward.io.elevation import extent_m, read_heights
from greensward.io.samples import Samples
from greensward.scene import EndlessGround, HeightMapGround, InputError, NoGround, NoiseGround, Scene
from greensward.scene.base import LEAST_EXTENT_M, MOST_EXTENT_M

Array = npt.NDArray[np.float64]
_MOST_PROBES = 10
"""Samples that are looked at along a side of a square, at most."""


@dataclass(frozen=True, eq=False)
class HeightField:
    """Heights in metres, float32 (rows, columns); row 0 lies at the north edge, −size_z / 2.

    The raster's corner samples lie on the corners of the ground. Beyond its edge the ground goes on mirrored, or
    repeated, and then the last row and column are the first again.
    """

    heights: npt.NDArray[np.float32]
    size_m: tuple[float, float]
    exists: bool = True
    """False where there is no ground: heights count from 0, and nothing is hidden."""
    repeats: bool = False
    """Copies lie side by side beyond the edge, in place of mirrored ones."""

    @classmethod
    def of(cls, scene: Scene) -> "HeightField":
        """Read or compute the heights of a scene's ground."""
        ground = scene.ground
        repeats, size_m = ground.beyond == "repeat", ground_size_m(scene)
        if isinstance(ground, HeightMapGround):
            heights = height_map(ground, scene.resolve(ground.file or ""))
        elif isinstance(ground, EndlessGround) and ground.file:
            heights = seamless_map(ground, scene.resolve(ground.file))
        elif isinstance(ground, NoiseGround | EndlessGround):
            return cls(_noise(ground, scene.seed), size_m, True, repeats)
        else:
            return cls(np.zeros((2, 2), np.float32), size_m, not isinstance(ground, NoGround), repeats)
        if repeats:
            warn_of_seam(heights)
            heights = np.pad(heights, ((0, 1), (0, 1)), mode="wrap")
        return cls(heights, size_m, True, repeats)

    @cached_property
    def lowest_m(self) -> float:
        """Lowest height."""
        return float(self.heights.min())

    @cached_property
    def highest_m(self) -> float:
        """Greatest height."""
        return float(self.heights.max())

    def cell_m(self) -> tuple[float, float]:
        """Distance between samples along x and z."""
        rows, columns = self.heights.shape
        return self.size_m[0] / (columns - 1), self.size_m[1] / (rows - 1)

    @property
    def period_m(self) -> Array:
        """Distance along x and z after which the ground is the same again, (2,)."""
        return np.array(self.size_m) * (1.0 if self.repeats else 2.0)

    def height(self, x: npt.ArrayLike, z: npt.ArrayLike) -> Array:
        """Height in metres at the points (x, z), bilinear between samples; float64 of the broadcast shape."""
        rows, columns = self.heights.shape
        cell_x, cell_z = self.cell_m()
        fold = np.mod if self.repeats else _mirror
        column = fold((np.asarray(x, np.float64) + 0.5 * self.size_m[0]) / cell_x, columns - 1)
        row = fold((np.asarray(z, np.float64) + 0.5 * self.size_m[1]) / cell_z, rows - 1)
        j = np.minimum(column.astype(np.int64), columns - 2)
        i = np.minimum(row.astype(np.int64), rows - 2)
        u, v = column - j, row - i
        h = self.heights
        north: Array = h[i, j] * (1.0 - u) + h[i, j + 1] * u
        south: Array = h[i + 1, j] * (1.0 - u) + h[i + 1, j + 1] * u
        result: Array = north * (1.0 - v) + south * v
        return result

    def normal(self, x: npt.ArrayLike, z: npt.ArrayLike) -> Array:
        """Unit normal at the points, float64 (..., 3): central differences over one sample to each side."""
        px, pz = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(z, np.float64))
        cell_x, cell_z = self.cell_m()
        slope_x = (self.height(px + cell_x, pz) - self.height(px - cell_x, pz)) / (2.0 * cell_x)
        slope_z = (self.height(px, pz + cell_z) - self.height(px, pz - cell_z)) / (2.0 * cell_z)
        normal = np.stack([-slope_x, np.ones_like(slope_x), -slope_z], axis=-1)
        result: Array = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
        return result

    def height_range(self, x0: Array, z0: Array, size_m: Array) -> tuple[Array, Array]:
        """Bounds of the height over squares: lowest and highest, float64 (n,).

        Squares have north-west corners (x0, z0) and edges of `size_m`, (n,) each.
        """
        if self.heights.shape == (2, 2) and self.lowest_m == self.highest_m:
            return np.full(len(x0), self.lowest_m), np.full(len(x0), self.highest_m)
        rows, columns = self.heights.shape
        cell_x, cell_z = self.cell_m()
        # between samples the surface is bilinear, so that it is nowhere higher than the highest sample around
        j = self._samples(x0 + 0.5 * self.size_m[0], cell_x, size_m, columns - 1)
        i = self._samples(z0 + 0.5 * self.size_m[1], cell_z, size_m, rows - 1)
        grid = self.heights[i[:, :, None], j[:, None, :]].astype(np.float64)
        if max(size_m.max(initial=0.0) / cell for cell in (cell_x, cell_z)) <= _MOST_PROBES - 2:
            return grid.min(axis=(1, 2)), grid.max(axis=(1, 2))
        low, high = grid.min(axis=(1, 2)), grid.max(axis=(1, 2))
        # what rises between the probes: the steepest slope seen, over half the distance between them
        slack = np.abs(np.diff(grid, axis=2)).max(axis=(1, 2)) + np.abs(np.diff(grid, axis=1)).max(axis=(1, 2))
        return low - slack, high + slack

    def _samples(self, start: Array, cell: float, size_m: Array, last: int) -> npt.NDArray[np.int64]:
        """Indices of samples from before each start to behind its end, (n, up to `_MOST_PROBES`)."""
        first, span = np.floor(start / cell), np.ceil(size_m / cell) + 1.0
        steps = int(np.clip(span.max(initial=1.0) + 1.0, 2, _MOST_PROBES))
        at = np.rint(first[:, None] + np.linspace(0.0, 1.0, steps) * span[:, None])
        folded: npt.NDArray[np.int64] = (np.mod(at, last) if self.repeats else _mirror(at, last)).astype(np.int64)
        return folded


def ground_size_m(scene: Scene) -> tuple[float, float]:
    """Extent of the ground along x and z, which the file of a height map may tell. Raises `InputError`."""
    ground = scene.ground
    if isinstance(ground, HeightMapGround):
        return height_map_size_m(ground, scene.resolve(ground.file or ""))
    return ground.size_m


def height_map_size_m(ground: HeightMapGround, path: Path) -> tuple[float, float]:
    """Extent of a height map: as the scene says, as its file says, or else 400 × 400 m. Raises `InputError`."""
    size_m = ground.size_m or (extent_m(path) if ground.file else None) or (400.0, 400.0)
    if not all(LEAST_EXTENT_M <= side < np.inf for side in size_m):
        raise InputError(
            f"{path}: must cover at least {LEAST_EXTENT_M:g} m a side (its reference says {size_m[0]:g} × "
            f"{size_m[1]:g} m); set ground.size_m"
        )
    if max(size_m) > MOST_EXTENT_M:
        raise InputError(
            f"{path}: covers {size_m[0]:,.0f} × {size_m[1]:,.0f} m, and a ground at most {MOST_EXTENT_M:,} m "
            "a side; cut out a part: gdal_translate -projwin WEST NORTH EAST SOUTH"
        )
    return size_m


def height_map(ground: HeightMapGround, path: Path) -> npt.NDArray[np.float32]:
    """Heights of a height map from its array or its file, float32 (rows, columns). Raises `InputError`."""
    if ground.array:
        return Samples(ground.array.values).heights(
            "ground.array", ground.height_m, ground.height_scale, ground.no_data
        )
    return read_heights(
        path, ground.key, ground.height_m, ground.height_scale, ground.no_data, ground.band, ground.byte_order
    )


def seamless_map(ground: EndlessGround, path: Path) -> npt.NDArray[np.float32]:
    """Heights of an endless ground from its file, float32 (rows, columns). Raises `InputError`."""
    return read_heights(path, height_m=(0.0, ground.height_m))


def _mirror(at: Array, last: int) -> Array:
    """Fold a sample coordinate into 0..last, back and forth."""
    folded: Array = last - np.abs(last - np.mod(at, 2.0 * last))
    return folded


def warn_of_seam(heights: npt.NDArray[np.float32]) -> None:
    """Warn where heights jump from one copy of a map to the next by far more than within it."""
    for axis, edges in ((0, "north and south"), (1, "west and east")):
        across = np.abs(np.take(heights, 0, axis) - np.take(heights, -1, axis)).max()
        inside = np.abs(np.diff(heights, axis=axis)).max(initial=0.0)
        if across > 2.0 * inside + 1e-3:
            warnings.warn(
                f"ground: the height map has a seam of {across:.2f} m where it repeats, between its {edges} edges; "
                'use a seamless map, or beyond = "mirror"',
                stacklevel=3,
            )


@lru_cache(maxsize=4)
def _noise(ground: NoiseGround | EndlessGround, seed: int) -> npt.NDArray[np.float32]:
    """Octaves of simplex noise (Tillman 2013, section 2.1.1), float32 (rows, columns).

    Where the ground repeats, each point blends two noises a period apart on both axes, and no edge is left.
    """
    size_x, size_z = ground.size_m
    per_metre = (ground.samples - 1) / max(size_x, size_z)
    columns, rows = (max(2, round(size * per_metre) + 1) for size in (size_x, size_z))
    x = np.linspace(-0.5 * size_x, 0.5 * size_x, columns)[None, :]
    z = np.linspace(-0.5 * size_z, 0.5 * size_z, rows)[:, None]

    def noise(x: Array, z: Array) -> Array:
        at = x / ground.wavelength_m, z / ground.wavelength_m
        return octaves(*at, seed, ground.octaves, ground.gain, ground.lacunarity)

    if ground.beyond == "repeat":
        heights = np.zeros((rows, columns))
        (u, before_x), (v, before_z) = _blended(x / size_x + 0.5), _blended(z / size_z + 0.5)
        for weight_x, ahead_x in ((u, 0.0), (before_x, size_x)):
            for weight_z, ahead_z in ((v, 0.0), (before_z, size_z)):
                heights += weight_x * weight_z * noise(x - ahead_x, z - ahead_z)
        heights[:, -1], heights[-1] = heights[:, 0], heights[0]  # to the last bit
    else:
        heights = noise(x, z)
    result = (0.5 * ground.height_m * heights).astype(np.float32)
    result.setflags(write=False)  # shared by all that ask for it
    return result


def _blended(along: Array) -> tuple[Array, Array]:
    """Weights of a noise and of the one a period before it, which keep its variance and have no kink at the edge."""
    smooth = along * along * (3.0 - 2.0 * along)
    length = np.hypot(smooth, 1.0 - smooth)
    return (1.0 - smooth) / length, smooth / length
