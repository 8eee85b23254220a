"""Shadows in pictures: blades do not shade themselves, soil in grass has no stripes, shadows of objects are sharp."""

import numpy as np
import pytest

from greensward.scene import SurfaceClass
from small_scenes import GRASS, small_scene

_LOW_SUN = {"azimuth_deg": 285.0, "elevation_deg": 14.0}
_SIZE = 320, 180


def _light(renderer, scene):
    """Brightness of a picture without any tone but sRGB, and its classes."""
    frame = renderer(scene, size=_SIZE).render(aovs=["class"])
    return (frame.image / 255.0).mean(axis=-1) ** 2.2, frame.truth["class"]


def _kept(renderer, **tables):
    """Share of the brightness of each pixel that shadows leave, and its classes."""
    shadows = {"size_px": 512, "cascades": 1, "nearest_m": 4.0}
    shaded, classes = _light(renderer, small_scene(**tables, shadows=shadows))
    plain, _ = _light(renderer, small_scene(**tables, shadows={"enabled": False}))
    return shaded / np.maximum(plain, 1e-4), classes


@pytest.mark.parametrize("technique", ["tessellated-quads", "visibility-buffer", "bezier-blades"])
def test_broad_blades_do_not_shade_themselves(renderer, technique):
    """They stand apart, so that hardly any shadow of another falls on one."""
    kept, classes = _kept(
        renderer,
        technique={"name": technique},
        grass=[{**GRASS, "width_m": [0.03, 0.03]}],
        sowing={"density_per_m2": 5.0, "reach_m": 4.0},
        sun=_LOW_SUN,
        camera={"position_m": [0.0, 0.5, 2.0], "target_m": [0.0, 0.25, -1.0]},
    )
    grass = kept[classes == SurfaceClass.GRASS]
    assert len(grass) > 1500
    assert (grass < 0.9).mean() < 0.15


def test_blades_shade_each_other(renderer):
    camera = {"position_m": [0.0, 0.8, 2.0], "target_m": [0.0, 0.2, -1.0]}
    kept, classes = _kept(renderer, sowing={"density_per_m2": 400.0}, sun=_LOW_SUN, camera=camera)
    grass = kept[classes == SurfaceClass.GRASS]
    assert np.mean(grass < 0.8) > 0.25


def test_soil_among_blades_has_no_stripes(renderer):
    """Seen from above, the light on it changes little from one decimetre to the next, though half of it is gone."""
    kept, classes = _kept(
        renderer,
        sowing={"density_per_m2": 150.0, "reach_m": 20.0, "full_density_m": 20.0},
        grass=[{**GRASS, "width_m": [0.004, 0.006]}],
        sun=_LOW_SUN,
        camera={"position_m": [0.0, 1.6, 0.0], "target_m": [0.0, 0.0, -0.01]},
    )
    soil = np.where(classes == SurfaceClass.GROUND, kept, np.nan)
    assert np.isfinite(soil).mean() > 0.4
    assert np.nanmean(soil) < 0.8
    places = np.nanmean(soil.reshape(_SIZE[1] // 4, 4, _SIZE[0] // 4, 4), axis=(1, 3))
    assert np.nanstd(places) / np.nanmean(places) < 0.2


def test_the_shadow_of_an_object_begins_at_its_foot_and_has_a_sharp_edge(renderer):
    """On bare ground: a wall of 1 m, the sun 45° high in the west, seen from above."""
    wall = {"kind": "box", "position_m": [0.0, 0.0, 0.0], "size_m": [0.1, 1.0, 3.0]}
    kept, classes = _kept(
        renderer,
        object=[wall],
        grass=[],
        sun={"azimuth_deg": 270.0, "elevation_deg": 45.0},
        camera={"position_m": [0.6, 3.0, 0.0], "target_m": [0.6, 0.0, -0.001]},
    )
    row = kept[_SIZE[1] // 2]
    foot = np.flatnonzero(classes[_SIZE[1] // 2] == SurfaceClass.OBJECT).max() + 1
    dark = np.flatnonzero(row[foot:] < 0.5) + foot
    assert dark[0] == foot, "at the foot"
    edge = np.flatnonzero((row[foot:] > 0.45) & (row[foot:] < 0.85))
    assert len(edge) < 8, "a few centimetres"
    px_per_m = _SIZE[1] / (2 * 3.0 * np.tan(np.radians(25)))
    assert len(dark) == pytest.approx(0.95 * px_per_m, abs=0.12 * px_per_m)
