"""What the passes make of a scene, measured in pictures and ground truth."""

import numpy as np
import pytest

from greensward.ground.noise import octaves
from greensward.scene import SurfaceClass
from oracles import terrain, tone
from reprojection import world_points
from small_scenes import BREEZE, GRASS, NOISE, small_scene, with_pictures

_DOWN = {"position_m": [0.0, 3.0, 0.0], "target_m": [0.0, 0.0, -0.001]}


def _flat(colour: tuple[int, ...]) -> np.ndarray:
    return np.full((8, 8, len(colour)), colour, np.uint8)


@pytest.mark.parametrize("alpha", [0, 102, 255])
def test_terrain_map_over_soil_by_its_alpha(renderer, tmp_path, alpha):
    """Equation 1 of Jahrmann & Wimmer 2013."""
    soil, map_colour = (150, 90, 40), (40, 160, 70)
    scene = with_pictures(
        tmp_path,
        {"soil.png": _flat(soil), "map.png": _flat((*map_colour, alpha))},
        ground={"texture": "soil.png", "terrain_map": "map.png"},
        grass=[],
        camera=_DOWN,
    )
    drawn = renderer(scene)
    albedo = drawn.render(aovs=["albedo"]).truth["albedo"]
    plain = terrain.ground_colour(
        tone.linear(np.array(soil) / 255), tone.linear(np.array(map_colour) / 255), np.array(alpha / 255)
    )
    # eight bits of a square root; pictures show as they are
    assert np.abs(albedo - plain).max() < 0.01


def test_soil_without_a_picture_drifts_in_shade(renderer):
    """By a factor of noise, over what its texture varies."""
    scene = small_scene(grass=[], camera={**_DOWN, "position_m": [0.0, 40.0, 0.0]})
    drawn = renderer(scene)
    truth = drawn.render(aovs=["albedo", "depth"]).truth
    albedo = truth["albedo"]
    x, _, z = np.moveaxis(world_points(drawn, scene.camera, truth["depth"]), -1, 0)
    drift = 0.25 * octaves(1.7 * x / 12.0, 1.7 * z / 12.0, 5 + 5003, 3, 0.6, 2.7)
    assert np.corrcoef(drift.ravel(), albedo.mean(-1).ravel())[0, 1] > 0.5


@pytest.mark.parametrize("alpha", [0, 128])
def test_tiles_of_the_ground_have_soils_of_their_own(renderer, tmp_path, alpha):
    """The terrain map lies over them as well (equation 1); of two that overlap the later counts."""
    colours = {"soil.png": (150, 90, 40), "east.png": (200, 40, 40), "corner.png": (40, 40, 200)}
    tiles = [
        {"from_m": [0.0, -9.0], "to_m": [9.0, 9.0], "texture": "east.png"},
        {"from_m": [0.0, -9.0], "to_m": [9.0, 0.0], "texture": "corner.png", "texture_m": 0.5},
    ]
    pictures = {name: _flat(colour) for name, colour in colours.items()}
    pictures["corner.png"] = np.full((16, 4, 3), colours["corner.png"], np.uint8)
    pictures["map.png"] = _flat((90, 90, 90, alpha))
    scene = with_pictures(
        tmp_path,
        pictures,
        ground={"texture": "soil.png", "tile": tiles, "terrain_map": "map.png"},
        grass=[],
        camera=_DOWN,
    )
    albedo = renderer(scene).render(aovs=["albedo"]).truth["albedo"]
    height, width = albedo.shape[:2]
    over = tone.linear(np.array((90, 90, 90)) / 255)
    for (rows, columns), name in (
        ((slice(0, height), slice(0, width // 2 - 3)), "soil.png"),
        ((slice(0, height // 2 - 3), slice(width // 2 + 3, width)), "corner.png"),
        ((slice(height // 2 + 3, height), slice(width // 2 + 3, width)), "east.png"),
    ):
        plain = terrain.ground_colour(tone.linear(np.array(colours[name]) / 255), over, np.array(alpha / 255))
        mean = albedo[rows, columns].reshape(-1, 3).mean(axis=0)
        assert np.allclose(mean / mean.sum(), plain / plain.sum(), atol=0.02), name


def test_maps_lie_the_right_way_up(renderer, tmp_path):
    """Row 0 is the north, column 0 the west; seen from above with north at the top."""
    quarters = np.zeros((2, 2, 4), np.uint8)
    quarters[0, 0], quarters[0, 1], quarters[1, 0], quarters[1, 1] = (
        (255, 0, 0, 255), (0, 255, 0, 255), (0, 0, 255, 255), (255, 255, 255, 255),
    )  # fmt: skip
    large = np.kron(quarters, np.ones((32, 32, 1), np.uint8))
    scene = with_pictures(
        tmp_path,
        {"map.png": large},
        ground={"terrain_map": "map.png", "size_m": [4.0, 4.0]},
        grass=[],
        camera={"position_m": [0.0, 4.0, 0.0], "target_m": [0.0, 0.0, -0.001]},
    )
    albedo = renderer(scene, size=(90, 90)).render(aovs=["albedo"]).truth["albedo"]
    bright = albedo[[30, 30, 60, 60], [30, 60, 30, 60]] > 0.3
    assert bright.tolist() == [[True, False, False], [False, True, False], [False, False, True], [True, True, True]]


def test_vegetation_map_colours_the_grass(renderer, tmp_path):
    scene = with_pictures(tmp_path, {"v.png": _flat((200, 20, 20, 255))}, sowing={"vegetation_map": "v.png"})
    truth = renderer(scene).render(aovs=["albedo", "class"]).truth
    red, green, blue = truth["albedo"][truth["class"] == SurfaceClass.GRASS].mean(axis=0)
    assert red > 5 * max(green, blue)


def test_ids_grow_only_where_the_density_map_lets_them(renderer, tmp_path):
    pixels = np.zeros((64, 64, 3), np.uint8)
    pixels[:, 32:, 0] = 255
    pixels[..., 2] = 255
    scene = with_pictures(
        tmp_path,
        {"d.png": pixels},
        ground={"size_m": [24.0, 24.0]},
        sowing={"density_map": "d.png"},
        grass=[{**GRASS, "tilt_deg": [0.0, 5.0], "bend": [0.0, 0.1]}],
    )
    truth = renderer(scene).render(aovs=["blade_id", "class"]).truth
    seen = (truth["blade_id"] > 0).sum(axis=0)
    assert seen[:70].sum() == 0
    assert seen[90:].sum() > 500


def test_srgb_of_a_linear_picture(renderer):
    """Sun and sky on bare soil with the straight tone curve: brightness doubles by the stop."""
    means = []
    for stops in (-2.0, -1.0):
        scene = small_scene(
            grass=[], camera=_DOWN, post={"tone_map": "linear", "exposure_ev": stops, "vignette": 0.0}
        )
        means.append(tone.linear(renderer(scene).render().image / 255.0).mean())
    assert means[1] / means[0] == pytest.approx(2.0, rel=0.03)


@pytest.mark.parametrize(("post", "check"), [
    ({"saturation": 0.0}, lambda image, _: np.abs(np.diff(image.astype(int), axis=2)).max() <= 2),
    ({"exposure_ev": 2.0}, lambda image, usual: image.mean() > usual.mean() + 20),
    ({"vignette": 1.0}, lambda image, usual: image[0, 0].mean() < usual[0, 0].mean() - 20),
    ({"tone_map": "linear"}, lambda image, usual: not np.array_equal(image, usual)),
])  # fmt: skip
def test_post(renderer, post, check):
    usual = renderer(small_scene(post={"vignette": 0.0})).render().image
    assert check(renderer(small_scene(post={"vignette": 0.0, **post})).render().image, usual)


@pytest.mark.slow
@pytest.mark.parametrize("table", [
    {"sun": {"azimuth_deg": 300.0}}, {"sun": {"elevation_deg": 60.0}}, {"sun": {"strength": 3.0}},
    {"sky": {"haze": 8.0}}, {"sky": {"clouds": 0.8}}, {"sky": {"strength": 3.0}}, {"shadows": {"enabled": False}},
    {"object": [{"kind": "box", "position_m": [0, 0, 0]}]}, {"seed": 6}, {"wind": [BREEZE]}, {"ground": NOISE},
])  # fmt: skip
def test_every_part_of_the_scene_shows(renderer, table):
    scene = {"camera": {"target_m": [0.0, 1.0, -3.0]}}
    assert not np.array_equal(
        renderer(small_scene(**scene)).render(1.0).image, renderer(small_scene(**scene, **table)).render(1.0).image
    )


@pytest.mark.slow
@pytest.mark.parametrize("elevation_deg", [-10.0, 0.0, 0.1, 3.0, 89.99, 90.0])
@pytest.mark.parametrize("haze", [0.0, 1.0, 50.0])
def test_any_sun_and_air_give_a_picture(renderer, elevation_deg, haze):
    scene = small_scene(
        sun={"elevation_deg": elevation_deg}, sky={"haze": haze, "clouds": 0.5}, camera={"target_m": [0.0, 1.3, -3.0]}
    )
    image = renderer(scene, size=(80, 45)).render().image
    assert 3 < image.mean() < 252
    assert image.std() > 2


def test_a_box_casts_its_shadow_away_from_the_sun(renderer):
    """From above; the sun in the east, so the shade lies to the west, as long as the height over the tangent."""
    tables = {
        "grass": [],
        "sun": {"azimuth_deg": 90.0, "elevation_deg": 45.0},
        "camera": {"position_m": [0.0, 6.0, 0.0], "target_m": [0.0, 0.0, -0.001]},
        "shadows": {"size_px": 512, "cascades": 2, "nearest_m": 4.0, "furthest_m": 20.0},
    }
    box = {"kind": "box", "position_m": [0.0, 0.0, 0.0], "size_m": [0.5, 1.0, 0.5]}
    lit = renderer(small_scene(**tables), size=(180, 120)).render().image.astype(int).sum(axis=2)
    frame = renderer(small_scene(**tables, object=[box]), size=(180, 120)).render(aovs=["class"])
    dark = (lit - frame.image.astype(int).sum(axis=2) > 60) & (frame.truth["class"] == SurfaceClass.GROUND)
    rows, columns = np.nonzero(dark)
    metre = 120 / (2 * 6.0 * np.tan(np.radians(25)))
    x, z = (columns + 0.5 - 90) / metre, (rows + 0.5 - 60) / metre
    assert x.min() == pytest.approx(-1.25, abs=0.12)
    assert x.max() < -0.15
    assert np.abs(z).max() == pytest.approx(0.25, abs=0.12)


@pytest.mark.parametrize("kind", ["box", "sphere", "cylinder"])
def test_solids_are_where_and_as_large_as_asked(renderer, kind):
    scene = small_scene(
        grass=[],
        object=[{"kind": kind, "position_m": [1.0, 0.0, 0.5], "size_m": [1.0, 1.0, 1.0]}],
        camera={"position_m": [0.0, 30.0, 0.0], "target_m": [0.0, 0.0, -0.001], "fov_y_deg": 8.0},
    )
    truth = renderer(scene, size=(200, 200)).render(aovs=["class", "depth"]).truth
    rows, columns = np.nonzero(truth["class"] == SurfaceClass.OBJECT)
    metre = 200 / (2 * 29.5 * np.tan(np.radians(4)))
    x, z = (columns + 0.5 - 100) / metre, (rows + 0.5 - 100) / metre
    assert x.mean() == pytest.approx(1.0, abs=0.05)
    assert z.mean() == pytest.approx(0.5, abs=0.05)
    area = {"box": 1.0, "sphere": np.pi / 4, "cylinder": np.pi / 4}[kind]
    assert len(rows) / metre**2 == pytest.approx(area, rel=0.06)
    assert truth["depth"][rows, columns].min() == pytest.approx(29.0, abs=0.02)
