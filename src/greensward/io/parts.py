"""Parts and materials of meshes, as readers hand them on."""

from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

Floats: TypeAlias = npt.NDArray[np.float64]
Indices: TypeAlias = npt.NDArray[np.int64]
Singles: TypeAlias = npt.NDArray[np.float32]
Pixels: TypeAlias = npt.NDArray[np.uint8]
Wrap: TypeAlias = Literal["repeat", "mirror", "clamp"]

MOST_TRIANGLES = 20_000_000


@dataclass(frozen=True, eq=False)
class Material:
    """Colours of a surface."""

    colour: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    """Linear colour and alpha, by which the picture and the colours of corners are multiplied."""
    picture: Pixels | None = None
    """sRGB and alpha, (rows, columns, 4), first row at v = 1."""
    cutoff: float = 0.0
    """Alpha below which the surface is cut out; 0 where all of it is opaque."""
    wrap: tuple[Wrap, Wrap] = ("repeat", "repeat")
    """Continuation of the picture past its edges, along u and v."""


@dataclass(frozen=True, eq=False)
class Part:
    """Triangles of a file, and at their corners what the file says."""

    positions: Floats
    """(n, 3)."""
    triangles: Indices
    """(m, 3)."""
    normals: Floats | None = None
    """(n, 3), of any length."""
    colours: Singles | None = None
    """(n, 4), linear, 0 to 1."""
    uv: Singles | None = None
    """(n, 2); v rises from the bottom of a picture to its top."""
    material: Indices | None = None
    """(n,), numbers of materials."""
    matrix: Floats = field(default_factory=lambda: np.eye(4))
    """Matrix that places it, (4, 4)."""


@dataclass(frozen=True, eq=False)
class Content:
    """All parts of a file, and its materials by number."""

    parts: list[Part]
    materials: list[Material] = field(default_factory=list)


def coloured(values: npt.NDArray[Any]) -> Singles:
    """Colours and alpha in 0..1, float32 (n, 4), of what a file holds at its corners, (n, 3 or 4)."""
    full = np.iinfo(values.dtype).max if values.dtype.kind in "iu" else 1.0
    colours = np.ones((len(values), 4), np.float32)
    colours[:, : values.shape[1]] = np.clip(np.nan_to_num(values.astype(np.float64) / full), 0.0, 1.0)
    return colours
