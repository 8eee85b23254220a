"""The field: the same bytes from the same seed, as dense as asked, nothing where nothing may grow."""

import re
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest

from blades import BLADE, blades_by_number, has_head, numbers_of, points, read_blades, species_of, up_of
from greensward.ground import HeightField
from greensward.ground.noise import octaves
from greensward.scene import InputError
from greensward.sowing import field as field_module
from greensward.sowing import sower as sower_module
from greensward.sowing.blade import BladeFlag
from greensward.sowing.pages import page_numbers
from greensward.sowing.species import leaf_edge_m
from greensward.sowing.streaming import StreamedPages
from oracles import bezier, sowing
from small_scenes import BREEZE, GRASS, NOISE, small_scene, with_pictures

_EVEN = {"drift": 0.0, "clumping": 0.0, "density_per_m2": 80.0}


def _shown(blades: np.ndarray, full_m: float, reach_m: float) -> np.ndarray:
    """Distances of the blades that a camera at the origin may show: tiles hold more than any one camera needs."""
    away, rank = _away(blades), (blades["rank_root"] / 65535.0) ** 2
    return away[(away <= reach_m) & (rank <= sowing.kept_share(away, full_m))]


def _away(blades: np.ndarray, focus=(0.0, 0.0, 0.0)) -> np.ndarray:
    return np.linalg.norm(blades["root"] - np.array(focus), axis=1)


def test_same_seed_same_bytes(sow):
    scene = small_scene(ground=NOISE, sowing={"drift": 0.7})
    one, two = (read_blades(sow(scene, (1.0, 2.0, 3.0), 0.5)) for _ in range(2))
    assert len(one) > 1000
    assert one.tobytes() == two.tobytes()
    again = sow(scene)
    again.sow((1.0, 2.0, 3.0), 0.5)
    assert read_blades(again).tobytes() == one.tobytes()


@pytest.mark.slow
def test_same_seed_same_bytes_with_every_core_at_work(sow):
    """Hundreds of full tiles at once: nothing may depend on which of them is sown first."""
    even = {**_EVEN, "density_per_m2": 120.0, "full_density_m": 100.0, "reach_m": 16.0}
    fields = [sow(small_scene(sowing={**even, "density_per_m2": 2000.0, "reach_m": 5.0})) for _ in range(4)]
    fields += [sow(small_scene(sowing=even)) for _ in range(4)]
    for same in (fields[:4], fields[4:]):
        blades = [read_blades(field) for field in same]
        assert len(blades[0]) > 80_000
        assert all(other.tobytes() == blades[0].tobytes() for other in blades[1:])
        assert (blades[0]["height"] > 0).all()


def test_another_seed_sows_elsewhere(sow):
    roots = [set(map(bytes, read_blades(sow(small_scene(seed=seed)))["root"])) for seed in (1, 2)]
    assert min(map(len, roots)) > 1000
    assert not roots[0] & roots[1]


@pytest.mark.parametrize("density", [0.3, 20.0, 300.0])
def test_as_many_as_asked(sow, density):
    full, reach = 4.0, 9.0
    blades = read_blades(
        sow(small_scene(sowing={**_EVEN, "density_per_m2": density, "full_density_m": full, "reach_m": reach}))
    )
    away = _shown(blades, full, reach)
    for low, high in ((0, 2), (2, full), (full, 6), (6, reach)):
        r = np.linspace(low, high, 1001)
        expected = density * np.trapezoid(2 * np.pi * r * sowing.kept_share(r, full), r)
        got = ((away >= low) & (away < high)).sum()
        # more even than chance, but not at the rim
        assert abs(got - expected) < 4 * np.sqrt(expected) + 1, (low, high)


def test_slack_extends_full_density_and_reach(sow):
    """No camera within the slack misses a blade that a field sown for itself has."""
    scene = small_scene(sowing=_EVEN)
    loose = read_blades(sow(scene, slack_m=2.0))
    held = set(map(bytes, loose["root"]))
    for x, z in ((0.0, 0.0), (2.0, 0.0), (-1.4, 1.4)):
        tight = read_blades(sow(scene, (x, 0.0, z)))
        away, rank = _away(tight, (x, 0.0, z)), (tight["rank_root"] / 65535.0) ** 2
        needed = tight[(away <= 12.0) & (rank <= sowing.kept_share(away, 5.0))]
        assert len(needed) > 5000
        # a rank is rounded otherwise in a tile of another level
        assert sum(bytes(root) not in held for root in needed["root"]) < 0.001 * len(needed)


@pytest.mark.parametrize(
    "tables", [{}, {"ground": NOISE}, {"grass": [{**GRASS, "head": "daisy", "head_share": 0.3}]}]
)
def test_a_streamed_field_is_that_which_is_sown_at_once(sow, tables):
    """Blade for blade and head for head, after a way with turns, with and without a leap."""
    scene = small_scene(**tables)
    streamed = sow(scene)
    for turn in np.linspace(0.0, 2.0, 41):
        streamed.sow((9.0 * np.sin(turn), 0.0, 5.0 * turn), 0.1)
    streamed.sow((500.0, 0.0, 0.0), 0.1)
    for x in np.arange(500.0, 506.0, 0.5):
        streamed.sow((x, 0.0, -0.3 * (x - 500.0)), 0.1)
    at_once = sow(scene, (505.5, 0.0, -0.3 * 5.5), 0.1)
    assert read_blades(streamed).tobytes() == read_blades(at_once).tobytes()
    assert len(streamed.pages) < 5
    for field in (streamed, at_once):
        heads = [
            np.frombuffer(page.heads.read(), np.uint32)[start : start + count]
            for page in field.pages
            for start, count in zip(page.tiles.head_start, page.tiles.heads, strict=True)
        ]
        lit = sum(
            int(has_head(np.frombuffer(page.blades.read(), BLADE)[page.tiles.rows()]).sum()) for page in field.pages
        )
        assert sum(map(len, heads)) == lit


@pytest.mark.parametrize("prepared_x", [4.0, 9.0])
def test_a_prepared_step_is_that_which_is_not(sow, prepared_x):
    """Also where the camera goes elsewhere after all."""
    scene = small_scene(ground=NOISE, grass=[{**GRASS, "head": "daisy"}])
    field, other = sow(scene), sow(scene)
    field.prepare((prepared_x, 0.0, 1.0), 0.2)
    for each in (field, other):
        assert each.sow((4.0, 0.0, 1.0), 0.2)
    assert read_blades(field).tobytes() == read_blades(other).tobytes()
    assert not field.sow((4.0, 0.0, 1.0), 0.2)


def test_memory_stays_level(sow):
    """Far beyond what a field holds at once."""
    field = sow(small_scene(sowing=_EVEN))
    sizes = []
    for x in np.arange(0.0, 400.0, 0.5):
        field.sow((x, 0.0, 0.2 * x), 0.3)
        sizes.append(field.nbytes)
    assert sizes[-1] == sizes[400] <= 3.0 * sizes[0]


def test_a_step_sows_the_tiles_that_are_new(sow, monkeypatch):
    sown = []
    usual = sower_module.Sower.count
    monkeypatch.setattr(
        sower_module.Sower,
        "count",
        lambda self, tiles, *rest: (sown.append(int(tiles["candidates"].sum())), usual(self, tiles, *rest))[1],
    )
    field = sow(small_scene(sowing={**_EVEN, "reach_m": 40.0}))
    whole = sum(sown)
    sown.clear()
    assert not field.sow((0.0, 0.0, 0.0), 0.0)
    assert sown == []
    steps = np.arange(0.2, 20.0, 0.2)
    for x in steps:
        field.sow((x, 0.0, 0.0), 0.0)
    assert sum(sown) < 0.15 * whole * len(steps)


@pytest.mark.parametrize(
    "nothing", [{"sowing": {"density_per_m2": 0.0}}, {"grass": []}, {"grass": [{**GRASS, "share": 0.0}]}]
)
def test_no_blades_at_all(sow, nothing):
    field = sow(small_scene(**nothing))
    assert field.count == field.nbytes == len(field.pages) == 0


def test_nothing_grows_where_the_density_map_is_zero(sow, tmp_path):
    pixels = np.zeros((64, 64, 3), np.uint8)
    pixels[:, 32:, 0] = 255  # the east half
    pixels[..., 2] = 255
    scene = with_pictures(
        tmp_path, {"d.png": pixels}, ground={"size_m": [16.0, 16.0]}, sowing={**_EVEN, "density_map": "d.png"}
    )
    x = read_blades(sow(scene))["root"][:, 0]
    half_texel = 16.0 / 64 / 2
    inside = np.abs(x) < 8.0
    assert inside.sum() > 2000
    assert x[inside].min() >= -half_texel
    # beyond the edges the map goes on mirrored
    assert (x > 8.0).sum() > 100
    assert not (np.abs(x + 12.0) < 4.0 - half_texel).any()


def test_a_map_does_not_leak_in_from_its_opposite_edge(sow, tmp_path):
    """Two texels: only the middle half of the ground lies between their centres."""
    pixels = np.zeros((1, 2, 3), np.uint8)
    pixels[:, 1] = 255
    scene = with_pictures(
        tmp_path,
        {"d.png": pixels},
        ground={"size_m": [16.0, 16.0], "beyond": "bare"},
        sowing={**_EVEN, "density_map": "d.png"},
    )
    x = read_blades(sow(scene))["root"][:, 0]
    assert len(x) > 2000
    assert x.min() >= -4.0


def test_density_and_height_follow_the_map(sow, tmp_path):
    pixels = np.zeros((32, 32, 3), np.uint8)
    pixels[:16, :, 0], pixels[16:, :, 0] = 64, 255
    pixels[..., 2] = 128
    scene = with_pictures(
        tmp_path, {"d.png": pixels}, ground={"size_m": [24.0, 24.0]}, sowing={**_EVEN, "density_map": "d.png"}
    )
    blades = read_blades(sow(scene))
    north = blades["root"][:, 2] < 0
    assert north.sum() / (~north).sum() == pytest.approx(64 / 255, rel=0.1)
    plain = read_blades(sow(small_scene(sowing=_EVEN)))
    assert blades["height"].mean() / plain["height"].mean() == pytest.approx(128 / 255, rel=0.03)
    assert blades["height"].max() <= 0.6 * 128 / 255 + 1e-4


def test_low_detail_is_marked_by_green(sow, tmp_path):
    pixels = np.full((32, 32, 3), 255, np.uint8)
    pixels[:, :16, 1] = 0
    scene = with_pictures(
        tmp_path, {"d.png": pixels}, ground={"size_m": [16.0, 16.0]}, sowing={**_EVEN, "density_map": "d.png"}
    )
    blades = read_blades(sow(scene))
    inside = np.abs(blades["root"][:, 0]) < 7.5
    marked = (blades["flags"] & BladeFlag.LOW_DETAIL) != 0
    east = blades["root"][:, 0] > 0.25
    west = blades["root"][:, 0] < -0.25
    assert marked[inside & east].all()
    assert not marked[inside & west].any()


@pytest.mark.parametrize("max_slope_deg", [10.0, 25.0])
def test_nothing_grows_on_steeper_slopes(sow, max_slope_deg):
    scene = small_scene(ground=NOISE, sowing={**_EVEN, "max_slope_deg": max_slope_deg})
    heights = HeightField.of(scene)
    field = sow(scene, (0.0, float(heights.height(0, 0)), 0.0))
    root = read_blades(field)["root"].astype(np.float64)
    slope = np.degrees(np.arccos(heights.normal(root[:, 0], root[:, 2])[:, 1]))
    everywhere = np.random.default_rng(0).uniform(-8, 8, (2, 4000))
    assert np.degrees(np.arccos(heights.normal(*everywhere)[:, 1])).max() > max_slope_deg + 2
    assert len(root) > 200
    assert slope.max() <= max_slope_deg + 0.05


def test_roots_stand_on_the_ground(sow):
    scene = small_scene(ground=NOISE)
    heights = HeightField.of(scene)
    root = read_blades(sow(scene, (0.0, float(heights.height(0, 0)), 0.0)))["root"].astype(np.float64)
    assert len(root) > 1000
    assert np.abs(root[:, 1] - heights.height(root[:, 0], root[:, 2])).max() < 1e-4


def test_ends_where_the_ground_is_bare_beyond(sow):
    small = {"size_m": [10.0, 6.0]}
    bare, mirrored = (
        np.abs(read_blades(sow(small_scene(ground={**small, "beyond": beyond}, sowing=_EVEN)))["root"])
        for beyond in ("bare", "mirror")
    )
    assert (bare[:, [0, 2]].max(axis=0) <= [5.0, 3.0]).all()
    assert len(bare) > 3000
    assert (mirrored[:, [0, 2]].max(axis=0) > [8.0, 8.0]).all()


def test_the_same_blades_are_sown_from_elsewhere(sow):
    scene = small_scene(sowing={"density_per_m2": 60.0, "drift": 0.5, "full_density_m": 5.0, "reach_m": 25.0})
    foci = np.array([[0.0, 0, 0], [6.0, 0, 2.0]])
    both = [read_blades(sow(scene, focus)) for focus in foci]
    near = [
        {
            b"".join(bytes(blade[name]) for name in ("root", "control", "tip", "facing", "width"))
            for blade in blades[np.maximum(*(_away(blades, focus) for focus in foci)) < 4.9]
        }
        for blades in both
    ]
    assert len(near[0]) > 900
    assert near[0] == near[1]
    # where both thin out, the one that keeps fewer keeps a part of the other's
    far = [
        {bytes(root) for root in blades["root"][(_away(blades, foci[0]) > 10) & (blades["root"][:, 0] < -8)]}
        for blades in both
    ]
    assert len(far[0]) > len(far[1]) > 100
    assert len(far[1] - far[0]) < 0.02 * len(far[1])


def test_ranks_are_even_and_order_a_tile(sow):
    field = sow(small_scene(sowing=_EVEN))
    blades = read_blades(field)
    rank = (blades["rank_root"] / 65535.0) ** 2
    near = _away(blades) < 4.0
    assert np.histogram(rank[near], bins=10, range=(0, 1))[0] / near.sum() == pytest.approx(0.1, abs=0.015)
    (page,) = field.pages
    tiles = page.tiles
    assert (tiles.start[1:] >= tiles.start[:-1] + tiles.up_to[:-1, 7]).all()
    for start, up_to, coverage in zip(tiles.start, tiles.up_to, tiles.coverage, strict=True):
        mine = rank[start : start + up_to[7]]
        assert (np.diff(mine) > -1e-4).all()
        for bin_, last in enumerate(up_to):
            assert (mine[last:] > coverage * (bin_ + 1) / 8 - 1e-3).all(), "a blade of this bin lies beyond its end"


def test_tiles_bound_their_blades(sow):
    for ground in ({"kind": "flat"}, {**NOISE, "height_m": 20.0}):
        scene = small_scene(ground=ground, sowing={"clumping": 1.0, "clump_m": 2.0, "drift": 1.0})
        heights = HeightField.of(scene)
        field = sow(scene, (0.0, float(heights.height(0, 0)), 0.0))
        root, _, tip = points(read_blades(field))
        (page,) = field.pages
        tile = np.repeat(np.arange(len(page.tiles.start)), page.tiles.up_to[:, 7])
        for p in (root, tip):
            assert (p >= page.tiles.low[tile] - 1e-3).all()
            assert (p <= page.tiles.high[tile] + 1e-3).all()


def test_length_along_the_curve_is_the_height(sow):
    scene = small_scene(grass=[{**GRASS, "tilt_deg": [0.0, 70.0], "bend": [0.0, 1.0]}], ground=NOISE)
    blades = read_blades(sow(scene))
    ratio = bezier.true_length(*points(blades)) / blades["height"]
    assert np.abs(ratio - 1).max() < 0.01
    assert blades["height"].min() >= 0.3 - 1e-5
    assert blades["height"].max() <= 0.6 + 1e-5


def test_values_lie_in_their_ranges_and_use_them(sow):
    grass = {**GRASS, "width_m": [0.01, 0.03], "stiffness": [0.2, 0.9], "dryness": [0.1, 0.6]}
    blades = read_blades(sow(small_scene(grass=[grass], sowing={"clumping": 0.0, "drift": 1.0})))
    dryness = (blades["flags"] >> 8 & 255) / 255
    for values, (low, high) in (
        (blades["width"], (0.01, 0.03)),
        (blades["stiffness"], (0.2, 0.9)),
        (dryness, (0.1, 0.6)),
    ):
        assert low - 0.003 <= values.min() < low + 0.2 * (high - low)
        assert high - 0.2 * (high - low) < values.max() <= high + 0.003
    tilt = np.degrees(np.arccos(_lean(blades)))
    assert 8.0 - 0.1 <= tilt.min() < 12
    assert 36 < tilt.max() <= 40.1
    facing = np.histogram(np.mod(blades["facing"], 2 * np.pi), bins=8, range=(0, 2 * np.pi))[0]
    assert facing / len(blades) == pytest.approx(0.125, abs=0.02)


def _lean(blades: np.ndarray) -> np.ndarray:
    """Cosine between up and the line from root to tip."""
    root, _, tip = points(blades)
    line = (tip - root) / np.linalg.norm(tip - root, axis=1, keepdims=True)
    return np.clip((line * up_of(blades)).sum(1), -1, 1)


def test_clumps_pull_and_turn_alike(sow):
    loose, tight = (
        read_blades(
            sow(
                small_scene(
                    sowing={**_EVEN, "clump_m": 0.6, "clumping": clumping, "reach_m": 4.0, "full_density_m": 4.0}
                )
            )
        )
        for clumping in (0.0, 1.0)
    )
    distances, spreads = [], []
    for blades in (loose, tight):
        xz = blades["root"][:, [0, 2]].astype(np.float64)
        centre = sowing.clump_centres(xz, 0.6, 5)
        distances.append(np.linalg.norm(xz - centre, axis=1).mean())
        _, clump = np.unique(centre, axis=0, return_inverse=True)
        turn = np.exp(1j * blades["facing"].astype(np.float64))
        spreads.append(np.abs(np.bincount(clump, turn.real) + 1j * np.bincount(clump, turn.imag)).sum() / len(xz))
    # up to 0.35 of the way, evenly: 0.175 on average, but less for blades of 0.45 m in clumps of 0.6 m
    assert distances[1] / distances[0] == pytest.approx(1 - 0.175 * 0.45 / 0.6, abs=0.02)
    assert spreads[0] < 0.35
    assert spreads[1] > 0.9


@pytest.mark.parametrize("patchiness", [0.0, 1.0])
def test_shares_of_species(sow, patchiness):
    grass = [{**GRASS, "share": share, "patchiness": patchiness} for share in (6.0, 3.0, 1.0)]
    blades = read_blades(sow(small_scene(grass=grass, sowing={**_EVEN, "drift_m": 3.0, "full_density_m": 12.0})))
    kind = species_of(blades)
    if patchiness == 0.0:
        share = np.bincount(kind, minlength=3) / len(blades)
        assert share == pytest.approx([0.6, 0.3, 0.1], abs=4 * np.sqrt(0.25 / len(blades)))
    cell = np.floor(blades["root"][:, [0, 2]]).astype(int) @ [1000, 1]
    _, cell, count = np.unique(cell, return_inverse=True, return_counts=True)
    first = np.bincount(cell, kind == 0) / count
    spread = first[count > 40].std()
    by_chance = np.sqrt(0.24 / count[count > 40].mean())
    assert spread < 1.3 * by_chance if patchiness == 0.0 else spread > 3 * by_chance


def test_density_drifts_as_its_noise_says(sow):
    sowing_table = {**_EVEN, "drift": 1.0, "drift_m": 4.0, "full_density_m": 12.0}
    blades = read_blades(sow(small_scene(sowing=sowing_table)))
    x, z = (c.ravel() for c in np.meshgrid(*[np.linspace(-8, 8, 161)] * 2))
    expected = np.clip(0.75 + 0.6 * octaves(x / 4, z / 4, 5 + 7, 3, 0.6, 2.7), 0, 1)
    assert np.ptp(expected) > 0.6
    for part in (expected < 0.5, expected > 0.9):
        cells = {(i, j) for i, j in np.round(np.stack([x, z], 1)[part] * 10).astype(int)}
        there = np.round(blades["root"][:, [0, 2]] * 10).astype(int)
        got = sum((i, j) in cells for i, j in there.tolist()) / (len(cells) * 0.01)
        assert got == pytest.approx(80.0 * expected[part].mean(), rel=0.1)
    spread = [read_blades(sow(small_scene(sowing={**sowing_table, "drift": d})))["height"].max() for d in (0, 1)]
    assert spread[0] <= 0.6 < spread[1]


def test_heads_are_marked_and_listed(sow):
    grass = [{**GRASS, "head": "daisy", "head_share": 0.25}, {**GRASS, "head": "none"}, {**GRASS, "head": "spike"}]
    field = sow(small_scene(grass=grass))
    blades = read_blades(field)
    marked, kind = has_head(blades), species_of(blades)
    assert marked[kind == 0].mean() == pytest.approx(0.25, abs=0.04)
    assert not marked[kind == 1].any()
    assert marked[kind == 2].all()
    (page,) = field.pages
    listed = np.frombuffer(page.heads.read(), np.uint32)
    assert page.head_count == marked.sum()
    assert np.array_equal(np.sort(listed[: page.head_count]), np.flatnonzero(marked))
    for start, count, first, all_ in zip(
        page.tiles.head_start, page.tiles.heads, page.tiles.start, page.tiles.up_to[:, 7], strict=True
    ):
        mine = listed[start : start + count]
        assert ((mine >= first) & (mine < first + all_)).all()


@pytest.mark.parametrize("free_gib", [1, 1000])
def test_a_hundred_million_blades_are_refused_before_anything_is_allocated(sow, monkeypatch, free_gib):
    monkeypatch.setattr(field_module, "available_bytes", lambda _: free_gib << 30)
    monkeypatch.setattr(sower_module, "Page", None)
    density = 4000.0 if free_gib == 1 else 8000.0
    scene = small_scene(sowing={"density_per_m2": density, "full_density_m": 90.0, "reach_m": 90.0})
    with pytest.raises(InputError) as refused:
        sow(scene)
    message = str(refused.value)
    million = int(re.search(r"about ([\d,]+) million", message)[1].replace(",", ""))
    assert million == pytest.approx(density * np.pi * 0.0081, rel=0.25)
    assert "\n" not in message
    assert "lower sowing.density_per_m2" in message
    if free_gib == 1:
        assert f"{million * 1e6 * 96 / 2**30:,.1f}"[:3] in message
        assert "this device can give 1.0 GiB" in message
    else:
        assert "must be at most 134 million blades" in message
    fits = float(re.search(r"sowing.full_density_m to ([\d.]+)$", message)[1])
    assert 10.0 < fits < 80.0
    monkeypatch.setattr(StreamedPages, "replace", lambda *_, **__: None)
    monkeypatch.setattr(sower_module.Sower, "count", lambda *_: None)
    for part, refused in ((0.99, nullcontext()), (1.03, pytest.raises(InputError))):
        with refused:
            sow(small_scene(sowing={**scene.sowing.model_dump(), "full_density_m": part * fits}))


def test_a_refusal_leaves_the_field_as_it_was(sow, monkeypatch):
    field = sow(small_scene())
    blades = read_blades(field)
    with monkeypatch.context() as tight:
        tight.setattr(field_module, "available_bytes", lambda _: 1000)
        with pytest.raises(InputError, match=r"need 0\.0 GiB"):
            field.sow((40, 0, 0), 0.0)
    assert read_blades(field).tobytes() == blades.tobytes()
    field.sow((40, 0, 0), 0.0)
    assert field.count > 1000


@pytest.mark.parametrize(
    ("counts", "limit", "expected"),
    [
        ([], 5, []),
        ([3], 5, [0]),
        ([3, 2, 1], 5, [0, 0, 1]),
        ([5, 5, 5], 5, [0, 1, 2]),
        ([1, 1, 1, 1], 2, [0, 0, 1, 1]),
        ([9, 1], 5, [0, 1]),
    ],
)
def test_pages_hold_no_more_than_fits(counts, limit, expected):
    assert page_numbers(np.array(counts, np.int64), limit).tolist() == expected


def _limited(monkeypatch, device, blades: int) -> None:
    monkeypatch.setattr(device, "limits", replace(device.limits, storage_block_bytes=blades * 64))


def test_no_page_is_larger_than_a_storage_block(device, sow, monkeypatch):
    scene = small_scene(sowing={**_EVEN, "full_density_m": 12.0})
    whole = read_blades(sow(scene))
    _limited(monkeypatch, device, 3000)
    field = sow(scene)
    assert len(field.pages) > 5
    assert max(page.blades.size for page in field.pages) <= 3000 * 64
    assert np.array_equal(np.unique(read_blades(field)["root"], axis=0), np.unique(whole["root"], axis=0))
    assert [page.first_number for page in field.pages] == [
        1,
        *(1 + np.cumsum([p.capacity for p in field.pages])[:-1]),
    ]


def test_a_tile_too_large_for_a_page_is_split(device, sow, monkeypatch):
    """Far off, tiles grow until only the limit holds them."""
    scene = small_scene(sowing={**_EVEN, "density_per_m2": 90.0, "full_density_m": 60.0, "reach_m": 60.0})
    whole = sow(scene)
    assert max(page.tiles.up_to[:, 7].max() for page in whole.pages) > 5000
    _limited(monkeypatch, device, 8000)
    split = sow(scene)
    assert max(page.count for page in split.pages) <= 4000
    near = [{bytes(root) for root in b["root"][_away(b) < 60.0]} for b in map(read_blades, (whole, split))]
    assert near[0] == near[1]


def test_several_pages_draw_the_same_picture(device, renderer, monkeypatch):
    scene = small_scene(grass=[{**GRASS, "head": "daisy"}], wind=[BREEZE], shadows={"size_px": 128})
    aovs = ("class", "depth", "blade_id", "motion")
    whole = renderer(scene)
    one = whole.render(1.0, aovs=aovs)
    _limited(monkeypatch, device, 2500)
    split = renderer(scene)
    many = split.render(1.0, aovs=aovs)
    assert len(split._world.field.pages) > 2
    for name in aovs:
        assert np.array_equal(one.truth[name], many.truth[name]), name
    roots = [
        blades_by_number(drawn._world.field)["root"][numbers_of(drawn._world.field, frame.truth["blade_id"])]
        for drawn, frame in ((whole, one), (split, many))
    ]
    assert np.array_equal(*roots)
    assert np.array_equal(one.image, many.image)


@pytest.mark.parametrize("density", [0.01, 1.0, 60.0, 600.0, 100_000.0])
def test_leaves_hold_one_to_four_thousand_blades(density):
    edge = leaf_edge_m(density)
    assert np.log2(edge) == np.round(np.log2(edge))
    assert 1000 <= density * edge * edge <= 4000
