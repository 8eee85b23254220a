"""Geometry billboards: each formula against its twin, tiles and levels, textures, tubes, flat tiles, culling."""

import itertools

import moderngl
import numpy as np
import pytest

from greensward.culling import DRAW_COMMAND
from greensward.scene import InputError, SceneError, SurfaceClass
from greensward.scene.wind import Wind
from greensward.techniques import chosen
from greensward.techniques.geometry_billboards.pictures import leaf, lines, shares
from greensward.techniques.geometry_billboards.tiles import LEVELS, TILE, rings_of
from oracles import billboards
from reprojection import world_points
from shader_calls import shader_call
from small_scenes import BREEZE, DRONE, GRASS, NOISE, small_scene, with_pictures

_FOLDER = "techniques/geometry_billboards"
_GRASS = SurfaceClass.GRASS
_DOWN = {"position_m": [0.3, 4.0, 0.2], "target_m": [0.3, 0.0, 0.1], "fov_y_deg": 30.0}
_HIGH = {"position_m": [0.0, 3.0, 4.0], "target_m": [0.0, 0.0, -4.0]}


def _settings(settings=None):
    return {"name": "geometry-billboards", **(settings or {})}


def _scene(settings=None, **tables):
    return small_scene(technique=_settings(settings), **tables)


def _random(count=500):
    random = np.random.default_rng(24)
    points = {name: random.uniform(-2, 2, (count, 3)).astype(np.float32) for name in ("a", "b")}
    return points | {name: random.uniform(0, 1, count).astype(np.float32) for name in ("r", "s", "t", "q")}


def _double(inputs):
    return {name: values.astype(np.float64) for name, values in inputs.items()}


def _tiles(drawn):
    """Tiles of the last view by level, and the commands that draw them."""
    tiles = drawn._technique._tiles
    commands = np.frombuffer(tiles.commands.read(), DRAW_COMMAND.dtype)[:LEVELS]
    found = np.frombuffer(tiles.buffer.read(), TILE.dtype)
    ends = commands["first_instance"] + commands["instances"]
    return [found[a:b] for a, b in zip(commands["first_instance"], ends, strict=True)], commands


# Formulas ---------------------------------------------------------------------------------------------------


def _corners(exact, edge):
    heights = np.stack([exact[name] for name in "rstq"], 1)
    zero = np.zeros(len(heights))
    return [np.column_stack([zero + x, heights[:, i], zero + z]) for i, (x, z) in enumerate(edge)]


def test_planes_of_a_tile(device):
    given = _random()
    corners = _corners(_double(given), [(0, 0), (0, 0.5), (0.5, 0), (0.5, 0.5)])
    body = """
        vec4 first, second;
        planesOf(vec3(0, r, 0), vec3(0, s, 0.5), vec3(0.5, t, 0), vec3(0.5, q, 0.5), first, second);
        result = """
    for name, expected in zip(("first", "second"), billboards.planes(*corners), strict=True):
        got = shader_call(device, f"{_FOLDER}/tiles.glsl", f"{body}{name};", given, "vec4")
        assert np.allclose(got, expected, atol=1e-6)
        assert (got[:, 1] > 0).all(), "upwards"


def test_a_plane_goes_through_its_corners_and_tells_heights_between(device):
    exact = _double(_random())
    corners = _corners(exact, [(0, 0), (0, 1), (1, 0), (1, 1)])
    first, second = billboards.planes(*corners)
    for plane, own in ((first, corners[:3]), (second, corners[1:])):
        for corner in own:
            assert np.allclose(billboards.height_on(plane, corner[:, [0, 2]]), corner[:, 1])
    given = {"plane": first.astype(np.float32), "xz": np.random.default_rng(1).random((500, 2)).astype(np.float32)}
    got = shader_call(device, f"{_FOLDER}/tiles.glsl", "heightOn(plane, xz)", given, "float")
    assert np.allclose(got, billboards.height_on(*_double(given).values()), atol=1e-5)


def test_the_pattern_is_shifted_by_the_random_value_of_the_tile(device):
    given = _random()
    exact = _double(given)
    got = shader_call(device, f"{_FOLDER}/tiles.glsl", "shifted(vec2(r, s), t)", given, "vec2")
    expected = billboards.shifted(np.column_stack([exact["r"], exact["s"]]), exact["t"])
    apart = np.abs(got - expected)
    assert np.minimum(apart, 1.0 - apart).max() < 1e-6
    assert (got >= 0).all()
    assert (got <= 1).all()


def test_tiles_and_roots_have_random_values(device):
    tiles = np.stack(np.meshgrid(np.arange(-20, 20), np.arange(-20, 20)), -1).reshape(-1, 2).astype(np.int32)
    given = {"tile": tiles, "root": np.arange(len(tiles), dtype=np.uint32) % 10}
    path = f"{_FOLDER}/tiles.glsl"
    of_tile = shader_call(device, path, "randomOfTile(tile, 3u)", given, "float")
    of_root = shader_call(device, path, "unit(randomOfRoot(tile, root, 3u).x)", given, "float")
    for values in (of_tile, of_root):
        assert len(np.unique(values)) > 0.99 * len(values)
        assert np.histogram(values, 8, (0, 1))[0].min() > 0.08 * len(values)
    assert not np.array_equal(of_tile, shader_call(device, path, "randomOfTile(tile, 4u)", given, "float"))


def test_thresholds_pick_the_texture(device):
    given, exact = _random(), _double(_random())
    got = shader_call(device, f"{_FOLDER}/tiles.glsl", "textureOf(r, min(s, t), max(s, t))", given, "int")
    low, high = np.minimum(exact["s"], exact["t"]), np.maximum(exact["s"], exact["t"])
    assert np.array_equal(got, billboards.texture_of(exact["r"], low, high))
    assert set(got) == {0, 1, 2}


def test_bending(device):
    given, exact = _random(), _double(_random())
    path = f"{_FOLDER}/bend.glsl"
    got = shader_call(device, path, "bent(a, b.xz, r)", given, "vec3")
    assert np.allclose(got, billboards.bent(exact["a"], exact["b"][:, [0, 2]], exact["r"]), atol=1e-5)
    # its direction along the blade is the derivative
    step, tall = 1e-6, exact["s"][:, None] * [0.0, 1.0, 0.0]
    above, below = (
        billboards.bent(tall * (exact["r"] + d)[:, None], exact["b"][:, [0, 2]], exact["r"] + d)
        for d in (step, -step)
    )
    got = shader_call(device, path, "bentAlong(s, b.xz, r)", given, "vec3")
    assert np.allclose(got, (above - below) / (2 * step), atol=1e-4)


def test_tube(device):
    given = _random()
    given["b"] = np.cross(given["a"], given["b"])
    for name in ("a", "b"):
        given[name] /= np.linalg.norm(given[name], axis=1, keepdims=True)
    exact, path = _double(given), f"{_FOLDER}/bend.glsl"
    got = shader_call(device, path, "tubeOffset(r)", given, "float")
    assert np.allclose(got, billboards.tube_offset(exact["r"]), atol=2e-4)
    got = shader_call(device, path, "tubeNormal(a, b, r)", given, "vec3")
    assert np.allclose(got, billboards.tube_normal(exact["a"], exact["b"], exact["r"]), atol=2e-4)
    assert np.allclose(np.linalg.norm(got, axis=1), 1.0, atol=1e-4)


def test_the_right_vector_is_that_of_the_view(device, renderer):
    drawn = renderer(_scene())
    view_from_world, clip_from_view = drawn.camera_matrices()
    clip = (clip_from_view @ view_from_world).astype(np.float32)
    rows = {f"m{i}": clip[None, i] for i in range(4)}
    got = shader_call(device, f"{_FOLDER}/bend.glsl", "rightOf(transpose(mat4(m0, m1, m2, m3)))", rows, "vec3")
    assert np.allclose(got[0], view_from_world[0, :3], atol=1e-5)


# Tiles ------------------------------------------------------------------------------------------------------


def test_a_tile_is_as_large_as_the_density_wants_it(renderer):
    """Blades seen from above, on an area that is known."""
    for roots in (50, 100):
        drawn = renderer(_scene({"roots": roots, "levels_m": [9.0, 9.0, 9.0]}, camera=_DOWN), size=(320, 180))
        drawn.render()
        (near, *_), _ = _tiles(drawn)
        assert np.allclose(near["edge_m"], np.sqrt(roots / 60.0))


def test_planes_lie_on_the_ground(renderer):
    drawn = renderer(_scene({"levels_m": [4.0, 6.0, 8.0]}, ground=NOISE))
    drawn.render()
    levels, _ = _tiles(drawn)
    heights, origin = drawn._world.ground.heights, drawn._view.origin_ws
    for tiles in levels:
        assert len(tiles) > 5
        x, z = tiles["left_m"] + origin[0], tiles["near_m"] + origin[2]
        edge = tiles["edge_m"].astype(np.float64)
        assert np.allclose(x, tiles["x"] * edge, atol=1e-4)
        for name, places in (("first", ((0, 0), (0, 1), (1, 0))), ("second", ((0, 1), (1, 0), (1, 1)))):
            for u, v in places:
                on = billboards.height_on(tiles[name].astype(np.float64), np.column_stack([u * edge, v * edge]))
                assert np.allclose(on + origin[1], heights.height(x + u * edge, z + v * edge), atol=2e-3)


def test_ids_are_those_of_one_tile_each(renderer):
    roots = 40
    drawn = renderer(_scene({"roots": roots, "levels_m": [3.0, 5.0, 8.0]}))
    frame = drawn.render(aovs=["blade_id"])
    *blades, flat = _tiles(drawn)[0]
    first = np.concatenate([tiles["number"] for tiles in blades])
    taken = np.concatenate([(first[:, None] + np.arange(roots)).ravel(), flat["number"]]) + 1
    assert len(np.unique(taken)) == len(taken)
    shown = np.unique(frame.truth["blade_id"])
    assert len(shown) > 200
    ids = drawn._technique.identify(taken.astype(np.uint32))
    assert len(np.unique(ids)) == len(taken)
    assert np.isin(shown[1:], ids).all()


def test_the_same_tiles_stand_wherever_the_camera_comes_from(renderer):
    """Tiles are made and dropped around it, and the number at hand stays; each is the same again."""
    drawn = renderer(_scene())
    seen, considered = [], []
    for x in (0.0, 35.0, 0.4, 0.0):
        camera = drawn.scene.camera.model_copy(update={"position_m": (x, 1.3, 4.0), "target_m": (x, 0.3, -3.0)})
        frame = drawn.render(camera=camera, aovs=["class", "depth"])
        seen.append(frame.truth["depth"])
        considered.append(frame.counts.considered)
    assert len(set(considered)) == 1
    assert np.array_equal(seen[0], seen[3])
    assert (seen[0] != seen[1]).mean() > 0.2


def test_tiles_are_steady_far_from_the_origin(renderer):
    covers = []
    for x in (0.0, 40_000.0):
        drawn = renderer(
            _scene({"levels_m": [3.0, 5.0, 8.0]}, ground={"kind": "flat", "size_m": [90_000.0, 90_000.0]})
        )
        camera = drawn.scene.camera.model_copy(update={"position_m": (x, 1.3, 4.0), "target_m": (x, 0.3, -3.0)})
        drawn.render(0.0, camera=camera)
        frame = drawn.render(0.5, camera=camera, aovs=["class", "motion"])
        covers.append((frame.truth["class"] == _GRASS).mean())
        assert np.abs(frame.truth["motion"]).max() < 0.05
    assert covers[0] == pytest.approx(covers[1], rel=0.05)


def test_nothing_grows_beyond_the_reach(renderer):
    for settings in ({"levels_m": [3.0, 5.0, 8.0]}, {}):
        frame = renderer(_scene(settings, camera=_HIGH)).render(aovs=["class", "depth"])
        grass = frame.truth["class"] == _GRASS
        assert 10.0 < frame.truth["depth"][grass].max() < 12.0


def test_flat_cells_grow_with_distance_and_not_in_number(renderer):
    """Twice the reach takes one more ring, each about as large as the one before."""
    counts = []
    for reach_m in (100.0, 200.0, 400.0, 800.0):
        scene = _scene(sowing={"density_per_m2": 900.0, "reach_m": reach_m})
        rings = rings_of(scene, chosen(scene)[1])
        assert all(b.edge_m == 2 * a.edge_m for a, b in itertools.pairwise(rings[1:]))
        assert all(b.from_m <= a.to_m for a, b in itertools.pairwise(rings))
        assert rings[-1].to_m == reach_m
        counts.append(sum(ring.patches**2 for ring in rings))
    assert max(np.diff(counts)) < 1.3 * min(np.diff(counts))


def test_maps_say_where_roots_bear_blades(renderer, tmp_path):
    half = np.zeros((8, 8, 3), np.uint8)
    half[:, :4] = 255
    for levels_m in ([9.0, 9.0, 9.0], [0.0, 0.0, 0.0]):
        scene = with_pictures(
            tmp_path,
            {"half.png": half},
            technique=_settings({"levels_m": levels_m}),
            sowing={"density_map": "half.png"},
            ground={"size_m": [40.0, 40.0]},
            camera={"position_m": [0.0, 4.0, 6.0], "target_m": [0.0, 0.0, 0.0]},
        )
        grass = renderer(scene).render(aovs=["class"]).truth["class"] == _GRASS
        assert grass[:, :70].mean() > 0.1
        assert grass[:, 95:].mean() < 0.1 * grass[:, :70].mean()


def test_no_blade_grows_on_slopes_that_are_too_steep(renderer):
    ground = {**NOISE, "height_m": 20.0}
    covers = [
        (
            renderer(_scene(ground=ground, sowing={"max_slope_deg": most})).render(aovs=["class"]).truth["class"]
            == _GRASS
        )
        for most in (80.0, 2.0)
    ]
    assert covers[1].mean() < 0.4 * covers[0].mean()


def test_grass_grows_up(renderer):
    covers = []
    for time_s in (0.0, 30.0, 90.0):
        frame = renderer(_scene(growth={"time_s": 60.0})).render(time_s, aovs=["class"])
        covers.append((frame.truth["class"] == _GRASS).mean())
    assert covers[0] < 0.3 * covers[2]
    assert covers[0] < covers[1] < covers[2]


# Levels -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("level", "levels_m", "blades", "segments"),
    [(0, [9.0, 9.0, 9.0], 100, 5), (1, [0.0, 9.0, 9.0], 95, 3), (2, [0.0, 0.0, 9.0], 85, 1)],
)
def test_a_level_has_its_blades_and_segments(device, renderer, level, levels_m, blades, segments):
    """Counted by the driver: all that is in view is nearer than the level ends, and every root bears a blade."""
    drawn = renderer(_scene({"levels_m": levels_m, "fade": 0.0}, camera=_DOWN))
    drawn.render()
    levels, commands = _tiles(drawn)
    assert [len(tiles) > 0 for tiles in levels] == [i == level for i in range(LEVELS)]
    assert commands["vertices"][level] == blades
    with device.use():
        query = device.ctx.query(primitives=True)
        with query:
            drawn._technique.draw(drawn._view)
        assert query.primitives == len(levels[level]) * blades * segments * 2


def test_levels_lie_at_their_distances(renderer):
    drawn = renderer(_scene({"levels_m": [3.0, 5.0, 8.0], "fade": 0.3}, camera=_HIGH))
    drawn.render()
    levels, commands = _tiles(drawn)
    assert list(commands["vertices"]) == [100, 95, 85, 4]
    eye = drawn._view.camera_ws - drawn._view.origin_ws
    for tiles, (near, far) in zip(levels, ((0, 3), (3, 5), (5, 8), (0.7 * 8, 12)), strict=True):
        x, z, edge = (tiles[name].astype(np.float64) for name in ("left_m", "near_m", "edge_m"))
        away = np.sqrt((x + edge / 2 - eye[0]) ** 2 + (z + edge / 2 - eye[2]) ** 2 + drawn._view.camera_ws[1] ** 2)
        assert (away > near - 0.75 * edge).all()
        assert (away < far + 0.75 * edge).all()
    assert len(levels[3]) > 10


def test_blades_are_scaled_to_the_roots(renderer):
    drawn = renderer(_scene({"roots": 40, "blades": [100, 50, 10], "levels_m": [3.0, 5.0, 8.0]}))
    drawn.render()
    assert list(_tiles(drawn)[1]["vertices"][:3]) == [40, 20, 4]


def test_blades_shrink_into_the_flat_tiles(renderer):
    tall = []
    for fade in (0.0, 1.0):
        drawn = renderer(_scene({"levels_m": [2.0, 4.0, 8.0], "fade": fade}, camera=_HIGH))
        truth = drawn.render(aovs=["class", "depth"]).truth
        points = world_points(drawn, drawn.scene.camera, truth["depth"])
        away = np.linalg.norm(points - drawn._view.camera_ws, axis=2)
        there = (truth["class"] == _GRASS) & (away > 6.0) & (away < 7.0)
        tall.append(points[there][:, 1].max())
    assert tall[0] > 0.3
    assert tall[1] < 0.5 * tall[0]


def test_without_the_test_of_distance_all_tiles_have_all_blades(renderer):
    drawn = renderer(_scene({"levels_m": [3.0, 5.0, 8.0]}, culling={"distance": False}))
    drawn.render()
    levels, _ = _tiles(drawn)
    assert [len(tiles) > 0 for tiles in levels] == [True, False, False, False]


# Textures ---------------------------------------------------------------------------------------------------


def _pure(channel):
    picture = np.zeros((8, 8, 3), np.uint8)
    picture[..., channel] = 255
    return picture


_PURE = {"red.png": _pure(0), "green.png": _pure(1), "blue.png": _pure(2)}
_NAMED = {"first_texture": "red.png", "second_texture": "green.png", "third_texture": "blue.png"}


@pytest.mark.parametrize("thresholds", [(0.2, 0.85), (0.0, 0.5), (0.6, 0.6), (0.9, 0.1)])
def test_colours_by_thresholds(renderer, tmp_path, thresholds):
    alpha, beta = thresholds
    technique = _settings({**_NAMED, "alpha": alpha, "beta": beta})
    scene = with_pictures(tmp_path, _PURE, technique=technique, sowing={"density_per_m2": 30.0})
    truth = renderer(scene, size=(320, 180)).render(aovs=["class", "albedo", "blade_id"]).truth
    _, at = np.unique(truth["blade_id"].ravel(), return_index=True)
    colours = truth["albedo"].reshape(-1, 3)[at[1:]]
    assert len(colours) > 1000
    share = [(colours[:, i] > 0.9).mean() for i in range(3)]
    assert sum(share) == pytest.approx(1.0)
    expected = [alpha, max(beta - alpha, 0.0), 1.0 - max(alpha, beta)]
    assert np.allclose(share, expected, atol=0.04)


def test_generated_colours_are_those_of_the_species(renderer):
    """Black roots and red tips, and blue where the third kind is dry."""
    grass = {
        **GRASS,
        "root_colour": "#000000",
        "tip_colour": "#ff0000",
        "dry_colour": "#0000ff",
        "dryness": [0.0, 0.0],
    }
    for alpha, beta, dry in ((0.999, 0.0, False), (0.0, 0.999, False), (0.0, 0.0, True)):
        truth = renderer(_scene({"alpha": alpha, "beta": beta}, grass=[grass])).render(aovs=["class", "albedo"]).truth
        albedo = truth["albedo"][truth["class"] == _GRASS]
        assert albedo[:, 0].max() > 0.3
        assert (albedo[:, 1] < 1e-3).all()
        assert ((albedo[:, 2] > 0.1).mean() > 0.2) == dry


def test_pictures_are_as_they_are_described():
    alpha = leaf(64, 256)
    assert alpha.shape == (256, 64)
    assert (alpha[:, 32] == 1.0).mean() > 0.95, "the middle is there from the root nearly to the tip"
    widths = alpha.sum(axis=1)
    assert widths[0] < 2 < widths[128]
    made = shares(16, 64) ** 2
    assert (made.sum(axis=-1) <= 1.0 + 1e-9).all()
    assert made[0, :, :, 1].mean() > made[1, :, :, 1].mean() > made[2, :, :, 1].mean()
    assert (made[:2, ..., 2] == 0).all()
    tile = lines(64, 5)
    assert np.allclose(tile.mean(axis=(0, 1)), 1.0)
    assert tile.std() > 0.2
    assert not np.array_equal(tile, lines(64, 6))


def test_an_alpha_texture_outlines_every_blade(renderer, tmp_path):
    full, half = (np.full((16, 16, 4), 255, np.uint8) for _ in range(2))
    half[:, 8:, 3] = 0
    cover = {}
    near = {"position_m": [0.0, 0.5, 2.0], "target_m": [0.0, 0.25, -3.0]}
    for name, picture in (("full", full), ("half", half)):
        scene = with_pictures(
            tmp_path,
            {f"{name}.png": picture},
            technique=_settings({"alpha_texture": f"{name}.png"}),
            grass=[{**GRASS, "width_m": [0.05, 0.05]}],
            sowing={"density_per_m2": 12.0, "reach_m": 6.0},
            camera=near,
        )
        cover[name] = (renderer(scene).render(aovs=["class"]).truth["class"] == _GRASS).mean()
    assert cover["full"] > 0.01
    assert 0.35 * cover["full"] < cover["half"] < 0.7 * cover["full"]


def test_what_is_less_opaque_than_asked_is_discarded(renderer, tmp_path):
    grey = np.full((8, 8, 4), 255, np.uint8)
    grey[..., 3] = 128
    cover = {}
    for opacity in (0.4, 0.5):
        technique = _settings({"alpha_texture": "grey.png", "opacity": opacity})
        scene = with_pictures(tmp_path, {"grey.png": grey}, technique=technique)
        cover[opacity] = (renderer(scene).render(aovs=["class"]).truth["class"] == _GRASS).mean()
    assert cover[0.4] == cover[0.5] > 0.2
    scene = with_pictures(tmp_path, {"grey.png": grey}, technique=_settings({"alpha_texture": "grey.png"}))
    with pytest.raises(InputError, match=r"technique\.alpha_texture: .*grey\.png: must reach technique\.opacity"):
        renderer(scene)


def test_beyond_the_last_level_tiles_are_flat_and_textured(renderer, tmp_path):
    technique = _settings(
        {"tile_texture": "blue.png", **_NAMED, "third_texture": "red.png", "levels_m": [2.0, 3.0, 6.0]}
    )
    scene = with_pictures(tmp_path, _PURE, technique=technique, camera=_HIGH)
    drawn = renderer(scene, size=(320, 180))
    truth = drawn.render(aovs=["class", "albedo", "depth", "blade_id"]).truth
    grass, points = truth["class"] == _GRASS, world_points(drawn, scene.camera, truth["depth"])
    away = np.linalg.norm(points - drawn._view.camera_ws, axis=2)
    flat = grass & (away > 6.5)
    assert flat.sum() > 2000
    assert (truth["albedo"][flat] == [0, 0, 1]).all()
    assert np.abs(points[flat][:, 1]).max() < 0.01, "on the ground"
    near = grass & (away < 0.6 * 6.0)
    assert (truth["albedo"][near][:, 2] == 0).all()
    # a quad is one thing, and has one id
    ids = truth["blade_id"][flat]
    assert 20 < len(np.unique(ids)) < 0.1 * len(ids)


def test_flat_tiles_are_coloured_like_the_blades_before_them(renderer):
    """All flat, and all blades: the same cover and about the same colour from a distance."""
    camera = {"position_m": [0.0, 1.6, 6.0], "target_m": [0.0, 0.9, -6.0]}
    sowing = {"density_per_m2": 300.0, "reach_m": 40.0}
    seen = []
    for levels_m in ([40.0, 40.0, 40.0], [0.0, 0.0, 0.0]):
        frame = renderer(_scene({"levels_m": levels_m}, camera=camera, sowing=sowing)).render(aovs=["class", "depth"])
        far = (frame.truth["class"] == _GRASS) & (frame.truth["depth"] > 15.0) & (frame.truth["depth"] < 28.0)
        seen.append(frame.image[far].mean(axis=0))
    assert np.abs(seen[0] - seen[1]).max() < 25


# Winds, tubes, culling, limits ------------------------------------------------------------------------------


def _kinds():
    (union, *_) = Wind.__args__ if hasattr(Wind, "__args__") else (Wind,)
    models = getattr(union, "__args__", (union,)) if not isinstance(union, type) else Wind.__args__
    return [model.model_fields["kind"].default for model in models]


_MORE = {
    "wake": {"by": "objects", "downwash_mps2": 100.0},
    "helicopter": {"centre_m": [0.0, 0.0]},
    "blast": {"power_mps": 12.0},
    "whirl": {"power_mps": 8.0},
}


@pytest.mark.parametrize("kind", [kind for kind in _kinds() if kind != "texture"])
def test_every_wind_bends_it(renderer, kind):
    still, blown = (
        renderer(_scene(wind=wind, object=[DRONE])).render(1.3, aovs=["depth"]).truth["depth"]
        for wind in ([], [{"kind": kind, **_MORE.get(kind, {})}])
    )
    assert (still != blown).mean() > 0.02


def test_a_wind_bends_all_blades_its_way(renderer):
    """From above, from the west: grass covers ground to the east of where it stood in still air."""
    west = {"kind": "gusts", "direction_deg": 270.0, "speed_mps": 14.0, "gustiness": 0.0, "turbulence": 0.0}
    camera = {"position_m": [0.0, 8.0, 0.01], "target_m": [0.0, 0.0, 0.0], "fov_y_deg": 60.0}
    grass = [{**GRASS, "height_m": [0.6, 0.6], "tilt_deg": [0.0, 0.0], "stiffness": [0.1, 0.1]}]
    middle = []
    for wind in ([], [west]):
        drawn = renderer(_scene(wind=wind, grass=grass, camera=camera, sowing={"reach_m": 9.0}), size=(320, 320))
        truth = drawn.render(1.0, aovs=["depth", "blade_id"]).truth
        rows, columns = np.nonzero(truth["blade_id"])
        x = world_points(drawn, drawn.scene.camera, truth["depth"])[rows, columns, 0]
        ids = truth["blade_id"][rows, columns]
        middle.append({i: x[ids == i].mean() for i in np.unique(ids)[:300]})
    moved = [middle[1][i] - middle[0][i] for i in middle[0].keys() & middle[1].keys()]
    assert len(moved) > 100
    assert np.mean(np.array(moved) > 0.02) > 0.9


def test_what_presses_it_down_lowers_it(renderer):
    track = {"kind": "tracks", "path": [[0.0, 3.0], [0.0, -3.0]], "gauge_m": 0.0, "tyre_m": 1.5}
    tops = []
    for force in ([], [track]):
        drawn = renderer(_scene(force=force, camera=_HIGH))
        truth = drawn.render(aovs=["class", "depth"]).truth
        points = world_points(drawn, drawn.scene.camera, truth["depth"])
        there = (truth["class"] == _GRASS) & (np.abs(points[..., 0]) < 0.5) & (np.abs(points[..., 2]) < 2.0)
        tops.append(points[there][:, 1].mean())
    assert tops[1] < 0.5 * tops[0]


def test_lean(renderer):
    """Without lean and wind blades stand upright."""
    grass = [{**GRASS, "tilt_deg": [50.0, 60.0], "height_m": [0.5, 0.5]}]
    tops = []
    for lean in (0.0, 1.0):
        drawn = renderer(_scene({"lean": lean}, grass=grass))
        truth = drawn.render(aovs=["class", "depth"]).truth
        points = world_points(drawn, drawn.scene.camera, truth["depth"])
        tops.append(points[truth["class"] == _GRASS][:, 1].max())
    assert tops[0] == pytest.approx(0.5, abs=0.03)
    assert tops[1] < 0.4


def test_a_tube_stands_out_towards_the_viewer(renderer):
    near = {"position_m": [0.0, 0.4, 1.2], "target_m": [0.0, 0.3, -3.0]}
    grass = [{**GRASS, "width_m": [0.06, 0.06], "tilt_deg": [0.0, 0.0]}]
    truths = [
        renderer(_scene({"tube": tube, "lean": 0.0}, grass=grass, camera=near, sowing={"density_per_m2": 6.0}))
        .render(aovs=["class", "depth", "normal", "blade_id"])
        .truth
        for tube in (False, True)
    ]
    same = (truths[0]["blade_id"] == truths[1]["blade_id"]) & (truths[0]["class"] == _GRASS)
    same &= truths[0]["depth"] < 2.5  # where none is widened
    out = (truths[0]["depth"] - truths[1]["depth"])[same]
    assert same.sum() > 300
    assert out.min() > -1e-4
    assert 0.02 < out.max() < 0.0301, "the radius"
    assert out.min() < 0.015
    across = truths[1]["normal"][same][:, 0]
    assert across.min() < -0.5
    assert across.max() > 0.5


def test_a_tube_hides_what_lies_within_it(renderer):
    """Depth in the buffer is that of the tube: a ball a little behind the billboards shows less of itself."""
    near = {"position_m": [0.0, 0.4, 1.6], "target_m": [0.0, 0.3, -3.0]}
    grass = [{**GRASS, "width_m": [0.2, 0.2], "tilt_deg": [0.0, 0.0], "height_m": [0.6, 0.6]}]
    wall = {"kind": "box", "position_m": [0.0, 0.0, -0.6], "size_m": [6.0, 0.5, 0.001]}
    shown = []
    for tube in (False, True):
        scene = _scene(
            {"tube": tube, "lean": 0.0}, grass=grass, camera=near, object=[wall], sowing={"density_per_m2": 8.0}
        )
        truth = renderer(scene).render(aovs=["class"]).truth
        shown.append((truth["class"] == SurfaceClass.OBJECT).sum())
    assert 0 < shown[1] < shown[0]


_CAMERAS = (
    {},
    _HIGH,
    {"position_m": [3.0, 0.3, 0.0], "target_m": [3.1, 0.5, 5.0], "fov_y_deg": 20.0},
    {"position_m": [-2.0, 2.0, 1.0], "target_m": [-2.0, 0.0, 0.9], "fov_y_deg": 100.0},
)


@pytest.mark.parametrize("camera", _CAMERAS)
def test_culling_of_tiles_drops_none_that_shows(renderer, camera):
    """Broad and tall blades, bent by a gale, on hills."""
    gale = {**BREEZE, "speed_mps": 25.0}
    grass = [{**GRASS, "width_m": [0.1, 0.2], "height_m": [0.4, 0.9]}]
    frames = []
    for flag in (True, False):
        drawn = renderer(
            _scene(
                {"levels_m": [3.0, 5.0, 8.0]},
                ground=NOISE,
                wind=[gale],
                grass=grass,
                camera=camera,
                culling={"frustum": flag},
            )
        )
        frames.append(drawn.render(1.0, aovs=["class", "blade_id", "depth"]))
        drawn.release()
    on, off = frames
    for name in ("class", "blade_id", "depth"):
        assert np.array_equal(on.truth[name], off.truth[name]), name
    assert on.counts.drawn < off.counts.drawn


def test_no_stage_but_compute_reads_storage(renderer):
    """OpenGL 4.3 promises none to vertex and geometry shaders."""
    technique = renderer(_scene({"tube": True}, wind=[BREEZE]))._technique
    for draw in (*technique._blades.values(), technique._flat):
        assert set(draw._program.storage_blocks) == {0}
        assert not any(isinstance(each, moderngl.StorageBlock) for each in draw._program.members.values())


def test_what_it_cannot_draw_is_refused(renderer):
    with pytest.raises(SceneError, match=r"technique\.levels_m: must not fall from one level to the next"):
        renderer(_scene({"levels_m": [5.0, 3.0, 8.0]}))
    sowing = {"density_per_m2": 50_000.0, "reach_m": 500.0}
    with pytest.raises(InputError, match=r"technique\.levels_m: must leave at most .* lower it or sowing"):
        renderer(_scene({"levels_m": [100.0, 200.0, 300.0]}, sowing=sowing))
