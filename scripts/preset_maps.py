#!/usr/bin/env python3
"""Paint the textures and maps of the presets: `.venv/bin/python scripts/preset_maps.py`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import trimesh
from PIL import Image, ImageDraw

FOLDER = Path(__file__).resolve().parents[1] / "src/greensward/scene/presets/jahrmann2013"
COLUMNS, ROWS = 96, 512
SCALE = 4  # drawn this many times larger, then averaged
Array = npt.NDArray[Any]


def _noise(rows: int, columns: int, cell: float, seed: int) -> Array:
    """Return smooth noise of mean 0 and standard deviation 1."""
    random = np.random.default_rng(seed).normal(size=(int(rows / cell) + 3, int(columns / cell) + 3))
    picture = Image.fromarray(random.astype(np.float32)).resize((columns, rows), Image.Resampling.BICUBIC)
    values = np.asarray(picture, np.float64)
    return np.asarray((values - values.mean()) / values.std())


def _canvas() -> tuple[Image.Image, ImageDraw.ImageDraw]:
    picture = Image.new("L", (COLUMNS * SCALE, ROWS * SCALE), 0)
    return picture, ImageDraw.Draw(picture)


def _downsampled(picture: Image.Image) -> Array:
    return np.asarray(picture.resize((COLUMNS, ROWS), Image.Resampling.LANCZOS))


def _save(name: str, pixels: Array) -> None:
    FOLDER.mkdir(exist_ok=True)
    Image.fromarray(np.clip(np.round(pixels), 0, 255).astype(np.uint8)).save(FOLDER / f"{name}.png", optimize=True)


# Blades -----------------------------------------------------------------------------------------------------


def blade() -> None:
    """Paint a leaf: narrow at the root, broadest at a third of its length, pointed; with veins and a pale midrib."""
    v = 1.0 - (np.arange(ROWS) + 0.5) / ROWS
    half = 0.46 * np.clip(0.15 + 0.85 * v / 0.35, 0, 1) ** 0.5 * np.clip((1 - v) / 0.65, 0, 1) ** 0.75
    u = (np.arange(COLUMNS) + 0.5) / COLUMNS - 0.5
    alpha = 255 * np.clip((half[:, None] - np.abs(u)) * COLUMNS + 0.5, 0, 1)
    _save("blade-alpha", alpha)
    across = np.clip(u / np.maximum(half[:, None], 0.02), -1, 1)
    veins = 1 + 0.1 * np.cos(across * 9 * np.pi) - 0.14 * np.abs(across) + 0.16 * np.exp(-((across / 0.08) ** 2))
    mottled = 1 + 0.05 * _noise(ROWS, COLUMNS, 9.0, 1)
    root, tip = np.array([78, 112, 42.0]), np.array([122, 158, 60.0])
    colour = root + (tip - root) * (v[:, None, None] ** 0.7)
    yellowed = np.clip((v - 0.86) / 0.14, 0, 1)[:, None, None] ** 2
    colour = colour * (1 - yellowed) + np.array([176, 158, 92.0]) * yellowed
    _save("blade-diffuse", colour * (veins * mottled)[..., None])


def _awn(draw: ImageDraw.ImageDraw, start: tuple[float, float], end: tuple[float, float]) -> None:
    """Draw an awn that leaves upwards, bends aside and tapers to a point."""
    (x0, y0), (x1, y1), t = start, end, np.linspace(0.0, 1.0, 9)
    x, y = x0 + (x1 - x0) * t**1.6, y0 + (y1 - y0) * t
    half = SCALE * 0.8 * (1.0 - t) ** 0.5
    outline = np.stack([np.concatenate([x - half, (x + half)[::-1]]), np.concatenate([y, y[::-1]])], 1)
    draw.polygon([(float(px), float(py)) for px, py in outline], fill=255)


def wheat() -> None:
    """Paint a stalk with its ear: two rows of grains with a third before them, and awns that end in points."""
    edge, middle = SCALE * ROWS, 0.5 * SCALE * COLUMNS
    stalk, draw = _canvas()
    for row in range(int(0.3 * edge), edge):
        half_width = (3.2 + 1.2 * (row / edge)) * SCALE
        draw.line((middle - half_width, row, middle + half_width, row), fill=255)
    grains, awns = Image.new("L", stalk.size, 0), Image.new("L", stalk.size, 0)
    on_grains, on_awns = ImageDraw.Draw(grains), ImageDraw.Draw(awns)
    shade = Image.new("L", stalk.size, 128)
    on_shade = ImageDraw.Draw(shade)
    random = np.random.default_rng(5)
    count = 13
    for k in range(count):
        y = (0.315 - 0.125 * k / count) * edge
        size = SCALE * (10.0 - 5.0 * abs(2 * k / count - 0.9) ** 1.5)
        for side in (-1, 1, 0):
            x = middle + side * size * 0.95
            tall = 1.5 * 9.5 * SCALE
            top = y - (0.5 if side == 0 else 0.0) * tall
            box = (x - 0.62 * size, top - tall, x + 0.62 * size, top + 0.8 * tall)
            on_grains.ellipse(box, fill=255)
            on_shade.ellipse(box, fill=int(118 + 70 * random.random()))
            on_shade.arc(box, 60, 130, fill=70, width=SCALE)
            if (k + side) % 2:
                continue
            # the lower ones end lower, and none at the edge of the picture
            end_y = (0.012 + 0.045 * random.random() + 0.3 * max(y / edge - 0.19, 0.0)) * edge
            end_x = x + side * SCALE * (28 - 22 * k / count) + SCALE * 5 * random.normal()
            _awn(on_awns, (x, top - 0.6 * tall), (float(np.clip(end_x, 3 * SCALE, (COLUMNS - 3) * SCALE)), end_y))
    alpha = np.maximum.reduce([_downsampled(part).astype(float) for part in (stalk, grains, awns)])
    _save("wheat-alpha", alpha)
    v = 1.0 - (np.arange(ROWS) + 0.5) / ROWS
    straw = np.array([196, 162, 88.0]) * (0.9 + 0.03 * _noise(ROWS, COLUMNS, 5.0, 2))[..., None]
    green = np.clip((0.34 - v) / 0.34, 0, 1)[:, None, None]
    straw = straw * (1 - 0.55 * green) + 0.55 * green * np.array([150, 146, 74.0])
    is_grain = (_downsampled(grains) / 255.0)[..., None]
    corn = np.array([206, 158, 74.0]) * (_downsampled(shade) / 150.0)[..., None]
    is_awn = (_downsampled(awns) / 255.0)[..., None] * (1 - is_grain)
    colour = straw * (1 - is_grain - is_awn) + corn * is_grain + np.array([226, 196, 122.0]) * is_awn
    _save("wheat-diffuse", colour)


# Maps -------------------------------------------------------------------------------------------------------


def _texel_centres(texels: int, size_m: float) -> tuple[Array, Array]:
    """Return x and z of the centre of each texel; row 0 is the north edge."""
    along = ((np.arange(texels) + 0.5) / texels - 0.5) * size_m
    x, z = np.meshgrid(along, along)
    return x, z


def _smoothstep(t: Array) -> Array:
    t = np.clip(t, 0, 1)
    return np.asarray(t * t * (3 - 2 * t))


def _shore_m(texels: int) -> Array:
    """Return the approximate distance of each texel of the oasis from the shore in metres, below 0 in the lake."""
    x, z = _texel_centres(texels, 160.0)
    coarse = Image.fromarray((3.2 * _noise(9, 9, 1.0, 31)).astype(np.float32))
    winding = np.asarray(coarse.resize((texels, texels), Image.Resampling.BICUBIC))
    return np.asarray(np.hypot(x / 1.35, (z + 4) / 0.95) - 19.0 + winding)


def oasis() -> None:
    """Paint a lake between dunes: maps of height, density and colour of the grass, and the sand."""
    shore = _shore_m(257)
    dunes = 0.5 * (1 + np.sin(0.11 * shore + 0.6 * _noise(257, 257, 60, 4)))
    land = 0.09 * np.clip(shore, 0, None) ** 0.9 + 1.9 * _smoothstep((shore - 16) / 30) * dunes
    height = np.where(shore < 0, -2.2 * (1 - np.exp(shore / 5)), land)
    height += 0.04 * _noise(257, 257, 5, 5) * _smoothstep(shore / 6)
    scaled = np.round((height + 4.0) / 16.0 * 65535).clip(0, 65535).astype(np.uint16)
    Image.fromarray(scaled).save(FOLDER / "oasis-height.png", optimize=True)

    shore = _shore_m(512)
    patchy = _noise(512, 512, 14, 6) + 0.6 * _noise(512, 512, 5, 7)
    lush = 1 - _smoothstep((shore + 2.5 * patchy - 6) / 24)
    here = _smoothstep((shore + 1.2) / 1.2)
    density = here * np.clip(0.07 + 0.93 * lush + 0.16 * patchy * (1 - lush), 0.0, 1.0)
    low = (shore < 9) * density
    tall = 0.42 + 0.5 * lush + 0.3 * np.exp(-(((shore - 0.6) / 1.6) ** 2))
    _save("oasis-density", 255 * np.stack([density, low, tall], -1))

    green, dry = np.array([118, 142, 52.0]), np.array([186, 160, 92.0])
    colour = green + (dry - green) * (1 - lush)[..., None] + 8 * patchy[..., None]
    _save("oasis-vegetation", np.concatenate([colour, np.full((512, 512, 1), 255)], -1))

    ripples = np.sin(0.55 * _texel_centres(512, 160.0)[0] + 2.2 * _noise(512, 512, 24, 8))
    sand = np.array([206, 178, 128.0]) * (1 + 0.035 * ripples + 0.02 * _noise(512, 512, 2, 9))[..., None]
    wet = 1 - _smoothstep((shore - 0.2) / 2.6)
    sand *= (1 - 0.5 * wet)[..., None]
    _save("oasis-terrain", np.concatenate([sand, np.full((512, 512, 1), 255)], -1))


def turf() -> None:
    """Paint the ground under a meadow and under wheat, seamless: thatch among leaves, and straw on soil."""
    _patchy("turf", [78, 96, 36], [108, 102, 56], 14)
    _patchy("stubble", [128, 98, 46], [168, 132, 66], 15)


def _patchy(name: str, low: Sequence[float], high: Sequence[float], seed: int) -> None:
    texels = 256
    waves = np.fft.fftfreq(texels)[:, None] ** 2 + np.fft.fftfreq(texels)[None, :] ** 2
    random = np.random.default_rng(seed)

    def noise(texture_px: float) -> Array:
        """Return noise that closes on itself, of mean 0 and standard deviation 1."""
        white = np.fft.fft2(random.normal(size=(texels, texels)))
        values = np.fft.ifft2(white * np.exp(-waves * (2 * texture_px) ** 2)).real
        return np.asarray((values - values.mean()) / values.std())

    thatch = _smoothstep(0.5 + 0.4 * noise(5.0) - 0.2)[..., None]
    colour = np.array(low) * (1 - thatch) + thatch * np.array(high)
    _save(name, colour * (1 + 0.16 * noise(1.2) + 0.08 * noise(12.0))[..., None])


def foot() -> None:
    """Paint the outline of a bare left foot, toes to the north, dark on light."""
    picture = Image.new("L", (4 * 96, 4 * 224), 255)
    draw = ImageDraw.Draw(picture)
    for x, y, half_x, half_y in (
        (48, 178, 25, 34),  # heel
        (42, 128, 19, 40),
        (50, 84, 35, 34),  # ball
        (70, 30, 13, 19),  # toes
        (47, 25, 8, 12),
        (31, 31, 7, 10),
        (18, 41, 6, 9),
        (9, 56, 5, 8),
    ):
        draw.ellipse([4 * (x - half_x), 4 * (y - half_y), 4 * (x + half_x), 4 * (y + half_y)], fill=0)
    _save("foot", np.asarray(picture.resize((96, 224), Image.Resampling.LANCZOS)))


def _bumps(points: Array, scale: float, seed: int) -> Array:
    """Return smooth bumps on a sphere: a sum of sines along random directions."""
    random = np.random.default_rng(seed)
    directions, phases = random.normal(size=(24, 3)), random.uniform(0, 2 * np.pi, 24)
    return np.asarray(np.sin(scale * points @ directions.T + phases).sum(1) / np.sqrt(12))


def stone() -> None:
    """Model a boulder of 1 m with facets, cracks and lichen: a mesh with vertex colours."""
    ball = trimesh.creation.icosphere(subdivisions=5)
    points = ball.vertices / np.linalg.norm(ball.vertices, axis=1, keepdims=True)
    random = np.random.default_rng(3)
    radius = np.full(len(points), 1.0)
    for _ in range(26):  # planes that broke off
        direction = random.normal(size=3)
        direction /= np.linalg.norm(direction)
        radius = np.minimum(radius, random.uniform(0.72, 0.95) / np.maximum(points @ direction, 0.2))
    radius *= 1 + 0.025 * _bumps(points, 2.5, 4) + 0.012 * _bumps(points, 7, 5) + 0.007 * _bumps(points, 19, 6)
    cracks = np.exp(-((_bumps(points, 3.1, 7) / 0.05) ** 2))
    radius -= 0.018 * cracks
    vertices = 0.5 * points * radius[:, None] * [1.0, 0.78, 0.86]
    vertices[:, 1] -= vertices[:, 1].min()
    lichen = np.clip(1.6 * _bumps(points, 4.5, 8) + 1.2 * points[:, 1] - 0.8, 0, 1)[:, None]
    moss = np.clip(1.5 * _bumps(points, 3.0, 9) - 2.2 * points[:, 1] - 0.6, 0, 1)[:, None]
    colour = np.array([50, 46, 40.0]) * (1 + 0.1 * _bumps(points, 11, 10) - 0.45 * cracks)[:, None]
    colour = colour * (1 - lichen) + lichen * np.array([92, 90, 58.0])
    colour = colour * (1 - 0.8 * moss) + 0.8 * moss * np.array([34, 44, 16.0])
    colours = np.concatenate([np.clip(colour, 0, 255), np.full((len(colour), 1), 255)], 1).astype(np.uint8)
    mesh = trimesh.Trimesh(vertices, ball.faces, vertex_colors=colours, process=False)
    (FOLDER / "stone.ply").write_bytes(trimesh.exchange.ply.export_ply(mesh, vertex_normal=False))


# A football pitch ---------------------------------------------------------------------------------------------


def pitch() -> None:
    """Paint mowing stripes and white lines on 120 m x 80 m, for a pitch of 105 m x 68 m."""
    per_m, size_m = 16, (120, 80)
    columns, rows = (edge * per_m for edge in size_m)
    x = (np.arange(columns) + 0.5) / per_m - size_m[0] / 2
    z = (np.arange(rows) + 0.5) / per_m - size_m[1] / 2
    light = (np.floor((x + 52.5) / 5.25) % 2).astype(int)
    green = np.array([[86, 124, 44, 150], [112, 148, 60, 150]], np.uint8)
    pixels = np.broadcast_to(green[light], (rows, columns, 4)).copy()
    worn = np.exp(-(x[None, :] ** 2 / 1.2 + z[:, None] ** 2 / 1.2))
    for goal in (-48.0, 48.0):
        worn = np.maximum(worn, np.exp(-(((x[None, :] - goal) / 4.0) ** 2) - (z[:, None] / 3.5) ** 2))
    pixels[worn > 0.62] = 134, 128, 74, 150
    lines = Image.new("L", (columns, rows), 0)
    draw = ImageDraw.Draw(lines)
    wide = round(0.12 * per_m)

    def at(px: float, pz: float) -> tuple[float, float]:
        return (px + size_m[0] / 2) * per_m, (pz + size_m[1] / 2) * per_m

    def box(x0: float, z0: float, x1: float, z1: float) -> None:
        draw.rectangle((*at(x0, z0), *at(x1, z1)), outline=255, width=wide)

    box(-52.5, -34, 52.5, 34)
    draw.line((*at(0, -34), *at(0, 34)), fill=255, width=wide)
    draw.ellipse((*at(-9.15, -9.15), *at(9.15, 9.15)), outline=255, width=wide)
    draw.ellipse((*at(-0.15, -0.15), *at(0.15, 0.15)), fill=255)
    for side in (-1, 1):
        for deep, half in ((16.5, 20.16), (5.5, 9.16)):
            west, east = sorted((side * 52.5, side * (52.5 - deep)))
            box(west, -half, east, half)
    pixels[np.asarray(lines) > 0] = 236, 240, 230, 255
    folder = FOLDER.with_name("habel2007")
    folder.mkdir(exist_ok=True)
    Image.fromarray(pixels).quantize(16).save(folder / "pitch-colours.png", optimize=True)


def gusts() -> None:
    """A noise map that repeats: low frequencies of high amplitude, high frequencies of low amplitude.

    Habel, Wimmer & Jeschke 2007; red and green are the velocity along x and z, for wind from 285°.
    """
    edge, random = 128, np.random.default_rng(285)
    cycles = np.hypot(*np.meshgrid(np.fft.fftfreq(edge, 1 / edge), np.fft.fftfreq(edge, 1 / edge)))
    strength, aside = np.zeros((edge, edge)), np.zeros((edge, edge))
    for fewest, most, amplitude in ((1.5, 4.0, 0.2), (9.0, 16.0, 0.06)):
        for part in (strength, aside):
            noise = np.fft.fft2(random.normal(size=(edge, edge))) * ((cycles >= fewest) & (cycles <= most))
            wave = np.fft.ifft2(noise).real
            part += amplitude * wave / wave.std()
    to_x, to_z = -np.sin(np.radians(285.0)), np.cos(np.radians(285.0))
    along = np.clip(0.5 + strength, 0.0, 0.95)
    velocity = np.stack([along * to_x - 0.3 * aside * to_z, along * to_z + 0.3 * aside * to_x, 0.0 * along], -1)
    pixels = np.clip(np.round(128.0 + 127.0 * velocity), 0, 255).astype(np.uint8)
    Image.fromarray(pixels).save(FOLDER.with_name("habel2007") / "gusts.png", optimize=True)


def main() -> None:
    """Paint all of them."""
    pitch()
    gusts()
    blade()
    wheat()
    oasis()
    turf()
    foot()
    stone()


if __name__ == "__main__":
    main()
