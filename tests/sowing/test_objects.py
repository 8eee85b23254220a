"""Grass on objects: everywhere alike on every side, where it may grow, the same each time."""

from dataclasses import replace

import numpy as np
import pytest

from blades import BLADE, has_head, points, read_blades, up_of
from greensward.scene import InputError
from greensward.sowing import field as field_module
from greensward.sowing import sower as sower_module
from greensward.sowing.objects import grassy_objects
from live_objects import live_objects
from small_scenes import GRASS, NOISE, small_scene, with_pictures

_EVEN = {"drift": 0.0, "clumping": 0.0}
_NOWHERE = {"kind": "none"}


def _thing(kind="sphere", density=800.0, **keys):
    fur = {"density_per_m2": density, **keys.pop("fur", {})}
    return {"kind": kind, "position_m": [0.0, 0.0, 0.0], "grass": fur, **keys}


def _alone(*things, **tables):
    """A scene of objects without ground."""
    return small_scene(object=list(things), ground=_NOWHERE, **{"sowing": _EVEN, **tables})


def _of(field, thing):
    parts = [np.frombuffer(page.blades.read(), BLADE) for page in field.pages if page.object_index == thing]
    return np.concatenate([np.zeros(0, BLADE), *parts])


def _rank(blades):
    return (blades["rank_root"] / 65535.0) ** 2


def _mesh(folder, triangles, colours=None, uv=None):
    """An OBJ file of these corners (m, 3, 3), its density in the red of colours (m, 3)."""
    pytest.importorskip("trimesh")
    lines = []
    for k, corner in enumerate(triangles.reshape(-1, 3)):
        red = "" if colours is None else f" {colours.reshape(-1)[k]} 0 1"
        lines.append(f"v {' '.join(map(str, corner))}{red}")
    if uv is not None:
        lines += [f"vt {u} {v}" for u, v in uv.reshape(-1, 2)]
    for k in range(len(triangles)):
        at = [3 * k + i + 1 for i in range(3)]
        lines.append("f " + " ".join(f"{i}/{i}" if uv is not None else str(i) for i in at))
    (folder / "mesh.obj").write_text("\n".join(lines))
    return {"kind": "mesh", "file": "mesh.obj"}


# Where ------------------------------------------------------------------------------------------------------


def _unequal():
    """Thirty triangles side by side, upright and turned, the largest five thousand times the smallest."""
    random = np.random.default_rng(1)
    triangles, left = [], 0.0
    for area in np.geomspace(0.001, 5.0, 30):
        wide = np.sqrt(2 * area) * random.uniform(0.4, 2.5)
        tall, turn = 2 * area / wide, random.uniform(0, np.pi)
        triangles.append(
            [[left, 0, 0], [left + wide, 0, 0], [left + 0.3 * wide, tall * np.cos(turn), tall * np.sin(turn)]]
        )
        left += wide + 0.1
    return np.array(triangles)


@pytest.mark.parametrize("part", [0.06, 0.25, 1.0])
def test_every_prefix_is_spread_evenly_over_unequal_triangles(sow, tmp_path, part):
    triangles = _unequal()
    areas = 0.5 * np.linalg.norm(
        np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
    )
    scene = _alone(_thing(**_mesh(tmp_path, triangles), density=700.0)).in_folder(tmp_path)
    blades = _of(sow(scene), 0)
    assert len(blades) == pytest.approx(700 * areas.sum(), abs=2)
    blades = blades[_rank(blades) <= part]
    left = triangles[:, 0, 0] - 0.5 * (triangles[:, 0, 0].min() + triangles[:, 1, 0].max())
    at = np.searchsorted(left - 0.05, blades["root"][:, 0]) - 1
    expected = 700 * part * areas
    off = (np.bincount(at, minlength=30) - expected) / np.sqrt(np.maximum(expected, 1))
    assert np.abs(off).max() < 4
    assert (off**2).mean() < 1.5


def test_evenly_within_a_triangle_and_no_lattice(sow, tmp_path):
    triangle = np.array([[[-1.0, 0, 0], [1, 0, 0], [-1, 2, 0]]])
    scene = _alone(_thing(**_mesh(tmp_path, triangle), density=2000.0)).in_folder(tmp_path)
    root = _of(sow(scene), 0)["root"].astype(np.float64)
    inside = (root[:, 0] + 1 + root[:, 1]) < 2 + 1e-5
    assert inside.all()
    assert np.abs(root[:, 2]).max() < 1e-6
    counts = np.histogram2d(root[:, 0], root[:, 1], bins=10, range=[[-1, 1], [0, 2]])[0]
    full = counts[np.add.outer(np.arange(10), np.arange(10)) < 9]  # squares wholly inside
    assert full.mean() == pytest.approx(2000 * 0.04, rel=0.03)
    assert full.std() < 1.1 * np.sqrt(full.mean())
    apart = np.linalg.norm(root[:500, None] - root[None], axis=2)
    np.fill_diagonal(apart, 9.0)
    assert apart.min(axis=1).std() > 0.2 * apart.min(axis=1).mean(), "a lattice"


def test_a_ball_has_grass_on_every_side_along_its_normals(sow):
    field = sow(_alone(_thing(size_m=[2.0, 2.0, 2.0])))
    blades = _of(field, 0)
    from_middle = blades["root"].astype(np.float64) - [0, 1, 0]
    away = np.linalg.norm(from_middle, axis=1)
    assert len(blades) == pytest.approx(800 * 4 * np.pi, rel=0.002)
    assert away.min() > 0.9985  # between the corners of the facets
    assert away.max() < 1.0001
    assert np.abs(up_of(blades) - from_middle / away[:, None]).max() < 1e-3
    # zones of equal height have equal area (Archimedes)
    zones = np.histogram(from_middle[:, 1], bins=10, range=(-1, 1))[0]
    assert np.abs(zones - len(blades) / 10).max() < 4 * np.sqrt(len(blades) / 10)
    root, control, tip = points(blades)
    assert np.einsum("ij,ij->i", tip - root, up_of(blades)).min() > 0
    assert blades["height"].min() >= 0.3 - 1e-5
    assert blades["height"].max() <= 0.6 + 1e-5
    assert np.isfinite(control).all()


def test_ceilings_and_walls_of_a_box(sow):
    blades = _of(sow(_alone(_thing("box", 300.0, size_m=[4.0, 3.0, 2.0]))), 0)
    up = np.round(up_of(blades)).astype(int)
    assert np.abs(up_of(blades) - up).max() < 1e-3
    for axis, area in ((0, 6.0), (1, 8.0), (2, 12.0)):
        for sign in (-1, 1):
            here = blades[up[:, axis] == sign]
            assert len(here) == pytest.approx(300 * area, abs=4 * np.sqrt(300 * area))
            side = {0: 2.0, 1: 1.5, 2: 1.0}[axis]
            middle = 1.5 if axis == 1 else 0.0
            assert np.abs(here["root"][:, axis] - middle - sign * side).max() < 1e-5


def test_turned_and_placed_objects_are_sown_in_their_own_space(sow):
    both = [
        read_blades(sow(_alone(_thing("capsule", **where))))
        for where in ({}, {"position_m": [9.0, 2.0, 1.0], "yaw_deg": 50.0, "pitch_deg": -35.0, "roll_deg": 20.0})
    ]
    assert len(both[0]) > 500
    assert both[0].tobytes() == both[1].tobytes()


# Density ----------------------------------------------------------------------------------------------------


def test_density_follows_the_red_of_vertex_colours(sow, tmp_path):
    triangles = np.array([[[4.0 * k, 0, 0], [4.0 * k + 2, 0, 0], [4.0 * k, 2, 0]] for k in range(3)])
    colours = np.array([[0.0] * 3, [0.5] * 3, [1.0] * 3])
    mesh = _mesh(tmp_path, triangles, colours)
    painted, plain = (
        _of(sow(_alone(_thing(**mesh, fur={"density_from": source})).in_folder(tmp_path)), 0)["root"][:, 0]
        for source in ("colours", "everywhere")
    )
    counts = [np.histogram(x, bins=[-5, -2, 2, 6])[0] for x in (painted, plain)]
    assert counts[0][0] == 0
    assert counts[0][1] == pytest.approx(800, abs=4 * 20)
    assert counts[0][2] == pytest.approx(1600, abs=2)
    assert counts[1] == pytest.approx([1600] * 3, abs=6)


def test_density_follows_a_picture_over_the_texture_coordinates(sow, tmp_path):
    pixels = np.zeros((64, 64, 3), np.uint8)
    pixels[:32, :, 0] = 255  # its upper half
    fur = {"density_map": "d.png"}
    for thing in (_thing("cylinder", fur=fur), _thing("sphere", fur=fur, size_m=[1.0, 1.0, 1.0])):
        scene = with_pictures(
            tmp_path, {"d.png": pixels}, object=[thing], ground=_NOWHERE, sowing=_EVEN, grass=[GRASS]
        )
        y = _of(sow(scene), 0)["root"][:, 1]
        assert len(y) > 300
        assert y.min() > 0.47


def test_what_density_is_taken_from_must_be_there(sow, tmp_path):
    mesh = _mesh(tmp_path, np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]]))
    with pytest.raises(InputError, match=r"^object\[0\]\.grass\.density_from: the object has no vertex colours"):
        sow(small_scene(object=[{**_thing(**mesh), "grass": {"density_from": "colours"}}]).in_folder(tmp_path))
    scene = with_pictures(
        tmp_path,
        {"d.png": np.zeros((2, 2, 3), np.uint8)},
        object=[{**_thing(**mesh), "grass": {"density_map": "d.png"}}],
    )
    with pytest.raises(InputError, match=r"^object\[0\]\.grass\.density_map: the mesh has no texture coordinates"):
        sow(scene)


def test_maps_and_slopes_of_the_ground_do_not_apply(sow, tmp_path):
    black = np.zeros((4, 4, 3), np.uint8)
    thing = _thing("box")
    scene = with_pictures(
        tmp_path, {"d.png": black}, object=[thing], sowing={**_EVEN, "density_map": "d.png", "max_slope_deg": 1.0}
    )
    field = sow(scene)
    assert {page.object_index for page in field.pages} == {0}
    assert field.count == pytest.approx(800 * 6, abs=2)


def test_drifts_change_density_on_all_sides(sow):
    thing = _thing("box", 500.0, size_m=[4.0, 4.0, 4.0])
    blades = _of(sow(_alone(thing, sowing={**_EVEN, "drift": 1.0, "drift_m": 1.5})), 0)
    up = np.round(up_of(blades)).astype(int)
    for axis in range(3):
        wall = blades["root"][up[:, axis] == 1]
        other = [k for k in range(3) if k != axis]
        counts = np.histogram2d(wall[:, other[0]], wall[:, other[1]], bins=8)[0]
        spread = counts.std() / np.sqrt(counts.mean())
        # neither along rows nor along columns does it stay the same, as streaks would
        assert spread > 1.6
        for way in (0, 1):
            assert (counts - counts.mean(axis=way, keepdims=True)).std() > 0.35 * counts.std()


@pytest.mark.parametrize("nothing", [{"grass": []}, {"grass": [{**GRASS, "share": 0.0}]}])
def test_no_species_no_blades(sow, nothing):
    assert sow(_alone(_thing(), **nothing)).count == 0
    assert sow(_alone(_thing(density=0.0))).pages == []
    assert sow(_alone({"kind": "box", "position_m": [0, 0, 0]})).pages == []


# Always the same --------------------------------------------------------------------------------------------


def test_same_seed_same_bytes_and_like_objects_are_not_alike(sow):
    two = _alone(_thing(), _thing(), sowing={"drift": 0.7, "clumping": 0.8})
    fields = [sow(two), sow(two), sow(small_scene(seed=6, object=[_thing()], ground=_NOWHERE))]
    bytes_of = [[_of(field, thing).tobytes() for thing in (0, 1)] for field in fields]
    assert bytes_of[0] == bytes_of[1]
    assert len({*bytes_of[0], bytes_of[2][0]}) == 3
    roots = [set(map(bytes, _of(fields[0], thing)["root"])) for thing in (0, 1)]
    assert not roots[0] & roots[1]


def test_objects_come_first_and_stay_where_the_ground_streams(sow):
    scene = small_scene(object=[_thing(), _thing("box")], ground=NOISE)
    field = sow(scene)

    def state():
        return [
            (page, page.first_number, page.blades.read()) for page in field.pages if page.object_index is not None
        ]

    before = state()
    assert [page.object_index for page in field.pages[: len(before)]] == [0, 1]
    for x in (4.0, 300.0):
        field.sow((x, 0.0, 3.0), 0.2)
        assert state() == before
        ends = np.cumsum([page.capacity for page in field.pages])
        assert [page.first_number for page in field.pages] == [1, *(1 + ends[:-1])]
    ground = [page for page in field.pages if page.object_index is None]
    assert len(ground) == 1, "after a leap nothing is left of the old ground"
    # 64 bytes of a blade and 24 of its pose; 8 of its id on the ground, and the blade as it was sown on objects
    assert field.nbytes == sum(
        page.capacity * (96 if page.object_index is None else 152) + page.heads.size for page in field.pages
    )


def test_the_ground_is_the_same_with_objects_and_without(sow):
    grounds = [
        [page for page in sow(small_scene(object=things, ground=NOISE)).pages if page.object_index is None]
        for things in ([], [_thing()])
    ]
    assert sum(page.count for page in grounds[0]) > 1000
    bare, beside = (
        np.concatenate([np.frombuffer(page.blades.read(), BLADE)[page.tiles.rows()] for page in pages])
        for pages in grounds
    )
    assert bare.tobytes() == beside.tobytes()
    assert all(page.sown is None for each in grounds for page in each)


def test_there_need_be_no_ground(sow):
    assert sow(small_scene(ground=_NOWHERE)).pages == []


# Tiles ------------------------------------------------------------------------------------------------------


def test_tiles_are_small_bound_their_blades_and_order_them_by_rank(sow):
    scene = _alone(_thing("box", 1500.0, size_m=[6.0, 2.0, 3.0]))
    field = sow(scene)
    (page,) = field.pages
    blades, tiles = _of(field, 0), page.tiles
    assert tiles.up_to[:, 7].max() <= 4096
    assert np.median(tiles.up_to[:, 7]) > 1000
    assert (tiles.coverage == 1).all()
    tile = np.repeat(np.arange(len(tiles.start)), tiles.up_to[:, 7])
    for p in points(blades):
        assert (p >= tiles.low[tile] - 1e-4).all()
        assert (p <= tiles.high[tile] + 1e-4).all()
    rank = _rank(blades)
    assert np.histogram(rank, bins=10, range=(0, 1))[0] / len(rank) == pytest.approx(0.1, abs=0.01)
    for start, up_to in zip(tiles.start, tiles.up_to, strict=True):
        mine = rank[start : start + up_to[7]]
        assert (np.diff(mine) > -1e-4).all()
        for eighth, last in enumerate(up_to):
            assert (mine[last:] > (eighth + 1) / 8 - 1e-3).all()
    size = (tiles.high - tiles.low - 2 * field.tallest_m).max(axis=1)
    assert np.median(size) < 3


def test_no_page_is_larger_than_a_storage_block(device, sow, monkeypatch):
    scene = _alone(_thing("box", 400.0, size_m=[3.0, 3.0, 3.0]))
    whole = sow(scene).count
    monkeypatch.setattr(device, "limits", replace(device.limits, storage_block_bytes=3000 * 64))
    field = sow(scene)
    assert len(field.pages) > 5
    assert max(page.count for page in field.pages) <= 1500
    assert field.count == pytest.approx(whole, abs=2)


def test_many_small_triangles_and_few_blades(sow):
    """Where a facet has a thousandth of a blade, as many grow as were asked for."""
    thing = _thing(density=5.0, size_m=[2.0, 2.0, 2.0])
    blades = _of(sow(_alone(thing)), 0)
    assert len(blades) == pytest.approx(5 * 4 * np.pi, abs=1)


def test_heads_are_listed(sow):
    field = sow(_alone(_thing(), grass=[{**GRASS, "head": "daisy", "head_share": 0.3}]))
    (page,) = field.pages
    listed = np.frombuffer(page.heads.read(), np.uint32)
    marked = np.flatnonzero(has_head(_of(field, 0)))
    assert np.array_equal(np.sort(listed), marked)
    assert len(marked) == pytest.approx(0.3 * page.count, rel=0.15)


# Limits -----------------------------------------------------------------------------------------------------


def test_too_many_are_refused_before_anything_is_allocated(sow, monkeypatch):
    monkeypatch.setattr(field_module, "available_bytes", lambda _: 1 << 30)
    monkeypatch.setattr(sower_module, "Page", None)
    thing = _thing("box", 1e6, size_m=[10_000.0, 10_000.0, 10_000.0])
    with pytest.raises(InputError) as refused:
        sow(small_scene(object=[thing]))
    message = str(refused.value)
    assert "\n" not in message
    assert message.startswith("sowing: about 600,000,000 million blades need")
    assert message.endswith("lower the density_per_m2 of the grass on objects")


def test_everything_is_released(device, sow):
    scene = small_scene(object=[_thing()], growth={})
    before = live_objects(device)
    field = sow(scene)
    field.transform(np.eye(4)[None], 1.0)
    field.sow((3.0, 0.0, 0.0), 0.0)
    field._ground.release()
    field.release()
    assert live_objects(device) == before


def test_so_little_grass_that_none_grows(sow):
    assert sow(_alone(_thing("box", size_m=[0.1, 0.1, 0.1], fur={"density_per_m2": 1.0}))).count == 0


def test_equal_objects_share_the_triangles_that_are_sown():
    things = [_thing(position_m=[3.0 * k, 0.0, 0.0], yaw_deg=5.0 * k) for k in range(20)] + [_thing("box")]
    surfaces = grassy_objects(_alone(*things))
    assert [each.index for each in surfaces] == list(range(21))
    assert len({id(each.corners) for each in surfaces}) == 2
