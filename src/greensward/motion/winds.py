"""The scene's winds as one uniform block and one texture. A wind is a model, a row here and a `.glsl` file."""

import math
from collections.abc import Sequence

import moderngl
import numpy as np
import numpy.typing as npt
from PIL import Image

from greensward.gpu.blocks import BlockBuffer, declare
from greensward.ground import HeightField
from greensward.io.rasters import read_rgba
from greensward.scene import (
    Blast,
    Gusts,
    Helicopter,
    Random,
    Ripples,
    Scene,
    Strong,
    Texture,
    Waves,
    Whirl,
)
from greensward.scene.wind import Wind

MOST_WINDS = 8
ROWS = 3
PICTURES_UNIT = 15

WINDS_BLOCK = declare("Winds", 3, ("rows", "vec4", MOST_WINDS * ROWS), ("count", "int"), ("seed", "uint"))
KINDS: tuple[type, ...] = (Gusts, Strong, Helicopter, Random, Waves, Blast, Whirl, Texture, Ripples)
"""In the order of the cases in `motion/wind.glsl`."""


def _towards(direction_deg: float) -> tuple[float, float]:
    # weather reports say where wind comes from, clockwise from north, which is −z
    azimuth = math.radians(direction_deg)
    return -math.sin(azimuth), math.cos(azimuth)


def _numbers(wind: Wind, heights: HeightField | None, first_picture: int) -> Sequence[float]:
    """What follows the kind in a wind's rows."""
    match wind:
        case Gusts():
            return *_towards(wind.direction_deg), wind.speed_mps, wind.gustiness, wind.gust_m, wind.turbulence
        case Strong():
            where = _towards(wind.direction_deg)
            return *where, wind.power_mps, wind.speed_mps, wind.interval_m, wind.steadiness
        case Helicopter():
            circle = *wind.centre_m, wind.radius_m, wind.power_mps, wind.period_s, wind.rotor_m
            return *circle, 0.0, wind.speed_mps, wind.interval_m, wind.steadiness
        case Random():
            return wind.power_mps, wind.period_s
        case Waves():
            return *_towards(wind.direction_deg), wind.speed_mps, wind.rate_hz
        case Blast():
            return *_above(wind.centre_m, heights), wind.power_mps, wind.rate
        case Whirl():
            return *_above(wind.centre_m, heights), wind.power_mps, wind.swirl_mps, wind.rate
        case Ripples():
            lengths = wind.wave_m, wind.swell_m, wind.front_m
            return *_towards(wind.direction_deg), wind.speed_mps, *lengths, wind.epsilon, wind.rate_hz
        case Texture():
            return wind.speed_mps, 0.0, wind.rate_hz, *wind.size_m, first_picture, len(wind.files)


def _above(point: tuple[float, float, float], heights: HeightField | None) -> tuple[float, float, float]:
    x, y, z = point
    return x, y + (float(heights.height(x, z)) if heights else 0.0), z


def wind_values(winds: tuple[Wind, ...], seed: int, heights: HeightField | None = None) -> dict[str, object]:
    """Members of the `Winds` block; without heights, the ground lies at 0."""
    rows = np.zeros((MOST_WINDS, ROWS * 4), np.float32)
    pictures = 0
    for row, wind in zip(rows, winds, strict=False):
        numbers = _numbers(wind, heights, pictures)
        row[: len(numbers) + 1] = KINDS.index(type(wind)), *numbers
        pictures += len(wind.files) if isinstance(wind, Texture) else 0
    return {"rows": rows.reshape(-1, 4), "count": len(winds), "seed": seed}


def absent_kinds(winds: Sequence[Wind]) -> dict[str, int]:
    """What to define for shaders of `motion/wind.glsl`, so that they leave out the kinds that are not there."""
    return {f"NO_{kind.__name__.upper()}": 1 for kind in KINDS if not any(isinstance(wind, kind) for wind in winds)}


def wind_pictures(scene: Scene) -> npt.NDArray[np.uint8]:
    """The pictures of every texture wind, (layers, height, width, 2), all scaled to the largest."""
    found = [
        read_rgba(scene.resolve(file)) for wind in scene.wind if isinstance(wind, Texture) for file in wind.files
    ]
    if not found:
        return np.full((1, 1, 1, 2), 128, np.uint8)
    height, width = (max(picture.shape[axis] for picture in found) for axis in (0, 1))
    scaled = [
        picture
        if picture.shape[:2] == (height, width)
        else np.asarray(Image.fromarray(picture).resize((width, height), Image.Resampling.BILINEAR))
        for picture in found
    ]
    return np.ascontiguousarray(np.stack(scaled)[..., :2])


def kept(wind: Wind) -> object:
    """What of a wind shaders, pictures and objects were made for."""
    match wind:
        case Helicopter():
            return wind
        case Texture():
            return wind.files
        case _:
            return wind.kind


class Winds:
    """The scene's winds, bound for shaders that include `motion/wind.glsl`."""

    def __init__(self, ctx: moderngl.Context, scene: Scene, heights: HeightField) -> None:
        self._block = BlockBuffer(ctx, WINDS_BLOCK)
        self._block.set(**wind_values(scene.wind, scene.seed, heights))  # type: ignore[arg-type]
        pictures = wind_pictures(scene)
        layers, height, width, _ = pictures.shape
        self._pictures = ctx.texture_array((width, height, layers), 2, pictures.tobytes(), alignment=1)
        self._pictures.filter = moderngl.LINEAR, moderngl.LINEAR

    def change(self, before: Scene, scene: Scene, heights: HeightField) -> bool:
        """Blow as another scene has it, if kinds, pictures and helicopters are the same; returns whether."""
        if [kept(wind) for wind in before.wind] != [kept(wind) for wind in scene.wind]:
            return False
        self._block.set(**wind_values(scene.wind, scene.seed, heights))  # type: ignore[arg-type]
        return True

    def bind(self) -> None:
        """Bind the block and the pictures."""
        self._block.bind()
        self._pictures.use(PICTURES_UNIT)

    def release(self) -> None:
        """Free the GPU memory."""
        self._block.release()
        self._pictures.release()
