"""Permanent ids of blades: 64 bits of kind, place and number, the same from every camera and in every process."""

from enum import IntEnum

import numpy as np
import numpy.typing as npt

from greensward.gpu.layouts import enumeration

Ids = npt.NDArray[np.uint64]
_KIND_BITS = 4


class BladeKind(IntEnum):
    """Uppermost bits of an id: what the rest of it is made of."""

    GROUND = 1
    """Leaf tile x and z, number among those made of one root, number of the root in the leaf."""
    OBJECT = 2
    """Index of the object, number among those made of one root, number of the root on it."""
    PATCH = 3
    """Column and row of the patch, number of the blade in the pattern."""
    BILLBOARD = 4
    """Tile x and z, number of the root in the pattern."""
    FLAT_TILE = 5
    """Cell x and z, its ring."""
    TRACED = 6
    """Kind of billboard, its plane in the grid, its copy along that, number of the blade in its picture."""
    FLOWER = 7
    """Index of the table in `[[flowers]]`, cell x and z."""


_WIDTHS: dict[BladeKind, tuple[int, ...]] = {
    BladeKind.GROUND: (22, 22, 4, 12),
    BladeKind.OBJECT: (12, 4, 44),
    BladeKind.PATCH: (20, 20, 20),
    BladeKind.BILLBOARD: (23, 23, 14),
    BladeKind.FLAT_TILE: (26, 26, 8),
    BladeKind.TRACED: (3, 21, 18, 18),
    BladeKind.FLOWER: (8, 26, 26),
}
"""Bits of each part, the uppermost first. A place may be negative: two's complement."""
MOST_OF_A_PATCH = 1 << 20
"""Blades in the pattern of a patch that ids tell apart."""
enumeration("BladeKind", "BLADE_KIND", BladeKind)


def blade_ids(kind: BladeKind, *parts: npt.ArrayLike) -> Ids:
    """Join whole numbers (n,) into ids, uint64 (n,); of each part its lowest bits count."""
    ids: Ids = np.asarray(int(kind), np.uint64)
    for part, bits in zip(parts, _WIDTHS[kind], strict=True):
        lowest = np.asarray(part).astype(np.int64).view(np.uint64) & np.uint64((1 << bits) - 1)
        ids = ids << np.uint64(bits) | lowest
    return ids


def beside(ids: Ids, number: npt.ArrayLike) -> Ids:
    """Ids of other blades that are made of the roots with these ids, by their number, 1 to 15; (n,) each."""
    shift = np.where(ids >> np.uint64(64 - _KIND_BITS) == BladeKind.GROUND, 12, 44).astype(np.uint64)
    result: Ids = ids | np.asarray(number).astype(np.uint64) << shift
    return result
