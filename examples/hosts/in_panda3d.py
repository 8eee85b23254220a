"""Grass in a window of Panda3D, whose z points up: python examples/hosts/in_panda3d.py"""

import sys

import moderngl
import numpy as np
from direct.showbase.ShowBase import ShowBase
from panda3d.core import (
    CallbackNode,
    CullBinManager,
    OmniBoundingVolume,
    PythonCallbackObject,
    Shader,
    loadPrcFileData,
)
from shared import BRICK, meadow, options, save

import greensward as gs

VERTEX = """#version 430
uniform mat4 p3d_ModelViewProjectionMatrix;
in vec4 p3d_Vertex;
in vec3 p3d_Normal;
out vec3 normal;
void main() { normal = p3d_Normal; gl_Position = p3d_ModelViewProjectionMatrix * p3d_Vertex; }"""
FRAGMENT = """#version 430
uniform vec4 p3d_Color;
in vec3 normal;
out vec4 drawn;
void main() { drawn = vec4(p3d_Color.rgb * (0.4 + 0.6 * dot(abs(normal), vec3(0.5, 0.3, 0.8))), 1.0); }"""
# Panda3D: x right, y ahead, z up; greensward: x right, y up, z back
TURN = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])


def matrix(row_vectors):
    return np.array(row_vectors).T


class Meadow(ShowBase):
    def __init__(self, chosen):
        super().__init__()
        self.chosen, self.frame, self.grass = chosen, 0, None
        self.disableMouse()
        self.camLens.setNearFar(0.1, 500.0)
        self.camLens.setMinFov(44.0)
        self.cube = self.loader.loadModel("models/box")
        self.cube.reparentTo(self.render)
        self.cube.setTextureOff(1)
        self.cube.setColor(*BRICK, 1.0)
        self.cube.setShader(Shader.make(Shader.SL_GLSL, VERTEX, FRAGMENT))

        # after what is opaque (20), before what is transparent (30); never culled
        CullBinManager.getGlobalPtr().addBin("grass", CullBinManager.BT_fixed, 25)
        node = CallbackNode("grass")
        node.setDrawCallback(PythonCallbackObject(self.draw_grass))
        node.setBounds(OmniBoundingVolume())
        node.setFinal(True)
        self.render.attachNewNode(node).setBin("grass", 0)
        self.taskMgr.add(self.move, "move")

    def move(self, task):
        self.cube.setPos(-0.5, -0.5, 0.0)
        self.camera.setPos(4.5 * np.sin(0.1 * task.time), -4.5 * np.cos(0.1 * task.time), 1.4)
        self.camera.lookAt(0.0, 0.0, 0.7)
        if self.frame == self.chosen.frames:
            sys.exit()
        return task.cont

    def draw_grass(self, _):
        if self.grass is None:  # the first time that Panda3D's context is current
            self.ctx = moderngl.create_context(require=430)
            self.grass = gs.Renderer(meadow(), ctx=self.ctx)
        target = self.ctx.detect_framebuffer()
        time_s = self.clock.getFrameTime()
        view_from_world = TURN @ matrix(self.render.getMat(self.cam)) @ TURN.T
        clip_from_view = matrix(self.camLens.getProjectionMat()) @ TURN.T
        self.grass.draw(target, time_s, view_from_world=view_from_world, clip_from_view=clip_from_view)
        self.frame += 1
        if self.frame == self.chosen.frames and self.chosen.out:
            save(target, (self.win.getXSize(), self.win.getYSize()), self.chosen.out)


if __name__ == "__main__":
    chosen = options(__doc__)
    loadPrcFileData("", f"gl-version 4 3\nwin-size {chosen.size[0]} {chosen.size[1]}\nwindow-title greensward")
    loadPrcFileData("", "audio-library-name null\nnotify-level-display error")
    Meadow(chosen).run()
