"""Contract of motion that has state: advanced once a frame, saved and continued with the world."""

import numpy as np
import pytest

from greensward.motion import MotionStep
from greensward.scene import InputError
from small_scenes import BREEZE, small_scene


class _Counter:
    """Wind field that counts its steps."""

    def __init__(self) -> None:
        self.steps: list[MotionStep] = []
        self.count = 0

    def advance(self, step: MotionStep) -> None:
        self.steps.append(step)
        self.count += 1

    def saved(self):
        return {"counted": np.array(self.count)}

    def resume(self, saved) -> None:
        if "counted" not in saved:
            raise InputError("the checkpoint holds no count")
        self.count = int(saved["counted"])

    def release(self) -> None:
        pass


@pytest.fixture
def counting(renderer):
    """Makes renderers whose world has a counter beside what else has state."""

    def make(**tables):
        box = {"kind": "box", "position_m": [0.0, 0.0, 0.0], "path": _PATH}
        drawn = renderer(small_scene(wind=[BREEZE], object=[box], **tables))
        drawn._world._stateful.append(_Counter())
        return drawn, drawn._world._stateful[-1]

    return make


_PATH = {"times_s": [0.0, 1.0], "positions_m": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], "smooth": False}


def test_each_frame_is_one_step_from_the_last(counting):
    drawn, counter = counting()
    aside = drawn.scene.camera.model_copy(update={"target_m": (3.0, 0.0, -3.0)})
    for time_s, camera in ((0.5, None), (0.75, None), (1.0, aside)):
        drawn.render(time_s, camera=camera)
    assert [(each.previous_time_s, each.time_s) for each in counter.steps] == [
        (pytest.approx(0.5 - 1 / 30), 0.5),
        (0.5, 0.75),
        (0.75, 1.0),
    ]
    assert [each.culled for each in counter.steps] == [True, False, True]
    step = counter.steps[0]
    assert np.array_equal(step.camera_ws, drawn._view.camera_ws)
    assert step.placed_at(0.25)[0, :3, 3].tolist() == [0.25, 0.0, 0.0]
    assert step.chunks is drawn._world.visible.chunks


@pytest.mark.slow
@pytest.mark.parametrize(
    "tables", [{}, {"simulation": {"within_m": 5.0, "settle_s": 0.2}}], ids=["alone", "beside blades"]
)
def test_all_that_has_state_is_saved_and_continued(counting, tables):
    drawn, _ = counting(**tables)
    assert drawn.checkpoint().keys() == {"time_s", "camera"}, "before the first frame there is none"
    for time_s in (0.0, 0.1):
        drawn.render(time_s)
    state = drawn.checkpoint()
    assert state["counted"] == 2
    assert ("steps" in state) == bool(tables)
    other, counted = counting(**tables)
    other.resume(state)
    assert counted.count == 2
    assert np.array_equal(other.render(0.2).image, drawn.render(0.2).image)
    del state["counted"]
    with pytest.raises(InputError, match="holds no count"):
        other.resume(state)
