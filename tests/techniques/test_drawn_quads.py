"""Tessellated quads as they are drawn: points, normals and colours of pixels against twins of the equations."""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import pytest

from blades import BLADE, blades_by_number, numbers_of
from greensward.ground import HeightField
from greensward.scene import InputError, SurfaceClass
from greensward.sowing.blade import BladeFlag
from greensward.sowing.identity import BladeKind
from greensward.sowing.pattern import pattern_of
from greensward.techniques import SETTINGS
from greensward.techniques.tessellated_quads.patches import patch_cells
from greensward.viewpoint import camera_view
from oracles import quads, wind_kinds
from small_scenes import GRASS, NOISE, small_scene, with_pictures

_SIZE = 320, 180
_WIDE = {**GRASS, "width_m": [0.04, 0.09], "height_m": [0.4, 0.8], "shape": "quad"}
_SOURCE = {
    "name": "tessellated-quads",
    "quads": "random",
    "bending_m": 0.35,
    "smoothness": 6,
    "shading": "blade",
    "edge_on": "drop",
    "orientation_limit": 1.0,
    "min_width_px": 0.0,
}
_BASE = {
    "grass": [_WIDE],
    "sowing": {
        "density_per_m2": 4.0,
        "reach_m": 9.0,
        "full_density_m": 100.0,
        "clumping": 0.0,
        "along_normal": 0.0,
    },
    "culling": {"distance": False},
    "shadows": {"enabled": False},
    "camera": {"position_m": [0.3, 1.1, 3.0], "target_m": [0.5, 0.35, -2.0], "fov_y_deg": 55.0},
}


def _scene(settings=None, tables=small_scene, **more):
    sowing, technique = {**_BASE["sowing"], **more.pop("sowing", {})}, {**_SOURCE, **(settings or {})}
    return tables(**{**_BASE, **more, "sowing": sowing, "technique": technique})


@dataclass
class Seen:
    """A picture, and what stands at its pixels."""

    scene: object
    truth: dict
    points: np.ndarray
    """World points of all pixels, (rows, columns, 3)."""
    eye: np.ndarray
    view: object
    ids: np.ndarray
    """Of the blades that show."""
    blades: np.ndarray
    """Those of them that are stored; empty for instances."""
    drawn: int
    at: dict = field(default_factory=dict)

    def pixels(self, blade_id):
        """Which pixels show a blade."""
        if not self.at:
            ids = self.truth["blade_id"].ravel()
            order = np.argsort(ids, kind="stable")
            starts = np.searchsorted(ids[order], self.ids)
            ends = np.searchsorted(ids[order], self.ids, side="right")
            self.at = {i: order[a:b] for i, a, b in zip(self.ids.tolist(), starts, ends, strict=True)}
        return self.at[blade_id]


@pytest.fixture
def see(renderer):
    def seen(scene, time_s=0.0, size=_SIZE):
        drawn = renderer(scene, size=size)
        frame = drawn.render(time_s, aovs=["depth", "blade_id", "normal", "albedo", "class"])
        view = camera_view(drawn.scene.camera, HeightField.of(drawn.scene), size)
        x, y = (2 * (np.arange(n) + 0.5) / n - 1 for n in size)
        middle, right, up = view.rays_ws
        rays = middle + x[None, :, None] * right - y[:, None, None] * up
        depth = frame.truth["depth"].astype(np.float64)[..., None]
        points = view.eye_ws[:3] + rays * np.where(np.isfinite(depth), depth, 0.0)
        ids = np.unique(frame.truth["blade_id"])[1:]
        stored = drawn.scene.technique.model_extra.get("mode") != "instanced"
        found = (
            blades_by_number(drawn._world.field)[numbers_of(drawn._world.field, ids)]
            if stored
            else np.zeros(0, BLADE)
        )
        return Seen(drawn.scene, frame.truth, points, view.eye_ws[:3], view, ids, found, frame.counts.drawn)

    return seen


@pytest.fixture(scope="module")
def once():
    """Pictures that several tests look at, by name."""
    return {}


@dataclass
class Twin:
    """What the source's equations make of the blades of a picture."""

    random: np.ndarray
    root: np.ndarray
    corners: np.ndarray
    control: tuple[np.ndarray, np.ndarray]
    level: np.ndarray


def _size(scene, name, count):
    return np.tile(np.array(getattr(scene.grass[0], name)), (count, 1))


def _finished(seen, random, root, bending=None, tall=1.0, smoothness=None):
    settings, count = seen.scene.technique.model_extra, len(root)
    bending = np.full(count, settings["bending_m"]) if bending is None else bending
    sizes = [_size(seen.scene, name, count) for name in ("width_m", "height_m")]
    corners = quads.outlines(root, random, sizes[0], sizes[1] * np.reshape(tall, (-1, 1)), bending)
    away = np.linalg.norm(root - seen.eye, axis=1)
    smoothness = np.full(count, settings["smoothness"]) if smoothness is None else smoothness
    level = quads.level_by_distance(smoothness, away, seen.scene.sowing.reach_m)
    return Twin(random, root, corners, quads.control_of(corners, random), level)


def _stored(seen, **more):
    """Twin of stored blades."""
    b = seen.blades
    return _finished(
        seen, quads.stored_randoms(b["random"], b["flags"], b["facing"]), b["root"].astype(float), **more
    )


def _instanced(seen, how, **more):
    """Twin of instances: ids tell patch and number in the pattern, and all else follows."""
    scene, patch_m = seen.scene, seen.scene.technique.model_extra["patch_m"]
    place = np.stack(
        [seen.ids >> np.uint64(40) & np.uint64(0xFFFFF), seen.ids >> np.uint64(20) & np.uint64(0xFFFFF)], 1
    )
    place = place.astype(np.int64)
    place -= (place >> 19) << 20
    index = (seen.ids & np.uint64(0xFFFFF)).astype(np.int64)
    stored = pattern_of(int(np.ceil(scene.sowing.density_per_m2 * patch_m**2)), scene.seed)[index]
    xz = (place + np.stack([stored["x"], stored["z"]], 1)) * patch_m
    share = xz / np.array(scene.ground.size_m) + 0.5
    random = quads.instanced_randoms(stored["random"].astype(float), index, place, how, xz, share)
    height = HeightField.of(scene).height(xz[:, 0], xz[:, 1])
    return _finished(seen, random, np.stack([xz[:, 0], height, xz[:, 1]], 1), **more)


def _fit(seen, twin, quads_of=None, least_px=25):
    """Distance in metres of the pixels of each large blade from its twin (n,), and how much of u and v they span."""
    away, spans, at = [], [], {}
    points = seen.points.reshape(-1, 3)
    for k, blade_id in enumerate(seen.ids.tolist()):
        mine = seen.pixels(blade_id)
        if len(mine) < least_px:
            continue
        count = int(np.ceil((twin.level if quads_of is None else quads_of)[k]))
        edges = [
            quads.edge(twin.corners[k, low], twin.control[low][k], twin.corners[k, 3 - low], max(count, 1))
            for low in (0, 1)
        ]
        off, u, v = quads.on_quads(points[mine], *edges)
        away.append(np.quantile(off, 0.9))
        spans.append((np.ptp(u), np.ptp(v)))
        at[k] = mine, u, v
    assert len(away) > 15, "blades are large enough to tell"
    return np.array(away), np.array(spans), at


def _basic(see, once):
    if "basic" not in once:
        once["basic"] = see(_scene())
    return once["basic"]


_CLOSE_M = 0.004


def test_stored_blades_are_the_source_s_equations(see, once):
    """Equations 2, 3, 4, 6, 7 and the position of 8: every pixel lies on the quads that they give, and fills them."""
    seen = _basic(see, once)
    twin = _stored(seen)
    away, spans, _ = _fit(seen, twin)
    assert np.quantile(away, 0.9) < _CLOSE_M
    assert np.median(spans, axis=0).min() > 0.85
    # so that a change of each would show
    for change in (-1, 1):
        other, *_ = _fit(seen, twin, np.maximum(twin.level + change, 1))
        assert np.median(other) > _CLOSE_M, "equation 4: one quad less or more"


_MAP_PX = 64
_NORTH_WEST, _SOUTH_EAST = (200, 40, 40), (40, 40, 200)


def _maps():
    """Not symmetric in x and z: density is 0 in the north-east, height half in the south-west, colours by corner."""
    density = np.full((_MAP_PX, _MAP_PX, 3), 255, np.uint8)
    half = _MAP_PX // 2
    density[:half, half:, 0] = 0
    density[half:, :half, 2] = 128
    density[half:, half:, 1] = 0
    colours = np.zeros((_MAP_PX, _MAP_PX, 4), np.uint8)
    colours[:half, :half] = (*_NORTH_WEST, 255)
    colours[half:, half:] = (*_SOUTH_EAST, 255)
    return {"density.png": density, "colours.png": colours}


def _mapped(settings, folder, **more):
    scene = _scene(
        settings,
        lambda **tables: with_pictures(folder, _maps(), **tables),
        sowing={"density_map": "density.png", "vegetation_map": "colours.png", "drift": 0.0},
        ground={**NOISE, "height_m": 3.0},
        camera={"position_m": [0.6, 2.2, 4.5], "target_m": [0.0, 0.2, -0.5], "fov_y_deg": 65.0},
        **more,
    )
    return scene


def _away_from_seams(twin):
    return (np.abs(twin.root[:, [0, 2]]) > 80.0 / _MAP_PX).all(axis=1)


def _tall_by_map(root):
    return np.where((root[:, 0] < 0) & (root[:, 2] > 0), 128 / 255, 1.0)


@pytest.mark.parametrize("how", ["hash", "ratio", "share", "sine"])
def test_instances_are_the_source_s_equations(see, once, tmp_path, how):
    """Equations 10 to 12 vary what equations 2, 3 and 6 take, on a height map, with blue of a density map."""
    seen = once[how] = see(_mapped({"mode": "instanced", "patch_m": 4.0, "variation": how}, tmp_path))
    roots = _instanced(seen, how).root
    twin = _instanced(seen, how, tall=_tall_by_map(roots))
    keep = _away_from_seams(twin)
    away, spans, at = _fit(seen, twin)
    kept = keep[list(at)]
    assert np.quantile(away[kept], 0.85) < 1.5 * _CLOSE_M
    assert np.median(spans[kept], axis=0).min() > 0.8
    x, z = roots[keep][:, [0, 2]].T
    assert not ((x > 0) & (z < 0)).any(), "red of the density map"
    assert all(((x > 0) == east)[(z > 0) == south].any() for east, south in ((0, 0), (0, 1), (1, 1)))


def test_maps_of_stored_blades(see, tmp_path):
    """The density map's red, green and blue channels, where each blade stands."""
    seen = see(_mapped({}, tmp_path))
    root = seen.blades["root"].astype(float)
    twin = _stored(seen, tall=_tall_by_map(root))
    keep = _away_from_seams(twin)
    away, _, at = _fit(seen, twin)
    assert np.quantile(away[keep[list(at)]], 0.85) < 1.5 * _CLOSE_M
    x, z = root[keep][:, [0, 2]].T
    assert not ((x > 0) & (z < 0)).any()
    low = (seen.blades["flags"][keep] & BladeFlag.LOW_DETAIL) != 0
    np.testing.assert_array_equal(low, ~((x > 0) & (z > 0)))
    _assert_colours(seen, twin, keep)


def test_instances_take_their_colours_from_the_vegetation_map(see, once, tmp_path):
    if "hash" not in once:
        once["hash"] = see(_mapped({"mode": "instanced", "patch_m": 4.0}, tmp_path))
    seen = once["hash"]
    twin = _instanced(seen, "hash")
    _assert_colours(seen, twin, _away_from_seams(twin))


def _linear(colour):
    return (np.array(colour) / 255.0) ** 2.2


def _assert_colours(seen, twin, keep):
    albedo, colours = seen.truth["albedo"].reshape(-1, 3), {-1: _NORTH_WEST, 1: _SOUTH_EAST}
    found = {-1: [], 1: []}
    for k in np.flatnonzero(keep):
        east, south = np.sign(twin.root[k, [0, 2]])
        mine = seen.pixels(seen.ids[k].item())
        if east == south and len(mine) > 6:
            mean = albedo[mine].mean(axis=0)
            found[int(east)].append(mean / mean.sum())
    for corner, colour in colours.items():
        expected = _linear(colour) / _linear(colour).sum()
        assert len(found[corner]) > 2
        assert np.abs(np.mean(found[corner], axis=0) - expected).max() < 0.08


def test_normals_are_those_of_equation_8_on_the_side_that_is_seen(see):
    seen = see(_scene({"smoothness": 64}))
    twin = _stored(seen)
    *_, at = _fit(seen, twin)
    agree, flipped = [], []
    normals, points = seen.truth["normal"].reshape(-1, 3), seen.points.reshape(-1, 3)
    for k, (mine, u, v) in at.items():
        lower, upper = twin.corners[k, :2], twin.corners[k, [3, 2]]
        sides = [
            quads.spline(*(np.tile(each, (len(mine), 1)) for each in (lower[e], twin.control[e][k], upper[e])), v)
            for e in (0, 1)
        ]
        *_, normal = quads.point(sides[0][0], sides[0][1], sides[1][0], sides[1][1], u)
        faces = np.einsum("ij,ij->i", normal, seen.eye - points[mine])
        sure = np.abs(faces) > 0.2 * np.linalg.norm(seen.eye - points[mine], axis=1)
        agree.append(np.einsum("ij,ij->i", normal * np.sign(faces)[:, None], normals[mine])[sure])
        flipped.append((faces < 0).mean() > 0.5)
    assert np.quantile(np.concatenate(agree), 0.1) > 0.99
    assert 0.2 < np.mean(flipped) < 0.8, "both sides are seen"


def test_colours_vary_by_three_random_values_and_darken_towards_the_root(see, tmp_path):
    """Section 5.1: the texel, times what is the blade's own, times the vertical texture coordinate."""
    grey = {"grey.png": np.full((8, 8, 3), 200, np.uint8)}
    grass = [{**_WIDE, "diffuse_texture": "grey.png"}]
    seen = see(_scene({}, lambda **tables: with_pictures(tmp_path, grey, **tables), grass=grass))
    twin = _stored(seen)
    *_, at = _fit(seen, twin)
    albedo, own = seen.truth["albedo"].reshape(-1, 3), twin.random[:, [3, 5, 6]] - 0.5
    texel, errors = _linear((200, 200, 200)), []
    for k, (mine, _, v) in at.items():
        expected = texel * (1 + 0.3 * own[k, 0] + 0.12 * own[k]) * v[:, None]
        sure = v > 0.2
        errors.append((albedo[mine][sure] / expected[sure] - 1.0).ravel())
    assert np.abs(np.median(np.concatenate(errors))) < 0.02
    assert np.quantile(np.abs(np.concatenate(errors)), 0.8) < 0.08
    # each component by its own value: against the second, the others are as the three values have it
    shades = np.array(
        [np.median(albedo[mine][v > 0.2] / albedo[mine][v > 0.2][:, 1:2], axis=0) for mine, _, v in at.values()]
    )
    blades = 1 + 0.3 * own[list(at), :1] + 0.12 * own[list(at)]
    differ = shades[:, [0, 2]] - (blades / blades[:, 1:2])[:, [0, 2]]
    assert np.ptp(shades[:, [0, 2]], axis=0).min() > 0.08
    assert np.quantile(np.abs(differ), 0.8) < 0.02


def test_the_size_on_the_screen_cuts_and_culls_as_equation_5_has_it(see):
    """Seen from above, blades that point down on the screen have a level below 0 and do not show."""
    above = {"position_m": [0.3, 3.0, 1.5], "target_m": [0.3, 0.0, 0.2], "fov_y_deg": 60.0}
    settings = {"level": "size", "px_per_quad": 9.0, "bending_m": 0.9}
    seen, every = (see(_scene({**settings, "level": level}, camera=above)) for level in ("size", "length"))
    twin = _stored(every)
    clip = (
        np.concatenate([twin.corners.reshape(-1, 3), np.ones((4 * len(twin.corners), 1))], 1)
        @ every.view.clip_from_world.T
    )
    y = (clip[:, 1] / clip[:, 3]).reshape(-1, 4)
    level = quads.level_by_size(6.0, y[:, 2:].mean(axis=1), y[:, :2].mean(axis=1), _SIZE[1], 9.0)
    sure = np.abs(level) > 0.3
    large = np.array([len(every.pixels(i)) > 40 for i in every.ids.tolist()])
    shown = np.isin(every.ids, seen.ids)
    assert (level[sure & large] < 0).sum() > 10
    np.testing.assert_array_equal(shown[sure & large], level[sure & large] > 0)
    order = np.searchsorted(every.ids, seen.ids)
    away, *_ = _fit(seen, _stored(seen), level[order])
    assert np.quantile(away, 0.85) < _CLOSE_M


# Level of detail --------------------------------------------------------------------------------------------------


def test_blades_lose_height_in_proportion_to_distance(see):
    """Section 6.3: a linear function lowers them, with all of their offset."""
    seen = see(_scene({"shrinking": 0.8}))
    away = np.linalg.norm(seen.blades["root"] - seen.eye, axis=1)
    lower = 1.0 - 0.8 * away / seen.scene.sowing.reach_m
    twin = _stored(seen, tall=lower, bending=0.35 * lower)
    off, spans, _ = _fit(seen, twin)
    assert np.quantile(off, 0.85) < 1.5 * _CLOSE_M
    assert np.median(spans[:, 1]) > 0.85
    assert np.ptp(lower) > 0.4


_ABOVE = {"position_m": [0.0, 14.0, 0.0], "target_m": [0.0, 0.0, -9.0], "fov_y_deg": 70.0}


@pytest.mark.parametrize("mode", ["basic", "instanced"])
def test_the_share_of_blades_left_out_is_in_proportion_to_distance(see, mode):
    """Section 6.3: by a random value and the distance as a part of the greatest; from above, none is hidden."""
    settings = {"mode": mode, "patch_m": 4.0, "min_width_px": 3.0, "edge_on": "turn", "bending_m": 0.1}
    far = {"density_per_m2": 4.0, "reach_m": 30.0}
    seen = {t: see(_scene({**settings, "thinning": t}, sowing=far, camera=_ABOVE)) for t in (0.0, 0.8)}
    every, left = (each.ids for each in seen.values())
    assert np.isin(left, every).mean() > 0.97
    points = seen[0.0].points.reshape(-1, 3)
    away = np.array(
        [np.linalg.norm(points[seen[0.0].pixels(i)].mean(axis=0) - seen[0.0].eye) for i in every.tolist()]
    )
    stays = np.isin(every, left)
    edges = np.quantile(away, [0.0, 0.25, 0.5, 0.75, 1.0])
    for near, beyond in pairwise(edges):
        ring = (away >= near) & (away < beyond)
        share = 1.0 - 0.8 * away[ring].mean() / 30.0
        # those that are left out next are narrow, and some of them are too narrow to show
        assert share - 0.06 < stays[ring].mean() < 1.12 * share + 0.03, (near, beyond)
    assert edges[-1] > 1.5 * edges[0]


# Patches ----------------------------------------------------------------------------------------------------------

_PATCHES = [
    {"from_m": [-20.0, -20.0], "to_m": [0.2, 20.0], "bending_m": 0.6, "smoothness": 2},
    {"from_m": [0.0, -20.0], "to_m": [20.0, 0.0], "bending_m": 0.7, "density": 3.0},
]


@pytest.mark.parametrize("mode", ["basic", "instanced"])
def test_patches_of_the_grid_have_their_own_bending_smoothness_and_density(see, mode):
    """A patch belongs to the area that holds its centre; a density of 3 shows three times as many blades."""
    settings = {"mode": mode, "patch_m": 2.0, "patch": _PATCHES}
    if mode == "instanced":
        seen = see(_scene({**settings, "variation": "hash"}, sowing={"density_per_m2": 2.0}))
        # three times as many are stored
        dense = seen.scene.model_copy(update={"sowing": seen.scene.sowing.model_copy(update={"density_per_m2": 6.0})})
        seen.scene = dense
        root = _instanced(seen, "hash").root
    else:
        seen = see(_scene(settings, sowing={"density_per_m2": 2.0}))
        root = seen.blades["root"].astype(float)
    west, north = np.floor(root[:, 0] / 2.0) < 0, np.floor(root[:, 2] / 2.0) < 0
    own = {
        "bending": np.where(west, 0.6, np.where(north, 0.7, 0.35)),
        "smoothness": np.where(west, 2, 6),
    }
    twin = _instanced(seen, "hash", **own) if mode == "instanced" else _stored(seen, **own)
    away, _, at = _fit(seen, twin, least_px=15)
    for region in (west, north & ~west, ~north & ~west):
        assert np.quantile(away[region[list(at)]], 0.8) < _CLOSE_M
    above = {"position_m": [0.0, 9.0, -1.9], "target_m": [0.0, 0.0, -2.0], "fov_y_deg": 50.0}
    few = {"density_per_m2": 2.0, "reach_m": 30.0}
    high = see(_scene({**settings, "min_width_px": 1.0}, camera=above, sowing=few))
    shown = high.points.reshape(-1, 3)[[high.pixels(i)[0] for i in high.ids.tolist()]]
    near = (np.abs(shown[:, 0]) < 4.0) & (shown[:, 2] < -0.8) & (shown[:, 2] > -4.0)
    east = (shown[near, 0] > 0).sum()
    assert 2.0 < east / (near.sum() - east) < 4.5


def test_a_density_of_0_leaves_a_patch_bare_and_tables_have_no_limit(see):
    bare = [
        {"from_m": [2.0 * i, 2.0 * j], "to_m": [2.0 * i + 2.0, 2.0 * j + 2.0], "density": float((i + j) % 2)}
        for i in range(-6, 6)
        for j in range(-6, 6)
    ]
    seen = see(_scene({"patch_m": 2.0, "patch": bare}))
    cell = np.floor(seen.blades["root"][:, [0, 2]] / 2.0).astype(int).sum(axis=1)
    assert len(cell) > 30
    assert (cell % 2 == 1).all()


def test_a_patch_belongs_to_the_area_that_holds_its_centre():
    """Of several the last counts; the table begins at the first patch of any."""
    areas = [
        {"from_m": [-4.0, -2.0], "to_m": [2.9, 2.9]},  # not quite the centres at 3
        {"from_m": [1.1, -0.9], "to_m": [5.1, 1.1]},
    ]
    settings = SETTINGS["tessellated-quads"].model_validate({"patch_m": 2.0, "patch": areas})
    cells, first = patch_cells(settings)
    np.testing.assert_array_equal(first, [-2, -1])
    np.testing.assert_array_equal(cells, [[1, 1, 1, 0, 0], [1, 1, 1, 2, 2]])


def test_patches_must_fit_into_a_texture(renderer):
    far = [{"from_m": [x, 0.0], "to_m": [x + 1.0, 1.0]} for x in (-100_000.0, 100_000.0)]
    with pytest.raises(InputError, match=r"technique\.patch: must reach over .* raise technique\.patch_m"):
        renderer(_scene({"patch_m": 1.0, "patch": far}))


# Wind ---------------------------------------------------------------------------------------------------------------


def _tips(seen):
    """Mean of the upper quarter of the pixels of each large blade, by id."""
    points = seen.points.reshape(-1, 3)
    found = {}
    for i in seen.ids.tolist():
        mine = points[seen.pixels(i)]
        if len(mine) >= 24:
            found[i] = mine[np.argsort(mine[:, 1])[-len(mine) // 4 :]].mean(axis=0)
    return found


def _moved(see, winds, mode, tables=small_scene):
    """How far the tips of blades that show with and without wind move, and their places in still air."""
    settings = {"mode": mode, "patch_m": 4.0, "quads": "sown"}
    calm, windy = (_tips(see(_scene(settings, tables, wind=each), 1.0)) for each in ([], winds))
    both = sorted(calm.keys() & windy.keys())
    assert len(both) > 25
    still = np.array([calm[i] for i in both])
    return np.array([windy[i] for i in both]) - still, still


@pytest.mark.parametrize("mode", ["basic", "instanced"])
def test_blades_are_drawn_where_equation_9_blows_them(see, mode):
    numbers = {"direction_deg": 270.0, "speed_mps": 7.0, "wave_m": 3.0, "swell_m": 11.0, "front_m": 5.0}
    numbers |= {"epsilon": 0.08, "rate_hz": 0.3}
    moved, at = _moved(see, [{"kind": "ripples", **numbers}], mode)
    wind = wind_kinds.ripples(at, 1.0, *numbers.values())
    strong = np.abs(wind[:, 0]) > 2.0
    assert (np.sign(moved[strong, 0]) == np.sign(wind[strong, 0])).mean() > 0.85
    assert np.corrcoef(moved[:, 0], wind[:, 0])[0, 1] > 0.6
    assert np.ptp(np.sign(wind[strong, 0])) == 2, "it blows to and fro"


@pytest.mark.parametrize("mode", ["basic", "instanced"])
@pytest.mark.parametrize(("colour", "way"), [((255, 128, 128), 0), ((128, 255, 128), 2)], ids=["red", "green"])
def test_painted_wind_blows_along_its_channels(see, tmp_path, mode, colour, way):
    picture = {"wind.png": np.full((4, 4, 3), colour, np.uint8)}
    painted = [{"kind": "texture", "files": ["wind.png"]}]
    moved, _ = _moved(see, painted, mode, lambda **tables: with_pictures(tmp_path, picture, **tables))
    mean = moved.mean(axis=0)
    assert mean[way] > 0.05
    assert abs(mean[2 - way]) < 0.4 * mean[way]


# Ground and objects -----------------------------------------------------------------------------------------------


def test_equation_1_blends_the_terrain_map_over_the_tile_by_its_alpha(see, tmp_path):
    """No noise of ours is on pictures: each point of bare ground has the colour of the equation."""
    pictures = {
        "tile.png": np.full((8, 8, 3), (180, 60, 60), np.uint8),
        "map.png": np.full((8, 8, 4), (40, 90, 200, 102), np.uint8),
    }
    ground = {"texture": "tile.png", "terrain_map": "map.png"}
    tables = lambda **given: with_pictures(tmp_path, pictures, **given)  # noqa: E731
    seen = see(_scene({}, tables, ground=ground, sowing={"density_per_m2": 0.0}))
    albedo = seen.truth["albedo"][seen.truth["class"] == SurfaceClass.GROUND]
    expected = _linear((180, 60, 60)) * (1 - 0.4) + _linear((40, 90, 200)) * 0.4
    assert np.abs(np.quantile(albedo, (0.05, 0.95), axis=0) / expected - 1.0).max() < 0.08


@pytest.mark.parametrize("ground", ["none", "flat"])
def test_instances_need_ground_and_grass_on_objects_grows_beside_them(see, ground):
    box = {"kind": "box", "position_m": [0.5, 0.5, -1.0], "grass": {"density_per_m2": 150.0}}
    seen = see(_scene({"mode": "instanced", "patch_m": 4.0}, ground={"kind": ground}, object=[box]))
    kinds = seen.ids >> np.uint64(60)
    assert (kinds == BladeKind.OBJECT).sum() > 20
    assert (kinds == BladeKind.PATCH).any() == (ground == "flat")
    assert seen.drawn >= len(seen.ids)
    points = seen.points.reshape(-1, 3)
    on_box = [points[seen.pixels(i)][:, 1].min() for i in seen.ids[kinds == BladeKind.OBJECT].tolist()]
    assert np.median(on_box) > 0.2, "on the box, which stands off the ground"


# Settings ---------------------------------------------------------------------------------------------------------

_EACH = {
    "mode": ({"mode": "instanced"}, "blade_id"),
    "patch_m": ({"patch_m": 2.0}, "blade_id"),
    "densities": ({"densities": 1}, "considered"),
    "variation": ({"variation": "sine"}, "depth"),
    "level": ({"level": "length"}, "depth"),
    "smoothness": ({"smoothness": 2}, "depth"),
    "px_per_quad": ({"px_per_quad": 40.0}, "depth"),
    "quads": ({"quads": "sown"}, "depth"),
    "bending_m": ({"bending_m": 0.1}, "depth"),
    "thinning": ({"thinning": 1.0}, "drawn"),
    "shrinking": ({"shrinking": 1.0}, "depth"),
    "shading": ({"shading": "sward"}, "albedo"),
    "alpha": ({"alpha": "hashed"}, "class"),
    "patch": ({"patch": [{"from_m": [-20.0, -20.0], "to_m": [20.0, 20.0], "density": 0.2}]}, "drawn"),
    "min_width_px": ({"min_width_px": 8.0}, "class"),
    "roundness": ({"roundness": 0.0}, "normal"),
    "edge_on": ({"edge_on": "turn"}, "depth"),
    "orientation_limit": ({"orientation_limit": 0.5}, "class"),
}
_WITH = {
    "patch_m": {"mode": "instanced"},
    "densities": {"mode": "instanced", "thinning": 1.0},
    "variation": {"mode": "instanced", "patch_m": 4.0},
    "px_per_quad": {"level": "length"},
    "roundness": {"shading": "sward"},
}


def test_every_setting_is_looked_at():
    assert set(_EACH) == set(SETTINGS["tessellated-quads"].model_fields)


@pytest.mark.parametrize("name", _EACH)
def test_a_setting_changes_what_it_is_for(renderer, tmp_path, name):
    """What else it does is in the tests above; ignored, it would leave all as it was."""
    changed, what = _EACH[name]
    soft = {"soft.png": np.tile(np.linspace(255, 30, 16, dtype=np.uint8)[:, None, None], (1, 16, 4))}
    grass = [{**_WIDE, "alpha_texture": "soft.png"}] if name == "alpha" else [_WIDE]
    found = []
    for settings in ({}, changed):
        tables = lambda **given: with_pictures(tmp_path, soft, **given)  # noqa: E731
        scene = _scene({**_WITH.get(name, {}), **settings}, tables, grass=grass)
        frame = renderer(scene, size=(160, 90)).render(aovs=["depth", "blade_id", "normal", "albedo", "class"])
        found.append(getattr(frame.counts, what) if what in ("drawn", "considered") else frame.truth[what])
    if what in ("drawn", "considered"):
        assert abs(found[0] - found[1]) > 0.1 * found[0]
    else:
        seen, other = (np.where(np.isfinite(each), each, 1e3).astype(float) for each in found)
        differ = np.abs(seen - other) > 1e-3
        assert differ.mean() > 0.01
    if name == "mode":
        assert [BladeKind.PATCH in each >> np.uint64(60) for each in found] == [False, True]


_HERE = {"from_m": [-20.0, -20.0], "to_m": [20.0, 20.0]}


def test_a_patch_has_width_and_height_of_its_own_range(see):
    """Equation 2 with the ranges of its table."""
    seen = see(_scene({"patch_m": 4.0, "patch": [{**_HERE, "width_m": [0.1, 0.15], "height_m": [0.2, 0.3]}]}))
    own = seen.scene.grass[0].model_copy(update={"width_m": (0.1, 0.15), "height_m": (0.2, 0.3)})
    seen.scene = seen.scene.model_copy(update={"grass": (own,)})
    away, spans, _ = _fit(seen, _stored(seen))
    assert np.quantile(away, 0.85) < _CLOSE_M
    assert np.median(spans, axis=0).min() > 0.8


@pytest.mark.parametrize(
    ("key", "value"),
    [("density", 0.4), ("width_m", [0.2, 0.3]), ("height_m", [0.1, 0.2]), ("bending_m", 0.9), ("smoothness", 1)],
)
def test_each_key_of_a_patch_changes_what_stands_on_it(renderer, key, value):
    images = [
        renderer(_scene({"patch_m": 4.0, "patch": [{**_HERE, **keys}]}), size=_SIZE).render().image
        for keys in ({}, {key: value})
    ]
    assert (images[0] != images[1]).mean() > 0.01


@pytest.mark.parametrize("mode", ["basic", "instanced"])
def test_patches_say_nothing_of_grass_on_objects(renderer, mode):
    box = {"kind": "box", "position_m": [0.5, 0.5, -1.0], "grass": {"density_per_m2": 150.0}}
    tables = {"ground": {"kind": "none"}, "object": [box]}
    images = [
        renderer(_scene({"mode": mode, "patch_m": 4.0, "patch": patches}, **tables), size=_SIZE).render().image
        for patches in ([], [{**_HERE, "width_m": [0.3, 0.4], "height_m": [0.1, 0.2], "density": 0.2}])
    ]
    assert np.array_equal(*images)


def test_a_blade_has_the_colour_of_the_vegetation_map_at_its_root(see, tmp_path):
    """East and west, which north and south do not share."""
    halves = np.zeros((8, 8, 4), np.uint8)
    halves[:, :4], halves[:, 4:] = (200, 40, 40, 255), (40, 40, 200, 255)
    scene = _scene(
        {},
        lambda **tables: with_pictures(tmp_path, {"halves.png": halves}, **tables),
        sowing={"vegetation_map": "halves.png"},
        ground={"size_m": [40.0, 40.0]},
    )
    seen = see(scene)
    albedo, checked = seen.truth["albedo"].reshape(-1, 3), 0
    for blade, root in zip(seen.ids.tolist(), seen.blades["root"], strict=True):
        if abs(root[0]) > 3.0:
            mean = albedo[seen.pixels(blade)].mean(axis=0)
            assert (mean[0] > mean[2]) == (root[0] < 0)
            checked += 1
    assert checked > 10


def test_a_long_texture_keeps_its_outline_from_afar(renderer, tmp_path):
    """A quarter of it is clear, in stripes across: where a pixel is taller than these, nothing of it is."""
    rows = np.where(np.arange(256) % 16 < 4, 0, 255).astype(np.uint8)
    striped, whole = np.full((256, 8, 4), 255, np.uint8), np.full((256, 8, 4), 255, np.uint8)
    striped[..., 3] = rows[:, None]
    shares = []
    for pixels in (striped, whole):
        grass = [{**_WIDE, "width_m": [0.2, 0.2], "alpha_texture": "blade.png"}]
        camera = {"position_m": [0.0, 1.0, 16.0], "target_m": [0.0, 0.3, 0.0], "fov_y_deg": 30.0}
        scene = _scene(
            {"quads": "sown"},
            lambda pixels=pixels, **tables: with_pictures(tmp_path, {"blade.png": pixels}, **tables),
            grass=grass,
            camera=camera,
            sowing={"reach_m": 30.0, "density_per_m2": 1.0},
        )
        truth = renderer(scene, size=(160, 90)).render(aovs=["class"]).truth
        shares.append((truth["class"] == SurfaceClass.GRASS).mean())
    assert shares[1] > 0.02
    assert shares[0] > 0.93 * shares[1]
