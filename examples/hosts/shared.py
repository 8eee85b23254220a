"""What the programs beside this one share, and no host needs: options, a small scene, a cube, a camera, a picture."""

import argparse
from pathlib import Path

import moderngl
import numpy as np
from PIL import Image

import greensward as gs

BRICK = 0.72, 0.28, 0.2
VERTEX = """#version 430
uniform mat4 clip_from_world;
uniform float angle;
out vec3 position_ws;
void main() {  // 36 corners of a cube of 1 m that turns on the ground, from their number alone
    int face = gl_VertexID / 6, corner = int[](0, 1, 2, 2, 1, 3)[gl_VertexID % 6];
    vec3 p = vec3(corner & 1, corner >> 1, face & 1) - 0.5;
    p = face < 2 ? p : face < 4 ? p.yzx : p.zxy;
    float c = cos(angle), s = sin(angle);
    position_ws = vec3(c * p.x + s * p.z, p.y + 0.5, c * p.z - s * p.x);
    gl_Position = clip_from_world * vec4(position_ws, 1.0);
}"""
FRAGMENT = """#version 430
uniform vec3 colour;
in vec3 position_ws;
out vec4 drawn;
void main() {
    vec3 normal = abs(normalize(cross(dFdx(position_ws), dFdy(position_ws))));
    drawn = vec4(colour * (0.4 + 0.6 * dot(normal, vec3(0.5, 0.8, 0.3))), 1.0);
}"""


def options(title):
    parser = argparse.ArgumentParser(description=title.splitlines()[0])
    parser.add_argument("--size", default="960x540", help="of the window in pixels")
    add_run(parser)
    chosen = parser.parse_args()
    chosen.size = tuple(map(int, chosen.size.split("x")))
    return chosen


def add_run(parser):
    parser.add_argument("--frames", type=int, help="leave after so many; without it, when the window is closed")
    parser.add_argument("-o", "--out", type=Path, help="picture of the last frame, read from the framebuffer")


def meadow():
    """A scene that a CPU draws in a tenth of a second at 320x180."""
    return gs.Scene(
        grass=[gs.Grass(species="meadow-grass", width_m=(0.006, 0.012)), gs.Grass(species="daisy", share=0.08)],
        sowing=gs.Sowing(density_per_m2=150, reach_m=40),
        shadows=gs.Shadows(size_px=256, cascades=1),
    )


def orbit(time_s, aspect):
    """A camera that circles around the cube: view_from_world and clip_from_view, for column vectors."""
    angle, near, far = 0.6 + 0.1 * time_s, 0.1, 500.0
    eye = np.array([4.5 * np.sin(angle), 1.4, 4.5 * np.cos(angle)])
    back = (eye - (0.0, 0.7, 0.0)) / np.linalg.norm(eye - (0.0, 0.7, 0.0))
    right = np.cross((0.0, 1.0, 0.0), back) / np.linalg.norm(np.cross((0.0, 1.0, 0.0), back))
    view_from_world = np.eye(4)
    view_from_world[:3, :3] = right, np.cross(back, right), back
    view_from_world[:3, 3] = -view_from_world[:3, :3] @ eye
    focal = 1.0 / np.tan(np.radians(22.0))
    clip_from_view = np.diag([focal / aspect, focal, (far + near) / (near - far), 0.0])
    clip_from_view[2:, 2:] = ((far + near) / (near - far), 2 * far * near / (near - far)), (-1.0, 0.0)
    return view_from_world, clip_from_view


class Cube:
    """The host's own object."""

    def __init__(self, ctx):
        self.program = ctx.program(VERTEX, FRAGMENT)
        self.program["colour"] = BRICK
        self.vertices = ctx.vertex_array(self.program, [])

    def draw(self, view_from_world, clip_from_view, time_s):
        # matrices are for column vectors, and OpenGL takes them column by column: hence the transpose
        clip_from_world = np.asarray(clip_from_view) @ np.asarray(view_from_world)
        self.program["clip_from_world"].write(clip_from_world.T.astype("f4").tobytes())
        self.program["angle"] = time_s
        self.vertices.ctx.enable(moderngl.DEPTH_TEST)
        self.vertices.render(moderngl.TRIANGLES, vertices=36)


def save(framebuffer, size, path):
    pixels = np.frombuffer(framebuffer.read((0, 0, *size), components=3, alignment=1), np.uint8)
    Image.fromarray(pixels.reshape(size[1], size[0], 3)[::-1].copy()).save(path)
