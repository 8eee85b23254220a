"""What a host may ask, and what it may move: ground, rays, blades, light, objects in their places."""

import json

import numpy as np
import pytest

from greensward.passes.light import sun_at_ground, to_sun
from greensward.scene import Camera, InputError, SurfaceClass
from reprojection import world_points
from small_scenes import NOISE, small_scene

_SIZE = 64, 36
_BOX = {"kind": "box", "name": "crate", "position_m": [0.0, 0.0, 0.0], "size_m": [1.0, 0.8, 1.0]}


def test_heights_and_normals_of_the_ground(renderer):
    drawn = renderer(small_scene(ground=NOISE), size=_SIZE)
    x, z = np.random.default_rng(3).uniform(-30, 30, (2, 5, 7))
    height = drawn.ground_height(x, z)
    assert height.shape == (5, 7)
    normal = drawn.ground_normal(x, z)
    assert normal.shape == (5, 7, 3)
    assert np.allclose(np.linalg.norm(normal, axis=-1), 1.0)
    step = 0.3
    slope = (drawn.ground_height(x + step, z) - drawn.ground_height(x - step, z)) / (2 * step)
    assert np.corrcoef(slope.ravel(), (-normal[..., 0] / normal[..., 1]).ravel())[0, 1] > 0.9
    assert drawn.ground_height(1.0, 2.0).shape == ()


@pytest.mark.parametrize("technique", ["visibility-buffer", "bezier-blades", "billboard-grid"])
def test_a_ray_hits_what_the_picture_shows(renderer, technique):
    scene = small_scene(ground=NOISE, object=[_BOX], technique={"name": technique})
    drawn = renderer(scene, size=_SIZE)
    truth = drawn.render(1.0, aovs=["depth", "class", "blade_id"]).truth
    points = world_points(drawn, scene.camera, truth["depth"])
    eye = drawn._views.pictures[0].camera_ws
    rng, near, same = np.random.default_rng(4), 0, 0
    kinds = [SurfaceClass.SKY, SurfaceClass.GRASS]
    # rays through pictures of grass pass by chance, which is the pixel's
    for kind in kinds if technique == "billboard-grid" else [*kinds, SurfaceClass.OBJECT, SurfaceClass.GROUND]:
        rows, columns = np.nonzero(truth["class"] == kind)
        for i in rng.choice(len(rows), min(4, len(rows)), replace=False):
            at = rows[i], columns[i]
            if kind == SurfaceClass.SKY:
                assert drawn.hit(eye, (0.0, 1.0, 0.1)) is None
                continue
            hit = drawn.hit(eye, points[at] - eye)
            assert hit is not None
            if kind == SurfaceClass.OBJECT:
                assert (hit.object_index, hit.object_name, hit.surface) == (0, "crate", kind)
            if kind != SurfaceClass.GRASS:
                assert np.linalg.norm(hit.point_m - points[at]) < 2e-3 + 1e-3 * hit.distance_m
                assert (hit.blade_id, hit.blade) == (0, None)
                continue
            near += 1
            if hit.blade_id == int(truth["blade_id"][at]):
                same += 1
                if technique != "billboard-grid":
                    assert hit.blade
                    assert np.allclose(hit.blade.root_m, drawn.blade(hit.blade_id).root_m)
                    assert np.linalg.norm(hit.blade.root_m - hit.point_m) < 1.2 * hit.blade.height_m + 0.05
                    assert hit.blade.species == scene.grass[0].species
                    assert 0.2 < hit.blade.height_m < 0.7
    assert near
    # the fixed pipeline rounds corners to fractions of a pixel, of another picture each
    assert same >= near - (technique == "bezier-blades") or technique == "billboard-grid"
    # the picture goes on as it would have
    again = renderer(scene, size=_SIZE)
    again.render(1.0)
    assert np.array_equal(drawn.render(1.1).image, again.render(1.1).image)


def test_a_ray_that_is_none_is_refused(renderer):
    drawn = renderer(small_scene(), size=_SIZE)
    with pytest.raises(InputError, match=r"^direction: must not be zero"):
        drawn.hit((0, 1, 0), (0, 0, 0))
    for bad in ((0, 1), (0, np.nan, 0), "up"):
        with pytest.raises(InputError, match=r"^origin_m: must be three finite numbers"):
            drawn.hit(bad, (0, 1, 0))


def test_a_blade_by_its_id(renderer):
    scene = small_scene(object=[{**_BOX, "grass": {"density_per_m2": 200.0}}])
    drawn = renderer(scene, size=_SIZE)
    truth = drawn.render(1.0, aovs=["class", "blade_id"]).truth
    ids = np.unique(truth["blade_id"][truth["class"] == SurfaceClass.GRASS])
    found = [drawn.blade(int(each)) for each in ids]
    assert all(found)
    on_object = [each for each in found if each.object_index == 0]
    assert on_object
    assert all(np.abs(each.root_m[[0, 2]]).max() < 0.51 for each in on_object)
    assert len({tuple(each.root_m) for each in found}) == len(found)
    assert drawn.blade(0) is None
    assert drawn.blade(int(ids[0]) ^ (1 << 40)) is None


def test_light_that_a_host_may_light_with(renderer):
    scene = small_scene()
    drawn = renderer(scene, size=_SIZE)
    light = drawn.light()
    assert np.allclose(light.to_sun, to_sun(scene))
    assert np.allclose(light.sun_irradiance, sun_at_ground(scene))
    up, down = light.sky_irradiance([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    assert up[2] > 2.0 * down[2]
    assert up[2] > up[0], "blue"
    assert light.sky_irradiance((0.0, 1.0, 0.0)).shape == (3,)
    darker = scene.model_copy(update={"sun": scene.sun.model_copy(update={"elevation_deg": 3.0})})
    drawn.update(darker)
    assert drawn.light().exposure > light.exposure


# Objects that a host moves ---------------------------------------------------------------------------------------


def test_an_object_is_where_it_was_put(renderer):
    scene = small_scene(object=[_BOX], grass=[])
    drawn = renderer(scene, size=_SIZE, movable=["crate"])
    at_home = drawn.render(1.0).image
    assert np.array_equal(at_home, renderer(scene, size=_SIZE).render(1.0).image)
    matrix = np.eye(4)
    matrix[:3, 3] = 1.0, 0.2, -1.0
    drawn.place("crate", matrix)
    moved = {**_BOX, "position_m": [1.0, 0.2, -1.0]}
    there = renderer(small_scene(object=[moved], grass=[]), size=_SIZE).render(1.0).image
    assert np.array_equal(drawn.render(1.0).image, there)
    drawn.place("crate", (1.0, 0.2, -1.0))
    assert np.array_equal(drawn.render(1.0).image, there)


def test_an_object_moves_evenly_from_frame_to_frame(renderer):
    """So motion is as of a script that does the same."""
    scene = small_scene(object=[_BOX], grass=[])

    def way(time_s):
        return np.array([time_s, 0.0, -1.0 + 0.5 * time_s])

    drawn = renderer(scene, size=_SIZE, movable=["crate"])
    scripted = renderer(scene, size=_SIZE, scripts={"crate": way})
    for time_s in (1.0, 1.04, 1.1):
        drawn.place("crate", way(time_s))
        got = drawn.render(time_s, aovs=["motion"]).truth["motion"]
        expected = scripted.render(time_s, aovs=["motion"]).truth["motion"]
    assert np.abs(expected).max() > 0.3
    assert np.abs(got - expected).max() < 1e-3


def test_a_placed_object_presses_grass_down(renderer):
    ball = {
        "kind": "sphere",
        "name": "crate",
        "position_m": [0.0, 0.0, 0.0],
        "size_m": [1.2, 1.2, 1.2],
        "drawn": False,
    }
    scene = small_scene(object=[ball], simulation={"settle_s": 0.0})
    drawn = renderer(scene, size=_SIZE, movable=["crate"])
    away = renderer(scene, size=_SIZE, movable=["crate"])
    for step in range(4):
        drawn.place("crate", (0.0, 0.0, 1.0))
        away.place("crate", (50.0, 0.0, 50.0))
        pressed, free = drawn.render(step / 20), away.render(step / 20)
    assert (np.abs(pressed.image.astype(int) - free.image).max(axis=-1) > 16).mean() > 0.02


def test_the_first_call_for_another_object_builds_anew(renderer):
    scene = small_scene(object=[_BOX])
    drawn = renderer(scene, size=_SIZE)
    drawn.render(0.0)
    drawn.place("crate", (2.0, 0.0, -2.0))
    picture = drawn.render(0.1).image
    expected = renderer(scene, size=_SIZE, movable=["crate"])
    expected.place("crate", (2.0, 0.0, -2.0))
    assert np.array_equal(picture, expected.render(0.1).image)


def test_scenery_comes_and_goes_without_building_the_field_anew(renderer):
    def crates(*places):
        return [
            {**_BOX, "name": f"crate{i}", "position_m": place, "clears": False, "colour": "#aa3311"}
            for i, place in enumerate(places)
        ]

    tree = {**_BOX, "name": "tree", "position_m": [3.0, 0.0, -3.0]}
    places = [0.0, 0.0, 1.0], [1.5, 0.0, 0.0]
    drawn = renderer(small_scene(object=[tree, *crates(places[0])]), size=_SIZE)
    drawn.render(1.0)
    world = drawn._world
    both = small_scene(object=[tree, *crates(*places)])
    assert drawn.updates_in_place(both)
    drawn.update(both)
    assert np.array_equal(drawn.render(1.0).image, renderer(both, size=_SIZE).render(1.0).image)
    drawn.place("crate1", (-1.5, 0.0, 0.0))
    moved = small_scene(object=[tree, *crates(places[0], [-1.5, 0.0, 0.0])])
    assert np.array_equal(drawn.render(1.0).image, renderer(moved, size=_SIZE).render(1.0).image)
    fewer = small_scene(object=[tree])
    drawn.update(fewer)
    assert np.array_equal(drawn.render(1.0).image, renderer(fewer, size=_SIZE).render(1.0).image)
    drawn.update(both)
    assert np.array_equal(drawn.render(1.0).image, renderer(moved, size=_SIZE).render(1.0).image), "where it was put"
    assert drawn._world is world
    for anew in (small_scene(object=[]), small_scene(object=[{**tree, "position_m": [2.0, 0.0, 0.0]}])):
        assert not drawn.updates_in_place(anew)


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ((1.0, 2.0), "^place: crate: must be 3 finite numbers or a 4 × 4 matrix"),
        (np.full((4, 4), np.nan), "^place: crate: must be 3 finite numbers"),
        (np.diag([2.0, 2, 2, 1]), "^place: crate: must be a matrix that only turns and moves"),
        (np.diag([-1.0, 1, 1, 1]), "^place: crate: must be a matrix that only turns and moves"),
        ("there", "^place: crate: must be 3 finite numbers"),
    ],
)
def test_places_that_are_none(renderer, where, message):
    drawn = renderer(small_scene(object=[_BOX]), size=_SIZE, movable=["crate"])
    with pytest.raises(InputError, match=message):
        drawn.place("crate", where)


def test_names_that_no_object_has(renderer):
    with pytest.raises(InputError, match="no object of the scene is named 'box'; named are crate"):
        renderer(small_scene(object=[_BOX]), size=_SIZE, movable=["box"])
    drawn = renderer(small_scene(object=[_BOX]), size=_SIZE)
    picture = drawn.render(0.0).image
    with pytest.raises(InputError, match="no object of the scene is named 'box'; named are crate"):
        drawn.place("box", (0, 0, 0))
    assert np.array_equal(drawn.render(0.0).image, picture)
    with pytest.raises(InputError, match="is moved by its script"):
        renderer(small_scene(object=[_BOX]), size=_SIZE, scripts={"crate": lambda _: (0, 0, 0)}).place(
            "crate", (0, 0, 0)
        )


def test_the_record_of_the_camera_holds_k(renderer):
    drawn = renderer(small_scene(camera={"fx_px": 50.0, "cx_px": 20.0}), size=_SIZE)
    record = json.loads(str(drawn.render(aovs=["depth"]).truth["camera"]))
    assert record["camera_matrix"] == [[50.0, 0.0, 20.0], [0.0, 50.0, 17.5], [0.0, 0.0, 1.0]]
    assert (record["projection"], record["distortion"]) == ("perspective", [])


def test_a_place_may_be_a_point_and_then_a_matrix(renderer):
    """An object goes on evenly from one to the other, and from where the scene has it."""
    drawn = renderer(small_scene(object=[_BOX], grass=[]), size=_SIZE, movable=["crate"])
    drawn.render(1.0)
    drawn.place("crate", (0.2, 0.0, 0.0))
    assert np.abs(drawn.render(1.1, aovs=["motion"]).truth["motion"]).max() > 0.3
    matrix = np.eye(4)
    matrix[:3, 3] = 0.4, 0.0, 0.0
    drawn.place("crate", matrix)
    assert np.abs(drawn.render(1.2, aovs=["motion"]).truth["motion"]).max() > 0.3


def test_counts_are_those_of_the_picture_whatever_was_asked_since(renderer):
    drawn = renderer(small_scene(), size=_SIZE)
    counts = drawn.render(1.0).counts
    other = renderer(small_scene(), size=_SIZE)
    target = other.ctx.simple_framebuffer(_SIZE)
    other.draw(target, 1.0)
    other.hit((0.0, 1.3, 4.0), (0.0, -0.3, -1.0))
    assert other.counts == counts
    target.release()


def test_scripts_and_hosts_do_not_share_an_object(renderer):
    with pytest.raises(InputError, match="movable: crate: is moved by its script"):
        renderer(small_scene(object=[_BOX]), size=_SIZE, scripts={"crate": lambda _: (0, 0, 0)}, movable=["crate"])


@pytest.mark.parametrize(("x", "z"), [(np.nan, 0.0), (np.zeros(2), np.zeros(3)), ("a", 0.0)])
def test_points_that_are_none_are_refused(renderer, x, z):
    drawn = renderer(small_scene(), size=_SIZE)
    for ask in (drawn.ground_height, drawn.ground_normal):
        with pytest.raises(InputError, match=r"^x, z: must be"):
            ask(x, z)
    with pytest.raises(InputError, match=r"^blade_id: must be a whole number"):
        drawn.blade("x")


def test_a_ray_in_a_parallel_picture_hits_what_it_shows(renderer):
    scene = small_scene(ground=NOISE, object=[_BOX])
    camera = Camera(
        position_m=(0.0, 6.0, 4.0), target_m=(0.0, 0.0, 0.0), projection="orthographic", view_height_m=6.0
    )
    drawn = renderer(scene, size=_SIZE)
    truth = drawn.render(1.0, camera=camera, aovs=["depth", "class"]).truth
    view, same, count = drawn._views.pictures[0], 0, 0
    for row in range(2, 36, 6):
        for column in range(2, 64, 9):
            ndc = 2 * (column + 0.5) / 64 - 1, 1 - 2 * (row + 0.5) / 36
            start = view.starts_ws[0] + ndc[0] * view.starts_ws[1] + ndc[1] * view.starts_ws[2]
            hit = drawn.hit(start, view.axis_ws[:3])
            count += 1
            same += hit is not None and hit.surface == truth["class"][row, column]
    assert same >= 0.9 * count
