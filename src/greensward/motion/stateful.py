"""Contract of the parts of motion that have state."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from greensward.culling import ChunkTable

Floats = npt.NDArray[np.float64]
Saved = dict[str, npt.NDArray[Any]]


@dataclass(frozen=True)
class MotionStep:
    """Instant that state is advanced to, and what acts on it until then."""

    time_s: float
    previous_time_s: float
    """Time of the frame before."""
    camera_ws: Floats
    placed_at: Callable[[float], Floats]
    """World from own space of every object at a time, (objects, 4, 4)."""
    chunks: ChunkTable
    culled: bool
    """The visible set is another than a frame ago."""


class Stateful(Protocol):
    """Motion whose present depends on its past: the simulation of blades, or a wind field."""

    def advance(self, step: MotionStep) -> None:
        """Advance the state to an instant."""

    def saved(self) -> Saved:
        """Read back everything that the next step depends on, as arrays."""

    def resume(self, saved: Mapping[str, npt.NDArray[Any]]) -> None:
        """Continue from what `saved` returned. Raises `InputError` where it does not fit the scene."""

    def release(self) -> None:
        """Free the GPU resources."""
