"""What presses grass down: its pictures, its law over time, and how blades lie in it with every technique."""

import numpy as np
import pytest
from PIL import Image
from pydantic import TypeAdapter

from blades import read_blades, read_poses, up_of
from greensward.motion import Forces
from greensward.motion.force_layers import layer_of
from greensward.motion.force_map import force_pictures, force_values
from greensward.motion.outlines import (
    as_picture,
    distance_to,
    forces_around,
    from_picture,
    normals,
    read_outline,
    signed_distance,
)
from greensward.scene import Camera, InputError, SurfaceClass
from greensward.scene.force import MOST_TEXELS, Force
from greensward.techniques import TECHNIQUES
from oracles import bezier, force_map
from reprojection import world_points
from shader_calls import shader_call
from small_scenes import BREEZE, GRASS, NOISE, small_scene

NAMES = [technique.name for technique in TECHNIQUES]
WALK = {"kind": "footprints", "path": [[-3.0, 1.0], [3.0, 1.0]], "impact_m": 0.2}
DRIVE = {"kind": "tracks", "path": [[-3.0, -1.0], [3.0, -1.0]], "gauge_m": 1.0, "tyre_m": 0.4}
FLAT = {"kind": "tracks", "path": [[-1.0, 0.0], [1.0, 0.0]], "gauge_m": 0.0, "tyre_m": 2.0, "impact_m": 0.3}


def _layer(force, folder=None):
    scene = small_scene(force=[force])
    return layer_of(scene.force[0], (scene.in_folder(folder) if folder else scene).resolve)


@pytest.fixture
def force_at(device, tmp_path):
    """Forces (n, 3) at places (n, 2) and a time, as the shaders have them."""
    made = []

    def at(forces, places, time_s: float = 0.0):
        made.append(Forces(device, small_scene(force=list(forces)).in_folder(tmp_path)))
        p = np.array(places, np.float32).reshape(-1, 2)
        return shader_call(
            device, "motion/force_map.glsl", f"forceAt(p, {time_s})", {"p": p}, "vec3", bindings=made[-1].bindings
        )

    yield at
    for each in made:
        each.release()


# The pictures -----------------------------------------------------------------------------------------------


def test_distances_are_exact():
    mask = np.random.default_rng(3).random((40, 70)) < 0.01
    exact = force_map.distances(mask)
    assert np.abs(distance_to(mask, 100.0) - exact).max() < 1e-4
    assert np.abs(distance_to(mask, 9.0) - np.minimum(exact, 9.0)).max() < 1e-4
    assert (distance_to(np.zeros((5, 6), bool), 4.0) == 4.0).all()


def test_the_force_around_an_outline():
    random = np.random.default_rng(4)
    distance, angle = random.uniform(-2, 3, 500), random.uniform(0, 6.3, 500)
    normal = np.stack([np.cos(angle), np.sin(angle)], 1)
    got = forces_around(distance, normal, 0.5, 2.0)
    assert np.abs(got - force_map.around(distance, normal, 0.5, 2.0)).max() < 1e-9
    length = np.linalg.norm(got, axis=1)
    assert np.allclose(length[distance < 0], 1.0)
    assert np.allclose(got[distance < -0.5], [0, -1, 0])
    assert (length[distance > 2.0] < 1e-9).all()
    assert np.abs(forces_around(distance, normal, 0.5, 0.0)[distance > 0]).max() < 1e-9


def test_a_level_field_has_no_normals():
    assert (normals(np.ones((4, 5))) == 0).all()


def test_a_disc_pushes_outwards_all_around():
    x = np.arange(81) - 40.0
    disc = np.hypot(x[None], x[:, None]) < 20.0
    distance = signed_distance(disc, 15.0)
    away = np.hypot(x[None], x[:, None])
    outward = np.stack(np.broadcast_arrays(x[None], x[:, None]), -1) / np.maximum(away, 1)[..., None]
    near = np.abs(distance) < 10.0
    assert ((normals(distance) * outward).sum(-1)[near] > 0.93).all()
    assert np.abs(distance - (away - 20.0))[near].max() < 1.0


def test_footprints_press_down_and_push_aside(force_at):
    walk = {**WALK, "gauge_m": 0.3, "step_m": 1.0, "foot_m": [0.3, 0.12]}
    middle = (0.5, 1.15)  # of the fourth print, a right one: south of someone who walks east
    (down,) = force_at([walk], [middle])
    assert np.allclose(down, [0, -1, 0], atol=0.02)
    south, north = force_at([walk], [(0.5, 1.15 + 0.06), (0.5, 1.15 - 0.06)])
    assert south[2] > 0.8
    assert north[2] < -0.8
    beyond = force_at([walk], [(0.5, 1.21 + away) for away in (0.02, 0.06, 0.1, 0.15, 0.19)])
    length = np.linalg.norm(beyond, axis=1)
    assert (np.diff(length) < 0).all()
    assert (np.abs(beyond[:, 1]) < 1e-3).all()
    assert (force_at([walk], [(0.0, 1.0 + 1.0), (0.0, 5.0), (900.0, 0.0)]) == 0).all()
    prints = force_at([walk], [(k - 2.5, 1.0 + side) for k in range(6) for side in (-0.15, 0.15)])[:, 1] < -0.9
    assert prints.tolist() == [True, False, False, True] * 3, "left and right in turn"


def test_a_foot_has_a_dozen_texels_however_long_the_walk():
    for length_m in (2.0, 20.0, 40.0):
        layer = _layer({**WALK, "path": [[0, 0], [length_m, 1]]})
        rows, columns, _ = layer.texels.shape
        texel = layer.size_m[0] / columns
        assert texel == pytest.approx(layer.size_m[1] / rows)
        assert 0.29 / texel > 11.99
        assert max(rows, columns) <= MOST_TEXELS
        edge = np.concatenate([layer.texels[[0, -1], :, :3].ravel(), layer.texels[:, [0, -1], :3].ravel()])
        assert (edge == 0).all(), "nothing is cut off"


def test_tracks_run_along_both_sides(force_at):
    z = np.array([-1.5, -1.0, -0.5])
    forces = force_at([DRIVE], [(x, each) for x in (-2.0, 0.0, 2.0) for each in z]).reshape(3, 3, 3)
    assert np.allclose(forces[:, [0, 2]], [0, -1, 0], atol=0.02)
    assert np.abs(forces[:, 1]).max() < 0.05
    ends = force_at([DRIVE], [(-3.5, -0.5), (3.5, -0.5)])
    assert (ends == 0).all()
    (single,) = force_at([{**DRIVE, "gauge_m": 0.0}], [(0.0, -1.0)])
    assert single[1] < -0.98
    border = force_at([DRIVE], [(0.3, -0.3), (0.3, -0.7)])
    assert border[0, 2] > 0.8
    assert border[1, 2] < -0.8
    assert np.abs(border[:, 0]).max() < 0.1, "square to the way"


def test_curves_are_driven_smoothly():
    layer = _layer({**DRIVE, "path": [[0, 0], [4, 0], [4, 4], [0, 4]]})
    assert np.isfinite(layer.texels.astype(float)).all()
    pressed = layer.texels[..., 1] < -0.9
    assert pressed.mean() > 0.05


def test_a_stamp_lies_where_and_as_it_is_turned(force_at, tmp_path):
    bar = np.full((40, 40), 255, np.uint8)
    bar[4:20, 16:24] = 0  # from the middle to the north
    Image.fromarray(bar).save(tmp_path / "bar.png")
    stamp = {"kind": "stamp", "outline": "bar.png", "size_m": [2.0, 2.0], "impact_m": 0.2,
             "places": [[0, 0, 0], [5, 0, 90], [10, 3, -90]]}  # fmt: skip
    inside = force_at([stamp], [(0, -0.4), (5 - 0.4, 0), (10.4, 3)])
    assert (inside[:, 1] < -0.9).all(), "90 is anticlockwise: what was north lies west"
    assert np.abs(force_at([stamp], [(0, 0.4), (5.4, 0), (9.6, 3)])).max() == 0


def test_later_presses_win(force_at):
    path = [[-2.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [0.0, 1.0], [0.0, 0.0], [0.0, -2.0]]
    drive = {**DRIVE, "path": path, "gauge_m": 0.0, "speed_mps": 1.0}
    layer = _layer(drive)
    texel = layer.size_m[0] / layer.texels.shape[1]
    column, row = (
        int((0.5 * size - middle) / texel) for size, middle in zip(layer.size_m, layer.centre_m, strict=True)
    )
    crossed = float(layer.texels[row, column, 3])
    assert crossed > 8.0, "not the two seconds of the first time"
    assert force_at([drive], [(0.0, 0.0)], 30.0)[0, 1] < -0.95
    assert force_at([drive], [(-1.0, 0.0)], 5.0)[0, 1] < -0.95


# Maps -------------------------------------------------------------------------------------------------------

_RGB = np.array([[[255, 128, 128], [128, 1, 128]], [[128, 128, 255], [1, 128, 128]]], np.uint8)
_FORCES = np.array([[[1, 0, 0], [0, -1, 0]], [[0, 0, 1], [-1, 0, 0]]], float)


def _pictures():
    rgb = Image.fromarray(_RGB)
    half = Image.fromarray(np.dstack([_RGB, np.full((2, 2), 128, np.uint8)]))
    palette = rgb.convert("P", palette=Image.Palette.ADAPTIVE, colors=4)
    return {"rgb.png": rgb, "rgba.png": half, "palette.png": palette, "rgb.tif": rgb, "rgb.bmp": rgb}


@pytest.mark.parametrize("name", _pictures())
def test_maps_of_all_modes(force_at, tmp_path, name):
    _pictures()[name].save(tmp_path / name)
    expected = _FORCES * (128 / 255 if name == "rgba.png" else 1.0)
    force = {"kind": "map", "file": name, "size_m": [4.0, 4.0], "centre_m": [10.0, 5.0]}
    corners = [(9.0, 4.0), (11.0, 4.0), (9.0, 6.0), (11.0, 6.0)]
    assert np.abs(force_at([force], corners) - expected.reshape(-1, 3)).max() < 1e-3
    assert np.abs(force_at([{**force, "strength": 0.5}], corners) - 0.5 * expected.reshape(-1, 3)).max() < 1e-3
    # up to its edge and not beyond, though another layer is larger
    edge = force_at([force, {**WALK, "path": [[-3, 90], [3, 90]]}], [(8.001, 3.001), (7.999, 3.001)])
    assert np.abs(edge[0] - expected[0, 0]).max() < 1e-3
    assert (edge[1] == 0).all()


def test_a_map_of_sixteen_bits(tmp_path):
    import struct
    import zlib

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = b"".join(b"\0" + (row.astype(">u2") * 257).tobytes() for row in _RGB)
    header = struct.pack(">IIBBBBB", 2, 2, 16, 2, 0, 0, 0)
    body = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    (tmp_path / "deep.png").write_bytes(b"\x89PNG\r\n\x1a\n" + body)
    layer = _layer({"kind": "map", "file": "deep.png"}, tmp_path)
    assert np.abs(layer.texels[..., :3] - _FORCES).max() < 1e-3


def test_a_turned_map_turns_its_forces(force_at, tmp_path):
    _pictures()["rgb.png"].save(tmp_path / "a.png")
    force = {"kind": "map", "file": "a.png", "size_m": [4.0, 4.0], "yaw_deg": 90.0}
    got = force_at([force], [(-1.0, 1.0)])  # its north-west lies south-west
    assert np.abs(got - [[0, 0, -1]]).max() < 1e-3  # and east is north


def test_zero_is_exactly_none_and_nothing_is_longer_than_one(force_at, tmp_path):
    Image.fromarray(np.full((8, 8, 3), 128, np.uint8)).save(tmp_path / "none.png")
    Image.fromarray(np.full((8, 8, 3), 255, np.uint8)).save(tmp_path / "all.png")
    none, all_ = ({"kind": "map", "file": f"{name}.png"} for name in ("none", "all"))
    assert (force_at([none] * 3, [(0, 0), (1, 1)]) == 0).all()
    assert np.linalg.norm(force_at([all_] * 8, [(0, 0)])) == pytest.approx(1.0, abs=1e-3)
    assert np.abs(from_picture(np.zeros((1, 1, 4), np.uint8) + np.array([0, 0, 0, 255], np.uint8))).max() == 1.0
    some = np.random.default_rng(1).uniform(-1, 1, (5, 6, 3))
    rgba = np.dstack([as_picture(some), np.full((5, 6), 255, np.uint8)])
    assert np.abs(from_picture(rgba) - some).max() < 0.5 / 127 + 1e-6


@pytest.mark.parametrize("mode", ["L", "LA", "I;16", "1"])
def test_a_map_needs_three_channels(tmp_path, mode):
    Image.new(mode, (4, 4)).save(tmp_path / "grey.png")
    with pytest.raises(InputError, match="needs red, green and blue") as caught:
        _layer({"kind": "map", "file": "grey.png"}, tmp_path)
    assert "\n" not in str(caught.value)


def test_outlines(tmp_path):
    shapes = {"light.png": np.full((8, 8), 250, np.uint8), "clear.png": np.zeros((8, 8, 4), np.uint8)}
    for name, pixels in shapes.items():
        Image.fromarray(pixels).save(tmp_path / name)
        with pytest.raises(InputError, match="so nothing would press"):
            read_outline(tmp_path / name)
    white = np.zeros((8, 8, 4), np.uint8)
    white[2:4, 2:6] = 255  # opaque and light
    Image.fromarray(white).save(tmp_path / "white.png")
    assert (read_outline(tmp_path / "white.png") > 0.5).sum() == 8
    dark = np.full((8, 8, 3), 240, np.uint8)
    dark[5, 5] = 20
    Image.fromarray(dark).save(tmp_path / "dark.png")
    assert (read_outline(tmp_path / "dark.png") > 0.5).sum() == 1


def test_a_map_larger_than_a_layer_is_made_smaller(tmp_path):
    Image.fromarray(np.full((20, 2100, 3), (255, 128, 128), np.uint8)).save(tmp_path / "wide.png")
    layer = _layer({"kind": "map", "file": "wide.png"}, tmp_path)
    assert layer.texels.shape == (20, 2048, 4)
    assert np.allclose(layer.texels[..., 0], 1.0)


# Over time --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("fades", [None, 0.5, 30.0])
@pytest.mark.parametrize("always", [False, True])
def test_the_law_over_time(device, fades, always):
    age = np.linspace(-2, 40, 2000).astype(np.float32)
    body = f"forceLeft(age, {float(fades or 0.0)}, {str(always).lower()})"
    got = shader_call(device, "motion/force_map.glsl", body, {"age": age}, "float")
    assert np.abs(got - force_map.press_left(age.astype(float), fades, always)).max() < 1e-5
    if fades and not always:
        assert (got[(age <= 0) | (age >= fades)] == 0).all()


def test_it_appears_as_the_walker_comes_and_goes_again(force_at):
    walk = {**WALK, "speed_mps": 2.0, "start_s": 10.0, "fades_s": 4.0, "step_m": 1.0, "gauge_m": 0.0}
    place = [(0.5, 1.0)]  # 3.5 m from the start
    down = [-force_at([walk], place, t)[0, 1] for t in (9.0, 11.7, 11.95, 12.5, 14.0, 15.7, 15.8, 99.0)]
    assert down[0] == down[1] == 0
    assert down[2] > 0.8
    assert (np.diff(down[2:6]) < 0).all()
    assert down[-2] < 1e-3
    assert down[-1] == 0
    expected = force_map.press_left(np.array([12.5 - 11.75]), 4.0, False)[0]
    assert down[3] == pytest.approx(expected, abs=0.02)


def test_without_speed_it_has_always_been_there_and_fades_from_the_start(force_at):
    walk = {**WALK, "step_m": 1.0, "gauge_m": 0.0, "start_s": 5.0, "fades_s": 4.0}
    down = [-force_at([walk], [(0.5, 1.0)], t)[0, 1] for t in (-1e5, 5.0, 6.0, 9.0)]
    assert down[0] == down[1] == pytest.approx(1.0, abs=0.01)
    assert 0.2 < down[2] < 0.6
    assert down[3] == 0


# Blades -----------------------------------------------------------------------------------------------------


def _field(**tables):
    sowing = {"density_per_m2": 60.0, "full_density_m": 14.0}
    camera = {"position_m": [0.0, 11.0, 0.1], "target_m": [0.0, 0.0, 0.0], "fov_y_deg": 90.0}
    return small_scene(**{"sowing": sowing, "camera": camera, "force": [FLAT], **tables})


def _standing(drawn, blades, when: int = 0) -> np.ndarray:
    (page,) = drawn._world.field.pages
    return (read_poses(page)[:, when, 1] * up_of(blades)).sum(1) / blades["height"]


@pytest.mark.slow
@pytest.mark.parametrize("form", [None, "natural", "yan2024", "jahrmann2017"])
@pytest.mark.parametrize("simulated", [True, False], ids=["simulated", "analytic"])
def test_pressed_blades_lie_flat(renderer, form, simulated):
    within = {"within_m": 30.0 if simulated else 0.01, "settle_s": 1.5}
    # in the papers' forms weight alone lays these blades down
    simulation = form and {"form": form, "gravity_mps2": 0.5, **within}
    scene = _field(wind=[BREEZE] if form in (None, "natural") else [], simulation=simulation)
    drawn, free = renderer(scene), renderer(scene.model_copy(update={"force": ()}))
    for each in (drawn, free):
        each.advance(1.0)
    blades = read_blades(drawn._world.field)
    x, z = blades["root"][:, 0], blades["root"][:, 2]
    under, away = (np.abs(x) < 0.9) & (np.abs(z) < 0.6), (np.abs(x) > 2.5) & (np.hypot(x, z) < 6.0)
    assert under.sum() > 60
    assert (_standing(drawn, blades)[under] < 0.15).all()
    assert _standing(free, blades)[under].mean() > 0.6
    (page,), (other,) = drawn._world.field.pages, free._world.field.pages
    assert np.array_equal(read_poses(page)[away], read_poses(other)[away]), "nothing changes outside"
    v1, v2 = read_poses(page)[under, 0, 0], read_poses(page)[under, 0, 1]
    ratio = bezier.true_length(np.zeros_like(v1), v1, v2) / blades["height"][under]
    assert np.abs(ratio - 1).max() < 0.01
    assert (np.hypot(v2[:, 0], v2[:, 2]) > 0.85 * blades["height"][under]).mean() > 0.95
    assert ((v1 * up_of(blades)[under]).sum(1) < 0.2 * blades["height"][under]).all()


def test_they_lie_along_the_ground_on_slopes(renderer):
    drawn = renderer(_field(ground={**NOISE, "height_m": 6.0}))
    drawn.render(0.0)
    blades = read_blades(drawn._world.field)
    (page,) = drawn._world.field.pages
    root = blades["root"].astype(float)
    under = (np.abs(root[:, 0]) < 0.9) & (np.abs(root[:, 2]) < 0.6)
    heights = drawn._world.ground.heights
    tip = root[under] + read_poses(page)[under, 0, 1]
    above = tip[:, 1] - heights.height(tip[:, 0], tip[:, 2])
    assert (above > 0).mean() > 0.98
    assert (above < 0.2 * blades["height"][under]).mean() > 0.98


def test_blades_straight_up_lie_down_too(renderer):
    drawn = renderer(_field(grass=[{**GRASS, "tilt_deg": [0.0, 0.0], "bend": [0.0, 0.0]}]))
    drawn.render(0.0)
    blades = read_blades(drawn._world.field)
    under = (np.abs(blades["root"][:, 0]) < 0.9) & (np.abs(blades["root"][:, 2]) < 0.6)
    assert (_standing(drawn, blades)[under] < 0.15).all()


def test_pressed_blades_hardly_move_in_the_wind(renderer):
    gale = {**BREEZE, "speed_mps": 14.0, "turbulence": 1.0}
    drawn = renderer(_field(wind=[gale]))
    drawn.render(1.0)
    drawn.render(1.4)
    blades = read_blades(drawn._world.field)
    (page,) = drawn._world.field.pages
    poses = read_poses(page)
    moved = np.linalg.norm(poses[:, 0, 1] - poses[:, 1, 1], axis=1)
    x, z = blades["root"][:, 0], blades["root"][:, 2]
    under, away = (np.abs(x) < 0.9) & (np.abs(z) < 0.6), (np.abs(x) > 2.5) & (np.hypot(x, z) < 6.0)
    assert moved[under].max() < 0.1 * moved[away].mean()


def test_grass_on_objects_feels_nothing(renderer):
    box = {"kind": "box", "position_m": [0, 0, 0], "size_m": [2.0, 0.5, 2.0], "grass": {"density_per_m2": 200}}
    scene = _field(object=[box])
    with_, without = (renderer(each) for each in (scene, scene.model_copy(update={"force": ()})))
    for each in (with_, without):
        each.render(0.0)
    pages = [
        next(page for page in each._world.field.pages if page.object_index is not None) for each in (with_, without)
    ]
    assert np.array_equal(*(read_poses(page) for page in pages))


def test_where_a_blade_lies_that_is_pressed_down(device):
    """Along its lean, by its length; its middle nearer to the root and a little above the ground."""
    body = (
        "Blade b; b.height = 0.5; b.facing = 0.0; b.chance = packUnorm2x16(vec2(0.0, r));"
        " vec3 v1 = vec3(0.1, 0.25, 0.05), v2 = vec3(0.2, 0.4, 0.1);"
        " applyForce(b, vec3(0.0, 1.0, 0.0), vec3(0.0, -1.0, 0.0), v1, v2); "
    )
    given = {"r": np.array([0.0, 0.5, 1.0], np.float32)}
    middle, tip = (
        shader_call(device, "motion/force_map.glsl", f"{body} result = {v};", given, "vec3") for v in ("v1", "v2")
    )
    assert tip[:, 1] == pytest.approx(0.5 * (0.06 + 0.07 * given["r"]), abs=0.003)
    assert np.linalg.norm(tip, axis=1) == pytest.approx(0.5 * np.sqrt(0.94), abs=0.01)
    along = tip[:, [0, 2]] / np.linalg.norm(tip[:, [0, 2]], axis=1, keepdims=True)
    assert (middle[:, [0, 2]] * along).sum(1) == pytest.approx(0.5 * 0.45, abs=0.01)
    assert middle[:, 1] == pytest.approx(0.5 * 0.1, abs=1e-4)


# Pictures ---------------------------------------------------------------------------------------------------


_ASIDE_M = 2.0


def _above(technique: str, **tables):
    # from above, so that what lies shows its whole length
    # aside, so that no coordinate is pressed as another would be
    camera = {"position_m": [_ASIDE_M, 5.0, 0.01], "target_m": [_ASIDE_M, 0.0, 0.0], "fov_y_deg": 60.0}
    flat = {**FLAT, "path": [[x + _ASIDE_M, z] for x, z in FLAT["path"]]}
    return small_scene(
        **{"technique": {"name": technique}, "camera": camera, "force": [flat], "sowing": {"density_per_m2": 150.0}},
        **tables,
    )


@pytest.mark.slow
@pytest.mark.parametrize("technique", NAMES)
def test_pressed_grass_is_low_in_the_picture(renderer, technique):
    truths = []
    for scene in (_above(technique), _above(technique).model_copy(update={"force": ()})):
        drawn = renderer(scene, size=(192, 108))
        frame = drawn.render(aovs=["depth", "class"])
        points = world_points(drawn, scene.camera, frame.truth["depth"]) - [_ASIDE_M, 0.0, 0.0]
        truths.append((points, frame.truth["class"] == SurfaceClass.GRASS, frame))
    (pressed, grass, frame), (free, free_grass, bare) = truths
    inside = (np.abs(pressed[..., 0]) < 0.8) & (np.abs(pressed[..., 2]) < 0.6)
    assert (grass & inside).sum() > 200
    # what sinks as far as it bends (Derstroff, section 2.2) does not lie quite flat
    lowest_m = 0.14 if technique == "geometry-billboards" else 0.12
    assert np.quantile(pressed[grass & inside][:, 1], 0.98) < lowest_m
    assert (
        np.quantile(free[free_grass & (np.abs(free[..., 0]) < 0.8) & (np.abs(free[..., 2]) < 0.6)][:, 1], 0.98) > 0.25
    )
    outside = np.hypot(np.maximum(np.abs(free[..., 0]) - 1.0, 0.0), free[..., 2]) > 2.2
    assert outside.sum() > 3000
    assert np.array_equal(pressed[outside], free[outside])
    again = renderer(_above(technique), size=(192, 108)).render(aovs=["depth"])
    assert again.image.tobytes() == frame.image.tobytes(), "the same bytes"
    assert bare.image.tobytes() != frame.image.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("stored_m", [0.0, 3.0])
def test_blades_that_are_not_stored_lie_too(renderer, stored_m):
    scenes = [
        small_scene(
            force=[WALK, {**DRIVE, "speed_mps": 3.0}], wind=[BREEZE],
            sowing={"density_per_m2": 150.0, "full_density_m": 4.0, **extra},
        )
        for extra in ({}, {"stored_m": stored_m})
    ]  # fmt: skip
    here, there = (
        renderer(scene, size=(320, 180)).render(1.0, aovs=["class", "depth", "motion"]).truth for scene in scenes
    )
    assert (here["class"] == there["class"]).mean() > 0.998
    same = np.isclose(here["depth"], there["depth"], rtol=1e-4)
    assert same.mean() > 0.995
    assert np.isclose(here["motion"], there["motion"], atol=0.02).all(-1)[same].mean() > 0.995


@pytest.mark.slow
@pytest.mark.parametrize("technique", NAMES)
def test_motion_is_that_of_blades_being_pressed(renderer, technique):
    """The vehicle passes between the two frames; without wind, only what it presses moves."""
    drive = {**FLAT, "speed_mps": 5.0, "start_s": 1.0}
    drawn = renderer(_above(technique).model_copy(update={"force": (TypeAdapter(Force).validate_python(drive),)}))
    still = drawn.render(0.9, aovs=["motion", "class"])
    assert np.abs(still.truth["motion"][still.truth["class"] == SurfaceClass.GRASS]).max() < 0.05
    drawn.render(1.15)
    frame = drawn.render(1.25, aovs=["motion", "class", "depth"])
    assert np.abs(frame.truth["motion"][frame.truth["class"] == SurfaceClass.GRASS]).max() > 0.5
    late = [drawn.render(t, aovs=["motion", "class"]) for t in (3.0, 3.1)][1]
    assert np.abs(late.truth["motion"][late.truth["class"] == SurfaceClass.GRASS]).max() < 0.05


def test_the_previous_pose_is_that_of_the_previous_instant(renderer):
    drawn = renderer(_field(force=[{**FLAT, "speed_mps": 5.0}], wind=[BREEZE]))
    (first, second) = ([drawn.render(t), read_poses(drawn._world.field.pages[0])][1] for t in (0.2, 0.3))
    same = np.isclose(second[:, 1], first[:, 0], atol=2e-3).reshape(len(first), -1).all(axis=1)
    assert same.mean() > 0.99, "drivers may round the two instants apart, and a blade then fall to another side"
    assert np.abs(second[:, 0] - second[:, 1]).max() > 0.1


def test_a_caller_keeps_its_textures(ctx, device, renderer):
    drawn = renderer(_above(NAMES[0]))
    texture = ctx.texture_array((1, 1, 1), 4)
    texture.use(16)
    before = device.state.snapshot()
    drawn.render()
    assert device.state.snapshot() == before
    texture.release()


def test_a_scene_without_forces_holds_no_texture(device):
    none = Forces(device, small_scene())
    assert none.bindings == {}
    none.release()


def test_layers_share_the_size_of_the_largest():
    layers = [_layer(WALK), _layer(DRIVE)]
    pictures = force_pictures(layers)
    assert pictures.shape[1:3] == tuple(max(layer.texels.shape[axis] for layer in layers) for axis in (0, 1))
    assert force_values(layers)["count"] == 2


def test_far_from_the_origin_prints_are_as_sharp(force_at):
    near, far = ({**WALK, "path": [[x - 3.0, x + 1.0], [x + 3.0, x + 1.0]]} for x in (0.0, 10_240.0))
    p = np.random.default_rng(2).uniform(-2, 2, (300, 2)).astype(np.float32)
    p = (p + 10_240.0) - np.float32(10_240.0)  # what a float tells apart out there
    assert np.abs(force_at([near], p) - force_at([far], p + np.float32(10_240.0))).max() < 0.12


def test_the_camera_of_a_walk_sees_all_of_it(renderer):
    camera = Camera(position_m=(0.0, 2.0, 4.0), target_m=(0.0, 0.0, 0.0))
    scene = small_scene(force=[WALK, DRIVE])
    with_, without = (
        renderer(each).render(camera=camera) for each in (scene, scene.model_copy(update={"force": ()}))
    )
    assert (np.abs(with_.image.astype(int) - without.image).max(-1) > 8).mean() > 0.02
