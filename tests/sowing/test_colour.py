"""Colour of the grass by place: octaves of noise, the green of the ground's picture, and what is drawn of both."""

import numpy as np
import pytest

from blades import blades_by_number, numbers_of, read_blades, up_of
from greensward.ground import HeightField
from greensward.renderer import Renderer
from greensward.scene import ChannelNoise, GroundColour, InputError, NoiseColour, SurfaceClass
from greensward.sowing.colour import TINTS_BLOCK, excess_green, green_of, green_pictures, tints_values
from greensward.sowing.species import SWARD_BLOCK
from greensward.techniques import TECHNIQUES
from live_objects import live_objects
from oracles import colour
from reprojection import world_points
from shader_calls import shader_call
from small_scenes import GRASS, NOISE, small_scene, with_pictures

_NOISES = [
    {"channel": "all", "wavelength_m": 9.0, "octaves": 4, "gain": 0.5, "lacunarity": 2.1, "weight": 1.0},
    {"channel": "red", "wavelength_m": 3.0, "octaves": 2, "gain": 0.8, "lacunarity": 3.0, "weight": 2.0},
    {"channel": "green", "wavelength_m": 20.0, "octaves": 1, "gain": 0.1, "lacunarity": 1.0, "weight": 0.3},
]
_LOW, _HIGH = np.array([51, 66, 26]), np.array([168, 173, 92])
_BLUISH, _YELLOWISH, _BARE = (50, 110, 62), (120, 125, 40), (107, 79, 51)
_RANDOM = np.random.default_rng(21)


def _scene(**tables):
    noise = {"kind": "noise", "low_colour": "#33421a", "high_colour": "#a8ad5c", "noise": _NOISES}
    return small_scene(**{"colour": noise, "grass": [{**GRASS, "dryness": [0.0, 0.0]}], **tables})


def test_noise(device):
    xz = _RANDOM.uniform(-60, 60, (3000, 2)).astype(np.float32)
    got = shader_call(
        device,
        "sowing/colour.glsl",
        "noiseColour(xz, 0.0)",
        {"xz": xz},
        "vec3",
        blocks={TINTS_BLOCK: tints_values(_scene()), SWARD_BLOCK: {"seed": 5}},
        defines={"COLOUR_NOISE": 1},
    )
    expected = colour.noise_colour(_NOISES, colour.light(_LOW), colour.light(_HIGH), 5, xz.astype(np.float64))
    assert np.abs(got - expected).max() < 2e-3
    assert np.ptp(expected[:, 0]) > 0.25
    assert np.ptp(expected[:, 2] / colour.light(_HIGH)[2]) > 0.4


def test_noise_finer_than_a_footprint_fades_to_its_mean(device):
    xz = _RANDOM.uniform(-60, 60, (500, 2)).astype(np.float32)
    blocks = {TINTS_BLOCK: tints_values(_scene()), SWARD_BLOCK: {"seed": 5}}
    for footprint, spread in ((0.5, 0.05), (60.0, 0.0)):
        got = shader_call(
            device,
            "sowing/colour.glsl",
            f"noiseColour(xz, {footprint})",
            {"xz": xz},
            "vec3",
            blocks=blocks,
            defines={"COLOUR_NOISE": 1},
        )
        assert (np.ptp(got[:, 0]) > spread) == (spread > 0)
    assert np.allclose(got, 0.5 * (colour.light(_LOW) + colour.light(_HIGH)), atol=1e-5)


@pytest.mark.parametrize("repeats", [True, False])
@pytest.mark.parametrize("neighbours", [0, 1, 3])
def test_green_of_a_picture(neighbours, repeats):
    picture = np.random.default_rng(3).integers(0, 256, (19, 23, 4), dtype=np.uint8)
    picture[..., 3] = 255
    picture[4:16, 5:17, 0] = 255  # a patch without green
    rule = GroundColour(greenness=0.3, neighbours=neighbours)
    got = green_of(picture, rule, repeats) / 255.0
    expected, grows = colour.green_of(picture, 0.3, neighbours, repeats)
    assert np.array_equal(got[..., 3] == 1.0, grows)
    assert 0.05 < grows.mean() < 1.0 or neighbours == 3
    assert np.abs(got[..., :3] - np.sqrt(expected)).max() < 0.6 / 255.0


def test_excess_green():
    index = excess_green(np.array([[0, 0, 0, 255], [0, 9, 0, 255], [120, 70, 140, 255], [77, 77, 77, 0]], np.uint8))
    assert index == pytest.approx([0.0, 2.0, -120 / 330, 0.0])


def _halves() -> np.ndarray:
    """Bluish green in the west and yellowish in the east of a bare path; a texel is a quarter of a metre."""
    pixels = np.empty((64, 64, 3), np.uint8)
    pixels[:, :32], pixels[:, 32:] = _BLUISH, _YELLOWISH
    pixels[:, 28:36] = _BARE
    return pixels


def _painted(folder, **tables):
    ground = {"size_m": [16.0, 16.0], "terrain_map": "map.png"}
    return with_pictures(
        folder,
        {"map.png": _halves()},
        ground=ground,
        colour={"kind": "ground", "neighbours": 1},
        grass=[{**GRASS, "dryness": [0.0, 0.0]}],
        **tables,
    )


def test_no_blade_grows_where_no_texel_near_is_green(sow, tmp_path):
    x = read_blades(sow(_painted(tmp_path)))["root"][:, 0]
    inside = np.abs(x) < 7.9
    assert np.abs(x[inside]).min() == pytest.approx(0.75, abs=0.05), "the neighbour's colour reaches one texel in"
    everywhere = read_blades(sow(small_scene()))["root"][:, 0]
    far = [((np.abs(each) > 0.8) & (np.abs(each) < 7.9)).sum() for each in (x, everywhere)]
    assert far[0] == far[1], "all others grow as they do without"


def test_soils_and_tiles_are_asked_where_the_terrain_map_leaves_them_bare(sow, tmp_path):
    """Green soil in the north, bare in a tile in the south, and a terrain map that covers the west with green."""
    covering = np.zeros((32, 32, 4), np.uint8)
    covering[:, :16] = (*_BLUISH, 255)
    covering[:, 16:] = (*_BARE, 0)
    green, bare = (np.full((8, 8, 3), each, np.uint8) for each in (_YELLOWISH, _BARE))
    scene = with_pictures(
        tmp_path,
        {"map.png": covering, "green.png": green, "bare.png": bare},
        ground={
            "size_m": [16.0, 16.0],
            "terrain_map": "map.png",
            "texture": "green.png",
            "tile": [{"from_m": [-8.0, 0.0], "to_m": [8.0, 8.0], "texture": "bare.png"}],
        },
        colour={"kind": "ground"},
    )
    root = read_blades(sow(scene))["root"]
    x, z = root[:, 0], root[:, 2]
    inside = np.abs(root[:, [0, 2]]).max(axis=1) < 7.5
    south_east = inside & (x > 0.5) & (z > 0.2)
    assert not south_east.any()
    for part in ((x < -0.5) & (z > 0.5), (x < -0.5) & (z < -0.5), (x > 0.5) & (z < -0.5)):
        assert (inside & part).sum() > 300


def test_a_soil_that_is_wider_than_tall_is_read_across_its_width(sow, tmp_path):
    """Its left half is green, so half as many blades grow as on one that is green all over."""
    whole = np.full((4, 16, 3), _YELLOWISH, np.uint8)
    half = whole.copy()
    half[:, 8:] = _BARE
    counts, rule = [], {"kind": "ground", "neighbours": 0}
    for pixels in (half, whole):
        ground = {"size_m": [16.0, 16.0], "texture": "soil.png", "texture_m": 1.0, "beyond": "bare"}
        scene = with_pictures(tmp_path, {"soil.png": pixels}, ground=ground, colour=rule)
        counts.append(len(read_blades(sow(scene))))
    assert counts[1] > 1000
    assert 0.4 < counts[0] / counts[1] < 0.6


_ALL = {
    **{each.name: {"technique": {"name": each.name}} for each in TECHNIQUES},
    "instanced": {"technique": {"name": "tessellated-quads", "mode": "instanced"}},
    "not stored": {"technique": {"name": "visibility-buffer"}, "sowing": {"stored_m": 0.0}},
}


@pytest.mark.parametrize("tables", _ALL.values(), ids=_ALL)
def test_every_technique_shows_the_colour_of_the_place(renderer, tables, tmp_path):
    camera = {"position_m": [0.0, 3.0, 4.0], "target_m": [0.0, 0.0, -1.0]}
    scene = _painted(tmp_path, camera=camera, **tables)
    drawn = renderer(scene)
    truth = drawn.render(0.0, aovs=["class", "depth", "albedo"]).truth
    grass = truth["class"] == SurfaceClass.GRASS
    x = world_points(drawn, scene.camera, np.where(grass, truth["depth"], 1.0))[..., 0]
    hue = truth["albedo"][..., 2] / np.maximum(truth["albedo"][..., 1], 1e-3)
    west, east = (grass & (sign * x > 1.6) & (sign * x < 7.0) for sign in (-1, 1))
    assert min(west.sum(), east.sum()) > 150
    bluish, yellowish = (colour.light(each)[2] / colour.light(each)[1] for each in (_BLUISH, _YELLOWISH))
    assert np.median(hue[west]) == pytest.approx(bluish, rel=0.2)
    assert np.median(hue[east]) == pytest.approx(yellowish, rel=0.2)
    assert (grass & (np.abs(x) < 0.1)).sum() < 0.2 * (grass & (np.abs(x) > 1.6) & (np.abs(x) < 1.8)).sum()


@pytest.mark.parametrize("name", ["bezier-blades", "visibility-buffer", "tessellated-quads"])
def test_each_blade_has_the_colour_at_its_root(renderer, name):
    """Darker at the root by 0.6, times the tint of the blade: within 0.275, 0.19 and 0.05 of 1."""
    drawn = renderer(_scene(technique={"name": name}))
    truth = drawn.render(0.0, aovs=["albedo", "blade_id"]).truth
    shown, field = truth["blade_id"] > 0, drawn._world.field
    root = blades_by_number(field)["root"][numbers_of(field, truth["blade_id"][shown])].astype(np.float64)
    near = np.linalg.norm(root - drawn._view.camera_ws, axis=1) < 8.0
    low, high = colour.light(_LOW), colour.light(_HIGH)
    expected = colour.noise_colour(_NOISES, low, high, 5, root[near][:, [0, 2]])
    fibres = 0.89 if name == "tessellated-quads" else 1.0
    ratio = truth["albedo"][shown][near] / expected
    tint = np.array([0.275, 0.19, 0.05]) + 0.06
    assert near.sum() > 500
    assert (ratio < 1.0 + tint).mean() > 0.995
    assert (ratio > fibres * 0.6 * (1.0 - tint)).mean() > 0.995
    assert np.corrcoef(truth["albedo"][shown][near][:, 0], expected[:, 0])[0, 1] > 0.6


def test_strength_blends_with_the_species(renderer):
    def albedo(**changes):
        scene = _scene(
            colour={"kind": "noise", "low_colour": "#0000ff", "high_colour": "#0000ff", "noise": [], **changes}
        )
        return renderer(scene).render(0.0, aovs=["albedo"]).truth["albedo"]

    none, half, full = (albedo(strength=each) for each in (0.0, 0.5, 1.0))
    plain = renderer(_scene(colour=None)).render(0.0, aovs=["albedo"]).truth["albedo"]
    assert np.abs(none - plain).max() < 0.01
    assert none[..., 1].mean() > half[..., 1].mean() > full[..., 1].mean()


def test_noises_change_in_place_and_kinds_do_not(renderer, tmp_path):
    scene = _scene()
    drawn = renderer(scene)
    other = scene.model_copy(update={"colour": NoiseColour(noise=[ChannelNoise(wavelength_m=2.0)])})
    assert drawn.updates_in_place(other)
    drawn.update(other)
    assert np.array_equal(drawn.render(0.0).image, renderer(other).render(0.0).image)
    assert not drawn.updates_in_place(scene.model_copy(update={"colour": None}))


@pytest.mark.parametrize("key", ["texture", "terrain_map"])
def test_a_picture_without_green_is_refused_in_a_sentence(tmp_path, key):
    bare = np.full((4, 4, 3), _BARE, np.uint8)
    scene = with_pictures(tmp_path, {"bare.png": bare}, ground={key: "bare.png"}, colour={"kind": "ground"})
    with pytest.raises(InputError) as caught:
        green_pictures(scene, scene.colour)
    assert str(caught.value) == (
        f'ground.{key}: {tmp_path / "bare.png"}: must have a texel of greenness 0.05 for colour.kind = "ground" '
        "(greenest is 0.00); lower colour.greenness, or take a greener picture"
    )


@pytest.mark.parametrize("along_normal", [0.0, 0.35, 1.0])
def test_blades_grow_between_the_vertical_and_the_normal_of_the_land(sow, along_normal):
    scene = small_scene(ground={**NOISE, "height_m": 14.0}, sowing={"along_normal": along_normal})
    heights = HeightField.of(scene)
    blades = read_blades(sow(scene, (0.0, float(heights.height(0, 0)), 0.0)))
    expected = along_normal * heights.normal(*blades["root"][:, [0, 2]].astype(np.float64).T)
    expected[:, 1] += 1.0 - along_normal
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    assert np.abs(up_of(blades) - expected).max() < 2e-3
    assert heights.normal(*blades["root"][:, [0, 2]].T)[:, 1].min() < 0.9


@pytest.mark.parametrize("along_normal", [0.0, 0.02, 0.7, 1.0])
def test_pressed_blades_lie_along_the_land_however_they_grow(device, along_normal):
    from greensward.motion.force_map import Forces  # noqa: F401  declares the layouts

    normal = _RANDOM.normal(size=(100, 3)) * 0.3 + np.array([0.0, 1.0, 0.0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    up = along_normal * normal + np.array([0.0, 1.0 - along_normal, 0.0])
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    got = shader_call(
        device,
        "motion/force_map.glsl",
        "upUnder(up, vec3(0.0, -1.0, 0.0))",
        {"up": up.astype(np.float32)},
        "vec3",
        blocks={SWARD_BLOCK: {"along_normal": along_normal}},
        defines={"NO_FORCES": 1},
    )
    expected = normal if along_normal else np.tile([0.0, 1.0, 0.0], (100, 1))
    assert np.abs(got - expected).max() < 1e-3


def test_nothing_is_left_behind(device, tmp_path):
    scene = _painted(tmp_path)
    with Renderer(scene, size=(64, 36), ctx=device.ctx) as first:  # what the device keeps for all
        first.render(0.0)
    before = live_objects(device)
    with Renderer(scene, size=(64, 36), ctx=device.ctx) as drawn:
        drawn.render(0.0)
    assert live_objects(device) == before


def test_the_far_level_shows_it_too(renderer, tmp_path, coarse_far):
    camera = {"position_m": [0.0, 3.0, 4.0], "target_m": [0.0, 0.0, -1.0]}
    scene = _painted(tmp_path, camera=camera, sowing={"traced_m": 2.0}, technique={"name": "visibility-buffer"})
    truth = renderer(scene).render(0.0, aovs=["class", "albedo"]).truth
    grass = truth["class"] == SurfaceClass.GRASS
    hue = truth["albedo"][..., 2] / np.maximum(truth["albedo"][..., 1], 1e-3)
    west, east = hue[:, :50][grass[:, :50]], hue[:, -50:][grass[:, -50:]]
    assert np.median(west) > 2.0 * np.median(east)
