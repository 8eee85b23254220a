"""Winds of the scene as one uniform block and one texture. A wind is a model, a row here and a `.glsl` file."""

import math
from collections.abc import Sequence

import moderngl
import numpy as np
import numpy.typing as npt
from PIL import Image

from greensward.gpu.buffers import release_all
from greensward.gpu.device import Device
from greensward.gpu.kernels import Bindings
from greensward.gpu.layouts import BlockBuffer, block, rows_of, text
from greensward.ground import HeightField
from greensward.io.rasters import read_rgba
from greensward.motion.stateful import Stateful
from greensward.motion.wake import WakeLayers, WindField
from greensward.scene import (
    Blast,
    Gusts,
    Helicopter,
    Idle,
    Random,
    Ripples,
    Scene,
    Strong,
    Texture,
    Wake,
    Waves,
    Whirl,
)
from greensward.scene.wind import MOST_WINDS, Wind

ROWS = 3

WINDS_BLOCK = block("Winds", ("rows", "vec4", MOST_WINDS * ROWS), ("count", "int"), ("seed", "uint"))
_STRENGTH = (("speed_mps", "float"), ("interval_m", "float"), ("steadiness", "float"))
# what a kind is called in GLSL: its struct, the function of its file, and the members of the struct
_GLSL: dict[type, tuple[str, str, tuple[tuple[str, str], ...]]] = {
    Gusts: (
        "Gusts",
        "gusts",
        (
            ("direction", "vec2"),
            ("speed_mps", "float"),
            ("gustiness", "float"),
            ("gust_m", "float"),
            ("turbulence", "float"),
        ),
    ),
    Strong: ("Strong", "strong", (("direction", "vec2"), ("power_mps", "float"), *_STRENGTH)),
    Helicopter: (
        "Helicopter",
        "helicopter",
        (
            ("centre_m", "vec2"),
            ("radius_m", "float"),
            ("power_mps", "float"),
            ("period_s", "float"),
            ("rotor_m", "float"),
            *_STRENGTH,
        ),
    ),
    Random: ("RandomWind", "randomWind", (("power_mps", "float"), ("period_s", "float"))),
    Waves: ("Waves", "waves", (("direction", "vec2"), ("speed_mps", "float"), ("rate_hz", "float"))),
    Blast: ("Blast", "blast", (("centre_ws", "vec3"), ("power_mps", "float"), ("rate", "float"))),
    Whirl: (
        "Whirl",
        "whirl",
        (("centre_ws", "vec3"), ("power_mps", "float"), ("swirl_mps", "float"), ("rate", "float")),
    ),
    Texture: (
        "PaintedWind",
        "paintedWind",
        (
            ("speed_mps", "float"),
            ("rate_hz", "float"),
            ("size_m", "vec2"),
            ("first_layer", "float"),
            ("layers", "float"),
        ),
    ),
    Ripples: (
        "Ripples",
        "ripples",
        (
            ("direction", "vec2"),
            ("speed_mps", "float"),
            ("wave_m", "float"),
            ("swell_m", "float"),
            ("front_m", "float"),
            ("epsilon", "float"),
            ("rate_hz", "float"),
        ),
    ),
    Idle: ("IdleWind", "idleWind", (("direction", "vec2"), ("speed_mps", "float"), ("period_s", "float"))),
    Wake: ("WakeWind", "wakeWind", (("cell_m", "float"),)),
}
KINDS = tuple(_GLSL)
"""Kinds of wind, by their number in the block."""


def _declare() -> None:
    """Declare the structs of all kinds, and `windAt`, which leaves out the kinds that `NO_KIND` names.

    A CPU driver would run every case for every blade. `phase` is a blade's own in idle wind, in turns.
    """
    structs, cases = [], []
    for number, (kind, (name, function, members)) in enumerate(_GLSL.items()):
        declared, value = rows_of(name, members, first=1)
        structs.append(declared)
        place = "phase" if kind is Idle else "p"
        cases.append(
            f"#ifndef {_absent(kind)}\n"
            f"        if (kind == {number}) one = {function}({value}, seed, {place}, time_s);\n"
            "#endif\n"
        )
    text("WindKinds", "\n".join(structs))
    rows = ", ".join(f"winds.rows[{ROWS} * i + {row}]" for row in range(ROWS))
    text(
        "WindAt",
        "Air windAt(vec3 p, float phase, float time_s) {\n"
        "    Air sum = Air(vec4(0.0), vec3(0.0));\n"
        "    for (int i = 0; i < winds.count; i++) {\n"
        f"        vec4 rows[{ROWS}] = vec4[{ROWS}]({rows});\n"
        "        uint seed = winds.seed + uint(i) * 97u;\n"
        "        int kind = int(rows[0].x);\n"
        "        Air one = Air(vec4(0.0), vec3(0.0));\n"
        f"{''.join(cases)}"
        "        sum.wind += one.wind;\n"
        "        sum.blast += one.blast;\n"
        "    }\n"
        "    return sum;\n"
        "}\n"
        "Air windAt(vec3 root, float time_s) { return windAt(root, idlePhase(root), time_s); }",
    )


def _absent(kind: type) -> str:
    return f"NO_{kind.__name__.upper()}"


_declare()


def _towards(direction_deg: float) -> tuple[float, float]:
    # weather reports say where wind comes from, clockwise from north, which is −z
    azimuth = math.radians(direction_deg)
    return -math.sin(azimuth), math.cos(azimuth)


def _numbers(wind: Wind, heights: HeightField | None, first_picture: int) -> Sequence[float]:
    """Numbers that follow the kind in a wind's rows: the members of its struct."""
    match wind:
        case Gusts():
            return *_towards(wind.direction_deg), wind.speed_mps, wind.gustiness, wind.gust_m, wind.turbulence
        case Strong():
            where = _towards(wind.direction_deg)
            return *where, wind.power_mps, wind.speed_mps, wind.interval_m, wind.steadiness
        case Helicopter():
            circle = *wind.centre_m, wind.radius_m, wind.power_mps, wind.period_s, wind.rotor_m
            return *circle, wind.speed_mps, wind.interval_m, wind.steadiness
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
        case Idle():
            return *_towards(wind.direction_deg), wind.speed_mps, wind.period_s
        case Wake():
            return (wind.cell_m,)
        case Texture():
            return wind.speed_mps, wind.rate_hz, *wind.size_m, first_picture, len(wind.files)


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
    """Defines of shaders of `motion/wind.glsl`, so that they leave out the kinds that the scene does not have."""
    return {_absent(kind): 1 for kind in KINDS if not any(isinstance(wind, kind) for wind in winds)}


def wind_pictures(scene: Scene) -> npt.NDArray[np.uint8]:
    """Pictures of every texture wind, (layers, height, width, 2), all scaled to the largest."""
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


def built_for(wind: Wind) -> object:
    """Part of a wind that shaders, pictures and objects are built for."""
    match wind:
        case Helicopter():
            return wind
        case Texture():
            return wind.files
        case Wake():
            return wind.kind, wind.cells, wind.cell_m
        case _:
            return wind.kind


def same_kinds(before: Sequence[Wind], winds: Sequence[Wind]) -> bool:
    """Return whether what is built for some winds is good for others."""
    return [built_for(wind) for wind in before] == [built_for(wind) for wind in winds]


def _wake_of(scene: Scene) -> Wake | None:
    return next((wind for wind in scene.wind if isinstance(wind, Wake)), None)


class Winds:
    """Winds of the scene, for shaders that include `motion/wind.glsl`.

    `moving` tells which of the scene's objects move.
    """

    def __init__(self, device: Device, scene: Scene, heights: HeightField, moving: Sequence[bool] = ()) -> None:
        self._block = BlockBuffer(device.ctx, WINDS_BLOCK)
        self._block.set(**wind_values(scene.wind, scene.seed, heights))  # type: ignore[arg-type]
        pictures = wind_pictures(scene)
        layers, height, width, _ = pictures.shape
        self._pictures = device.ctx.texture_array((width, height, layers), 2, pictures.tobytes(), alignment=1)
        self._pictures.filter = moderngl.LINEAR, moderngl.LINEAR
        wake = _wake_of(scene)
        self._layers = WakeLayers(device, wake.cells if wake else 0)
        self._field = WindField(self._layers, wake, heights, scene.object, moving) if wake else None
        self.stateful: tuple[Stateful, ...] = (self._field,) if self._field else ()
        """Winds that have state; the `Winds` free it."""
        self.bindings: Bindings = {
            "Winds": self._block,
            "wind_maps": self._pictures,
            **self._layers.bindings,
        }
        """Blocks and textures, by their names in shaders."""

    def change(self, scene: Scene, heights: HeightField) -> None:
        """Blow as another scene has it, whose kinds, pictures and helicopters are the same."""
        self._block.set(**wind_values(scene.wind, scene.seed, heights))  # type: ignore[arg-type]
        if self._field and (wake := _wake_of(scene)):
            self._field.settings = wake

    def release(self) -> None:
        """Free the GPU memory."""
        release_all(self._block, self._pictures, self._layers)
