"""pcg3d of Jarzynski & Olano 2020, listing 2, in Python integers."""

import numpy as np

_MASK = 0xFFFFFFFF


def hash3(x: int, y: int, z: int) -> tuple[int, int, int]:
    """Three hashed words of three words."""
    v = [(value * 1664525 + 1013904223) & _MASK for value in (x, y, z)]

    def mix() -> None:
        v[0] = (v[0] + v[1] * v[2]) & _MASK
        v[1] = (v[1] + v[2] * v[0]) & _MASK
        v[2] = (v[2] + v[0] * v[1]) & _MASK

    mix()
    v[:] = [word ^ (word >> 16) for word in v]
    mix()
    return v[0], v[1], v[2]


def hashes(words: np.ndarray) -> np.ndarray:
    """Rows of three words to rows of three hashed words, uint32 (n, 3)."""
    return np.array([hash3(*(int(word) for word in row)) for row in words], np.uint32).reshape(-1, 3)


def unit(words: np.ndarray) -> np.ndarray:
    """The upper 24 bits as a number in 0..1, 1 excluded."""
    return (np.asarray(words, np.uint32) >> np.uint32(8)) / 2.0**24
