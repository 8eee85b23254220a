"""The ground by rays, in both stages, and the pyramid that they run down."""

import numpy as np
import pytest

from greensward.ground import HeightField
from greensward.ground.noise import octaves
from greensward.ground.rays import highest_heights
from greensward.scene import SurfaceClass
from reprojection import world_points
from small_scenes import NOISE, small_scene, with_pictures

CAMERAS = {
    "level": {"position_m": [0.0, 1.7, 4.0], "target_m": [3.0, 1.5, -9.0]},
    "over the edge": {"position_m": [55.0, 3.0, -47.0], "target_m": [90.0, 0.0, -99.0]},
    "down": {"position_m": [0.0, 60.0, 0.1], "target_m": [0.0, 0.0, 0.0]},
    "through a long lens": {"position_m": [0.0, 6.0, 36.0], "target_m": [4.0, 0.0, -50.0], "fov_y_deg": 5.0},
    "along an axis": {"position_m": [5.0, 2.0, 5.0], "target_m": [5.0, 2.0, -5.0]},
}
GROUNDS = {
    "hills": {**NOISE, "height_m": 14.0},
    "repeated": {**NOISE, "height_m": 14.0, "size_m": [60.0, 50.0], "beyond": "repeat"},
    "flat": {"kind": "flat"},
}
VISIBILITY_BUFFER = {"name": "visibility-buffer"}


def _first_hit(heights, eye, rays, far_m):
    """Depth in float64 at which rays (n, 3), a metre deep, first meet the ground; inf where they do not."""
    steps = np.arange(0.5, far_m, 0.05)
    below = np.zeros(len(rays), np.bool_)
    depth = np.full(len(rays), np.inf)
    for t in steps:
        at = eye + t * rays
        now = at[:, 1] < heights.height(at[:, 0], at[:, 2])
        depth[now & ~below] = t
        below |= now
    low, high = depth - 0.05, depth.copy()
    for _ in range(40):
        middle = np.where(below, 0.5 * (low + high), 1.0)
        at = eye + middle[:, None] * rays
        under = at[:, 1] < heights.height(at[:, 0], at[:, 2])
        low, high = np.where(under, low, middle), np.where(under, middle, high)
    return np.where(below, high, np.inf)


@pytest.mark.parametrize("stage", ["fragment", "compute"])
@pytest.mark.parametrize("technique", ["visibility-buffer", "bezier-blades"])
@pytest.mark.parametrize("fov_y_deg", [4.0, 110.0])
def test_depth_is_that_of_the_ground_through_any_lens(renderer, stage, technique, fov_y_deg):
    camera = {"position_m": [0.0, 7.0, 38.0], "target_m": [4.0, 0.0, -50.0], "fov_y_deg": fov_y_deg, "far_m": 150.0}
    scene = small_scene(grass=[], technique={"name": technique}, ground=GROUNDS["hills"], camera=camera)
    drawn = renderer(scene, stage=stage, size=(48, 27))
    depth = drawn.render(aovs=["depth"]).truth["depth"].ravel()
    eye = drawn._view.camera_ws
    rays = world_points(drawn, scene.camera, np.ones((27, 48))).reshape(-1, 3) - eye
    expected = _first_hit(HeightField.of(scene), eye, rays, 150.0)
    assert np.isfinite(expected).mean() > 0.3
    # at the edge of a ridge a ray meets it or what is behind it
    off = np.abs(np.where(np.isfinite(expected), depth, 0.0) - np.where(np.isfinite(expected), expected, 0.0))
    assert (np.isfinite(depth) != np.isfinite(expected)).mean() < 2e-3
    assert (off > 0.02).mean() < 4e-3


@pytest.mark.slow
@pytest.mark.parametrize("stage", ["fragment", "compute"])
@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
@pytest.mark.parametrize("ground", GROUNDS.values(), ids=GROUNDS)
def test_rays_meet_the_ground_where_it_first_is(renderer, camera, ground, stage):
    scene = small_scene(grass=[], technique=VISIBILITY_BUFFER, ground=ground, camera={**camera, "far_m": 300.0})
    drawn = renderer(scene, stage=stage)
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
def test_rays_of_both_stages_draw_the_same_picture(renderer):
    scene = small_scene(
        technique=VISIBILITY_BUFFER,
        ground=NOISE,
        object=[{"kind": "box", "position_m": [0.5, 0.0, -1.0], "size_m": [1.0, 1.2, 1.0]}],
        grass=[{"head": "daisy", "head_share": 0.3}],
    )
    frames = []
    for stage in ("fragment", "compute"):
        drawn = renderer(scene, stage=stage, size=(320, 180))
        drawn.render(0.9)
        frames.append(drawn.render(1.0, aovs=["class", "blade_id", "motion", "depth"]))
    fragment, compute = (frame.truth for frame in frames)
    assert (fragment["class"] == compute["class"]).mean() > 0.99
    assert (fragment["blade_id"] == compute["blade_id"]).mean() > 0.99
    for name in ("ground", "object", "flower", "grass"):
        assert (compute["class"] == SurfaceClass[name.upper()]).sum() > 50, name
    ground = (fragment["class"] == SurfaceClass.GROUND) & (compute["class"] == SurfaceClass.GROUND)
    assert np.abs(fragment["depth"][ground] / compute["depth"][ground] - 1.0).max() < 1e-4
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


def test_turf_differs_in_hue_from_place_to_place(renderer):
    """By a factor of noise on red, a tenth of it on green, and against it on blue."""
    scene = small_scene(
        sowing={"reach_m": 4.0, "full_density_m": 2.0, "density_per_m2": 200.0, "drift": 0.0},
        camera={"position_m": [0.0, 80.0, 0.0], "target_m": [0.0, 0.0, -0.001], "fov_y_deg": 60.0},
    )
    drawn = renderer(scene)
    truth = drawn.render(aovs=["albedo", "depth"]).truth
    albedo = truth["albedo"].astype(float)
    x, _, z = np.moveaxis(world_points(drawn, scene.camera, truth["depth"]), -1, 0)
    drift = octaves(0.31 * x / 12.0, 0.31 * z / 12.0, 5 + 6007, 3, 0.6, 2.7)
    away = np.hypot(x, z) > 8.0
    for channel, strength in ((0, 0.16), (2, -0.6 * 0.16)):
        ratio = albedo[..., channel] / albedo[..., 1]
        ratio /= np.median(ratio)
        expected = (1 + strength * drift) / (1 + 0.016 * drift)
        slope = np.polyfit((expected / np.median(expected))[away], ratio[away], 1)[0]
        assert slope == pytest.approx(1.0, abs=0.2), channel
