"""Blades filled by compute shaders: the same pixels as the pipeline fills, and as float64 says."""

from dataclasses import replace

import numpy as np
import pytest

import greensward.techniques.visibility_buffer as visibility_buffer
from blades import numbers_of, read_blades, read_poses, up_of
from greensward.scene import Camera, InputError, SurfaceClass
from greensward.viewpoint import camera_view
from oracles import culling, strips
from small_scenes import BREEZE, GRASS, NOISE, small_scene

EVERY_BLADE = {"density_per_m2": 60.0, "full_density_m": 1000.0, "reach_m": 1000.0, "drift": 0.0}
SMALL = {"kind": "flat", "size_m": [16.0, 16.0], "beyond": "bare"}


def _scene(technique="visibility-buffer", settings=None, **tables):
    own = {"ground": SMALL, "sowing": EVERY_BLADE, "shadows": {"enabled": False}}
    return small_scene(technique={"name": technique, **(settings or {})}, **{**own, **tables})


def _ids(renderer, scene, time_s=1.0, **options):
    return renderer(scene, **options).render(time_s, aovs=["blade_id", "depth", "class"]).truth


def _both(renderer, size=(320, 180), settings=None, **tables):
    return [
        _ids(renderer, _scene(name, settings, **tables), size=size) for name in ("bezier-blades", "visibility-buffer")
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    "tables",
    [
        {},
        {"wind": [BREEZE], "ground": {**NOISE, "size_m": [16.0, 16.0], "beyond": "bare"}},
        {"grass": [{**GRASS, "shape": shape} for shape in ("quad", "triangle", "minimum-width", "triangle-tip")]},
        {"grass": [{**GRASS, "shape": "dandelion", "width_m": [0.05, 0.1]}]},
        {"grass": [{**GRASS, "shape": "quadratic-3d"}, GRASS]},
        # among the blades: some are cut by the near plane, some fill the picture
        {"camera": {"position_m": [0.0, 0.25, 0.0], "target_m": [1.0, 0.3, -1.0], "near_m": 0.1}},
        {"camera": {"position_m": [0.0, 3.0, 0.01], "target_m": [0.0, 0.0, 0.0]}},
        {"object": [{"kind": "sphere", "position_m": [0.0, 0.0, 0.0], "size_m": [1.0, 1.0, 1.0]}]},
    ],
    ids=["plain", "hills and wind", "shapes", "dandelion", "folded", "close", "from above", "object"],
)
def test_same_blades_at_the_same_pixels_as_the_pipeline(renderer, tables):
    pipeline, filled = _both(renderer, **tables)
    same = pipeline["blade_id"] == filled["blade_id"]
    assert (pipeline["blade_id"] > 0).mean() > 0.1
    assert same.mean() >= 0.995
    both = same & (pipeline["blade_id"] > 0)
    apart = np.abs(filled["depth"][both] / pipeline["depth"][both] - 1.0)
    folded = "quadratic-3d" in str(tables)  # its quads are not planar
    assert np.quantile(apart, 0.99) < (5e-3 if folded else 1e-4)
    assert apart.max() < 1e-2
    assert (pipeline["class"] == filled["class"]).mean() >= 0.998


@pytest.mark.slow
def test_every_pixel_shows_the_blade_that_float64_finds_there(renderer):
    """Three segments each, of their own width and side, so that the outline follows from the blade alone."""
    size, settings = (128, 72), {"max_level": 3, "error_px": 1e-3, "min_width_px": 0.0, "edge_on": "drop"}
    scene = _scene(settings=settings, sowing={**EVERY_BLADE, "density_per_m2": 20.0}, wind=[BREEZE])
    drawn = renderer(scene, size=size)
    truth = drawn.render(1.0, aovs=["blade_id", "depth"]).truth
    (page,) = drawn._world.field.pages
    blades, pose = read_blades(drawn._world.field), read_poses(page)[:, 0]
    view = camera_view(scene.camera, drawn._world.ground.heights, size)
    root = blades["root"].astype(np.float64)
    control, tip = root + pose[:, 0], root + pose[:, 1]
    chord = (tip - root) / np.linalg.norm(tip - root, axis=1, keepdims=True)
    side = _across(up_of(blades), blades["facing"].astype(np.float64), chord)
    middle = 0.25 * root + 0.5 * control + 0.25 * tip
    to_eye = view.camera_ws - middle
    to_eye /= np.linalg.norm(to_eye, axis=1, keepdims=True)
    width = blades["width"] * culling.share_of_width(to_eye, side, 0.9)
    quads = strips.on_screen(strips.corners(root, control, tip, side, width, 3), view.clip_from_world, size)
    quads[(quads[..., 2] <= 0.0).any((1, 2))] = -1e6  # behind the camera
    owner, nearness, margin = strips.fill(quads, size)
    numbers, certain = numbers_of(drawn._world.field, truth["blade_id"])[::-1], margin > 0.02
    assert certain.mean() > 0.9
    assert (owner[certain] > 0).sum() > 300
    np.testing.assert_array_equal(numbers[certain], owner[certain])
    shown = certain & (owner > 0)
    np.testing.assert_allclose(truth["depth"][::-1][shown], 1.0 / nearness[shown], rtol=1e-4)
    # also at the edges, a pixel shows only a blade that covers its centre, but for rounding
    lone = np.unique(numbers[(numbers > 0) & ~certain])
    for blade in lone[:20]:
        only, _, near = strips.fill(quads[blade - 1 : blade], size)
        assert ((only > 0) | (near < 0.02))[numbers == blade].all()


def _across(up, facing, chord):
    helper = np.where(np.abs(up[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]])
    e1 = np.cross(helper, up)
    e1 /= np.linalg.norm(e1, axis=1, keepdims=True)
    front = np.cos(facing)[:, None] * e1 + np.sin(facing)[:, None] * np.cross(up, e1)
    across = np.cross(up, front)
    across -= chord * np.einsum("ij,ij->i", across, chord)[:, None]
    return across / np.linalg.norm(across, axis=1, keepdims=True)


@pytest.mark.slow
@pytest.mark.parametrize("threshold", [-1.0, 1e9], ids=["by rows", "by blades"])
def test_no_cracks_between_segments(renderer, monkeypatch, threshold):
    """Blades as broad as the picture, in 32 segments, close the view."""
    monkeypatch.setattr(visibility_buffer, "LARGE_PX", threshold)
    broad = {**GRASS, "shape": "quad", "width_m": [2.0, 2.0], "height_m": [4.0, 4.0], "bend": [0.5, 0.9]}
    camera = {"position_m": [0.0, 1.0, 4.0], "target_m": [0.0, 1.0, 0.0], "fov_y_deg": 25.0}
    truth = _ids(
        renderer,
        _scene(
            settings={"max_level": 32, "error_px": 0.01},
            grass=[broad],
            camera=camera,
            sowing={**EVERY_BLADE, "density_per_m2": 3.0},
        ),
        size=(320, 180),
    )
    assert (truth["class"] == SurfaceClass.GRASS).all()


@pytest.mark.slow
def test_large_blades_by_rows_show_the_same(renderer, monkeypatch):
    scene, results = _scene(wind=[BREEZE]), []
    for threshold in (-1.0, 60.0, 1e9):
        monkeypatch.setattr(visibility_buffer, "LARGE_PX", threshold)
        results.append(_ids(renderer, scene, size=(200, 112)))
    for other in results[1:]:
        assert (other["blade_id"] == results[0]["blade_id"]).mean() > 0.9995


def test_one_64_bit_run_or_two_of_32_give_the_same_picture(renderer, device, monkeypatch):
    if not device.features.wide_atomics:
        pytest.skip("this driver has no 64-bit atomics")
    scene, size = _scene(wind=[BREEZE]), (640, 360)
    wide = renderer(scene, size=size).render(1.0, aovs=["blade_id", "depth"])
    monkeypatch.setattr(device, "features", replace(device.features, wide_atomics=False))
    narrow = renderer(scene, size=size).render(1.0, aovs=["blade_id", "depth"])
    assert wide.image.tobytes() == narrow.image.tobytes()
    np.testing.assert_array_equal(wide.truth["blade_id"], narrow.truth["blade_id"])


def test_shadow_maps_are_those_of_the_pipeline(renderer):
    maps = []
    for name in ("bezier-blades", "visibility-buffer"):
        drawn = renderer(_scene(name, shadows={"enabled": True, "size_px": 512, "cascades": 1, "nearest_m": 10.0}))
        drawn.render(1.0)
        (texture, *_) = drawn._shadows._maps
        maps.append(np.frombuffer(texture.read(), np.float32).reshape(512, 512))
    bare = renderer(_scene(grass=[], shadows={"enabled": True, "size_px": 512, "cascades": 1, "nearest_m": 10.0}))
    bare.render(1.0)
    ground = np.frombuffer(bare._shadows._maps[0].read(), np.float32).reshape(512, 512)
    apart = np.abs(maps[0] - maps[1]) > 1e-5
    assert (np.abs(ground - maps[0]) > 1e-5).mean() > 0.05
    assert apart.mean() < 0.005


def test_counts_what_its_tests_left(renderer):
    counts = [
        renderer(_scene(name), size=(320, 180)).render().counts for name in ("bezier-blades", "visibility-buffer")
    ]
    assert counts[1].drawn == counts[0].drawn > 100
    assert counts[1].considered == counts[0].considered
    assert abs(counts[1].pixels - counts[0].pixels) < 0.01 * counts[0].pixels


def test_nothing_shows_beyond_the_far_plane(renderer):
    camera = Camera(position_m=(0.0, 1.3, 6.0), target_m=(0.0, 0.3, -3.0), far_m=7.0)
    for truth in _both(renderer, camera=camera.model_dump()):
        shown = truth["blade_id"] > 0
        assert shown.any()
        assert truth["depth"][shown].max() <= 7.0


@pytest.mark.parametrize(
    ("size", "told"),
    [((8, 8), "shadows.size_px: must be at most 45 "), ((128, 64), "size: must have at most 0 million pixels")],
)
def test_more_pixels_than_a_storage_block_holds_are_refused(device, renderer, monkeypatch, size, told):
    drawn = renderer(_scene(shadows={"enabled": True, "size_px": 64, "cascades": 1}), size=size)
    monkeypatch.setattr(device, "limits", replace(device.limits, storage_block_bytes=2048 * 4))
    with pytest.raises(InputError, match=told):
        drawn.render()
    monkeypatch.undo()
    assert drawn.render().image.std() > 0
