"""Heights and maps of the ground on the GPU."""

import moderngl
import numpy as np
import numpy.typing as npt
from PIL import Image

from greensward.gpu.device import Device
from greensward.gpu.kernels import Bindings
from greensward.gpu.layouts import BlockBuffer, block
from greensward.ground.height_field import HeightField
from greensward.ground.soil import generated_soil
from greensward.io.masks import read_mask
from greensward.io.rasters import decoded, read_colours
from greensward.scene import InputError, Scene
from greensward.scene.ground import MOST_TILES

GROUND_BLOCK = block(
    "Ground",
    ("size_m", "vec2"),
    ("samples", "vec2"),
    ("samples_per_m", "vec2"),
    ("soil_per_m", "float"),
    ("beyond", "int"),
    ("soil_mean", "vec4"),
    ("soil_drift", "float"),  # strength of the variation of a generated soil
    ("tile_area_m", "vec4", MOST_TILES),  # x and z, least and greatest
    ("tile_mean", "vec4", MOST_TILES),  # mean colour; copies of the texture on a metre
    ("tiles", "int"),
    ("anchor_m", "vec2"),  # in the world, x and z
    ("folded_anchor_m", "vec2"),  # without whole copies of the ground
    ("soil_anchor", "vec2"),  # without whole copies of the soil, in copies
    ("hexagon", "ivec2"),  # of the soil, in which the anchor lies
    ("in_hexagon", "vec2"),
)
SOIL_HEXAGONS = np.array([[1.0, -0.57735027], [0.0, 1.15470054]]) * 1.7
"""Matrix from copies of the soil's texture to the lattice of `hexagonsAt` in ground/soil.glsl."""


_LIGHT = decoded(np.arange(256) / 255.0)
"""Linear light of each 8-bit sRGB value."""
_SOIL_DRIFT = 0.25


class GroundGpu:
    """Textures of the ground and its maps. A map that the scene lacks is one neutral texel."""

    def __init__(self, device: Device, scene: Scene, heights: HeightField) -> None:
        limit = device.limits.texture_px
        rows, columns = heights.heights.shape
        if max(rows, columns) > limit:
            raise InputError(
                f"ground: a height map of {columns} × {rows} is beyond this driver's {limit} texels a side; "
                "scale it down"
            )
        self.heights = heights
        heights_texture = device.ctx.texture((columns, rows), 1, heights.heights.tobytes(), dtype="f4")
        heights_texture.filter = moderngl.NEAREST, moderngl.NEAREST
        self.bindings: Bindings = {"ground_heights": heights_texture}
        """Heights, maps and block, by their names in shaders."""
        ground, sowing = scene.ground, scene.sowing
        soil = read_colours(scene.resolve(ground.texture)) if ground.texture else generated_soil(scene.seed)
        none = np.zeros((1, 1, 4), np.uint8)
        full = np.array([[[255, 255, 255, 255]]], np.uint8)
        self.mean_density = 1.0
        for name, file, default, srgb in (
            ("soil", None, soil, True),
            ("terrain_map", ground.terrain_map, none, True),
            ("density_map", sowing.density_map, full, False),
            ("vegetation_map", sowing.vegetation_map, none, True),
        ):
            read = read_colours if srgb else read_mask
            pixels = read(scene.resolve(file)) if file else default
            texture = _texture(device, pixels, srgb)
            # the soil repeats; a map must not leak in from its opposite edge, unless it lies beside itself there
            texture.repeat_x = texture.repeat_y = default is soil or ground.beyond == "repeat"
            self.bindings[name] = texture
            if file and name == "density_map":
                self.mean_density = float(pixels[..., 0].mean() / 255.0)
        self._soil_per_m = 1.0 / ground.texture_m
        counts = [np.bincount(soil[..., channel].ravel(), minlength=256) for channel in range(3)]
        mean = np.array(counts) @ _LIGHT / soil[..., 0].size
        self._block = BlockBuffer(device.ctx, GROUND_BLOCK)
        self._block.set(
            size_m=heights.size_m,
            samples=(columns, rows),
            samples_per_m=(1.0 / heights.cell_m()[0], 1.0 / heights.cell_m()[1]),
            soil_per_m=self._soil_per_m,
            beyond=("mirror", "bare", "repeat").index(ground.beyond),
            soil_mean=(*mean, 0.0),
            soil_drift=0.0 if ground.texture else _SOIL_DRIFT,
            tiles=len(ground.tile),
        )
        self.bindings["Ground"] = self._block
        if ground.tile:
            self.bindings["tile_soils"] = self._tile_array(device.ctx, scene)

    def count_from(self, anchor_ws: npt.NDArray[np.float64]) -> None:
        """Count points of the world from an anchor (3,) from now on."""
        at = anchor_ws[[0, 2]]
        copies = at * self._soil_per_m
        hexagon = SOIL_HEXAGONS @ copies
        self._block.set(
            anchor_m=at,
            folded_anchor_m=np.fmod(at, self.heights.period_m),
            soil_anchor=copies - np.floor(copies),
            hexagon=np.floor(hexagon).astype(np.int32),
            in_hexagon=hexagon - np.floor(hexagon),
        )

    def _tile_array(self, ctx: moderngl.Context, scene: Scene) -> moderngl.TextureArray:
        """Soils of the ground's tiles, as square roots of linear colours, and what the block says of them."""
        pictures = [read_colours(scene.resolve(tile.texture))[..., :3] for tile in scene.ground.tile]
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

    def release(self) -> None:
        """Free the GPU memory."""
        for resource in self.bindings.values():
            resource.release()  # type: ignore[union-attr]


def _texture(device: Device, pixels: np.ndarray, srgb: bool) -> moderngl.Texture:
    gl_srgb8_alpha8 = 0x8C43
    rows, columns, _ = pixels.shape
    texture = device.ctx.texture(
        (columns, rows),
        4,
        np.ascontiguousarray(pixels).tobytes(),
        internal_format=gl_srgb8_alpha8 if srgb else 0x8058,
    )
    texture.build_mipmaps()
    texture.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
    if not device.software:
        # llvmpipe takes seconds per thousand pixels for it
        texture.anisotropy = 8.0
    return texture
