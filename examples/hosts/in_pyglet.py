"""Grass in a window of pyglet, seen through pyglet's matrices: python examples/hosts/in_pyglet.py"""

import moderngl
import numpy as np
import pyglet
from pyglet.math import Mat4, Vec3
from shared import Cube, meadow, options, save

import greensward as gs


class Meadow(pyglet.window.Window):
    def __init__(self, chosen):
        config = pyglet.gl.Config(major_version=4, minor_version=3, depth_size=24, double_buffer=True)
        super().__init__(*chosen.size, "greensward in pyglet", resizable=True, config=config)
        self.chosen, self.time_s, self.frame = chosen, 0.0, 0
        self.ctx = moderngl.create_context(require=430)
        self.cube = Cube(self.ctx)
        self.grass = gs.Renderer(meadow(), size=self.get_framebuffer_size(), ctx=self.ctx)

    def on_draw(self):
        size = self.get_framebuffer_size()
        self.view = Mat4.look_at(Vec3(2.5, 1.4, 3.7), Vec3(0.0, 0.7, 0.0), Vec3(0.0, 1.0, 0.0))
        self.projection = Mat4.perspective_projection(size[0] / size[1], 0.1, 500.0, fov=44)
        # sixteen numbers, column by column
        view_from_world, clip_from_view = (np.reshape(each, (4, 4)).T for each in (self.view, self.projection))

        self.clear()
        screen = self.ctx.detect_framebuffer()
        screen.use()
        self.ctx.viewport = (0, 0, *size)
        self.cube.draw(view_from_world, clip_from_view, self.time_s)
        self.grass.draw(screen, self.time_s, view_from_world=view_from_world, clip_from_view=clip_from_view)
        self.frame += 1
        if self.frame == self.chosen.frames:
            if self.chosen.out:
                save(screen, size, self.chosen.out)
            pyglet.app.exit()

    def update(self, seconds):
        self.time_s += seconds


if __name__ == "__main__":
    window = Meadow(options(__doc__))
    pyglet.clock.schedule(window.update)
    pyglet.app.run()
