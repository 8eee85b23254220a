"""Blades as curved leaves: settings of every technique that draws them so."""

from typing import Any, Literal

from pydantic import Field

from greensward.gpu.layouts import block
from greensward.scene.base import Count, Model, Number

LEAF_BLOCK = block(
    "Leaf",
    ("error_px", "float"),
    ("max_level", "float"),
    ("min_width_px", "float"),
    ("roundness", "float"),
    ("orientation_limit", "float"),  # above 1, blades turn instead of vanishing
    ("slack_m", "float"),  # how far a blade may be from the curve of its pose, besides its width
)


class ThinSettings(Model):
    """Thinness and roundness of blades."""

    min_width_px: Number = Field(default=1.0, ge=0, le=16)
    """Blades are widened to this, so that they neither break up nor vanish edge-on."""
    roundness: Number = Field(default=0.55, ge=0, le=1)
    """Turn of the shading normal across a blade: 0 is flat."""
    edge_on: Literal["turn", "drop"] = "turn"
    """Blades seen from their edge: `turn` shows them their width all the same, so that grass stays closed and
    `culling.orientation` finds none to leave out; `drop` lets them thin out until nothing of them is left to draw."""
    orientation_limit: Number = Field(default=0.9, ge=0.2, le=1)
    """Cosine between view and width of a blade at which, with `drop`, nothing is left; it thins over 0.15 before."""

    def block_values(self) -> dict[str, Any]:
        """Members of the `Leaf` block."""
        numbers = {name: getattr(self, name) for name, *_ in LEAF_BLOCK.members if name in type(self).model_fields}
        return numbers if self.edge_on == "drop" else {**numbers, "orientation_limit": 2.0}


class LeafSettings(ThinSettings):
    """Fineness, thinness and roundness of blades."""

    error_px: Number = Field(default=0.7, ge=1e-6, le=100)
    """A blade gets as many segments as keep it this close to its true curve on the screen."""
    max_level: Count = Field(default=12, ge=1, le=64)
    """Never more segments than this."""
