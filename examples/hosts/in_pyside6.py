"""Grass in a widget of PySide6, with the widget's own anti-aliasing: python examples/hosts/in_pyside6.py"""

import sys

import moderngl
import numpy as np
from PySide6.QtCore import QElapsedTimer
from PySide6.QtGui import QMatrix4x4, QSurfaceFormat, QVector3D
from PySide6.QtOpenGLWidgets import QOpenGLWidget
from PySide6.QtWidgets import QApplication
from shared import Cube, meadow, options

import greensward as gs


class Meadow(QOpenGLWidget):
    def __init__(self, chosen):
        super().__init__()
        self.chosen, self.frame = chosen, 0
        self.clock = QElapsedTimer()
        self.setWindowTitle("greensward in PySide6")
        self.resize(*chosen.size)
        self.frameSwapped.connect(self.next)

    def initializeGL(self):  # noqa: N802  # as Qt calls it
        self.ctx = moderngl.create_context(require=430)
        self.cube = Cube(self.ctx)
        self.grass = gs.Renderer(meadow(), ctx=self.ctx)
        self.clock.start()
        self.context().aboutToBeDestroyed.connect(self.leave)

    def paintGL(self):  # noqa: N802
        time_s = self.clock.elapsed() / 1000.0
        pose, lens = QMatrix4x4(), QMatrix4x4()
        pose.lookAt(QVector3D(2.5, 1.4, 3.7), QVector3D(0.0, 0.7, 0.0), QVector3D(0.0, 1.0, 0.0))
        lens.perspective(44.0, self.width() / self.height(), 0.1, 500.0)
        view_from_world, clip_from_view = (np.reshape(each.copyDataTo(), (4, 4)) for each in (pose, lens))

        target = self.ctx.detect_framebuffer()  # the widget's own, which Qt has bound; another after a resize
        target.use()  # moderngl does not know what Qt has bound
        target.clear(depth=1.0)
        self.cube.draw(view_from_world, clip_from_view, time_s)
        self.grass.draw(target, time_s, view_from_world=view_from_world, clip_from_view=clip_from_view)
        self.frame += 1

    def next(self):
        if self.format().version() < (4, 3):  # Qt takes less without a word
            print("Qt finds no OpenGL 4.3", file=sys.stderr)
            QApplication.exit(1)
            return
        if self.frame != self.chosen.frames:
            self.update()
            return
        if self.chosen.out:
            self.grabFramebuffer().save(str(self.chosen.out))
        self.close()

    def leave(self):
        self.makeCurrent()
        self.grass.release()


if __name__ == "__main__":
    surface = QSurfaceFormat()
    surface.setVersion(4, 3)
    surface.setProfile(QSurfaceFormat.OpenGLContextProfile.CoreProfile)
    surface.setDepthBufferSize(24)
    surface.setSamples(4)
    QSurfaceFormat.setDefaultFormat(surface)
    application = QApplication(sys.argv[:1])
    widget = Meadow(options(__doc__))
    widget.show()
    sys.exit(application.exec())
