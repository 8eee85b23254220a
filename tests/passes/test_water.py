"""Water: where its surface lies, what it mirrors, and what it leaves alone."""

import numpy as np
import pytest

from greensward.aovs import AOVS
from greensward.gpu.view import View
from greensward.ground import HeightField
from greensward.scene import Camera, InputError, SurfaceClass
from greensward.viewpoint import camera_view
from live_objects import live_objects
from small_scenes import GRASS, small_scene, with_pictures

_WATER, _GRASS, _OBJECT = (SurfaceClass[name.upper()] for name in ("water", "grass", "object"))
_BASIN = np.full((33, 33), 1.0)
_BASIN[8:25, 8:25] = -1.5
_CAMERA = {"position_m": [0.0, 2.0, 9.0], "target_m": [0.0, 0.0, -4.0], "height_above_ground": False, "far_m": 400.0}


@pytest.fixture
def scene(tmp_path):
    """A square lake of 20 m in a plain a metre above its surface."""
    np.save(tmp_path / "basin.npy", _BASIN.astype(np.float32))

    def make(water=None, **tables):
        values = {
            "ground": {"kind": "heightmap", "file": "basin.npy", "size_m": [40.0, 40.0]},
            "camera": _CAMERA,
            "water": {"level_m": 0.0, "ripple": 0.0, **(water or {})} if water is not False else None,
            "grass": [],
            **tables,
        }
        return small_scene(**values).in_folder(tmp_path)

    return make


def _rays(drawn, camera, size):
    view_from_world, clip_from_view = drawn.camera_matrices(camera)
    x = (2 * (np.arange(size[0]) + 0.5) / size[0] - 1) / clip_from_view[0, 0]
    y = (1 - 2 * (np.arange(size[1]) + 0.5) / size[1]) / clip_from_view[1, 1]
    rays = np.stack(np.broadcast_arrays(x[None, :], y[:, None], -1.0), -1) @ view_from_world[:3, :3]
    return rays, np.linalg.inv(view_from_world)[:3, 3]


@pytest.mark.parametrize("stage", ["fragment", "compute"])
@pytest.mark.parametrize(
    "technique", ["visibility-buffer", "bezier-blades", "tessellated-quads", "geometry-billboards", "billboard-grid"]
)
def test_its_surface_is_a_plane(renderer, scene, stage, technique):
    made = scene({"ripple": 0.4}, technique={"name": technique}, grass=[GRASS])
    drawn = renderer(made, stage=stage)
    truth = drawn.render(aovs=AOVS).truth
    there = truth["class"] == _WATER
    rays, eye = _rays(drawn, made.camera, (160, 90))
    assert there.mean() > 0.15
    assert np.allclose((eye + rays * truth["depth"][..., None])[there][:, 1], 0.0, atol=2e-3)
    assert truth["normal"][there][:, 1].min() > 0.8
    assert (truth["blade_id"][there] == 0).all()
    assert np.abs(truth["motion"][there]).max() < 0.01
    assert np.array_equal(truth["blade_id"] > 0, truth["class"] == _GRASS)


def test_motion_on_it_is_that_of_the_camera(renderer, scene):
    drawn = renderer(scene({"ripple": 0.4}))
    drawn.render(0.0)
    moved = drawn.scene.camera.model_copy(update={"position_m": (0.3, 2.0, 9.0), "target_m": (0.3, 0.0, -4.0)})
    truth = drawn.render(0.1, camera=moved, aovs=["motion", "class"]).truth
    motion = truth["motion"][truth["class"] == _WATER]
    assert (motion[:, 0] < -1.0).all(), "to the left as the camera goes right"
    assert np.abs(motion[:, 1]).max() < 0.05


def test_a_mirrored_view_shows_points_where_their_images_are():
    made = small_scene(camera=_CAMERA)
    view: View = camera_view(made.camera, HeightField.of(made), (160, 90))
    mirror = view.mirrored(0.5, (80, 45))
    points = np.random.default_rng(3).uniform([-5, 0.5, -20], [5, 4, 2], (200, 3))
    image = points * [1, -1, 1] + [0, 1.0, 0]
    one = np.ones((200, 1))
    seen = np.hstack([points, one]) @ mirror.clip_from_world.T
    assert np.allclose(seen, np.hstack([image, one]) @ view.clip_from_world.T)
    depth = np.hstack([points, one]) @ mirror.axis_ws
    assert np.allclose(depth, seen[:, 3])
    assert np.allclose(mirror.near_and_far_m, view.near_and_far_m, rtol=1e-6)


@pytest.mark.parametrize("stage", ["fragment", "compute"])
def test_it_mirrors_objects(renderer, scene, stage):
    """A red post on the far shore, upside down below itself; none without reflections."""
    post = {"kind": "box", "position_m": [0.0, 0.0, -11.0], "size_m": [1.0, 3.0, 1.0], "colour": "#ff0000"}
    red = []
    for reflections in (True, False):
        made = scene({"reflections": reflections, "reflection_scale": 1.0}, object=[post], sky={"clouds": 0.0})
        frame = renderer(made, stage=stage).render(aovs=["class"])
        image, water = frame.image.astype(int), frame.truth["class"] == _WATER
        red.append((image @ [1, -1, 0] > 25) & water)
    assert not red[1].any()
    columns = np.nonzero(red[0].any(axis=0))[0]
    assert 3 < len(columns) < 30
    assert abs(columns.mean() - 79.5) < 2
    rows = np.nonzero(red[0].any(axis=1))[0]
    assert rows.min() == np.nonzero((frame.truth["class"] == _WATER).any(axis=1))[0].min() or len(rows) > 4


def _greens(frame):
    image, water = frame.image.astype(int), frame.truth["class"] == _WATER
    return ((image @ [0, 1, -1] > 12) & water).sum()


@pytest.mark.slow
@pytest.mark.parametrize(
    "technique", ["visibility-buffer", "bezier-blades", "tessellated-quads", "geometry-billboards", "billboard-grid"]
)
def test_it_mirrors_the_low_detail_grass_only(renderer, tmp_path, technique):
    """Green in the density map, row A2: without it the grass still stands on the shore, and none in the water."""
    np.save(tmp_path / "basin.npy", _BASIN.astype(np.float32))
    tables = {
        "ground": {"kind": "heightmap", "file": "basin.npy", "size_m": [40.0, 40.0]},
        "camera": {**_CAMERA, "position_m": [0.0, 0.8, 0.0], "target_m": [0.0, 0.9, -9.0], "fov_y_deg": 40.0},
        "water": {"level_m": 0.9, "ripple": 0.0, "reflection_scale": 1.0, "clarity_m": 0.2},
        "grass": [{**GRASS, "height_m": [0.8, 1.2]}],
        "sowing": {"density_per_m2": 200.0, "density_map": "map.png", "reach_m": 30.0},
        "technique": {"name": technique},
    }
    tables["camera"]["position_m"] = [0.0, 1.4, 0.0]
    frames = []
    for low in (255, 0):
        pixels = np.full((4, 4, 3), (255, low, 255), np.uint8)
        frames.append(renderer(with_pictures(tmp_path, {"map.png": pixels}, **tables)).render(aovs=["class"]))
    assert abs(_cover(frames[0], _GRASS) - _cover(frames[1], _GRASS)) < 0.01
    assert _cover(frames[0], _GRASS) > 0.05
    assert _greens(frames[0]) > 3 * _greens(frames[1]) + 50


def _cover(frame, kind):
    return (frame.truth["class"] == kind).mean()


def test_ripples_run_and_the_same_instant_is_the_same_picture(renderer, scene):
    drawn = renderer(scene({"ripple": 0.5}), samples=2)
    first, second, again = (drawn.render(time_s, aovs=["class"]) for time_s in (0.5, 1.0, 0.5))
    water = first.truth["class"] == _WATER
    assert np.array_equal(first.image, again.image)
    changed = np.abs(first.image.astype(int) - second.image).max(-1) > 2
    assert changed[water].mean() > 0.3
    assert not changed[~water].any()


def test_shallow_water_shows_the_ground_and_deep_water_its_colour(renderer, scene):
    high = {**_CAMERA, "position_m": [0.0, 8.0, 0.01], "target_m": [0.0, 0.0, 0.0]}
    colours = []
    for clarity_m in (0.01, 1000.0):
        frame = renderer(scene({"clarity_m": clarity_m, "colour": "#0000ff"}, camera=high)).render(aovs=["class"])
        colours.append(frame.image[40:50, 75:85].reshape(-1, 3).mean(axis=0))
    assert colours[0][2] > 1.5 * colours[0][0]
    assert colours[1][0] > 1.2 * colours[1][2], "brown soil"


def test_scenes_without_water_have_none(renderer, scene):
    frame = renderer(scene(water=False)).render(aovs=["class"])
    assert (frame.truth["class"] != _WATER).all()


def test_water_meets_depth_in_a_framebuffer_of_the_callers(ctx, renderer, scene):
    target = ctx.framebuffer([ctx.texture((160, 90), 4)], ctx.depth_renderbuffer((160, 90)))
    drawn = renderer(scene())
    target.clear(depth=1.0)
    drawn.draw(target)
    depth = np.frombuffer(target.read(attachment=-1, components=1, dtype="f4"), np.float32).reshape(90, 160)[::-1]
    truth = drawn.render(aovs=["class", "depth"]).truth
    near, far = drawn.scene.camera.near_m, drawn.scene.camera.far_m
    metres = near * far / (far - depth.astype(np.float64) * (far - near))
    there = truth["class"] == _WATER
    assert np.allclose(metres[there], truth["depth"][there], rtol=0.02)
    for part in (*target.color_attachments, target.depth_attachment, target):
        part.release()


def test_it_takes_part_in_temporal_pictures_and_in_resizing(renderer, scene):
    drawn = renderer(scene({"ripple": 0.3}), temporal=True)
    for step in range(3):
        frame = drawn.render(step / 30, aovs=["class"])
    assert drawn.blended == 3
    drawn.resize((80, 44))
    frame = drawn.render(0.2, aovs=["class"])
    assert _cover(frame, _WATER) > 0.15


@pytest.mark.parametrize("hidden", [True, False])
def test_hills_hide_grass_in_the_mirror_as_they_should(renderer, scene, hidden):
    """With the test of occlusion and without, the picture is the same."""
    tables = {"grass": [GRASS], "sowing": {"reach_m": 20.0}}
    frames = [
        renderer(scene({"reflection_scale": 1.0}, culling={"occlusion": flag}, **tables), samples=2).render()
        for flag in (hidden, True)
    ]
    assert np.array_equal(frames[0].image, frames[1].image)


def test_a_camera_in_the_water_is_refused(renderer, scene):
    drawn = renderer(scene())
    below = Camera(position_m=(0.0, -0.5, 0.0), target_m=(0.0, 0.0, -4.0), height_above_ground=False)
    with pytest.raises(InputError, match=r"must be above the water, whose level is 0 m \(got -0\.50 m\)"):
        drawn.render(camera=below)
    drawn.render()


@pytest.mark.slow
def test_everything_is_released_and_nothing_grows(device, renderer, scene):
    before = live_objects(device)
    for stage in ("fragment", "compute"):
        drawn = renderer(scene(grass=[GRASS]), stage=stage)
        drawn.render(0.5, aovs=AOVS)
        counts = {kind: len(names) for kind, names in live_objects(device).items()}
        for step in range(3):
            drawn.render(0.1 * step)
            drawn.resize((100, 60))
            drawn.render(0.1 * step)
            drawn.resize((160, 90))
        drawn.render(0.5)
        assert {kind: len(names) for kind, names in live_objects(device).items()} == counts
        drawn.release()
        assert live_objects(device) == before


def test_its_price_is_told(renderer, scene):
    drawn = renderer(scene())
    drawn.timers.enabled = True
    drawn.render()
    assert drawn.timers.milliseconds()["water"] > 0
