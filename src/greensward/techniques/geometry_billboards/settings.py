"""Settings of billboards that the geometry stage makes."""

from typing import Annotated

from pydantic import AfterValidator, Field

from greensward.scene.base import Count, Flag, Model, Number, OptionalFileName, Triple, default

MOST_SEGMENTS = 12
_Distance = Annotated[Number, Field(ge=0, le=10_000)]
_Segments = Annotated[Count, Field(ge=1, le=MOST_SEGMENTS)]
_Percent = Annotated[Count, Field(ge=0, le=100)]


def _rising(distances: tuple[float, float, float]) -> tuple[float, float, float]:
    if sorted(distances) != list(distances):
        raise ValueError(f"must not fall from one level to the next (got {list(distances)}); sort them")
    return distances


class BillboardSettings(Model):
    """Pattern of roots, levels of detail, textures and shape of the blades."""

    roots: Count = Field(100, ge=1, le=1024)
    """Roots in the pattern of a tile. `sowing.density_per_m2` then gives the edge of the tiles."""
    levels_m: Annotated[Triple[_Distance], AfterValidator(_rising)] = default((5.0, 12.0, 24.0))
    """Distances from the camera at which each level of blades ends, the finest first. From the last on, tiles are
    flat and textured."""
    segments: Triple[_Segments] = default((5, 3, 1))
    """Segments of a blade, by level."""
    blades: Triple[_Percent] = default((100, 95, 85))
    """Blades for every 100 roots, by level."""
    fade: Number = Field(0.4, ge=0, le=1)
    """Part of the last level's distance over which blades shrink into the flat tiles; at 0 they end at once."""
    alpha: Number = Field(0.2, ge=0, lt=1)
    """Threshold on a blade's random value below which it takes the first colour texture."""
    beta: Number = Field(0.85, ge=0, lt=1)
    """Threshold below which it takes the second; from there on, the third. At most `alpha`, none takes the second."""
    first_texture: OptionalFileName = default(None)
    """Colours of the first kind of blade, the tip at the upper edge. Without it, fresh blades of the species."""
    second_texture: OptionalFileName = default(None)
    """Colours of the second kind. Without it, the species as other techniques show them."""
    third_texture: OptionalFileName = default(None)
    """Colours of the third kind. Without it, blades of the species that dry from the tip."""
    alpha_texture: OptionalFileName = default(None)
    """Outline of all blades: the picture's alpha channel, or its brightness where it has none. Without it, a leaf."""
    opacity: Number = Field(1.0, ge=0.001, le=1)
    """Least value of the alpha texture at which a blade is drawn; what lies below is discarded."""
    tile_texture: OptionalFileName = default(None)
    """Colours of a flat tile. Without it, the sward's own, with lines of other colours."""
    tube: Flag = False
    """Shade blades as round stalks, with the depth of a tube."""
    lean: Number = Field(0.5, ge=0, le=1)
    """Part of the lean that the species has in still air; at 0 only wind and forces bend blades."""
    min_width_px: Number = Field(1.5, ge=0, le=16)
    """Blades are widened to this, so that they do not break up far away."""
