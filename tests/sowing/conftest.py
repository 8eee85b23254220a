"""Fields without a renderer around them."""

from collections.abc import Callable, Iterator

import moderngl
import numpy.typing as npt
import pytest

from greensward.ground import HeightField
from greensward.ground.ground_gpu import GroundGpu
from greensward.scene import Scene
from greensward.sowing import Field


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
