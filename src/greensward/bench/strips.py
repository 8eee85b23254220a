"""The baseline: instanced strips pulled from a buffer, as someone who knows moderngl writes them first."""

from types import TracebackType
from typing import Self

import moderngl
import numpy as np

from greensward.gpu.context import driver_name, open_context
from greensward.gpu.pixel_pass import best_shell
from greensward.gpu.program import build, put
from greensward.gpu.timers import PassTimers
from greensward.ground import HeightField
from greensward.renderer import Counts
from greensward.scene import Camera, Scene, SceneError
from greensward.viewpoint import camera_view
from greensward.world import World

_SKY = (0.55, 0.70, 0.90)
VERTICES = 7
"""Of a blade."""


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
        self.ctx = open_context(device)
        try:
            self.driver = driver_name(self.ctx)
            self.timers = PassTimers(self.ctx)
            self._heights = HeightField.of(scene)
            self._world = World(self.ctx, scene, self._heights, best_shell(self.ctx))
            self._array = self.ctx.vertex_array(build(self.ctx, "bench/strips.vert", "bench/strips.frag"), [])
        except BaseException:
            self.ctx.release()
            raise

    @property
    def blades(self) -> int:
        """Blades sown around the last camera."""
        return self._world.field.count

    @property
    def counts(self) -> Counts:
        """Of the last picture, whose alpha tells blades from sky. Waits for the GPU."""
        pixels = 0
        if self._last:
            picture = np.frombuffer(self._last.read(components=4), np.uint8)
            pixels = int(np.count_nonzero(picture[3::4]))
        return Counts(self.blades, 0, self.blades, pixels)

    def draw(self, framebuffer: moderngl.Framebuffer, time_s: float = 0.0, *, camera: Camera | None = None) -> None:
        """Draw every blade into a framebuffer that it clears."""
        view = camera_view(camera or self.scene.camera, self._heights, framebuffer.size)
        self._world.follow(view.camera_ws)
        self._last = framebuffer
        self.timers.start_frame()
        with self.timers.measure("grass"):
            framebuffer.use()
            framebuffer.clear(*_SKY, 0.0)
            self.ctx.enable_only(moderngl.DEPTH_TEST)
            matrix = np.ascontiguousarray(view.clip_from_world.T, np.float32)
            put(self._array.program, clipFromWorld=tuple(matrix.ravel().tolist()), timeNow=time_s)
            for page in self._world.field.pages:
                if page.thing is None and page.count:
                    page.bind()
                    self._array.render(moderngl.TRIANGLE_STRIP, vertices=VERTICES, instances=page.count)

    def release(self) -> None:
        """Free every GPU resource."""
        self._world.release()
        self._array.program.release()
        self._array.release()
        self.ctx.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()
