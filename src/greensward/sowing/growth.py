"""Growth of the scene as a uniform block."""

import numpy as np
import numpy.typing as npt

from greensward.gpu.layouts import block
from greensward.scene import Growth
from greensward.scene.field import MOST_KEYS

_CURVES = ("height", "width", "stiffness")

GROWTH_BLOCK = block(
    "Growth",
    ("keys", "vec4", len(_CURVES) * MOST_KEYS),  # age and factor; a curve's last key is repeated
    ("spread", "float"),
    ("phase", "float"),
)


def curve_rows(growth: Growth) -> npt.NDArray[np.float32]:
    """Keys of all curves as the block holds them, float32 (24, 4)."""
    rows = np.zeros((len(_CURVES), MOST_KEYS, 4), np.float32)
    for row, name in zip(rows, _CURVES, strict=True):
        keys = getattr(growth, name)
        row[:, :2] = keys + keys[-1:] * (MOST_KEYS - len(keys))
    return rows.reshape(-1, 4)


def phase_at(growth: Growth, time_s: float) -> float:
    """Phase of growth: a blade's age is this less how late it is, which is at most `spread`.

    At 0 all are seeds; at 1 + `spread`, beyond which nothing changes, all are full-grown.
    """
    full = 1.0 + growth.spread
    return float(np.clip(growth.age * full + time_s / growth.time_s, 0.0, full))


def cover_at(growth: Growth | None, time_s: float) -> float:
    """Mean cover of the field as a part of the full-grown one's: height times width over all ages at a time."""
    if growth is None:
        return 1.0
    ages = np.clip(phase_at(growth, time_s) - growth.spread * np.linspace(0.0, 1.0, 33), 0.0, 1.0)
    tall, wide = (np.interp(ages, *np.array(curve).T) for curve in (growth.height, growth.width))
    return float(np.minimum(tall * wide, 1.0).mean())
