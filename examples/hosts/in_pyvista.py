"""Grass in a window of PyVista, which draws with VTK: python examples/hosts/in_pyvista.py"""

import time

import moderngl
import numpy as np
import pyvista as pv
from shared import BRICK, meadow, options

import greensward as gs


def matrix(vtk_matrix):
    return np.reshape(vtk_matrix.GetData(), (4, 4))


class Grass:
    """Draws grass into a renderer of VTK, after all that the renderer draws."""

    def __init__(self, renderer, scene):
        self.renderer, self.scene, self.grass, self.time_s = renderer, scene, None, 0.0
        # VTK fits the clipping range to its own things; the meadow is longer
        renderer.AddObserver("StartEvent", lambda *_: renderer.camera.SetClippingRange(0.1, 500.0))
        renderer.AddObserver("EndEvent", self.draw)

    def draw(self, *_):
        if self.grass is None:  # the first time that VTK's context is current
            self.ctx = moderngl.create_context(require=430)
            self.grass = gs.Renderer(self.scene, ctx=self.ctx)
        target = self.ctx.detect_framebuffer()  # VTK's own, with the viewport of this renderer
        # moderngl has chosen another texture unit for that, and VTK remembers which one it chose itself
        self.renderer.GetRenderWindow().GetState().ResetGLActiveTexture()
        camera, aspect = self.renderer.camera, self.renderer.GetTiledAspectRatio()
        view_from_world = matrix(camera.GetViewTransformMatrix())
        clip_from_view = matrix(camera.GetProjectionTransformMatrix(aspect, -1.0, 1.0))
        self.grass.draw(target, self.time_s, view_from_world=view_from_world, clip_from_view=clip_from_view)


def main():
    chosen = options(__doc__)
    plotter = pv.Plotter(window_size=chosen.size, title="greensward in PyVista")
    ball = plotter.add_mesh(pv.Sphere(radius=0.5, center=(0.0, 0.0, 0.0)), color=BRICK, smooth_shading=True)
    plotter.camera_position = [(2.5, 1.4, 3.7), (0.0, 0.7, 0.0), (0.0, 1.0, 0.0)]  # y is up
    plotter.camera.view_angle = 44.0
    grass = Grass(plotter.renderer, meadow())
    plotter.show(auto_close=False, interactive_update=True)
    if grass.grass is None:
        raise SystemExit(1)  # VTK has printed the error, and goes on
    start, frame = time.perf_counter(), 0
    while not plotter.iren.interactor.GetDone() and frame != chosen.frames:
        frame, grass.time_s = frame + 1, time.perf_counter() - start
        ball.position = 0.0, 0.4 + 0.1 * np.sin(grass.time_s), 0.0
        plotter.update(force_redraw=True)
    if chosen.out:
        plotter.screenshot(chosen.out)
    grass.grass.release()
    plotter.close()


if __name__ == "__main__":
    main()
