"""Grass in a window of pygame: python examples/hosts/in_pygame.py"""

import moderngl
import pygame
from shared import Cube, meadow, options, orbit, save

import greensward as gs


def main():
    chosen = options(__doc__)
    pygame.display.init()
    pygame.display.gl_set_attribute(pygame.GL_CONTEXT_MAJOR_VERSION, 4)
    pygame.display.gl_set_attribute(pygame.GL_CONTEXT_MINOR_VERSION, 3)
    pygame.display.gl_set_attribute(pygame.GL_CONTEXT_PROFILE_MASK, pygame.GL_CONTEXT_PROFILE_CORE)
    pygame.display.gl_set_attribute(pygame.GL_DEPTH_SIZE, 24)
    pygame.display.set_mode(chosen.size, pygame.OPENGL | pygame.DOUBLEBUF | pygame.RESIZABLE)
    pygame.display.set_caption("greensward in pygame")

    ctx = moderngl.create_context(require=430)
    cube = Cube(ctx)
    grass = gs.Renderer(meadow(), size=chosen.size, ctx=ctx)
    frame, open_, clock = 0, True, pygame.time.Clock()
    while open_ and frame != chosen.frames:
        frame, time_s = frame + 1, pygame.time.get_ticks() / 1000.0
        size = pygame.display.get_window_size()
        view_from_world, clip_from_view = orbit(time_s, size[0] / size[1])
        ctx.screen.use()
        ctx.viewport = (0, 0, *size)
        ctx.clear(depth=1.0)
        cube.draw(view_from_world, clip_from_view, time_s)
        grass.draw(ctx.screen, time_s, view_from_world=view_from_world, clip_from_view=clip_from_view)
        if chosen.out and frame == chosen.frames:
            save(ctx.screen, size, chosen.out)
        pygame.display.flip()
        clock.tick(60)
        open_ = not any(event.type == pygame.QUIT for event in pygame.event.get())
    grass.release()
    pygame.quit()


if __name__ == "__main__":
    main()
