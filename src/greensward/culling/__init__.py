"""Culling, WHICH blades are drawn: tiles against the views, level of detail, then every blade on its own."""

from greensward.culling.blade_culling import BladeCulling, distance_defines, test_defines, width_from
from greensward.culling.chunks import CHUNK, ChunkRange, ChunkTable
from greensward.culling.compaction import DRAW_COMMAND, Compaction
from greensward.culling.depth_pyramid import DepthPyramid
from greensward.culling.tiles import coverage_needed, distance_to, in_view
from greensward.culling.visible import DrawList, NeededTiles, VisibleSet

__all__ = [
    "CHUNK",
    "DRAW_COMMAND",
    "BladeCulling",
    "ChunkRange",
    "ChunkTable",
    "Compaction",
    "DepthPyramid",
    "DrawList",
    "NeededTiles",
    "VisibleSet",
    "coverage_needed",
    "distance_defines",
    "distance_to",
    "in_view",
    "test_defines",
    "width_from",
]
