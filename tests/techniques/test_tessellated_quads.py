"""Tessellated quads: each equation against its twin, both modes, level of detail, outlines, hierarchy of patches."""

import numpy as np
import pytest
from PIL import Image

from blades import read_blades
from greensward.ground import HeightField
from greensward.scene import InputError, SceneError, SurfaceClass
from greensward.sowing.pattern import Grid, patches_in_view
from greensward.techniques import chosen
from greensward.techniques.tessellated_quads.pictures import blade_pictures, outline
from greensward.viewpoint import camera_view
from oracles import quads, shapes
from shader_calls import shader_call
from small_scenes import BREEZE, GRASS, NOISE, small_scene, with_pictures

_GLSL = "techniques/tessellated_quads/quad.glsl"
_GRASS = SurfaceClass.GRASS
_FULL = {"full_density_m": 60.0, "reach_m": 30.0}


def _scene(settings=None, **tables):
    return small_scene(technique={"name": "tessellated-quads", **(settings or {})}, **tables)


def _instanced(settings=None, **tables):
    return _scene({"mode": "instanced", "patch_m": 4.0, **(settings or {})}, **tables)


def _random(count=400):
    random = np.random.default_rng(13)
    points = {name: random.uniform(-2, 2, (count, 3)).astype(np.float32) for name in ("a", "b", "c", "d")}
    return points | {name: random.uniform(0.02, 1, count).astype(np.float32) for name in ("r", "s", "t")}


def _double(inputs):
    return {name: values.astype(np.float64) for name, values in inputs.items()}


def test_equation_2(device):
    given = _random()
    given["a"][:, 1] = 0
    given["a"] /= np.linalg.norm(given["a"], axis=1, keepdims=True)
    exact = _double(given)
    expected = quads.corners(exact["b"], exact["a"], exact["r"], exact["s"])
    for k in range(4):
        body = f"vec3 corners[4]; outline(b, a, vec3(0, 1, 0), r, s, corners); result = corners[{k}];"
        assert np.allclose(shader_call(device, _GLSL, body, given, "vec3"), expected[:, k], atol=1e-5)


def test_equation_3(device):
    given, exact = _random(), _double(_random())
    result = shader_call(device, _GLSL, "tipOffset(r, vec2(s, t))", given, "vec2")
    assert np.allclose(result, quads.offset(exact["r"], exact["s"], exact["t"])[:, [0, 2]], atol=1e-6)


def test_equations_4_and_5(device):
    given, exact = _random(), _double(_random())
    result = shader_call(device, _GLSL, "levelByDistance(8.0, 50.0 * r, 30.0)", given, "float")
    expected = quads.level_by_distance(8.0, 50.0 * exact["r"], 30.0)
    assert (result == expected).mean() > 0.99, "but where it steps"
    assert expected.min() == 0
    assert expected.max() == 8
    result = shader_call(device, _GLSL, "levelBySize(12.0, r, s - t, 360.0, 20.0)", given, "float")
    expected = quads.level_by_size(12.0, exact["r"], exact["s"] - exact["t"], 360.0, 20.0)
    assert np.allclose(result, expected, atol=1e-4)
    assert expected.min() < 0
    assert expected.max() == 12


def test_the_length_on_the_screen_tells_the_level(device):
    """Pixels between both ends over those of a quad; at least one quad, and no more than smoothness."""
    given = _random()
    body = "levelByLength(9.0, vec2(r, s), vec2(t, r), vec2(640.0, 360.0), 30.0)"
    result = shader_call(device, _GLSL, body, given, "float")
    r, s, t = (given[name].astype(float) for name in "rst")
    expected = np.clip(np.hypot(320.0 * (r - t), 180.0 * (s - r)) / 30.0, 1.0, 9.0)
    np.testing.assert_allclose(result, expected, rtol=1e-4)


def test_patches_are_counted_from_the_anchor(device):
    xz = np.random.default_rng(5).uniform(-30.0, 30.0, (200, 2)).astype(np.float32)
    values = {"patch_m": 4.0, "in_patch": (0.3, 0.8), "anchor_patch": (100, -7)}
    include = "techniques/tessellated_quads/parameters.glsl"
    result = shader_call(device, include, "patchAt(xz)", {"xz": xz}, "ivec2", uniforms=values)
    assert np.array_equal(
        result, np.floor(xz.astype(float) / 4.0 + np.array([0.3, 0.8])).astype(int) + np.array([100, -7])
    )


def test_equation_6(device):
    given, exact = _random(), _double(_random())
    result = shader_call(device, _GLSL, "controlPoint(a, b, vec3(0, 1, 0), vec2(r, s))", given, "vec3")
    assert np.allclose(result, quads.control(exact["a"], exact["b"], exact["r"], exact["s"]), atol=1e-5)


def test_the_control_point_stands_above_the_root_at_the_height_of_the_tip(device):
    """As section 5.1 has it in words; on any surface, above means along its normal."""
    given = _random()
    up = given["c"] / np.linalg.norm(given["c"], axis=1, keepdims=True)
    result = shader_call(device, _GLSL, "controlPoint(a, b, c, vec2(1.0, 0.0))", {**given, "c": up}, "vec3")
    height = np.einsum("ij,ij->i", given["b"] - given["a"], up)[:, None]
    assert np.allclose(result, given["a"] + height * up, atol=1e-5)


def test_equation_7(device):
    given, exact = _random(), _double(_random())
    point, tangent = quads.spline(exact["a"], exact["b"], exact["c"], exact["r"])
    for name, expected in (("spline(a, b, c, r, tangent)", point), ("tangent", tangent)):
        body = f"vec3 tangent, p = spline(a, b, c, r, tangent); result = {'p' if 'spline' in name else name};"
        assert np.allclose(shader_call(device, _GLSL, body, given, "vec3"), expected, atol=2e-5)


def test_equation_8(device):
    given = _random()
    for name in ("b", "d"):
        given[name] /= np.linalg.norm(given[name], axis=1, keepdims=True)
    exact = _double(given)
    expected = quads.point(exact["a"], exact["b"], exact["c"], exact["d"], exact["r"])
    well = np.linalg.norm(exact["b"] * (1 - exact["r"][:, None]) + exact["d"] * exact["r"][:, None], axis=1) > 0.1
    well &= np.linalg.norm(np.cross(expected[2], expected[1]), axis=1) > 0.1
    assert well.mean() > 0.8
    for name, values in zip(("position", "bitangent", "tangent", "normal"), expected, strict=True):
        result = shader_call(device, _GLSL, f"pointOn(a, b, c, d, r).{name}", given, "vec3")
        assert np.allclose(result[well], values[well], atol=1e-4), name


@pytest.mark.parametrize(
    ("call", "twin"),
    [
        ("variedByRatio(r, 40.0 * s, 9.0 * t)", lambda e: quads.varied_by_ratio(e["r"], 40 * e["s"], 9 * e["t"])),
        ("variedByShare(r, 40.0 * s, 200.0)", lambda e: quads.varied_by_share(e["r"], 40 * e["s"], 200.0)),
        ("variedBySine(r, s, 12.9898)", lambda e: quads.varied_by_sine(e["r"], e["s"], 12.9898)),
    ],
    ids=["10", "11", "12"],
)
def test_equations_10_to_12(device, call, twin):
    path = "techniques/tessellated_quads/variation.glsl"
    result, expected = shader_call(device, path, call, _random(), "float"), twin(_double(_random()))
    close = np.isclose(result, expected, atol=2e-4)
    assert close.mean() > 0.99, "but where a fraction wraps around"


@pytest.mark.parametrize("shape", ["quad", "triangle", "quadratic", "triangle-tip"])
def test_outlines_are_those_of_other_techniques(shape):
    rows, columns = 64, 256
    v = 1.0 - (np.arange(rows) + 0.5) / rows
    left, right = (shapes.parameter(shape, np.full(rows, u), v, np.full(rows, 99.0)) for u in (0.0, 1.0))
    assert np.allclose(outline(shape, columns, rows).mean(axis=1), right - left, atol=0.01)


# Both modes -------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_both_modes_show_alike(renderer):
    """Other blades, but as much grass of the same colour."""
    frames = [
        renderer(scene(wind=[BREEZE], sowing={"density_per_m2": 80.0})).render(1.0, aovs=["class"])
        for scene in (_scene, _instanced)
    ]
    cover = [(frame.truth["class"] == _GRASS).mean() for frame in frames]
    assert cover[0] == pytest.approx(cover[1], rel=0.05)
    colour = [frame.image[frame.truth["class"] == _GRASS].mean(axis=0) for frame in frames]
    assert np.abs(colour[0] - colour[1]).max() < 6


@pytest.mark.parametrize("variation", ["ratio", "share", "sine"])
def test_no_instance_is_like_another(renderer, variation):
    """Two places a patch apart show different blades, and each the same again."""
    drawn = renderer(_instanced({"variation": variation}))
    ids, images = [], []
    for x in (0.0, 4.0, 0.0):
        camera = drawn.scene.camera.model_copy(update={"position_m": (x, 1.3, 4.0), "target_m": (x, 0.3, -3.0)})
        frame = drawn.render(camera=camera, aovs=["class"])
        ids.append(frame.truth["class"])
        images.append(frame.image)
    assert (ids[0] != ids[1]).mean() > 0.1
    assert np.array_equal(images[0], images[2])


def test_instances_take_no_memory_and_no_time_for_a_larger_field(renderer):
    """The same view of fields of 60 m and of 90 km: the same blades, patches and bytes."""
    seen = []
    for edge_m in (60.0, 90_000.0):
        ground = {"kind": "flat", "size_m": [edge_m, edge_m], "beyond": "bare"}
        drawn = renderer(_instanced({"variation": "sine"}, ground=ground))
        frame = drawn.render(aovs=["class", "depth"])
        seen.append((frame, drawn._technique._instances.nbytes, drawn.field_bytes))
    (small, *small_bytes), (large, *large_bytes) = seen
    assert small_bytes == large_bytes
    assert small.counts == large.counts
    assert np.array_equal(small.truth["depth"], large.truth["depth"])


def test_instances_are_steady_far_from_the_origin(renderer):
    ground = {"kind": "flat", "size_m": [90_000.0, 90_000.0]}
    drawn = renderer(_instanced(ground=ground))
    covers = []
    for x in (0.0, 40_000.0):
        camera = drawn.scene.camera.model_copy(update={"position_m": (x, 1.3, 4.0), "target_m": (x, 0.3, -3.0)})
        drawn.render(0.0, camera=camera)
        frame = drawn.render(0.5, camera=camera, aovs=["class", "motion"])
        covers.append((frame.truth["class"] == _GRASS).mean())
        assert np.abs(frame.truth["motion"]).max() < 0.05
    assert covers[0] == pytest.approx(covers[1], rel=0.1)


def test_maps_are_read_where_the_blade_stands(renderer, tmp_path):
    """East of the middle nothing grows; there are no stored blades that could know."""
    half = np.zeros((8, 8, 3), np.uint8)
    half[:, :4] = 255
    sowing = {"density_map": "half.png"}
    cover = []
    for scene in (_scene, _instanced):
        tables = scene(sowing=sowing, ground={"size_m": [40.0, 40.0]}).model_dump(exclude_defaults=True)
        tables["camera"] = {"position_m": [0.0, 4.0, 6.0], "target_m": [0.0, 0.0, 0.0]}
        kept = with_pictures(tmp_path, {"half.png": half}, **{**tables, "technique": scene().technique.model_dump()})
        grass = renderer(kept).render(aovs=["class"]).truth["class"] == _GRASS
        cover.append((grass[:, :70].mean(), grass[:, 95:].mean()))
    for west, east in cover:
        assert west > 0.1
        assert east < 0.1 * west


def test_ids_of_instances_are_unique_in_a_picture(renderer):
    drawn = renderer(_instanced())
    frame = drawn.render(aovs=["blade_id", "depth"])
    shown = np.unique(frame.truth["blade_id"])
    assert len(shown) > 300
    assert len(shown) - 1 <= frame.counts.drawn <= frame.counts.considered


# Level of detail --------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_densities_change_the_work_and_not_the_picture(renderer):
    frames = {
        count: renderer(_instanced({"densities": count, "thinning": 1.0}, sowing=_FULL)).render(aovs=["depth"])
        for count in (1, 4, 8)
    }
    considered = [frames[count].counts.considered for count in (1, 4, 8)]
    assert considered[0] > 1.2 * considered[1]
    assert considered[1] >= considered[2]
    for count in (4, 8):
        assert np.array_equal(frames[count].truth["depth"], frames[1].truth["depth"])
        assert frames[count].counts.drawn == frames[1].counts.drawn


def _shown_between(frame, near_m, far_m):
    """How many blades show in a ring of depth."""
    depth, ids = frame.truth["depth"], frame.truth["blade_id"]
    return len(np.unique(ids[(depth >= near_m) & (depth < far_m)]))


@pytest.mark.parametrize("scene", [_scene, _instanced], ids=["basic", "instanced"])
def test_thinning_leaves_out_more_with_distance(renderer, scene):
    high = {"position_m": [0.0, 8.0, 20.0], "target_m": [0.0, 0.0, 4.0]}
    frames = [
        renderer(
            scene({"thinning": thinning}, sowing={**_FULL, "density_per_m2": 4.0}, camera=high), size=(320, 180)
        ).render(aovs=["blade_id", "depth"])
        for thinning in (0.0, 1.0)
    ]
    near, far = (_shown_between(frames[1], *ring) / _shown_between(frames[0], *ring) for ring in ((8, 14), (21, 25)))
    assert 0.5 < near < 0.85
    assert far < 0.45


@pytest.mark.parametrize("scene", [_scene, _instanced], ids=["basic", "instanced"])
def test_shrinking_lowers_the_far_ones(renderer, scene):
    low = {"position_m": [0.0, 0.8, 20.0], "target_m": [0.0, 0.75, 0.0], "fov_y_deg": 8.0}
    tops = []
    for shrinking in (0.0, 1.0):
        frame = renderer(scene({"shrinking": shrinking}, sowing=_FULL, camera=low)).render(aovs=["class", "depth"])
        far = (frame.truth["class"] == _GRASS) & (frame.truth["depth"] > 20)
        tops.append(np.nonzero(far.any(axis=1))[0].min())
    assert tops[1] > tops[0] + 1, "the far edge of the grass lies lower in the picture"


@pytest.mark.slow
def test_nothing_pops_while_the_camera_comes_closer(renderer):
    """Cover grows and shrinks smoothly: a step of a centimetre changes few pixels at once."""
    unshaded = {"shadows": {"enabled": False}}
    drawn = renderer(_instanced({"thinning": 1.0, "densities": 3}, sowing=_FULL, **unshaded))
    covers = []
    for step in range(12):
        z = 4.0 - 0.01 * step
        camera = drawn.scene.camera.model_copy(update={"position_m": (0.0, 1.3, z), "target_m": (0.0, 0.3, z - 7.0)})
        covers.append((drawn.render(camera=camera, aovs=["class"]).truth["class"] == _GRASS).mean())
    assert np.abs(np.diff(covers)).max() < 0.006


@pytest.mark.slow
def test_levels(renderer):
    """More quads follow a bent blade more closely; what reaches the limit of the driver still draws."""
    near = {"position_m": [0.0, 0.5, 1.5], "target_m": [0.0, 0.2, -1.0]}
    images = {
        (level, smoothness): renderer(
            _scene(
                {"level": level, "smoothness": smoothness}, camera=near, grass=[{**GRASS, "tilt_deg": [50.0, 70.0]}]
            )
        )
        .render()
        .image.astype(int)
        for level in ("distance", "size")
        for smoothness in (1, 16, 64)
    }
    for level in ("distance", "size"):
        coarse, fine = (np.abs(images[level, s] - images[level, 64]).mean() for s in (1, 16))
        assert fine < 0.5 * coarse


# Outlines and colours ---------------------------------------------------------------------------------------


def _blade_scene(tmp_path, pictures, grass, settings=None, **tables):
    """Few and wide blades, which hide little of each other."""
    near = {"position_m": [0.0, 0.5, 2.0], "target_m": [0.0, 0.25, -3.0]}
    technique = {"name": "tessellated-quads", **(settings or {})}
    wide = {**GRASS, "width_m": [0.05, 0.05], **grass}
    tables["sowing"] = {"density_per_m2": 12.0, "reach_m": 6.0, **tables.get("sowing", {})}
    return with_pictures(tmp_path, pictures, technique=technique, grass=[wide], camera=near, **tables)


def test_a_texture_outlines_the_blade(renderer, tmp_path):
    full, half = (np.full((16, 16, 4), 255, np.uint8) for _ in range(2))
    half[:, 8:, 3] = 0
    cover = {}
    for name, picture in (("full", full), ("half", half)):
        scene = _blade_scene(tmp_path, {f"{name}.png": picture}, {"alpha_texture": f"{name}.png"})
        cover[name] = (renderer(scene).render(aovs=["class"]).truth["class"] == _GRASS).mean()
    assert cover["full"] > 0.01
    assert 0.4 * cover["full"] < cover["half"] < 0.8 * cover["full"]


def test_brightness_outlines_where_there_is_no_alpha(tmp_path):
    grey = np.zeros((16, 16, 3), np.uint8)
    grey[:, :8] = 255
    scene = _blade_scene(tmp_path, {"grey.png": grey}, {"alpha_texture": "grey.png"})
    alpha = blade_pictures(scene)[0, ..., 3]
    assert (alpha[:, : alpha.shape[1] // 2 - 4] == 255).all()
    assert (alpha[:, alpha.shape[1] // 2 + 4 :] == 0).all()


@pytest.mark.parametrize("mode", ["L", "P", "I;16", "1", "LA", "RGBA"])
def test_textures_of_any_mode(renderer, tmp_path, mode):
    ramp = np.tile(np.arange(256, dtype=np.uint8), (16, 1))
    picture = Image.fromarray(ramp)
    picture = Image.fromarray(ramp.astype(np.uint16) * 257) if mode == "I;16" else picture.convert(mode)
    picture.save(tmp_path / "blade.png")
    scene = _blade_scene(tmp_path, {}, {"alpha_texture": "blade.png", "diffuse_texture": "blade.png"})
    assert (renderer(scene).render(aovs=["class"]).truth["class"] == _GRASS).mean() > 0.02


def test_an_invisible_texture_is_refused(renderer, tmp_path):
    nothing = np.zeros((4, 4, 4), np.uint8)
    scene = _blade_scene(tmp_path, {"nothing.png": nothing}, {"alpha_texture": "nothing.png"})
    with pytest.raises(InputError, match=r"nothing\.png: grass\.alpha_texture: must be opaque"):
        renderer(scene)


def test_a_texture_colours_the_blade_and_the_vegetation_map_wins(renderer, tmp_path):
    red, blue = (np.full((8, 8, 3), colour, np.uint8) for colour in ((200, 20, 20), (20, 20, 200)))
    plain = _blade_scene(tmp_path, {"red.png": red}, {"diffuse_texture": "red.png"})
    mapped = _blade_scene(
        tmp_path,
        {"red.png": red, "blue.png": blue},
        {"diffuse_texture": "red.png"},
        sowing={"vegetation_map": "blue.png"},
    )
    colours = []
    for scene in (plain, mapped):
        truth = renderer(scene).render(aovs=["albedo", "class"]).truth
        colours.append(truth["albedo"][truth["class"] == _GRASS].mean(axis=0))
    assert colours[0][0] > 5 * colours[0][2]
    assert colours[1][2] > 5 * colours[1][0]


def test_blades_of_one_texture_differ_and_are_darker_at_the_root(renderer, tmp_path):
    grey = np.full((8, 8, 3), 160, np.uint8)
    scene = _blade_scene(tmp_path, {"grey.png": grey}, {"diffuse_texture": "grey.png"})
    truth = renderer(scene, size=(320, 180)).render(aovs=["albedo", "blade_id", "class"]).truth
    ids, albedo = truth["blade_id"], truth["albedo"]
    big = [i for i in np.unique(ids)[1:] if (ids == i).sum() > 60]
    means = np.array([albedo[ids == i].mean(axis=0) for i in big])
    assert np.ptp(means, axis=0).min() > 0.03
    darker = [albedo[ids == i][-8:].mean() < albedo[ids == i][:8].mean() for i in big]  # rows run down to the root
    assert np.mean(darker) > 0.8


def test_hashed_alpha_shows_in_the_mean_what_is_half_transparent(renderer, tmp_path):
    sheer = np.full((16, 16, 4), 255, np.uint8)
    sheer[..., 3] = 100
    cover = {}
    for alpha in ("test", "hashed"):
        scene = _blade_scene(
            tmp_path,
            {"sheer.png": sheer},
            {"alpha_texture": "sheer.png"},
            {"alpha": alpha},
            shadows={"enabled": False},
        )
        cover[alpha] = (renderer(scene).render(aovs=["class"]).truth["class"] == _GRASS).mean()
    solid = np.full((16, 16, 4), 255, np.uint8)
    scene = _blade_scene(tmp_path, {"solid.png": solid}, {"alpha_texture": "solid.png"})
    whole = (renderer(scene).render(aovs=["class"]).truth["class"] == _GRASS).mean()
    assert cover["test"] == 0
    assert 0.3 * whole < cover["hashed"] < 0.75 * whole


# Parameters of a patch --------------------------------------------------------------------------------------


def test_a_patch_has_parameters_of_its_own(renderer):
    east = {"from_m": [0.0, -50.0], "to_m": [50.0, 50.0]}
    view = {"position_m": [0.0, 2.0, 5.0], "target_m": [0.0, 0.0, -1.0]}

    def sides(**own):
        drawn = renderer(_scene({"patch": [{**east, **own}]}, camera=view))
        grass = drawn.render(aovs=["class"]).truth["class"] == _GRASS
        return grass[:, :70].mean(), grass[:, 90:].mean()

    usual = sides()
    for own, changes in (
        ({"density": 0.2}, -1),
        ({"height_m": [0.05, 0.08]}, -1),
        ({"width_m": [0.08, 0.1]}, 1),
    ):
        west, other = sides(**own)
        assert west == pytest.approx(usual[0], abs=0.02)
        assert changes * (other - usual[1]) > 0.2 * usual[1]


@pytest.mark.parametrize(
    ("patch", "words"),
    [
        ({"from_m": [1.0, 0.0], "to_m": [0.0, 5.0]}, "must be south-east of from_m"),
        ({"from_m": [0.0, 0.0], "to_m": [5.0, 5.0], "smoothness": 0}, "must be at least 1"),
        ({"from_m": [0.0, 0.0], "to_m": [5.0, 5.0], "smoothness": 65}, "must be at most 64"),
        ({"from_m": [0.0, 0.0], "to_m": [5.0, 5.0], "bending": 1.0}, "did you mean"),
    ],
)
def test_a_wrong_patch_is_told(patch, words):
    with pytest.raises(SceneError, match=words):
        chosen(_scene({"patch": [patch]}))


@pytest.mark.parametrize(
    ("settings", "words"),
    [({"smoothness": 0}, "smoothness: must be at least 1"), ({"patch_m": 0.0}, "patch_m: must be at least 1")],
)
def test_wrong_settings_are_told(settings, words):
    with pytest.raises(SceneError, match=words):
        chosen(_scene(settings))


@pytest.mark.slow
def test_a_patch_larger_than_the_field(renderer):
    ground = {"kind": "flat", "size_m": [6.0, 6.0], "beyond": "bare"}
    frame = renderer(_instanced({"patch_m": 60.0}, ground=ground)).render(aovs=["class", "depth"])
    grass = frame.truth["class"] == _GRASS
    assert grass.mean() > 0.02
    assert frame.truth["depth"][grass].max() < 4.0 + 3.0 + 1.0


def test_too_large_a_patch_and_growing_instances_are_refused(renderer):
    with pytest.raises(InputError, match=r"technique\.patch_m: must leave at most"):
        renderer(_instanced({"patch_m": 200.0}, sowing={"density_per_m2": 100_000.0}))
    with pytest.raises(InputError, match=r'technique\.mode: must be "basic" with \[growth\]'):
        renderer(_instanced(growth={"age": 0.5}))


# The hierarchy ----------------------------------------------------------------------------------------------


def _view(camera):
    scene = small_scene(camera=camera)
    return camera_view(scene.camera, HeightField.of(scene), (160, 90))


@pytest.mark.parametrize("grid", [((-6, -9), (7, 5)), ((0, 0), (1, 1)), ((-32, -32), (32, 32)), ((3, -4), (20, -2))])
def test_the_hierarchy_finds_what_testing_each_patch_finds(grid):
    views = [
        _view({"position_m": [0.0, 1.7, 4.0], "target_m": [0.0, 1.0, -20.0]}),
        _view({"position_m": [0.0, 1.7, 4.0], "target_m": [30.0, -10.0, 3.0]}),
    ]
    made = Grid(5.0, *grid, (-0.5, 1.5), 0.7)
    nodes, shown, away = patches_in_view(made, views, views[0].camera_ws, 60.0)
    every = np.stack(np.meshgrid(*(np.arange(*ends) for ends in zip(*grid, strict=True)), indexing="ij"), -1).reshape(
        -1, 2
    )
    low, high = every * 5.0 - 0.7, (every + 1) * 5.0 + 0.7
    corners = np.stack(
        np.broadcast_arrays(
            np.stack([low[:, 0], high[:, 0]], 1)[:, :, None, None],
            np.array([-0.5, 1.5])[None, None, :, None],
            np.stack([low[:, 1], high[:, 1]], 1)[:, None, None, :],
        ),
        -1,
    ).reshape(len(every), 8, 3)
    eye = views[0].camera_ws
    near = np.clip(eye, corners.min(1), corners.max(1))
    within = np.linalg.norm(near - eye, axis=1) <= 60.0
    expected = np.array(
        [
            within & ((corners @ view.planes_ws()[:, :3].T + view.planes_ws()[:, 3]).max(1) >= 0).all(1)
            for view in views
        ]
    )
    found = {tuple(node): mask for node, mask in zip(nodes.tolist(), shown.T.tolist(), strict=True)}
    assert {tuple(n): m for n, m in zip(every.tolist(), expected.T.tolist(), strict=True) if any(m)} == found
    assert len(away) == len(nodes)


def test_the_hierarchy_looks_at_few_nodes_of_a_large_field(monkeypatch):
    from greensward.sowing import pattern

    looked = []
    tested = pattern.boxes_in_view
    monkeypatch.setattr(pattern, "boxes_in_view", lambda *a: looked.append(len(a[1])) or tested(*a))
    view = _view({"position_m": [0.0, 1.7, 4.0], "target_m": [0.0, 1.0, -20.0]})
    for each_way in (64, 16384):
        looked.clear()
        nodes, *_ = patches_in_view(
            Grid(5.0, (-each_way,) * 2, (each_way,) * 2, (-0.5, 1.5), 0.7), [view], view.camera_ws, 60.0
        )
        assert sum(looked) < 8 * len(nodes)


def test_instances_on_hills_with_shadows_and_wind(renderer):
    drawn = renderer(_instanced(wind=[BREEZE], ground=NOISE), samples=2)
    frame = drawn.render(1.0, aovs=["class", "motion"])
    again = drawn.render(1.0, aovs=["class"])
    assert np.array_equal(frame.image, again.image)
    grass = frame.truth["class"] == _GRASS
    assert grass.mean() > 0.2
    assert 0.05 < np.linalg.norm(frame.truth["motion"][grass], axis=1).mean() < 10


def test_the_blades_of_the_field_stand_where_other_techniques_have_them(renderer):
    """The field is the same to the byte, whatever draws it."""
    drawn = renderer(_scene())
    drawn.render()
    other = renderer(small_scene())
    other.render()
    assert read_blades(drawn._world.field).tobytes() == read_blades(other._world.field).tobytes()


def test_what_the_outline_cuts_away_never_shows(tmp_path):
    leaf = np.full((40, 12, 4), (110, 190, 60, 255), np.uint8)
    leaf[:, :3, 3] = leaf[:, 9:, 3] = leaf[:9, :, 3] = 0
    found = []
    for hidden in ((0, 0, 0), (255, 255, 255), (110, 190, 60)):
        picture = np.where(leaf[..., 3:] > 0, leaf, [*hidden, 0]).astype(np.uint8)
        grass = [{"alpha_texture": "leaf.png", "diffuse_texture": "leaf.png"}]
        found.append(blade_pictures(with_pictures(tmp_path, {"leaf.png": picture}, grass=grass)))
    np.testing.assert_array_equal(found[0], found[1])
    assert np.abs(found[0].astype(int) - found[2]).max() <= 1
