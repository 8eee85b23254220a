"""The ground's heights and pictures on the GPU, at the bindings that shaders expect."""

import moderngl
import numpy as np
from PIL import Image

from greensward.gpu.blocks import BlockBuffer, declare
from greensward.gpu.context import is_software
from greensward.ground.height_field import HeightField
from greensward.ground.soil import generated_soil
from greensward.io.rasters import decoded, read_rgba
from greensward.scene import InputError, Scene
from greensward.scene.ground import MOST_TILES

_TILES_UNIT = 21
GROUND_BLOCK = declare(
    "Ground",
    1,
    ("size_m", "vec2"),
    ("samples", "vec2"),
    ("samples_per_m", "vec2"),
    ("soil_per_m", "float"),
    ("beyond", "int"),
    ("soil_mean", "vec4"),
    ("tile_area_m", "vec4", MOST_TILES),  # x and z, least and greatest
    ("tile_mean", "vec4", MOST_TILES),  # mean colour; copies of the texture on a metre
    ("tiles", "int"),
)


class GroundGpu:
    """Textures of the ground and its maps. A map that the scene lacks is one neutral texel."""

    def __init__(self, ctx: moderngl.Context, scene: Scene, heights: HeightField) -> None:
        limit = ctx.info["GL_MAX_TEXTURE_SIZE"]
        rows, columns = heights.heights.shape
        if max(rows, columns) > limit:
            raise InputError(
                f"ground: a height map of {columns} × {rows} is beyond this driver's {limit} texels a side; "
                "scale it down"
            )
        self.heights = heights
        self._textures: list[moderngl.Texture] = []
        heights_texture = ctx.texture((columns, rows), 1, heights.heights.tobytes(), dtype="f4")
        heights_texture.filter = moderngl.NEAREST, moderngl.NEAREST
        self._textures.append(heights_texture)

        ground, sowing = scene.ground, scene.sowing
        soil = read_rgba(scene.resolve(ground.texture)) if ground.texture else generated_soil(scene.seed)
        none = np.zeros((1, 1, 4), np.uint8)
        full = np.array([[[255, 255, 255, 255]]], np.uint8)
        self.mean_density = 1.0
        for file, default, srgb in (
            (None, soil, True),
            (ground.terrain_map, none, True),
            (sowing.density_map, full, False),
            (sowing.vegetation_map, none, True),
        ):
            pixels = read_rgba(scene.resolve(file)) if file else default
            texture = _texture(ctx, pixels, srgb)
            # the soil repeats; a map must not leak in from its opposite edge
            texture.repeat_x = texture.repeat_y = default is soil
            self._textures.append(texture)
            if file and file == sowing.density_map:
                self.mean_density = float(pixels[..., 0].mean() / 255.0)
        mean = ((soil[..., :3] / 255.0) ** 2.2).mean(axis=(0, 1))
        self._block = BlockBuffer(ctx, GROUND_BLOCK)
        self._block.set(
            size_m=ground.size_m,
            samples=(columns, rows),
            samples_per_m=(1.0 / heights.cell_m()[0], 1.0 / heights.cell_m()[1]),
            soil_per_m=1.0 / ground.texture_m,
            beyond=("mirror", "bare").index(ground.beyond),
            soil_mean=(*mean, 0.0),
            tiles=len(ground.tile),
        )
        self._tiles = self._tile_array(ctx, scene) if ground.tile else None

    def _tile_array(self, ctx: moderngl.Context, scene: Scene) -> moderngl.TextureArray:
        """The soils of the ground's tiles, as square roots of linear colours, and what the block says of them."""
        pictures = [read_rgba(scene.resolve(tile.texture))[..., :3] for tile in scene.ground.tile]
        rows, columns = (max(picture.shape[axis] for picture in pictures) for axis in (0, 1))
        layers = (
            np.stack([np.asarray(Image.fromarray(picture).resize((columns, rows))) for picture in pictures]) / 255.0
        )
        light = decoded(layers)
        area, mean = np.zeros((MOST_TILES, 4)), np.zeros((MOST_TILES, 4))
        for i, tile in enumerate(scene.ground.tile):
            area[i] = *tile.from_m, *tile.to_m
            mean[i] = *light[i].mean(axis=(0, 1)), 1.0 / tile.texture_m
        self._block.set(tile_area_m=area, tile_mean=mean)
        coded = np.round(255.0 * np.sqrt(light)).astype(np.uint8)
        array = ctx.texture_array((columns, rows, len(layers)), 3, coded.tobytes(), alignment=1)
        array.build_mipmaps()
        array.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
        return array

    def bind(self) -> None:
        """Bind heights, soil and maps to texture units 0 to 4 and the block."""
        for unit, texture in enumerate(self._textures):
            texture.use(unit)
        if self._tiles:
            self._tiles.use(_TILES_UNIT)
        self._block.bind()

    def release(self) -> None:
        """Free the GPU memory."""
        for texture in self._textures:
            texture.release()
        if self._tiles:
            self._tiles.release()
        self._block.release()


def _texture(ctx: moderngl.Context, pixels: np.ndarray, srgb: bool) -> moderngl.Texture:
    gl_srgb8_alpha8 = 0x8C43
    rows, columns, _ = pixels.shape
    texture = ctx.texture(
        (columns, rows),
        4,
        np.ascontiguousarray(pixels).tobytes(),
        internal_format=gl_srgb8_alpha8 if srgb else 0x8058,
    )
    texture.build_mipmaps()
    texture.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
    if not is_software(ctx):
        # llvmpipe takes seconds per thousand pixels for it
        texture.anisotropy = 8.0
    return texture
