"""Textures of billboards: an outline, three kinds of colours, and a flat tile, from files or generated."""

import moderngl
import numpy as np
import numpy.typing as npt
from PIL import Image

from greensward.gpu.buffers import release_all
from greensward.gpu.kernels import Bindings
from greensward.io.rasters import decoded, read_colours, read_rgba
from greensward.scene import InputError, Scene
from greensward.techniques.geometry_billboards.settings import BillboardSettings

SIZE = 64, 256
"""Columns and rows of a picture of a blade that is generated; of files, the largest of all is taken."""
TILE_PX = 128
MOST_PX = 1024
Pixels = npt.NDArray[np.float64]


class Pictures:
    """Textures by their names in shaders, and which of them hold colours of their own."""

    def __init__(self, ctx: moderngl.Context, scene: Scene, settings: BillboardSettings) -> None:
        files = settings.first_texture, settings.second_texture, settings.third_texture
        self.painted = sum(1 << i for i, file in enumerate(files) if file)
        """Bits of the colour textures that are files."""
        outline = _coded(outline_of(scene, settings))
        colours = _coded(colours_of(scene, settings))
        tile = _coded(tile_of(scene, settings))
        layers, rows, columns, _ = colours.shape
        array = ctx.texture_array((columns, rows, layers), 3, colours.tobytes(), alignment=1)
        flat = ctx.texture(tile.shape[1::-1], 3, tile.tobytes(), alignment=1)
        for texture in (array, flat):
            texture.build_mipmaps()
            texture.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
        alpha = ctx.texture(outline.shape[1::-1], 1, outline.tobytes(), alignment=1)
        alpha.filter = moderngl.LINEAR, moderngl.LINEAR
        alpha.repeat_x = alpha.repeat_y = array.repeat_x = array.repeat_y = False
        self._textures = alpha, array, flat
        self.bindings: Bindings = {"outline_image": alpha, "colour_images": array, "tile_image": flat}
        """Textures by their names in shaders."""

    def release(self) -> None:
        """Free the GPU memory."""
        release_all(*self._textures)


def _coded(values: Pixels) -> npt.NDArray[np.uint8]:
    return np.ascontiguousarray(np.round(255.0 * np.clip(values, 0.0, 1.0)).astype(np.uint8))


def outline_of(scene: Scene, settings: BillboardSettings) -> Pixels:
    """Alpha, (rows, columns), first row at the tip. Raises `InputError` where nothing of it would be drawn."""
    if settings.alpha_texture is None:
        return leaf(*SIZE)
    path = scene.resolve(settings.alpha_texture)
    pixels = read_rgba(path) / 255.0
    alpha: Pixels = pixels[..., 3] if pixels[..., 3].min() < 1.0 else pixels[..., :3].mean(axis=-1)
    if alpha.max() < settings.opacity - 0.5 / 255.0:
        raise InputError(
            f"technique.alpha_texture: {path}: must reach technique.opacity, {settings.opacity:g}, somewhere "
            f"(got at most {alpha.max():.3g}), or no blade would be seen; lower technique.opacity"
        )
    return alpha


def leaf(columns: int, rows: int) -> Pixels:
    """Part of each texel inside a leaf that tapers to its tip and a little to its base, first row at the tip."""
    h = 1.0 - (np.arange(rows) + 0.5) / rows
    half = 0.5 * (1.0 - h**2.2) * (0.8 + 0.2 * np.clip(h / 0.3, 0.0, 1.0))
    u = np.arange(columns) / columns
    inside = np.minimum(u + 1.0 / columns, 0.5 + half[:, None]) - np.maximum(u, 0.5 - half[:, None])
    result: Pixels = np.clip(inside * columns, 0.0, 1.0)
    return result


def colours_of(scene: Scene, settings: BillboardSettings) -> Pixels:
    """Square roots of colours, or of shares of a species' root, tip and dry colour: (3, rows, columns, 3)."""
    files = settings.first_texture, settings.second_texture, settings.third_texture
    read = [_colours(scene, file) if file else None for file in files]
    sizes = [SIZE, *(each.shape[1::-1] for each in read if each is not None)]
    columns, rows = (min(max(edges), MOST_PX) for edges in zip(*sizes, strict=True))
    made = shares(columns, rows)
    return np.stack(
        [made[i] if each is None else np.sqrt(_scaled(each, columns, rows)) for i, each in enumerate(read)]
    )


def shares(columns: int, rows: int) -> Pixels:
    """Square roots of the shares of three kinds: fresh to the base, as other techniques, and dry from the tip."""
    h, u = 1.0 - (np.arange(rows)[:, None] + 0.5) / rows, (np.arange(columns)[None] + 0.5) / columns
    veins = 0.95 + 0.05 * np.cos(2.0 * np.pi * 5.0 * u)
    result = np.zeros((3, rows, columns, 3))
    for layer, grown, dry in zip(result, (0.5, 0.85, 0.85), (0.0, 0.0, 0.75), strict=True):
        tip, old = _smooth(h / grown), dry * _smooth((h - 0.15) / 0.7)
        for channel, share in enumerate(((1.0 - tip) * (1.0 - old), tip * (1.0 - old), old)):
            layer[..., channel] = np.sqrt(share * veins)
    return result


def tile_of(scene: Scene, settings: BillboardSettings) -> Pixels:
    """Square roots of colours, or of half the factors of the sward's colour: (rows, columns, 3), to be repeated."""
    if settings.tile_texture is None:
        return np.sqrt(0.5 * lines(TILE_PX, scene.seed))
    picture = _colours(scene, settings.tile_texture)
    columns, rows = (min(edge, MOST_PX) for edge in picture.shape[1::-1])
    result: Pixels = np.sqrt(_scaled(picture, columns, rows))
    return result


def lines(edge: int, seed: int) -> Pixels:
    """Factors around 1 of a tile of lines, as fresh, dark and dry blades lie, whose edges fit: (edge, edge, 3)."""
    random = np.random.default_rng([seed, 2024])
    kinds = np.array([[1.25, 1.3, 1.0], [0.62, 0.7, 0.7], [1.5, 1.25, 0.95], [0.95, 1.0, 0.95]])
    picture = np.ones((edge, edge, 3))
    count, steps = 12 * edge, edge // 5
    at, turn = random.random((count, 2)) * edge, random.random(count) * np.pi
    along = np.arange(steps)[:, None]
    for place, angle, kind in zip(at, turn, random.choice(len(kinds), count, p=(0.35, 0.3, 0.1, 0.25)), strict=True):
        column, row = ((place + along * (np.cos(angle), np.sin(angle))).astype(int) % edge).T
        picture[row, column] = kinds[kind]
    result: Pixels = picture / picture.mean(axis=(0, 1))
    return result


def _colours(scene: Scene, file: str) -> Pixels:
    """Linear colours, (rows, columns, 3)."""
    return decoded(read_colours(scene.resolve(file))[..., :3] / 255.0)


def _scaled(values: Pixels, columns: int, rows: int) -> Pixels:
    if values.shape[:2] == (rows, columns):
        return values
    channels = [
        Image.fromarray(values[..., i].astype(np.float32)).resize((columns, rows), Image.Resampling.BILINEAR)
        for i in range(values.shape[2])
    ]
    return np.clip(np.stack([np.asarray(each, np.float64) for each in channels], -1), 0.0, 1.0)


def _smooth(t: Pixels) -> Pixels:
    t = np.clip(t, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)
