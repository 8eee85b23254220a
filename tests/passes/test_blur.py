"""The blur by depth against its twin, and the darkening with distance."""

import numpy as np
import pytest

from greensward.gpu.layouts import BlockBuffer
from greensward.passes.blur import Blur
from greensward.passes.light import LIGHT_BLOCK
from greensward.scene import SurfaceClass
from oracles import blur
from shader_calls import Neutral, surface_at
from small_scenes import small_scene

_NEAR, _FAR = 2.0, 400.0


@pytest.mark.parametrize("stage", ["fragment", "compute"])
@pytest.mark.parametrize("kind", ["average", "gaussian"])
def test_both_passes_against_the_twin(device, stage, kind):
    random = np.random.default_rng(4)
    columns, rows = 37, 21
    colours = random.uniform(0, 8, (rows, columns, 4)).astype(np.float32)
    depth = np.exp(random.uniform(0, 7, (rows, columns))).astype(np.float32)
    depth[random.uniform(size=depth.shape) < 0.1] = np.inf
    picture = device.ctx.texture((columns, rows), 4, colours.tobytes(), dtype="f4")
    picture.repeat_x = picture.repeat_y = False
    surface = surface_at(device, depth)
    block = BlockBuffer(device.ctx, LIGHT_BLOCK)
    block.set(blur=1 if kind == "average" else 2, blur_near_m=_NEAR, blur_far_m=_FAR)
    bindings = Neutral(Light=block, gbuffer_surface=surface)
    made = Blur(device, bindings, (columns, rows), stage)
    bindings.kernel = made._passes[0].shader
    result = np.frombuffer(made.run(picture).read(), np.float32).reshape(rows, columns, 4)[..., :3]
    exact = depth.astype(np.float64)
    across = blur.row(colours[..., :3].astype(np.float64), exact, _NEAR, _FAR, kind == "gaussian")
    expected = blur.row(across.swapaxes(0, 1), exact.T, _NEAR, _FAR, kind == "gaussian").swapaxes(0, 1)
    # bilinear filters have 8 bits
    assert np.abs(result - expected).max() < 0.06
    assert np.abs(result - colours[..., :3])[depth < _NEAR].max() < 1e-5
    for part in (made, block, picture, surface):
        part.release()


def _scene(**post):
    return small_scene(
        ground={"kind": "flat", "size_m": [4000.0, 4000.0]},
        sowing={"reach_m": 80.0, "full_density_m": 20.0},
        post=post,
    )


def _roughness(image):
    return np.abs(np.diff(image.astype(float), axis=1)).mean()


@pytest.mark.slow
def test_the_distance_is_blurred_and_what_is_near_is_not(renderer):
    frames = {kind: renderer(_scene(blur=kind)).render(aovs=["depth"]) for kind in ("off", "average", "gaussian")}
    depth = frames["off"].truth["depth"]
    far, near = (depth > 25) & np.isfinite(depth), depth < 2.0
    rows = np.nonzero(far.all(axis=1))[0]
    rough = {kind: _roughness(frame.image[rows]) for kind, frame in frames.items()}
    assert max(rough["average"], rough["gaussian"]) < 0.75 * rough["off"]
    assert near.sum() > 20
    assert np.abs(frames["average"].image[near].astype(int) - frames["off"].image[near]).max() <= 2


def test_a_near_object_does_not_spread_over_what_lies_behind_it(renderer):
    """Red against grass: no pixel beside it turns red."""
    box = {"kind": "box", "position_m": [0.0, 0.0, 1.5], "size_m": [0.3, 2.0, 0.3], "colour": "#ff0000"}
    thing = small_scene(object=[box]).object
    scenes = [_scene(blur=kind).model_copy(update={"object": thing}) for kind in ("off", "average")]
    frames = [renderer(scene).render(aovs=["class", "depth"]) for scene in scenes]
    behind = (frames[0].truth["class"] != SurfaceClass.OBJECT) & (frames[0].truth["depth"] > 8)
    red = [frame.image[behind].astype(int) @ [1, -1, 0] for frame in frames]
    assert (red[1] - red[0]).max() < 30


def test_it_is_told_as_a_pass_and_may_be_off(renderer):
    drawn = renderer(_scene(blur="average"))
    drawn.timers.enabled = True
    drawn.render()
    assert "blur" in drawn.timers.milliseconds()
    drawn.resize((64, 40))
    drawn.render()
    off = renderer(_scene())
    off.timers.enabled = True
    off.render()
    assert "blur" not in off.timers.milliseconds()


def test_darkening_grows_with_distance_and_spares_the_sky_and_objects(renderer):
    box = {"kind": "box", "position_m": [1.5, 0.0, -20.0], "size_m": [3.0, 6.0, 0.5]}
    thing = small_scene(object=[box]).object
    frames = []
    for darkening in (0.0, 1.0):
        scene = _scene(darkening=darkening, darkening_m=60.0, tone_map="linear", vignette=0.0)
        frames.append(renderer(scene.model_copy(update={"object": thing})).render(aovs=["class", "depth"]))
    kind, depth = frames[0].truth["class"], frames[0].truth["depth"]
    image = [((frame.image / 255.0 + 0.055) / 1.055) ** 2.4 for frame in frames]
    for untouched in ("sky", "object"):
        there = kind == SurfaceClass[untouched.upper()]
        assert there.sum() > 50
        assert np.abs(image[0][there] - image[1][there]).max() < 0.02
    for low, high in ((3, 5), (12, 18), (30, 40)):
        ring = (depth > low) & (depth < high) & (kind != SurfaceClass.OBJECT)
        assert image[1][ring].mean() / image[0][ring].mean() == pytest.approx(1 - depth[ring].mean() / 60, abs=0.12)
