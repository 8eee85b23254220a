"""A scene saved into its file's text: every value is right, and nothing else of the text changes."""

import difflib
import tomllib
from importlib.resources import files
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from any_scenes import valid_scenes
from greensward.scene import Grass, Scene, SceneError, Simulation
from greensward.scene.load import dump
from greensward.scene.save import saved_text
from greensward.scene.toml_text import spelled, spelled_key

FOLDER = Path(str(files("greensward.scene")))
TEXTS = {path.stem: path.read_text(encoding="utf-8") for path in sorted(FOLDER.glob("presets/*.toml"))}
TEXTS["template"] = (FOLDER / "template.toml").read_text(encoding="utf-8")
TEXTS["empty"] = ""
TEXTS["odd"] = '''\
# A scene as nobody writes one.
title = """
He said ""[[grass]]"" \\
   # no comment"""   # a comment with "quotes' and [brackets]
"seed" = 0x7F
camera.position_m = [
  0, 1.7,  # the eye
  +8.0e0,  # south
]
camera . target_m = [0.0, 1, -20.0]
wind = [{kind = "gusts", speed_mps = 4}, { kind = 'ripples' }] # two of them
sun = {azimuth_deg = 200}
technique.name = 'tessellated-quads'
technique."smoothness" = 8
   [ ground ]
   kind = 'noise'
   height_m = 1_2.5

# grass one
[["grass"]]
# nothing here
[[grass]]   # two
species = "reed"
height_m = [ 1, 2 ]   # tall

[[object]]
kind = "capsule"
position_m = [0, 0, 0]
  [object.path]
  times_s = [0, 1]
  positions_m = [[0, 0, 0],
                 [1, 0, 0]]  # one step
[[object]]
kind = "box"
position_m = [3, 0, 0]
# the end'''


def parse(text: str) -> Scene:
    return Scene.model_validate(tomllib.loads(text.removeprefix("\ufeff")))


@pytest.mark.parametrize("name", TEXTS)
def test_a_text_stays_as_it_is_where_nothing_changed(name):
    text = TEXTS[name]
    assert saved_text(text, parse(text)) == text
    windows = "\ufeff" + text.replace("\n", "\r\n")
    assert saved_text(windows, parse(text)) == windows


@pytest.mark.parametrize("name", TEXTS)
def test_every_text_can_become_every_other_scene(name):
    for other in (*map(parse, TEXTS.values()), Scene()):
        assert parse(saved_text(TEXTS[name], other)) == other


@pytest.mark.parametrize("name", TEXTS)
def test_without_a_text_a_scene_is_written_anew(name):
    scene = parse(TEXTS[name])
    assert parse(saved_text(None, scene)) == scene
    assert dump(scene) == saved_text(None, scene)


# By chance --------------------------------------------------------------------------------------------------


@st.composite
def edited(draw, scene):
    """The scene with parts of another, and with items of its lists gone, doubled and moved."""
    try:
        other = Scene.model_validate(draw(valid_scenes))
    except ValidationError:  # a camera that looks at itself
        other = Scene()
    taken = {key: getattr(other, key) for key in draw(st.sets(st.sampled_from(sorted(Scene.model_fields))))}
    for key in ("grass", "wind", "force", "object", "flowers"):
        items = [*getattr(scene, key), *getattr(other, key)]
        if items and draw(st.booleans()):
            taken[key] = tuple(draw(st.lists(st.sampled_from(items), max_size=6)))
    winds = taken.get("wind", ())
    first = next((i for i, wind in enumerate(winds) if wind.kind == "wake"), None)  # a scene has at most one
    taken |= {"wind": tuple(w for i, w in enumerate(winds) if w.kind != "wake" or i == first)} if winds else {}
    return scene.model_copy(update=taken)


@given(st.data())
def test_any_edits_one_after_another_are_saved_exactly(data):
    text = data.draw(st.sampled_from(sorted(TEXTS.values())))
    scene = parse(text)
    for _ in range(data.draw(st.integers(1, 3))):
        scene = data.draw(edited(scene))
        text = saved_text(text, scene)
        assert parse(text) == scene
        assert saved_text(text, scene) == text


settings_tables = st.dictionaries(
    st.sampled_from(["b", "c d", 'e"f', "kind"]),
    st.recursive(
        st.integers(-9, 9) | st.booleans() | st.text(max_size=3),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from("ghi"), inner, max_size=3),
        max_leaves=8,
    ),
    max_size=4,
)


def dotted(table):
    """Keys and values with tables opened up: `a.b = 1`."""
    for key, value in table.items():
        if isinstance(value, dict) and value:
            yield from ((f"{spelled_key(key)}.{inner}", item) for inner, item in dotted(value))
        else:
            yield spelled_key(key), value


@given(settings_tables, settings_tables, st.sampled_from(["headers", "braces", "dots"]))
def test_settings_of_any_shape_are_saved_exactly(old, new, written):
    first, second = (Scene.model_validate({"technique": {"name": "x", **table}}) for table in (old, new))
    text = {
        "headers": saved_text(None, first),
        "braces": f"technique = {spelled(old)}\n",
        "dots": "".join(f"technique.{key} = {spelled(value)}\n" for key, value in dotted(old)),
    }[written]
    assert parse(saved_text(text, second)) == second


# In detail --------------------------------------------------------------------------------------------------


def after(name: str, **parts) -> tuple[list[str], list[str]]:
    """Which lines a text loses and gains; keys of the scene are replaced, or updated where a table is given."""
    scene = parse(TEXTS[name])
    update = {
        key: getattr(scene, key).model_copy(update=part) if isinstance(part, dict) else part
        for key, part in parts.items()
    }
    new = scene.model_copy(update=update)
    made = saved_text(TEXTS[name], new)
    assert parse(made) == new
    lines = list(difflib.ndiff(TEXTS[name].splitlines(), made.splitlines()))
    return tuple([line[2:] for line in lines if line.startswith(sign)] for sign in "-+")


def test_a_number_changes_alone():
    assert after("template", sun={"azimuth_deg": 240.0, "elevation_deg": 18.5}) == (
        ["azimuth_deg = 235                   # clockwise from north: 90 is east, 180 south",
         "elevation_deg = 18                  # above the horizon"],
        ["azimuth_deg = 240                   # clockwise from north: 90 is east, 180 south",
         "elevation_deg = 18.5                # above the horizon"],
    )  # fmt: skip
    gone, new = after("template", title="x" * 40, seed=123_456)
    assert new[1] == "seed = 123456                       # another number: another field of the same kind"
    gone, new = after("odd", camera={"position_m": (0.0, 2.5, 8.0)})
    assert (gone, new) == (["  0, 1.7,  # the eye"], ["  0, 2.5,  # the eye"])


def test_a_new_key_stands_below_the_last_of_its_table():
    assert after("template", sowing={"reach_m": 90.0}) == ([], ["reach_m = 90.0"])
    assert after("odd", ground={"octaves": 3}, camera={"near_m": 0.2}) == (
        [], ["camera.near_m = 0.2", "   octaves = 3"],
    )  # fmt: skip
    assert after("template", post={"exposure_ev": 1.0, "blur": "average"})[1] == [
        "exposure_ev = 1.0                   # +1 is twice as bright", 'blur = "average"',
    ]  # fmt: skip


def test_a_table_goes_without_the_comments_of_others():
    grass = parse(TEXTS["template"]).grass
    gone, new = after("template", grass=(grass[0], grass[1]))
    assert (gone, new) == (["", "[[grass]]", 'species = "daisy"', "share = 0.02", "patchiness = 0.8"], [])
    gone, new = after("template", grass=grass[1:])
    assert not [line for line in gone if line.startswith("#")]
    assert 'species = "fescue"' not in gone
    assert new == []


def test_a_table_comes_where_the_order_of_a_scene_has_it():
    made = saved_text(TEXTS["template"], parse(TEXTS["template"]).model_copy(update={"simulation": Simulation()}))
    assert "gustiness = 0.6\n\n[simulation]\n\n\n# What presses it down" in made


def test_the_comment_upon_a_header_goes_with_it_and_the_opening_stays():
    text = "# The summary\n[[grass]]\nshare = 1 # a\n\n# second\n[[grass]]\nshare = 2 # b\n\n# the sun\n[sun]\n"
    scene = parse(text)
    assert saved_text(text, scene.model_copy(update={"grass": scene.grass[:1]})) == (
        "# The summary\n[[grass]]\nshare = 1 # a\n\n# the sun\n[sun]\n"
    )
    assert saved_text(text, scene.model_copy(update={"grass": scene.grass[1:]})) == (
        "# The summary\n\n# second\n[[grass]]\nshare = 2 # b\n\n# the sun\n[sun]\n"
    )
    assert (
        saved_text(text, scene.model_copy(update={"grass": ()})) == "# The summary\ngrass = []\n\n# the sun\n[sun]\n"
    )
    third = (*scene.grass, Grass(share=3.0))
    assert saved_text(text, scene.model_copy(update={"grass": third})) == text.replace(
        "# the sun", '[[grass]]\nspecies = "meadow-grass"\nshare = 3.0\n\n# the sun'
    )


def test_items_of_an_array_come_and_go_one_by_one():
    path = "path = [[0, 0], [12, 5],\n  [13, 6]] # around\n"
    text = f'[[force]]\nkind = "footprints"\n{path}'
    scene = parse(text)

    def walked(*points):
        made = saved_text(
            text, scene.model_copy(update={"force": (scene.force[0].model_copy(update={"path": points}),)})
        )
        assert parse(made).force[0].path == points
        return made.removeprefix('[[force]]\nkind = "footprints"\n')

    assert walked((0.0, 0.0), (12.0, 5.0), (13.0, 6.0)) == path
    assert walked((0.0, 0.0), (12.0, 5.0)) == "path = [[0, 0], [12, 5]] # around\n"
    assert walked((12.0, 5.0), (13.0, 6.0)) == "path = [[12, 5],\n  [13, 6]] # around\n"
    assert walked((0.0, 0.0), (12.0, 5.5), (13.0, 6.0)) == path.replace("5]", "5.5]")
    assert walked((9.0, 9.0), (0.0, 0.0), (12.0, 5.0), (13.0, 6.0), (1.0, 1.0)) == (
        "path = [[9.0, 9.0], [0, 0], [12, 5],\n  [13, 6], [1.0, 1.0]] # around\n"
    )


@pytest.mark.parametrize("text", ["[ground", "seed = -1", "[ground]\nkind = 'nothing'"])
def test_what_is_no_scene_is_not_written_over(text):
    with pytest.raises(SceneError, match="the text to save into: "):
        saved_text(text, Scene())
