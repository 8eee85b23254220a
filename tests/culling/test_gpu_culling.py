"""Tests per blade on the GPU: pictures stay as they are, whatever is left out."""

import moderngl
import numpy as np
import pytest

from greensward.culling import DRAW_COMMAND, BladeCulling, ChunkTable, DepthPyramid
from greensward.culling.depth_pyramid import level_sizes
from greensward.gpu.device import Device
from greensward.gpu.kernels import Kernel
from greensward.gpu.layouts import BlockBuffer
from greensward.gpu.view import VIEW_BLOCK, View, view_values
from greensward.ground import HeightField
from greensward.renderer import Counts
from greensward.scene import Culling, SurfaceClass
from greensward.sowing.blade import BLADE, POSE
from greensward.sowing.sower import Sower
from greensward.sowing.species import SWARD_BLOCK
from greensward.techniques.blades.leaf import LEAF_BLOCK
from greensward.viewpoint import camera_view
from oracles import culling
from shader_calls import Neutral, shader_call, surface_at
from small_scenes import BREEZE, GRASS, NOISE, small_scene

_EXACT = ("orientation", "frustum", "occlusion")
_AOVS = ("class", "depth", "blade_id", "normal", "motion")
_BOX = {"kind": "box", "position_m": [0.0, 0.0, 0.5], "size_m": [1.6, 1.1, 0.4]}
_RIDGE = {**NOISE, "height_m": 14.0, "wavelength_m": 18.0}
_SCENES = {
    "flat": {},
    "hills": {"ground": _RIDGE, "sowing": {"reach_m": 35.0, "full_density_m": 12.0}},
    "a box in front": {"object": [_BOX]},
    "dropped edge-on": {"technique": {"name": "bezier-blades", "edge_on": "drop"}, "object": [_BOX], "ground": NOISE},
    "dropped edge-on and folded": {
        "technique": {"name": "bezier-blades", "edge_on": "drop", "orientation_limit": 0.6, "min_width_px": 3.0},
        "grass": [{**GRASS, "shape": "quadratic-3d"}],
    },
    "heads in a storm": {
        "grass": [{**GRASS, "head": "daisy", "tilt_deg": [0.0, 80.0]}],
        "wind": [{**BREEZE, "speed_mps": 25.0}],
        "object": [_BOX],
    },
    "inside the grass": {
        "camera": {"position_m": [0.0, 0.15, 0.0], "target_m": [0.3, 0.2, -3.0]},
        "object": [{**_BOX, "position_m": [0.4, 0.0, -0.8]}],
        "grass": [{**GRASS, "width_m": [0.04, 0.06]}],
    },
    "between root and tip": {
        # nearer than the blades are long, through a view too narrow for their ends
        "camera": {"position_m": [0.0, 1.0, 1.2], "target_m": [0.0, 1.0, -2.0], "fov_y_deg": 4.0},
        "grass": [{**GRASS, "height_m": [2.0, 2.4], "tilt_deg": [0.0, 10.0]}],
        "object": [{**_BOX, "position_m": [0.0, 0.0, -2.0], "size_m": [0.06, 3.0, 0.1]}],
    },
    "all hidden": {"object": [{**_BOX, "position_m": [0.0, 0.0, 3.2], "size_m": [40.0, 10.0, 0.1]}]},
    "a sphere of grass": {
        "ground": {"kind": "none"},
        "object": [
            {
                "kind": "sphere",
                "position_m": [0.0, 0.0, 0.0],
                "size_m": [2.0, 2.0, 2.0],
                "grass": {"density_per_m2": 300.0},
            }
        ],
        "grass": [{**GRASS, "height_m": [0.1, 0.2]}],
    },
    "thin poles": {
        "object": [
            {**_BOX, "position_m": [0.21 * i - 1.5, 0.0, 1.5], "size_m": [0.02 + 0.005 * i, 2.0, 0.02]}
            for i in range(15)
        ]
    },
}


def _culled(**flags: bool) -> dict[str, dict[str, bool]]:
    return {"culling": dict.fromkeys((*_EXACT, "distance"), False) | flags}


def _frame(renderer, tables, flags, **options):
    drawn = renderer(small_scene(**{**tables, **_culled(**flags)}), **options)
    frame = drawn.render(1.0, aovs=_AOVS)
    drawn.release()  # the next takes over its programs
    return frame


def _assert_same(a, b) -> None:
    for name in ("class", "depth", "blade_id", "normal", "motion"):
        assert np.array_equal(a.truth[name], b.truth[name]), name
    assert np.array_equal(a.image, b.image)


@pytest.mark.slow
@pytest.mark.parametrize("samples", [1, 2])
@pytest.mark.parametrize("scene", _SCENES)
def test_the_picture_is_that_of_every_blade(renderer, scene, samples):
    """By each test alone, and by all of them, as of samples beside the pixels' centres."""
    options = {"samples": samples, "size": (96, 54)}
    every = _frame(renderer, _SCENES[scene], {"distance": True}, **options)
    assert every.counts.drawn <= every.counts.considered
    for name in _EXACT if samples == 1 else ():
        some = _frame(renderer, _SCENES[scene], {"distance": True, name: True}, **options)
        _assert_same(some, every)
        assert some.counts.drawn <= every.counts.drawn
    both = _frame(renderer, _SCENES[scene], dict.fromkeys((*_EXACT, "distance"), True), **options)
    _assert_same(both, every)
    if scene != "all hidden":
        assert both.counts.pixels > 100


@pytest.mark.slow
@pytest.mark.parametrize(
    ("test", "scene", "most"),
    [
        ("frustum", "flat", 0.8),
        ("frustum", "between root and tip", 0.5),
        ("occlusion", "hills", 0.9),
        ("occlusion", "a box in front", 0.99),
        ("occlusion", "all hidden", 0.05),
        ("occlusion", "a sphere of grass", 0.9),
        ("orientation", "dropped edge-on", 0.9),
        ("orientation", "dropped edge-on and folded", 0.7),
        ("distance", "flat", 0.9),
    ],
)
def test_each_test_leaves_blades_out(renderer, test, scene, most):
    in_view = {"frustum": True} if test == "occlusion" else {}
    without, with_it = (_frame(renderer, _SCENES[scene], {**in_view, test: on}).counts for on in (False, True))
    assert without.drawn > 500
    assert with_it.drawn < most * without.drawn
    assert with_it.drawn < with_it.considered


def test_without_tests_every_blade_is_drawn(renderer):
    """Also in tiles that were handed over in part; blades beyond the reach are none."""
    drawn = renderer(small_scene(**_culled(), sowing={"reach_m": 30.0}))
    counts = drawn.render().counts
    page = drawn._world.field.pages[0]
    assert 0.9 * counts.considered < counts.drawn <= counts.considered
    sown = {int(n) for n in page.tiles.up_to[:, 7]}
    handed = {int(n) for n in page.tiles.up_to[:, :7].ravel()} - sown
    assert handed, "tiles that could be handed over in part"
    (seen,) = drawn._world.visible.of(drawn._view)
    rows = np.frombuffer(drawn._world.visible.chunks.buffer.read(), np.uint32).reshape(-1, 2)
    rows = rows[seen.blades.first : seen.blades.first + seen.blades.count]
    whole = {int(start): int(n) for start, n in zip(page.tiles.start, page.tiles.up_to[:, 7], strict=True)}
    handed_over = rows[:, 1].sum()
    assert handed_over == sum(n for start, n in whole.items() if start in set(rows[:, 0].tolist()))


@pytest.mark.slow
def test_turned_blades_are_never_left_out_edge_on(renderer):
    on, off = (_frame(renderer, _SCENES["flat"], {"orientation": flag}).counts for flag in (True, False))
    assert on == off


def test_blades_dropped_edge_on_thin_the_picture(renderer):
    turned, dropped = (
        _frame(renderer, {"technique": {"name": "bezier-blades", "edge_on": how}}, {}).counts.pixels
        for how in ("turn", "drop")
    )
    assert 0.3 * turned < dropped < 0.97 * turned


@pytest.mark.parametrize("samples", [1, 3])
def test_counts_are_those_of_the_first_sample(renderer, samples):
    drawn = renderer(small_scene(**_SCENES["heads in a storm"]), samples=samples)
    assert drawn.counts == Counts()
    frame = drawn.render(1.0, aovs=("class", "blade_id"))
    shows = (frame.truth["class"] == SurfaceClass.GRASS) & (frame.truth["blade_id"] > 0)
    assert frame.counts == drawn.counts
    assert frame.counts.pixels == shows.sum() > 100
    assert frame.counts.considered == drawn.blades_in_view
    assert frame.counts.simulated == 0
    ids = np.unique(frame.truth["blade_id"][frame.truth["class"] == SurfaceClass.GRASS])
    assert len(ids) <= frame.counts.drawn < frame.counts.considered


def test_counts_change_with_the_frame(ctx, renderer):
    drawn = renderer(small_scene())
    first = drawn.render().counts
    aside = drawn.scene.camera.model_copy(update={"target_m": (9.0, 0.0, 1.0)})
    assert drawn.render(camera=aside).counts != first
    assert drawn.render().counts == first
    target = ctx.framebuffer([ctx.texture((160, 90), 4)])
    drawn.draw(target)
    assert drawn.counts == first
    drawn.advance(3.0, camera=aside)
    assert drawn.counts == first
    for part in (*target.color_attachments, target):
        part.release()


def test_blades_with_a_memory_are_counted(renderer):
    drawn = renderer(small_scene(simulation={"within_m": 6.0}))
    assert 0 < drawn.render(0.1).counts.simulated == drawn._world.blades_simulated


def test_several_pages_are_drawn_like_one(renderer, monkeypatch):
    tables = {**_SCENES["hills"], "wind": [BREEZE]}
    one = renderer(small_scene(**tables)).render(1.0, aovs=_AOVS)
    usual = Sower.__init__
    monkeypatch.setattr(Sower, "__init__", lambda self, device, path, _, *more: usual(self, device, path, 700, *more))
    drawn = renderer(small_scene(**tables))
    several = drawn.render(1.0, aovs=_AOVS)
    assert len(drawn._world.field.pages) > 5
    assert several.counts == one.counts
    _assert_same(several, one)


def _pyramid(device: Device, depth: np.ndarray) -> tuple[moderngl.Texture, DepthPyramid]:
    """A G-buffer's surface with these depths, rows from the bottom, and a pyramid of it."""
    bindings = Neutral(gbuffer_surface=surface_at(device, depth))
    made = DepthPyramid(device, bindings)
    bindings.kernel = made._kernel
    return bindings["gbuffer_surface"], made


@pytest.mark.parametrize("size", [(1, 1), (2, 3), (7, 5), (160, 90), (161, 93), (257, 3), (64, 64)])
def test_pyramid(device, size):
    random = np.random.default_rng(size[0])
    depth = random.uniform(0.1, 900.0, size[::-1]).astype(np.float32)
    depth[random.uniform(size=depth.shape) < 0.01] = np.inf
    texture, made = _pyramid(device, depth)
    for _ in range(2):  # the buffer is used again
        made.build(texture.size)
    sizes = level_sizes(size)
    flat = np.frombuffer(made.buffer.read(), np.float32)
    expected = culling.pyramid(depth, len(sizes))
    assert sizes[-1] == (1, 1)
    for (columns, rows), level in zip(sizes, expected, strict=True):
        assert level.shape == (rows, columns)
        assert np.array_equal(flat[: rows * columns].reshape(rows, columns), level)
        flat = flat[rows * columns :]
    texture.release()
    made.release()


def _blades(count: int, seed: int) -> tuple[np.ndarray, ...]:
    random = np.random.default_rng(seed)
    v0 = random.uniform([-6, 0, -12], [6, 2, 4], (count, 3))
    v1, v2 = (v0 + random.uniform(-0.6, 0.6, (count, 3)) for _ in range(2))
    return tuple(v.astype(np.float32) for v in (v0, v1, v2))


def _call(device, view, body: str, output: str, blades, pixels: np.ndarray | None = None) -> np.ndarray:
    """A function of culling/occlusion.glsl for every blade, with a picture's depth."""
    relative = [(points - view.origin_ws).astype(np.float32) for points in blades]
    made, bindings = (), {}
    if pixels is not None:
        made = _pyramid(device, pixels)
        made[1].build(view.size_px)
        bindings = {"DepthPyramid": made[1].buffer}
    result = shader_call(
        device,
        "culling/occlusion.glsl" if "outside" not in body else "culling/tests.glsl",
        body,
        dict(zip(("v0", "v1", "v2"), relative, strict=True)),
        output,
        blocks={VIEW_BLOCK: view_values(view, view)},
        bindings=bindings,
    )
    for each in made:
        each.release()
    return result


_WIDTH_M = 0.08


def _view() -> View:
    scene = small_scene()
    return camera_view(scene.camera, HeightField.of(scene), (161, 93))


@pytest.mark.parametrize(("width_m", "keeps_besides"), [(_WIDTH_M, 0.05), (3.0, 0.3)], ids=["thin", "wide"])
def test_no_blade_with_a_point_in_view_is_outside(device, width_m, keeps_besides):
    view, blades = _view(), _blades(4000, 3)
    points = culling.clip(culling.hull_samples(*blades, width_m, 300, 1), view.clip_from_world)
    shows = (np.abs(points[..., :2]) <= points[..., 3:]).all(axis=2).any(axis=0)
    out = _call(device, view, f"outside(v0, v1, v2, {width_m}) ? 1 : 0", "int", blades) == 1
    assert not out[shows].any()
    assert (~out & ~shows).mean() < keeps_besides
    assert shows.mean() > 0.1


def test_samples_see_half_a_pixel_beyond_the_edges(device):
    """A speck there is kept; one as far beyond a pixel is not."""
    view = _view()
    clip_from_view = np.linalg.inv(view.clip_from_world)
    for pixels, is_out in ((0.4, False), (1.6, True)):
        width, height = view.size_px
        ends = (1.0 + 2.0 * pixels / width, 0.0), (0.0, -1.0 - 2.0 * pixels / height)
        ndc = np.array([[x * side, y * side, 0.5, 1.0] for x, y in ends for side in (-1.0, 1.0)])
        world = ndc @ clip_from_view.T
        specks = (world[:, :3] / world[:, 3:]).astype(np.float32)
        out = _call(device, view, "outside(v0, v1, v2, 0.0) ? 1 : 0", "int", (specks,) * 3) == 1
        assert (out == is_out).all(), pixels


def test_the_box_holds_every_point_and_is_no_larger_than_needed(device):
    view, blades = _view(), _blades(4000, 4)
    body = (
        f"ivec4 box = ivec4(0); float nearest; bool far = boxOf(v0, v1, v2, {_WIDTH_M}, box, nearest);"
        " result = far ? box : ivec4(-1);"
    )
    box = _call(device, view, body, "ivec4", blades)
    known = box[:, 0] >= 0
    points = culling.clip(culling.hull_samples(*blades, _WIDTH_M, 200, 2), view.clip_from_world)[:, known]
    assert known.mean() > 0.5
    assert (points[..., 3] > 0.05).all()
    px = (0.5 + 0.5 * points[..., :2] / points[..., 3:]) * view.size_px
    box = box[known]
    inside = ((px >= 0) & (px < view.size_px)).all(axis=2)
    low, high = box[:, :2], box[:, 2:]
    assert ((np.floor(px) >= low + 1) | (low == 0) | ~inside[..., None]).all(), "with a pixel to spare"
    assert ((np.floor(px) <= high - 1) | (high == np.array(view.size_px) - 1) | ~inside[..., None]).all()
    away = points[..., 3].min(axis=0)
    wholly = inside.all(axis=0) & (away > 2.0)
    # the control point may stand out from the curve as far as that reaches
    spare_px = 3.0 + 4.0 * _WIDTH_M / (away * view.pixel_m[0])
    assert wholly.sum() > 100
    assert ((px.min(axis=0) - low)[wholly] < spare_px[wholly, None] + 1.1 * np.ptp(px, axis=0)[wholly]).all()


def test_the_level_has_a_box_in_two_by_two_texels(device):
    random = np.random.default_rng(6)
    low = random.integers(0, 2000, (3000, 2))
    box = np.concatenate([low, low + np.exp(random.uniform(0, 7.5, (3000, 2))).astype(int) - 1], 1).astype(np.int32)
    level = shader_call(device, "culling/occlusion.glsl", "levelOf(box)", {"box": box}, "int")
    texels = box >> level[:, None]
    assert ((texels[:, 2:] - texels[:, :2]) <= 1).all()
    extent = (box[:, 2:] - box[:, :2]).max(axis=1)
    assert (level >= 1).all()
    assert ((2 ** (level - 1) < extent) | (level == 1)).all(), "no coarser than needed"


def test_no_blade_with_a_point_before_the_depth_is_hidden(device):
    view, blades = _view(), _blades(4000, 5)
    random = np.random.default_rng(7)
    columns, rows = view.size_px
    # steps like hills, poles and holes
    depth = np.repeat(np.linspace(2, 20, rows)[:, None], columns, axis=1) + random.uniform(0, 2, (1, columns))
    depth[:, 100:] = 1.5
    depth[random.uniform(size=depth.shape) < 0.002] = np.inf
    depth = depth.astype(np.float32)
    behind = _call(device, view, f"hidden(v0, v1, v2, {_WIDTH_M}) ? 1 : 0", "int", blades, pixels=depth) == 1
    points = culling.clip(culling.hull_samples(*blades, _WIDTH_M, 200, 3), view.clip_from_world)
    px = np.floor((0.5 + 0.5 * points[..., :2] / points[..., 3:]) * view.size_px).astype(int)
    inside = ((px >= 0) & (px < view.size_px)).all(axis=2) & (points[..., 3] > 0)
    at = depth[np.clip(px[..., 1], 0, rows - 1), np.clip(px[..., 0], 0, columns - 1)]
    shows = (inside & (points[..., 3] < at)).any(axis=0)
    assert not behind[shows].any()
    assert behind.sum() > 200


def test_width_goes_as_a_blade_turns_its_edge(device):
    random = np.random.default_rng(8)
    viewer, side = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in random.normal(size=(2, 5000, 3)))
    for limit in (0.9, 1.0, 0.4):
        got = shader_call(
            device,
            "techniques/blades/leaf.glsl",
            f"edgeOnFade(abs(dot(a, b)), {limit})",
            {"a": viewer.astype(np.float32), "b": side.astype(np.float32)},
            "float",
        )
        assert np.abs(got - culling.share_of_width(viewer, side, limit)).max() < 1e-5
        gone = np.abs(np.einsum("ij,ij->i", viewer, side)) > limit + 1e-6
        assert (got[gone] == 0.0).all(), "exactly, or the test would take what shows"


class _Bits:
    """What stands in for a page: blades of a width, or of none where they are to be left out."""

    def __init__(self, device: Device, keep: np.ndarray) -> None:
        blades = np.zeros(max(len(keep), 1), BLADE.dtype)
        blades["width"][: len(keep)] = keep
        self.bindings = {
            "Blades": device.ctx.buffer(blades.tobytes()),
            "Poses": device.ctx.buffer(bytes(len(blades) * POSE.dtype.itemsize)),
        }

    def release(self) -> None:
        for buffer in self.bindings.values():
            buffer.release()


_WRITER = """
#include "culling/compaction.glsl"
layout(local_size_x = 32) in;
layout(std430) buffer Records { uint records[]; };
void main() {
    uint index, chunk = workgroupIndex(), lane = gl_LocalInvocationID.x;
    if (!takeItem(index) || !survives(chunk, lane)) return;
    uint place = compactedIndex(chunk, lane);
    records[2u * place] = index;
    atomicAdd(records[2u * place + 1u], 1u);
}
"""


@pytest.fixture
def blade_culling(device):
    """One that leaves the blades that have a width."""
    only = Culling(orientation=True, frustum=False, distance=False, occlusion=False)
    bindings = Neutral()
    made = BladeCulling(device, bindings, only, "techniques/blades/width.glsl", occlusion=False)
    bindings.kernel = made._cull["picture"]
    for block, values in {
        VIEW_BLOCK: {"density": 1.0},
        SWARD_BLOCK: {"reach_m": 10.0, "blades_m": 10.0},
        LEAF_BLOCK: {"orientation_limit": 2.0},
    }.items():
        bindings[block.name] = BlockBuffer(device.ctx, block)
        bindings[block.name].set(**values)
    yield made
    for each in (made, *bindings.values()):
        each.release()


def _survivors(device, blade_culling, table, page, chunks, view, command: int) -> tuple[list[int], list[int]]:
    """Blades in the order of their places, and how often each place was written; with some room behind."""
    blade_culling.cull(page, chunks, table, view, command)
    writer = Kernel(device, "writer.comp", generated={"writer.comp": _WRITER})
    records = device.ctx.buffer(bytes((chunks.items + 40) * 8))
    writer.run(
        chunks.groups,
        **blade_culling.compacted,
        Chunks=table.buffer,
        Records=records,
        first_chunk=chunks.first,
        chunk_count=chunks.count,
    )
    device.ctx.memory_barrier()
    rows = np.frombuffer(records.read(), np.uint32).reshape(-1, 2)
    writer.release()
    records.release()
    count = int(blade_culling.survivors()[command])
    assert (rows[count:] == 0).all(), "nothing behind the last"
    return rows[:count, 0].tolist(), rows[:count, 1].tolist()


_LENGTHS = {
    "1": [1],
    "31": [31],
    "32": [32],
    "33": [33],
    "ragged": [5, 0, 64, 33, 1, 90],
    "64 chunks": [64 * 32],
    "65 chunks": [65 * 32],
    "three levels": [3000, 0, 140_000, 77],
    "tiny tiles": [3] * 5000,
}


@pytest.mark.parametrize("share", [0.0, 0.03, 0.5, 1.0])
@pytest.mark.parametrize("lengths", _LENGTHS)
def test_survivors_keep_their_order_and_lie_without_gaps(device, blade_culling, lengths, share):
    view = _view()
    length = np.array(_LENGTHS[lengths], np.int64)
    random = np.random.default_rng(len(length))
    # runs in any order, as the nearest come first
    order = random.permutation(len(length))
    start = (np.cumsum(length) - length)[order]
    keeps = [random.uniform(size=int(length.sum())) < share for _ in range(3)]
    table = ChunkTable(device)
    spans = [table.add(start, length[order]) for _ in keeps]
    table.cut()
    pages = [_Bits(device, keep) for keep in keeps]
    blade_culling.make_room(len(pages), spans[0].count)
    each = np.concatenate([np.arange(s, s + n) for s, n in zip(start, length[order], strict=True)])
    for command, (page, span, keep) in enumerate(zip(pages, spans, keeps, strict=True)):
        found, written = _survivors(device, blade_culling, table, page, span, view, command)
        assert found == each[keep[each]].tolist()
        assert all(n == 1 for n in written)
    commands = np.frombuffer(blade_culling.commands.read(), DRAW_COMMAND.dtype)[: len(pages)]
    counts = np.array([keep.sum() for keep in keeps])
    assert (commands["survivors"] == counts).all()
    assert (commands["vertices"] == 32).all()
    assert (commands["instances"] == -(-counts // 32)).all()
    assert not commands["first_vertex"].any()
    assert not commands["first_instance"].any()
    for part in (table, *pages):
        part.release()
