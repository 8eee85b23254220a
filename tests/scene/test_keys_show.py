"""Every key of winds, forces, sowing, growth, simulation, shadows and post-processing changes what is drawn."""

from typing import get_args

import numpy as np
import pytest
from PIL import Image

from greensward.scene import Scene
from greensward.scene.base import Model
from greensward.scene.field import Culling, Growth, Shadows, Sowing
from greensward.scene.light import Post
from greensward.scene.wind import Simulation
from small_scenes import BREEZE, DRONE, NOISE, small_scene

_LOOK = {"position_m": [0.0, 1.6, 3.0], "target_m": [0.0, 0.2, -2.0], "far_m": 400.0}
_ABOVE = {"position_m": [0.2, 6.0, 0.1], "target_m": [0.2, 0.0, 0.0], "fov_y_deg": 60.0}
_SPREAD = {"density_per_m2": 25.0, "full_density_m": 8.0, "reach_m": 12.0}
# key: another value, for a wind whose keys all matter
_WINDS = {
    "gusts": {"direction_deg": 10.0, "speed_mps": 9.0, "gustiness": 0.1, "gust_m": 3.0, "turbulence": 0.9},
    "strong": {"direction_deg": 10.0, "power_mps": 4.0, "speed_mps": 9.0, "interval_m": 5.0, "steadiness": 0.7},
    "helicopter": {
        "centre_m": [1.0, 1.0], "radius_m": 2.0, "height_m": 3.0, "period_s": 5.0, "rotor_m": 1.0, "power_mps": 7.0,
        "speed_mps": 3.0, "interval_m": 1.7, "steadiness": 0.0, "published": True, "drawn": False,
    },
    "random": {"power_mps": 9.0, "period_s": 2.0},
    "waves": {"direction_deg": 10.0, "speed_mps": 12.0, "rate_hz": 1.3},
    "blast": {"centre_m": [1.0, 0.0, 1.0], "power_mps": 30.0, "rate": 1.0},
    "whirl": {"centre_m": [1.0, 0.0, 1.0], "power_mps": 10.0, "swirl_mps": 20.0, "rate": 6.0},
    "ripples": {
        "direction_deg": 10.0, "speed_mps": 12.0, "wave_m": 3.0, "swell_m": 9.0, "front_m": 4.0, "epsilon": 0.7,
        "rate_hz": 1.1,
    },
    "texture": {"size_m": [17.0, 17.0], "speed_mps": 30.0, "moves_mps": [3.0, 1.0], "rate_hz": 1.0},
    "idle": {"direction_deg": 10.0, "speed_mps": 6.0, "period_s": 1.1},
    "wake": {
        "by": "camera", "strength": 70.0, "reach_m": 1.0, "downwash_mps2": 30.0, "damping": 0.2, "cells": 9,
        "cell_m": 0.3,
    },
}  # fmt: skip
_LINE = [[-2.0, -1.0], [2.0, -0.3]]
_FORCES = {
    "map": {"centre_m": [1.0, 0.5], "size_m": [3.0, 2.0], "yaw_deg": 40.0, "strength": 0.3},
    "footprints": {
        "path": [[-2.0, 1.0], [2.0, 1.0]], "start_s": 0.4, "speed_mps": 1.5, "step_m": 0.4, "gauge_m": 0.6,
        "foot_m": [0.5, 0.3], "impact_m": 0.5, "pressure": 0.3, "fades_s": 1.0,
    },
    "tracks": {
        "path": [[-2.0, 1.0], [2.0, 1.0]], "start_s": 0.4, "speed_mps": 1.5, "gauge_m": 0.7, "tyre_m": 0.6,
        "impact_m": 0.6, "pressure": 0.3, "fades_s": 1.0,
    },
    "stamp": {
        "places": [[1.0, 0.5, 30.0]], "size_m": [2.0, 0.7], "at_s": 0.65, "impact_m": 0.5, "pressure": 0.3,
        "fades_s": 1.0,
    },
}  # fmt: skip
# what a key needs beside it to matter
_BESIDE = {
    "Footprints.start_s": {"speed_mps": 1.5},
    "Tracks.start_s": {"speed_mps": 1.5},
    "Footprints.fades_s": {"speed_mps": 4.0},
    "Tracks.fades_s": {"speed_mps": 4.0},
    "Stamp.fades_s": {"at_s": 0.0},
}


@pytest.fixture
def picture(renderer, tmp_path):
    """Bytes of a small picture at 0.7 s of what small_scene makes of tables, which may name map.png and gust.png."""
    noise = np.random.default_rng(4).integers(0, 255, (8, 8, 4), dtype=np.uint8)
    noise[..., 3] = 255
    Image.fromarray(noise).save(tmp_path / "map.png")
    Image.fromarray(noise[::-1, :, :3]).save(tmp_path / "gust.png")

    def drawn(**tables) -> bytes:
        made = renderer(small_scene(**tables).in_folder(tmp_path), size=(96, 54))
        frame = [made.render(time, aovs=["motion"]) for time in (0.0, 0.3, 0.7)][-1]
        made.release()  # the next takes over its programs
        return frame.image.tobytes()

    return drawn


def _models(name: str) -> dict[str, type[Model]]:
    """Kinds of a table of a scene that has several."""
    kinds = get_args(get_args(Scene.model_fields[name].annotation)[0])
    found = [each for each in (get_args(kinds[0]) if kinds else ()) if isinstance(each, type)]
    return {each.model_fields["kind"].default: each for each in found}


def _keys(model: type[Model]) -> set[str]:
    return {key for key in model.model_fields if key not in ("kind", "file", "files", "outline", "name")}


@pytest.mark.parametrize("kind", _WINDS)
def test_keys_of_winds(picture, kind):
    base = {"kind": kind, **({"files": ["gust.png", "map.png"]} if kind == "texture" else {})}
    objects = [DRONE] if kind == "wake" else []
    # over what the camera sees
    base |= {"wake": {"by": "objects"}, "helicopter": {"radius_m": 1.0}}.get(kind, {})
    tables = {"camera": _ABOVE, "sowing": _SPREAD, "shadows": {"enabled": False}, "object": objects}
    usual = picture(wind=[base], **tables)
    for key, value in _WINDS[kind].items():
        assert picture(wind=[{**base, key: value}], **tables) != usual, key


@pytest.mark.parametrize("kind", _FORCES)
def test_keys_of_forces(picture, kind):
    base = {
        "map": {"file": "map.png", "size_m": [4.0, 4.0]},
        "footprints": {"path": _LINE},
        "tracks": {"path": _LINE},
        "stamp": {"outline": "map.png", "places": [[0.0, 0.0, 0.0]]},
    }[kind]
    tables = {"camera": _ABOVE, "sowing": _SPREAD, "shadows": {"enabled": False}}
    for key, value in _FORCES[kind].items():
        beside = {"kind": kind, **base, **_BESIDE.get(f"{kind.title()}.{key}", {})}
        assert picture(force=[{**beside, key: value}], **tables) != picture(force=[beside], **tables), key


_TABLES = {
    "sowing": {
        "density_per_m2": 60.0, "density_map": "map.png", "vegetation_map": "map.png", "max_slope_deg": 12.0,
        "along_normal": 1.0, "clump_m": 1.2, "clumping": 0.9, "drift_m": 4.0, "drift": 0.2, "full_density_m": 2.0,
        "reach_m": 5.0, "traced_m": 4.0,
    },
    "growth": {
        "age": 0.3, "time_s": 2.0, "spread": 0.9, "height": [[0.0, 0.5], [1.0, 1.0]],
        "width": [[0.0, 1.0], [1.0, 2.0]], "stiffness": [[0.0, 0.2], [1.0, 0.3]],
    },
    "simulation": {
        "form": "yan2024", "step_s": 0.05, "settle_s": 0.0, "within_m": 1.5, "gravity_mps2": 20.0,
        "gravity_centre_m": [3.0, 2.0, 0.0], "gravity_towards": 0.4, "forward": 2.0, "recovery_hz": 4.0,
        "reference_m": 0.2, "rise_s": 0.1,
    },
    "shadows": {
        "enabled": False, "cascades": 2, "size_px": 64, "nearest_m": 2.0, "furthest_m": 5.0, "density": 1.0,
    },
    "post": {
        "exposure_ev": 1.0, "tone_map": "linear", "saturation": 0.3, "vignette": 0.9, "blur": "average",
        "blur_near_m": 6.0, "darkening": 0.9, "darkening_m": 20.0, "bloom": 0.5, "bloom_threshold": 0.2,
        "bloom_size": 0.1,
    },
}  # fmt: skip
_MODELS = {"sowing": Sowing, "growth": Growth, "simulation": Simulation, "shadows": Shadows, "post": Post}
_GIVEN = {
    "sowing": {**_SPREAD, "drift": 0.8, "clumping": 0.5},
    "growth": {"age": 0.4},
    "simulation": {"form": "jahrmann2017", "settle_s": 0.5},
    "shadows": {"size_px": 128, "cascades": 1, "nearest_m": 3.0},
    "post": {},
}
_MATTERS_WITH = {
    "gravity_towards": {"gravity_centre_m": [3.0, 2.0, 0.0]},
    "furthest_m": {"cascades": 2},
    "blur_near_m": {"blur": "gaussian"},
    "darkening_m": {"darkening": 0.9},
    "bloom_threshold": {"bloom": 0.5},
    "bloom_size": {"bloom": 0.5},
}
_NOT_SEEN = {"stored_m"}
"""Where the blades come from; they are the same."""


@pytest.mark.parametrize("table", _TABLES)
def test_keys_of_tables(picture, table):
    rolls = {"times_s": [0.0, 0.7], "positions_m": [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]}
    ball = {"kind": "sphere", "position_m": [0.0, 0.0, 0.0], "size_m": [0.8, 0.8, 0.8], "path": rolls}
    more = {"object": [ball]} if table == "simulation" else {}
    more |= {"ground": NOISE} if table == "sowing" else {}
    tables = {"camera": _LOOK, "sowing": _SPREAD, "wind": [BREEZE], **more}
    assert set(_TABLES[table]) | _NOT_SEEN >= _keys(_MODELS[table])
    for key, value in _TABLES[table].items():
        usual = {**_GIVEN[table], **_MATTERS_WITH.get(key, {})}
        assert picture(**{**tables, table: {**usual, key: value}}) != picture(**{**tables, table: usual}), key


def test_the_tables_of_these_tests_name_every_key():
    for name, keys in (("wind", _WINDS), ("force", _FORCES)):
        models = _models(name)
        assert models
        for kind, model in models.items():
            assert set(keys[kind]) >= _keys(model), kind


@pytest.mark.parametrize("key", sorted(_keys(Culling)))
def test_each_test_of_culling_leaves_blades_out(renderer, key):
    """With the others off; what is behind grass only where occlusion is tested."""
    off = dict.fromkeys(_keys(Culling), False)
    box = {"kind": "box", "position_m": [0.0, 0.0, 0.0], "size_m": [3.0, 1.5, 0.2]}
    deep = key == "behind_grass"
    sowing = {"density_per_m2": 1500.0 if deep else 400.0, "full_density_m": 6.0 if deep else 3.0, "reach_m": 12.0}
    camera = {**_LOOK, **({"position_m": [0.0, 0.4, 6.0], "target_m": [0.0, 0.3, -2.0]} if deep else {})}
    counts = []
    for culling in (
        {**off, "occlusion": key == "behind_grass"},
        {**off, "occlusion": key == "behind_grass", key: True},
    ):
        technique = {"name": "visibility-buffer", "edge_on": "drop"}
        scene = small_scene(culling=culling, technique=technique, object=[box], camera=camera, sowing=sowing)
        made = renderer(scene, size=(192, 108))
        counts.append([made.render(time) for time in (0.0, 0.1)][-1].counts.drawn)
    assert counts[1] < 0.98 * counts[0]
