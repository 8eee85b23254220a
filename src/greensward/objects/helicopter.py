"""The helicopter of a helicopter wind: a few solids that fly its circle."""

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from pydantic import TypeAdapter

from greensward.ground import HeightField
from greensward.objects.placing import Script, about
from greensward.scene import Helicopter
from greensward.scene.objects import Object
from greensward.scene.wind import Wind

Floats = npt.NDArray[np.float64]
_OBJECT: TypeAdapter[Object] = TypeAdapter(Object)
_UP = np.array([0.0, 1.0, 0.0])
_TURNS_PER_S = 3.7  # of the rotor
_DARK, _BODY, _METAL = "#23262a", "#a3261c", "#8d9296"
_PARTS = (
    # kind, extent and middle in rotor diameters (x ahead, y up, from the middle of the cabin), colour, spin
    ("sphere", (0.42, 0.22, 0.2), (0.0, 0.0, 0.0), _BODY, None),
    ("sphere", (0.2, 0.15, 0.17), (0.12, 0.015, 0.0), _DARK, None),
    ("box", (0.5, 0.035, 0.03), (-0.4, 0.045, 0.0), _BODY, None),
    ("box", (0.07, 0.15, 0.012), (-0.64, 0.09, 0.0), _BODY, None),
    ("box", (0.02, 0.12, 0.02), (0.0, 0.15, 0.0), _METAL, None),
    ("box", (0.34, 0.012, 0.012), (0.02, -0.15, 0.09), _METAL, None),
    ("box", (0.34, 0.012, 0.012), (0.02, -0.15, -0.09), _METAL, None),
    ("box", (0.012, 0.07, 0.012), (0.08, -0.12, 0.085), _METAL, None),
    ("box", (0.012, 0.07, 0.012), (0.08, -0.12, -0.085), _METAL, None),
    ("box", (0.012, 0.07, 0.012), (-0.06, -0.12, 0.085), _METAL, None),
    ("box", (0.012, 0.07, 0.012), (-0.06, -0.12, -0.085), _METAL, None),
    ("box", (1.0, 0.008, 0.035), (0.0, 0.21, 0.0), _DARK, "rotor"),
    ("box", (0.035, 0.008, 1.0), (0.0, 0.21, 0.0), _DARK, "rotor"),
    ("box", (0.16, 0.012, 0.006), (-0.65, 0.09, 0.012), _DARK, "tail"),
)


def helicopters(winds: Sequence[Wind], heights: HeightField) -> tuple[tuple[Object, ...], dict[str, Script]]:
    """Objects that draw the helicopters of these winds, and where each is at a time."""
    parts: list[Object] = []
    scripts: dict[str, Script] = {}
    for i, wind in enumerate(winds):
        if not isinstance(wind, Helicopter) or not wind.drawn:
            continue
        for k, (kind, extent, middle, colour, spin) in enumerate(_PARTS):
            name = f"wind[{i}] helicopter part {k}"
            size = tuple(wind.rotor_m * edge for edge in extent)
            keys = {"name": name, "position_m": (0.0, 0.0, 0.0), "size_m": size, "colour": colour}
            parts.append(_OBJECT.validate_python({"kind": kind, "roughness": 0.35, "collides": False, **keys}))
            scripts[name] = _script(wind, heights, np.array(middle) * wind.rotor_m, size[1], spin)
    return tuple(parts), scripts


def _script(wind: Helicopter, heights: HeightField, middle: Floats, tall: float, spin: str | None) -> Script:
    def at(time_s: float) -> Floats:
        cabin = _cabin(wind, heights, time_s)
        own = np.eye(3)
        if spin:
            axis = _UP if spin == "rotor" else np.array([0.0, 0.0, 1.0])
            own = about(axis, 2.0 * math.pi * _TURNS_PER_S * (1.0 if spin == "rotor" else 4.1) * time_s)
        matrix = np.eye(4)
        matrix[:3, :3] = cabin[:3, :3] @ own
        # an object's own space starts at the middle of its base
        matrix[:3, 3] = cabin[:3, 3] + cabin[:3, :3] @ middle - 0.5 * tall * matrix[:3, 1]
        return matrix

    return at


@lru_cache(maxsize=64)
def _cabin(wind: Helicopter, heights: HeightField, time_s: float) -> Floats:
    """World from the middle of the cabin, once for all parts: along the circle, banked, nose a little down."""
    angle = 2.0 * math.pi * time_s / wind.period_s
    x = wind.centre_m[0] + wind.radius_m * math.cos(angle)
    z = wind.centre_m[1] + wind.radius_m * math.sin(angle)
    matrix = np.eye(4)
    heading = about(_UP, math.atan2(-math.cos(angle), -math.sin(angle)))
    matrix[:3, :3] = heading @ about(np.array([1.0, 0.0, 0.0]), 0.16) @ about(np.array([0.0, 0.0, 1.0]), -0.1)
    matrix[:3, 3] = x, float(heights.height(x, z)) + wind.height_m, z
    return matrix
