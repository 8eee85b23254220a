"""The examples run as a user would run them; and on the real hillside grass keeps to where it may grow."""

import json
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import greensward as gs
from blades import blades_by_number, numbers_of
from greensward.ground import HeightField

EXAMPLES = Path(__file__).parents[1] / "examples"


def run(monkeypatch, name: str, out: Path, *arguments: str) -> None:
    line = [f"{name}.py", "--size", "96x54", "--samples", "1", "-o", str(out), *arguments]
    monkeypatch.setattr(sys, "argv", line)
    runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")


def pixels(path: Path) -> np.ndarray:
    with Image.open(path) as picture:
        assert picture.size == (96, 54)
        return np.asarray(picture.convert("RGB")).astype(float)


def test_every_example_is_tested():
    assert {path.stem for path in EXAMPLES.glob("*.py")} == {"picture", "embed", "hillside", "walk"}


@pytest.mark.slow
@pytest.mark.usefixtures("thin_fields")
def test_picture_writes_a_picture_and_its_truth(monkeypatch, tmp_path, capsys):
    run(monkeypatch, "picture", tmp_path / "picture.png")
    assert pixels(tmp_path / "picture.png").std() > 10
    with np.load(tmp_path / "picture.npz") as truth:
        assert set(truth) == {"depth", "class", "blade_id", "camera"}
        assert truth["depth"].shape == truth["class"].shape == truth["blade_id"].shape == (54, 96)
        assert json.loads(str(truth["camera"]))["size"] == [96, 54]
    assert "different blades show" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.usefixtures("thin_fields")
def test_embed_draws_a_cube_that_turns_among_the_grass(monkeypatch, tmp_path):
    # depth composes if all of the cube is hidden or shown by place, not by order: blue shows, and grass before it
    for time_s in ("1", "1.5"):
        run(monkeypatch, "embed", tmp_path / f"{time_s}.png", "--time", time_s)
    first, second = (pixels(tmp_path / f"{time_s}.png") for time_s in ("1", "1.5"))
    middle = np.s_[20:44, 32:64]
    bluish = first[middle][..., 2] > first[middle][..., 1] + 15
    assert 0.05 < bluish.mean() < 0.9
    assert np.abs(first - second).mean() > 0.5


@pytest.mark.slow
@pytest.mark.usefixtures("thin_fields")
def test_hillside_draws_near_and_far_from_a_scene_that_is_right(monkeypatch, tmp_path):
    run(monkeypatch, "hillside", tmp_path / "hill")
    near, far = (pixels(tmp_path / "hill" / f"{name}.png") for name in ("near", "far"))
    for picture in (near, far):
        sky, land = picture[:8].mean(axis=(0, 1)), picture[30:].mean(axis=(0, 1))
        assert sky[2] > sky[1] > sky[0]
        assert land[1] > land[2] + 10
    assert np.abs(near - far).mean() > 5
    assert gs.load(tmp_path / "hill").ground.kind == "heightmap"


@pytest.mark.slow
@pytest.mark.usefixtures("thin_fields")
def test_walk_writes_a_video_of_a_moving_camera(monkeypatch, tmp_path, capsys):
    run(monkeypatch, "walk", tmp_path / "walk.mp4", "--seconds", "0.2", "--fps", "10")
    assert (tmp_path / "walk.mp4").stat().st_size > 1000
    assert "through the meadow" in capsys.readouterr().out
    camera_at = runpy.run_path(str(EXAMPLES / "walk.py"))["camera_at"]
    start = gs.load("meadow").camera
    way = np.array([camera_at(start, t).position_m for t in np.arange(0, 60, 1 / 30)])
    steps = np.linalg.norm(np.diff(way[:, [0, 2]], axis=0), axis=1)
    assert steps.max() < 2 * steps.min() < 0.12


@pytest.mark.slow
@pytest.mark.usefixtures("thin_fields")
def test_the_notebook_runs_cell_by_cell(monkeypatch):
    pytest.importorskip("jupyter_rfb")
    shown = []

    def small(scene, **options):
        shown.append(show(scene, size=(48, 27), **options))
        return shown[-1]

    show = gs.show
    monkeypatch.setattr(gs, "show", small, raising=False)
    notebook = json.loads((EXAMPLES / "meadow.ipynb").read_text(encoding="utf-8"))
    names: dict[str, object] = {}
    for number, cell in enumerate(notebook["cells"]):
        if cell["cell_type"] == "code":
            text = "".join(cell["source"]).replace("(960, 540), samples=8", "(96, 54), samples=1")
            exec(compile(text, f"meadow.ipynb: cell {number}", "exec"), names)
            assert cell["outputs"] == [], "a notebook is kept without what it printed"
            if shown[-1]._renderer:
                assert shown[-1].get_frame().std() > 10
    assert names["picture"].std() > 10
    assert shown[-1].get_frame() is None


# The real hillside ------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def hillside(tmp_path_factory):
    folder = tmp_path_factory.mktemp("real") / "hillside"
    runpy.run_path(str(EXAMPLES / "hillside.py"))["make"](folder)
    return folder


def most_density(folder: Path, size_m: tuple[float, float], x, z) -> np.ndarray:
    """The greatest of the four texels that bilinear filtering mixes at each point: 0 only where it must give 0."""
    with Image.open(folder / "density.png") as picture:
        red = np.asarray(picture)[..., 0]
    rows, columns = red.shape
    j = np.floor((x / size_m[0] + 0.5) * columns - 0.5).astype(int)
    i = np.floor((z / size_m[1] + 0.5) * rows - 0.5).astype(int)
    return np.max([red[i + di, j + dj] for di in (0, 1) for dj in (0, 1)], axis=0)


def shown_roots(renderer, truth) -> tuple[np.ndarray, np.ndarray]:
    """Where the blades stand whose ids the picture shows: x and z."""
    field = renderer._world.field
    numbers = np.unique(numbers_of(field, truth["blade_id"]))
    x, _, z = blades_by_number(field)["root"][numbers[numbers > 0]].astype(float).T
    return x, z


def places(truth) -> tuple[np.ndarray, np.ndarray]:
    """The x and z that every pixel shows, from its depth."""
    camera = json.loads(str(truth["camera"]))
    width, height = camera["size"]
    slope = np.tan(np.radians(camera["fov_y_deg"]) / 2)
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, 1 - (np.arange(height) + 0.5) / height * 2)
    d = np.where(np.isfinite(truth["depth"]), truth["depth"], np.nan)
    points = np.stack([x * slope * width / height * d, y * slope * d, -d, np.ones_like(d)], -1)
    world = points @ np.linalg.inv(np.array(camera["view_from_world"])).T
    return world[..., 0], world[..., 2]


@pytest.mark.slow
@pytest.mark.parametrize("max_slope_deg", [30.0, 22.0])
def test_nothing_grows_where_density_is_zero_or_the_slope_too_steep(renderer, hillside, max_slope_deg):
    # a place where bare and steep land lies beside land that bears grass
    scene = gs.load(
        hillside,
        overrides={
            "sowing.max_slope_deg": max_slope_deg,
            "sowing.reach_m": 110.0,
            "sowing.full_density_m": 20.0,
            "camera.position_m": [-150, 30, -2896],
            "camera.target_m": [-190, 0, -2850],
            "camera.fov_y_deg": 80,
            "shadows.enabled": False,
        },
    )
    drawn = renderer(scene, size=(320, 180))
    truth = drawn.render(aovs=("depth", "class", "blade_id")).truth
    heights = HeightField.of(scene)

    def slope_deg(x, z):
        return np.degrees(np.arccos(heights.normal(x, z)[..., 1]))

    x, z = shown_roots(drawn, truth)
    assert len(x) > 500, "grass is seen"
    assert (most_density(hillside, scene.ground.size_m, x, z) > 0).all()
    assert slope_deg(x, z).max() <= max_slope_deg + 0.05

    # and this tried something: land within reach that is in the picture is bare for either reason
    near = (truth["class"] == gs.SurfaceClass.GROUND) & (truth["depth"] < 100)
    gx, gz = (each[near] for each in places(truth))
    assert (most_density(hillside, scene.ground.size_m, gx, gz) == 0).sum() > 500
    if max_slope_deg < 30:
        assert (slope_deg(gx, gz) > max_slope_deg).sum() > 500
        steep = slope_deg(gx, gz) > max_slope_deg
        assert (most_density(hillside, scene.ground.size_m, gx[steep], gz[steep]) > 100).sum() > 100
