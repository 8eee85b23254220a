"""One software context for all tests that draw, current and without an error around each of them."""

from collections.abc import Callable, Iterator
from typing import Any

import moderngl
import pytest

from greensward.gpu.context import open_context
from greensward.renderer import Renderer
from greensward.scene import Scene


@pytest.fixture(scope="session")
def session_ctx() -> Iterator[moderngl.Context]:
    ctx = open_context("cpu")
    yield ctx
    ctx.release()


@pytest.fixture(scope="session")
def resting_place(session_ctx: moderngl.Context) -> moderngl.Framebuffer:
    """What is bound when a test starts; a headless context has no screen."""
    with session_ctx:
        return session_ctx.simple_framebuffer((1, 1))


@pytest.fixture
def ctx(session_ctx: moderngl.Context, resting_place: moderngl.Framebuffer) -> Iterator[moderngl.Context]:
    """The shared context; a test that leaves an OpenGL error behind fails."""
    with session_ctx:  # whoever released or left another context since left none current
        assert session_ctx.error == "GL_NO_ERROR"
        resting_place.use()  # what the test before left bound may be gone
        yield session_ctx
        assert session_ctx.error == "GL_NO_ERROR"


@pytest.fixture
def renderer(ctx: moderngl.Context) -> Iterator[Callable[..., Renderer]]:
    """Makes renderers in the shared context, of small pictures, and releases them afterwards."""
    made: list[Renderer] = []

    def make(scene: Scene, **options: Any) -> Renderer:
        made.append(Renderer(scene, **{"size": (160, 90), "ctx": ctx, **options}))
        return made[-1]

    yield make
    for each in made:
        each.release()
