"""Reversed depth tells far surfaces apart; without clip control the usual depth draws the same picture."""

from dataclasses import replace

import numpy as np
import pytest

from greensward.gpu.depth import ReversedDepth
from greensward.ground import HeightField
from greensward.scene import Camera, SurfaceClass
from greensward.viewpoint import camera_view
from small_scenes import NOISE, small_scene


def _frame(renderer):
    return renderer(small_scene(ground=NOISE)).render(1.0, aovs=("depth", "class", "blade_id"))


def test_without_clip_control_the_picture_is_the_same(device, renderer, monkeypatch):
    reversed_ = _frame(renderer)
    monkeypatch.setattr(device, "features", replace(device.features, clip_control=False))
    assert not ReversedDepth(device).available
    usual = _frame(renderer)
    assert (reversed_.truth["class"] == SurfaceClass.GRASS).mean() > 0.05
    assert (reversed_.truth["blade_id"] != usual.truth["blade_id"]).mean() < 0.005
    far = np.abs(reversed_.image.astype(int) - usual.image.astype(int)).max(axis=-1) > 5
    assert far.mean() < 0.005


@pytest.mark.parametrize("near", [0.05, 0.1, 1.0])
def test_depth_falls_from_one_to_nothing(device, near):
    """The matrix alone: near plane at 1, far plane at 0, and steps that single precision still tells at 4 km."""
    camera = Camera(position_m=(0, 0, 0), target_m=(0, 0, -1), height_above_ground=False, near_m=near)
    none = HeightField(np.zeros((2, 2), np.float32), (1.0, 1.0), exists=False)
    clip = ReversedDepth(device).matrix(camera_view(camera, none, (30, 20)).clip_from_world)
    assert ReversedDepth(device).available

    def at(metres):
        _, _, z, w = clip @ [0.0, 0.0, -metres, 1.0]
        return np.float32(z / w)

    assert at(near) == pytest.approx(1.0)
    assert at(5000.0) == pytest.approx(0.0, abs=1e-9)
    assert at(4000.0) > at(4000.1) > at(4000.2)
