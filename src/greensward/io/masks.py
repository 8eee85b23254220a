"""Density maps in, with a warning where one cannot be meant as it is."""

import warnings
from pathlib import Path

import numpy as np
import numpy.typing as npt

from greensward.io.rasters import read_rgba
from greensward.scene.raster import Raster


def read_mask(path: Path | Raster, with_heights: bool = True) -> npt.NDArray[np.uint8]:
    """A density map as `read_rgba` has it: red is density and, `with_heights`, blue the height of the grass.

    Warns where red, blue or alpha say what nobody means. Raises `InputError` for a file that cannot be read.
    """
    pixels = read_rgba(path)
    if doubt := doubt_of(pixels, with_heights):
        warnings.warn(f"{path}: {doubt}", stacklevel=2)
    return pixels


def doubt_of(pixels: npt.NDArray[np.uint8], with_heights: bool = True) -> str | None:
    """Reason why a density map (rows, columns, 4) cannot be meant as it is, with its cure; None where it can."""
    red, blue, alpha = pixels[..., 0], pixels[..., 2], pixels[..., 3]
    if np.ptp(alpha) and (pixels[..., :3] == pixels[0, 0, :3]).all():
        return "only its alpha varies, which a density map does not use; save the alpha as a grey picture"
    if red.max() == 1:
        return (
            "its greatest density is 1 of 255, so next to nothing grows; scale classes such as 0 and 1: "
            "gdal_translate -ot Byte -scale 0 1 0 255 in.tif out.png"
        )
    if with_heights and red.any() and not blue[red > 0].any():
        return (
            "blue, the height of the grass, is 0 wherever red, its density, is not, so nothing grows; "
            "save it in grey, or set blue to 255"
        )
    return None
