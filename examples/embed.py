"""Grass in a program's own OpenGL context and framebuffer: a turning cube stands in the meadow.

python examples/embed.py -o embed.png
"""

import argparse
import sys
from pathlib import Path

import moderngl
import numpy as np
from PIL import Image

import greensward as gs

VERTEX = """#version 430
uniform mat4 clip_from_world;
uniform mat4 world_from_cube;
out vec3 position_ws;
void main() {  // 36 corners of a cube, from their number alone
    int face = gl_VertexID / 6, corner = int[](0, 1, 2, 2, 1, 3)[gl_VertexID % 6];
    vec3 p = vec3(corner & 1, corner >> 1, face & 1) - 0.5;
    position_ws = (world_from_cube * vec4(face < 2 ? p : face < 4 ? p.yzx : p.zxy, 1.0)).xyz;
    gl_Position = clip_from_world * vec4(position_ws, 1.0);
}"""
FRAGMENT = """#version 430
in vec3 position_ws;
out vec4 colour;
void main() {
    vec3 normal = abs(normalize(cross(dFdx(position_ws), dFdy(position_ws))));
    colour = vec4(vec3(0.3, 0.42, 0.62) * (0.35 + 0.65 * dot(normal, vec3(0.5, 0.8, 0.3))), 1.0);
}"""


def world_from_cube(angle, centre, edge):
    c, s = np.cos(angle), np.sin(angle)
    turn = edge * np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return np.block([[turn, np.array(centre)[:, None]], [np.zeros((1, 3)), 1.0]])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--samples", type=int, default=4)
    parser.add_argument("--time", type=float, default=1.0)
    parser.add_argument("-o", "--out", type=Path, default=Path("embed.png"))
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))

    # what a program has already: a context, a framebuffer with depth, something that it draws
    backend = {"backend": "egl"} if sys.platform == "linux" else {}
    ctx = moderngl.create_context(standalone=True, require=430, **backend)
    target = ctx.framebuffer([ctx.texture((width, height), 4)], ctx.depth_renderbuffer((width, height)))
    cube = ctx.vertex_array(ctx.program(VERTEX, FRAGMENT), [])
    ctx.enable(moderngl.DEPTH_TEST)

    scene = gs.load("meadow")
    camera = scene.camera
    with gs.Renderer(scene, size=(width, height), samples=options.samples, ctx=ctx) as grass:
        view_from_world, clip_from_view = grass.camera_matrices(camera)
        world_from_view = np.linalg.inv(view_from_world)
        centre = (world_from_view @ (0.0, -0.75, -6.0, 1.0))[:3]  # six metres ahead

        target.use()
        target.clear(depth=1.0)
        # matrices are for column vectors, and OpenGL takes them column by column: hence the transpose
        cube.program["clip_from_world"].write((clip_from_view @ view_from_world).T.astype("f4").tobytes())
        pose = world_from_cube(options.time, centre, 1.2)
        cube.program["world_from_cube"].write(pose.T.astype("f4").tobytes())
        cube.render(moderngl.TRIANGLES, vertices=36)
        grass.draw(target, time_s=options.time, camera=camera)  # stands before and behind the cube

    pixels = np.frombuffer(target.read(components=3, alignment=1), np.uint8).reshape(height, width, 3)[::-1]
    Image.fromarray(np.ascontiguousarray(pixels)).save(options.out)
    print(options.out)


if __name__ == "__main__":
    main()
