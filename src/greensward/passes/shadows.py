"""Cascaded shadow maps of the sun: nested squares around the view, drawn by the same calls as the picture."""

import math

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import release_all
from greensward.gpu.device import Device
from greensward.gpu.kernels import Bindings
from greensward.gpu.view import View, anchored, look_at, parallel
from greensward.passes.light import to_sun
from greensward.scene import Scene
from greensward.scene.field import MOST_CASCADES
from greensward.world import World

_BIAS = np.array([[0.5, 0, 0, 0.5], [0, 0.5, 0, 0.5], [0, 0, 0.5, 0.5], [0, 0, 0, 1.0]])


class ShadowMaps:
    """Depth from the sun in up to four cascades; none while the sun is down."""

    def __init__(self, device: Device, world: World) -> None:
        self._world = world
        self._settings, self.count = world.scene.shadows, _cascades(world.scene)
        self.relight()
        settings = self._settings
        self._maps: list[moderngl.Texture] = []
        self.framebuffers: list[moderngl.Framebuffer] = []
        for _ in range(max(self.count, 1)):
            size = settings.size_px if self.count else 1
            texture = device.ctx.depth_texture((size, size))
            texture.compare_func = "<="
            texture.filter = moderngl.LINEAR, moderngl.LINEAR
            texture.repeat_x = texture.repeat_y = False
            self._maps.append(texture)
            self.framebuffers.append(device.ctx.framebuffer([], texture))
        self.bindings: Bindings = {
            f"shadow_map{i}": self._maps[min(i, len(self._maps) - 1)] for i in range(MOST_CASCADES)
        }
        """Maps by their names in shaders; unused ones repeat the last."""

    def suits(self, scene: Scene) -> bool:
        """Return whether these maps are good for another scene's sun."""
        return scene.shadows == self._settings and _cascades(scene) == self.count

    def relight(self) -> None:
        """Take the direction of the world's sun from now on."""
        self._to_sun = to_sun(self._world.scene)
        self._rotation = look_at(self._to_sun, np.zeros(3))
        self._rotation[:3, 3] = 0.0

    def views(self, camera: View) -> tuple[View, ...]:
        """One parallel view per cascade, in whole texels so that still shadows stay still."""
        scene = self._world.scene
        nearest = scene.shadows.nearest_m
        furthest = max(scene.shadows.furthest_m, nearest)
        ratio = (furthest / nearest) ** (1.0 / max(self.count - 1, 1))
        # each map draws the grass of those inside it again; half as many blades, wider, shade alike there
        return tuple(
            self._view(scene, camera, nearest * ratio**i, scene.shadows.density * 0.5**i) for i in range(self.count)
        )

    def _view(self, scene: Scene, camera: View, radius_m: float, density: float) -> View:
        size, sun, rotation = scene.shadows.size_px, self._to_sun, self._rotation
        ahead = camera.axis_ws[:3] * np.array([1.0, 0.0, 1.0])
        centre = camera.camera_ws + ahead * radius_m * 0.8
        centre[1] = self._world.ground.heights.height(centre[0], centre[2])
        texel = 2.0 * radius_m / size
        in_light = rotation[:3, :3] @ centre
        in_light[:2] = np.round(in_light[:2] / texel) * texel
        # hills far outside the square may still shade it when the sun is low
        relief = self._world.ground.heights.highest_m - self._world.ground.heights.lowest_m
        depth = 2.0 * radius_m + (relief + 30.0) / max(math.sin(math.radians(scene.sun.elevation_deg)), 0.05)
        shift = np.eye(4)
        shift[:3, 3] = -in_light
        clip_from_view = parallel(radius_m, -depth, depth)
        return View(
            purpose="shadow",
            clip_from_world=clip_from_view @ shift @ rotation,
            eye_ws=np.array([*sun, 0.0]),
            axis_ws=np.array([*(-sun), 0.0]),
            camera_ws=camera.camera_ws,
            size_px=(size, size),
            pixel_m=(0.0, texel),
            camera_pixel_m=camera.camera_pixel_m,
            # blades smaller than a texel are left to the shading of the sward
            density=density if texel < 0.4 * self._world.field.canopy_m else 0.0,
        )

    def release(self) -> None:
        """Free the GPU memory."""
        release_all(*self.framebuffers, *self._maps)


def _cascades(scene: Scene) -> int:
    shines = scene.sun.elevation_deg > 0 and scene.sky.overcast < 1.0
    return scene.shadows.cascades if scene.shadows.enabled and shines else 0


def shadow_from_world(view: View) -> npt.NDArray[np.float64]:
    """Matrix from the world, counted from the anchor, to texture coordinates and depth, all in 0..1."""
    world_from_anchor = anchored(np.eye(4), -view.anchor_ws)
    result: npt.NDArray[np.float64] = _BIAS @ view.clip_from_world @ world_from_anchor
    return result
