"""Malformed scenes, by the thousand: never anything but `SceneError`; and valid ones survive TOML."""

import copy
import string
import tempfile
import tomllib
from pathlib import Path

import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from any_scenes import valid_scenes
from greensward.scene import Scene, SceneError, Sky
from greensward.scene.load import dump, load

BAD_WORDS = ("Input should", "pydantic", "Traceback", "Value error", "valid string", "FieldInfo")
FOLDER = Path(tempfile.mkdtemp(prefix="greensward-test-"))
FILE = FOLDER / "scene.toml"

scalars = (
    st.none().map(lambda _: 0)
    | st.booleans()
    | st.integers(min_value=-(2**70), max_value=2**70)
    | st.floats()
    | st.text(max_size=12)
    | st.dates()
    | st.datetimes()
    | st.sampled_from(["flat", "noise", "heightmap", "gusts", "box", "reed", "~x/y", "\0", "../..", "#fff"])
)


def _keys(model):
    names = set(model.model_fields)
    for definition in model.model_json_schema().get("$defs", {}).values():
        names |= set(definition.get("properties", {}))
    return sorted(names)


keys = st.sampled_from(_keys(Scene)) | st.text(string.printable, min_size=1, max_size=8) | st.text(max_size=4)
values = st.recursive(
    scalars,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(keys, inner, max_size=4),
    max_leaves=12,
)
scenes = st.dictionaries(keys, values, max_size=5)

WHOLE = tomllib.loads(
    """
    title = "Whole"
    [ground]
    kind = "noise"
    size_m = [10, 20.5]
    [[grass]]
    species = "reed"
    height_m = [0.1, 0.2]
    [[grass]]
    [sowing]
    density_per_m2 = 5
    [[wind]]
    kind = "gusts"
    [[object]]
    kind = "box"
    position_m = [0, 1, 2]
    [camera]
    position_m = [0, 1, 2]
    near_m = 0.1
    [technique]
    name = "visibility-buffer"
    haze = 1.0
    """
)


def told(*args, **options):
    """What a user is told; nothing where the scene loads. Every sentence is fit to be read."""
    problems = None
    try:
        load(*args, **options)
    except SceneError as error:
        problems = error.problems
    assert problems != ()
    for problem in problems or ():
        assert problem.strip()
        assert "\n" not in problem
        assert not any(word in problem for word in BAD_WORDS), problem
    return problems


def check(table):
    try:
        text = tomli_w.dumps(table)
        FILE.write_text(text, encoding="utf-8")
    except (ValueError, TypeError, UnicodeError):
        return
    if any(word in text for word in BAD_WORDS):
        return  # a sentence quotes what the user wrote
    told(FILE, technique_settings={"visibility-buffer": Sky})


@given(scenes)
def test_any_table_loads_or_is_refused_in_words(table):
    check(table)


@st.composite
def mutated(draw):
    """A valid scene of which a few parts are replaced, removed, or joined by others."""
    table = copy.deepcopy(WHOLE)
    for _ in range(draw(st.integers(1, 3))):
        node = table
        while True:
            places = list(node) if isinstance(node, dict) else list(range(len(node)))
            if not places:
                break
            place = draw(st.sampled_from(places))
            if isinstance(node[place], dict | list) and draw(st.booleans()):
                node = node[place]
                continue
            action = draw(st.sampled_from(["replace", "remove", "add"]))
            if action == "replace":
                node[place] = draw(values)
            elif action == "remove":
                del node[place]
            elif isinstance(node, dict):
                node[draw(keys)] = draw(values)
            else:
                node.append(draw(values))
            break
    return table


@given(mutated())
def test_a_valid_scene_with_something_wrong_is_refused_in_words(table):
    check(table)


@given(st.binary(max_size=60) | st.text(max_size=60).map(lambda text: text.encode("utf-8", "replace")))
def test_any_bytes_load_or_are_refused_in_words(content):
    FILE.write_bytes(content)
    told(FILE)


@pytest.mark.slow
@given(st.lists(st.text(max_size=20) | st.builds("{}.{}={}".format, keys, keys, st.text(max_size=5)), max_size=3))
def test_any_override_is_taken_or_refused_in_words(overrides):
    told("meadow", overrides=overrides)


@pytest.mark.slow
@given(st.text(max_size=20) | st.from_regex(r"-?[0-9]{1,3},[0-9.]{1,4},[0-9e]{1,3}:1,2,[0-9]{1,3}(:[0-9]{1,3})?"))
def test_any_camera_is_taken_or_refused_in_words(camera):
    told("meadow", camera=camera)


@given(valid_scenes)
def test_every_valid_scene_survives_toml(given_table):
    try:
        scene = Scene.model_validate(given_table).in_folder(FOLDER)
    except ValidationError:  # a camera that looks at itself
        return
    FILE.write_text(dump(scene), encoding="utf-8")
    assert load(FILE) == scene
