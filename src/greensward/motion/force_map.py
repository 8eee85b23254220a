"""The scene's forces on the grass of the ground: a uniform block, and one array of pictures."""

import math
from collections.abc import Sequence

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.blocks import BlockBuffer, declare
from greensward.motion.presses import Layer, layer_of
from greensward.scene import Scene

MOST_FORCES = 8
ROWS = 3
UNIT = 16
FORCES_BLOCK = declare("Forces", 9, ("rows", "vec4", MOST_FORCES * ROWS), ("count", "int"))


def force_values(layers: Sequence[Layer]) -> dict[str, object]:
    """Members of the `Forces` block."""
    rows = np.zeros((MOST_FORCES, ROWS * 4), np.float32)
    for row, layer in zip(rows, layers, strict=False):
        yaw = math.radians(layer.yaw_deg)
        height, width = layer.texels.shape[:2]
        row[:] = (
            *(*layer.centre_m, math.cos(yaw), math.sin(yaw)),
            *(0.5 * layer.size_m[0], 0.5 * layer.size_m[1], width, height),
            *(layer.start_s, layer.fades_s or 0.0, layer.always, 0.0),
        )
    return {"rows": rows.reshape(-1, 4), "count": len(layers)}


def force_pictures(layers: Sequence[Layer]) -> npt.NDArray[np.float16]:
    """The pictures of all layers, (layers, height, width, 4), each in the corner of the largest."""
    height, width = (max(layer.texels.shape[axis] for layer in layers) for axis in (0, 1))
    pictures = np.zeros((len(layers), height, width, 4), np.float16)
    for picture, layer in zip(pictures, layers, strict=True):
        picture[: layer.texels.shape[0], : layer.texels.shape[1]] = layer.texels
    return pictures


def absent_forces(scene: Scene) -> dict[str, int]:
    """What to define for shaders of `motion/force_map.glsl`, so that they leave it out where there are no forces."""
    return {} if scene.force else {"NO_FORCES": 1}


class Forces:
    """The scene's forces, bound for shaders that include `motion/force_map.glsl`; nothing where it has none."""

    def __init__(self, ctx: moderngl.Context, scene: Scene) -> None:
        layers = [layer_of(force, scene.resolve) for force in scene.force]
        self._block = self._pictures = None
        if layers:
            self._block = BlockBuffer(ctx, FORCES_BLOCK)
            self._block.set(**force_values(layers))  # type: ignore[arg-type]
            pictures = force_pictures(layers)
            count, height, width, _ = pictures.shape
            self._pictures = ctx.texture_array((width, height, count), 4, pictures.tobytes(), dtype="f2")
            self._pictures.filter = moderngl.LINEAR, moderngl.LINEAR
            self._pictures.repeat_x = self._pictures.repeat_y = False

    def bind(self) -> None:
        """Bind the block and the pictures."""
        if self._block and self._pictures:
            self._block.bind()
            self._pictures.use(UNIT)

    def release(self) -> None:
        """Free the GPU memory."""
        for part in (self._block, self._pictures):
            if part:
                part.release()
