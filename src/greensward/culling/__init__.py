"""WHICH blades are drawn: tiles against the views, how many of each, and then every blade on its own."""

from greensward.culling.chunks import CHUNK, ChunkTable, Span, at_least
from greensward.culling.pyramid import Pyramid
from greensward.culling.sieve import Sieve, distance_defines, test_defines, width_from
from greensward.culling.tiles import distance_to, shares_needed, visible

__all__ = [
    "CHUNK",
    "ChunkTable",
    "Pyramid",
    "Sieve",
    "Span",
    "at_least",
    "distance_defines",
    "distance_to",
    "shares_needed",
    "test_defines",
    "visible",
    "width_from",
]
