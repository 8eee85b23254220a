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

ROWS = 4
Floats = npt.NDArray[np.float64]

WINDS_BLOCK = block(
    "Winds",
    ("rows", "vec4", MOST_WINDS * ROWS),
    ("count", "int"),
    ("seed", "uint"),
    ("anchor_cm", "ivec2"),  # in the world
)
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
            ("front", "vec4"),  # cell of the noise in which the anchor lies, and where it lies from its corner
            ("ripple", "vec4"),
        ),
    ),
    Strong: ("Strong", "strong", (("direction", "vec2"), ("power_mps", "float"), *_STRENGTH, ("anchor", "float"))),
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
            ("published", "float"),
        ),
    ),
    Random: ("RandomWind", "randomWind", (("power_mps", "float"), ("period_s", "float"))),
    Waves: (
        "Waves",
        "waves",
        (("direction", "vec2"), ("speed_mps", "float"), ("rate_hz", "float"), ("anchor", "vec3")),
    ),
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
            ("anchor", "vec2"),
            ("moves_mps", "vec2"),
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
            ("anchor", "vec3"),
        ),
    ),
    Idle: ("IdleWind", "idleWind", (("direction", "vec2"), ("speed_mps", "float"), ("period_s", "float"))),
    Wake: ("WakeWind", "wakeWind", (("cell_m", "float"), ("anchor", "vec2"))),
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
        "}\n",
    )


def _absent(kind: type) -> str:
    return f"NO_{kind.__name__.upper()}"


_declare()


def _towards(direction_deg: float) -> tuple[float, float]:
    # weather reports say where wind comes from, clockwise from north, which is −z
    azimuth = math.radians(direction_deg)
    return -math.sin(azimuth), math.cos(azimuth)


def _numbers(wind: Wind, heights: HeightField | None, first_picture: int, anchor_ws: Floats) -> Sequence[float]:
    """Numbers that follow the kind in a wind's rows: the members of its struct.

    Places are counted from the anchor, (3,); `anchor` is the phase of the wind there, in small numbers.
    """
    x, z = anchor_ws[[0, 2]]
    match wind:
        case Gusts():
            towards = _towards(wind.direction_deg)
            along = np.array([x * towards[0] + z * towards[1], z * towards[0] - x * towards[1]])
            at = along * (1.0, 0.55) / wind.gust_m
            noise = *_noise_cell(at), *_noise_cell(2.7 * at)
            return *towards, wind.speed_mps, wind.gustiness, wind.gust_m, wind.turbulence, *noise
        case Strong():
            where = _towards(wind.direction_deg)
            phase = math.fmod(x * where[0] + z * where[1], math.tau * wind.interval_m)
            return *where, wind.power_mps, wind.speed_mps, wind.interval_m, wind.steadiness, phase
        case Helicopter():
            circle = *np.subtract(wind.centre_m, (x, z)), wind.radius_m, wind.power_mps, wind.period_s, wind.rotor_m
            return *circle, wind.speed_mps, wind.interval_m, wind.steadiness, float(wind.published)
        case Random():
            return wind.power_mps, wind.period_s
        case Waves():
            phases = (math.fmod(each, math.tau) for each in (0.75 * (x + z), 0.5 * x, 0.25 * z))
            return *_towards(wind.direction_deg), wind.speed_mps, wind.rate_hz, *phases
        case Blast():
            return *_above(wind.centre_m, heights) - anchor_ws, wind.power_mps, wind.rate
        case Whirl():
            return *_above(wind.centre_m, heights) - anchor_ws, wind.power_mps, wind.swirl_mps, wind.rate
        case Ripples():
            lengths, (to_x, to_z) = (wind.wave_m, wind.swell_m, wind.front_m), _towards(wind.direction_deg)
            upwind, aside = -(x * to_x + z * to_z), x * to_z - z * to_x
            turns = (math.fmod(at / length, 1.0) for at, length in zip((upwind, upwind, aside), lengths, strict=True))
            return to_x, to_z, wind.speed_mps, *lengths, wind.epsilon, wind.rate_hz, *turns
        case Idle():
            return *_towards(wind.direction_deg), wind.speed_mps, wind.period_s
        case Wake():
            return wind.cell_m, x / wind.cell_m % 1.0, z / wind.cell_m % 1.0
        case Texture():
            size_x, size_z = wind.size_m
            shown = first_picture, len(wind.files)
            return (
                wind.speed_mps,
                wind.rate_hz,
                size_x,
                size_z,
                *shown,
                math.fmod(x / size_x, 1.0),
                math.fmod(z / size_z, 1.0),
                *wind.moves_mps,
            )


def _above(point: tuple[float, float, float], heights: HeightField | None) -> Floats:
    x, y, z = point
    return np.array([x, y + (float(heights.height(x, z)) if heights else 0.0), z])


def _noise_cell(at: Floats) -> tuple[float, ...]:
    """Cell of `simplex` in which a point lies, and where it lies from the corner of the cell."""
    skew, unskew = (math.sqrt(3.0) - 1.0) / 2.0, (3.0 - math.sqrt(3.0)) / 6.0
    cell = np.floor(at + at.sum() * skew)
    return *cell, *(at - cell + cell.sum() * unskew)


def wind_values(
    winds: tuple[Wind, ...],
    seed: int,
    heights: HeightField | None = None,
    anchor_ws: npt.ArrayLike = (0.0, 0.0, 0.0),
) -> dict[str, object]:
    """Members of the `Winds` block, counted from the anchor, (3,); without heights, the ground lies at 0."""
    anchor = np.asarray(anchor_ws, np.float64)
    rows = np.zeros((MOST_WINDS, ROWS * 4), np.float32)
    pictures = 0
    for row, wind in zip(rows, winds, strict=False):
        numbers = _numbers(wind, heights, pictures, anchor)
        row[: len(numbers) + 1] = KINDS.index(type(wind)), *numbers
        pictures += len(wind.files) if isinstance(wind, Texture) else 0
    anchor_cm = np.round(100.0 * anchor[[0, 2]]).astype(np.int64).astype(np.int32)
    return {"rows": rows.reshape(-1, 4), "count": len(winds), "seed": seed, "anchor_cm": anchor_cm}


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
        self._block, self._anchor_ws = BlockBuffer(device.ctx, WINDS_BLOCK), np.zeros(3)
        self._scene, self._heights = scene, heights
        self.count_from(self._anchor_ws)
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
        self._scene, self._heights = scene, heights
        self.count_from(self._anchor_ws)
        if self._field and (wake := _wake_of(scene)):
            self._field.settings = wake

    def count_from(self, anchor_ws: Floats) -> None:
        """Count points of the world from an anchor, (3,)."""
        self._anchor_ws, scene = anchor_ws, self._scene
        self._block.set(**wind_values(scene.wind, scene.seed, self._heights, anchor_ws))  # type: ignore[arg-type]

    def release(self) -> None:
        """Free the GPU memory."""
        release_all(self._block, self._pictures, self._layers)
