"""Settings of the ray-marched grid of billboards."""

from typing import Literal

from pydantic import Field

from greensward.scene.base import Count, Flag, Model, Number, OptionalFileName, default


class GridSettings(Model):
    """Spacing of billboards, their images, and the ray marching through them."""

    spacing: Number = Field(0.35, ge=0.005, le=20)
    """Distance from one billboard to the next, in mean lengths of a blade; from 1 on its rows show."""
    irregularity: Number = Field(0.7, ge=0, le=0.9)
    """Offset of billboards from a regular grid, in spacings; 0 shows its rows."""
    turn_deg: Number = Field(27.0, ge=-90, le=90)
    """Angle that the grid is turned by, so that no path of the camera runs along its rows."""
    carrier: Flag = False
    """True as published: polygons carry the grid, those of the ground, raised to the height of the tips. Each ray
    meets `steps` billboards below the polygon through which it comes, and is then filled. Hills have no silhouette of
    blades, and a camera lower than the tips sees no grass."""
    steps: Count = Field(40, ge=1, le=64)
    """Billboards that a ray meets at most. Where more stand before the ground, each of the second half of them stands
    for some, and what is left transparent at the last is filled."""
    early_exit: Flag = True
    """End a ray where nothing behind it would show; without it, all rays take the same steps."""
    fill: Literal["texture", "colour"] = "texture"
    """Filling of the rest: an opaque image of grass, or its mean colour."""
    middle_plane: Flag = True
    """Add a plane at half the height, which closes the grass for views from above."""
    opacity: Number = Field(0.5, ge=0.001, le=1)
    """A pixel shows grass from this opacity on, at the depth where it is reached; where blades are finer than a
    pixel, by chance, so that samples average."""
    sway: Literal["blade", "shear"] = "blade"
    """Motion of billboards in the wind: along the curve of a bent blade, whose tip sinks, or, as published, sheared
    by an offset that grows with height."""
    layers: Count = Field(8, ge=1, le=64)
    """Number of different billboards; the grid takes them in random order."""
    billboard_m: Number = Field(1.0, ge=0.01, le=50)
    """Width of a billboard, after which it repeats."""
    texture_px: Count = Field(768, ge=16, le=4096)
    """Texels on that width."""
    roundness: Number = Field(0.55, ge=0, le=1)
    """Turn of the shading normal across a blade: 0 is flat."""
    side_texture: OptionalFileName = default(None)
    """Picture of grass from the side with transparency, instead of blades of the scene's own species; its right edge
    continues on its left, and its lower edge is the ground. As high as the tallest species."""
    top_texture: OptionalFileName = default(None)
    """Picture of grass from above with transparency, likewise."""
