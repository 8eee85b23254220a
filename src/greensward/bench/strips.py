"""The baseline: instanced triangle strips that pull their blades from a buffer."""

from types import TracebackType
from typing import Self

import moderngl
import numpy as np

from greensward.gpu.device import Device
from greensward.gpu.kernels import Draw
from greensward.gpu.timers import PassTimers
from greensward.gpu.view import View
from greensward.ground import HeightField
from greensward.renderer import Counts
from greensward.scene import Camera, Scene, SceneError
from greensward.viewpoint import camera_view
from greensward.world import World

_SKY = (0.55, 0.70, 0.90)
VERTICES = 7
"""Vertices of a blade."""


class InstancedStrips:
    """The blades of a scene's ground, every one of them drawn in every frame: no culling, no light, no shadows.

    Measured through the same few names that `Renderer` has.
    """

    technique_name = "instanced-strips"
    culls = False

    def __init__(self, scene: Scene, *, size: tuple[int, int], device: str = "auto") -> None:
        if scene.sowing.stored_m is not None:
            raise SceneError(["scene: sowing.stored_m: instanced-strips draws stored blades; leave stored_m out"])
        self.scene, self.size = scene, size
        self._last: moderngl.Framebuffer | None = None
        self.device = Device.shared(device)
        self.ctx, self.driver = self.device.ctx, self.device.name
        self.timers = PassTimers(self.device)
        self._heights = HeightField.of(scene)
        with self.device.use():
            self._world = World(self.device, scene, self._heights, self.device.best_stage, {})
            self._draw = Draw(self.device, "bench/strips.vert", "bench/strips.frag")

    @property
    def blades(self) -> int:
        """Blades sown around the last camera."""
        return self._world.field.count

    @property
    def counts(self) -> Counts:
        """Counts of the last picture, whose alpha separates blades from sky. Waits for the GPU."""
        pixels = 0
        if self._last:
            picture = np.frombuffer(self._last.read(components=4), np.uint8)
            pixels = int(np.count_nonzero(picture[3::4]))
        return Counts(self.blades, 0, self.blades, pixels)

    def draw(self, framebuffer: moderngl.Framebuffer, time_s: float = 0.0, *, camera: Camera | None = None) -> None:
        """Draw every blade into a framebuffer that it clears."""
        view = camera_view(camera or self.scene.camera, self._heights, framebuffer.size)
        with self.device.use(framebuffer):
            self._draw_view(framebuffer, view, time_s)

    def _draw_view(self, framebuffer: moderngl.Framebuffer, view: View, time_s: float) -> None:
        if not self._world.field.pages:  # sown once, and so without gaps between blades
            self._world.follow(view.camera_ws)
        self._last = framebuffer
        self.timers.start_frame()
        with self.timers.measure("grass"):
            framebuffer.use()
            framebuffer.clear(*_SKY, 0.0)
            self.ctx.enable_only(moderngl.DEPTH_TEST)
            for page in self._world.field.pages:
                if page.object_index is None and page.count:
                    self._draw.run(
                        moderngl.TRIANGLE_STRIP,
                        VERTICES,
                        page.count,
                        Blades=page.blades,
                        clip_from_world=view.clip_from_world,
                        time_s=time_s,
                    )

    def release(self) -> None:
        """Free every GPU resource."""
        with self.device.use():
            self._world.release()
            self._draw.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()
