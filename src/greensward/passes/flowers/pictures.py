"""Pictures of flowers, from files or painted here."""

import math

import moderngl
import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw

from greensward.io.rasters import decoded, encoded, read_rgba, spread
from greensward.scene import Flowers, InputError, Scene
from greensward.scene.base import linear

SIZE = 104, 480
"""Columns and rows of a picture that is painted; of files, the largest of all is taken."""
_MOST_PX = 1024
_FINER = 3
_STEM, _LEAF = (86, 118, 48), (98, 136, 54)


def flower_array(ctx: moderngl.Context, scene: Scene) -> tuple[moderngl.TextureArray, list[float]]:
    """A layer for each `[[flowers]]` table, first row at the root, and how wide each picture is over its height.

    Raises `InputError` for a picture that is transparent all over.
    """
    pictures = [_picture(scene, flowers) for flowers in scene.flowers]
    columns, rows = (min(max(picture.shape[axis] for picture in pictures), _MOST_PX) for axis in (1, 0))
    layers = np.stack([_coded(picture, columns, rows) for picture in pictures])[:, ::-1]
    texture = ctx.texture_array((columns, rows, len(layers)), 4, np.ascontiguousarray(layers).tobytes())
    texture.build_mipmaps()
    texture.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
    texture.repeat_x = texture.repeat_y = False
    return texture, [picture.shape[1] / picture.shape[0] for picture in pictures]


def _picture(scene: Scene, flowers: Flowers) -> npt.NDArray[np.uint8]:
    if flowers.picture is None:
        return painted(flowers)
    path = scene.resolve(flowers.picture)
    pixels = read_rgba(path)
    if pixels[..., 3].max() == 0:
        raise InputError(f"{path}: flowers.picture: must be opaque somewhere, or no flower would be seen")
    return pixels


def _coded(picture: npt.NDArray[np.uint8], columns: int, rows: int) -> npt.NDArray[np.uint8]:
    """Square root of linear colours and alpha, scaled with what is transparent left out."""
    shown = spread(picture) / 255.0
    light = np.dstack([decoded(shown[..., :3]), shown[..., 3:]]).astype(np.float32)
    parts = [
        np.asarray(Image.fromarray(light[..., k]).resize((columns, rows), Image.Resampling.BILINEAR))
        for k in range(4)
    ]
    scaled = np.dstack([*(np.sqrt(part) for part in parts[:3]), parts[3]])
    result: npt.NDArray[np.uint8] = np.round(255.0 * np.clip(scaled, 0.0, 1.0)).astype(np.uint8)
    return result


def painted(flowers: Flowers) -> npt.NDArray[np.uint8]:
    """A flower on its stem with a few leaves, seen a little from above: sRGB and alpha, uint8 (rows, columns, 4)."""
    columns, rows = (_FINER * edge for edge in SIZE)
    picture = Image.new("RGBA", (columns, rows), (*_STEM, 0))
    draw = ImageDraw.Draw(picture)
    random = np.random.default_rng(flowers.petals)
    middle, head_y, radius = 0.5 * columns, 0.17 * rows, 0.44 * columns
    stem = [(middle + 0.06 * columns * math.sin(2.6 * t), rows - t * (rows - head_y)) for t in np.linspace(0, 1, 40)]
    draw.line(stem, fill=(*_STEM, 255), width=round(0.032 * columns), joint="curve")
    for at, side in ((0.3, -1), (0.42, 1), (0.6, -1)):
        _leaf(draw, stem[int(at * 39)], side, 0.34 * columns * (1.1 - at))
    _head(picture, (middle + 0.06 * columns * math.sin(2.6), head_y), radius, flowers, random)
    small = picture.resize(SIZE, Image.Resampling.LANCZOS)
    return np.asarray(small, np.uint8)


def _leaf(draw: ImageDraw.ImageDraw, root: tuple[float, float], side: int, size: float) -> None:
    along = np.linspace(0.0, 1.0, 24)
    x, y = root[0] + side * size * along, root[1] - size * (1.25 * along - 0.35 * along**2)
    half = 0.13 * size * np.sin(np.pi * along**0.8)
    upper, lower = (np.stack([x, y + sign * half], 1) for sign in (-1, 1))
    draw.polygon([tuple(p) for p in np.concatenate([upper, lower[::-1]])], fill=(*_LEAF, 255))


def _head(
    picture: Image.Image,
    centre: tuple[float, float],
    radius: float,
    flowers: Flowers,
    random: np.random.Generator,
) -> None:
    draw = ImageDraw.Draw(picture)
    petal, heart = (encoded(np.array(linear(colour))) * 255 for colour in (flowers.colour, flowers.heart_colour))
    flat = 0.72  # seen from above by less than a right angle
    along = np.linspace(0.0, 1.0, 20)
    # those behind first
    turns = (np.arange(flowers.petals) + 0.3 * random.random(flowers.petals)) * 2 * np.pi / flowers.petals
    for turn in sorted(turns, key=math.sin):
        size = radius * (0.9 + 0.1 * random.random())
        half = 0.95 * size * math.sin(math.pi / flowers.petals) * np.sin(np.pi * along**1.6 * 0.93) ** 0.6
        way, across = (
            np.array([math.cos(turn), flat * math.sin(turn)]),
            np.array([-math.sin(turn), flat * math.cos(turn)]),
        )
        edge = [
            np.array(centre) + size * t * way + sign * h * across
            for sign in (1, -1)
            for t, h in _there(along, half, sign)
        ]
        shade = 0.82 + 0.18 * random.random() - 0.1 * (math.sin(turn) < 0)
        draw.polygon([tuple(p) for p in edge], fill=(*(int(c) for c in np.clip(petal * shade, 0, 255)), 255))
        rib = [tuple(np.array(centre) + size * t * way) for t in (0.15, 0.85)]
        draw.line(rib, fill=(*(int(c) for c in np.clip(petal * shade * 0.88, 0, 255)), 255), width=_FINER)
    core = 0.27 * radius
    for k in range(60):
        r, turn = core * math.sqrt(k / 60), 2.39996 * k
        x, y = centre[0] + r * math.cos(turn), centre[1] + flat * r * math.sin(turn) - 0.25 * core * (1 - k / 60)
        shade = 1.08 - 0.4 * (k / 60) - 0.1 * random.random()
        dot = 0.17 * core
        fill = (*(int(c) for c in np.clip(heart * shade, 0, 255)), 255)
        draw.ellipse((x - dot, y - dot, x + dot, y + dot), fill=fill)


def _there(along: npt.NDArray[np.float64], half: npt.NDArray[np.float64], sign: int) -> list[tuple[float, float]]:
    pairs = [(float(t), float(h)) for t, h in zip(along, half, strict=True)]
    return pairs if sign > 0 else pairs[::-1]
