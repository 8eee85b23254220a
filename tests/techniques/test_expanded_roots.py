"""Expanded roots: each formula against its twin, both storages, extra blades, outlines, culling, bad input."""

from dataclasses import replace

import numpy as np
import pytest

from blades import BLADE
from greensward.aovs import AOVS
from greensward.scene import Camera, InputError, SceneError, SurfaceClass
from greensward.techniques import expanded_roots
from greensward.techniques.expanded_roots.textures import size_of
from oracles import trajectory
from reprojection import world_points
from shader_calls import shader_call
from small_scenes import BREEZE, GRASS, NOISE, small_scene

_FOLDER = "techniques/expanded_roots"
_GRASS = SurfaceClass.GRASS
_SMALL = 96, 54


def _scene(settings=None, **tables):
    return small_scene(technique={"name": "expanded-roots", **(settings or {})}, **tables)


def _random(count=300):
    random = np.random.default_rng(31)
    return {
        "speed": random.uniform(0.5, 4.0, count).astype(np.float32),
        "angle": random.uniform(0.1, 1.5, count).astype(np.float32),
        "gravity": random.uniform(0.0, 12.0, count).astype(np.float32),
        "time": random.uniform(0.0, 0.3, count).astype(np.float32),
    }


def _double(inputs):
    return {name: values.astype(np.float64) for name, values in inputs.items()}


# Formulas ---------------------------------------------------------------------------------------------------


def test_a_particle_on_its_trajectory(device):
    given = _random()
    got = shader_call(device, f"{_FOLDER}/trajectory.glsl", "particleAt(speed, angle, gravity, time)", given, "vec2")
    assert np.allclose(got, trajectory.particle(*_double(given).values()), atol=1e-6)


@pytest.mark.parametrize("intervals", [1, 2, 3])
def test_the_length_of_a_flight(device, intervals):
    given = _random()
    call = f"flightLength(speed, angle, gravity, time, {intervals})"
    got = shader_call(device, f"{_FOLDER}/trajectory.glsl", call, given, "float")
    assert np.allclose(got, trajectory.flight_length(*_double(given).values(), intervals), atol=1e-5)


def test_the_width_runs_from_root_to_top(device):
    point = np.arange(30, dtype=np.int32) % 3
    given = {"point": point, "root": _random(30)["speed"], "top": _random(30)["time"]}
    got = shader_call(device, f"{_FOLDER}/trajectory.glsl", "widthAt(point, 2, root, top)", given, "float")
    assert np.allclose(got, trajectory.width(given["point"], 2, given["root"], given["top"]), atol=1e-6)
    alone = shader_call(device, f"{_FOLDER}/trajectory.glsl", "widthAt(0, 0, root, top)", given, "float")
    assert np.array_equal(alone, given["root"].astype(np.float64))


def test_extra_blades_are_spread_over_the_area_of_a_root(device):
    given = {"k": np.arange(320, dtype=np.int32) % 8 + 1, "turn": np.linspace(0, 1, 320, dtype=np.float32)}
    got = shader_call(device, f"{_FOLDER}/extra.glsl", "offsetOf(k, 8, 0.5, turn)", given, "vec2")
    shape = np.ones(320)
    expected = trajectory.offset(given["k"], 8 * shape, 0.5 * shape, given["turn"].astype(np.float64))
    assert np.allclose(got, expected, atol=1e-5)
    # with the root in the middle they fill a disc of its area, a quarter of a square metre, evenly
    away = np.linalg.norm(got, axis=1)
    assert away.max() < np.sqrt(0.25 / np.pi)
    assert np.allclose(np.sort(away[:8]) ** 2 * np.pi / 0.25, (np.arange(1, 9) + 0.5) / 9, atol=1e-4)


def test_parts_of_neighbours(device):
    random = np.random.default_rng(3)
    a, b = random.uniform(0.3, 1.0, (2, 400, 2)).astype(np.float32)
    a[:, 0] *= -1.0
    given = {"place": random.uniform(-0.3, 0.7, (400, 2)).astype(np.float32), "a": a, "b": b}
    got = shader_call(device, f"{_FOLDER}/extra.glsl", "partsOf(place, a, b)", given, "vec2")
    assert np.allclose(got, trajectory.parts(*_double(given).values()), atol=1e-4)
    assert (got >= 0.0).all()
    assert (got.sum(axis=1) <= 1.0 + 1e-6).all()


def test_quadrants_go_around(device):
    angle = np.radians([45.0, 135.0, 225.0, 315.0]).astype(np.float32)
    got = shader_call(
        device, f"{_FOLDER}/extra.glsl", "quadrantOf(vec2(cos(angle), sin(angle)))", {"angle": angle}, "int"
    )
    assert got.tolist() == [0, 1, 2, 3]


# Both storages ----------------------------------------------------------------------------------------------

_BOX = {"kind": "box", "position_m": [0.0, 0.3, 0.0], "grass": {"density_per_m2": 60.0}}
_TABLES = {
    "wind": {"wind": [BREEZE], "ground": NOISE},
    "forces": {"force": [{"kind": "tracks", "path": [[-3, 0], [3, 0]]}], "simulation": {"within_m": 6.0}},
    "a moving object": {
        "object": [{**_BOX, "path": {"times_s": [0.0, 2.0], "positions_m": [[-1.0, 0.3, 0.0], [1.0, 0.3, 0.0]]}}]
    },
    "growth": {"growth": {"age": 0.3, "time_s": 8.0}},
    "no tests": {"culling": dict.fromkeys(("orientation", "frustum", "occlusion", "distance"), False)},
}


@pytest.mark.slow
@pytest.mark.parametrize("tables", _TABLES.values(), ids=_TABLES.keys())
def test_both_storages_are_the_same_picture_to_the_bit(renderer, tables):
    """Pictures stay alike as time goes on and the camera walks to where the field is sown anew."""
    frames = []
    for storage in ("vertex-buffer", "texture-array"):
        drawn = renderer(_scene({"storage": storage}, **tables), size=_SMALL)
        shown = [drawn.render(0.5, aovs=AOVS), drawn.render(1.0, aovs=AOVS)]
        for step in (1.0, 9.0):
            camera = Camera(position_m=(step, 1.3, 4.0), target_m=(step, 0.3, -3.0))
            shown.append(drawn.render(1.5, camera=camera, aovs=AOVS))
        frames.append(shown)
        drawn.release()
    for one, other in zip(*frames, strict=True):
        assert one.counts == other.counts
        assert one.counts.drawn > 500
        assert one.image.tobytes() == other.image.tobytes()
        for name in AOVS:
            assert np.array_equal(one.truth[name], other.truth[name], equal_nan=True), name


@pytest.mark.parametrize("extra", [0, 2])
def test_textures_wider_than_the_limit_fold_without_a_seam(renderer, device, monkeypatch, extra):
    settings = {"storage": "texture-array", "extra_blades": extra}
    frames, rows = [], []
    for limit in (device.limits.texture_px, 139):
        monkeypatch.setattr(expanded_roots.textures, "size_of", lambda roots, _, limit=limit: size_of(roots, limit))
        scene = _scene(settings, ground=NOISE, wind=[BREEZE], sowing={"density_per_m2": 20.0})
        drawn = renderer(scene, size=_SMALL)
        frames.append(drawn.render(1.0, aovs=AOVS))
        (filled,) = drawn._technique._textures._filled.values()
        assert filled.texture.width == min(limit, drawn._world.field.pages[0].capacity)
        rows.append(filled.texture.height)
        drawn.release()
    assert rows[1] > 10 * rows[0]
    assert frames[0].image.tobytes() == frames[1].image.tobytes()
    assert np.array_equal(frames[0].truth["blade_id"], frames[1].truth["blade_id"])


def test_only_tiles_that_come_are_written_to_textures(renderer):
    drawn = renderer(_scene({"storage": "texture-array"}), size=_SMALL)
    fill, written = drawn._technique._textures._fill, []
    run = fill.run
    fill.run = lambda groups, **values: (written.append(values["root_count"]), run(groups, **values))
    drawn.render(0.0)
    first = sum(written)
    assert first == drawn.blades
    written.clear()
    drawn.render(1.0)
    assert not written
    drawn.render(1.0, camera=Camera(position_m=(1.5, 1.3, 4.0), target_m=(1.5, 0.3, -3.0)))
    assert 0 < sum(written) < 0.5 * first


# Extra blades -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("storage", ["vertex-buffer", "texture-array"])
def test_each_root_has_as_many_blades_more(renderer, storage):
    frames = {}
    for extra in (0, 3, 8):
        drawn = renderer(_scene({"storage": storage, "extra_blades": extra}, ground=NOISE))
        frames[extra] = drawn.render(aovs=["class", "blade_id"])
        drawn.release()
    for extra, frame in frames.items():
        counts = frame.counts
        assert 0.9 < counts.drawn / (1 + extra) / frames[0].counts.drawn < 1.1
        ids = np.unique(frame.truth["blade_id"][frame.truth["class"] == _GRASS])
        assert ids.min() > 0
        # each part of the ids is that of one of the blades
        part = ids >> np.uint64(12) & np.uint64(15)
        assert set(part) == set(range(1 + extra))
    cover = [int((frame.truth["class"] == _GRASS).sum()) for frame in frames.values()]
    assert cover == sorted(cover)
    assert cover[-1] > 1.5 * cover[0]


def test_heights_from_neighbours_are_exact_on_a_paraboloid(device):
    random = np.random.default_rng(8)
    at, a, b = random.uniform(-1.0, 1.0, (3, 200, 2))
    curved = np.array([[0.4, 0.1], [0.1, -0.7]])

    def land(place):
        return 0.5 * np.einsum("ij,jk,ik->i", place, curved, place)

    parts = np.linalg.solve(np.stack([a, b], -1), at[:, :, None])[..., 0]
    heights = [trajectory.height(at, each, land(each), each @ curved) for each in (a, b)]
    assert np.allclose((parts * np.column_stack(heights)).sum(axis=1), land(at))
    given = {"at": at, "a": a, "above": land(a), "slope": a @ curved}
    given = {name: values.astype(np.float32) for name, values in given.items()}
    got = shader_call(device, f"{_FOLDER}/extra.glsl", "heightFrom(at, a, above, slope)", given, "float")
    assert np.allclose(got, trajectory.height(*_double(given).values()), atol=1e-5)


def test_the_normal_under_a_blade_is_that_of_the_land(device):
    """Sowing turns the up of a blade a third of the way from the vertical to the normal of the land."""
    normal = np.random.default_rng(2).normal(size=(200, 3))
    normal[:, 1] = np.abs(normal[:, 1]) + 0.2
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    up = 0.65 * np.array([0.0, 1.0, 0.0]) + 0.35 * normal
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    given = {"up": up.astype(np.float32)}
    assert np.allclose(
        shader_call(device, f"{_FOLDER}/roots.glsl", "normalUnder(up)", given, "vec3"), normal, atol=1e-5
    )


def _neighbours(drawn):
    """Roots of the only page, (n, 3), rows of a tile, and the neighbours of each root, (n, 4)."""
    (page,) = drawn._world.field.pages
    blades = np.frombuffer(page.blades.read(), BLADE)
    texture = drawn._technique._textures.of(page)
    layers = np.frombuffer(texture.read(), np.uint32).reshape(texture.layers, -1, 4)
    return blades["root"], page.tiles, layers[4]


def test_neighbours_are_near_on_four_sides_of_a_root_in_its_tile(renderer):
    settings = {"storage": "texture-array", "extra_blades": 1}
    drawn = renderer(_scene(settings, sowing={"density_per_m2": 30.0}), size=(32, 18))
    drawn.render()
    places, tiles, found = _neighbours(drawn)
    tile = int(np.argmax(tiles.up_to[:, 7]))
    rows = tiles.start[tile] + np.arange(tiles.up_to[tile, 7])
    there = found[rows] != 0xFFFFFFFF
    # at the edges of the tile some are missing
    assert there.mean() > 0.95
    assert np.isin(found[rows][there], rows).all()
    away = (places[np.where(there, found[rows], rows[:, None])] - places[rows][:, None])[..., [0, 2]]
    far = np.linalg.norm(away, axis=2)
    assert (far[there] > 0.0).all()
    assert np.median(far[there]) < 1.5 / np.sqrt(30.0)
    whole = there.all(axis=1)
    angle = np.sort(np.arctan2(away[whole][..., 1], away[whole][..., 0]), axis=1)
    # one in each quarter of the circle: next ones are less than half of it apart
    assert np.diff(angle, axis=1, append=angle[:, :1] + 2.0 * np.pi).max() < np.pi


@pytest.mark.parametrize("storage", ["vertex-buffer", "texture-array"])
def test_extra_blades_stand_on_the_land(renderer, storage):
    """On hills, of blades that lie: what shows of them is hardly above it. On a level with its root, one would be."""
    hills = {**NOISE, "height_m": 6.0, "wavelength_m": 16.0, "octaves": 1}
    drawn = renderer(
        _scene(
            {"storage": storage, "extra_blades": 8, "angle_deg": [10.0, 10.0], "gravity_mps2": 0.0},
            ground=hills,
            grass=[{**GRASS, "height_m": [0.15, 0.15], "width_m": [0.1, 0.1]}],
            sowing={"density_per_m2": 2.0, "reach_m": 40.0, "full_density_m": 50.0, "max_slope_deg": 80.0},
            camera={"position_m": [0.0, 22.0, 0.1], "target_m": [0.0, 0.0, 0.0]},
            shadows={"enabled": False},
        )
    )
    truth = drawn.render(aovs=["depth", "blade_id"]).truth
    extra = (truth["blade_id"] >> np.uint64(12) & np.uint64(15)) > 0
    points = world_points(drawn, drawn.scene.camera, truth["depth"])[extra]
    above = points[:, 1] - drawn._world.ground.heights.height(points[:, 0], points[:, 2])
    assert len(points) > 1000
    assert np.quantile(above, 0.95) < 0.15
    assert np.quantile(above, 0.05) > -0.05


def test_wind_bends_extra_blades(renderer):
    drawn = renderer(_scene({"extra_blades": 3}, wind=[{**BREEZE, "turbulence": 0.8}]))
    drawn.render(1.0)
    truth = drawn.render(1.1, aovs=["motion", "class", "blade_id"]).truth
    part = truth["blade_id"] >> np.uint64(12) & np.uint64(15)
    for k in range(4):
        here = (truth["class"] == _GRASS) & (part == k)
        assert np.quantile(np.linalg.norm(truth["motion"][here], axis=1), 0.8) > 0.1


@pytest.mark.parametrize("storage", ["vertex-buffer", "texture-array"])
def test_invocations_draw_the_same_as_a_loop(renderer, storage):
    frames = []
    for expansion in ("loop", "invocations"):
        settings = {"storage": storage, "extra_blades": 3, "expansion": expansion}
        drawn = renderer(_scene(settings, ground=NOISE, wind=[BREEZE]), size=_SMALL)
        frames.append(drawn.render(1.0, aovs=AOVS))
        drawn.release()
    assert frames[0].image.tobytes() == frames[1].image.tobytes()
    assert frames[0].counts == frames[1].counts


@pytest.mark.parametrize("extra", [0, 8])
def test_boxes_leave_room_for_extra_blades(renderer, extra):
    """Short blades beside sparse roots: none that shows is missing at the edges of the picture."""
    grass = [{**GRASS, "height_m": [0.03, 0.05]}]
    camera = {"position_m": [0.0, 2.0, 0.1], "target_m": [0.0, 0.0, 0.0]}
    scene = _scene(
        {"extra_blades": extra},
        grass=grass,
        sowing={"density_per_m2": 1.0},
        camera=camera,
        shadows={"enabled": False},
    )
    wide = renderer(scene, size=(96, 96)).render(aovs=["blade_id"])
    narrow_camera = scene.camera.model_copy(update={"fov_y_deg": 12.0})
    narrow = renderer(scene.model_copy(update={"camera": narrow_camera}), size=(64, 64)).render(aovs=["blade_id"])
    inside = np.unique(wide.truth["blade_id"][43:53, 43:53])
    assert np.isin(inside, np.unique(narrow.truth["blade_id"])).all()


# Outlines, levels, culling ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("levels_m", "triangles"), [((50.0, 50.0, 50.0), 5), ((0.0, 50.0, 50.0), 3), ((0.0, 0.0, 50.0), 1)]
)
def test_a_blade_has_seven_five_or_three_points_by_level(renderer, device, levels_m, triangles):
    drawn = renderer(_scene({"levels_m": levels_m}, shadows={"enabled": False}), size=_SMALL)
    query, draw = device.ctx.query(primitives=True), drawn._technique.draw

    def counted(view):
        with query:
            draw(view)

    drawn._technique.draw = counted
    blades = drawn.render().counts.drawn
    assert blades > 500
    assert query.primitives == triangles * blades


def test_levels_cover_alike(renderer):
    """An outline of fewer points is as much wider, and its tip is where it was."""
    cover = []
    for levels_m in ((50.0, 50.0, 50.0), (0.0, 50.0, 50.0), (0.0, 0.0, 50.0)):
        truth = renderer(_scene({"levels_m": levels_m, "angle_deg": [75.0, 75.0]})).render(aovs=["class"]).truth
        cover.append(int((truth["class"] == _GRASS).sum()))
    assert max(cover) < 1.06 * min(cover)


def test_nothing_grows_beyond_the_last_level_and_the_rim_is_smooth(renderer):
    """The radius leaves out whole tiles first, and then single blades."""
    far = {"position_m": [0.0, 3.0, 0.0], "target_m": [0.0, 0.0, -8.0]}
    tables = {"camera": far, "sowing": {"reach_m": 30.0, "full_density_m": 100.0}, "wind": []}
    drawn = renderer(_scene({"levels_m": [3.0, 6.0, 9.0], "fade": 0.0}, **tables))
    frame = drawn.render(aovs=["class", "depth"])
    commands = sum(part.count for parts in drawn._technique._parts.values() for part in parts)
    points = world_points(drawn, drawn.scene.camera, frame.truth["depth"])[frame.truth["class"] == _GRASS]
    eye = np.array([0.0, 3.0, 0.0])
    away = np.linalg.norm(points - eye, axis=1)
    # a blade's tip is nearer or farther than its root by its height
    assert 8.5 < away.max() < 9.0 + 0.7
    all_ = renderer(_scene({"levels_m": [3.0, 6.0, 100.0], "fade": 0.0}, **tables))
    whole = all_.render()
    assert commands < sum(part.count for parts in all_._technique._parts.values() for part in parts)
    assert 200 < frame.counts.drawn < 0.8 * whole.counts.drawn


def test_the_angle_of_launch_leans_blades(renderer):
    heights = []
    for angle in (35.0, 85.0):
        scene = _scene({"angle_deg": [angle, angle]}, sowing={"density_per_m2": 6.0})
        drawn = renderer(scene)
        truth = drawn.render(aovs=["class", "depth"]).truth
        heights.append(
            np.quantile(world_points(drawn, scene.camera, truth["depth"])[truth["class"] == _GRASS][:, 1], 0.98)
        )
    assert heights[0] < 0.75 * heights[1]


# Bad input --------------------------------------------------------------------------------------------------

_REFUSED = {
    "zero points": ({"points": [0, 0, 0]}, r"technique\.points\[0\]: must be at least 3 \(got 0\)"),
    "even points": ({"points": [6, 5, 3]}, r"technique\.points: must be odd"),
    "rising points": ({"points": [3, 5, 7]}, r"technique\.points: must not rise"),
    "a trajectory in the ground": (
        {"speed_mps": 0.2},
        r"technique: the trajectory must leave the ground: launched at 0\.2 m/s and 48 degrees, .*; raise speed_mps",
    ),
    "negative widths": ({"root_width": -1.0}, r"technique\.root_width: must be at least 0.01 \(got -1\.0\)"),
    "negative top": ({"top_width": -0.5}, r"technique\.top_width: must be at least 0 \(got -0\.5\)"),
    "no width": ({"root_width": 0.0}, r"technique\.root_width: must be at least 0.01 \(got 0\.0\)"),
    "no level": ({"levels_m": [0.0, 0.0, 0.0]}, r"technique\.levels_m: must end above 0"),
    "too many": ({"extra_blades": 9}, r"technique\.extra_blades: must be at most 8 \(got 9\)"),
    "falling levels": ({"levels_m": [5.0, 3.0, 8.0]}, r"technique\.levels_m: must not fall"),
    "a storage": ({"storage": "buffer"}, r"technique\.storage: must be one of vertex-buffer, texture-array"),
}


@pytest.mark.parametrize(("settings", "message"), _REFUSED.values(), ids=_REFUSED.keys())
def test_what_makes_no_blade_is_refused(renderer, settings, message):
    with pytest.raises(SceneError, match=message):
        renderer(_scene(settings))


def test_more_roots_than_a_texture_holds_are_refused(renderer, device, monkeypatch):
    monkeypatch.setattr(device, "limits", replace(device.limits, texture_px=40))
    drawn = renderer(_scene({"storage": "texture-array"}), size=(32, 18))
    with pytest.raises(
        InputError, match=r'technique\.storage: must be "vertex-buffer" for more than 1,600 roots.*; or'
    ):
        drawn.render()


def test_more_roots_than_memory_holds_are_refused(renderer, monkeypatch):
    monkeypatch.setattr(expanded_roots.textures, "available_bytes", lambda _: 1000)
    drawn = renderer(_scene({"storage": "texture-array"}), size=_SMALL)
    with pytest.raises(InputError, match=r'technique\.storage: must be "vertex-buffer" here: .* GiB'):
        drawn.render()


def test_more_blades_than_can_be_numbered_are_refused(renderer, monkeypatch):
    monkeypatch.setattr(expanded_roots.ExpandedRoots, "_most_roots", 2222)
    drawn = renderer(_scene({"extra_blades": 8}), size=_SMALL)
    with pytest.raises(InputError, match=r"technique\.extra_blades: must leave a number for each blade, of 2,222"):
        drawn.render()
