"""Fences: posts at equal distances on the ground, rails from post to post, the same from the same seed."""

import numpy as np
import pytest

from greensward.ground import HeightField
from greensward.objects.fences import all_objects
from greensward.objects.placing import Placing
from greensward.scene import Fence, InputError, SceneError
from greensward.sowing.clearings import pieces_of, sward_defines
from small_scenes import NOISE, small_scene

CORNER = {"path": [[0.0, 0.0], [9.0, 0.0], [9.0, 8.0]], "spacing_m": 2.0, "smooth": False, "weathered": 0.0}


def _boxes(ground=NOISE, **changed):
    scene = small_scene(ground=ground, fence=[{**CORNER, **changed}], object=[])
    heights = HeightField.of(scene)
    return all_objects(scene, heights), heights, scene


def test_posts_stand_on_the_ground_at_equal_distances():
    boxes, _, _ = _boxes(rails_m=[])
    at = np.array([box.position_m for box in boxes])
    assert len(boxes) == 10
    assert np.allclose(np.hypot(*np.diff(at[:4, [0, 2]], axis=0).T), 17.0 / 9.0)
    assert np.allclose(at[[0, -1]][:, [0, 2]], [[0.0, 0.0], [9.0, 8.0]])
    for box in boxes:
        assert box.position_m[1] + box.size_m[1] == pytest.approx(CORNER.get("post_m", (0, 1.25, 0))[1])


def test_rails_lead_from_post_to_post_above_the_ground():
    boxes, heights, _ = _boxes(rails_m=[0.5])
    posts, rails = boxes[:10], boxes[10:]
    assert len(rails) == 9
    placed = Placing(boxes, heights).at(0.0)[10:]
    for rail, matrix, before, after in zip(rails, placed, posts, posts[1:], strict=False):
        length_m = rail.size_m[1] - 0.05
        ends = (matrix @ np.array([[0, 0, 0, 1], [0, length_m, 0, 1]], float).T).T[:, :3]
        for end, post in zip(ends, (before, after), strict=True):
            x, _, z = post.position_m
            assert np.allclose(end, [x, heights.height(x, z) + 0.5, z], atol=1e-6)


def test_a_weathered_fence_varies_by_the_seed_alone():
    old, _, _ = _boxes(weathered=1.0)
    again, _, _ = _boxes(weathered=1.0)
    new, _, _ = _boxes()
    assert old == again != new
    assert len({box.colour for box in old}) > 5
    assert {box.colour for box in new} == {"#857766"}


def test_posts_clear_their_feet_and_rails_do_not():
    boxes, heights, scene = _boxes({"kind": "flat"}, rails_m=[0.9])
    pieces = pieces_of(scene, Placing(boxes, heights), boxes, heights)
    assert len(pieces.corners) == 10
    assert "CLEARINGS" in sward_defines(scene)
    assert "CLEARINGS" not in sward_defines(_boxes(clears=False)[2])


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"path": [[0, 0]]}, "Fence: path: must hold at least 2 values (got 1)"),
        ({"path": [[1, 1], [1, 1]]}, "Fence: path must lead from one point to another"),
        ({"path": [[0, 0], [9000, 0]]}, "Fence: a path of 9000 m has more than 2,000 posts with spacing_m 2"),
        ({"spacing_m": 0}, "Fence: spacing_m: must be at least 0.05 (got 0)"),
        ({"post_m": [0.1, 0.0, 0.1]}, "Fence: post_m[1]: must be at least 0.002 (got 0.0)"),
    ],
)
def test_a_fence_that_cannot_stand_is_refused(changed, expected):
    with pytest.raises(SceneError) as caught:
        Fence(**{**CORNER, **changed})
    assert expected in str(caught.value)


def test_more_posts_and_rails_than_there_is_room_for_are_refused_before_they_are_made():
    fence = {"path": [[0.0, 0.0], [99.0, 0.0]], "spacing_m": 0.05}
    scene = small_scene(fence=[fence] * 10)
    with pytest.raises(InputError, match=r"fence: must have at most 50,000 posts and rails together \(got 59,"):
        all_objects(scene, HeightField.of(scene))
