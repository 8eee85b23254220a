"""The scene's winds as one uniform block. A wind is a model, a row here and a `.glsl` file."""

import math

import numpy as np

from greensward.gpu.blocks import declare
from greensward.scene import Gusts
from greensward.scene.wind import Wind

MOST_WINDS = 8
ROWS = 2

WINDS_BLOCK = declare("Winds", 3, ("rows", "vec4", MOST_WINDS * ROWS), ("count", "int"), ("seed", "uint"))
KINDS: tuple[type, ...] = (Gusts,)


def _gusts(wind: Gusts) -> list[tuple[float, ...]]:
    # weather reports say where wind comes from, clockwise from north, which is −z
    azimuth = math.radians(wind.direction_deg)
    return [
        (KINDS.index(Gusts), -math.sin(azimuth), math.cos(azimuth), wind.speed_mps),
        (wind.gustiness, wind.gust_m, wind.turbulence, 0.0),
    ]


def wind_values(winds: tuple[Wind, ...], seed: int) -> dict[str, object]:
    """Members of the `Winds` block."""
    rows = np.zeros((MOST_WINDS * ROWS, 4), np.float32)
    for i, wind in enumerate(winds):
        assert isinstance(wind, Gusts)
        rows[i * ROWS : (i + 1) * ROWS] = _gusts(wind)
    return {"rows": rows, "count": len(winds), "seed": seed}
