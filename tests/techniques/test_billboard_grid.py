"""The grid of billboards: what a ray meets in it, how its textures are grown, and what is refused."""

import numpy as np
import pytest
from PIL import Image

from greensward.gpu.view import VIEW_BLOCK
from greensward.ground import HeightField
from greensward.ground.noise import simplex
from greensward.scene import Camera, InputError, Scene, SurfaceClass
from greensward.scene.base import linear
from greensward.sowing.identity import BladeKind, blade_ids
from greensward.techniques.billboard_grid.pictures import Billboards, mean_length_m
from greensward.techniques.billboard_grid.settings import GridSettings
from oracles import billboard_grid
from oracles import wind as oracle_wind
from reprojection import world_points
from shader_calls import shader_call
from small_scenes import BREEZE, GRASS, NOISE, small_scene, with_pictures

GRASS_CLASS = SurfaceClass.GRASS
STIFF = {**GRASS, "height_m": [0.4, 0.4], "tilt_deg": [0.0, 0.0], "bend": [0.0, 0.0]}


def _scene(settings=None, **tables):
    return small_scene(technique={"name": "billboard-grid", **(settings or {})}, **tables)


def _cover(frame) -> float:
    return float((frame.truth["class"] == GRASS_CLASS).mean())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("turn_deg", "irregularity", "stage"),
    [(0.0, 0.0, "fragment"), (33.0, 0.8, "fragment"), (33.0, 0.0, "compute"), (0.0, 0.8, "compute")],
)
def test_a_ray_ends_at_the_first_billboard_that_it_meets(renderer, tmp_path, turn_deg, irregularity, stage):
    """Billboards opaque but for their upper edge: the depth of every pixel is that of the twin."""
    wall = np.full((64, 64, 4), 255, np.uint8)
    wall[:2, :, 3] = 0
    settings = {"turn_deg": turn_deg, "irregularity": irregularity, "spacing": 0.5}
    settings |= {"side_texture": "wall.png", "middle_plane": False}
    scene = with_pictures(
        tmp_path,
        {"wall.png": wall},
        grass=[STIFF],
        technique={"name": "billboard-grid", "steps": 64, **settings},
        camera={"position_m": [0.3, 1.1, 2.0], "target_m": [-0.4, 0.1, -1.0]},
    )
    drawn = renderer(scene, stage=stage)
    truth = drawn.render(aovs=["depth", "class"]).truth
    far = world_points(drawn, scene.camera, np.full(truth["depth"].shape, 50.0)).reshape(-1, 3)
    eye = drawn._view.camera_ws
    tall_m, spacing_m = drawn._technique._billboards.tall_m, drawn._technique._spacing_m
    share, at_m = billboard_grid.first_met(
        eye, far - eye, spacing_m, np.radians(turn_deg), irregularity, tall_m, scene.seed
    )
    grass = truth["class"].ravel() == GRASS_CLASS
    # where the threshold lies within the soft upper edge, or between the posts of a corner, is left to the texture
    sure = grass & (at_m < 0.9 * tall_m) & (at_m > 0.02 * tall_m)
    assert sure.mean() > 0.3
    away = np.abs(truth["depth"].ravel()[sure] - 50.0 * share[sure])
    assert np.quantile(away, 0.98) < 2e-3
    assert (away < 2e-3).mean() > 0.97


def test_billboards_show_the_blades_that_a_slab_holds(device):
    scene = _scene(grass=[STIFF])
    settings = GridSettings(layers=6, texture_px=512)
    billboards = Billboards(device, scene, settings)
    slab_m = 0.25 * np.pi * settings.spacing * mean_length_m(scene)
    assert billboards.tall_m == pytest.approx(0.4, rel=0.02)
    texture = billboards._textures[0]
    columns, rows, layers = texture.size
    colour = np.frombuffer(texture.read(), np.float16).reshape(layers, rows, columns, 4).astype(np.float64)
    opacity = colour[..., 3]
    # blades of 16 mm that hide each other, a little narrower than that at a quarter of their height
    quarter = opacity[:6, rows // 4].mean()
    assert quarter == pytest.approx(1.0 - np.exp(-60.0 * slab_m * 0.016 * 0.9), rel=0.35)
    assert opacity[6, rows // 4].mean() > 2.5 * quarter
    # the edges meet: what stands across one goes on at the other
    jump = np.abs(colour[:, :, 0] - colour[:, :, -1]).mean()
    assert jump < 2.0 * np.abs(np.diff(colour, axis=2)).mean() + 1e-3
    assert billboards.opacity_from_above < 0.02
    assert billboards.nbytes > colour.size * 2
    billboards.release()
    leaning = Billboards(device, _scene(), settings)
    assert 0.05 < leaning.opacity_from_above < 0.9
    leaning.release()


@pytest.mark.slow
def test_it_shows_as_much_grass_as_blades_and_in_their_colours(renderer):
    """From eye level and from above; where a pixel is wider than blades, too, which are drawn a pixel wide."""
    field = {"drift": 0.0, "density_per_m2": 600.0, "reach_m": 60.0, "full_density_m": 60.0}
    south_m = 30.0
    tables = {
        "sowing": field,
        "wind": [],
        # as much as the picture shows within reach; neither light nor shade is in the colours compared
        "ground": {"kind": "flat", "size_m": [42.0, 62.0], "beyond": "bare"},
        "shadows": {"enabled": False},
    }
    of_blades, of_grid = (
        renderer(Scene.model_validate({"technique": {"name": technique}, **tables}), size=(240, 135))
        for technique in ("visibility-buffer", "billboard-grid")
    )
    for height_m, down_deg in ((0.5, 10.0), (1.7, 15.0), (1.7, 35.0), (8.0, 45.0), (8.0, 85.0)):
        down = np.radians(down_deg)
        camera = Camera(
            position_m=(0.0, height_m, south_m),
            target_m=(0.0, height_m - 5.0 * np.sin(down), south_m - 5.0 * np.cos(down)),
            fov_y_deg=20.0,
        )
        cover, colour = [], []
        for drawn in (of_blades, of_grid):
            grass = drawn.render(camera=camera, aovs=["class"]).truth["class"] == GRASS_CLASS
            packed = np.frombuffer(drawn._gbuffer.colour.read(), np.uint8).reshape(135, 240, 4)[::-1] / 255.0
            cover.append(grass.mean())
            colour.append((packed[grass, :3] ** 2).mean(axis=0))
        assert cover[1] == pytest.approx(cover[0], abs=0.06), (height_m, down_deg)
        assert colour[1] == pytest.approx(colour[0], rel=0.08), (height_m, down_deg)


@pytest.mark.slow
def test_grass_stands_out_against_the_sky(renderer):
    """What the source cannot: a silhouette beyond the ground's own."""
    sowing = {"density_per_m2": 300.0, "reach_m": 80.0}
    camera = {"position_m": [0.0, 1.0, 4.0], "target_m": [0.0, 1.4, -3.0]}
    scene = _scene(seed=7, ground=NOISE, sowing=sowing, camera=camera)
    drawn = renderer(scene)
    grass = drawn.render(aovs=["class"]).truth["class"]
    bare = renderer(_scene(seed=7, ground=NOISE, grass=[], camera=scene.camera.model_dump())).render(aovs=["class"])
    assert ((grass == GRASS_CLASS) & (bare.truth["class"] == SurfaceClass.SKY)).sum() > 300


@pytest.mark.slow
@pytest.mark.parametrize("height_m", [0.05, 0.25, 0.5, 6.0])
def test_the_camera_may_be_anywhere(renderer, height_m):
    """Down in the grass, at its tips and high above, looking ahead and straight down."""
    for target in ([0.0, height_m, -5.0], [0.0, -10.0, 0.0]):
        camera = {"position_m": [0.0, height_m, 0.0], "target_m": target, "near_m": 0.02}
        dense = {"density_per_m2": 400.0, "reach_m": 30.0}
        frame = renderer(_scene(sowing=dense, camera=camera)).render(aovs=["class", "depth"])
        assert _cover(frame) > 0.25
        assert (frame.truth["depth"] >= 0.02).all()


def test_no_grass_on_what_is_steeper_than_60_degrees(renderer):
    steep = {**NOISE, "height_m": 30.0, "wavelength_m": 20.0}
    scene = _scene(
        ground=steep,
        sowing={"max_slope_deg": 90.0, "density_per_m2": 400.0, "reach_m": 60.0},
        shadows={"enabled": False},
    )
    drawn = renderer(scene)
    truth = drawn.render(aovs=["class", "depth"]).truth
    grass = truth["class"] == GRASS_CLASS
    points = world_points(drawn, scene.camera, np.where(grass, truth["depth"], 1.0))[grass]
    up = HeightField.of(scene).normal(points[:, 0], points[:, 2])[:, 1]
    assert len(up) > 2000
    # it leans over the edge
    assert np.quantile(up, 0.02) > 0.45


@pytest.mark.slow
def test_forces_press_it_down(renderer):
    press = {"kind": "tracks", "path": [[-6.0, 0.0], [6.0, 0.0]], "tyre_m": 1.5, "gauge_m": 1.5}
    above = Camera(position_m=(0.0, 0.8, 4.0), target_m=(0.0, 0.2, 0.0))
    dense = {"density_per_m2": 300.0}
    depths = []
    for force in ([], [press]):
        drawn = renderer(_scene(sowing=dense, force=force))
        truth = drawn.render(1.0, camera=above, aovs=["depth", "class"]).truth
        points = world_points(drawn, above, np.where(np.isinf(truth["depth"]), 1e3, truth["depth"]))
        track = (np.abs(points[..., 2]) < 0.5) & (np.abs(points[..., 0]) < 3.0)
        depths.append(points[..., 1][track].mean())
    assert depths[1] < 0.85 * depths[0]


@pytest.mark.slow
def test_gusts_run_over_it(renderer):
    """Where it leans and when: the same gust later stands downwind."""
    wind = {**BREEZE, "direction_deg": 270.0, "gust_m": 3.0, "gustiness": 1.0, "turbulence": 0.0}
    high = {"position_m": [0.0, 8.0, 0.01], "target_m": [0.0, 0.0, 0.0]}
    drawn = renderer(_scene(wind=[wind], camera=high, sowing={"density_per_m2": 300.0}))
    motion = []
    for time_s in (1.0, 1.4):
        drawn.render(time_s - 0.05)
        motion.append(drawn.render(time_s, aovs=["motion"]).truth["motion"][..., 0])
    rows = [np.nan_to_num(each).mean(axis=0) - np.nan_to_num(each).mean() for each in motion]
    likeness = [np.corrcoef(rows[0][: 160 - shift], rows[1][shift:])[0, 1] for shift in range(60)]
    assert int(np.argmax(likeness)) > 5


@pytest.mark.parametrize(
    ("settings", "tables", "said"),
    [
        ({"spacing": 0.005, "billboard_m": 2.0, "texture_px": 64}, {}, "technique.spacing: must be at least a texel"),
        ({}, {"growth": {}}, "must not be billboard-grid with [growth]"),
    ],
    ids=["below a texel", "growth"],
)
def test_refuses(renderer, settings, tables, said):
    with pytest.raises(InputError) as error:
        renderer(_scene(settings, **tables))
    assert said in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("alpha", [0, 255])
@pytest.mark.parametrize("key", ["side_texture", "top_texture"])
def test_refuses_textures_that_cut_nothing_out(renderer, tmp_path, key, alpha):
    Image.fromarray(np.full((4, 4, 4), alpha, np.uint8)).save(tmp_path / "grass.png")
    with pytest.raises(InputError, match=f"grass.png: technique.{key}: must have an alpha channel"):
        renderer(_scene({key: "grass.png"}).in_folder(tmp_path))


# What is drawn, against the twin ----------------------------------------------------------------------------------
_COLUMNS, _ROWS = np.meshgrid(np.arange(16), np.arange(8))
_SIDE = np.stack(
    [
        140 + 100 * np.sin(2 * np.pi * _COLUMNS / 16),
        60 + 24 * _ROWS,
        200 - 90 * np.cos(2 * np.pi * _COLUMNS / 16),
        95 + 60 * np.sin(2 * np.pi * _COLUMNS / 16 + 1.0),
    ],
    -1,
).astype(np.uint8)
_ACROSS, _DOWN = np.meshgrid(np.arange(16), np.arange(16))
_TOP = np.stack(
    [
        90 + 80 * np.sin(2 * np.pi * _ACROSS / 16),
        130 + 100 * np.sin(2 * np.pi * _DOWN / 16),
        230 + 0 * _DOWN,
        120 + 60 * np.cos(2 * np.pi * (_ACROSS + _DOWN) / 16),
    ],
    -1,
).astype(np.uint8)
_STEADY = {**BREEZE, "gustiness": 0.0, "turbulence": 0.0, "speed_mps": 6.0}
_OF_COLOUR = {
    **STIFF,
    "root_colour": "#205010",
    "tip_colour": "#a0803c",
    "width_m": [0.1, 0.1],
    "stiffness": [0.3, 0.3],
}
_PUBLISHED = {"carrier": True, "steps": 5, "early_exit": False, "irregularity": 0.0, "turn_deg": 0.0, "sway": "shear"}
_WAYS = {
    "as published": _PUBLISHED,
    "four steps, filled with colour, no middle plane": {
        **_PUBLISHED,
        "steps": 4,
        "fill": "colour",
        "middle_plane": False,
        "opacity": 0.7,
    },
    "ours": {"steps": 40, "turn_deg": 20.0, "irregularity": 0.7, "billboard_m": 0.8},
    "ours, too few steps": {"steps": 4, "turn_deg": -35.0, "irregularity": 0.4, "sway": "shear"},
}


def _leaning(scene, stiffness, tall_m, at, time_s):
    """Control points and tips, from their roots, of blades at places (n, 3) in the gusts of a scene: (n, 2, 3)."""
    many = len(at)
    up, one = np.tile([0.0, 1.0, 0.0], (many, 1)), np.ones(many)
    wind = oracle_wind.gusts(scene.wind[0].model_dump(), scene.seed, at, time_s)
    neighbours = simplex(2.3 * at[:, 0], 2.3 * at[:, 2], 71)
    swing = 3.5 / np.sqrt(max(tall_m, 0.02)) * time_s + 5.0 * neighbours
    swing += 2.0 * simplex(9.1 * at[:, 0], 9.1 * at[:, 2], 73)
    blade = np.zeros((many, 3)), 0.5 * tall_m * up, tall_m * up, up, tall_m * one, stiffness * one
    return np.stack(oracle_wind.stand(*blade, 0.0 * one, wind, time_s, swing), 1)


def _mean_colour(grass):
    root, tip, dry = (np.array(linear(colour)) for colour in (grass.root_colour, grass.tip_colour, grass.dry_colour))
    green = 0.1 * root + 0.9 * tip
    return green + sum(grass.dryness) / 2.0 * (dry - green)


def _against_twin(renderer, folder, settings, pixels=60, height=1.0, pictures=None, **tables):
    """Ground truth of a picture at some pixels, and the twin's rays through these."""
    technique = {"name": "billboard-grid", "spacing": 0.7, **settings}
    technique |= {"side_texture": "side.png", "top_texture": "top.png"}
    camera = {"position_m": [0.3, 1.3, 1.1], "target_m": [-0.5, 0.0, -0.9], "fov_y_deg": 35.0}
    given = {"grass": [_OF_COLOUR], "wind": [_STEADY], "technique": technique, "camera": camera, **tables}
    scene = with_pictures(
        folder, {"side.png": _SIDE, "top.png": _TOP, **(pictures or {})}, shadows={"enabled": False}, **given
    )
    drawn = renderer(scene)
    aovs = ("depth", "class", "albedo", "normal", "blade_id")
    truth = drawn.render(1.0, aovs=aovs).truth
    far, eye = world_points(drawn, scene.camera, np.full(truth["depth"].shape, 50.0)), drawn._view.camera_ws
    options = GridSettings.model_validate({k: v for k, v in technique.items() if k != "name"})
    tall_m = drawn._technique._billboards.tall_m
    chosen = np.random.default_rng(3).choice(truth["depth"].size, pixels, replace=False)
    through = (far.reshape(-1, 3)[chosen] - eye) / 50.0
    # wind is that where a ray enters the grass
    entered = eye + ((tall_m - eye[1]) / through[:, 1:2]) * through
    leaning = _leaning(scene, 0.3, tall_m, entered, 1.0)
    rays = [
        billboard_grid.Ray(
            eye,
            ray,
            options.spacing * 0.4,  # blades of 0.4 m
            np.radians(options.turn_deg),
            options.irregularity,
            tall_m,
            options.steps,
            scene.seed,
            billboard_grid.picture(_SIDE),
            billboard_grid.picture(_TOP),
            _mean_colour(scene.grass[0]),
            *leaning[k],
            carrier=options.carrier,
            shear=options.sway == "shear",
            middle=options.middle_plane,
            billboard_m=options.billboard_m,
            fill=options.fill,
            opacity=options.opacity,
            height=height,
        ).trace()
        for k, ray in enumerate(through)
    ]
    return {name: truth[name].reshape(-1, *truth[name].shape[2:])[chosen] for name in aovs}, rays


@pytest.mark.parametrize("way", ["as published", "ours"])
def test_each_ray_goes_through_grass_in_the_wind_of_its_place(renderer, tmp_path, way):
    gusts = {**BREEZE, "gustiness": 0.9, "turbulence": 0.9, "speed_mps": 5.0, "gust_m": 1.5}
    _check(*_against_twin(renderer, tmp_path, _WAYS[way], wind=[gusts]))


@pytest.mark.parametrize("way", _WAYS)
def test_what_a_ray_gathers(renderer, tmp_path, way):
    """Depth, colour, normal and id of the drawn picture, with wind, are those of the twin."""
    _check(*_against_twin(renderer, tmp_path, _WAYS[way]))


@pytest.mark.parametrize("way", ["as published", "ours"])
def test_the_density_map_lowers_what_a_ray_gathers(renderer, tmp_path, way):
    lower = {"low.png": np.full((4, 4, 3), (255, 255, 153), np.uint8)}
    sowing = {"density_map": "low.png"}
    _check(*_against_twin(renderer, tmp_path, _WAYS[way], height=0.6, pictures=lower, sowing=sowing))


def _check(truth, rays):
    grass = np.array([np.isfinite(ray.depth) for ray in rays])
    assert (grass == (truth["class"] == GRASS_CLASS)).mean() > 0.97
    assert grass.sum() > 40
    seen = [ray for ray, is_grass in zip(rays, grass, strict=True) if is_grass]
    truth = {name: values[grass] for name, values in truth.items()}
    near = np.abs(truth["depth"] - [ray.depth for ray in seen]) < 2e-3
    shown = [ray.shown(int(blade)) for ray, blade in zip(seen, truth["blade_id"], strict=True)]
    # mottled by a factor that all channels share
    colours, wanted = truth["albedo"], np.array([colour for colour, _ in shown])
    off = np.abs(colours / colours.sum(-1, keepdims=True) - wanted / wanted.sum(-1, keepdims=True)).max(-1)
    cosines = (truth["normal"] * [normal for _, normal in shown]).sum(-1)
    upright = [k for k, ray in enumerate(seen) if len(ray.id) == 4]
    same = [truth["blade_id"][k] == blade_ids(BladeKind.TRACED, *seen[k].id) for k in upright]
    assert near.mean() > 0.94
    assert np.quantile(off, 0.9) < 0.01
    assert np.quantile(cosines, 0.1) > 0.999
    assert len(same) > 10
    assert np.mean(same) > 0.9


def _albedo(renderer, folder, settings=None, pictures=None, **tables):
    """Linear colours of the grass where all textures are the same grey, (n, 3)."""
    grey = np.full((8, 8, 4), (150, 150, 150, 200), np.uint8)
    technique = {"name": "billboard-grid", "side_texture": "grey.png", "top_texture": "grey.png", **(settings or {})}
    tables = {"grass": [_OF_COLOUR], "technique": technique, "shadows": {"enabled": False}, **tables}
    truth = (
        renderer(with_pictures(folder, {"grey.png": grey, **(pictures or {})}, **tables))
        .render(aovs=["class", "albedo", "depth"])
        .truth
    )
    return truth["albedo"][(truth["class"] == GRASS_CLASS) & (truth["depth"] < 7.0)]


@pytest.mark.parametrize("colour", [(250, 2, 4), (1, 3, 240), (110, 100, 125)])
def test_painted_colours_are_shown_as_they_are(renderer, tmp_path, colour):
    """However far they are from those of the species."""
    map_ = {"map.png": np.full((4, 4, 3), colour, np.uint8)}
    shown = _albedo(renderer, tmp_path, pictures=map_, sowing={"vegetation_map": "map.png"})
    wanted = np.array(linear("#{:02x}{:02x}{:02x}".format(*colour)))
    ratio = shown / shown.sum(-1, keepdims=True)
    assert len(shown) > 1000
    # ground truth holds 8 bits, of square roots
    assert np.abs(np.median(ratio, axis=0) - wanted / wanted.sum()).max() < 0.01
    assert np.abs(ratio - wanted / wanted.sum()).max() < 0.1


def test_an_early_exit_leaves_out_what_would_hardly_show(renderer, tmp_path):
    """Black billboards that hide all but a hundredth of what lies behind them, which is white."""
    pictures = {"black.png": np.full((8, 8, 4), (0, 0, 0, 235), np.uint8)}
    pictures["white.png"] = np.full((8, 8, 4), (255, 255, 255, 254), np.uint8)
    settings = {
        "side_texture": "black.png",
        "top_texture": "white.png",
        "middle_plane": False,
        "fill": "colour",
        "steps": 3,
    }
    whole, cut = (_albedo(renderer, tmp_path, {**settings, "early_exit": e}, pictures) for e in (False, True))
    more = whole - cut
    assert 1e-4 < np.quantile(more, 0.8) < 0.02
    assert more.min() > -0.01


def test_settings_of_its_textures(device):
    """Each is looked at in the textures that it sets."""
    settings = {"layers": 3, "texture_px": 96, "billboard_m": 0.5, "roundness": 0.0}
    scene, spreads = _scene(grass=[STIFF]), []
    for changed in ({}, {"roundness": 1.0}, {"layers": 5}, {"texture_px": 64}, {"billboard_m": 1.0}):
        options = GridSettings(**{**settings, **changed})
        billboards = Billboards(device, scene, options)
        columns, rows, layers = billboards._textures[0].size
        assert (columns, layers, billboards.layers) == (options.texture_px, options.layers + 1, options.layers)
        assert rows == np.ceil(billboards.tall_m / options.billboard_m * options.texture_px)
        shape = np.frombuffer(billboards._textures[1].read(), np.uint8).reshape(layers, rows, columns, 4) / 255.0
        opacity = np.frombuffer(billboards._textures[0].read(), np.float16).reshape(shape.shape)[..., 3]
        sure = opacity > 0.95
        spreads.append((2.0 * shape[sure][:, 0] - 1.0).std())
        billboards.release()
    assert spreads[1] > 1.1 * spreads[0]


def test_parts_of_a_ray(device):
    """What is laid over what, how high it is, how a texel thins with the density map, and the size of a pixel."""
    random = np.random.default_rng(6)
    a, b, c, d = random.uniform(0.05, 1.0, (4, 50)).astype(np.float32)
    given = {"a": a, "b": b, "c": c, "d": d}

    def call(body: str, output: str = "float", **more) -> np.ndarray:
        return shader_call(device, "techniques/billboard_grid/trace.glsl", body, given, output, **more)

    started = "Traced t = Traced(vec4(0.0, 0.0, 0.0, b), vec3(0.0), a, c, NOWHERE_M, uvec2(0u), 0.0, 0.0);"
    high = call(
        f"{started} over(t, vec4(0.1, 0.2, 0.3, d), vec3(0.0, 1.0, 0.0), c, a); result = vec2(t.high, t.along);",
        "vec2",
    )
    np.testing.assert_allclose(high, np.stack([a + (1 - b) * d * c, c + (1 - b) * d * a], 1), rtol=1e-5)
    filled = call(
        "vec4 colour = vec4(0.1, 0.2, 0.3, a), shape = vec4(b); fillUp(colour, shape, c, true); result = shape;",
        "vec4",
    )
    np.testing.assert_allclose(filled[:, 3], b + (1 - a) * (0.3 + 0.6 * c), rtol=1e-5)
    np.testing.assert_allclose(filled[:, :3], np.tile((b + (1 - a) * 0.5)[:, None], 3), rtol=1e-5)
    for lod, part in ((0.0, 0.0), (1.75, 0.5), (4.0, 1.0)):
        np.testing.assert_allclose(
            call(f"shareOfTexel(a, b, {lod})"), (1 - part) * (b >= a) + part * b, atol=1e-5, err_msg=str(lod)
        )
    pixel = call("pixelAt(a)", blocks={VIEW_BLOCK: {"pixel_m": (0.25, 0.5)}})
    np.testing.assert_allclose(pixel, 0.25 * a + 0.5, rtol=1e-5)
    np.testing.assert_allclose(call("hiddenBy(a, 2.0)"), 1 - (1 - a) ** 2, atol=1e-5)


def test_what_stands_under_forces_is_as_tall_as_the_sward(device):
    body = (
        "Around a; a.height = h; a.v1 = a.v2 = a.before1 = a.before2 = vec3(0.0);"
        " bendUnderForces(a, vec3(0.1, 0.0, 0.2)); result = a.v2.y;"
    )
    h = np.array([0.6, 1.0, 1.4], np.float32)
    values = {"tall_m": 0.5, "mean_blade": (1.0, 0.5)}
    tall = shader_call(device, "techniques/billboard_grid/trace.glsl", body, {"h": h}, "float", uniforms=values)
    assert tall == pytest.approx(0.5 * h, rel=0.02)
