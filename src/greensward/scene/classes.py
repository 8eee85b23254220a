"""Classes of surfaces in the G-buffer and in ground truth."""

from enum import IntEnum

BLADE_NUMBER_BITS = 27
"""Lower bits of a pixel's surface, which hold the number of the blade in this frame; the class is above them."""


class SurfaceClass(IntEnum):
    """Class of the surface that a pixel shows, as in `Frame.truth["class"]`."""

    SKY = 0
    GROUND = 1
    GRASS = 2
    FLOWER = 3
    OBJECT = 4
    WATER = 5
