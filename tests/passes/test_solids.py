"""Objects of a shape are one draw whatever their sizes, and have the surface of their own."""

import numpy as np
import pytest

from greensward.gpu.kernels import Draw
from greensward.library import load
from greensward.scene import SurfaceClass
from reprojection import world_points
from small_scenes import small_scene


@pytest.fixture
def draw_calls(monkeypatch):
    """Files of the programs that drew, one for each call."""
    calls, run = [], Draw.run
    monkeypatch.setattr(Draw, "run", lambda self, *a, **o: (calls.append(self.path), run(self, *a, **o))[1])
    return calls


def test_the_fence_of_the_meadow_is_a_handful_of_draws(renderer, draw_calls):
    scene = load("meadow")
    bare = {"grass": (), "flowers": (), "shadows": scene.shadows.model_copy(update={"enabled": False})}
    drawn = renderer(scene.model_copy(update=bare))
    assert len({each.size_m for each in drawn._world.objects if each.kind == "box"}) > 50
    frame = drawn.render(aovs=["class"])
    assert (frame.truth["class"] == SurfaceClass.OBJECT).mean() > 0.01
    assert 0 < sum(path.startswith("passes/solids/") for path in draw_calls) <= 3


_SIZES = [(0.6, 1.4, 0.8), (1.0, 0.5, 1.2), (0.4, 0.4, 0.4)]


def test_ellipsoids_of_one_draw_have_each_its_surface_and_normals(renderer, draw_calls):
    balls = [
        {"kind": "sphere", "position_m": [1.3 * (i - 1), 0.2, 0.0], "size_m": size, "yaw_deg": 30.0 * i}
        for i, size in enumerate(_SIZES)
    ]
    drawn = renderer(small_scene(grass=[], object=balls, shadows={"enabled": False}), size=(320, 180))
    truth = drawn.render(aovs=["class", "depth", "normal"]).truth
    assert draw_calls.count("passes/solids/solid.frag") == 1
    shown = truth["class"] == SurfaceClass.OBJECT
    points, normals = world_points(drawn, drawn.scene.camera, truth["depth"])[shown], truth["normal"][shown]
    of = np.argmin(np.abs(points[:, :1] - 1.3 * np.array([-1, 0, 1])), axis=1)
    for i, size in enumerate(_SIZES):
        placed, half = drawn._world.placed[i], 0.5 * np.array(size)
        own = (points[of == i] - placed[:3, 3]) @ placed[:3, :3] - [0.0, half[1], 0.0]
        assert len(own) > 100
        assert np.abs(np.linalg.norm(own / half, axis=1) - 1.0).max() < 0.02
        expected = own / half**2 @ placed[:3, :3].T
        expected /= np.linalg.norm(expected, axis=1, keepdims=True)
        assert np.quantile((normals[of == i] * expected).sum(1), 0.05) > 0.995
