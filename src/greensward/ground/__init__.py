"""Ground that the grass stands on: one height raster for every kind of ground, sampled alike in Python and GLSL."""

from greensward.ground.height_field import HeightField, ground_size_m

__all__ = ["HeightField", "ground_size_m"]
