"""Grass in moderngl-window, for two players side by side: python examples/hosts/in_moderngl_window.py"""

import moderngl_window
from shared import Cube, add_run, meadow, orbit, save

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
        self.grass = gs.Renderer(meadow(), size=self.wnd.buffer_size, ctx=self.ctx)

    def on_render(self, time, _):
        screen, (width, height) = self.wnd.fbo, self.wnd.buffer_size
        screen.use()
        self.ctx.clear(depth=1.0)
        eyes = []
        for player in range(2):
            view, projection = orbit(time, width // 2 / height, start=0.6 + 2.0 * player)
            self.ctx.viewport = half = (player * (width // 2), 0, width // 2, height)
            self.cube.draw(view, projection, time)
            eyes.append(gs.Eye(screen, view_from_world=view, clip_from_view=projection, viewport=half))
        self.grass.draw_eyes(eyes, time)  # grass moves once for both
        if self.wnd.frames + 1 == self.argv.frames:
            if self.argv.out:
                save(screen, (width, height), self.argv.out)
            self.wnd.close()


if __name__ == "__main__":
    moderngl_window.run_window_config(Meadow)
