"""The ground by rays, in compute shaders, and the pyramid that they run down."""

import numpy as np
import pytest

from greensward.ground import HeightField
from greensward.ground.rays import highest_heights
from greensward.scene import SurfaceClass
from reprojection import world_points
from small_scenes import NOISE, small_scene, with_pictures

CAMERAS = {
    "level": {"position_m": [0.0, 1.7, 4.0], "target_m": [3.0, 1.5, -9.0]},
    "over the edge": {"position_m": [55.0, 3.0, -47.0], "target_m": [90.0, 0.0, -99.0]},
    "down": {"position_m": [0.0, 60.0, 0.1], "target_m": [0.0, 0.0, 0.0]},
    "along an axis": {"position_m": [5.0, 2.0, 5.0], "target_m": [5.0, 2.0, -5.0]},
}
GROUNDS = {
    "hills": {**NOISE, "height_m": 14.0},
    "repeated": {**NOISE, "height_m": 14.0, "size_m": [60.0, 50.0], "beyond": "repeat"},
    "flat": {"kind": "flat"},
}
VISIBILITY_BUFFER = {"name": "visibility-buffer"}


@pytest.mark.slow
@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
@pytest.mark.parametrize("ground", GROUNDS.values(), ids=GROUNDS)
def test_rays_meet_the_ground_where_it_first_is(renderer, camera, ground):
    scene = small_scene(grass=[], technique=VISIBILITY_BUFFER, ground=ground, camera={**camera, "far_m": 300.0})
    drawn = renderer(scene, stage="compute")
    truth = drawn.render(1.0, aovs=["depth", "class"]).truth
    heights, here = HeightField.of(scene), truth["class"] == SurfaceClass.GROUND
    assert here.mean() > 0.2
    # where no ground is, nothing may lie before the far plane either
    points = world_points(drawn, scene.camera, np.where(here, truth["depth"], 299.0)).reshape(-1, 3)
    eye, here = drawn._view.camera_ws, here.ravel()
    away = np.linalg.norm(points - eye, axis=1)
    gap = points[:, 1] - heights.height(points[:, 0], points[:, 2])
    assert np.abs(gap / away)[here].max() < 5e-4
    for share in np.linspace(0.01, 0.995, 250):
        before = eye + share * (points - eye)
        clear = before[:, 1] - heights.height(before[:, 0], before[:, 2])
        assert (clear > -1e-4 * away).all()


@pytest.mark.slow
def test_rays_draw_the_same_picture_as_triangles(renderer):
    scene = small_scene(
        technique=VISIBILITY_BUFFER,
        ground={**NOISE, "height_m": 2.0},  # gentle, as triangles are coarse far away
        object=[{"kind": "box", "position_m": [0.5, 0.0, -1.0], "size_m": [1.0, 1.2, 1.0]}],
        grass=[{"head": "daisy", "head_share": 0.3}],
    )
    frames = []
    for stage in ("fragment", "compute"):
        drawn = renderer(scene, stage=stage, size=(320, 180))
        drawn.render(0.9)
        frames.append(drawn.render(1.0, aovs=["class", "blade_id", "motion", "depth"]))
    triangles, rays = (frame.truth for frame in frames)
    assert (triangles["class"] == rays["class"]).mean() > 0.99
    assert (triangles["blade_id"] == rays["blade_id"]).mean() > 0.99
    for name in ("ground", "object", "flower", "grass"):
        assert (rays["class"] == SurfaceClass[name.upper()]).sum() > 50, name
    ground = (triangles["class"] == SurfaceClass.GROUND) & (rays["class"] == SurfaceClass.GROUND)
    assert np.quantile(np.abs(triangles["depth"][ground] / rays["depth"][ground] - 1.0), 0.9) < 0.02
    assert np.abs(frames[0].image.astype(int) - frames[1].image).mean() < 1.5


def test_a_cut_moves_the_ground_by_the_camera(renderer):
    """Motion of the ground is that of its points between the two cameras."""
    scene = small_scene(grass=[], technique=VISIBILITY_BUFFER, ground={**NOISE, "height_m": 2.0})
    drawn, still = renderer(scene, stage="compute"), renderer(scene, stage="fragment")
    step = scene.camera.model_copy(update={"position_m": (0.2, 1.3, 4.0)})
    for each in (drawn, still):
        each.render(0.0)
    rays, triangles = (each.render(0.1, camera=step, aovs=["motion", "class"]).truth for each in (drawn, still))
    both = (rays["class"] == SurfaceClass.GROUND) & (triangles["class"] == SurfaceClass.GROUND)
    assert np.abs(rays["motion"][both]).max() > 1.0
    assert np.quantile(np.abs(rays["motion"] - triangles["motion"])[both], 0.9) < 0.1


@pytest.mark.parametrize("shape", [(2, 2), (2, 9), (17, 17), (100, 37)])
def test_pyramid_holds_maxima(shape):
    heights = np.random.default_rng(3).normal(size=shape).astype(np.float32)
    table, starts = highest_heights(heights)
    rows, columns = shape[0] - 1, shape[1] - 1
    for level, start in enumerate(starts[1:], start=1):
        size = 2**level
        wide = -(-columns // size)
        for row in range(-(-rows // size)):
            for column in range(wide):
                under = heights[row * size : row * size + size + 1, column * size : column * size + size + 1]
                assert table[start + row * wide + column] == under.max()
    assert len(starts) == max(int(np.ceil(np.log2(max(rows, columns)))) + 1, 1)


def test_no_hidden_colour_of_a_terrain_map_rings_what_shows(renderer, tmp_path):
    land = np.full((8, 8, 4), (255, 255, 255, 0), np.uint8)
    land[2:6, 2:6] = 60, 40, 20, 255
    truths = []
    for hidden in (255, 40):
        land[land[..., 3] == 0, :3] = hidden
        ground = {"size_m": [12.0, 12.0], "terrain_map": "land.png"}
        camera = {"position_m": [0.0, 12.0, 0.01], "target_m": [0.0, 0.0, 0.0]}
        scene = with_pictures(tmp_path, {"land.png": land}, grass=[], ground=ground, camera=camera)
        truths.append(renderer(scene).render(aovs=["albedo"]).truth["albedo"])
    np.testing.assert_allclose(truths[0], truths[1], atol=2e-3)
