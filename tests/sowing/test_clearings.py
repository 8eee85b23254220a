"""Clearings: what shaders make of them, and that no technique draws grass there."""

import numpy as np
import pytest

from greensward.ground import HeightField
from greensward.ground.ground_gpu import GROUND_BLOCK
from greensward.objects.placing import Placing
from greensward.scene import Scene, SceneError, SurfaceClass
from greensward.sowing.clearings import packed, pieces_of, sward_defines
from greensward.techniques import TECHNIQUES
from oracles.clearings import open_at
from shader_calls import shader_call
from small_scenes import GRASS, small_scene

ROAD = {"path": [[-8.0, 3.0], [2.0, 4.0], [9.0, -6.0]], "width_m": 1.5, "edge_m": 0.6}
YARD = {"outline": [[-5.0, -5.0], [1.0, -7.0], [-1.5, -3.0], [3.0, 0.0], [-6.0, 1.0]], "edge_m": 0.3}
TREE = {"path": [[6.0, 6.0]], "width_m": 2.0, "edge_m": 0.0}
POST = {"kind": "box", "position_m": [4.5, -0.1, 2.0], "size_m": [0.06, 1.2, 0.06], "yaw_deg": 30.0}
SHAPES = {"clear": [ROAD, YARD, TREE], "object": [POST]}


def _pieces(scene: Scene, scripts=None):
    heights = HeightField.of(scene)
    return pieces_of(scene, Placing(scene.object, heights, scripts), scene.object, heights)


def _texture(ctx, texels):
    rows = -(-len(texels) // 1024)
    data = np.zeros((rows * 1024, 4), np.uint32)
    data[: len(texels)] = texels
    return ctx.texture((1024, rows), 4, data.tobytes(), dtype="u4")


@pytest.mark.parametrize("anchor_m", [0.0, 8192.0 * 122])
@pytest.mark.parametrize("footprint_m", [0.0, 0.8])
def test_the_shader_finds_what_lies_around_a_point(device, footprint_m, anchor_m):
    scene = small_scene(**SHAPES)
    pieces = _pieces(scene)
    points = np.random.default_rng(3).uniform(-9.0, 9.0, (6000, 2)).astype(np.float32)
    points[:1000] = points[:1000] * 0.01 + [4.5, 2.0]
    expected = open_at(points.astype(np.float64), pieces, footprint_m)
    far = type(pieces)(pieces.corners + anchor_m, pieces.radius_m, pieces.edge_m, pieces.width_m)
    texture = _texture(device.ctx, packed(far))
    found = shader_call(
        device, "sowing/clearings.glsl", f"openAt(xz, {footprint_m})", {"xz": points}, "float",
        defines={"CLEARINGS": 1}, bindings={"clearings": texture},
        blocks={GROUND_BLOCK: {"anchor_m": (anchor_m, anchor_m)}},
    )  # fmt: skip
    texture.release()
    assert 0.1 < (expected == 0.0).mean() < 0.9
    # a footprint reaches over the edge of its cell, where only what lies near it is listed
    off = np.abs(found - expected)
    assert off.max() < 2e-4 if not footprint_m else (off > 1e-3).mean() < 0.12


def test_thousands_of_shapes_leave_few_to_look_at():
    random = np.random.default_rng(1)
    trees = [{"path": [xz], "width_m": 0.4} for xz in random.uniform(-200.0, 200.0, (999, 2)).tolist()]
    texels = packed(_pieces(small_scene(clear=[*trees, {"path": [[-9e5, 0.0], [9e5, 3.0]], "width_m": 6.0}])))
    buckets = int(texels[1, 1]) + 1
    assert texels[2 : 2 + buckets, 1].max() <= 12
    assert len(texels) < 60_000


def test_what_moves_floats_or_is_told_not_to_clears_nothing():
    slab = {"kind": "box", "position_m": [0.0, 0.0, 0.0], "size_m": [2.0, 0.1, 1.0], "name": "slab"}
    path = {"times_s": [0.0, 1.0], "positions_m": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]}
    assert len(_pieces(small_scene(object=[slab])).corners) == 1
    for changed in ({"path": path}, {"clears": False}, {"drawn": False}, {"position_m": [0.0, 0.6, 0.0]}):
        assert len(_pieces(small_scene(object=[{**slab, **changed}])).corners) == 0
    assert len(_pieces(small_scene(object=[slab]), {"slab": lambda _: (0.0, 0.0, 0.0)}).corners) == 0
    assert len(_pieces(small_scene(object=[slab], ground={"kind": "none"})).corners) == 0
    assert "CLEARINGS" not in sward_defines(small_scene(object=[{**slab, "clears": False}]))
    assert "CLEARINGS" in sward_defines(small_scene(object=[slab]))


@pytest.mark.parametrize(
    ("table", "expected"),
    [
        ({}, "clear[0]: must have path, with width_m, or outline (got neither)"),
        ({"path": [[0, 0]], "outline": [[0, 0], [1, 0], [0, 1]]}, "or outline (got both)"),
        ({"path": [[0, 0], [1, 1]]}, "clear[0]: width_m is missing, the width of the path"),
        ({"path": [[0, 0]], "width_m": 0}, "clear[0].width_m: must be at least 0.001 (got 0)"),
        ({"outline": [[0, 0], [1, 0], [0, 1]], "width_m": 1.0}, "clear[0]: width_m is for a path"),
        ({"outline": [[0, 0], [1, 0]]}, "clear[0]: outline must have three corners at least, all different (got 2"),
        ({"outline": [[0, 0], [1, 0], [0, 1], [0, 0]]}, "(got 4, 3 of them different); it is closed without"),
        (
            {"outline": [[0, 0], [1, 1], [1, 0], [0, 1]]},
            "clear[0]: outline must not cross itself, and its sides 0 and",
        ),
        ({"outline": [[0, 0], [1, 1], [2, 2]]}, "clear[0]: outline must enclose an area"),
        ({"path": [[0, 0]], "width_m": 1.0, "edge": 2}, "clear[0].edge: unknown key; did you mean edge_m?"),
    ],
)
def test_an_area_that_is_none_is_refused(table, expected):
    with pytest.raises(SceneError) as caught:
        Scene(clear=[table])
    assert expected in str(caught.value)


DOWN = {"position_m": [0.0, 9.0, 0.0], "target_m": [0.0, 0.0, -0.01], "fov_y_deg": 60.0}
SHORT = {**GRASS, "height_m": [0.05, 0.08], "width_m": [0.02, 0.03], "tilt_deg": [0.0, 20.0]}
SQUARE = {"outline": [[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]], "edge_m": 0.0}
VARIANTS = [
    *((technique.name, {}, {}) for technique in TECHNIQUES),
    *(
        pytest.param(*each, marks=pytest.mark.slow)
        for each in (
            ("visibility-buffer", {}, {"stored_m": 0.0}),
            ("visibility-buffer", {}, {"traced_m": 4.0}),
            ("tessellated-quads", {"mode": "instanced"}, {}),
            ("expanded-roots", {"storage": "texture-array", "extra_blades": 2}, {}),
            ("geometry-billboards", {"levels_m": [0.5, 1.0, 2.0]}, {}),
        )
    ),
]


@pytest.mark.usefixtures("coarse_far")
@pytest.mark.parametrize(("technique", "settings", "sowing"), VARIANTS)
def test_no_technique_draws_grass_in_a_clearing(renderer, technique, settings, sowing):
    sowing = {"density_per_m2": 150.0, "full_density_m": 30.0, "reach_m": 40.0, **sowing}
    tables = {"grass": [SHORT], "sowing": sowing, "camera": DOWN, "shadows": {"enabled": False}}
    drawn = renderer(small_scene(technique={"name": technique, **settings}, clear=[SQUARE], **tables), size=(96, 96))
    kinds = drawn.render(aovs=["class"]).truth["class"]
    half = round(2.0 / 9.0 / np.tan(np.radians(30.0)) * 48)  # of the square, in pixels
    edge = 5
    inside = kinds[48 - half + edge : 48 + half - edge, 48 - half + edge : 48 + half - edge]
    outside = np.concatenate([kinds[: 48 - half - edge].ravel(), kinds[48 + half + edge :].ravel()])
    assert (inside == SurfaceClass.GRASS).sum() == 0
    assert (outside == SurfaceClass.GRASS).mean() > 0.15
