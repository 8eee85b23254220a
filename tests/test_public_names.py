"""The public names, where they were before, and what may stand in the place of a scene."""

import subprocess
import sys

import pytest

import greensward as gs


def test_every_public_name_is_there_and_listed():
    assert {"Scene", "Renderer", "load", "show", "winds", "objects", "grounds", "forces", "colours"} <= set(dir(gs))
    for name in gs.__all__:
        assert getattr(gs, name)
    for group in (gs.winds, gs.objects, gs.grounds, gs.forces, gs.colours):
        assert set(group.__all__) <= set(dir(group))


@pytest.mark.parametrize(
    ("name", "home"),
    [
        ("Strong", "winds"),
        ("Path", "objects"),
        ("FlatGround", "grounds"),
        ("Tracks", "forces"),
        ("NoiseColour", "colours"),
    ],
)
def test_a_name_that_moved_says_where_it_is(name, home):
    with pytest.raises(AttributeError, match=rf"greensward\.{name} is now greensward\.{home}\.{name}"):
        getattr(gs, name)
    assert not hasattr(gs, "Scenery")


def test_importing_loads_no_models_arrays_or_graphics():
    script = (
        "import sys, greensward\n"
        "print([name for name in ('numpy', 'moderngl', 'pydantic', 'greensward.scene') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_renderer_takes_the_name_of_a_scene_or_its_path(tmp_path):
    with pytest.raises(gs.SceneError, match=r"medow: no preset has this name.*did you mean meadow"):
        gs.Renderer("medow")
    (tmp_path / "scene.toml").write_text("title = 'Bare'\ngrass = []\nsowing.density_per_m2 = 0")
    for source in (str(tmp_path), tmp_path / "scene.toml", gs.load(tmp_path)):
        with gs.Renderer(source, size=(16, 9)) as renderer:
            assert renderer.scene.title == "Bare"
