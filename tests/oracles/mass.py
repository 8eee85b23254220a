"""Mass of a blade, and what of a wind moves it (motion/mass.glsl), in float64."""

import numpy as np


def mass_kg(height_m, width_m, kg_per_m2):
    """Mass of a parabola of this height and greatest width."""
    v = (np.arange(4000) + 0.5) / 4000
    return kg_per_m2 * np.asarray(height_m) * np.asarray(width_m) * (1.0 - v**2).mean()


def part(mass, reference_kg):
    """Acceleration over that of a blade of the reference mass under one force, at most 10."""
    return np.minimum(reference_kg / np.asarray(mass), 10.0)
