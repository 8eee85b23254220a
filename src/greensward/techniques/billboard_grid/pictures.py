"""Textures of the billboards: grown from blades of the scene's own species, or from a user's files."""

from dataclasses import dataclass
from itertools import product

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import release_all
from greensward.gpu.device import Device
from greensward.gpu.kernels import Bindings, Draw, Mesh
from greensward.gpu.layouts import BlockBuffer
from greensward.gpu.view import VIEW_BLOCK
from greensward.ground import HeightField
from greensward.ground.ground_gpu import GroundGpu
from greensward.io.rasters import decoded, read_rgba
from greensward.scene import FlatGround, InputError, Scene
from greensward.scene.files import check_memory
from greensward.sowing import Field, Page
from greensward.sowing.blade import BLADE
from greensward.sowing.species import sward_values
from greensward.techniques.billboard_grid.settings import GridSettings
from greensward.techniques.blades.leaf import LEAF_BLOCK, LeafSettings

_FOLDER = "techniques/billboard_grid"
_MOST_ROWS = 4096
_INSTANCE = np.dtype([("number", "u4"), ("moved_m", "f4", 3), ("order", "f4")])
_VERTICES = 22
Rows = npt.NDArray[np.float32]
_MOST_NUMBERED = 1 << 18
"""Blades of a picture that ids tell apart."""
_CLOSED_SLABS = 8
"""Number of slabs that together let nothing through: the picture of the last billboard that a ray meets."""
_ABOUT_A_SLAB = np.pi / 4.0
"""Thickness of the slab of grass that a billboard stands for, in spacings. A ray in direction (x, z) meets |x| + |z|
billboards on one spacing, 4 / pi in the mean over all directions."""


@dataclass(frozen=True)
class Picture:
    """Layers of one kind of billboard on the CPU, first row at the ground; all but `blade` are times opacity."""

    colour: npt.NDArray[np.float16]
    """Linear red, green, blue, and opacity: (layers, rows, columns, 4)."""
    shape: npt.NDArray[np.uint8]
    """Normal across and upwards, rank, place along the blade: (layers, rows, columns, 4)."""
    blade: npt.NDArray[np.uint32]
    """Blade by `_numbered`, 0 for none: (layers, rows, columns)."""


class Billboards:
    """Textures of grass from the side, in layers, and from above."""

    def __init__(self, device: Device, scene: Scene, settings: GridSettings) -> None:
        side, top, self.tall_m = _grow(device, scene, settings)
        if settings.side_texture:
            side = _closed(_read(scene, settings.side_texture, "technique.side_texture"))
        if settings.top_texture:
            top = _read(scene, settings.top_texture, "technique.top_texture")
        self.layers = len(side.colour) - 1
        """Number of them from the side; one more is opaque."""
        self.opacity_from_above = float(top.colour[..., 3].mean(dtype=np.float64))
        """Part of the ground that is hidden, seen from above."""
        self._textures = [*_uploaded(device.ctx, side), *_uploaded(device.ctx, top, repeat_y=True)]
        names = (f"{kind}_{part}" for kind in ("side", "top") for part in ("colour", "shape", "blade"))
        self.bindings: Bindings = dict(zip(names, self._textures, strict=True))
        """Textures by their names in shaders."""

    @property
    def nbytes(self) -> int:
        """GPU memory in bytes, but for coarser levels."""
        texel_bytes = 8, 4, 4
        return sum(texel_bytes[i % 3] * int(np.prod(texture.size)) for i, texture in enumerate(self._textures))

    def release(self) -> None:
        """Free the GPU memory."""
        release_all(*self._textures)


def _uploaded(ctx: moderngl.Context, picture: Picture, repeat_y: bool = False) -> list[moderngl.TextureArray]:
    _, rows, columns, _ = picture.colour.shape
    result = []
    blade = _with_coarser(picture.blade)
    for values, components, dtype in ((picture.colour, 4, "f2"), (picture.shape, 4, "f1"), (blade, 1, "u4")):
        texture = ctx.texture_array(
            (columns, rows, len(values)), components, np.ascontiguousarray(values).tobytes(), alignment=1, dtype=dtype
        )
        texture.repeat_x, texture.repeat_y = True, repeat_y
        if dtype == "u4":
            texture.filter = moderngl.NEAREST, moderngl.NEAREST
        else:
            texture.build_mipmaps()
            texture.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
        result.append(texture)
    return result


def _with_coarser(blade: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint32]:
    """Numbers of blades, and in as many layers more their coarser levels below each other: the highest of four."""
    below, level, row = np.zeros_like(blade), blade, 0
    while min(level.shape[1:]) > 1:
        rows, columns = (edge // 2 for edge in level.shape[1:])
        level = level[:, : 2 * rows, : 2 * columns].reshape(len(blade), rows, 2, columns, 2).max(axis=(2, 4))
        below[:, row : row + rows, :columns] = level
        row += rows
    return np.concatenate([blade, below])


_TEXEL_BYTES = 256
"""Memory that a texel of the side view takes at most while its pictures are put together."""


def _numbered(blade: npt.NDArray[np.int64], aside: int = 0, ahead: int = 0) -> npt.NDArray[np.int64]:
    """Numbers of blades of a picture, from 1, which tell how many pictures to each side a blade has its root."""
    return 9 * (blade % _MOST_NUMBERED) + 3 * (ahead + 1) + aside + 2


def _grow(device: Device, scene: Scene, settings: GridSettings) -> tuple[Picture, Picture, float]:
    """Side, top and height of a bed of the scene's blades."""
    mean_m = mean_length_m(scene)
    slab_m = _ABOUT_A_SLAB * settings.spacing * mean_m
    edge_m = settings.billboard_m
    deep_m = max((settings.layers + _CLOSED_SLABS) * slab_m, edge_m)
    bed = _bed(scene, edge_m, deep_m)
    heights = HeightField.of(bed)
    ground = GroundGpu(device, bed, heights)
    field = Field(device, bed, ground)
    leaf, view = BlockBuffer(device.ctx, LEAF_BLOCK), BlockBuffer(device.ctx, VIEW_BLOCK)
    leaf.set(**LeafSettings(roundness=settings.roundness).block_values())
    try:
        field.sow((0.5 * edge_m, 0.0, 0.5 * deep_m), 0.0)
        sown = [(page, _rows(page)) for page in field.pages]
        tall_m = max((_tallest(rows) for _, rows in sown), default=mean_m)
        grower = _Grower(device, {**field.bindings, "Leaf": leaf, "View": view}, sown, settings, tall_m)
        return grower.side(slab_m), grower.top(), tall_m
    finally:
        release_all(leaf, view, field, ground)


def mean_length_m(scene: Scene) -> float:
    """Mean length of a blade, over the scene's species by their shares."""
    return float(sward_values(scene)["blade_m"][0]) or 0.1  # type: ignore[index]


def _bed(scene: Scene, edge_m: float, deep_m: float) -> Scene:
    """A level piece of ground that bears the scene's species in their shares, without drifts."""
    reach_m = 0.75 * (edge_m + deep_m)
    sowing = {
        "density_map": None,
        "vegetation_map": None,
        "drift": 0.0,
        "max_slope_deg": 90.0,
        "full_density_m": 2.0 * reach_m,
        "reach_m": reach_m,
        "traced_m": None,
        "stored_m": None,
    }
    return Scene(
        seed=scene.seed,
        ground=FlatGround(),
        grass=tuple(grass.model_copy(update={"patchiness": 0.0}) for grass in scene.grass),
        sowing=scene.sowing.model_copy(update=sowing),
        wind=(),
    ).in_folder(scene.resolve(""))


def _rows(page: Page) -> Rows:
    """The blades of a page that was just sown, as they lie on the GPU from its beginning: (n, 16)."""
    data = page.blades.read(page.count * BLADE.dtype.itemsize) if page.count else b""
    return np.frombuffer(data, np.float32).reshape(-1, BLADE.dtype.itemsize // 4)


def _points(rows: Rows) -> npt.NDArray[np.float32]:
    """Nine points of each blade's curve: (n, 9, 3)."""
    t = np.linspace(0.0, 1.0, 9, dtype=np.float32)[:, None]
    root, control, tip = (rows[:, None, first : first + 3] for first in (0, 4, 8))
    curve: npt.NDArray[np.float32] = (1.0 - t) ** 2 * root + 2.0 * t * (1.0 - t) * control + t * t * tip
    return curve


def _tallest(rows: Rows) -> float:
    return float(_points(rows)[..., 1].max(initial=1e-3))


class _Grower:
    """Draws blades of a bed into pictures, four samples a texel."""

    def __init__(
        self,
        device: Device,
        bindings: Bindings,
        sown: list[tuple[Page, Rows]],
        settings: GridSettings,
        tall_m: float,
    ) -> None:
        self._device, self._bindings = device, bindings
        self._sown, self._settings, self._tall_m = sown, settings, tall_m

    def side(self, slab_m: float) -> Picture:
        """A layer for each slab of the bed, seen along z, and one that is closed."""
        edge_m = self._settings.billboard_m
        columns = self._settings.texture_px
        rows = int(np.clip(np.ceil(self._tall_m / edge_m * columns), 4, _MOST_ROWS))
        texels = columns * rows * (self._settings.layers + 1)
        check_memory("technique.layers", _TEXEL_BYTES * texels, "lower layers or texture_px, or raise billboard_m")
        axes = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
        drawn = []
        layers = self._settings.layers
        for first, count in [(layer, 1) for layer in range(layers)] + [(layers, _CLOSED_SLABS)]:
            low = (0.0, 0.0, first * slab_m)
            high = (edge_m, self._tall_m, (first + count) * slab_m)
            drawn.append(self._draw((columns, rows), axes, low, high, wrapped=(0,)))
        return _stacked(drawn)

    def top(self) -> Picture:
        """A square of the bed, seen from above: x across, z upwards."""
        edge_m, columns = self._settings.billboard_m, self._settings.texture_px
        axes = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)
        low, high = (0.0, 0.0, 0.0), (edge_m, edge_m, self._tall_m)
        return _stacked([self._draw((columns, columns), axes, low, high, wrapped=(0, 2))])

    def _draw(
        self,
        size: tuple[int, int],
        axes: tuple[tuple[float, float, float], ...],
        low: tuple[float, float, float],
        high: tuple[float, float, float],
        wrapped: tuple[int, ...],
    ) -> Picture:
        ctx, finer = self._device.ctx, (2 * size[0], 2 * size[1])
        before = ctx.fbo
        targets = [
            ctx.texture(finer, 4, dtype="f2"),
            ctx.texture(finer, 4, dtype="f2"),
            ctx.texture(finer, 1, dtype="f4"),
        ]
        depth = ctx.depth_renderbuffer(finer)
        canvas = ctx.framebuffer(targets, depth)
        canvas.use()
        canvas.clear(depth=1.0)
        ctx.enable_only(moderngl.DEPTH_TEST)
        # blades lean out of the slab in which they stand
        reach = np.array(axes[2]) @ (self._tall_m * np.array([1.0, 0.0, 1.0]))
        shown = *low[:2], low[2] - reach
        shown_high = *high[:2], high[2] + reach
        stages = f"{_FOLDER}/grow.vert", f"{_FOLDER}/grow.frag"
        for page, rows in self._sown:
            instances = _standing(rows, low, high, wrapped, axes)
            if not len(instances):
                continue
            buffer = ctx.buffer(instances.tobytes())
            mesh = Mesh(((buffer, "1u4 3f4 1f4/i", "number", "moved_m", "order"),))
            draw = Draw(self._device, *stages, bindings=self._bindings, meshes=[mesh])
            draw.run(
                moderngl.TRIANGLE_STRIP,
                _VERTICES,
                len(instances),
                **page.bindings,
                across=axes[0],
                upwards=axes[1],
                outwards=axes[2],
                low_m=shown,
                high_m=shown_high,
                texel_m=self._settings.billboard_m / self._settings.texture_px,
            )
            draw.release()
            buffer.release()
        picture = _halved(targets)
        self._device.bind_again(before)  # a released framebuffer must not stay the current one
        canvas.release()
        depth.release()
        release_all(*targets)
        return picture


def _standing(
    rows: Rows,
    low: tuple[float, float, float],
    high: tuple[float, float, float],
    wrapped: tuple[int, ...],
    axes: tuple[tuple[float, float, float], ...],
) -> npt.NDArray[np.void]:
    """Blades whose roots lie within the picture, again wherever they stand across its edges."""
    root = rows[:, :3] @ np.array(axes, np.float32).T
    ground = [k for k in range(3) if axes[k][1] == 0.0]
    chosen = np.flatnonzero(np.all([(root[:, k] >= low[k]) & (root[:, k] < high[k]) for k in ground], axis=0))
    points, wide = _points(rows[chosen]), rows[chosen, 11]
    span = np.stack([points.min(axis=1) - wide[:, None], points.max(axis=1) + wide[:, None]])
    parts = []
    for x, z in product((-1, 0, 1), (-1, 0, 1) if 2 in wrapped else (0,)):
        move = np.array([x, 0.0, z]) * (high[0] - low[0])
        there = np.all(
            [(span[1, :, k] + move[k] > 0.0) & (span[0, :, k] + move[k] < high[0] - low[0]) for k in wrapped], axis=0
        )
        part = np.zeros(int(there.sum()), _INSTANCE)
        part["number"], part["moved_m"] = chosen[there], move
        part["order"] = _numbered(np.flatnonzero(there), x, z)
        parts.append(part)
    return np.concatenate(parts)


def _halved(targets: list[moderngl.Texture]) -> Picture:
    """Half of a picture's size: means of two by two texels, but the highest of their blades."""
    means = []
    for target in targets[:2]:
        target.build_mipmaps(0, 1)
        columns, rows = target.size[0] // 2, target.size[1] // 2
        means.append(np.frombuffer(target.read(level=1, alignment=1), np.float16).reshape(rows, columns, 4))
    columns, rows = targets[2].size
    blades = np.frombuffer(targets[2].read(alignment=1), np.float32).reshape(rows // 2, 2, columns // 2, 2)
    blades = blades.max(axis=(1, 3))
    return Picture(
        means[0],
        np.round(255.0 * np.clip(means[1].astype(np.float32), 0.0, 1.0)).astype(np.uint8),
        blades.astype(np.uint32),
    )


def _stacked(pictures: list[Picture]) -> Picture:
    return Picture(*(np.stack([getattr(each, name) for each in pictures]) for name in ("colour", "shape", "blade")))


def _read(scene: Scene, file: str, key: str) -> Picture:
    """A user's picture: upright blades that look towards the viewer. Raises `InputError` without transparency."""
    path = scene.resolve(file)
    pixels = read_rgba(path)[::-1] / 255.0
    alpha = pixels[..., 3:]
    if alpha.min() == 1.0 or alpha.max() == 0.0:
        every = "opaque" if alpha.min() == 1.0 else "transparent"
        raise InputError(f"{path}: {key}: must have an alpha channel that cuts blades out (all of it is {every})")
    colour = np.concatenate([decoded(pixels[..., :3]) * alpha, alpha], -1).astype(np.float16)
    v = ((np.arange(len(pixels)) + 0.5) / len(pixels))[:, None, None]
    shape = np.concatenate([0.5 * alpha, 0.5 * alpha, 0.5 * alpha, v * alpha], -1)
    columns = _numbered(np.arange(pixels.shape[1])[None, :] * 128 // pixels.shape[1])
    blade = np.where(alpha[..., 0] > 0.0, columns, 0)
    return Picture(colour[None], np.round(255.0 * shape).astype(np.uint8)[None], blade.astype(np.uint32)[None])


def _closed(side: Picture) -> Picture:
    """A user's picture, and once more with shifted copies behind it."""
    columns = side.colour.shape[2]
    layers = []
    for values in (side.colour, side.shape):
        behind = values[0].astype(np.float32)
        alpha = side.colour[0, ..., 3:].astype(np.float32)
        for k in range(1, _CLOSED_SLABS):
            shift = columns * (2 * k - 1) // (2 * _CLOSED_SLABS)
            behind = behind + (1.0 - alpha) * np.roll(values[0], shift, axis=1)
            alpha = alpha + (1.0 - alpha) * np.roll(side.colour[0, ..., 3:], shift, axis=1)
        layers.append(np.stack([values[0], behind.astype(values.dtype)]))
    return Picture(layers[0], layers[1], np.concatenate([side.blade, side.blade]))
