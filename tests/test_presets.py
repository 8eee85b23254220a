"""Every preset draws, moves, and says in its file what it is; every kind of wind moves grass."""

import numpy as np
import pytest

import greensward as gs
from greensward.ground import HeightField
from greensward.scene.load import named_files
from greensward.scene.wind import Wind
from greensward.techniques import SETTINGS, TECHNIQUES
from greensward.techniques.tessellated_quads.pictures import blade_pictures
from greensward.viewpoint import camera_view
from small_scenes import COARSE_PX, DRONE, small_scene

_PRESETS = (
    "derstroff",
    "football",
    "habel2007-published",
    "habel2007",
    "jahrmann2013-instance",
    "jahrmann2013-meadow",
    "jahrmann2013-oasis",
    "jahrmann2013-wheat",
    "jahrmann2017-balls",
    "meadow",
    "planet",
    "tillman2013-texture-array",
    "tillman2013-vertex-buffer",
    "yan2024-helicopter",
    "yan2024-random",
    "yan2024-strong",
)
_WINDS = {
    **{kind: {"kind": kind} for kind in ("gusts", "strong", "helicopter", "random")},
    **{kind: {"kind": kind} for kind in ("waves", "blast", "whirl", "idle")},
    "wake": {"kind": "wake", "by": "objects", "downwash_mps2": 100.0},
    "ripples": {"kind": "ripples"},
}
_KINDS = tuple(_WINDS)
_TECHNIQUES = [technique.name for technique in TECHNIQUES]
_USUAL = gs.TechniqueChoice().name
_SIZE = 96, 54


@pytest.fixture(scope="module")
def still_images():
    """Images without wind, by technique and by whether blades are simulated."""
    return {}


def thin(scene: gs.Scene) -> gs.Scene:
    """The same scene with few blades, where what they cost is by the blade."""
    grid = scene.technique.name == "billboard-grid"
    few = {"reach_m": 40.0} if grid else {"reach_m": 40.0, "density_per_m2": 30.0}
    coarse = {"texture_px": COARSE_PX} if grid else {}
    technique = gs.TechniqueChoice.model_validate({**scene.technique.model_dump(), **coarse})
    sowing = scene.sowing.model_copy(update=few)
    things = tuple(
        thing.model_copy(update={"grass": thing.grass.model_copy(update={"density_per_m2": 60.0})})
        if thing.grass
        else thing
        for thing in scene.object
    )
    quick = scene.simulation and scene.simulation.model_copy(update={"settle_s": 0.1})
    shadows = scene.shadows.model_copy(update={"size_px": 128})
    parts = {"technique": technique, "sowing": sowing, "object": things, "simulation": quick, "shadows": shadows}
    return scene.model_copy(update=parts)


def test_these_are_the_presets():
    assert tuple(gs.presets()) == _PRESETS
    assert all(title and summary for title, summary in gs.presets().values())


@pytest.mark.slow
@pytest.mark.parametrize("name", _PRESETS)
def test_a_preset_survives_toml_and_moves(renderer, name, tmp_path):
    scene = gs.load(name)
    (tmp_path / "scene.toml").write_text(gs.dump(scene), encoding="utf-8")
    for _, file in named_files(scene, SETTINGS):
        copy = tmp_path / file.relative_to(scene.resolve("."))
        copy.parent.mkdir(exist_ok=True)
        copy.write_bytes(file.read_bytes())
    assert gs.load(tmp_path / "scene.toml").model_dump() == scene.model_dump()
    drawn = renderer(thin(scene), size=_SIZE)
    first, second = (drawn.render(time_s, aovs=["class", "motion"]) for time_s in (0.3, 0.6))
    assert (first.truth["class"] == gs.SurfaceClass.GRASS).mean() > 0.1
    # the lowest grass moves by less than a pixel
    differs = (np.abs(first.image.astype(int) - second.image).max(-1) > 8).mean()
    assert differs > 0.01 or np.abs(second.truth["motion"]).max() > 0.05


def test_grass_hangs_under_the_planet(renderer):
    """Roots all around it, and every blade grows away from its middle."""
    frame = renderer(thin(gs.load("planet")), size=(160, 160)).render(0.0, aovs=["class", "normal"])
    grass = frame.truth["class"] == gs.SurfaceClass.GRASS
    rows = np.nonzero(grass.any(axis=1))[0]
    middle = int(0.5 * (rows.min() + rows.max()))
    above, below = grass[:middle], grass[middle:]
    assert 0.6 < below.sum() / above.sum() < 1.6
    assert (frame.truth["class"][[0, -1]] == gs.SurfaceClass.SKY).all(), "there is sky above and below"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("technique", "kind", "simulated"),
    [
        *((technique, kind, False) for technique in _TECHNIQUES for kind in _KINDS),
        # blades of every technique follow the same simulation; the last kind is tried with each
        *(
            (technique, kind, True)
            for technique in _TECHNIQUES
            for kind in (_KINDS if technique == _USUAL else _KINDS[-1:])
        ),
    ],
)
def test_every_wind_moves_grass_with_every_technique(renderer, still_images, technique, kind, simulated):
    scene = small_scene(
        wind=[_WINDS[kind]],
        technique={"name": technique},
        simulation={"settle_s": 0.1} if simulated else None,
        object=[DRONE],
    )
    drawn = renderer(scene, size=_SIZE)
    first, second = (drawn.render(time_s).image.astype(int) for time_s in (0.4, 0.8))
    calm = scene.model_copy(update={"wind": ()})
    if (technique, simulated) not in still_images:
        still_images[technique, simulated] = renderer(calm, size=_SIZE).render(0.8).image.astype(int)
    still = still_images[technique, simulated]
    assert (np.abs(first - second).max(-1) > 8).mean() > 0.01
    assert (np.abs(second - still).max(-1) > 8).mean() > 0.02


def test_every_kind_of_wind_is_tried():
    kinds = {model.model_fields["kind"].annotation.__args__[0] for model in Wind.__args__[0].__args__}
    assert kinds - {"texture"} == set(_KINDS)  # painted wind: tests/motion/test_winds.py


def test_all_footprints_of_the_meadow_show(renderer):
    """From heel to toes, and nothing stands before them: depth there is that of grass on the ground."""
    scene = gs.load("jahrmann2013-meadow")
    (stamp,) = scene.force
    size, heights = (320, 180), HeightField.of(scene)
    view = camera_view(scene.camera, heights, size)
    sparse = scene.model_copy(update={"sowing": scene.sowing.model_copy(update={"density_per_m2": 0.0})})
    depth = renderer(sparse, size=size).render(aovs=["depth"]).truth["depth"]
    assert len(stamp.places) == 6
    for x, z, turn_deg in stamp.places:
        ahead = 0.45 * stamp.size_m[1] * np.array([np.sin(np.radians(turn_deg)), -np.cos(np.radians(turn_deg))])
        for end in (-1, 0, 1):
            at = np.array([x, z]) + end * ahead
            point = np.array([at[0], heights.height(*at), at[1], 1.0])
            clip = view.clip_from_world @ point
            column, row = ((clip[:2] / clip[3] * (1, -1) * 0.5 + 0.5) * size).astype(int)
            assert 0 <= column < size[0], (x, z)
            assert 0 <= row < size[1], (x, z)
            assert depth[row, column] == pytest.approx(clip[3], rel=0.03), (x, z)


def test_awns_of_wheat_end_within_their_texture():
    alpha = blade_pictures(gs.load("jahrmann2013-wheat"))[0, ..., 3].astype(int)  # first row at the root
    assert alpha[-2:].max() == 0, "at the tip"
    assert alpha[len(alpha) // 2 :, [0, -1]].max() == 0, "at the sides"
    # points: fewer texels of each row are covered the nearer it is to the tip
    covered = (alpha > 127).sum(axis=1)
    assert covered[int(0.95 * len(alpha))] < 0.6 * covered[int(0.88 * len(alpha))]
