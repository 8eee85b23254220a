"""Clearings: where no grass grows, as pieces in the cells of a hash grid that shaders look up (`clearings.glsl`)."""

from collections.abc import Sequence
from dataclasses import dataclass

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.device import Device
from greensward.gpu.kernels import Bindings
from greensward.ground import HeightField
from greensward.objects.feet import feet_of, trapezoids
from greensward.objects.paths import line_of
from greensward.objects.placing import Placing
from greensward.scene import Clearing, InputError, Scene
from greensward.scene.objects import Object
from greensward.sowing.colour import colour_defines
from greensward.sowing.species import sward_values

_AROUND_M = 0.02
"""Distance around an object's foot in which no blade has its root either, as blades have some width."""
_FINEST_M, _SIZES, _SLIMMEST = 0.25, 15, 16.0
"""Edge of the smallest cells, sizes of cells, each twice the last, and cells along a narrow piece, at most."""
_ROW = 1024
"""Texels in a row of the texture."""
_ENTRY = 4
"""Texels of a piece in a cell."""
Floats = npt.NDArray[np.float64]
Words = npt.NDArray[np.uint32]


@dataclass(frozen=True)
class Pieces:
    """Convex quadrilaterals with a radius and a soft edge around each."""

    corners: Floats
    """Corners in the world, x and z, (n, 4, 2), turning from x to z; they may coincide."""
    radius_m: Floats
    edge_m: Floats
    width_m: Floats
    """Least width of the shape that a piece belongs to."""

    @classmethod
    def of(cls, corners: Floats, radius_m: float, edge_m: float) -> "Pieces":
        """The pieces of one shape, which all have the same surroundings."""
        extent_m = float(np.ptp(corners.reshape(-1, 2), axis=0).min())
        each = (radius_m, edge_m, extent_m + 2.0 * radius_m + edge_m)
        return cls(corners, *(np.full(len(corners), value) for value in each))

    def joined(self, others: Sequence["Pieces"]) -> "Pieces":
        """All pieces of these and of others."""
        parts = [vars(each) for each in (self, *others)]
        return Pieces(**{name: np.concatenate([part[name] for part in parts]) for name in parts[0]})


def sward_defines(scene: Scene) -> dict[str, object]:
    """Defines of shaders of `sowing/sward.glsl`, so that they hold what the scene needs and no more."""
    clears = scene.clear or any(each.clears for each in scene.fence)
    clears = clears or any(each.clears and each.drawn and not each.path for each in scene.object)
    return {**colour_defines(scene), **({"CLEARINGS": 1} if clears else {})}


def pieces_of(scene: Scene, placing: Placing, objects: Sequence[Object], heights: HeightField) -> Pieces:
    """All that is cleared: by `[[clear]]`, and by objects that stand still."""
    # what is higher than most of the grass stands above it
    high_m = float(sward_values(scene)["canopy_m"])  # type: ignore[arg-type]
    feet = feet_of(objects, placing, heights, scene.resolve, high_m)
    parts = [_cleared(each) for each in scene.clear]
    parts += [Pieces.of(corners, radius_m + _AROUND_M, 0.0) for corners, radius_m in feet]
    return Pieces(np.zeros((0, 4, 2)), *np.zeros((3, 0))).joined(parts)


def _cleared(table: Clearing) -> Pieces:
    if table.outline:
        return Pieces.of(trapezoids(np.array(table.outline)), 0.0, table.edge_m)
    line, width_m = line_of(table.path, table.smooth), table.width_m or 0.0
    a, b = (line[:-1], line[1:]) if len(line) > 1 else (line, line)
    each = (0.5 * width_m, table.edge_m, width_m + table.edge_m)
    return Pieces(np.stack([a, a, b, b], axis=1), *(np.full(len(a), value) for value in each))


def packed(pieces: Pieces) -> Words:
    """Texels of `clearings`, uint32 (n, 4): bounds of all; sizes of cells and mask of buckets; buckets; entries.

    An entry is a piece in a cell: the cell's place and size, and four corners counted from its own.
    """
    around = (pieces.radius_m + pieces.edge_m)[:, None]
    low, high = pieces.corners.min(axis=1) - around, pieces.corners.max(axis=1) + around
    long_m, short_m = (high - low).max(axis=1), (high - low).min(axis=1)
    wanted = np.maximum(np.sqrt(long_m * short_m), long_m / _SLIMMEST)
    size = np.clip(np.ceil(np.log2(np.maximum(wanted, _FINEST_M) / _FINEST_M)), 0, _SIZES - 1).astype(np.int64)
    edge_m = _FINEST_M * 2.0**size
    first, last = (np.floor(at / edge_m[:, None]).astype(np.int64) for at in (low, high))
    columns, rows = (last - first + 1).T
    # one entry for each cell of each piece
    piece = np.repeat(np.arange(len(size)), columns * rows)
    number = np.arange(len(piece)) - np.repeat(np.cumsum(columns * rows) - columns * rows, columns * rows)
    cell = first[piece] + np.stack([number % columns[piece], number // columns[piece]], axis=1)
    buckets = 1 << max(int(2 * len(piece) - 1).bit_length(), 0)
    words = cell.astype(np.uint32), size[piece].astype(np.uint32)
    factors = np.array([73856093, 19349663, 83492791], np.uint32)
    mixed = np.bitwise_xor.reduce(np.column_stack(words) * factors, axis=1)
    bucket = (mixed ^ mixed >> np.uint32(15)) & np.uint32(buckets - 1)
    order = np.argsort(bucket, kind="stable")
    counts = np.bincount(bucket, minlength=buckets)
    texels = np.zeros((2 + buckets + _ENTRY * len(piece), 4), np.uint32)
    if len(piece):
        texels[0].view(np.float32)[:] = *(low.min(axis=0) - 1.0), *(high.max(axis=0) + 1.0)
    else:
        texels[0].view(np.float32)[:] = np.inf, np.inf, -np.inf, -np.inf
    texels[1, :2] = np.bitwise_or.reduce(1 << size, initial=0), buckets - 1
    texels[2 : 2 + buckets, 0] = 2 + buckets + _ENTRY * (np.cumsum(counts) - counts)
    texels[2 : 2 + buckets, 1] = counts
    entries = texels[2 + buckets :].reshape(-1, _ENTRY, 4)
    own, piece = (cell * edge_m[piece][:, None])[order], piece[order]
    entries[:, 0, :2], entries[:, 0, 2] = words[0][order], words[1][order]
    numbers = entries.view(np.float32)
    numbers[:, 1:3] = (pieces.corners[piece] - own[:, None]).reshape(-1, 2, 4)
    numbers[:, 3, :3] = np.stack([pieces.radius_m, pieces.edge_m, pieces.width_m], axis=1)[piece]
    return texels


class Clearings:
    """The clearings of a scene on the GPU."""

    def __init__(
        self, device: Device, scene: Scene, placing: Placing, objects: Sequence[Object], heights: HeightField
    ) -> None:
        self.bindings: Bindings = {}
        """Texture by its name in shaders; none where the scene has nothing that clears."""
        self._texture: moderngl.Texture | None = None
        if "CLEARINGS" not in sward_defines(scene):
            return
        texels = packed(pieces_of(scene, placing, objects, heights))
        rows = -(-len(texels) // _ROW)
        if rows > device.limits.texture_px:
            raise InputError(f"scene: clear: {len(texels):,} texels are beyond this driver; have fewer of them")
        filled = np.zeros((rows * _ROW, 4), np.uint32)
        filled[: len(texels)] = texels
        self._texture = device.ctx.texture((_ROW, rows), 4, filled.tobytes(), dtype="u4")
        self._texture.filter = moderngl.NEAREST, moderngl.NEAREST
        self.bindings = {"clearings": self._texture}

    def release(self) -> None:
        """Free the GPU memory."""
        if self._texture:
            self._texture.release()
