"""Colour of the grass by place: octaves of noise as a uniform block, or the green of the ground's pictures."""

import moderngl
import numpy as np
import numpy.typing as npt
from PIL import Image

from greensward.gpu.buffers import release_all
from greensward.gpu.device import Device
from greensward.gpu.kernels import Bindings
from greensward.gpu.layouts import BlockBuffer, block
from greensward.io.rasters import decoded, read_rgba
from greensward.scene import GroundColour, InputError, NoiseColour, Scene
from greensward.scene.base import linear
from greensward.scene.colour import MOST_NOISES

TINTS_BLOCK = block(
    "Tints",
    ("low", "vec4"),  # linear; strength of all
    ("high", "vec4"),
    # wavelength in metres, gain, lacunarity and octaves of each; then its part in red, green and blue
    ("noises", "vec4", 2 * MOST_NOISES),
    ("count", "int"),
)
_CHANNELS = ("red", "green", "blue")
Pixels = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.float64]


def colour_defines(scene: Scene) -> dict[str, object]:
    """Defines of shaders of `sowing/colour.glsl`, so that they hold what the scene needs and no more."""
    if isinstance(scene.colour, GroundColour):
        return {"COLOUR_GROUND": 1, **({"TILES": 1} if scene.ground.tile else {})}
    return {"COLOUR_NOISE": 1} if scene.colour else {}


def tints_values(scene: Scene) -> dict[str, object]:
    """Members of the `Tints` block for a scene that has `[colour]`."""
    colour = scene.colour
    if not isinstance(colour, NoiseColour):
        return {"low": (0.0, 0.0, 0.0, colour.strength if colour else 0.0)}
    rows = np.zeros((MOST_NOISES, 2, 4))
    for row, noise in zip(rows, colour.noise, strict=False):
        row[0] = noise.wavelength_m, noise.gain, noise.lacunarity, noise.octaves
        row[1, :3] = [noise.weight * (noise.channel in ("all", channel)) for channel in _CHANNELS]
    rows[:, 1] /= np.maximum(rows[:, 1].sum(axis=0), 1e-9)
    return {
        "low": (*linear(colour.low_colour), colour.strength),
        "high": (*linear(colour.high_colour), 0.0),
        "noises": rows.reshape(-1, 4),
        "count": len(colour.noise),
    }


def excess_green(srgb: npt.NDArray[np.integer] | Floats) -> Floats:
    """Excess green index (Woebbecke et al. 1995) of sRGB colours (..., 3 or 4): float64 (...); of black 0."""
    red, green, blue = np.moveaxis(np.asarray(srgb, np.float64)[..., :3], -1, 0)
    total = red + green + blue
    result: Floats = (2.0 * green - red - blue) / np.where(total > 0.0, total, 1.0)
    return result


def green_of(picture: Pixels, rule: GroundColour, repeats: bool) -> Pixels:
    """Colours that grass takes from a picture (rows, columns, 4): square roots of linear light; alpha where it grows.

    A texel that is not green takes the mean of the green ones in the smallest square around it that has any, up to
    `rule.neighbours` to each side, across the edges where the picture `repeats`. Where there are none, alpha is 0 and
    the colour the mean of all that is green.
    """
    light = decoded(picture[..., :3] / 255.0)
    green = (excess_green(picture) >= rule.greenness) & (picture[..., 3] > 0)
    found, grows = light * green[..., None], green.copy()
    for reach in range(1, rule.neighbours + 1):
        if grows.all():
            break
        sums = _sums_around(np.dstack([light * green[..., None], green]), reach, repeats)
        fresh = ~grows & (sums[..., 3] > 0.5)
        found[fresh] = sums[fresh, :3] / sums[fresh, 3:]
        grows |= fresh
    found[~grows] = light[green].mean(axis=0) if green.any() else 0.0
    coded: Pixels = np.round(255.0 * np.sqrt(np.dstack([found, grows]))).astype(np.uint8)
    return coded


def _sums_around(values: Floats, reach: int, repeats: bool) -> Floats:
    """Sums over the squares of 2 × reach + 1 texels around each."""
    padding = ((reach, reach), (reach, reach), (0, 0))
    sums = np.pad(values, padding, mode="wrap" if repeats else "constant").cumsum(axis=0).cumsum(axis=1)
    sums = np.pad(sums, ((1, 0), (1, 0), (0, 0)))
    wide = 2 * reach + 1
    around = sums[wide:, wide:] - sums[:-wide, wide:] - sums[wide:, :-wide] + sums[:-wide, :-wide]
    result: Floats = np.maximum(around, 0.0)  # differences of large sums may fall below
    return result


def green_pictures(scene: Scene, rule: GroundColour) -> tuple[list[Pixels], Pixels]:
    """Green of the soil and of each tile's, and of the terrain map, as `green_of` has it; black where there is none.

    Raises `InputError` where no picture has a green texel.
    """
    ground = scene.ground
    named = [
        ("ground.texture", ground.texture),
        *((f"ground.tile[{i}].texture", tile.texture) for i, tile in enumerate(ground.tile)),
        ("ground.terrain_map", ground.terrain_map),
    ]
    none = np.zeros((1, 1, 4), np.uint8)
    pictures = [read_rgba(scene.resolve(file)) if file else none for _, file in named]
    repeats = [True] * (len(named) - 1) + [ground.beyond == "repeat"]
    greens = [green_of(each, rule, repeat) for each, repeat in zip(pictures, repeats, strict=True)]
    if not any(each[..., 3].any() for each in greens):
        key, file = next((key, file) for key, file in named if file)
        greenest = max(excess_green(each).max() for (_, file), each in zip(named, pictures, strict=True) if file)
        raise InputError(
            f"{key}: {scene.resolve(file)}: must have a texel of greenness {rule.greenness:g} for "
            f'colour.kind = "ground" (greenest is {greenest:.2f}); lower colour.greenness, or take a greener picture'
        )
    return greens[:-1], greens[-1]


class GrassColours:
    """Colours by place on the GPU; only what is bound must be there where the scene has none."""

    def __init__(self, device: Device, scene: Scene) -> None:
        self._block = BlockBuffer(device.ctx, TINTS_BLOCK)
        self.bindings: Bindings = {"Tints": self._block}
        """Block and textures, by their names in shaders."""
        self._textures: list[moderngl.Texture | moderngl.TextureArray] = []
        self.change(scene)
        if not isinstance(scene.colour, GroundColour):
            return
        soils, terrain = green_pictures(scene, scene.colour)
        rows, columns = (max(each.shape[axis] for each in soils) for axis in (0, 1))
        layers = np.stack([_enlarged(each, rows, columns) for each in soils])
        array = device.ctx.texture_array((columns, rows, len(layers)), 4, layers.tobytes())
        whole = device.ctx.texture(terrain.shape[1::-1], 4, np.ascontiguousarray(terrain).tobytes())
        whole.repeat_x = whole.repeat_y = scene.ground.beyond == "repeat"
        self._textures = [array, whole]
        for texture in (array, whole):
            texture.build_mipmaps()
            texture.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
        self.bindings |= {"green_soils": array, "green_map": whole}

    def change(self, scene: Scene) -> None:
        """Take the numbers of another scene, whose pictures are the same."""
        self._block.set(**tints_values(scene))  # type: ignore[arg-type]

    def release(self) -> None:
        """Free the GPU memory."""
        release_all(self._block, *self._textures)


def _enlarged(picture: Pixels, rows: int, columns: int) -> Pixels:
    if picture.shape[:2] == (rows, columns):
        return picture
    return np.asarray(Image.fromarray(picture).resize((columns, rows), Image.Resampling.NEAREST))
