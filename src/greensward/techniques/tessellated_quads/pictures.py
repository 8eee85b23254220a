"""Images of blades: an outline and colours for each species, as layers of one texture."""

import moderngl
import numpy as np
import numpy.typing as npt
from PIL import Image

from greensward.io.rasters import decoded, read_colours, read_rgba, spread
from greensward.scene import Grass, InputError, Scene

SIZE = 64, 256
"""Columns and rows of a picture that is generated; of files, the largest of all is taken."""
MOST_PX = 1024
Pixels = npt.NDArray[np.float64]


def blade_pictures(scene: Scene) -> npt.NDArray[np.uint8]:
    """Square root of linear red, green and blue, and alpha, uint8 (species, rows, columns, 4), first row at the root.

    Raises `InputError` for a texture that has no opaque part.
    """
    found = [(_alpha(scene, grass), _colours(scene, grass)) for grass in scene.grass] or [(np.ones((1, 1)), None)]
    sizes = [SIZE] + [part.shape[1::-1] for both in found for part in both if part is not None]
    columns, rows = (min(max(edges), MOST_PX) for edges in zip(*sizes, strict=True))
    layers = np.empty((len(found), rows, columns, 4))
    for layer, (alpha, colours) in zip(layers, found, strict=True):
        layer[..., 3] = _scaled(alpha, columns, rows)
        if colours is None:
            layer[..., :3] = _fibres(columns)[None, :, None]
        else:
            for channel in range(3):
                layer[..., channel] = _scaled(colours[..., channel], columns, rows)
    coded = np.round(255.0 * layers).astype(np.uint8)
    for layer, (_, colours) in zip(coded, found, strict=True):
        if colours is not None:  # what the outline cuts away never shows
            layer[:] = spread(layer)
    return np.ascontiguousarray(coded[:, ::-1])


def picture_array(ctx: moderngl.Context, scene: Scene) -> moderngl.TextureArray:
    """The pictures on the GPU."""
    pictures = blade_pictures(scene)
    layers, rows, columns, _ = pictures.shape
    texture = ctx.texture_array((columns, rows, layers), 4, pictures.tobytes())
    texture.build_mipmaps()
    texture.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
    texture.repeat_x = texture.repeat_y = False
    return texture


def coloured(scene: Scene) -> int:
    """Bits of the species that have a diffuse texture."""
    return sum(1 << i for i, grass in enumerate(scene.grass) if grass.diffuse_texture)


def slender(scene: Scene) -> int:
    """Bits of the species whose alpha texture leaves out much more than the outline of a leaf does."""
    return sum(1 << i for i, grass in enumerate(scene.grass) if _alpha(scene, grass).mean() < 0.4)


def _alpha(scene: Scene, grass: Grass) -> Pixels:
    if grass.alpha_texture is None:
        return outline(grass.shape, *SIZE)
    path = scene.resolve(grass.alpha_texture)
    pixels = read_rgba(path) / 255.0
    alpha = pixels[..., 3] if pixels[..., 3].min() < 1.0 else pixels[..., :3].mean(axis=-1)
    if alpha.max() == 0.0:
        raise InputError(
            f"{path}: grass.alpha_texture: must be opaque or bright somewhere, or no blade would be seen"
        )
    return alpha


def _colours(scene: Scene, grass: Grass) -> Pixels | None:
    if grass.diffuse_texture is None:
        return None
    result: Pixels = np.sqrt(decoded(read_colours(scene.resolve(grass.diffuse_texture))[..., :3] / 255.0))
    return result


def _scaled(values: Pixels, columns: int, rows: int) -> Pixels:
    if values.shape == (rows, columns):
        return values
    picture = Image.fromarray(values.astype(np.float32)).resize((columns, rows), Image.Resampling.BILINEAR)
    return np.clip(np.asarray(picture, np.float64), 0.0, 1.0)


def _fibres(columns: int) -> Pixels:
    """Veins along the blade, paler at the middle; a factor on the species' colour, by column."""
    u = (np.arange(columns) + 0.5) / columns
    veins = 0.93 + 0.04 * np.cos(2.0 * np.pi * 9.0 * u)
    result: Pixels = np.minimum(veins + 0.06 * np.exp(-(((u - 0.5) / 0.05) ** 2)), 1.0)
    return result


def outline(shape: str, columns: int, rows: int) -> Pixels:
    """Part of each texel inside the outline of `grass.shape`, float64 (rows, columns), first row at the tip.

    The outlines of techniques/outlines.glsl (Jahrmann & Wimmer 2017), without what depends on the size on the screen.
    """
    v = 1.0 - (np.arange(rows) + 0.5) / rows
    left, right = np.zeros(rows), np.ones(rows)
    if shape == "triangle":
        left, right = 0.5 * v, 1.0 - 0.5 * v
    elif shape == "triangle-tip":
        left = 0.5 * np.clip(2.0 * v - 1.0, 0.0, 1.0)
        right = 1.0 - left
    elif shape == "dandelion":
        lobes = 2.0 * np.abs(np.sin(1.5 * np.pi * v) * np.cos(1.5 * np.pi * v))
        reach = (0.32 + 0.68 * lobes) * _smooth(v / 0.7) * (1.0 - _smooth((v - 0.9) / 0.1)) + 0.08 * (1.0 - v)
        left, right = 0.5 - 0.5 * reach, 0.5 + 0.5 * reach
    elif shape != "quad":
        right = 1.0 - v * v
    u = np.arange(columns) / columns
    inside = np.minimum(u + 1.0 / columns, right[:, None]) - np.maximum(u, left[:, None])
    result: Pixels = np.clip(inside * columns, 0.0, 1.0)
    return result


def _smooth(t: Pixels) -> Pixels:
    t = np.clip(t, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)
