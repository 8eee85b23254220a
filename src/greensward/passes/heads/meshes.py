"""Meshes of heads, near and far, padded to one length so that a draw needs no mesh bound per kind.

A vertex is position and heart, normal and stem: y runs along the head's axis from its base, lengths in units of the
head's size. Heart and stem are parts of the colour, from 0 to 1; the rest is petal or seed. A heart of -1 tells the
ribbon that joins the blade to its head: x is the side, y runs down it. Each level shows as much area as the finest,
from the side and from above, or a field would change with distance.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from greensward.scene.grass import HEADS

LEVELS = ((0, 588), (588, 60))
"""First vertex and vertices of each level of detail that has a mesh, the finest first; meshes are padded to these."""
OUTLINES = {
    "none": (0.0, 0.0),
    "panicle": (0.0217, 0.0108),
    "spike": (0.0886, 0.018),
    "daisy": (0.03, 0.5),
    "cup": (0.29, 0.755),
    "globe": (0.61, 0.65),
}
"""Area that a head shows from the side and along its axis, in units of its size squared; at an angle e above the
side it is hypot(side cos e, along sin e)."""
FAR_PAINT = {
    "none": (0.0, 0.0),
    "panicle": (0.0, 0.3),
    "spike": (0.0, 0.0),
    "daisy": (0.08, 0.0),
    "cup": (0.04, 0.0),
    "globe": (0.0, 0.0),
}
"""Heart and stem, as parts of the colour of a whole head."""
Mesh = npt.NDArray[np.float64]


def head_meshes() -> npt.NDArray[np.float32]:
    """All kinds in the order of `HEADS`, float32 (kinds, vertices of all levels, 8)."""
    builders: dict[str, tuple[Callable[[], Mesh], ...]] = {
        "none": (_nothing, _nothing),
        "panicle": (_panicle, lambda: _plume(0.046, 8)),
        "spike": (_spike, lambda: _spindle(0.064, 1.0)),
        "daisy": (_daisy, lambda: _disk(0.42, 0.02)),
        "cup": (_cup, lambda: _disk(0.52, 0.5)),
        "globe": (_globe, lambda: _spindle(0.49, 0.9)),
    }
    last, size = LEVELS[-1]
    table = np.zeros((len(HEADS), last + size, 8), np.float32)
    for row, kind in zip(table, HEADS, strict=True):
        for build, (first, vertices) in zip(builders[kind], LEVELS, strict=True):
            mesh = np.concatenate([build(), np.zeros((0, 8)) if kind == "none" else _stem()])
            assert len(mesh) <= vertices
            row[first : first + len(mesh)] = mesh
    return table


def _nothing() -> Mesh:
    return np.zeros((0, 8))


def _facets(corners: Mesh, heart: float = 0.0, out: Mesh | None = None, stem: float = 0.0) -> Mesh:
    """Triangles (n, 3, 3) to vertices; normals flat, or along `out` of the same shape."""
    if out is None:
        flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        out = np.repeat(flat[:, None], 3, 1)
    result = np.zeros((len(corners) * 3, 8))
    result[:, :3], result[:, 3] = corners.reshape(-1, 3), heart
    result[:, 4:7] = (out / np.maximum(np.linalg.norm(out, axis=-1, keepdims=True), 1e-9)).reshape(-1, 3)
    result[:, 7] = stem
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
    """A dense ear: grains overlap upwards in six rows around it, each an open pyramid."""
    ring, row = np.divmod(np.arange(48), 6)
    turn = (row + 0.5 * (ring % 2)) * np.pi / 3.0
    base = 0.86 * ring / 8.0
    swell = np.sin(np.pi * (0.2 + 0.72 * ring / 8.0)) ** 0.5
    root, tip = _polar(0.01, base - 0.02, turn), _polar(0.055 * swell, base + 0.19, turn)
    middle = _polar(0.062 * swell, base + 0.07, turn)
    left, right = (_polar(0.034 * swell, base + 0.07, turn + side) for side in (-0.75, 0.75))
    sides = [(root, middle, left), (root, right, middle), (left, middle, tip), (middle, right, tip)]
    return _facets(np.concatenate([np.stack(each, 1) for each in sides]))


def _panicle() -> Mesh:
    """A loose plume: whorls of fine branches around the stem, the lower ones longer, with spikelets along each."""
    whorl, branch = np.divmod(np.arange(24), 4)
    turn = 2.39996 * np.arange(24)
    long = 0.03 + 0.2 * (1.0 - whorl / 6.0) ** 0.8 * (0.65 + 0.35 * np.sin(1.7 * np.arange(24)) ** 2)
    start = 0.02 + 0.14 * whorl + 0.012 * branch
    tip_r, tip_y = 0.6 * long, start + 0.9 * long
    thin = _polar(0.0025, 0.0, turn + 0.5 * np.pi)
    foot, tip = _polar(0.0, start, turn), _polar(tip_r, tip_y, turn)
    stems = [np.stack([foot - thin, foot + thin, tip], 1), _ribbon(0.005, 0.0), _ribbon(0.005, 0.5 * np.pi)]
    part = np.repeat(np.array([[0.45], [0.75], [1.0]]), 24, 1)
    part[:2] += 0.08 * np.sin(np.arange(24))
    aside = turn + np.array([[0.5], [-0.5], [0.0]]) * (1.0 - whorl / 8.0)
    low = _polar(part * tip_r, start + part * (tip_y - start) - 0.01, turn)
    reach = _polar(0.02, 0.055, aside)
    wide = _polar(0.0075, 0.0, aside + 0.5 * np.pi)
    left, right, high = low + 0.45 * reach - wide, low + 0.45 * reach + wide, low + reach
    grains = np.concatenate([np.stack([low, right, left], 2), np.stack([left, right, high], 2)]).reshape(-1, 3, 3)
    return np.concatenate([_facets(grains), _facets(np.concatenate(stems), stem=1.0)])


def _stem() -> Mesh:
    """Two quads down a blade, which the shader places."""
    down = np.linspace(0.0, 1.0, 3)
    left, right = (np.stack([np.full(3, side), down, np.zeros(3)], 1) for side in (-1.0, 1.0))
    quads = [left[:-1], right[:-1], left[1:], left[1:], right[:-1], right[1:]]
    corners = np.stack(quads, 1).reshape(-1, 3, 3)
    return _facets(corners, heart=-1.0, out=np.broadcast_to([0.0, 0.0, 1.0], corners.shape), stem=1.0)


def _ribbon(width: float, turn: float) -> Mesh:
    """An upright sliver from the base of the head to its top."""
    side = _polar(width / 2, 0.0, turn)
    return np.stack([-side, side, np.array([0.0, 1.0, 0.0])])[None]


def _plume(width: float, count: int) -> Mesh:
    """Upright kites in a spiral up the axis, smaller towards its top."""
    at = (np.arange(count) + 0.5) / count
    turn, size = 2.39996 * np.arange(count), 1.0 - 0.6 * at
    base, top = _polar(0.02 * size, 0.8 * at - 0.05, turn), _polar(0.13 * size, 0.8 * at + 0.24, turn)
    wide = _polar(0.5 * width * size, 0.0, turn + 0.5 * np.pi)
    left, right = 0.5 * (base + top) - wide, 0.5 * (base + top) + wide
    return _facets(np.concatenate([np.stack([base, right, left], 1), np.stack([left, right, top], 1)]))


def _spindle(radius: float, tall: float) -> Mesh:
    """A body of four sides with a point at each end."""
    turn = 0.5 * np.pi * np.arange(5)
    low, high = _polar(radius, 0.18 * tall, turn), _polar(radius, 0.7 * tall, turn)
    base, top = np.zeros_like(low[:-1]), np.broadcast_to([0.0, tall, 0.0], low[:-1].shape)
    corners = np.concatenate(
        [
            np.stack([base, low[:-1], low[1:]], 1),
            np.stack([low[:-1], high[:-1], low[1:]], 1),
            np.stack([low[1:], high[:-1], high[1:]], 1),
            np.stack([high[:-1], top, high[1:]], 1),
        ]
    )
    return _facets(corners, 0.0, corners - np.array([0.0, 0.45 * tall, 0.0]))


def _disk(radius: float, height: float) -> Mesh:
    """A shallow cone of petals with a raised heart."""
    ring = _polar(radius, height, 0.25 * np.pi * np.arange(9))
    petals = np.stack([np.zeros_like(ring[:-1]), ring[1:], ring[:-1]], 1)
    return np.concatenate([_facets(petals), _dome(0.14, 0.1, 0.03 + 0.25 * height, 4)])
