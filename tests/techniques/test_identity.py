"""Permanent ids of blades: the same from every camera, along every way there, and in every renderer."""

import numpy as np
import pytest

from blades import all_numbers, blades_by_number
from greensward.scene import SurfaceClass
from greensward.sowing.identity import BladeKind, blade_ids
from greensward.techniques import TECHNIQUES
from reprojection import world_points
from small_scenes import COARSE_PX, GRASS, NOISE, small_scene

_SOWING = {"density_per_m2": 60.0, "full_density_m": 3.0, "reach_m": 30.0}
_PATCHES = {"name": "tessellated-quads", "mode": "instanced", "patch_m": 3.0}
_WAYS = {each.name: {"technique": {"name": each.name}} for each in TECHNIQUES} | {
    "patches": {"technique": _PATCHES},
    "extra blades": {"technique": {"name": "expanded-roots", "extra_blades": 3}},
    "unstored": {"technique": {"name": "visibility-buffer"}, "sowing": {**_SOWING, "stored_m": 0.0}},
    "traced": {"technique": {"name": "bezier-blades"}, "sowing": {**_SOWING, "traced_m": 6.0}},
    "flowers": {"flowers": [{"density_per_m2": 3.0, "height_m": [0.5, 0.9], "reach_m": 20.0}]},
}
_KINDS = {
    "billboard-grid": {BladeKind.TRACED},
    "geometry-billboards": {BladeKind.BILLBOARD, BladeKind.FLAT_TILE},
    "patches": {BladeKind.PATCH},
    "traced": {BladeKind.GROUND, BladeKind.TRACED},
    "flowers": {BladeKind.GROUND, BladeKind.FLOWER},
}


def _scene(way):
    tables = {"ground": NOISE, "sowing": _SOWING, "shadows": {"enabled": False}, **_WAYS[way]}
    if tables.get("technique", {}).get("name") == "billboard-grid":
        tables["technique"] = {**tables["technique"], "texture_px": COARSE_PX}
    return small_scene(**tables)


@pytest.mark.parametrize("way", _WAYS)
def test_what_two_cameras_see_has_one_id(renderer, way):
    """A second renderer comes from afar, and looks at the same grass from a metre beside the first."""
    scene = _scene(way)
    here = scene.camera
    x, y, z = here.position_m
    beside = here.model_copy(update={"position_m": (x + 0.15, y + 0.03, z + 0.1)})
    afar = here.model_copy(update={"position_m": (x + 21.0, y, z - 17.0)})
    first, second = renderer(scene, size=(320, 180)), renderer(scene, size=(320, 180))
    aovs = ("class", "depth", "blade_id")
    one = first.render(0.0, camera=here, aovs=aovs).truth
    second.render(0.0, camera=afar)
    two = second.render(0.0, camera=beside, aovs=aovs).truth
    kinds = np.unique(one["blade_id"][one["blade_id"] > 0] >> np.uint64(60))
    assert set(kinds) == _KINDS.get(way, {BladeKind.GROUND})

    points = world_points(first, here, one["depth"])
    view_from_world, clip_from_view = second.camera_matrices(beside)
    clip = np.concatenate([points, np.ones((*points.shape[:2], 1))], -1) @ (clip_from_view @ view_from_world).T
    with np.errstate(invalid="ignore"):
        pixel = np.floor((clip[..., :2] / clip[..., 3:] * (0.5, -0.5) + 0.5) * (320, 180))
        inside = (one["blade_id"] > 0) & ((pixel >= 0) & (pixel < (320, 180))).all(-1)
    column, row = pixel[inside].astype(int).T
    seen = np.isclose(two["depth"][row, column], clip[inside][:, 3], rtol=2e-3)
    assert seen.sum() > 1000
    # else a blade close by covers the point, or the pixel's centre lies on the next
    same = two["blade_id"][row, column][seen] == one["blade_id"][inside][seen]
    for kind in kinds:
        mine = one["blade_id"][inside][seen] >> np.uint64(60) == kind
        assert same[mine].mean() > (0.35 if kind == BladeKind.TRACED else 0.8), BladeKind(int(kind)).name


@pytest.mark.parametrize("way", ["billboard-grid", "traced"])
def test_an_id_of_traced_grass_names_one_blade(renderer, way):
    """All pixels of an id lie within the reach of a blade, whatever the level of its picture, near and far."""
    scene = _scene(way)
    drawn = renderer(scene, size=(320, 180))
    truth = drawn.render(aovs=("depth", "blade_id")).truth
    mine = truth["blade_id"] >> np.uint64(60) == BladeKind.TRACED
    points = world_points(drawn, scene.camera, np.where(mine, truth["depth"], 1.0))[mine][:, [0, 2]]
    ids, blade = np.unique(truth["blade_id"][mine], return_inverse=True)
    low, high = np.full((len(ids), 2), np.inf), np.full((len(ids), 2), -np.inf)
    np.minimum.at(low, blade, points)
    np.maximum.at(high, blade, points)
    assert len(ids) > 3000
    assert np.linalg.norm(high - low, axis=1).max() < 0.6
    assert (ids & np.uint64((1 << 18) - 1) > 0).all()


def test_an_id_is_of_one_root_whatever_way_the_field_came_there(renderer):
    scene = small_scene(
        ground=NOISE,
        sowing=_SOWING,
        object=[
            {
                "kind": "sphere",
                "position_m": [0.0, 0.0, 0.0],
                "size_m": [2.0, 2.0, 2.0],
                "grass": {"density_per_m2": 80.0},
            }
        ],
    )
    found = []
    for way in ([(0.0, 0.0)], [(40.0, 3.0), (9.0, -5.0), (1.0, 1.0), (0.0, 0.0)], [(2.0, 1.0)]):
        drawn = renderer(scene, size=(32, 18))
        for x, z in way:
            camera = scene.camera.model_copy(update={"position_m": (x, 1.3, z)})
            drawn.render(0.0, camera=camera)
        field = drawn._world.field
        numbers = all_numbers(field).astype(np.uint32)
        ids, roots = field.identify(numbers), blades_by_number(field)["root"][numbers]
        assert len(np.unique(ids)) == len(ids) > 10_000
        found.append({int(i): bytes(root) for i, root in zip(ids, roots, strict=True)})
    assert found[0] == found[1]
    common = found[0].keys() & found[2].keys()
    assert len(found[0]) > len(common) > 0.8 * len(found[0])
    assert all(found[0][i] == found[2][i] for i in common)
    assert {i >> 60 for i in common} == {BladeKind.GROUND, BladeKind.OBJECT}


def test_ids_of_the_ground_tell_leaf_and_number(renderer):
    drawn = renderer(small_scene(ground=NOISE, sowing=_SOWING), size=(32, 18))
    drawn.render()
    field = drawn._world.field
    numbers = all_numbers(field).astype(np.uint32)
    ids, roots = field.identify(numbers), blades_by_number(field)["root"][numbers]
    leaf = np.stack([ids >> np.uint64(38), ids >> np.uint64(16)], -1).astype(np.int64) & 0x3FFFFF
    leaf = np.where(leaf < 1 << 21, leaf, leaf - (1 << 22))
    edge = 8.0  # of the leaf of 60 blades on a square metre, whose clumps pull roots across its border
    assert np.abs(roots[:, [0, 2]] - (leaf + 0.5) * edge).max() < 0.5 * edge + 0.4
    assert (ids & np.uint64(0xFFF)).max() < 60 * edge * edge


@pytest.mark.parametrize("kind", BladeKind)
def test_parts_of_an_id_do_not_run_into_each_other(kind):
    random = np.random.default_rng(int(kind))
    count = {BladeKind.TRACED: 4, BladeKind.GROUND: 4}.get(kind, 3)
    parts = [random.integers(-3, 4, 200) for _ in range(count)]
    ids = blade_ids(kind, *parts)
    assert ids.dtype == np.uint64
    assert (ids >> np.uint64(60) == int(kind)).all()
    assert len(np.unique(ids)) == len(np.unique(np.stack(parts), axis=1).T)


def test_flowers_of_blades_have_the_id_of_their_blade(renderer):
    drawn = renderer(small_scene(grass=[{**GRASS, "head": "daisy", "head_size_m": [0.06, 0.06]}]), size=(320, 180))
    truth = drawn.render(aovs=("class", "blade_id")).truth
    flower = truth["class"] == SurfaceClass.FLOWER
    assert flower.any()
    assert (truth["blade_id"][flower] >> np.uint64(60) == BladeKind.GROUND).all()
    assert np.isin(truth["blade_id"][flower], truth["blade_id"][~flower]).mean() > 0.5
