"""Which billboard of a grid on level ground a ray meets first (Habel, Wimmer & Jeschke 2007), in float64."""

import numpy as np
import numpy.typing as npt

from oracles import hashing

Floats = npt.NDArray[np.float64]


def stands_at(plane: npt.NDArray[np.int64], axis: int, spacing_m: float, irregularity: float, seed: int) -> Floats:
    """Where a plane stands on its axis, in metres: off a regular place by up to half the irregularity."""
    words = np.stack([plane & 0xFFFFFFFF, np.full(plane.shape, axis), np.full(plane.shape, seed ^ 0x2545F491)], -1)
    chance = hashing.unit(hashing.hashes(words.astype(np.uint32)))[..., 0]
    return (plane + irregularity * (chance - 0.5)) * spacing_m


def first_met(
    eye: Floats, rays: Floats, spacing_m: float, turn: float, irregularity: float, tall_m: float, seed: int
) -> tuple[Floats, Floats]:
    """Share of each ray to the first billboard between ground and `tall_m`, and how high it is met, (n,) each.

    Infinite where there is none.
    """
    grid = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    start, way = grid @ eye[[0, 2]], rays[:, [0, 2]] @ grid.T
    best = np.full(len(rays), np.inf)
    reach = 2.0 + np.abs(start).max() + np.abs(way).max()
    for axis in (0, 1):
        planes = np.arange(-int(reach / spacing_m), int(reach / spacing_m) + 1)
        for at in stands_at(planes, axis + 1, spacing_m, irregularity, seed):
            with np.errstate(divide="ignore", invalid="ignore"):
                share = (at - start[axis]) / way[:, axis]
                high = eye[1] + share * rays[:, 1]
            met = (share > 0.0) & (high > 0.0) & (high < 0.97 * tall_m) & (share < best)
            best = np.where(met, share, best)
    return best, np.where(np.isfinite(best), eye[1] + np.where(np.isfinite(best), best, 0.0) * rays[:, 1], np.inf)
