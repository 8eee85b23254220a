"""Reading of STL, text and binary."""

import numpy as np

from greensward.io.parts import Content, Part

_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])


def read_stl(data: bytes) -> Content:
    """The triangles of an STL file; bytes past the last mean nothing. Raises `ValueError` where it is damaged."""
    count = int.from_bytes(data[80:84], "little")
    end = 84 + _FACET.itemsize * count
    if len(data) != end and data.lstrip()[:5].lower() == b"solid":
        words = np.array(data.lower().split())
        at = np.flatnonzero(words == b"vertex")
        if len(at) % 3 or (len(at) and at[-1] + 3 >= len(words)) or b"endsolid" not in words[-50:]:
            raise ValueError("its text ends within a facet")
        corners = words[at[:, None] + np.arange(1, 4)].astype(np.float64)
    elif len(data) < 84 or len(data) < end:
        raise ValueError(f"it needs {end:,} bytes and has {len(data):,}")
    else:
        corners = np.frombuffer(data, _FACET, count, 84)["corners"].reshape(-1, 3).astype(np.float64)
    return Content([Part(corners, np.arange(len(corners)).reshape(-1, 3))])
