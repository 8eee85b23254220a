"""Grass in moderngl-window, for two players side by side: python examples/hosts/in_moderngl_window.py"""

import moderngl_window
import numpy as np
from moderngl_window.scene.camera import OrbitCamera
from shared import Cube, add_run, meadow, save

import greensward as gs


class Meadow(moderngl_window.WindowConfig):
    """A window that is split: each half has a camera of its own."""

    title = "greensward in moderngl-window"
    gl_version = (4, 3)  # 3.3 is the default
    aspect_ratio = None  # fill the window
    window_size = (960, 540)

    @classmethod
    def add_arguments(cls, parser):
        add_run(parser)  # beside --size, --samples and --window, which are moderngl-window's

    def __init__(self, **host):
        super().__init__(**host)
        self.cube = Cube(self.ctx)
        self.grass = gs.Renderer(meadow(), ctx=self.ctx)
        self.cameras = [
            OrbitCamera(
                target=(0.0, 0.7, 0.0),
                radius=4.5,
                angles=(angle, -81.0),
                fov=44.0,
                near=0.1,
                far=500.0,
                aspect_ratio=1.0,
            )
            for angle in (235.0, 120.0)
        ]

    def on_render(self, time, _):
        screen, (width, height) = self.wnd.fbo, self.wnd.buffer_size
        screen.use()
        self.ctx.clear(depth=1.0)
        eyes = []
        for player, camera in enumerate(self.cameras):
            camera.projection.update(aspect_ratio=width // 2 / height)
            view, projection = np.array(camera.matrix), np.array(camera.projection.matrix)
            self.ctx.viewport = half = (player * (width // 2), 0, width // 2, height)
            self.cube.draw(view, projection, time)
            eyes.append(gs.Eye(screen, view_from_world=view, clip_from_view=projection, viewport=half))
        self.grass.draw_eyes(eyes, time)  # grass moves once for both
        if self.wnd.frames + 1 == self.argv.frames:
            if self.argv.out:
                save(screen, (width, height), self.argv.out)
            self.wnd.close()

    def on_mouse_drag_event(self, x, _, dx, dy):
        self.cameras[x >= self.wnd.width / 2].rot_state(dx, dy)


if __name__ == "__main__":
    moderngl_window.run_window_config(Meadow)
