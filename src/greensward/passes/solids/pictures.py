"""Pictures of the materials of a mesh as layers of one texture, and what its corners say of them."""

import moderngl
import numpy as np
import numpy.typing as npt
from PIL import Image

from greensward.io.meshes import TriMesh
from greensward.io.rasters import decoded, spread

_MOST_PX, _MOST_TEXELS = 2048, 1 << 26
_WRAPS = {"repeat": 0.0, "mirror": 1.0, "clamp": 2.0}
_ROOTS = np.round(255.0 * np.sqrt(decoded(np.arange(256) / 255.0))).astype(np.uint8)
"""Square root of the linear light of each sRGB value."""
Singles = npt.NDArray[np.float32]
Pixels = npt.NDArray[np.uint8]


def surfaces(mesh: TriMesh) -> tuple[Singles, Singles]:
    """Colours and pictures of each corner, (n, 4) both, as the file says.

    Linear colour and 1, or 0 where it says none; and layer of the picture or -1, alpha below which it is cut out, and
    continuation along u and v.
    """
    count = len(mesh.positions)
    tint, surface = np.zeros((count, 4), np.float32), np.tile(np.array([-1, 0, 0, 0], np.float32), (count, 1))
    if mesh.material is not None and mesh.materials:
        numbers = np.maximum(mesh.material, 0)
        layers = np.cumsum([each.picture is not None for each in mesh.materials]) - 1
        rows = np.array(
            [
                (layer if each.picture is not None else -1, each.cutoff, *map(_WRAPS.__getitem__, each.wrap))
                for layer, each in zip(layers, mesh.materials, strict=True)
            ],
            np.float32,
        )
        painted = mesh.material >= 0
        surface[painted] = rows[numbers][painted]
        colours = np.array([each.colour for each in mesh.materials], np.float32)[numbers]
        tint[painted, :3], tint[painted, 3] = colours[painted, :3], 1.0
        # the shader compares the alpha of the picture alone
        surface[painted, 1] /= np.maximum(colours[painted, 3], 1e-6)
    if mesh.colours is not None:
        said = tint[:, 3] > 0.0
        tint[:, :3] = np.where(said[:, None], tint[:, :3], 1.0) * mesh.colours[:, :3]
        tint[:, 3] = 1.0
    return tint, surface


def picture_array(ctx: moderngl.Context, mesh: TriMesh) -> moderngl.TextureArray | None:
    """The pictures of its materials, square roots of linear colours and alpha; None where it has none."""
    columns, rows, count = _shape(mesh)
    if not count:
        return None
    layers = np.stack([_coded(each.picture, columns, rows) for each in mesh.materials if each.picture is not None])
    texture = ctx.texture_array((columns, rows, count), 4, np.ascontiguousarray(layers[:, ::-1]).tobytes())
    texture.build_mipmaps()
    texture.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
    return texture


def picture_bytes(mesh: TriMesh) -> int:
    """Bytes of the texture that `picture_array` makes; its levels add a third."""
    columns, rows, count = _shape(mesh)
    return columns * rows * count * 16 // 3


def _shape(mesh: TriMesh) -> tuple[int, int, int]:
    """Columns and rows that all pictures of its materials get, and their number."""
    pictures = [each.picture for each in mesh.materials if each.picture is not None]
    if not pictures or mesh.uv is None:
        return 0, 0, 0
    columns, rows = (min(max(picture.shape[axis] for picture in pictures), _MOST_PX) for axis in (1, 0))
    while columns * rows * len(pictures) > _MOST_TEXELS:
        columns, rows = max(columns // 2, 1), max(rows // 2, 1)
    return columns, rows, len(pictures)


def _coded(picture: Pixels, columns: int, rows: int) -> Pixels:
    shown = spread(picture)
    if shown.shape[:2] != (rows, columns):
        # channel by channel, or Pillow would weigh colours by alpha
        parts = [Image.fromarray(np.ascontiguousarray(part)) for part in np.moveaxis(shown, -1, 0)]
        shown = np.dstack([np.asarray(part.resize((columns, rows), Image.Resampling.BILINEAR)) for part in parts])
    return np.dstack([_ROOTS[shown[..., :3]], shown[..., 3]])
