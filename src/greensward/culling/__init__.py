"""WHICH blades are drawn: tiles against the views, and how many of each."""

from greensward.culling.chunks import CHUNK, ChunkTable, Span
from greensward.culling.tiles import distance_to, shares_needed, visible

__all__ = ["CHUNK", "ChunkTable", "Span", "distance_to", "shares_needed", "visible"]
