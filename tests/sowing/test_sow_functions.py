"""Functions of the sowing shader against their float64 twins."""

import itertools

import numpy as np
import pytest

from greensward.sowing.species import SWARD_BLOCK
from oracles import sowing
from shader_calls import shader_call
from small_scenes import GRASS, small_scene

_SOW = "sowing/sow.comp"


def _leaves(device, x: int, z: int, level: int, count: int, seed: int = 5) -> np.ndarray:
    """Leaf x, z and index of the first candidates of a tile."""
    body = (
        f"ivec2 leaf; uint index; leafOf(Tile({x}, {z}, {level}, {count}u), j, leaf, index);"
        " result = ivec3(leaf, int(index));"
    )
    candidates = {"j": np.arange(count, dtype=np.uint32)}
    return shader_call(device, _SOW, body, candidates, "ivec3", blocks={SWARD_BLOCK: {"seed": seed}})


@pytest.mark.parametrize(("x", "z", "level"), [(0, 0, 0), (3, -2, 1), (-1, -1, 2), (7, 5, 4)])
def test_every_blade_of_every_leaf_is_visited_once(device, x, z, level):
    per_leaf, edge = 5, 2**level
    got = _leaves(device, x, z, level, per_leaf * edge * edge)
    every = itertools.product(range(x * edge, (x + 1) * edge), range(z * edge, (z + 1) * edge), range(per_leaf))
    assert sorted(map(tuple, got.tolist())) == sorted(every)


@pytest.mark.parametrize("seed", [0, 5, 2**32 - 1])
def test_leaves_are_visited_as_the_twin_does(device, seed):
    got = _leaves(device, -3, 4, 3, 200, seed)
    assert [tuple(row) for row in got.tolist()] == [sowing.leaf_of(-3, 4, 3, j, seed) for j in range(200)]


@pytest.mark.parametrize("level", [1, 2, 3])
def test_a_prefix_spreads_evenly_over_the_tile(device, level):
    """Four to the power of n candidates hit each square of that division once."""
    got = _leaves(device, 0, 0, level, 4**level)
    for depth in range(1, level + 1):
        squares = got[: 4**depth, :2] // 2 ** (level - depth)
        assert len(np.unique(squares, axis=0)) == 4**depth


def test_a_tile_and_its_quarters_hold_the_same_blades(device):
    whole = set(map(tuple, _leaves(device, 1, 1, 3, 4 * 300).tolist()))
    quarters = [set(map(tuple, _leaves(device, x, z, 2, 300).tolist())) for x in (2, 3) for z in (2, 3)]
    assert whole == set().union(*quarters)


def test_places_stay_in_their_leaf_and_fill_it(device):
    index = np.arange(4000, dtype=np.uint32)
    body = "result = placeIn(ivec2(-3, 2), index, hash3(uvec3(1u, 2u, index)));"
    blocks = {SWARD_BLOCK: {"seed": 9, "leaf_m": 0.5}}
    xz = shader_call(device, _SOW, body, {"index": index}, "vec2", blocks=blocks)
    inside = xz / 0.5 - [-3, 2]
    assert inside.min() >= -1e-6
    assert inside.max() <= 1 + 1e-6
    counts, *_ = np.histogram2d(*inside.T, bins=20, range=[[0, 1], [0, 1]])
    assert counts.std() < 0.8 * np.sqrt(counts.mean()), "no more even than chance"
    assert counts.min() > 0


def test_leaves_are_counted_from_the_anchor(device):
    index = np.arange(50, dtype=np.uint32)
    body = "result = placeIn(ivec2(-3, 2), index, hash3(uvec3(1u, 2u, index)));"
    near, far = (
        shader_call(
            device,
            "sowing/ground_blade.glsl",
            body,
            {"index": index},
            "vec2",
            blocks={SWARD_BLOCK: {"leaf_m": 0.5, "seed": 3, "anchor_leaf": anchor}},
        )
        for anchor in ((0, 0), (40, -7))
    )
    np.testing.assert_allclose(near - far, np.tile([20.0, -3.5], (50, 1)), atol=1e-5)


def test_clump_is_the_nearest_of_all_centres(device):
    xz = np.random.default_rng(5).uniform(-3, 3, (400, 2)).astype(np.float32)
    blocks = {SWARD_BLOCK: {"seed": 9, "clump_m": 0.5}}
    got = shader_call(device, _SOW, "clumpAt(xz).centre", {"xz": xz}, "vec2", blocks=blocks)
    expected = sowing.clump_centres(xz.astype(np.float64), 0.5, 9)
    found, best = (np.linalg.norm(c - xz, axis=1) for c in (got, expected))
    # nine cells miss a nearer centre two cells away now and then, by little
    assert (np.abs(found - best) < 1e-5).mean() > 0.98
    assert (found - best).max() < 0.2


_PULLS = {"short": (0.05, 0.6), "tall": (0.45, 0.3)}
"""Mean length of a blade, and size of a clump."""


@pytest.mark.parametrize(("blade_m", "clump_m"), _PULLS.values(), ids=_PULLS)
def test_clumps_pull_no_farther_than_blades_reach(device, blade_m, clump_m):
    random = np.random.default_rng(6)
    xz = random.uniform(-3, 3, (400, 2)).astype(np.float32)
    words = random.integers(0, 2**32, 400, dtype=np.uint32)
    got = shader_call(
        device,
        "sowing/clump.glsl",
        "vec2 root = xz; pullIntoClump(root, uvec3(0u, 0u, word)); result = root;",
        {"xz": xz, "word": words},
        "vec2",
        blocks={SWARD_BLOCK: {"seed": 9, "clump_m": clump_m, "clumping": 0.8, "blade_m": (blade_m, 0.01)}},
    )
    chance = (words >> 8) / 2.0**24
    expected = sowing.pull_into_clump(xz.astype(np.float64), chance, clump_m, 0.8, blade_m, 9)
    assert (np.abs(got - expected).max(axis=1) < 1e-5).mean() > 0.97, "but for a nearer centre two cells away"
    assert 0.1 * blade_m < np.linalg.norm(got - xz, axis=1).max() < 0.35 * blade_m


@pytest.mark.parametrize(("blade_m", "clump_m"), _PULLS.values(), ids=_PULLS)
def test_blades_of_instances_are_pulled_alike(device, sow, blade_m, clump_m):
    """Short lawns must not tear in the one stored patch either."""
    grass = {**GRASS, "height_m": [0.9 * blade_m, 1.1 * blade_m]}
    field = sow(small_scene(grass=[grass], sowing={"clump_m": clump_m, "clumping": 1.0, "density_per_m2": 5.0}))
    stored = np.random.default_rng(7).uniform(0, 1, (600, 3)).astype(np.float32)
    body = """
        PatternRoot s = PatternRoot(at.x, at.y, float[8](at.z, 0.3, 0.1, at.x, at.y, 0.7, 0.0, 0.0));
        Blade b;
        bool grew = growStored(uint(row), ivec2(-1, 2), s, variedRandoms(uint(row), ivec2(-1, 2), s), b);
        result = vec3(b.x, b.z, grew ? 1.0 : 0.0);"""
    got = shader_call(
        device,
        "techniques/tessellated_quads/patch.glsl",
        body,
        {"at": stored},
        "vec3",
        bindings=field.bindings,
        defines={"FADING": 0.12, "gl_InstanceID": 0, "gl_VertexID": 0},
        uniforms={"patch_m": 4.0, "blades_stored": 600, "variation": 3},
    )
    grew = got[:, 2] == 1.0
    assert grew.mean() > 0.9
    before = 4.0 * (stored[grew, :2].astype(np.float64) + np.array([-1, 2]))
    way = sowing.clump_centres(before, clump_m, 5) - before
    part = ((got[grew, :2] - before) * way).sum(1) / (way**2).sum(1)
    most = 0.35 * min(blade_m / clump_m, 1.0)
    off = np.abs(got[grew, :2] - before - part[:, None] * way).max(axis=1)
    assert (off < 1e-5).mean() > 0.97
    straight = off < 1e-5
    assert -1e-4 < part[straight].min() < 0.05 * most
    assert 0.95 * most < part[straight].max() < 1.001 * most


def test_sown_coverage_and_slope_share(device):
    distance = np.geomspace(0.01, 500, 200).astype(np.float32)
    blocks = {SWARD_BLOCK: {"full_density_m": 6.0}}
    got = shader_call(device, "sowing/sward.glsl", "sownCoverage(d)", {"d": distance}, "float", blocks=blocks)
    assert np.allclose(got, sowing.kept_share(distance.astype(np.float64), 6.0), rtol=1e-5)
    normal_y = np.linspace(0, 1, 200, dtype=np.float32)
    blocks = {SWARD_BLOCK: {"min_normal_y": np.cos(np.radians(40.0))}}
    got = shader_call(device, "sowing/sward.glsl", "slopeShare(y)", {"y": normal_y}, "float", blocks=blocks)
    assert np.allclose(got, sowing.slope_share(normal_y.astype(np.float64), 40.0), atol=2e-5)


def test_species_are_picked_by_weight(device):
    chance = ((np.arange(4000) + 0.5) / 4000).astype(np.float32)
    rows = np.zeros((16 * 9, 4))
    rows[[0, 9, 18], 0] = 2.0, 0.0, 6.0
    got = shader_call(
        device,
        _SOW,
        "pickSpecies(vec3(0.0), vec3(0.0, 1.0, 0.0), c)",
        {"c": chance},
        "int",
        blocks={SWARD_BLOCK: {"species": rows, "count": 3, "drift_m": 1.0}},
    )
    assert np.bincount(got, minlength=3) / 4000 == pytest.approx([0.25, 0.0, 0.75], abs=1e-3)
