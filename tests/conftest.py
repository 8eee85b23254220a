"""One context for all tests that draw, current and without an error around each; GREENSWARD_DEVICE chooses it."""

import os
from collections.abc import Callable, Iterator
from typing import Any

import moderngl
import numpy.typing as npt
import pytest

from greensward.gpu.context import open_context
from greensward.ground import HeightField
from greensward.ground.ground_gpu import GroundGpu
from greensward.renderer import Renderer
from greensward.scene import Scene
from greensward.sowing import Field

os.environ.setdefault("GREENSWARD_DEVICE", "cpu")


@pytest.fixture(scope="session")
def session_ctx() -> Iterator[moderngl.Context]:
    ctx = open_context()
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


@pytest.fixture
def sow(ctx: moderngl.Context) -> Iterator[Callable[..., Field]]:
    """Sows a scene's field around a focus; without one, around a point on the ground below the origin."""
    made: list[Field | GroundGpu] = []

    def make(scene: Scene, focus: npt.ArrayLike = (0.0, 0.0, 0.0), slack_m: float = 0.0) -> Field:
        ground = GroundGpu(ctx, scene, HeightField.of(scene))
        field = Field(ctx, scene, ground)
        made.extend((field, ground))
        field.sow(focus, slack_m)
        return field

    yield make
    for each in made:
        each.release()
