"""A good guest: windows, attachments, encodings and depth of a host; contexts, threads and processes; memory."""

import ctypes
import gc
import os
import subprocess
import sys
import threading
import weakref

import numpy as np
import pytest

from greensward.eyes import Eye
from greensward.gpu.adapters import open_context
from greensward.gpu.current import current_context
from greensward.gpu.view import look_at
from greensward.renderer import Renderer
from greensward.scene import Camera, GreenswardError, InputError, SurfaceClass
from small_scenes import NOISE, small_scene

_SIZE = 64, 36
_BOX = {"kind": "box", "position_m": [0.0, 0.0, 0.0], "size_m": [1.0, 0.8, 1.0]}


def _target(ctx, size=_SIZE, dtype="f1"):
    return ctx.framebuffer([ctx.texture(size, 4, dtype=dtype)], ctx.depth_texture(size))


def _seen(framebuffer, dtype=np.uint8):
    width, height = framebuffer.size
    pixels = framebuffer.color_attachments[0].read()
    return np.frombuffer(pixels, dtype).reshape(height, width, 4)[::-1]


def _depths(framebuffer):
    width, height = framebuffer.size
    return np.frombuffer(framebuffer.depth_attachment.read(), np.float32).reshape(height, width)[::-1]


def _free(*framebuffers):
    for each in framebuffers:
        for part in (*each.color_attachments, each.depth_attachment, each):
            part.release()


@pytest.fixture(scope="module")
def scene():
    return small_scene(ground=NOISE, object=[_BOX])


# Windows ------------------------------------------------------------------------------------------------------


def test_a_picture_fills_the_viewport_wherever_it_lies(ctx, device, renderer, scene):
    drawn = renderer(scene, size=_SIZE)
    alone, wide = _target(ctx), _target(ctx, (200, 100))
    for each in (alone, wide):
        each.clear(depth=1.0)
    drawn.draw(alone, 1.0)
    wide.viewport = (120, 50, *_SIZE)
    drawn.draw(wide, 1.0)
    left = 100 - 50 - 36
    assert np.array_equal(_seen(wide)[left : left + 36, 120:184], _seen(alone))
    assert np.array_equal(_depths(wide)[left : left + 36, 120:184], _depths(alone))
    assert not _seen(wide)[:, :120].any()
    # what a host sets without moderngl's knowledge counts as well
    wide.clear(depth=1.0, viewport=(0, 0, 200, 100))
    wide.use()
    device.function("glViewport", None, *(ctypes.c_int,) * 4)(3, 2, *_SIZE)
    drawn.draw(wide, 1.0)
    assert np.array_equal(_seen(wide)[62:98, 3:67], _seen(alone))
    _free(alone, wide)


def test_a_folded_window_draws_nothing(ctx, renderer, scene):
    target = _target(ctx)
    target.viewport = (0, 0, 0, 36)
    renderer(scene, size=_SIZE).draw(target)
    _free(target)


def test_other_attachments_stay_as_they_are(ctx, device, renderer, scene):
    target = ctx.framebuffer(
        [ctx.texture(_SIZE, 4), ctx.texture(_SIZE, 4, dtype="f2"), ctx.texture(_SIZE, 1, dtype="u4")],
        ctx.depth_texture(_SIZE),
    )
    target.clear(depth=1.0)
    target.color_attachments[1].write(np.full((36, 64, 4), 0.5, np.float16))
    target.color_attachments[2].write(np.full((36, 64), 77, np.uint32))
    before = device.state.snapshot()
    renderer(scene, size=_SIZE).draw(target, 1.0)
    assert device.state.snapshot() == before
    assert _seen(target).std() > 5
    assert set(np.frombuffer(target.color_attachments[1].read(), np.float16)) == {0.5}
    assert set(np.frombuffer(target.color_attachments[2].read(), np.uint32)) == {77}
    _free(target)


def test_layers(ctx, renderer, scene):
    size = 32, 18
    colours, depth = ctx.texture_array((*size, 3), 4), ctx.depth_texture(size)
    target = ctx.framebuffer([colours])
    target.clear()
    alone = _target(ctx, size)
    alone.clear(depth=1.0)
    drawn = renderer(scene, size=size)
    drawn.draw(target, layer=1)
    drawn.draw(alone)
    layers = np.frombuffer(colours.read(), np.uint8).reshape(3, 18, 32, 4)
    assert np.array_equal(layers[1][::-1], _seen(alone))
    assert not layers[[0, 2]].any()
    for each in (target, colours, depth):
        each.release()
    _free(alone)


@pytest.mark.parametrize("encoding", ["linear", "hdr"])
def test_encodings(ctx, renderer, scene, encoding):
    target, usual = _target(ctx, dtype="f2"), _target(ctx)
    drawn = renderer(scene, size=_SIZE)
    for each, name in ((target, encoding), (usual, "srgb")):
        each.clear(depth=1.0)
        drawn.draw(each, 1.0, encoding=name)
    got, srgb = _seen(target, np.float16)[..., :3].astype(float), _seen(usual)[..., :3] / 255.0
    decoded = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    if encoding == "linear":
        assert np.abs(got - decoded).max() < 0.012  # dithered by half a step, and eight bits
    else:
        raw = np.frombuffer(drawn._lighting._radiance.read(), np.float16).reshape(36, 64, 4)[::-1, :, :3]
        assert np.allclose(got, raw.astype(float), rtol=2e-3)
        assert got.max() > 1.0
        toned = got * drawn.light().exposure
        assert np.corrcoef(toned.ravel().clip(0, 1), decoded.ravel())[0, 1] > 0.9
    _free(target, usual)


def test_linear_light_into_an_srgb_attachment_is_encoded_by_the_driver(ctx, device, renderer, scene):
    usual = _target(ctx)
    coded = ctx.framebuffer([ctx.texture(_SIZE, 4, internal_format=0x8C43)], ctx.depth_texture(_SIZE))
    drawn = renderer(scene, size=_SIZE)
    before = device.state.snapshot()
    for each, name in ((usual, "srgb"), (coded, "linear")):
        each.clear(depth=1.0)
        drawn.draw(each, 1.0, encoding=name)
    assert device.state.snapshot() == before
    assert np.abs(_seen(usual).astype(int) - _seen(coded).astype(int)).max() <= 1
    _free(usual, coded)


def _reversed(near: float) -> np.ndarray:
    matrix = np.zeros((4, 4))
    matrix[0, 0], matrix[1, 1], matrix[2, 3], matrix[3, 2] = 36 / 64 * 2.1, 2.1, near, -1.0
    return matrix


def test_reversed_depth_as_the_context_has_it(ctx, device, renderer, scene):
    """Nearer is greater, without a far plane: what the host drew hides the grass, and the depth is the host's."""
    drawn = renderer(scene, size=_SIZE)
    pose, near = drawn.camera_matrices()[0], 0.1
    control = device.function("glClipControl", None, ctypes.c_uint, ctypes.c_uint)
    target = _target(ctx)
    target.clear(depth=0.0)
    target.depth_attachment.write(np.repeat(np.linspace(0.0, 0.03, 64, dtype=np.float32)[None], 36, 0))
    control(0x8CA1, 0x935F)
    drawn.draw(target, 1.0, view_from_world=pose, clip_from_view=_reversed(near))
    control(0x8CA1, 0x935E)
    truth = drawn.render(1.0, camera=drawn._views.cameras[0], aovs=["depth"]).truth["depth"]
    host = np.repeat(np.linspace(0.0, 0.03, 64)[None], 36, 0)
    own = np.where(np.isfinite(truth), near / truth, 0.0)
    assert np.abs(_depths(target) - np.maximum(own, host)).max() < 1e-5
    assert (_seen(target)[..., 3] > 0)[own > host + 1e-4].all()
    assert not _seen(target)[own < host - 1e-4].any()
    _free(target)


def test_parallel_projections_that_begin_behind_the_camera(ctx, renderer, scene):
    drawn = renderer(scene, size=_SIZE)
    pose = drawn.camera_matrices()[0]
    matrix = np.diag([1 / 4.0, 1 / 2.25, -2 / 60.0, 1.0])  # 30 m to both sides
    target = _target(ctx)
    target.clear(depth=1.0)
    drawn.draw(target, view_from_world=pose, clip_from_view=matrix)
    truth = drawn.render(camera=drawn._views.cameras[0], aovs=["depth"]).truth["depth"]
    behind = 31.0  # what shows begins a metre before the camera
    expected = np.where(np.isfinite(truth), 0.5 + 0.5 * (truth - behind) / 30.0, 1.0)
    assert np.abs(_depths(target) - expected.clip(0, 1)).max() < 1e-5
    _free(target)


# Grass alone ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("samples", [1, 4])
def test_without_sky_and_ground_the_host_shows(ctx, renderer, scene, samples):
    drawn = renderer(scene, size=_SIZE, samples=samples)
    target, whole = _target(ctx), _target(ctx)
    for each in (target, whole):
        each.clear(0.0, 0.0, 1.0, 1.0, depth=1.0)
    drawn.draw(whole, 1.0)
    drawn.draw(target, 1.0, sky=False, ground=False)
    kinds = renderer(scene, size=_SIZE).render(1.0, aovs=["class"]).truth["class"]
    got, all_ = _seen(target).astype(int), _seen(whole).astype(int)
    bare = np.isin(kinds, (SurfaceClass.SKY, SurfaceClass.GROUND))
    solid = kinds == SurfaceClass.OBJECT
    assert (got[..., 2] == 255)[bare].mean() > (0.99 if samples == 1 else 0.4)
    assert np.abs(got - all_)[solid].max(axis=-1).mean() < 3
    assert (kinds == SurfaceClass.GRASS).mean() > 0.1
    if samples == 1:
        assert np.array_equal(got[~bare], all_[~bare])
        assert (_depths(target)[bare] == 1.0).all()
        assert np.array_equal(_depths(target)[~bare], _depths(whole)[~bare])
    else:
        # a blade that covers a part of the pixel covers a part of the host's colour
        mixed = (got[..., 2] < 250) & (got[..., 2] > all_[..., 2] + 20)
        assert mixed.mean() > 0.03
    _free(target, whole)


def test_grass_alone_is_not_for_temporal_pictures(ctx, renderer, scene):
    target = _target(ctx)
    with pytest.raises(InputError, match=r"sky, ground: must be drawn by a renderer with temporal"):
        renderer(scene, size=_SIZE, temporal=True).draw(target, ground=False)
    _free(target)


# Two eyes ---------------------------------------------------------------------------------------------------------


def _apart(camera: Camera, aside_m: float) -> Camera:
    shift = {
        name: (x + aside_m, y, z)
        for name, (x, y, z) in (("position_m", camera.position_m), ("target_m", camera.target_m))
    }
    return camera.model_copy(update=shift)


def test_eyes_see_what_each_alone_sees(ctx, renderer, scene, monkeypatch):
    eyes = [_apart(scene.camera, aside) for aside in (-0.03, 0.03)]
    both = _target(ctx, (128, 36))
    both.clear(depth=1.0)
    drawn = renderer(scene, size=_SIZE)
    moved: list[float] = []
    move = drawn._world.move
    monkeypatch.setattr(drawn._world, "move", lambda frame: (moved.append(frame.time_s), move(frame)))
    filled: list[int] = []
    fill = drawn._geometry.fill_shadow_maps
    monkeypatch.setattr(drawn._geometry, "fill_shadow_maps", lambda *maps: (filled.append(1), fill(*maps)))
    drawn.draw_eyes([Eye(both, camera, viewport=(64 * i, 0, 64, 36)) for i, camera in enumerate(eyes)], 1.0)
    assert (moved, filled) == ([1.0], [1])
    for i, camera in enumerate(eyes):
        alone = renderer(scene, size=_SIZE).render(1.0, camera=camera).image.astype(int)
        got = _seen(both)[:, 64 * i : 64 * i + 64, :3].astype(int)
        assert (np.abs(got - alone).max(axis=-1) > 8).mean() < 0.01  # shadows are those of the first
    assert (_seen(both)[:, :64] != _seen(both)[:, 64:]).any()
    _free(both)


def test_eyes_have_histories_of_their_own(ctx, renderer, scene):
    eyes = [_apart(scene.camera, aside) for aside in (-0.03, 0.03)]
    both = _target(ctx, (128, 36))
    drawn = renderer(scene, size=_SIZE, temporal=True)
    for step in range(3):
        both.clear(depth=1.0)
        drawn.draw_eyes([Eye(both, camera, viewport=(64 * i, 0, 64, 36)) for i, camera in enumerate(eyes)], step / 60)
    alone = renderer(scene, size=_SIZE, temporal=True)
    for step in range(3):
        picture = alone.render(step / 60, camera=eyes[1]).image
    assert drawn.blended == 3
    assert (np.abs(_seen(both)[:, 64:, :3].astype(int) - picture).max(axis=-1) > 8).mean() < 0.02
    _free(both)


def test_eyes_of_two_sizes_are_refused(ctx, renderer, scene):
    both = _target(ctx, (128, 36))
    with pytest.raises(InputError, match="viewport: must be of one size"):
        renderer(scene).draw_eyes([Eye(both, viewport=(0, 0, 64, 36)), Eye(both, viewport=(64, 0, 60, 36))])
    with pytest.raises(InputError, match="eyes: must hold one at least"):
        renderer(scene).draw_eyes([])
    _free(both)


# Contexts, threads, processes ---------------------------------------------------------------------------------------


def test_a_context_of_its_own_leaves_the_hosts_current(ctx, scene):
    """Whether the host's was made before or after the renderer's."""
    host = current_context().handle
    assert host
    with Renderer(scene, size=_SIZE) as own:
        assert current_context().handle == host
        own.render()
        own.update(scene.model_copy(update={"title": "other"}))
        own.resize((32, 18))
        assert own.counts.pixels >= 0
        assert current_context().handle == host
        with open_context() as later:
            third = current_context().handle
            assert third != host
            picture = own.render().image
            assert picture.std() > 5
            assert current_context().handle == third
            assert later.error == "GL_NO_ERROR"
        later.release()
    ctx.__enter__()
    assert current_context().handle == host


def test_no_context_is_left_where_there_was_none(ctx, scene):
    before = current_context()
    before.leave()
    try:
        with Renderer(scene, size=_SIZE) as own:
            own.render()
            assert current_context().handle is None
        assert current_context().handle is None
    finally:
        before.enter()


def test_a_host_context_that_is_not_current_is_told(ctx, renderer, scene):
    drawn = renderer(scene, size=_SIZE)
    before = current_context()
    before.leave()
    try:
        with pytest.raises(GreenswardError, match=r"is not current in this thread: make it current before each call"):
            drawn.render()
    finally:
        before.enter()
    assert drawn.render().image.std() > 5


def test_another_thread_is_told(scene):
    told: list[str] = []
    with Renderer(scene, size=_SIZE) as own:
        first = own.render().image

        def elsewhere():
            for call in (own.render, own.checkpoint, lambda: own.resize((32, 18)), lambda: own.advance(1.0)):
                try:
                    call()
                except GreenswardError as error:
                    told.append(str(error))

        thread = threading.Thread(target=elsewhere)
        thread.start()
        thread.join()
        assert len(told) == 4
        assert set(told) == {
            "a renderer is used in the thread that made it: OpenGL draws in one thread at a time; "
            "make one for each thread"
        }
        assert np.array_equal(own.render().image, first)


def test_use_after_release_is_told(renderer, ctx, scene):
    drawn = renderer(scene, size=_SIZE)
    target = _target(ctx)
    drawn.release()
    for call in (drawn.render, drawn.checkpoint, lambda: drawn.draw(target), lambda: drawn.resize((9, 9))):
        with pytest.raises(GreenswardError, match=r"^this renderer has been released: make another$"):
            call()
    drawn.release()
    _free(target)


def test_a_foreign_framebuffer_is_told(ctx, scene):
    target = _target(ctx)
    with Renderer(scene, size=_SIZE) as own:
        with pytest.raises(InputError, match=r"framebuffer: must be of the context.*Renderer\(…, ctx=ctx\)"):
            own.draw(target)
        with pytest.raises(InputError, match=r"framebuffer: must be a moderngl\.Framebuffer \(got int\)"):
            own.draw(7)
    _free(target)


_FORKED = """
import multiprocessing as mp
import greensward as gs
scene = gs.Scene(sowing=gs.Sowing(density_per_m2=20, reach_m=10), shadows=gs.Shadows(size_px=64, cascades=1))
def job(_):
    try:
        gs.Renderer(scene, size=(16, 9))
    except gs.GreenswardError as error:
        return str(error)
with gs.Renderer(scene, size=(16, 9)) as r:
    r.render()
    with mp.get_context("fork").Pool(1) as pool:
        print(pool.map_async(job, [0]).get(timeout=60)[0])
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="there is no fork")
def test_a_forked_worker_is_told_to_be_spawned():
    done = subprocess.run([sys.executable, "-c", _FORKED], capture_output=True, text=True, timeout=120, check=True)
    assert 'start workers with multiprocessing.get_context("spawn")' in done.stdout


def test_forgotten_renderers_free_themselves(device, scene):
    first = Renderer(scene, size=_SIZE, ctx=device.ctx)
    first.render()
    released: list[str] = []
    for part in first._parts:
        weakref.finalize(part, released.append, type(part).__name__)
    kinds = sorted(type(each).__name__ for each in first._parts)
    del part
    gone = weakref.ref(first)
    del first
    assert gone() is None, "no circle of references waits for the collector"
    assert device._forgotten
    with Renderer(scene, size=_SIZE, ctx=device.ctx) as second:
        assert not device._forgotten
        gc.collect()
        assert sorted(released) == kinds
        assert second.render().image.std() > 5


def test_hosts_that_change_their_matrices_each_frame(ctx, renderer, scene):
    target = _target(ctx)
    drawn = renderer(scene, size=_SIZE)
    projection = drawn.camera_matrices()[1]
    for step in range(3):
        pose = look_at((0.1 * step, 3.0, 6.0), (0.0, 0.0, -3.0)).astype(np.float32)
        target.clear(depth=1.0)
        drawn.draw(target, step / 30, view_from_world=pose, clip_from_view=projection.astype(np.float32))
    assert _seen(target).std() > 5
    _free(target)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"encoding": "foo"}, r'encoding: must be "srgb", "linear" or "hdr" \(got \'foo\'\)'),
        ({"sky": "no"}, r"sky: must be True or False \(got 'no'\)"),
        ({"layer": 1}, r"layer: must be one of the framebuffer's, which has no layers \(got 1\)"),
        ({"layer": "a"}, r"layer: must be a whole number from 0 on \(got 'a'\)"),
        ({"camera": "x"}, r"camera: must be a gs\.Camera \(got str\)"),
    ],
)
def test_what_draw_is_asked_and_cannot_do(ctx, renderer, scene, given, message):
    target = _target(ctx)
    with pytest.raises(InputError, match=message):
        renderer(scene, size=_SIZE).draw(target, **given)
    _free(target)


def test_what_eyes_cannot_be(ctx, renderer, scene):
    target = _target(ctx)
    drawn = renderer(scene, size=_SIZE)
    for eyes, message in (
        (Eye(target, viewport=(0, 0, 64)), "viewport: must be four whole numbers"),
        ([target], r"eyes: must be a list of gs\.Eye \(got Framebuffer\)"),
        (Eye(target, viewport=(0, 0, 64.5, 36)), "viewport: must be four whole numbers"),
    ):
        with pytest.raises(InputError, match=message):
            drawn.draw_eyes(eyes)
    target.clear(depth=1.0)
    folded = Eye(target, viewport=(0, 0, 0, 36))
    drawn.draw_eyes(each for each in (folded, Eye(target, viewport=np.array([0, 0, 64, 36]))))
    assert _seen(target).std() > 5
    _free(target)


def test_the_sky_lies_at_the_far_end_of_the_depth_range(ctx, device, renderer):
    scene = small_scene(camera={"target_m": [0.0, 1.3, -3.0]})
    target = _target(ctx)
    target.clear(depth=0.9)
    depth_range = device.function("glDepthRange", None, ctypes.c_double, ctypes.c_double)
    depth_range(0.0, 0.9)
    renderer(scene, size=_SIZE).draw(target, 1.0)
    depth_range(0.0, 1.0)
    kinds = renderer(scene, size=_SIZE).render(1.0, aovs=["class"]).truth["class"]
    assert np.abs(_depths(target)[kinds == SurfaceClass.SKY] - 0.9).max() < 1e-6
    assert (_seen(target)[kinds == SurfaceClass.SKY] > 0).any()
    _free(target)


_WINDOW = """
import glfw
import greensward as gs
scene = gs.Scene(sowing=gs.Sowing(density_per_m2=20, reach_m=10), shadows=gs.Shadows(size_px=64, cascades=1))
def drawn():
    with gs.Renderer(scene, size=(16, 9), device="cpu") as renderer:
        return renderer.render().image.std()
before = drawn()
assert glfw.init()
glfw.window_hint(glfw.VISIBLE, False)
window = glfw.create_window(32, 18, "host", None, None)
glfw.make_context_current(window)
import moderngl
ctx = moderngl.create_context()
assert drawn() == before
ctx.clear(1.0, 0.0, 0.0)
assert ctx.screen.read()[:3] == b"\\xff\\x00\\x00", "the window's context is current again"
print("left alone")
"""


def test_a_window_and_a_headless_renderer_leave_each_other_alone(display):
    """Whichever is made first, and at the end of the process."""
    pytest.importorskip("glfw", reason="the extra viewer is not installed", exc_type=ImportError)
    environment = {**os.environ, "DISPLAY": display}
    done = subprocess.run(
        [sys.executable, "-c", _WINDOW], capture_output=True, text=True, timeout=120, env=environment
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "left alone\n", "")
