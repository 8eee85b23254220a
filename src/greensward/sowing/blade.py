"""Blades as they lie on the GPU: 64 bytes each, 24 of its pose, and the bits that a surface has for its number."""

from enum import IntFlag

from greensward.gpu.layouts import constants, enumeration, struct
from greensward.scene.classes import BLADE_NUMBER_BITS, SurfaceClass

MOST_BLADES = (1 << BLADE_NUMBER_BITS) - 2
"""Greatest number of a blade in a frame: 0 stands for none."""
FIRST_TRACED = 1 << (BLADE_NUMBER_BITS - 1)
"""First number of a blade in a picture of grass, whose other bits are a hash."""

BLADE = struct(
    "Blade",
    ("x", "float"),  # root, metres
    ("y", "float"),
    ("z", "float"),
    ("facing", "float"),  # radians about up
    ("x1", "float"),  # control point at rest
    ("y1", "float"),
    ("z1", "float"),
    ("height", "float"),  # length along the curve, metres
    ("x2", "float"),  # tip at rest
    ("y2", "float"),
    ("z2", "float"),
    ("width", "float"),  # metres
    ("up", "uint"),  # octahedral, snorm 2 x 16
    ("stiffness", "float"),  # 0 follows the wind, 1 hardly moves
    ("flags", "uint"),  # species 0-3, `BladeFlag`, dryness 8-15, tint 16-23, crowding 24-31
    ("chance", "uint"),  # square root of the rank within its tile 0-15, random 16-31
)
POSE = struct(
    "Pose",
    ("now", "uint", 3),  # control point and tip relative to the root as six halfs
    ("previous", "uint", 3),  # one frame ago
)


class BladeFlag(IntFlag):
    """Bits of a blade's flags."""

    HEAD = 1 << 4
    LOW_DETAIL = 1 << 5
    """It belongs to the density map's low-detail subset."""
    ON_OBJECT = 1 << 6


enumeration("BladeFlag", "BLADE", BladeFlag)
enumeration("SurfaceClass", "CLASS", SurfaceClass)
constants("BladeBits", {"SPECIES_MASK": 15}, unsigned=True)
constants(
    "SurfaceBits",
    {
        "BLADE_NUMBER_BITS": BLADE_NUMBER_BITS,
        "BLADE_NUMBER_MASK": (1 << BLADE_NUMBER_BITS) - 1,
        "FIRST_TRACED": FIRST_TRACED,
    },
    unsigned=True,
)
