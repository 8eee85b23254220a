"""WHICH blades are drawn: tiles against the view, and how many of each."""

from greensward.culling.tiles import CHUNK, Chunks, share_needed, visible

__all__ = ["CHUNK", "Chunks", "share_needed", "visible"]
