"""Meshes of heads, near and far, padded to one length so that a draw needs no mesh bound per kind.

A vertex is position and part, normal and padding: y runs along the head's axis from its base, lengths in units of
the head's size. Part 0 is petal or seed, 1 the heart.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from greensward.scene.grass import HEADS

LEVELS = ((0, 216), (216, 36), (252, 12))
"""First vertex and vertices of each level of detail, the finest first; meshes are padded to these."""
Mesh = npt.NDArray[np.float64]


def head_meshes() -> npt.NDArray[np.float32]:
    """All kinds in the order of `HEADS`, float32 (kinds, vertices of all levels, 8)."""
    builders: dict[str, tuple[Callable[[], Mesh], ...]] = {
        "none": (_nothing, _nothing, _nothing),
        "panicle": (lambda: _panicle(36), lambda: _panicle(6, 0.02, 0.22), lambda: _crossed(0.13, 0.35, 2)),
        "spike": (_spike, lambda: _crossed(0.09, 0.45, 3), lambda: _crossed(0.09, 0.45, 2)),
        "daisy": (_daisy, lambda: _disk(0.5, 0.02, 8), lambda: _disk(0.5, 0.02, 3)),
        "cup": (_cup, lambda: _disk(0.48, 0.3, 8), lambda: _disk(0.48, 0.3, 3)),
        "globe": (_globe, lambda: _crossed(0.9, 0.5, 3), lambda: _crossed(0.9, 0.5, 2)),
    }
    last, size = LEVELS[-1]
    table = np.zeros((len(HEADS), last + size, 8), np.float32)
    for row, kind in zip(table, HEADS, strict=True):
        for build, (first, vertices) in zip(builders[kind], LEVELS, strict=True):
            mesh = build()
            assert len(mesh) <= vertices
            row[first : first + len(mesh)] = mesh
    return table


def _nothing() -> Mesh:
    return np.zeros((0, 8))


def _facets(corners: Mesh, part: float = 0.0, out: Mesh | None = None) -> Mesh:
    """Triangles (n, 3, 3) to vertices; normals flat, or along `out` of the same shape."""
    if out is None:
        flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        out = np.repeat(flat[:, None], 3, 1)
    result = np.zeros((len(corners) * 3, 8))
    result[:, :3], result[:, 3] = corners.reshape(-1, 3), part
    result[:, 4:7] = (out / np.maximum(np.linalg.norm(out, axis=-1, keepdims=True), 1e-9)).reshape(-1, 3)
    return result


def _polar(radius: npt.ArrayLike, height: npt.ArrayLike, angle: npt.ArrayLike) -> Mesh:
    r, y, a = np.broadcast_arrays(radius, height, angle)
    return np.stack([r * np.cos(a), y, r * np.sin(a)], -1)


def _petals(count: int, rings: list[tuple[float, float, float]]) -> Mesh:
    """Petals around the axis; each ring is (radius, height, half width in radians), the last a point."""
    faces = []
    turn = 2.0 * np.pi * np.arange(count) / count
    for (r0, y0, w0), (r1, y1, w1) in pairwise(rings):
        a, b = _polar(r0, y0, turn - w0), _polar(r0, y0, turn + w0)
        c, d = _polar(r1, y1, turn + w1), _polar(r1, y1, turn - w1)
        if w0 > 0:
            faces.append(np.stack([a, b, c], 1))
        if w1 > 0:
            faces.append(np.stack([a, c, d], 1))
    return np.concatenate(faces)


def _dome(radius: float, height: float, base: float, sides: int) -> Mesh:
    turn = 2.0 * np.pi * np.arange(sides + 1) / sides
    ring = _polar(radius, base, turn)
    top = np.broadcast_to([0.0, base + height, 0.0], ring[:-1].shape)
    corners = np.stack([ring[:-1], top, ring[1:]], 1)
    out = corners - np.array([0.0, base - radius, 0.0])
    return _facets(corners, 1.0, out)


def _daisy() -> Mesh:
    inner = _petals(15, [(0.09, 0.01, 0.13), (0.36, 0.05, 0.19)])
    tips = _petals(15, [(0.36, 0.05, 0.19), (0.5, 0.015, 0.0)])
    return np.concatenate([_facets(inner), _facets(tips), _dome(0.14, 0.09, 0.02, 8)])


def _cup() -> Mesh:
    """Four overlapping petals, each a curved sheet with a wavy rim, shaded as one smooth bowl."""
    v, u = np.meshgrid(np.linspace(0.0, 1.0, 3), np.linspace(-1.0, 1.0, 4), indexing="ij")
    faces = []
    for k in range(4):
        sheet = 0.03 * (k % 2)
        radius = (0.05 + 0.45 * v**0.75) * (1.0 - 0.05 * u * u) + sheet * v
        height = 0.40 * v**1.6 - 0.10 * v * u * u + 0.03 * v * np.sin(5.0 * u + k)
        points = _polar(radius, height, 0.5 * np.pi * k + 1.02 * u * (0.55 + 0.45 * np.sin(np.pi * (0.2 + 0.6 * v))))
        a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
        faces += [np.stack([a, b, c], 2).reshape(-1, 3, 3), np.stack([a, c, d], 2).reshape(-1, 3, 3)]
    corners = np.concatenate(faces)
    out = corners * np.array([-1.0, 0.0, -1.0]) + np.array([0.0, 0.35, 0.0])
    return np.concatenate([_facets(corners, 0.0, out), _dome(0.1, 0.14, 0.05, 8)])


def _globe() -> Mesh:
    rows = [(0.05, 0.0), (0.40, 0.16), (0.5, 0.42), (0.36, 0.72), (0.02, 0.86)]
    turn = 2.0 * np.pi * np.arange(8) / 7
    faces = []
    for (r0, y0), (r1, y1) in pairwise(rows):
        a, b = _polar(r0, y0, turn), _polar(r1, y1, turn)
        faces += [np.stack([a[:-1], b[:-1], a[1:]], 1), np.stack([a[1:], b[:-1], b[1:]], 1)]
    corners = np.concatenate(faces)
    out = corners - np.array([0.0, 0.42, 0.0])
    return _facets(corners, 0.0, out)


def _spike() -> Mesh:
    """A dense ear: a spindle with rows of grains standing out."""
    along = np.linspace(0.0, 1.0, 7)
    radius = 0.05 * np.sin(np.pi * np.clip(along * 0.9 + 0.08, 0.0, 1.0)) ** 0.5 * np.tile([1.0, 0.72], 4)[:7]
    radius[-1] = 0.0
    turn = 2.0 * np.pi * np.arange(7) / 6
    faces = []
    for k in range(6):
        a = _polar(radius[k], along[k], turn + 0.5 * k)
        b = _polar(radius[k + 1], along[k + 1], turn + 0.5 * (k + 1))
        faces += [np.stack([a[:-1], b[:-1], a[1:]], 1), np.stack([a[1:], b[:-1], b[1:]], 1)]
    return _facets(np.concatenate(faces))


def _panicle(count: int, wide: float = 0.0075, long: float = 0.085) -> Mesh:
    """A loose plume: spikelets spiral up the axis, the lower ones reaching further."""
    along = (np.arange(count) + 0.5) / count
    turn = 2.39996 * np.arange(count)
    reach = 0.14 * (1.0 - along) ** 0.7 * (0.55 + 0.45 * np.sin(1.7 * np.arange(count)) ** 2) + 0.008
    start = _polar(0.5 * reach, 0.86 * along + 0.02, turn)
    middle = _polar(reach, 0.86 * along + 0.02 + 0.4 * long, turn)
    end = _polar(reach * 1.15, 0.86 * along + 0.02 + long, turn)
    left, right = middle + _polar(wide, 0.0, turn + 1.57), middle - _polar(wide, 0.0, turn + 1.57)
    return _facets(np.concatenate([np.stack([start, left, right], 1), np.stack([left, end, right], 1)]))


def _crossed(width: float, widest: float, count: int) -> Mesh:
    """Upright diamonds across each other."""
    faces = []
    for turn in np.pi * np.arange(count) / count:
        left, right = _polar(width / 2, widest, turn), _polar(-width / 2, widest, turn)
        base, top = np.zeros(3), np.array([0.0, 1.0, 0.0])
        faces += [np.stack([base, left, right]), np.stack([left, top, right])]
    return _facets(np.array(faces))


def _disk(radius: float, height: float, sides: int) -> Mesh:
    """A shallow cone of petals, with a raised heart where it has enough sides."""
    turn = 2.0 * np.pi * np.arange(sides + 1) / sides
    ring = _polar(radius * (1.0 - 0.12 * (np.arange(sides + 1) % 2 * (sides > 3))), height, turn)
    corners = np.stack([np.broadcast_to([0.0, 0.0, 0.0], ring[:-1].shape), ring[1:], ring[:-1]], 1)
    heart = _dome(0.14, 0.1, 0.03 + 0.25 * height, 4) if sides > 3 else _nothing()
    return np.concatenate([_facets(corners), heart])
