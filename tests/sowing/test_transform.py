"""Blades that move with their object, and that grow."""

from itertools import pairwise

import numpy as np
import pytest

from blades import BLADE, points, read_blades, up_of
from greensward.scene import Growth
from greensward.sowing.growth import GROWTH_BLOCK, curve_rows
from oracles import growing
from shader_calls import shader_call
from small_scenes import GRASS, NOISE, small_scene

_BALL = {
    "kind": "sphere",
    "position_m": [0.0, 0.0, 0.0],
    "size_m": [1.0, 1.2, 0.8],
    "grass": {"density_per_m2": 500.0},
}
_GROWTH = {
    "age": 0.1,
    "time_s": 20.0,
    "spread": 0.4,
    "height": [[0.0, 0.0], [0.3, 0.7], [0.6, 0.8], [1.0, 1.5]],
    "width": [[0.2, 0.3], [0.9, 1.2]],
    "stiffness": [[0.5, 0.4]],
}


def _rigid(seed: int) -> np.ndarray:
    """Some turn and shift, (4, 4)."""
    random = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(random.standard_normal((3, 3)))
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.sign(np.linalg.det(turn))
    matrix[:3, 3] = random.uniform(-5, 5, 3)
    return matrix


def _page(field):
    (page,) = (page for page in field.pages if page.object_index == 0)
    return page


def _now(page) -> np.ndarray:
    return np.frombuffer(page.blades.read(), BLADE)[page.tiles.rows()]


def _sown(page) -> np.ndarray:
    return np.frombuffer(page.sown.read(), BLADE)[page.tiles.rows()]


# Moved ------------------------------------------------------------------------------------------------------


def test_until_its_object_is_placed_a_blade_is_as_it_was_sown(sow):
    page = _page(sow(small_scene(object=[_BALL], growth=_GROWTH)))
    assert _now(page).tobytes() == _sown(page).tobytes()
    assert np.array_equal(page.previous_from_now, np.eye(4))


@pytest.mark.parametrize("seed", range(4))
def test_blades_are_moved_whole(sow, seed):
    field = sow(small_scene(object=[_BALL]))
    page, matrix = _page(field), _rigid(seed)
    field.transform(matrix[None], 0.0)
    was, now = _sown(page), _now(page)
    for before, after in zip(points(was), points(now), strict=True):
        np.testing.assert_allclose(after, growing.moved(before, matrix), atol=3e-6)
    np.testing.assert_allclose(up_of(now), up_of(was) @ matrix[:3, :3].T, atol=2e-4)
    before = growing.front(up_of(was), was["facing"].astype(np.float64))
    after = growing.front(up_of(now), now["facing"].astype(np.float64))
    np.testing.assert_allclose(after, before @ matrix[:3, :3].T, atol=1e-3)
    for name in ("height", "width", "stiffness", "flags", "rank_root", "random"):
        assert np.array_equal(was[name], now[name]), name


def test_tiles_go_along(sow):
    field = sow(small_scene(object=[_BALL]))
    page = _page(field)
    for seed in range(3):
        field.transform(_rigid(seed)[None], 0.0)
        tile = np.repeat(np.arange(len(page.tiles.start)), page.tiles.up_to[:, 7])
        for p in points(_now(page)):
            assert (p >= page.tiles.low[tile] - 1e-4).all()
            assert (p <= page.tiles.high[tile] + 1e-4).all()
        np.testing.assert_allclose(page.tiles.centre, 0.5 * (page.tiles.low + page.tiles.high))


def test_where_a_point_was_before(sow):
    field = sow(small_scene(object=[_BALL, {**_BALL, "position_m": [1.0, 0.0, 0.0]}]))
    one, two = (next(page for page in field.pages if page.object_index == k) for k in (0, 1))
    placed = [np.stack([_rigid(seed), _rigid(9)]) for seed in range(3)]
    field.transform(placed[0], 0.0)
    assert np.array_equal(one.previous_from_now, np.eye(4)), "it was nowhere before"
    for earlier, later in pairwise(placed):
        before = _now(one)["root"].astype(np.float64)
        field.transform(later, 0.0)
        now = _now(one)["root"].astype(np.float64)
        np.testing.assert_allclose(growing.moved(now, one.previous_from_now), before, atol=1e-5)
        np.testing.assert_allclose(one.previous_from_now @ later[0], earlier[0], atol=1e-12)
        assert np.array_equal(two.previous_from_now, np.eye(4))
    field.transform(placed[-1], 0.0)
    assert np.array_equal(one.previous_from_now, np.eye(4)), "it stayed"
    assert all(np.array_equal(page.previous_from_now, np.eye(4)) for page in field.pages if page.object_index is None)


def test_nothing_is_written_where_nothing_changed(sow):
    field = sow(small_scene(object=[_BALL]))
    page, matrix = _page(field), _rigid(1)
    field.transform(matrix[None], 0.0)
    tiles = page.tiles
    page.blades.clear()
    field.transform(matrix[None].copy(), 7.0)
    assert not np.frombuffer(page.blades.read(), np.uint8).any()
    assert page.tiles is tiles
    field.transform(_rigid(2)[None], 7.0)
    assert (_now(page)["height"] > 0).all()


def test_the_matrix_may_be_changed_in_place(sow):
    field = sow(small_scene(object=[_BALL]))
    placed = np.eye(4)[None].copy()
    field.transform(placed, 0.0)
    placed[0, 0, 3] = 2.0
    field.transform(placed, 0.0)
    assert _now(_page(field))["root"][:, 0].mean() == pytest.approx(2.0, abs=0.05)
    assert _page(field).previous_from_now[0, 3] == -2.0


def test_the_ground_is_left_alone(sow):
    field = sow(small_scene(object=[_BALL], ground=NOISE))
    ground = [page for page in field.pages if page.object_index is None]
    before = [page.blades.read() for page in ground]
    field.transform(_rigid(3)[None], 5.0)
    assert [page.blades.read() for page in ground] == before
    assert all(page.sown is None for page in ground)


def test_more_matrices_than_objects_with_grass(sow):
    field = sow(small_scene(object=[{"kind": "box", "position_m": [0, 0, 0]}, _BALL]))
    (page,) = (page for page in field.pages if page.object_index is not None)
    assert page.object_index == 1
    field.transform(np.stack([np.eye(4), _rigid(1), np.eye(4)]), 0.0)
    np.testing.assert_allclose(points(_now(page))[0], growing.moved(points(_sown(page))[0], _rigid(1)), atol=3e-6)


# Grown ------------------------------------------------------------------------------------------------------


def test_age_and_curves_are_those_of_the_twin(device):
    growth = Growth(**_GROWTH)
    random = np.random.default_rng(2)
    root = random.uniform(-50, 50, (2000, 3)).astype(np.float32)
    phase = random.uniform(-0.2, 1.6, 2000).astype(np.float32)
    blocks = {GROWTH_BLOCK: {"keys": curve_rows(growth), "spread": 0.4}}
    got = shader_call(
        device, "sowing/growth.glsl", "ageOf(root, phase)", {"root": root, "phase": phase}, "float", blocks=blocks
    )
    expected = np.clip(phase - 0.4 * growing.lateness(root), 0, 1)
    np.testing.assert_allclose(got, expected, atol=1e-6)
    age = np.concatenate([np.linspace(0, 1, 501), [0.3, 0.6]]).astype(np.float32)
    for number, name in enumerate(("height", "width", "stiffness")):
        got = shader_call(
            device, "sowing/growth.glsl", f"curveAt({number}, age)", {"age": age}, "float", blocks=blocks
        )
        np.testing.assert_allclose(got, growing.factor(getattr(growth, name), age), atol=1e-5)


@pytest.mark.parametrize("time_s", [0.0, 3.0, 11.0, 18.0, 1e9])
def test_blades_grow_with_time(sow, time_s):
    field = sow(small_scene(object=[_BALL], growth=_GROWTH, ground=NOISE))
    field.transform(np.eye(4)[None], time_s)
    was = np.concatenate([_sown(page) for page in field.pages])
    now = read_blades(field)
    age = growing.age(was["root"], 0.1, time_s, 20.0, 0.4)
    factors = {
        name: growing.factor(getattr(Growth(**_GROWTH), name), age) for name in ("height", "width", "stiffness")
    }
    tall = np.maximum(factors["height"], 1e-4 / was["height"])
    np.testing.assert_allclose(now["height"], was["height"] * tall, rtol=3e-4)
    np.testing.assert_allclose(now["width"], was["width"] * factors["width"], rtol=2e-4)
    np.testing.assert_allclose(now["stiffness"], np.clip(was["stiffness"] * factors["stiffness"], 0, 1), rtol=2e-4)
    root, control, tip = points(was)
    for before, after in ((control, points(now)[1]), (tip, points(now)[2])):
        np.testing.assert_allclose(after, root + tall[:, None] * (before - root), atol=2e-5)
    if time_s == 1e9:
        assert (age == 1).all()
    else:
        assert np.ptp(age) > 0.05


def test_seeds_are_nothing_and_yet_numbers(sow):
    field = sow(small_scene(growth={}))
    field.transform(np.zeros((0, 4, 4)), 0.0)
    blades = read_blades(field)
    assert len(blades) > 1000
    assert blades["height"].max() <= 1.001e-4
    for name in ("root", "control", "tip", "facing", "height", "width", "stiffness"):
        assert np.isfinite(blades[name]).all()
    root, _, tip = points(blades)
    assert (np.linalg.norm(tip - root, axis=1) > 0).all(), "no direction"


def test_full_grown_from_the_start_is_as_sown(sow):
    field = sow(small_scene(growth={"age": 1.0}))
    (page,) = field.pages
    before = _sown(page)
    field.transform(np.zeros((0, 4, 4)), 0.0)
    now = read_blades(field)
    for name in ("height", "width", "stiffness"):
        np.testing.assert_allclose(now[name], before[name], rtol=1e-6)


def test_growth_goes_on_where_the_ground_is_sown_anew(sow):
    field = sow(small_scene(growth={"age": 0.4}))
    nothing = np.zeros((0, 4, 4))
    field.transform(nothing, 5.0)
    before = {bytes(blade["root"]): blade["height"] for blade in read_blades(field)}
    field.sow((1.0, 0.0, 0.5), 0.0)
    field.transform(nothing, 5.0)
    after = {bytes(blade["root"]): blade["height"] for blade in read_blades(field)}
    both = before.keys() & after.keys()
    assert len(both) > 1000
    assert all(before[root] == after[root] for root in both)


def test_nothing_is_written_once_all_are_grown(sow):
    field = sow(small_scene(growth={"time_s": 10.0, "spread": 0.5}))
    nothing = np.zeros((0, 4, 4))
    field.transform(nothing, 15.0)
    (page,) = field.pages
    page.blades.clear()
    field.transform(nothing, 99.0)
    assert not np.frombuffer(page.blades.read(), np.uint8).any()
    field.transform(nothing, 14.0)
    assert (_now(page)["height"] > 0).all()


def test_taller_than_sown_still_lies_in_its_tile(sow):
    field = sow(small_scene(growth={"age": 1.0, "height": [[1.0, 10.0]]}, grass=[{**GRASS, "tilt_deg": [0.0, 80.0]}]))
    field.transform(np.zeros((0, 4, 4)), 0.0)
    (page,) = field.pages
    tip = points(_now(page))[2]
    tile = np.repeat(np.arange(len(page.tiles.start)), page.tiles.up_to[:, 7])
    assert _now(page)["height"].min() >= 3.0
    assert (tip >= page.tiles.low[tile]).all()
    assert (tip <= page.tiles.high[tile]).all()


def test_a_field_without_either_has_no_second_buffer(sow):
    field = sow(small_scene())
    assert field._transform is None
    before = read_blades(field).tobytes()
    field.transform(np.zeros((0, 4, 4)), 1.0)
    assert read_blades(field).tobytes() == before
    assert all(page.sown is None for page in field.pages)
