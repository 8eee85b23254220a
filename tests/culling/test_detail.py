"""Level of detail conserves what full detail shows: cover and colour by distance, without ring, pop or sparkle."""

from itertools import pairwise

import numpy as np
import pytest

import greensward as gs
from greensward.gpu.view import VIEW_BLOCK
from greensward.scene import Scene, SurfaceClass
from greensward.sowing.species import SWARD_BLOCK
from greensward.techniques.blades.leaf import LEAF_BLOCK
from oracles import culling
from shader_calls import shader_call
from small_scenes import GRASS, small_scene

_SIZE = 320, 180
_CAMERAS = {"standing": (1.7, 10.0, (5, 8, 12, 18, 26)), "looking down": (4.5, 9.0, (5, 8, 12))}
"""Height, how far away it looks at the ground, and edges of bands, metres. Further down there, blades that stand for
all would be broader than grass is (`BROADEST` of culling/level_of_detail.glsl)."""
_FULL_M = 6.0
_NOISE = (
    0.002,
    0.015,
)  # of cover and colour: the largest half-difference of two seeds' ratios that was seen in any band
_HALF_WIDTH_M, _LENGTH_M = 4.5, 30.0


def _scene(camera: str, seed: int, full_density_m: float):
    height, ahead, _ = _CAMERAS[camera]
    return small_scene(
        seed=seed,
        ground={"kind": "flat", "size_m": [2 * _HALF_WIDTH_M, _LENGTH_M], "beyond": "bare"},
        grass=[{**GRASS, "width_m": [0.006, 0.009]}],
        sowing={"density_per_m2": 300.0, "full_density_m": full_density_m, "reach_m": 100.0},
        shadows={"enabled": False},
        camera={
            "position_m": [0.0, height, _LENGTH_M / 2],
            "target_m": [0.0, 0.0, _LENGTH_M / 2 - ahead],
            "fov_y_deg": 40.0,
        },
        technique={"name": "visibility-buffer", "min_width_px": 0.5},
    )


def _bands(renderer, camera: str) -> list[np.ndarray]:
    """Pixels whose ray meets the ground of the strip in each range of distances."""
    view_from_world, clip_from_view = renderer.camera_matrices()
    (width, height), eye = renderer.size, np.linalg.inv(view_from_world)[:3, 3]
    x = (2 * (np.arange(width) + 0.5) / width - 1)[None, :] / clip_from_view[0, 0]
    y = (1 - 2 * (np.arange(height) + 0.5) / height)[:, None] / clip_from_view[1, 1]
    rays = np.stack(np.broadcast_arrays(x, y, -1.0), -1) @ view_from_world[:3, :3]
    along = -eye[1] / np.minimum(rays[..., 1], -1e-9)
    at = eye + along[..., None] * rays
    distance = np.where(np.abs(at[..., 0]) < _HALF_WIDTH_M - 1, np.linalg.norm(at - eye, axis=-1), np.inf)
    masks = [(distance >= low) & (distance < high) for low, high in pairwise(_CAMERAS[camera][2])]
    assert min(mask.sum() for mask in masks) >= 300
    return masks


def _seen(renderer, camera: str, scene) -> np.ndarray:
    """Cover and linear luminance by band: (bands, 2), of four pictures side by side."""
    drawn = renderer(scene, size=_SIZE, samples=4)
    bands, sums = _bands(drawn, camera), []
    _, y, z = scene.camera.position_m
    for x in (-0.3, -0.1, 0.1, 0.3):
        moved = {"position_m": (x, y, z), "target_m": (x, *scene.camera.target_m[1:])}
        frame = drawn.render(camera=scene.camera.model_copy(update=moved), aovs=["class"])
        cover = frame.truth["class"] == SurfaceClass.GRASS
        light = (frame.image / 255.0) ** 2.2 @ [0.2126, 0.7152, 0.0722]
        sums.append([[cover[band].mean(), light[band].mean()] for band in bands])
    drawn.release()  # the next takes over its programs
    return np.mean(sums, axis=0)


@pytest.mark.slow
@pytest.mark.parametrize("camera", _CAMERAS)
def test_cover_and_colour_are_those_of_full_detail(renderer, camera):
    ratios = []
    for seed in (1, 2):
        full, less = (_seen(renderer, camera, _scene(camera, seed, metres)) for metres in (1000.0, _FULL_M))
        ratios.append(less / full)
    ratio = np.mean(ratios, axis=0)
    assert (np.abs(ratio - 1) < 0.02 + np.array(_NOISE)).all(), ratio
    # no ring: what is off changes little from band to band
    assert np.abs(np.diff(ratio[:, 0])).max() < 0.015, ratio


@pytest.mark.slow
def test_the_visibility_buffer_flickers_less_than_bezier_blades(renderer):
    scene, steps = _scene("standing", 1, _FULL_M), {}
    for name in ("visibility-buffer", "bezier-blades"):
        technique = {"name": name, "min_width_px": 1.0}
        drawn = renderer(type(scene).model_validate({**scene.model_dump(), "technique": technique}), size=_SIZE)
        frames = []
        for x in 0.002 * np.arange(4):
            moved = {"position_m": (x, *scene.camera.position_m[1:]), "target_m": (x, *scene.camera.target_m[1:])}
            frames.append(drawn.render(camera=scene.camera.model_copy(update=moved)).image.astype(int))
        change = np.abs(np.diff(frames, axis=0)).mean(axis=(0, 3))
        steps[name] = np.array([change[band].mean() for band in _bands(drawn, "standing")])
    assert (steps["visibility-buffer"] < steps["bezier-blades"]).all(), steps


def _drawn(device, away: np.ndarray, rank: np.ndarray, height_m: float) -> dict[str, np.ndarray]:
    """Length as a part of the whole, share of the area and drawn width of a blade that far from the camera."""
    body = """
        Blade b; BladeBounds h;
        b.chance = packUnorm2x16(vec2(sqrt(rank), 0.0));
        b.up = packSnorm2x16(octahedralEncode(vec3(0.0, 1.0, 0.0)));
        b.flags = 144u << 24u;  // 2^8 m of blade on a square metre
        b.width = 0.005; b.facing = 0.0; b.x = away; b.y = 0.0; b.z = 0.0;
        h.v0 = vec3(away, 0.0, 0.0);
        h.v1 = h.v0 + vec3(0.0, 0.2, 0.0); h.v2 = h.v0 + vec3(0.0, 0.4, 0.0); h.middle = h.v1;
        h.away = distance(h.v0, view.camera_ws.xyz); h.fade = lodFade(b, h.away); h.pixel = 0.002 * h.away;
        result = vec3(h.fade, coverageOf(b, h), leafWidth(b, h));"""
    values = shader_call(
        device,
        "techniques/blades/leaf.glsl",
        body,
        {"away": away.astype(np.float32), "rank": rank.astype(np.float32)},
        "vec3",
        blocks={
            VIEW_BLOCK: {"camera_ws": (0, height_m, 0, 0), "camera_pixel_m": (0.002, 0.0), "density": 1.0},
            SWARD_BLOCK: {
                "full_density_m": _FULL_M,
                "reach_m": 300.0,
                "blades_m": 300.0,
                "grown": 1.0,
                "blade_m": (0.4, 0.005),
            },
            LEAF_BLOCK: {"min_width_px": 1.0, "orientation_limit": 2.0},
        },
    )
    return dict(zip(("fade", "share", "width"), values.T, strict=True))


@pytest.mark.parametrize("height_m", [0.6, 1.7, 6.0, 30.0])
def test_area_that_is_drawn_follows_the_oracle(device, height_m):
    beside = np.linspace(0.5, 90, 300)
    away = np.hypot(beside, height_m)
    there = culling.area_there(away, _FULL_M, 300.0, 1.0)
    width = np.maximum(0.005, 0.002 * away)
    layers = culling.layers(256.0, height_m / away, width)
    share = culling.share_of_area(layers, there, width, 0.002 * away, 0.4)
    got = _drawn(device, beside, np.zeros(300), height_m)
    assert np.abs(got["share"] / share - 1).max() < 2e-3
    assert np.abs(got["width"] / (width * share / there) - 1).max() < 3e-3


@pytest.mark.parametrize("height_m", [1.7, 6.0])
def test_a_small_step_of_the_camera_makes_no_blade_pop(device, height_m):
    rank, beside = np.meshgrid(np.linspace(0.01, 0.7, 50), np.arange(1.0, 60.0, 0.02), indexing="ij")
    drawn = _drawn(device, beside.ravel(), rank.ravel(), height_m)
    for name in ("fade", "width"):
        part = drawn[name].reshape(rank.shape)
        assert (np.abs(np.diff(part, axis=1)).max(axis=1) <= 0.08 * part.max(axis=1)).all()


_ENDS_M = 100.0


def _far_field(reach_m: float, height_m: float, azimuth_deg: float, elevation_deg: float) -> Scene:
    return Scene.model_validate(
        {
            "seed": 3,
            "ground": {"kind": "flat", "size_m": [400, 400]},
            "sowing": {"drift": 0.3, "density_per_m2": 500, "full_density_m": 5, "reach_m": reach_m},
            "grass": [{"species": "meadow-grass"}, {"species": "fescue"}],
            "wind": [],
            "sun": {"azimuth_deg": azimuth_deg, "elevation_deg": elevation_deg},
            "sky": {"clouds": 0},
            "camera": {"position_m": [0, height_m, 0], "target_m": [0, 0, -14 * height_m], "fov_y_deg": 24},
        }
    )


@pytest.mark.slow
@pytest.mark.parametrize("sun", [(0.0, 12.0), (180.0, 12.0), (0.0, 55.0), (180.0, 55.0)])
@pytest.mark.parametrize("height_m", [1.7, 8.0])
def test_ground_beyond_the_blades_has_their_colour_in_any_light(renderer, height_m, sun):
    colours = []
    for reach_m in (_ENDS_M, 3 * _ENDS_M):
        drawn = renderer(_far_field(reach_m, height_m, *sun), size=(240, 240), samples=4)
        frame = drawn.render(aovs=["class", "depth"])
        away = frame.truth["depth"]
        bands = [(away >= low * _ENDS_M) & (away < high * _ENDS_M) for low, high in ((0.9, 1.2), (1.2, 2.0))]
        light = (frame.image / 255.0) ** 2.2
        colours.append([light[band].mean(0)[:2] for band in bands])
        drawn.release()
    assert np.abs(np.array(colours[0]) / np.array(colours[1]) - 1.0).max() < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("sun_deg", [12.0, 55.0])
@pytest.mark.parametrize("name", ["jahrmann2013-meadow", "jahrmann2013-wheat"])
def test_blades_that_thin_out_end_in_the_colour_of_the_ground(renderer, name, sun_deg):
    scene = gs.load(name)
    camera = {"position_m": (0.0, 8.0, 0.0), "target_m": (0.0, 0.0, -60.0), "fov_y_deg": 16.0}
    changed = scene.model_copy(
        update={
            "ground": scene.ground.model_copy(update={"height_m": 0.0}),
            "camera": scene.camera.model_copy(update=camera),
            "sun": scene.sun.model_copy(update={"elevation_deg": sun_deg}),
            "sky": scene.sky.model_copy(update={"clouds": 0.0}),
            "object": (),
            "force": (),
            "wind": (),
        }
    )
    frame = renderer(changed, size=(240, 240), samples=4).render(aovs=["depth"])
    along, light = frame.truth["depth"] / scene.sowing.reach_m, (frame.image / 255.0) ** 2.2
    bands = [light[(along >= low) & (along < high)] for low, high in ((0.6, 0.8), (0.8, 1.0), (1.0, 1.3))]
    means = np.array([band.mean(0) for band in bands])
    differs = np.abs(means[:2, :2] / means[2, :2] - 1.0).max(axis=1)
    assert differs[1] < 0.12
    assert differs[0] < 0.4  # and there is no edge on the way
