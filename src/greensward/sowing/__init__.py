"""Sowing, WHERE blades grow: the sward that a scene describes, sown on the GPU into a Field of blades."""

from greensward.sowing.clearings import Clearings, sward_defines
from greensward.sowing.field import Field, Page
from greensward.sowing.pages import Tiles, UnstoredPage

__all__ = ["Clearings", "Field", "Page", "Tiles", "UnstoredPage", "sward_defines"]
