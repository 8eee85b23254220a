"""Edges smoothed over time: the shader's functions, and what they make of pictures that follow each other."""

import numpy as np
import pytest

from greensward.gpu.view import VIEW_BLOCK
from greensward.passes.light import LIGHT_BLOCK  # noqa: F401  # declares the block that the shader includes
from greensward.passes.temporal import is_cut
from greensward.scene import InputError, SurfaceClass
from greensward.viewpoint import camera_view
from oracles import temporal
from shader_calls import shader_call
from small_scenes import BREEZE, NOISE, small_scene

_SHADER = "passes/temporal/temporal.glsl"
_RANDOM = np.random.default_rng(12)
_TECHNIQUES = ["bezier-blades", "visibility-buffer"]


def _scene(technique="bezier-blades", **tables):
    return small_scene(wind=[BREEZE], technique={"name": technique}, **tables)


def _camera(scene, moved_m=(0.0, 0.0, 0.0), turned_deg=0.0, **changes):
    """The scene's camera, moved, and turned to the right."""
    position, target = (np.array(p) for p in (scene.camera.position_m, scene.camera.target_m))
    turn = np.radians(turned_deg)
    x, y, z = target - position
    ahead = np.array([x * np.cos(turn) - z * np.sin(turn), y, x * np.sin(turn) + z * np.cos(turn)])
    position = position + moved_m
    changes = {"position_m": tuple(position.tolist()), "target_m": tuple((position + ahead).tolist()), **changes}
    return scene.camera.model_copy(update=changes)


def _difference(a, b):
    return float(np.abs(a.astype(float) - b).mean())


# Functions --------------------------------------------------------------------------------------------------


def test_weights_are_those_of_the_spline(device):
    f = np.linspace(0.0, 1.0, 101, dtype=np.float32)
    got = shader_call(device, _SHADER, "catmullRom(f)", {"f": f}, "vec4")
    assert np.abs(got - temporal.catmull_rom(f.astype(float))).max() < 1e-6
    assert np.abs(got.sum(1) - 1.0).max() < 1e-6
    assert got[50] == pytest.approx([-0.0625, 0.5625, 0.5625, -0.0625])


def test_history_is_resampled_by_all_sixteen_texels(device):
    texels = _RANDOM.uniform(0.0, 1.0, (9, 13, 4)).astype(np.float16)
    history = device.ctx.texture((13, 9), 4, texels.tobytes(), dtype="f2")
    history.repeat_x = history.repeat_y = False
    at_px = (_RANDOM.uniform(0.0, 1.0, (300, 2)) * [13, 9]).astype(np.float32)
    view = {VIEW_BLOCK: {"size_px": (13, 9, 1 / 13, 1 / 9)}}
    got = shader_call(
        device, _SHADER, "historyAt(at_px)", {"at_px": at_px}, "vec3", blocks=view, bindings={"history": history}
    )
    # samplers of GPUs interpolate in steps of 1/256
    assert np.abs(got - temporal.resample(texels.astype(float), at_px.astype(float))[:, :3]).max() < 5e-3
    history.release()


def test_ycocg_and_back(device):
    c = _RANDOM.uniform(0.0, 1.0, (100, 3)).astype(np.float32)
    there = shader_call(device, _SHADER, "toYCoCg(c)", {"c": c}, "vec3")
    assert np.abs(there - c.astype(float) @ temporal.YCOCG.T).max() < 1e-6
    back = shader_call(device, _SHADER, "fromYCoCg(c)", {"c": there.astype(np.float32)}, "vec3")
    assert np.abs(back - c).max() < 1e-6


def test_history_is_clipped_towards_the_mean(device):
    c, mean = (_RANDOM.uniform(-1.0, 1.0, (200, 3)).astype(np.float32) for _ in range(2))
    reach = _RANDOM.uniform(0.0, 2.0, (200, 3)).astype(np.float32)
    reach[:5] = 0.0
    inputs = {"c": c, "mean": mean, "reach": reach}
    got = shader_call(device, _SHADER, "mean + (c - mean) / max(outside(c, mean, reach), 1.0)", inputs, "vec3")
    expected = temporal.clip(*(a.astype(float) for a in (c, mean, reach)))
    assert np.abs(got - expected).max() < 1e-5
    assert 20 < (np.abs(got - c).max(1) < 1e-6).sum() < 180  # some lie within


# Pictures ---------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("technique", _TECHNIQUES)
def test_a_still_scene_becomes_the_average_of_many_samples(renderer, technique):
    scene = _scene(technique)
    many = renderer(scene, samples=16).render().image
    one = renderer(scene).render().image
    over_time = renderer(scene, temporal=True)
    frames = [over_time.render().image for _ in range(24)]
    assert np.abs(frames[0].astype(int) - one).max() <= 1  # the history is of half floats
    assert _difference(frames[-1], many) < 0.25 * _difference(one, many)
    assert _difference(frames[-1], many) < 3.0


@pytest.mark.slow
@pytest.mark.parametrize("technique", _TECHNIQUES)
@pytest.mark.parametrize("path", ["aside", "ahead", "turning"])
def test_a_moving_camera_leaves_no_ghosts(renderer, technique, path):
    scene = _scene(technique, object=[{"kind": "box", "position_m": [0.3, 0, 0], "size_m": [0.4, 1.2, 0.4]}])

    def camera(i):
        moved = {"aside": (0.04 * i, 0.0, 0.0), "ahead": (0.0, 0.0, -0.04 * i), "turning": (0.0, 0.0, 0.0)}[path]
        return _camera(scene, moved, 0.7 * i if path == "turning" else 0.0)

    over_time = renderer(scene, temporal=True)
    last = 10
    frames = [over_time.render(i / 30, camera=camera(i)).image for i in range(last + 1)]
    truth = renderer(scene, samples=16).render(last / 30, camera=camera(last)).image
    one = renderer(scene).render(last / 30, camera=camera(last)).image
    assert _difference(frames[last], truth) < 0.63 * _difference(one, truth)
    assert _difference(frames[last], truth) < 0.8 * _difference(frames[last - 1], truth)  # it is of this instant


@pytest.mark.slow
@pytest.mark.parametrize("technique", _TECHNIQUES)
def test_an_object_leaves_no_trail(renderer, technique):
    """Clipping leaves little of a fast box behind it, already in the next frame."""
    box = {"kind": "box", "name": "box", "position_m": [0, 0, 0], "size_m": [0.6, 1.0, 0.2], "colour": "#f00808"}
    scene = _scene(technique, object=[box])

    def path(time_s):
        return np.array([-1.5 + 4.5 * time_s, 0.0, 1.0])

    over_time = renderer(scene, temporal=True, scripts={"box": path})
    still = renderer(scene, samples=16, scripts={"box": path})
    ghosted = [over_time.render(i / 30).image for i in range(10)][-1]
    before, after = (still.render(i / 30, aovs=("class",)) for i in (8, 9))
    uncovered = (before.truth["class"] == SurfaceClass.OBJECT) & (after.truth["class"] != SurfaceClass.OBJECT)
    assert uncovered.sum() > 20
    red, truly_red, boxs_red = (
        (image[uncovered].astype(float) @ [1.0, -0.5, -0.5]).mean() for image in (ghosted, after.image, before.image)
    )
    assert boxs_red - truly_red > 100
    assert red - truly_red < 0.25 * (boxs_red - truly_red)


def test_the_sky_moves_with_the_camera(renderer):
    scene = _scene(sky={"clouds": 1.0}, camera={"target_m": [0.0, 4.0, -3.0]})
    over_time = renderer(scene, temporal=True)
    frames = [over_time.render(camera=_camera(scene, turned_deg=2.3 * i)).image for i in range(8)]
    truth = renderer(scene, samples=16).render(camera=_camera(scene, turned_deg=2.3 * 7)).image
    above = slice(0, 40)
    assert truth[above].std() > 10
    assert _difference(frames[7][above], truth[above]) < 0.15 * _difference(frames[6][above], truth[above])


@pytest.mark.slow
def test_a_creeping_camera_does_not_flicker(renderer):
    scene = _scene()

    def flicker(**options):
        drawn = renderer(scene, **options)
        frames = [drawn.render(camera=_camera(scene, (0.002 * i, 0.0, 0.0))).image for i in range(16)]
        return np.mean([_difference(a, b) for a, b in zip(frames[9:], frames[8:-1], strict=True)])

    assert flicker(temporal=True) < 0.4 * flicker()


@pytest.mark.parametrize("stage", ["fragment", "compute"])
def test_the_same_frames_twice_are_identical(renderer, stage):
    scene = _scene(ground=NOISE)
    runs = []
    for _ in range(2):
        drawn = renderer(scene, temporal=True, stage=stage)
        runs.append([drawn.render(i / 30, camera=_camera(scene, (0.03 * i, 0, 0))).image for i in range(4)])
    assert np.array_equal(*runs)


def test_both_shells_agree(renderer):
    scene = _scene(ground=NOISE, sky={"clouds": 0.5}, camera={"target_m": [0.0, 1.0, -3.0]})
    last = []
    for stage in ("fragment", "compute"):
        drawn = renderer(scene, temporal=True, stage=stage)
        last.append([drawn.render(i / 30, camera=_camera(scene, (0.03 * i, 0, 0))).image for i in range(5)][-1])
    difference = np.abs(last[0].astype(int) - last[1])
    assert (difference > 1).mean() < 1e-3
    assert difference.max() <= 5


# Beginning anew ---------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "time_s"),
    [
        ({"moved_m": (0.0, 0.0, 4.0)}, 0.1),
        ({"turned_deg": 40.0}, 0.1),
        ({"fov_y_deg": 25.0}, 0.1),
        ({}, -0.1),
        ({}, 0.7),
    ],
    ids=["jump", "turn", "zoom", "backwards", "pause"],
)
def test_after_a_cut_a_frame_is_that_of_a_fresh_renderer(renderer, change, time_s):
    scene = _scene(sowing={"full_density_m": 40.0})  # sown once
    over_time = renderer(scene, temporal=True)
    for i in range(3):
        over_time.render(i / 60)
    camera = _camera(scene, **change)
    fresh = renderer(scene, temporal=True)
    for i in range(3):
        after, expected = (each.render(time_s + i / 60, camera=camera).image for each in (over_time, fresh))
        assert np.array_equal(after, expected)
        assert over_time.blended == fresh.blended == i + 1


def test_what_is_a_cut(renderer):
    scene = _scene()
    heights = renderer(scene)._world.ground.heights

    def cut(time_s=0.0, **change):
        views = (camera_view(each, heights, (160, 90)) for each in (scene.camera, _camera(scene, **change)))
        return is_cut(*zip(views, (0.0, time_s), strict=True))

    for within in ({}, {"time_s": 0.5}, {"moved_m": (0, 0, 2.9)}, {"turned_deg": 25}, {"fov_y_deg": 60}):
        assert not cut(**within), within
    for beyond in ({"time_s": -1e-3}, {"time_s": 0.51}, {"moved_m": (0, 0, 3.1)}, {"turned_deg": 35}):
        assert cut(**beyond), beyond
    assert cut(fov_y_deg=30)


@pytest.mark.parametrize("what", ["resize", "advance"])
def test_without_the_frame_before_history_begins_anew(renderer, what):
    scene = _scene()
    over_time = renderer(scene, temporal=True)
    over_time.render(0.0)
    over_time.render(0.03)
    if what == "resize":
        over_time.resize((96, 54))
    else:
        over_time.advance(0.06)
    after = over_time.render(0.1).image
    fresh = renderer(scene, temporal=True, size=over_time.size)
    assert np.array_equal(after, fresh.render(0.1).image)
    assert over_time.blended == 1
    over_time.render(0.13)
    assert over_time.blended == 2


@pytest.mark.slow
def test_a_checkpoint_continues_bit_for_bit(renderer):
    scene = _scene(simulation={"settle_s": 0.1})
    instants = [(i / 30, _camera(scene, (0.02 * i, 0.0, 0.0))) for i in range(6)]
    whole = renderer(scene, temporal=True)
    frames = [whole.render(time_s, camera=camera).image for time_s, camera in instants[:3]]
    saved = whole.checkpoint()
    assert saved["history"].dtype == np.float16
    frames += [whole.render(time_s, camera=camera).image for time_s, camera in instants[3:]]
    second = renderer(scene, temporal=True)
    second.resume(saved)
    assert second.blended == 3
    for (time_s, camera), expected in zip(instants[3:], frames[3:], strict=True):
        assert np.array_equal(second.render(time_s, camera=camera).image, expected)
    without = renderer(scene, temporal=True)
    without.resume({name: array for name, array in saved.items() if "history" not in name})
    begun = without.render(instants[3][0], camera=instants[3][1]).image
    assert without.blended == 1
    assert not np.array_equal(begun, frames[3])  # or the history does not matter, and this test is none


def test_a_checkpoint_of_another_size_begins_anew(renderer):
    scene = _scene()
    small = renderer(scene, temporal=True, size=(96, 54))
    small.render(0.0)
    drawn = renderer(scene, temporal=True)
    drawn.render(0.0)
    drawn.resume(small.checkpoint())
    assert drawn.blended == 0
    assert np.array_equal(drawn.render(0.03).image, renderer(scene, temporal=True).render(0.03).image)


def test_a_checkpoint_with_a_damaged_camera_is_refused(renderer):
    drawn = renderer(_scene())
    with pytest.raises(InputError, match="the checkpoint's camera is damaged"):
        drawn.resume({**drawn.checkpoint(), "camera": np.array("{")})


@pytest.mark.parametrize("value", [np.nan, 1e38])
def test_a_checkpoint_of_numbers_that_no_state_has_is_refused(renderer, value):
    drawn = renderer(_scene())
    with pytest.raises(InputError, match=r"the checkpoint's \"\\u001b\" is damaged"):
        drawn.resume({**drawn.checkpoint(), "\x1b": np.full(3, value)})


# Around it --------------------------------------------------------------------------------------------------


def test_truth_stays_at_the_pixels_centres(renderer):
    scene = _scene()
    aovs = ("depth", "class", "motion")
    over_time, plain = renderer(scene, temporal=True), renderer(scene)
    for i in range(3):
        for each in (over_time, plain):
            each.render(i / 30)
    truth, expected = (each.render(0.1, aovs=aovs).truth for each in (over_time, plain))
    assert over_time.blended == 4
    for name in ("depth", "class", "motion"):
        assert np.array_equal(truth[name], expected[name])


def test_time_shows_and_nothing_is_allocated(renderer):
    drawn = renderer(_scene(), temporal=True)
    drawn.render(0.0)
    textures = [drawn._histories[0]._history, drawn._histories[0]._target]
    for i in range(1, 4):
        drawn.render(i / 30)
        assert drawn._histories[0]._history in textures
        assert drawn._histories[0]._target in textures


def test_temporal_draws_one_sample(renderer):
    with pytest.raises(
        InputError, match=r"samples: must be 1 with temporal, which draws one sample a frame \(got 4\)"
    ):
        renderer(_scene(), temporal=True, samples=4)
    assert renderer(_scene()).blended == 0
