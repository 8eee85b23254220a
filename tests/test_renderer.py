"""The renderer's own promises: sizes, samples, bad input, and drawing into a framebuffer of the caller's."""

import json

import moderngl
import numpy as np
import pytest

from greensward.aovs import AOVS
from greensward.gpu.device import Device
from greensward.renderer import Renderer
from greensward.scene import Camera, InputError, SurfaceClass
from live_objects import live_objects
from small_scenes import BREEZE, NOISE, small_scene

_BOX = {"kind": "box", "position_m": [0.6, 0.0, 0.0]}


@pytest.mark.parametrize("size", [(1, 1), (3, 2), (37, 23), (160, 90)])
@pytest.mark.parametrize("stage", ["fragment", "compute"])
def test_sizes(renderer, size, stage):
    frame = renderer(small_scene(), size=size, stage=stage).render(aovs=AOVS)
    width, height = size
    assert frame.image.shape == (height, width, 3)
    assert frame.image.dtype == np.uint8
    assert all(frame.truth[name].shape[:2] == (height, width) for name in frame.truth if name != "camera")
    assert frame.image.mean() > 20


@pytest.mark.parametrize("size", [(0, 0), (10, 0), (-1, 5), (40_000, 10), (10, 40_000)])
def test_impossible_sizes_are_refused(device, renderer, size):
    before = live_objects(device)
    limit = device.limits.picture_px
    with pytest.raises(
        InputError, match=rf"size: must be 1 to {limit} pixels a side on this driver \(got {size[0]}x{size[1]}\)"
    ):
        renderer(small_scene(), size=size)
    assert live_objects(device) == before
    drawn = renderer(small_scene())
    with pytest.raises(InputError, match="size: must be"):
        drawn.resize(size)
    assert drawn.size == (160, 90)
    assert drawn.render().image.shape == (90, 160, 3)


@pytest.mark.parametrize("samples", [0, -3])
def test_impossible_samples_are_refused(renderer, samples):
    with pytest.raises(InputError, match=f"samples: must be a whole number of at least 1 \\(got {samples}\\)"):
        renderer(small_scene(), samples=samples)


@pytest.mark.parametrize(
    "technique",
    [{"name": "no-such"}, {"name": "bezier-blades", "nonsense": 3}, {"name": "bezier-blades", "max_level": 0}],
)
def test_unknown_techniques_and_settings_are_refused(device, renderer, technique):
    before = live_objects(device)
    with pytest.raises(InputError, match="technique"):
        renderer(small_scene(technique=technique))
    assert live_objects(device) == before


@pytest.mark.slow
@pytest.mark.parametrize("stage", ["fragment", "compute"])
def test_resized_as_if_made_so(renderer, stage):
    scene = small_scene(wind=[BREEZE])
    drawn = renderer(scene, stage=stage)
    drawn.render(1.0)
    for size in ((90, 51), (160, 90), (64, 64), (90, 51)):
        drawn.resize(size)
        fresh = renderer(scene, size=size, stage=stage)
        assert np.array_equal(drawn.render(1.0, aovs=["motion"]).image, fresh.render(1.0).image)
        fresh.release()


def test_samples_smooth_edges_and_leave_the_truth_alone(renderer):
    scene = small_scene(object=[_BOX])
    one, many = (renderer(scene, samples=samples).render(aovs=AOVS) for samples in (1, 8))
    for name in AOVS:
        assert np.array_equal(one.truth[name], many.truth[name]), name
    noise = [np.abs(np.diff(frame.image.astype(int), axis=1)).mean() for frame in (one, many)]
    assert noise[1] < 0.85 * noise[0]
    assert abs(one.image.mean() - many.image.mean()) < 5


@pytest.mark.parametrize("samples", [1, 2])
def test_what_lay_in_memory_before_does_not_show(renderer, samples):
    drawn = renderer(small_scene(), samples=samples)
    for average in drawn._post._average:
        average.write(np.full((90, 160, 4), np.nan, np.float32).tobytes())
    assert np.array_equal(drawn.render().image, renderer(small_scene(), samples=samples).render().image)


def test_progress_is_told_after_each_sample(renderer):
    told = []
    renderer(small_scene(), samples=3).render(progress=lambda done, total: told.append((done, total)))
    assert told == [(1, 3), (2, 3), (3, 3)]


def test_an_error_in_progress_leaves_the_renderer_usable(device, renderer):
    drawn = renderer(small_scene(), samples=2)
    expected = drawn.render().image

    def stop(*_):
        raise KeyboardInterrupt

    before = device.state.snapshot()
    with pytest.raises(KeyboardInterrupt):
        drawn.render(progress=stop)
    assert device.state.snapshot() == before
    assert np.array_equal(drawn.render().image, expected)


@pytest.mark.parametrize(
    ("aovs", "fix"),
    [
        (["nonsense"], "unknown output nonsense; choose from depth, normal, class, blade_id, motion, albedo"),
        (["depth", "blade-id"], r"unknown output blade-id; did you mean blade_id\?"),
        ([""], "unknown output without a name; choose from"),
        ("dept", r"unknown output dept; did you mean depth\?"),
        ("depth", r'must be a list of names, such as \["depth"\] \(got "depth"\)'),
    ],
)
def test_unknown_aovs_are_refused(renderer, aovs, fix):
    with pytest.raises(InputError, match=f"aovs: {fix}"):
        renderer(small_scene()).render(aovs=aovs)


@pytest.mark.parametrize("time_s", [float("nan"), float("inf"), float("-inf"), 1e30])
def test_impossible_times_are_refused(renderer, time_s):
    with pytest.raises(InputError, match="time: must be a finite number of seconds"):
        renderer(small_scene()).render(time_s)


def test_a_camera_inside_the_ground_is_refused(renderer):
    inside = Camera(position_m=(0.0, -1.0, 0.0), target_m=(0.0, 0.0, -5.0))
    with pytest.raises(InputError, match="must be above the ground"):
        renderer(small_scene(camera=inside.model_dump()))
    drawn = renderer(small_scene())
    with pytest.raises(InputError, match="must be above the ground"):
        drawn.render(camera=inside)
    assert drawn.render().image.std() > 5


def test_the_camera_record_tells_what_the_arrays_mean(renderer):
    scene = small_scene(ground=NOISE)
    drawn = renderer(scene)
    record = json.loads(str(drawn.render(aovs=["depth"]).truth["camera"]))
    view_from_world, clip_from_view = drawn.camera_matrices()
    assert record["size"] == [160, 90]
    assert record["classes"] == {"sky": 0, "ground": 1, "grass": 2, "flower": 3, "object": 4, "water": 5}
    assert (record["near_m"], record["far_m"], record["fov_y_deg"]) == (scene.camera.near_m, 400.0, 50.0)
    assert np.allclose(record["view_from_world"], view_from_world)
    assert np.allclose(record["clip_from_world"], clip_from_view @ view_from_world)


def test_depth_is_the_distance_along_the_axis(renderer):
    """Looking straight down on flat ground, it is the camera's height everywhere."""
    scene = small_scene(grass=[], camera={"position_m": [0.0, 3.0, 0.0], "target_m": [0.0, 0.0, -0.001]})
    depth = renderer(scene).render(aovs=["depth"]).truth["depth"]
    assert np.abs(depth - 3.0).max() < 2e-3


def test_normals_of_the_ground_face_the_sky_and_boxes_their_faces(renderer):
    scene = small_scene(grass=[], object=[{**_BOX, "size_m": [1.0, 0.5, 1.0]}])
    truth = renderer(scene).render(aovs=["normal", "class"]).truth
    assert np.abs(truth["normal"][truth["class"] == SurfaceClass.GROUND] - [0, 1, 0]).max() < 2e-3
    faces = np.unique(np.round(truth["normal"][truth["class"] == SurfaceClass.OBJECT], 2) + 0.0, axis=0)
    assert {tuple(face) for face in faces} == {(0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (-1.0, 0.0, 0.0)}


def _target(ctx: moderngl.Context, size: tuple[int, int]) -> moderngl.Framebuffer:
    return ctx.framebuffer([ctx.texture(size, 4)], ctx.depth_texture(size))


def _free(framebuffer: moderngl.Framebuffer) -> None:
    for each in (*framebuffer.color_attachments, framebuffer.depth_attachment, framebuffer):
        each.release()


def _seen(framebuffer: moderngl.Framebuffer) -> np.ndarray:
    width, height = framebuffer.size
    return np.frombuffer(framebuffer.color_attachments[0].read(), np.uint8).reshape(height, width, 4)[::-1, :, :3]


def _depths(framebuffer: moderngl.Framebuffer) -> np.ndarray:
    width, height = framebuffer.size
    return np.frombuffer(framebuffer.depth_attachment.read(), np.float32).reshape(height, width)[::-1]


@pytest.mark.parametrize("size", [(160, 90), (200, 120), (33, 20)])
def test_drawn_into_a_framebuffer_of_the_caller(ctx, device, renderer, size):
    scene = small_scene(wind=[BREEZE], object=[_BOX])
    target = _target(ctx, size)
    target.clear(depth=1.0)
    drawn = renderer(scene)
    before = device.state.snapshot()
    drawn.draw(target, 1.0)
    assert device.state.snapshot() == before
    frame = renderer(scene, size=size).render(1.0, aovs=["depth"])
    assert np.array_equal(_seen(target), frame.image)
    near, far, d = scene.camera.near_m, scene.camera.far_m, frame.truth["depth"]
    with np.errstate(invalid="ignore"):
        expected = np.where(np.isinf(d), 1.0, 0.5 + 0.5 * ((far + near) - 2 * far * near / d) / (far - near))
    assert np.abs(_depths(target) - expected).max() < 1e-5
    _free(target)


@pytest.mark.parametrize("depth_mask", [True, False])
def test_what_the_caller_drew_nearer_hides_the_scene(ctx, renderer, depth_mask):
    """A plane across the view, drawn with the matrices that the renderer tells, before and after."""
    scene = small_scene(camera={"target_m": [0.0, 0.8, -3.0]})
    drawn = renderer(scene)
    truth = drawn.render(aovs=["depth"]).truth
    view_from_world, clip_from_view = drawn.camera_matrices()
    program = ctx.program(
        vertex_shader="""
            #version 430
            uniform mat4 clip_from_world;
            in vec3 p;
            void main() { gl_Position = clip_from_world * vec4(p, 1.0); }
        """,
        fragment_shader="#version 430\nout vec4 c;\nvoid main() { c = vec4(1.0, 0.0, 1.0, 1.0); }",
    )
    program["clip_from_world"].write((clip_from_view @ view_from_world).T.astype("f4").tobytes())
    corners = np.array([[-9, -9, 1], [9, -9, 1], [-9, 9, 1], [9, 9, 1]], "f4")  # a wall at z = 1, three metres away
    buffer = ctx.buffer(corners.tobytes())
    wall = ctx.vertex_array(program, [(buffer, "3f", "p")])
    in_wall = _wall_depth(drawn, scene.camera, truth["depth"].shape, 1.0)
    first, after = _target(ctx, (160, 90)), _target(ctx, (160, 90))
    for target, steps in ((first, "wall scene"), (after, "scene wall")):
        target.clear(depth=1.0)
        for step in steps.split():
            if step == "scene":
                target.depth_mask = depth_mask or step == "scene"
                drawn.draw(target)
            else:
                target.use()
                ctx.enable_only(moderngl.DEPTH_TEST)
                wall.render(moderngl.TRIANGLE_STRIP)
    magenta = (_seen(first) == [255, 0, 255]).all(axis=2)
    clear = np.abs(truth["depth"] - in_wall) > 0.02
    assert np.array_equal(magenta[clear], (in_wall < truth["depth"])[clear])
    assert 0.1 < magenta.mean() < 0.9
    assert np.array_equal(magenta[clear], (_seen(after) == [255, 0, 255]).all(axis=2)[clear])
    ctx.enable_only(moderngl.NOTHING)
    for each in (wall, buffer, program):
        each.release()
    _free(first)
    _free(after)


def _wall_depth(drawn: Renderer, camera: Camera, shape: tuple[int, ...], z: float) -> np.ndarray:
    """Depth along the axis at which each pixel's ray meets the plane of this z."""
    view_from_world, clip_from_view = drawn.camera_matrices(camera)
    height, width = shape
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, 1 - (np.arange(height) + 0.5) / height * 2)
    ray = (
        np.stack([x / clip_from_view[0, 0], y / clip_from_view[1, 1], -np.ones_like(x)], -1) @ view_from_world[:3, :3]
    )
    eye = np.linalg.inv(view_from_world)[:3, 3]
    with np.errstate(divide="ignore"):
        depth = (z - eye[2]) / ray[..., 2]
    return np.where(depth > 0, depth, np.inf)


def test_the_callers_masks_are_kept_while_it_draws(ctx, renderer):
    """A framebuffer that is not bound and whose depth is locked gets its depth all the same, and stays locked."""
    target = _target(ctx, (160, 90))
    target.clear(depth=1.0)
    target.depth_mask = False
    target.viewport = (0, 0, 80, 90)
    renderer(small_scene()).draw(target)
    assert target.depth_mask is False
    assert target.viewport == (0, 0, 80, 90)
    _free(target)


def test_two_renderers_in_one_context_take_turns(renderer):
    scenes = [small_scene(wind=[BREEZE]), small_scene(seed=8, ground=NOISE, grass=[])]
    expected = [renderer(scene).render(1.0, aovs=["depth"]) for scene in scenes]
    drawn = [renderer(scene) for scene in scenes]
    for _ in range(2):
        for each, frame in zip(drawn, expected, strict=True):
            again = each.render(1.0, aovs=["depth"])
            assert np.array_equal(again.image, frame.image)
            assert np.array_equal(again.truth["depth"], frame.truth["depth"])


def test_two_renderers_on_one_headless_device_take_turns(ctx, renderer):
    scenes = [small_scene(wind=[BREEZE]), small_scene(seed=8, ground=NOISE)]
    expected = [renderer(scene).render(1.0).image for scene in scenes]
    with Renderer(scenes[0], size=(160, 90)) as one:
        with Renderer(scenes[1], size=(160, 90)) as two:
            assert one.device is two.device is not Device.of(ctx)
            for _ in range(2):
                assert np.array_equal(one.render(1.0).image, expected[0])
                assert np.array_equal(two.render(1.0).image, expected[1])
        one.resize((80, 45))
        assert one.render(1.0).image.shape == (45, 80, 3)
    ctx.__enter__()  # it is to be current again


def test_released_twice_is_released(device, renderer):
    drawn = renderer(small_scene())
    drawn.render()
    drawn.release()
    before = live_objects(device)
    drawn.release()
    assert live_objects(device) == before


def test_figures_of_the_last_picture(renderer):
    drawn = renderer(small_scene())
    assert (drawn.blades, drawn.blades_in_view) == (0, 0)
    drawn.render()
    assert drawn.blades >= drawn.blades_in_view > 0
    assert drawn.field_bytes >= drawn.blades * 88
    assert set(drawn.seconds) == {"context", "ground", "build", "shaders", "sow", "draw"}
    assert all(seconds >= 0 for seconds in drawn.seconds.values())


def test_passes_are_timed_when_asked(renderer):
    drawn = renderer(small_scene())
    drawn.render()
    assert drawn.timers.milliseconds() == {}
    drawn.timers.enabled = True
    drawn.render()
    assert {"move", "shadows", "objects", "grass", "heads", "ground", "light", "post"} <= set(
        drawn.timers.milliseconds()
    )


def test_a_hundred_million_blades_are_refused_and_nothing_is_left(device, renderer, monkeypatch):
    from greensward.sowing import field

    monkeypatch.setattr(field, "available_bytes", lambda _: 2 << 30)
    drawn = renderer(small_scene(sowing={"density_per_m2": 4000.0, "full_density_m": 90.0, "reach_m": 90.0}))
    before = live_objects(device)
    with pytest.raises(
        InputError, match=r"sowing: about 1\d\d million blades need [\d.]+ GiB, and this device can give 2\.0 GiB"
    ):
        drawn.render()
    assert live_objects(device) == before
