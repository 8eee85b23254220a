"""Far from the origin the picture is as still, and moves as smoothly, as near it."""

import numpy as np
import pytest

from greensward.scene import Camera, SurfaceClass
from greensward.sowing import field as field_module
from greensward.sowing.sower import Sower
from greensward.techniques import TECHNIQUES
from reprojection import world_points
from small_scenes import small_scene

_FAR = 10_240.0, 999_424.0
_STEPS = [(0.0, 0.0), (0.0004, 0.0), (0.0011, -0.0007)]  # less than a float tells apart out there


def _camera(x: float, z: float) -> Camera:
    return Camera(
        position_m=(x, 0.35, z), target_m=(x, 0.2, z - 1.0), height_above_ground=False, near_m=0.05, fov_y_deg=60.0
    )


@pytest.mark.slow
@pytest.mark.parametrize("technique", ["bezier-blades", "visibility-buffer"])
@pytest.mark.parametrize("stage", ["fragment", "compute"])
@pytest.mark.parametrize(("far_m", "stored_m"), [(_FAR[0], None), (_FAR[0], 0.0), (_FAR[1], None)])
def test_motion_of_still_grass_is_that_of_the_camera(renderer, technique, stage, far_m, stored_m):
    if stored_m is not None and technique == "bezier-blades":
        pytest.skip("draws stored blades only")
    sowing = {"density_per_m2": 400.0} | ({} if stored_m is None else {"stored_m": stored_m})
    scene = small_scene(technique={"name": technique}, sowing=sowing, shadows={"enabled": False})
    drawn = renderer(scene, size=(320, 180), stage=stage)
    previous = None
    for time_s, (right, ahead) in enumerate(_STEPS):
        camera = _camera(far_m + right, -far_m + ahead)
        truth = drawn.render(float(time_s), camera=camera, aovs=["motion", "depth", "class", "blade_id"]).truth
        if previous is not None:
            shown = truth["blade_id"] > 0
            assert shown.mean() > 0.1
            points = world_points(drawn, camera, truth["depth"])[shown]
            now, before = (_pixels(drawn, each, points) for each in (camera, previous))
            error = np.abs(truth["motion"][shown] - (now - before)).max(1)
            assert np.quantile(error, 0.99) < 0.02, "pixels"
        previous = camera


def _pixels(drawn, camera: Camera, points: np.ndarray) -> np.ndarray:
    view_from_world, clip_from_view = drawn.camera_matrices(camera)
    clip = np.concatenate([points, np.ones((len(points), 1))], 1) @ (clip_from_view @ view_from_world).T
    return clip[:, :2] / clip[:, 3:] * 0.5 * np.array(drawn.size) * (1.0, -1.0)


# Anchors from which shaders count ---------------------------------------------------------------------------

_LOW_AND_HIGH = {"kind": "endless", "size_m": [96.0, 80.0], "samples": 97, "height_m": 4.0, "wavelength_m": 25.0}
_WINDS = [
    {"kind": "gusts", "speed_mps": 5.0, "gust_m": 3.7},
    {"kind": "strong", "power_mps": 3.0},
    {"kind": "waves", "speed_mps": 3.0},
    {"kind": "ripples", "speed_mps": 2.0},
    {"kind": "idle"},
    {"kind": "wake", "cells": 15, "cell_m": 0.7},
]


def _at_a_border(lands: float, name: str, technique: str) -> tuple[dict, Camera]:
    """A scene around a camera on the border between two anchors."""
    x = 4096.0 + 8192.0 * lands
    near = x - 0.5, 0.0, -2.0
    tables = {
        "plain": {},
        "winds": {"wind": _WINDS},
        "objects": {
            "wind": [{"kind": "helicopter", "centre_m": [x, -4.0]}, {"kind": "whirl", "centre_m": [x, 2.0, -3.0]}],
            "object": [
                {"kind": "sphere", "position_m": near, "size_m": [0.6, 0.6, 0.6], "grass": {"density_per_m2": 90.0}}
            ],
            "force": [{"kind": "tracks", "path": [[x - 1.5, 2.0], [x + 1.0, -4.0]]}],
            "simulation": {"within_m": 8.0, "gravity_centre_m": [x, -50.0, 0.0], "gravity_towards": 0.5},
        },
        "extra blades": {},
        "colours": {"colour": {"kind": "noise", "noise": [{"channel": "all", "wavelength_m": 3.0}]}},
        "flowers": {"flowers": [{"density_per_m2": 3.0, "height_m": [0.4, 0.7], "reach_m": 20.0}]},
    }[name]
    if technique in ("tessellated-quads", "geometry-billboards", "billboard-grid"):
        tables.pop("simulation", None)
    low = {"from_m": [x - 3.0, -8.0], "to_m": [x + 1.0, 2.0], "height_m": [0.1, 0.2]}
    settings = {"tessellated-quads": {"mode": "instanced", "patch_m": 3.3, "patch": [low]}}
    settings["expanded-roots"] = {"storage": "texture-array", "extra_blades": int(name == "extra blades")}
    settings = settings.get(technique, {})
    scene = {
        "ground": _LOW_AND_HIGH,
        "sowing": {"density_per_m2": 120.0, "full_density_m": 6.0, "reach_m": 15.0, "clumping": 0.8, "drift": 1.0},
        "technique": {"name": technique, **settings},
        **tables,
    }
    camera = Camera(position_m=(x, 1.2, 1.0), target_m=(x - 0.2, 0.4, -4.0))
    return scene, camera


@pytest.mark.parametrize(
    ("name", "technique", "lands"),
    [
        *(("plain", each.name, 120.0) for each in TECHNIQUES),
        *((name, "bezier-blades", 120.0) for name in ("winds", "objects", "flowers", "colours")),
        *((name, "expanded-roots", 120.0) for name in ("objects", "extra blades")),
        *(("plain", each.name, 0.0) for each in TECHNIQUES if each.name.endswith(("grid", "quads", "billboards"))),
    ],
)
def test_at_a_border_the_picture_is_the_same_from_either_anchor(renderer, lands, name, technique):
    tables, camera = _at_a_border(lands, name, technique)
    frames = []
    for aside in (-1e-6, 1e-6):
        x, *rest = camera.position_m
        beside = camera.model_copy(update={"position_m": (x + aside, *rest)})
        drawn = renderer(small_scene(**tables, camera=beside.model_dump()), size=(160, 90))
        for time_s in (1.0, 1.0 + 1 / 60):
            frame = drawn.render(time_s, aovs=["class", "depth", "motion", "blade_id"])
        frames.append(frame)
    one, two = frames
    assert (one.truth["class"] == SurfaceClass.GRASS).mean() > 0.15
    same = one.truth["blade_id"] == two.truth["blade_id"]
    # half a millimetre decides at edges, and which texel of a picture of grass shows
    assert same.mean() > {"billboard-grid": 0.5, "expanded-roots": 0.9}.get(technique, 0.96)
    assert np.isclose(one.truth["depth"], two.truth["depth"], rtol=1e-3)[same].mean() > 0.99
    assert np.quantile(np.abs(one.truth["motion"] - two.truth["motion"])[same], 0.99) < 0.05
    # extra blades stand between neighbours, and which of two in a cell is one may be decided by it too
    part = 0.85 if name == "extra blades" else 0.95
    assert np.quantile(np.abs(one.image.astype(int) - two.image), part) <= 6


def test_grass_goes_on_over_a_border(renderer):
    """Simulated blades keep their states where shaders begin to count from another anchor."""
    tables, camera = _at_a_border(3.0, "winds", "visibility-buffer")
    scene = small_scene(**tables, simulation={"within_m": 8.0})
    speeds: list[float] = []
    walked = renderer(scene, size=(240, 135))
    x, *rest = camera.position_m
    for frame in range(20):
        at = camera.model_copy(update={"position_m": (x - 0.4 + 0.05 * frame, *rest)})
        truth = walked.render(frame / 60, camera=at, aovs=["motion", "blade_id"]).truth
        shown = truth["blade_id"] > 0
        speed = np.quantile(np.linalg.norm(truth["motion"][shown], axis=1), 0.9)
        if frame > 4:
            assert speed < 3.0 * np.median(speeds), "pixels"
        speeds.append(speed)


def test_a_refusal_at_a_border_is_not_for_what_is_there_and_leaves_nothing_behind(renderer, monkeypatch):
    """All is sown again there, in the room that it has; and if that fails, the next frame is drawn all the same."""
    tables, camera = _at_a_border(0.0, "plain", "bezier-blades")

    def at(x):
        return camera.model_copy(update={"position_m": (x, 1.2, 1.0), "target_m": (x, 0.4, -4.0)})

    drawn, fresh = (renderer(small_scene(**tables), size=(120, 68)) for _ in range(2))
    drawn.render(camera=at(4095.0))
    with monkeypatch.context() as tight:
        tight.setattr(field_module, "available_bytes", lambda _: drawn.field_bytes // 4)
        over = drawn.render(camera=at(4096.2)).image
    assert np.array_equal(over, fresh.render(camera=at(4096.2)).image)
    with monkeypatch.context() as broken:
        broken.setattr(Sower, "counted", None)
        with pytest.raises(TypeError):
            drawn.render(camera=at(4095.0))
    assert np.array_equal(drawn.render(camera=at(4095.1)).image, fresh.render(camera=at(4095.1)).image)


@pytest.mark.parametrize("x", [104.0, 4096.1])
def test_a_checkpoint_is_continued_whatever_was_drawn_before(renderer, x):
    tables, camera = _at_a_border(0.0, "winds", "visibility-buffer")
    scene = small_scene(**tables, simulation={"within_m": 8.0})

    def at(x):
        return camera.model_copy(update={"position_m": (x, 1.2, 1.0), "target_m": (x, 0.4, -4.0)})

    first, other = (renderer(scene, size=(120, 68)) for _ in range(2))
    for i, away in enumerate((-0.4, -0.3, 0.0)):
        first.render(1.0 + 0.1 * i, camera=at(x + away))
    state = first.checkpoint()
    other.render(7.0, camera=at(x - 0.2))
    other.resume(state)
    pictures = [each.render(1.3, camera=at(x + 0.02)).image for each in (first, other)]
    assert np.array_equal(*pictures)
