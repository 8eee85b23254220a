"""Force layers of the scene on the grass of the ground: a uniform block, and one array of maps."""

import math
from collections.abc import Sequence

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.device import Device
from greensward.gpu.kernels import Bindings
from greensward.gpu.layouts import BlockBuffer, block, rows_of, text
from greensward.motion.force_layers import ForceLayer, layer_of
from greensward.scene import Scene
from greensward.scene.force import MOST_FORCES

ROWS = 3
FORCES_BLOCK = block("Forces", ("rows", "vec4", MOST_FORCES * ROWS), ("count", "int"))
_STRUCT, _VALUE = rows_of(
    "ForceLayer",
    (
        ("centre_m", "vec2"),
        ("turn", "vec2"),
        ("half_size_m", "vec2"),
        ("texels", "vec2"),
        ("start_s", "float"),
        ("fades_s", "float"),
        ("always", "float"),
    ),
)
text(
    "ForceLayers",
    f"{_STRUCT}\n"
    "ForceLayer forceLayer(int i) {\n"
    f"    vec4 rows[{ROWS}] = vec4[{ROWS}]({', '.join(f'forces.rows[{ROWS} * i + {row}]' for row in range(ROWS))});\n"
    f"    return {_VALUE};\n"
    "}",
)


def force_values(layers: Sequence[ForceLayer], anchor_m: npt.ArrayLike = (0.0, 0.0)) -> dict[str, object]:
    """Members of the `Forces` block; places are counted from the anchor, x and z."""
    rows = np.zeros((MOST_FORCES, ROWS * 4), np.float32)
    for row, layer in zip(rows, layers, strict=False):
        yaw = math.radians(layer.yaw_deg)
        height, width = layer.texels.shape[:2]
        row[:] = (
            *(*np.subtract(layer.centre_m, anchor_m), math.cos(yaw), math.sin(yaw)),
            *(0.5 * layer.size_m[0], 0.5 * layer.size_m[1], width, height),
            *(layer.start_s, layer.fades_s or 0.0, layer.always, 0.0),
        )
    return {"rows": rows.reshape(-1, 4), "count": len(layers)}


def force_pictures(layers: Sequence[ForceLayer]) -> npt.NDArray[np.float16]:
    """Maps of all layers, (layers, height, width, 4), each in the corner of the largest."""
    height, width = (max(layer.texels.shape[axis] for layer in layers) for axis in (0, 1))
    pictures = np.zeros((len(layers), height, width, 4), np.float16)
    for picture, layer in zip(pictures, layers, strict=True):
        picture[: layer.texels.shape[0], : layer.texels.shape[1]] = layer.texels
    return pictures


def absent_forces(scene: Scene) -> dict[str, int]:
    """Defines of shaders of `motion/force_map.glsl`, so that they leave it out where there are no forces."""
    return {} if scene.force else {"NO_FORCES": 1}


class Forces:
    """Forces of the scene, for shaders that include `motion/force_map.glsl`; nothing where it has none."""

    def __init__(self, device: Device, scene: Scene) -> None:
        layers = self._layers = [layer_of(force, scene.resolve) for force in scene.force]
        self.bindings: Bindings = {}
        """Block and maps, by their names in shaders."""
        if layers:
            self._block = forces = BlockBuffer(device.ctx, FORCES_BLOCK)
            self.count_from(np.zeros(3))
            pictures = force_pictures(layers)
            count, height, width, _ = pictures.shape
            maps = device.ctx.texture_array((width, height, count), 4, pictures.tobytes(), dtype="f2")
            maps.filter = moderngl.LINEAR, moderngl.LINEAR
            maps.repeat_x = maps.repeat_y = False
            self.bindings = {"Forces": forces, "force_maps": maps}

    def count_from(self, anchor_ws: npt.NDArray[np.float64]) -> None:
        """Count points of the world from an anchor, (3,)."""
        if self._layers:
            self._block.set(**force_values(self._layers, anchor_ws[[0, 2]]))  # type: ignore[arg-type]

    def release(self) -> None:
        """Free the GPU memory."""
        for part in self.bindings.values():
            part.release()  # type: ignore[union-attr]
