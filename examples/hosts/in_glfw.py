"""Grass in a window of GLFW, with the window's own anti-aliasing: python examples/hosts/in_glfw.py"""

import glfw
import moderngl
from shared import Cube, meadow, options, orbit, save

import greensward as gs


def main():
    chosen = options(__doc__)
    if not glfw.init():
        raise SystemExit("GLFW finds no display")
    glfw.window_hint(glfw.CONTEXT_VERSION_MAJOR, 4)
    glfw.window_hint(glfw.CONTEXT_VERSION_MINOR, 3)
    glfw.window_hint(glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE)
    glfw.window_hint(glfw.SAMPLES, 4)
    window = glfw.create_window(*chosen.size, "greensward in GLFW", None, None)
    if not window:
        raise SystemExit("GLFW finds no OpenGL 4.3")
    glfw.make_context_current(window)
    glfw.swap_interval(1)

    ctx = moderngl.create_context(require=430)  # takes the context that is current
    cube = Cube(ctx)
    grass = gs.Renderer(meadow(), size=chosen.size, ctx=ctx)
    frame = 0
    while not glfw.window_should_close(window) and frame != chosen.frames:
        frame, time_s = frame + 1, glfw.get_time()
        size = glfw.get_framebuffer_size(window)  # pixels; the window's size is in the screen's units
        if 0 not in size:
            view_from_world, clip_from_view = orbit(time_s, size[0] / size[1])
            ctx.screen.use()
            ctx.viewport = (0, 0, *size)
            ctx.clear(depth=1.0)
            cube.draw(view_from_world, clip_from_view, time_s)
            grass.draw(ctx.screen, time_s, view_from_world=view_from_world, clip_from_view=clip_from_view)
            if chosen.out and frame == chosen.frames:
                save(ctx.screen, size, chosen.out)
        glfw.swap_buffers(window)
        glfw.poll_events()
    grass.release()
    glfw.terminate()


if __name__ == "__main__":
    main()
