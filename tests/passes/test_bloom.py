"""Bloom against its float64 twin, and what it does to a picture."""

import numpy as np
import pytest

from greensward.gpu.layouts import BlockBuffer
from greensward.passes.bloom import Bloom
from greensward.passes.light import LIGHT_BLOCK
from greensward.passes.sky import SKY_LIGHT_BLOCK
from oracles import bloom
from shader_calls import Neutral
from small_scenes import small_scene

_EXPOSURE, _THRESHOLD, _STRENGTH = 0.5, 1.2, 0.3


@pytest.mark.parametrize("stage", ["fragment", "compute"])
@pytest.mark.parametrize("part", [0.02, 0.15])
def test_all_passes_against_the_twin(device, stage, part):
    random = np.random.default_rng(6)
    columns, rows = 75, 43
    colours = random.gamma(1.0, 1.0, (rows, columns, 4)).astype(np.float16)
    colours[5, 7] = 6e4  # as the sun's disk
    picture = device.ctx.texture((columns, rows), 4, colours.tobytes(), dtype="f2")
    light, sky = BlockBuffer(device.ctx, LIGHT_BLOCK), BlockBuffer(device.ctx, SKY_LIGHT_BLOCK)
    light.set(bloom=_STRENGTH, bloom_threshold=_THRESHOLD)
    sky.set(exposure=_EXPOSURE)
    bindings = Neutral(Light=light, SkyLight=sky)
    made = Bloom(device, bindings, (columns, rows), part, stage)
    bindings.kernel = made._bright.shader
    result = np.frombuffer(made.run(picture).read(), np.float16).reshape(rows, columns, 4)[..., :3].astype(float)
    exact = colours[..., :3].astype(np.float64)
    small = bloom.spread(bloom.bright(exact * _EXPOSURE, _THRESHOLD), max(part * rows / bloom.BLOCK, 0.5))
    expected = exact + _STRENGTH * bloom.enlarged(small, rows, columns) / _EXPOSURE
    assert np.allclose(result, expected, rtol=5e-3, atol=5e-3)
    assert (result - exact).max() > 0.1
    for each in (made, light, sky, picture):
        each.release()


def _drawn(renderer, size=(96, 54), **post):
    camera = {"position_m": [0.0, 1.3, 4.0], "target_m": [3.0, 1.6, 5.8], "far_m": 400.0}
    scene = small_scene(grass=[], post=post, camera=camera)
    return renderer(scene, size=size).render(aovs=["depth", "albedo"])


def test_light_spreads_from_what_is_bright_and_truth_does_not_see_it(renderer):
    plain, shining = _drawn(renderer), _drawn(renderer, bloom=0.5)
    more = shining.image.astype(int) - plain.image
    assert more.min() >= -1
    assert more.max() > 15
    for name in ("depth", "albedo"):
        assert np.array_equal(plain.truth[name], shining.truth[name])
    dark = _drawn(renderer, bloom=0.5, bloom_threshold=1000.0).image
    assert np.abs(dark.astype(int) - plain.image).max() <= 1


def test_its_size_goes_by_the_picture(renderer):
    """The same part of the picture glows at any resolution."""
    glow = [
        _drawn(renderer, size, bloom=0.5).image.astype(int) - _drawn(renderer, size).image
        for size in ((96, 54), (384, 216))
    ]
    coarse = glow[1].reshape(54, 4, 96, 4, 3).mean(axis=(1, 3))
    assert np.abs(coarse - glow[0]).mean() < 2.5


def test_it_is_told_as_a_pass_and_may_be_switched(renderer):
    drawn = renderer(small_scene(post={"bloom": 0.4}), size=(64, 36))
    drawn.timers.enabled = True
    drawn.render()
    assert "bloom" in drawn.timers.milliseconds()
    drawn.resize((48, 30))
    drawn.render()
    assert drawn.updates_in_place(small_scene(post={"bloom": 0.2}))
    assert not drawn.updates_in_place(small_scene())
    drawn.update(small_scene())
    assert np.array_equal(drawn.render().image, renderer(small_scene(), size=(48, 30)).render().image)


def test_a_fisheye_has_it_too(renderer):
    camera = {
        "projection": "fisheye",
        "fov_y_deg": 170.0,
        "position_m": [0.0, 1.0, 0.0],
        "target_m": [0.0, 1.5, -1.0],
    }
    images = [
        renderer(small_scene(camera=camera, grass=[], post={"bloom": each}), size=(64, 64)).render().image.astype(int)
        for each in (0.0, 0.6)
    ]
    assert (images[1] - images[0]).max() > 8
