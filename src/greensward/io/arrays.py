"""Arrays of NumPy's format in, whose headers are judged before memory is taken."""

import math
from typing import IO, Any

import numpy as np
import numpy.typing as npt

_HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}


def npy_header(stream: IO[bytes]) -> tuple[tuple[int, ...], np.dtype[Any]] | None:
    """Shape and type that a stream's header tells; None for a version that only named fields need.

    Raises `ValueError` where it is damaged.
    """
    read_header = _HEADERS.get(np.lib.format.read_magic(stream))
    if read_header is None:
        return None
    shape, _, dtype = read_header(stream)
    return shape, dtype


def read_npy(stream: IO[bytes], size: int) -> npt.NDArray[Any]:
    """The array of a stream of that many bytes, from its start. Raises `ValueError` for one that tells of more."""
    header = npy_header(stream)
    if header is None or math.prod(header[0]) * header[1].itemsize > size:
        raise ValueError("it is cut short")
    stream.seek(0)
    return np.asarray(np.lib.format.read_array(stream, allow_pickle=False))
