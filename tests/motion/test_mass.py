"""Winds as forces on blades of some mass: the formula, poses of light and heavy blades, and every technique."""

import numpy as np
import pytest

from blades import points, read_blades, read_poses, species_of, up_of
from greensward.motion.poses import MOTION_BLOCK, mass_values
from greensward.scene import Mass, SurfaceClass
from greensward.techniques import TECHNIQUES
from oracles import mass, wind
from shader_calls import shader_call
from small_scenes import BREEZE, GRASS, small_scene

_STEADY = {
    "kind": "gusts",
    "direction_deg": 250.0,
    "speed_mps": 4.0,
    "gustiness": 0.0,
    "gust_m": 4.0,
    "turbulence": 0.0,
}
_SIZES = {
    "narrow": {"width_m": [0.004, 0.006]},
    "wide": {"width_m": [0.02, 0.03]},
    "heavy": {"width_m": [0.004, 0.006], "mass_kg_per_m2": 1.0},
}
_MIXED = [{**GRASS, **size, "height_m": [0.4, 0.4], "stiffness": [0.6, 0.6]} for size in _SIZES.values()]


def _mean_kg() -> float:
    return float(np.mean([mass.mass_kg(0.4, w, k) for w, k in ((0.005, 0.2), (0.025, 0.2), (0.005, 1.0))]))


def test_force_by_mass(device):
    scene = small_scene(grass=_MIXED, mass={})
    random = np.random.default_rng(3)
    kind = random.integers(0, 3, 400).astype(np.uint32)
    height, width = (random.uniform(0.001, most, 400).astype(np.float32) for most in (1.2, 0.04))
    body = """
        Blade b = Blade(0, 0, 0, 0, 0, 0, 0, height, 0, 0, 0, width, 0u, 0.5, kind, 0u);
        Air air = forced(Air(vec4(1.0, 2.0, 3.0, 4.0), vec3(5.0, 6.0, 7.0)), massOf(b));
        result = vec4(air.wind.x, air.wind.w, air.blast.x, air.blast.z);"""
    inputs = {"height": height, "width": width, "kind": kind}
    blocks = {MOTION_BLOCK: mass_values(scene)}
    got = shader_call(device, "motion/mass.glsl", body, inputs, "vec4", blocks=blocks)
    own = mass.mass_kg(height.astype(np.float64), width.astype(np.float64), np.array([0.2, 0.2, 1.0])[kind])
    expected = mass.part(own, _mean_kg())
    assert got == pytest.approx(expected[:, None] * np.array([1.0, 4.0, 5.0, 7.0]), rel=1e-4)
    assert expected.min() < 0.2
    assert expected.max() == 10.0


@pytest.fixture
def stood(renderer):
    """Blades of the mixed species around the middle, and their poses in a steady wind."""

    def at(**tables):
        scene = small_scene(
            wind=[_STEADY],
            grass=_MIXED,
            sowing={"full_density_m": 12.0, "density_per_m2": 20.0},
            camera={"position_m": [0.0, 11.0, 0.1], "target_m": [0.0, 0.0, 0.0], "fov_y_deg": 120.0},
            **tables,
        )
        drawn = renderer(scene)
        drawn.render(5.0)
        (page,) = drawn._world.field.pages
        blades, poses = read_blades(drawn._world.field), read_poses(page)
        near = np.linalg.norm(blades["root"][:, [0, 2]], axis=1) < 4.0
        return blades[near], poses[near]

    return at


def test_poses_are_those_of_a_wind_that_is_weaker_for_heavy_blades(stood):
    blades, poses = stood(mass={})
    root, control, tip = points(blades)
    own = mass.mass_kg(blades["height"].astype(float), blades["width"].astype(float), 0.2)
    own[species_of(blades) == 2] *= 5.0
    there = wind.gusts(_STEADY, 5, root, 5.0) * mass.part(own, _mean_kg())[:, None]
    values = (blades["height"], blades["stiffness"], blades["random"] / 65535.0)
    v1, v2 = wind.stand(root, control, tip, up_of(blades), *(v.astype(np.float64) for v in values), there, 5.0)
    expected = np.stack([v1 - root, v2 - root], 1)
    assert np.quantile(np.abs(poses[:, 0] - expected), 0.99) < 2e-3


_FORMS = {"analytic": {}} | {
    form: {"simulation": {"form": form, "recovery_hz": 9.0, "gravity_mps2": 1.0}}
    for form in ("natural", "yan2024", "jahrmann2017")
}


@pytest.mark.parametrize("tables", _FORMS.values(), ids=_FORMS)
def test_wide_and_heavy_blades_move_less_than_light_ones(stood, tables):
    downwind = np.array([np.sin(np.radians(70.0)), 0.0, -np.cos(np.radians(70.0))])

    def moved(**more):
        blades, poses = stood(**tables, **more)
        way = (poses[:, 0, 1] - (blades["tip"] - blades["root"])) @ downwind
        return [way[species_of(blades) == kind].mean() for kind in range(3)]

    narrow, wide, heavy = moved(mass={})
    assert max(wide, heavy) < narrow - 0.03
    alike = moved()
    assert np.ptp(alike) < 0.02


_ALL = {
    **{each.name: {"technique": {"name": each.name}} for each in TECHNIQUES},
    "instanced": {"technique": {"name": "tessellated-quads", "mode": "instanced"}},
}


@pytest.mark.parametrize("tables", _ALL.values(), ids=_ALL)
def test_every_technique_moves_by_mass(renderer, tables):
    """Blades a hundred times as heavy as the reference hardly move, and of the reference mass as much as without."""

    def motion(**more):
        drawn = renderer(small_scene(wind=[BREEZE], **tables, **more))
        drawn.render(1.0)
        truth = drawn.render(1.2, aovs=["class", "motion"]).truth
        return np.linalg.norm(truth["motion"], axis=-1)[truth["class"] == SurfaceClass.GRASS].mean()

    mean_kg = float(mass.mass_kg(0.45, 0.016, 0.2))
    plain, same, heavy = (motion(), motion(mass={}), motion(mass=Mass(reference_kg=0.01 * mean_kg)))
    assert heavy < 0.1 * plain
    assert same == pytest.approx(plain, rel=0.35)
