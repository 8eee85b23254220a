"""What every technique promises, whatever it does inside."""

from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import get_args

import moderngl
import numpy as np
import pytest
from annotated_types import Ge, Gt, Le, Lt
from PIL import Image
from pydantic import ValidationError

from blades import BLADE, blades_by_number, numbers_of
from greensward.aovs import AOVS
from greensward.gpu.programs import ProgramPool, is_image
from greensward.library import dump, load
from greensward.renderer import Renderer
from greensward.scene import Camera, Gusts, InputError, SurfaceClass
from greensward.scene.base import names_a_file
from greensward.techniques import SETTINGS, TECHNIQUES
from live_objects import live_objects
from reprojection import world_points
from small_scenes import BREEZE, GRASS, NOISE, small_scene

STORED = {each.name for each in TECHNIQUES if each.needs(each.Settings()).stored}
"""Those that draw stored blades, which can be looked up; the others have neither them nor heads."""
UNCOUNTED = {"billboard-grid"}
"""Those that have no blades to count."""
SKY, GROUND, GRASS_CLASS, FLOWER, OBJECT, _ = SurfaceClass
SMALL = 96, 54
"""Size of a picture in which any difference shows."""
NAMES = [technique.name for technique in TECHNIQUES]
pytestmark = pytest.mark.parametrize("technique", NAMES)


def _scene(technique: str, settings=None, **tables):
    return small_scene(technique={"name": technique, **(settings or {})}, **tables)


def _needs_stored(technique: str) -> None:
    if technique not in STORED:
        pytest.skip("draws no stored blades")


def _cover(frame) -> int:
    return int((frame.truth["class"] == GRASS_CLASS).sum())


def test_names_itself(technique):
    made = next(t for t in TECHNIQUES if t.name == technique)
    assert technique == technique.lower()
    assert len(made.source) > 20
    assert made.Settings.model_config["frozen"]
    assert made.Settings.model_config["extra"] == "forbid"
    assert all(field.description for field in made.Settings.model_fields.values())
    assert "name" not in made.Settings.model_fields


def test_grass_appears(renderer, technique):
    drawn = renderer(_scene(technique))
    frame = drawn.render(aovs=["class"])
    bare = renderer(_scene(technique, grass=[])).render(aovs=["class"])
    assert drawn.technique_name == technique
    if technique in STORED:
        assert drawn.blades > drawn.blades_in_view > 500
    assert _cover(bare) == 0
    assert _cover(frame) > 0.2 * frame.truth["class"].size
    there = frame.truth["class"] == GRASS_CLASS
    assert np.abs(frame.image[there].astype(int) - bare.image[there]).mean() > 5


@pytest.mark.slow
@pytest.mark.parametrize("samples", [1, 3])
def test_same_frame_twice_is_identical(renderer, technique, samples):
    scene = _scene(technique, wind=[BREEZE], ground=NOISE, grass=[{**GRASS, "head": "daisy", "head_share": 0.3}])
    first = renderer(scene, size=SMALL, samples=samples)
    frames = [first.render(2.0, aovs=AOVS), first.render(2.0, aovs=AOVS)]
    frames.append(renderer(scene, size=SMALL, samples=samples).render(2.0, aovs=AOVS))
    for other in frames[1:]:
        assert other.image.tobytes() == frames[0].image.tobytes()
        for name in frames[0].truth:
            if name != "motion":
                assert np.array_equal(other.truth[name], frames[0].truth[name]), name
    assert np.array_equal(frames[2].truth["motion"], frames[0].truth["motion"])


@pytest.mark.slow
def test_a_frame_does_not_depend_on_those_before(renderer, technique):
    """Far enough away that the field is sown anew, at another time, and back."""
    scene = _scene(technique, wind=[BREEZE])
    fresh = renderer(scene).render(1.0, aovs=["class", "depth"])
    used = renderer(scene)
    used.render(9.0, camera=Camera(position_m=(30.0, 1.0, 20.0), target_m=(0.0, 0.0, 0.0)))
    again = used.render(1.0, aovs=["class", "depth"])
    assert again.image.tobytes() == fresh.image.tobytes()
    assert np.array_equal(again.truth["depth"], fresh.truth["depth"])


def test_a_small_step_of_the_camera_keeps_the_blades(renderer, technique):
    """Within the slack nothing is sown anew; the picture is nearly that of a field sown there."""
    scene, stepped = _scene(technique), Camera(position_m=(0.3, 1.3, 4.0), target_m=(0.3, 0.3, -3.0), far_m=400.0)
    used = renderer(scene)
    used.render()
    sown = [page.blades for page in used._world.field.pages]
    assert bool(sown) == (technique in STORED)
    frames = [used.render(camera=stepped), renderer(scene.model_copy(update={"camera": stepped})).render()]
    assert all(page.blades is old for page, old in zip(used._world.field.pages, sown, strict=True))
    differs = (np.abs(frames[0].image.astype(int) - frames[1].image) > 8).any(axis=2)
    assert differs.mean() < 0.02


@pytest.mark.parametrize(
    "none", [{"sowing": {"density_per_m2": 0.0}}, {"grass": [{**GRASS, "share": 0.0}]}], ids=["density", "share"]
)
def test_no_blades_equal_bare_ground(renderer, technique, none):
    bare = renderer(_scene(technique, grass=[])).render(aovs=AOVS)
    drawn = renderer(_scene(technique, **none))
    frame = drawn.render(aovs=AOVS)
    assert drawn.blades == drawn.blades_in_view == 0
    assert np.array_equal(frame.image, bare.image)
    assert all(np.array_equal(frame.truth[name], bare.truth[name]) for name in frame.truth)
    assert set(np.unique(frame.truth["class"])) == {SKY, GROUND}


@pytest.mark.parametrize("still", [[], [{**BREEZE, "speed_mps": 0.0}]], ids=["none", "calm"])
def test_no_wind_means_no_motion(renderer, technique, still):
    drawn = renderer(_scene(technique, wind=still))
    frames = [drawn.render(time_s, aovs=["motion", "depth"]) for time_s in (0.0, 1.7)]
    assert np.array_equal(frames[0].image, frames[1].image)
    for frame in frames:
        assert np.abs(frame.truth["motion"]).max() < 0.01
    assert np.array_equal(frames[0].truth["depth"], frames[1].truth["depth"])


def test_wind_moves_grass_and_nothing_else(renderer, technique):
    box = {"kind": "box", "position_m": [1.0, 0.0, -1.0]}
    drawn = renderer(_scene(technique, wind=[{**BREEZE, "turbulence": 0.8}], object=[box]))
    frames = [drawn.render(time_s, aovs=["motion", "class"]) for time_s in (1.0, 1.1)]
    motion, kind = frames[1].truth["motion"], frames[1].truth["class"]
    speed = np.linalg.norm(motion, axis=2)
    assert (kind == OBJECT).sum() > 100
    assert speed[kind != GRASS_CLASS].max() < 0.01
    assert np.quantile(speed[kind == GRASS_CLASS], 0.9) > 0.1
    assert (motion[kind == SKY] == 0).all()
    assert not np.array_equal(frames[0].image, frames[1].image)


def test_motion_of_grass_is_the_way_its_blades_went(renderer, technique):
    """Where a blade's tip was and is, seen from above: the motion at its pixels lies between rest and the tip's."""
    high = {"position_m": [0.0, 6.0, 0.01], "target_m": [0.0, 0.0, 0.0]}
    scene = _scene(
        technique,
        camera=high,
        wind=[
            {
                "kind": "gusts",
                "direction_deg": 270.0,
                "speed_mps": 3.0,
                "gustiness": 1.0,
                "turbulence": 0.0,
                "gust_m": 3.0,
            }
        ],
    )
    drawn = renderer(scene)
    drawn.render(0.0)
    frame = drawn.render(0.2, aovs=["motion", "class"])
    motion = frame.truth["motion"][frame.truth["class"] == GRASS_CLASS]
    # a wind from the west moves grass along x, which is to the right here, to and fro; as it bends it sinks, which
    # from above moves it towards the middle as well
    assert np.abs(motion[:, 0]).mean() > 3 * np.abs(motion[:, 1]).mean()
    assert np.abs(motion[:, 0]).max() > 0.3


@pytest.mark.slow
def test_an_occluder_hides_grass(renderer, technique):
    box = {"kind": "box", "position_m": [0.0, 0.0, 0.0], "size_m": [1.5, 1.0, 0.5], "clears": False}
    aovs = ["class", "depth", "blade_id"]
    both = renderer(_scene(technique, object=[box])).render(aovs=aovs)
    grass = renderer(_scene(technique)).render(aovs=aovs)
    alone = renderer(_scene(technique, object=[box], grass=[])).render(aovs=aovs)
    before = (alone.truth["class"] == OBJECT) & (alone.truth["depth"] < grass.truth["depth"])
    assert (grass.truth["class"][before] == GRASS_CLASS).sum() > 100
    assert (both.truth["class"][before] == OBJECT).all()
    assert (both.truth["blade_id"][before] == 0).all()
    behind = grass.truth["depth"] < alone.truth["depth"]
    assert np.array_equal(both.truth["blade_id"][behind], grass.truth["blade_id"][behind])
    wall = {"kind": "box", "position_m": [0.0, 0.0, 3.0], "size_m": [50.0, 10.0, 0.5]}
    hidden = renderer(_scene(technique, object=[wall])).render(aovs=aovs)
    near = hidden.truth["depth"][hidden.truth["class"] == GRASS_CLASS]
    assert (near < 0.9).all()


@pytest.mark.slow
def test_taller_grass_covers_more(renderer, technique):
    cover = [
        _cover(
            renderer(
                _scene(technique, grass=[{**GRASS, "height_m": [0.5 * h, h]}], sowing={"density_per_m2": 30.0})
            ).render(aovs=["class"])
        )
        for h in (0.1, 0.3, 0.9)
    ]
    assert 0 < 1.2 * cover[0] < cover[1] < cover[2] / 1.2


@pytest.mark.slow
def test_wider_and_denser_grass_covers_more(renderer, technique):
    few, wide, many = (
        _cover(
            renderer(_scene(technique, grass=[{**GRASS, "width_m": [w, w]}], sowing={"density_per_m2": d})).render(
                aovs=["class"]
            )
        )
        for w, d in ((0.04, 20.0), (0.16, 20.0), (0.04, 80.0))
    )
    assert 1.3 * few < min(wide, many)


@pytest.mark.slow
@pytest.mark.parametrize("distance_m", [0.6, 3.0])
def test_edge_on_blades_do_not_vanish(renderer, technique, distance_m):
    """All blades turned alike, by sixteenths; whichever way they face, they cover nearly as much."""
    _needs_stored(technique)
    upright = {**GRASS, "tilt_deg": [0.0, 10.0], "bend": [0.0, 0.1], "width_m": [0.02, 0.02]}
    camera = {"position_m": [0.0, 0.5, distance_m], "target_m": [0.0, 0.2, -1.0]}
    scene = _scene(
        technique,
        grass=[upright],
        camera=camera,
        sowing={"density_per_m2": 30.0, "reach_m": 6.0, "full_density_m": 6.0},
    )
    drawn = renderer(scene)
    drawn.render()
    cover = []
    for turn in np.arange(16) * np.pi / 16:
        for page in drawn._world.field.pages:
            blades = np.frombuffer(page.blades.read(), BLADE).copy()
            blades["facing"] = turn
            page.blades.write(blades.tobytes())
        cover.append(_cover(drawn.render(aovs=["class"])))
    assert min(cover) > 0.7 * max(cover) > 100


def test_ids_depths_and_classes_belong_together(renderer, technique):
    grass = [GRASS, {**GRASS, "head": "daisy", "head_size_m": [0.05, 0.08], "share": 0.5}]
    ball = {"kind": "sphere", "position_m": [0.5, 0.0, 0.5]}
    scene = _scene(technique, grass=grass, object=[ball], camera={"target_m": [0.0, 0.9, -3.0]})
    drawn = renderer(scene)
    frame = drawn.render(aovs=AOVS)
    truth, kind = frame.truth, frame.truth["class"]
    assert {SKY, GROUND, GRASS_CLASS, OBJECT} | ({FLOWER} if technique in STORED else set()) == set(np.unique(kind))
    growing = (kind == GRASS_CLASS) | (kind == FLOWER)
    assert np.array_equal(truth["blade_id"] > 0, growing)
    assert len(np.unique(truth["blade_id"])) > 100
    assert np.array_equal(np.isinf(truth["depth"]), kind == SKY)
    assert (truth["depth"][kind != SKY] >= scene.camera.near_m).all()
    length = np.linalg.norm(truth["normal"], axis=2)
    assert np.allclose(length[kind != SKY], 1.0, atol=1e-5)
    assert (length[kind == SKY] == 0).all()
    assert (truth["motion"][kind == SKY] == 0).all()
    assert ((truth["albedo"] >= 0) & (truth["albedo"] <= 1)).all()
    assert (truth["albedo"][growing].sum(axis=1) > 0).mean() > 0.99
    shapes = {name: (a.dtype.name, a.shape[2:]) for name, a in truth.items() if name != "camera"}
    assert shapes == {
        "depth": ("float32", ()),
        "normal": ("float32", (3,)),
        "class": ("uint8", ()),
        "blade_id": ("uint64", ()),
        "motion": ("float32", (2,)),
        "albedo": ("float32", (3,)),
    }


def test_an_id_is_that_of_the_blade_that_stands_there(renderer, technique):
    """The root of the blade at a pixel is within its height of the point that the depth tells."""
    _needs_stored(technique)
    scene = _scene(technique, wind=[BREEZE], ground=NOISE)
    drawn = renderer(scene)
    truth = drawn.render(1.0, aovs=["blade_id", "depth"]).truth
    rows, columns = np.nonzero(truth["blade_id"])
    p = world_points(drawn, scene.camera, truth["depth"])[rows, columns]
    field = drawn._world.field
    blade = blades_by_number(field)[numbers_of(field, truth["blade_id"][rows, columns])]
    away = np.linalg.norm(p - blade["root"], axis=1)
    assert len(away) > 1000
    assert (away <= blade["height"] + 0.1).all()


def test_motion_of_a_moving_camera_is_the_reprojection(renderer, technique):
    """What stands still moves in the picture as the two cameras tell."""
    scene = _scene(technique, ground=NOISE, object=[{"kind": "box", "position_m": [0.8, 0.0, 0.0]}])
    before = scene.camera
    after = before.model_copy(
        update={"position_m": (0.15, 1.25, 3.9), "target_m": (0.1, 0.35, -3.0), "fov_y_deg": 48.0}
    )
    drawn = renderer(scene)
    drawn.render(0.0, camera=before)
    truth = drawn.render(0.5, camera=after, aovs=["motion", "depth", "class"]).truth
    p = world_points(drawn, after, truth["depth"])
    view_from_world, clip_from_view = drawn.camera_matrices(before)
    known = truth["class"] != SKY
    clip = np.concatenate([p[known], np.ones((known.sum(), 1))], 1) @ (clip_from_view @ view_from_world).T
    height, width = known.shape
    then = clip[:, :2] / clip[:, 3:] * [0.5 * width, -0.5 * height] + [0.5 * width, 0.5 * height]
    rows, columns = np.nonzero(known)
    expected = np.stack([columns + 0.5, rows + 0.5], 1) - then
    error = np.abs(truth["motion"][known] - expected).max(axis=1)
    kind = truth["class"][known]
    for each in (GROUND, GRASS_CLASS, OBJECT):
        assert (kind == each).sum() > 50
        assert error[kind == each].max() < 0.05, each
    assert np.abs(expected).max() > 3


@pytest.mark.slow
def test_every_resource_is_released(device, renderer, technique):
    scene = _scene(
        technique,
        wind=[BREEZE],
        grass=[{**GRASS, "head": "daisy"}],
        object=[{"kind": "box", "position_m": [0, 0, 0]}],
        force=[{"kind": "tracks", "path": [[0, 0], [1, 0]]}],
    )
    before = live_objects(device)
    for stage in ("fragment", "compute"):
        drawn = renderer(scene, size=SMALL, stage=stage, samples=2)
        drawn.render(1.0, aovs=AOVS)
        drawn.resize((64, 40))
        drawn.render(1.0, camera=Camera(position_m=(30.0, 1.0, 0.0), target_m=(0.0, 0.0, 0.0)))
        assert live_objects(device) != before
        drawn.release()
        assert live_objects(device) == before


OPTIONS = {
    "plain": {},
    "all at once": {
        "wind": [BREEZE, {"kind": "helicopter", "centre_m": [0, 0]}],
        "ground": NOISE,
        "grass": [{**GRASS, "head": "daisy", "shape": "quadratic-3d"}],
        "flowers": [{"density_per_m2": 1.0}],
        "object": [{"kind": "box", "position_m": [0, 0, 0], "grass": {"density_per_m2": 20.0}}],
        "force": [{"kind": "tracks", "path": [[0, 0], [1, 0]]}],
        "simulation": {"within_m": 4.0, "settle_s": 0.1},
        "water": {"level_m": -6.0},
        "sowing": {"density_per_m2": 20.0},
        "post": {"blur": "gaussian"},
    },
    "growth": {"growth": {"age": 0.5}},
    "traced": {"sowing": {"traced_m": 6.0}},
    "not stored": {"sowing": {"stored_m": 3.0}, "wind": [BREEZE]},
    "instanced": {"technique": {"mode": "instanced", "quads": "random", "alpha": "hashed"}, "wind": [BREEZE]},
    "no tests": {
        "culling": dict.fromkeys(("orientation", "frustum", "occlusion", "behind_grass", "distance"), False)
    },
}


@pytest.mark.slow
@pytest.mark.usefixtures("coarse_far")
@pytest.mark.parametrize(
    ("options", "stage"),
    [*((name, "compute") for name in OPTIONS), ("plain", "fragment"), ("all at once", "fragment")],
)
def test_no_program_needs_more_than_opengl_promises(device, monkeypatch, technique, options, stage):
    """Eight storage blocks and four images; drivers have no more for each stage, and WebGPU for all together."""
    made, take = [], ProgramPool.take
    monkeypatch.setattr(ProgramPool, "take", lambda self, sources: made.append(take(self, sources)) or made[-1])
    tables = {**OPTIONS[options], "technique": {"name": technique, **OPTIONS[options].get("technique", {})}}
    try:
        with Renderer(small_scene(**tables), size=(32, 18), ctx=device.ctx, stage=stage) as drawn:
            if options == "all at once":  # some are made when they are first needed
                drawn.advance(1.0)
    except InputError:
        pytest.skip(f"{technique} cannot draw this")
    storage, images = [], []
    for program in made:
        members = program.gl._members.values()
        storage.append(sum(isinstance(each, moderngl.StorageBlock) for each in members))
        images.append(sum(isinstance(each, moderngl.Uniform) and is_image(each) for each in members))
    assert len(made) > 15
    assert 3 <= max(storage) <= 8
    assert max(images) <= 4
    assert (max(images) > 0) == (stage == "compute")


@pytest.mark.slow
def test_drawing_again_and_again_makes_nothing_new(device, renderer, technique):
    drawn = renderer(_scene(technique, wind=[BREEZE]))
    cameras = [Camera(position_m=(x, 1.0, 4.0), target_m=(x, 0.0, -3.0)) for x in (0.0, 20.0, 40.0)]
    counts = []
    for _ in range(3):
        for size in (SMALL, (60, 36)):
            drawn.resize(size)
            for time_s, camera in enumerate(cameras):
                drawn.render(float(time_s), camera=camera)
        counts.append({kind: len(names) for kind, names in live_objects(device).items()})
    assert counts[0] == counts[1] == counts[2]


def test_state_is_left_as_it_was(ctx, device, renderer, technique):
    scene = _scene(technique, wind=[BREEZE], grass=[{**GRASS, "head": "daisy"}])
    target = ctx.framebuffer([ctx.texture((64, 40), 4)], ctx.depth_renderbuffer((64, 40)))
    other = ctx.simple_framebuffer((8, 8))
    other.use()
    ctx.patch_vertices = 4
    ctx.enable_only(ctx.BLEND | ctx.CULL_FACE)
    before = device.state.snapshot()
    drawn = renderer(scene)
    assert device.state.snapshot() == before, "building"
    for name, step in (
        ("render", lambda: drawn.render(1.0, aovs=AOVS)),
        ("draw", lambda: drawn.draw(target, 1.0)),
        ("resize", lambda: drawn.resize((50, 30))),
        ("render again", lambda: drawn.render(1.0)),
        ("release", drawn.release),
    ):
        step()
        assert device.state.snapshot() == before, name
    ctx.enable_only(0)
    for each in (*target.color_attachments, target.depth_attachment, target, other):
        each.release()


def test_settings_survive_toml(technique, tmp_path):
    model = SETTINGS[technique]
    changed = {name: _another(field) for name, field in model.model_fields.items()}
    scene = _scene(technique, changed)
    (tmp_path / "scene.toml").write_text(dump(scene), encoding="utf-8")
    back = load(tmp_path)
    assert back.in_folder(Path()) == scene
    assert model(**back.technique.model_extra) == model(**changed) != model()


SPEED_ONLY = {"densities", "early_exit", "storage", "expansion"}
"""Settings that show in no picture, and have tests of their own."""


@cache
def _cut_out() -> str:
    """A picture of ten red stripes with nothing between them."""
    pixels = np.zeros((40, 200, 4), np.uint8)
    pixels[..., 0] = 200
    pixels[:, (np.arange(200) // 10) % 2 == 0, 3] = 255
    path = Path(mkdtemp()) / "stripes.png"
    Image.fromarray(pixels).save(path)
    return str(path)


def _bounds(field) -> list[float]:
    """The least and greatest values that a setting takes, near to them where they are excluded."""
    low, high = None, None
    for rule in field.metadata:
        if isinstance(rule, Ge):
            low = rule.ge
        elif isinstance(rule, Gt):
            low = rule.gt + 1e-3
        elif isinstance(rule, Le):
            high = rule.le
        elif isinstance(rule, Lt):
            high = rule.lt - 1e-3
    return [bound for bound in (low, high) if bound is not None]


def _values(field) -> list[object]:
    """Values of a setting other than its default."""
    if field.annotation is bool:
        return [not field.default]
    if names_a_file(field):
        return [_cut_out()]
    if isinstance(field.default, int | float):
        return [type(field.default)(bound) for bound in _bounds(field) if bound != field.default]
    if isinstance(field.default, tuple) and field.default:  # of numbers, by level
        return [[field.default[-1]] * len(field.default)]
    if isinstance(field.default, tuple):
        return [[{"from_m": [-9.0, -9.0], "to_m": [9.0, 9.0], "density": 0.4}]]
    return [choice for choice in get_args(field.annotation) if choice != field.default]


def _fits(technique: str, settings) -> bool:
    """Tell whether settings are allowed together; a bound of one may need another."""
    try:
        SETTINGS[technique].model_validate(settings)
    except ValidationError:
        return False
    return True


def _another(field) -> object:
    values = _values(field)
    assert values, "a setting without limits or choices"
    return values[0]


@pytest.mark.slow
def test_every_setting_changes_the_picture(renderer, technique):
    """By itself, with one of the choices that another setting has, or with few steps."""
    eye_m = 0.4 if technique in STORED else 0.9
    near = {"position_m": [0.0, eye_m, 2.0], "target_m": [0.0, 0.2, -3.0]}
    tables = {"camera": near, "sowing": {"reach_m": 8.0}, "shadows": {"enabled": False}, "wind": [BREEZE]}
    fields = SETTINGS[technique].model_fields
    choices = [
        {name: choice} for name, field in fields.items() if get_args(field.annotation) for choice in _values(field)
    ]

    if "steps" in fields:
        choices.append({"steps": 3})

    # narrow billboards, whose texels are smaller than the least spacing
    usually = {"billboard_m": 0.25} if "billboard_m" in fields else {}
    # and flat tiles within the reach
    if "levels_m" in fields:
        usually = {"levels_m": [1.5, 3.0, 5.0]}

    def picture(settings) -> bytes:
        drawn = renderer(_scene(technique, {**usually, **settings}, **tables), size=SMALL)
        image = drawn.render().image.tobytes()
        drawn.release()  # the next takes over its programs
        return image

    usual = [({**others}, picture(others)) for others in ({}, *choices)]
    for name, field in fields.items():
        assert _values(field), name
        if name in SPEED_ONLY:
            continue
        assert any(
            picture({**others, name: value}) != without
            for others, without in usual
            for value in _values(field)
            if _fits(technique, {**others, name: value})
        ), name


@pytest.mark.slow
@pytest.mark.parametrize("test", ["orientation", "frustum", "occlusion", "behind_grass"])
def test_what_culling_leaves_out_does_not_show(renderer, technique, test):
    box = {"kind": "box", "position_m": [0.0, 0.0, 0.0], "size_m": [1.5, 1.0, 0.5]}
    frames = []
    for flag in (True, False):
        drawn = renderer(
            _scene(technique, ground=NOISE, wind=[BREEZE], object=[box], culling={test: flag}), size=SMALL, samples=2
        )
        frames.append(drawn.render(1.0, aovs=AOVS))
        drawn.release()  # the next takes over its programs
    on, off = frames
    assert all(np.array_equal(on.truth[name], off.truth[name]) for name in on.truth)
    assert np.array_equal(on.image, off.image)
    assert on.counts.pixels == off.counts.pixels
    assert on.counts.drawn <= off.counts.drawn <= off.counts.considered == on.counts.considered


def test_counts_how_many_it_drew(renderer, technique):
    drawn = renderer(_scene(technique))
    frame = drawn.render(aovs=["class", "blade_id"])
    if technique not in STORED:
        assert frame.counts.pixels == _cover(frame)
        if technique in UNCOUNTED:
            assert (frame.counts.considered, frame.counts.drawn) == (0, 0)
        else:
            assert len(np.unique(frame.truth["blade_id"])) - 1 <= frame.counts.drawn < frame.counts.considered
        return
    assert drawn._technique.drawn(drawn._view) == frame.counts.drawn
    assert len(np.unique(frame.truth["blade_id"])) - 1 <= frame.counts.drawn <= drawn.blades_in_view
    assert frame.counts.pixels == _cover(frame)


@pytest.mark.slow
def test_without_the_test_of_distance_nothing_thins_out(renderer, technique):
    """Heads and all: more blades, of their own width, and none beyond the reach."""
    _needs_stored(technique)
    far = {"position_m": [0.0, 1.3, 4.0], "target_m": [0.0, 0.0, -20.0]}
    grass = [{**GRASS, "head": "daisy", "head_size_m": [0.05, 0.08]}]
    scenes = {
        flag: _scene(
            technique,
            camera=far,
            grass=grass,
            sowing={"reach_m": 20.0, "density_per_m2": 30.0},
            culling={"distance": flag},
        )
        for flag in (True, False)
    }
    frames = {flag: renderer(scene).render(aovs=["class", "depth"]) for flag, scene in scenes.items()}
    assert frames[False].counts.drawn > 1.1 * frames[True].counts.drawn
    growing = (frames[False].truth["class"] == GRASS_CLASS) | (frames[False].truth["class"] == FLOWER)
    assert 15.0 < frames[False].truth["depth"][growing].max() < 21.0
    assert frames[True].truth["depth"][growing].min() < 5.0


def test_grass_casts_shadows(renderer, technique):
    low_sun = {"azimuth_deg": 90.0, "elevation_deg": 25.0}
    # the patch of ground in view is free, the grass that shades it is out of sight
    images = {}
    for enabled in (True, False):
        scene = _scene(
            technique, sun=low_sun, shadows={"enabled": enabled, "size_px": 256, "cascades": 1, "nearest_m": 6.0}
        )
        drawn = renderer(scene)
        frame = drawn.render(aovs=["class"])
        images[enabled] = frame.image[frame.truth["class"] == GROUND].astype(int)
    assert images[True].mean() < images[False].mean() - 3


@pytest.mark.slow
def test_fewer_blades_still_cast_much_of_the_shade(renderer, technique):
    low_sun = {"azimuth_deg": 90.0, "elevation_deg": 30.0}
    mean = {}
    for density in (0.0, 0.3, 1.0):
        shadows = {"size_px": 512, "cascades": 1, "nearest_m": 6.0, "density": density}
        mean[density] = renderer(_scene(technique, sun=low_sun, shadows=shadows)).render().image.mean()
    shade = mean[0.0] - mean[1.0]
    assert shade > 2
    assert 0.45 * shade < mean[0.0] - mean[0.3] < 1.1 * shade


def test_a_gale_and_a_thousand_hours_are_drawn(renderer, technique):
    gale = Gusts(speed_mps=200.0, turbulence=1.0, gustiness=1.0).model_dump()
    frame = renderer(_scene(technique, wind=[gale])).render(3.6e6, aovs=["class", "motion", "normal"])
    assert _cover(frame) > 500
    assert np.isfinite(frame.truth["motion"]).all()
    assert np.isfinite(frame.truth["normal"]).all()


@pytest.mark.parametrize("stage", ["fragment", pytest.param("compute", marks=pytest.mark.slow)])
def test_nothing_lies_before_the_near_plane_or_behind_the_far_one(renderer, technique, stage):
    camera = {"position_m": [0.0, 0.3, 0.0], "target_m": [0.0, 0.35, -5.0], "near_m": 0.8, "far_m": 6.0}
    tables = {"camera": camera, "shadows": {"enabled": False}, "sowing": {"density_per_m2": 120.0, "reach_m": 30.0}}
    truth = renderer(_scene(technique, **tables), size=SMALL, stage=stage).render(aovs=["depth", "class"]).truth
    shown = truth["depth"][truth["class"] != SKY]
    assert (truth["class"] == GRASS_CLASS).mean() > 0.2
    assert shown.min() >= 0.8 - 1e-4
    assert shown.max() <= 6.0 + 1e-3
