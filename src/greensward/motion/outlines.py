"""The force around whatever presses grass down, from the distance to its outline; no GPU."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from greensward.io.rasters import read_rgba
from greensward.scene import InputError

Floats = npt.NDArray[np.floating]
Mask = npt.NDArray[np.bool_]


def forces_around(distance: Floats, normal: Floats, rim: float, impact: float) -> Floats:
    """Forces (…, 3), x, up and z, at signed distances to an outline, negative inside, along its normals (…, 2).

    Jahrmann & Wimmer 2013, section 5.2: down where the object pressed fully, outwards at its border, and outwards
    with decreasing length in the surroundings. Over `rim` inside the border the one turns into the other.
    """
    turn = 0.5 * np.pi * np.clip(1.0 + distance / rim, 0.0, 1.0)
    wide = impact > 1e-6  # metres; a narrower rim is none
    left = np.clip(1.0 - distance / impact, 0.0, 1.0) ** 2 if wide else (distance <= 0.0).astype(float)
    around = left * np.sin(turn)
    return np.stack([around * normal[..., 0], -np.cos(turn), around * normal[..., 1]], axis=-1)


def normals(distance: Floats) -> Floats:
    """Unit normals (rows, columns, 2), x and z, of a field of distances; zero where it is level."""
    down, right = np.gradient(distance)
    steep = np.hypot(right, down)
    return np.stack([right, down], axis=-1) / np.where(steep > 1e-9, steep, 1.0)[..., None]


def distance_to(mask: Mask, most: float) -> npt.NDArray[np.float32]:
    """Distance of every cell to the nearest that is set, in cells, exact up to `most`, which it does not exceed.

    Along the columns first, then along the rows for each shift (Saito & Toriwaki 1994).
    """
    most = float(max(most, 1.0))
    near = np.where(mask, 0.0, most).astype(np.float32)
    for row in range(1, len(near)):
        np.minimum(near[row], near[row - 1] + 1.0, out=near[row])
    for row in range(len(near) - 2, -1, -1):
        np.minimum(near[row], near[row + 1] + 1.0, out=near[row])
    squares = np.square(near)
    least = squares.copy()
    for shift in range(1, min(int(np.ceil(most)) + 1, mask.shape[1])):
        if shift * shift >= least.max():
            break
        np.minimum(least[:, shift:], squares[:, :-shift] + shift * shift, out=least[:, shift:])
        np.minimum(least[:, :-shift], squares[:, shift:] + shift * shift, out=least[:, :-shift])
    return np.sqrt(least)


def signed_distance(mask: Mask, most: float) -> npt.NDArray[np.float32]:
    """Distance to the border of what is set, in cells, negative inside; beyond the mask nothing is set."""
    wide = np.pad(mask, 1)
    outside, inside = distance_to(wide, most), distance_to(~wide, max(wide.shape))
    distance = np.where(wide, 0.5 - inside, outside - 0.5)[1:-1, 1:-1].astype(np.float32)
    return _smoothed(distance)  # or steps of the mask would show in the normals


def rim_of(distance: Floats) -> float:
    """Width inside of its border over which an outline turns from aside to down: a fifth of its deepest part."""
    return max(0.2 * -float(distance.min()), 0.5)


def read_outline(path: Path) -> Floats:
    """Part of each pixel of a picture that belongs to what pressed, 0 to 1: its alpha if it has any, or its darkness.

    Raises `InputError` for a file that cannot be read, or where nothing pressed.
    """
    rgba = read_rgba(path)
    clear = (rgba[..., 3] < 255).any()
    grey = rgba[..., :3] @ np.array([0.299, 0.587, 0.114])
    pressed = (rgba[..., 3] if clear else 255.0 - grey) / 255.0
    if not (pressed > 0.5).any():
        raise InputError(f"{path}: nothing in it is {'opaque' if clear else 'dark'}, so nothing would press")
    return np.asarray(pressed, np.float64)


def resized(picture: Floats, size: tuple[int, int]) -> npt.NDArray[np.float32]:
    """A picture (rows, columns, …) of another size, (columns, rows); averaged where that is smaller."""
    planes = np.moveaxis(np.atleast_3d(picture).astype(np.float32), -1, 0)
    made = [np.asarray(Image.fromarray(plane).resize(size, Image.Resampling.BILINEAR)) for plane in planes]
    stacked: npt.NDArray[np.float32] = np.stack(made, axis=-1)
    return stacked if picture.ndim == 3 else stacked[..., 0]


def as_picture(forces: Floats) -> npt.NDArray[np.uint8]:
    """Forces as a picture of `kind = "map"`."""
    picture: npt.NDArray[np.uint8] = np.clip(np.rint(128.0 + 127.0 * forces), 0, 255).astype(np.uint8)
    return picture


def from_picture(rgba: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:
    """The forces in a picture of `kind = "map"`, (rows, columns, 3): 128 of 255 is 0; alpha scales them."""
    forces: npt.NDArray[np.float32] = np.clip((rgba[..., :3].astype(np.float32) - 128.0) / 127.0, -1.0, 1.0)
    forces *= rgba[..., 3:].astype(np.float32) / 255.0
    return forces


def _smoothed(field: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Averaged over 3 × 3 cells, the middle ones counting more."""
    for axis in (0, 1):
        wide = np.pad(field, [(1, 1) if axis == each else (0, 0) for each in (0, 1)], mode="edge")
        first, last = (np.take(wide, range(at, at + field.shape[axis]), axis) for at in (0, 2))
        field = (0.25 * first + 0.5 * field + 0.25 * last).astype(np.float32)
    return field
