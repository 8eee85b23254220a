"""Blades, poses and states as they lie on the GPU, read back."""

import numpy as np

from greensward.motion.simulation import STATE
from greensward.sowing import Field, blade
from greensward.sowing.field import Page
from greensward.world import World
from oracles import octahedral

# rows as vectors, where the shaders' struct has numbers
BLADE = np.dtype(
    [
        ("root", "f4", 3),
        ("facing", "f4"),
        ("control", "f4", 3),
        ("height", "f4"),
        ("tip", "f4", 3),
        ("width", "f4"),
        ("up", "i2", 2),
        ("stiffness", "f4"),
        ("flags", "u4"),
        ("rank_root", "u2"),
        ("random", "u2"),
    ]
)
_POSE = np.dtype([("now", "f2", 6), ("previous", "f2", 6)])
_STATE = np.dtype([("tip", "f4", 3), ("pressed", "f4"), ("velocity", "f4", 3), ("step", "f4")])
_SPECIES = 15
assert (BLADE.itemsize, _POSE.itemsize, _STATE.itemsize) == tuple(
    each.dtype.itemsize for each in (blade.BLADE, blade.POSE, STATE)
)


def read_blades(field: Field) -> np.ndarray:
    """All blades of a field, in its own order."""
    return blades_by_number(field)[all_numbers(field)]


def blades_by_number(field: Field) -> np.ndarray:
    """Blades by their numbers in a frame; numbers that no blade has are between them, and 0 is one."""
    return np.concatenate([np.zeros(1, BLADE), *(np.frombuffer(page.blades.read(), BLADE) for page in field.pages)])


def numbers_of(field: Field, ids: np.ndarray) -> np.ndarray:
    """Numbers of stored blades by their permanent ids, int64 of the same shape; 0 for what is none."""
    numbers = np.concatenate([[0], all_numbers(field)])
    known = np.concatenate([[np.uint64(0)], field.identify(numbers[1:].astype(np.uint32))])
    order = np.argsort(known)
    at = np.minimum(np.searchsorted(known[order], ids), len(order) - 1)
    return np.where(known[order][at] == ids, numbers[order][at], 0)


def all_numbers(field: Field) -> np.ndarray:
    """Number of each blade in a frame, in the order of `read_blades`."""
    order = field.order()
    return np.array([page.first_number for page in field.pages], np.int64)[order.page] + order.row


def read_poses(page: Page) -> np.ndarray:
    """Control point and tip relative to the root, now and one frame ago, tile by tile: float64 (n, 2, 2, 3)."""
    return _poses(np.frombuffer(page.poses.read(), _POSE)[page.tiles.rows()])


def poses_of(field: Field) -> np.ndarray:
    """Poses of all blades in the order of `read_blades`, as `read_poses` has them."""
    by_number = [np.zeros(1, _POSE), *(np.frombuffer(page.poses.read(), _POSE) for page in field.pages)]
    return _poses(np.concatenate(by_number)[all_numbers(field)])


def _poses(raw: np.ndarray) -> np.ndarray:
    return np.stack([raw["now"], raw["previous"]], 1).reshape(len(raw), 2, 2, 3).astype(np.float64)


def up_of(blades: np.ndarray) -> np.ndarray:
    return octahedral.decode(blades["up"] / 32767.0)


def species_of(blades: np.ndarray) -> np.ndarray:
    return blades["flags"] & _SPECIES


def has_head(blades: np.ndarray) -> np.ndarray:
    return (blades["flags"] & blade.BladeFlag.HEAD) != 0


def points(blades: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Root, control point and tip at rest, float64 (n, 3) each."""
    return tuple(blades[name].astype(np.float64) for name in ("root", "control", "tip"))


def read_states(world: World) -> np.ndarray:
    """State of the blades of a simulated field, in the field's order."""
    return np.frombuffer(world.saved()["state"].tobytes(), _STATE)
