"""A run at toy size: rows as promised, and an honest word on what is missing."""

import moderngl
import pytest

from greensward.bench import quality, suite
from greensward.bench.quality import flip_distance
from greensward.bench.suite import Wanted, commit, run, scene_hash
from greensward.bench.workloads import STRIPS, chosen_workloads
from greensward.io.camera_path import CameraPath
from greensward.library import load
from greensward.scene import Camera, GreenswardError

TOY = {"scale": "toy", "frames": 2, "quality": False, "device": "cpu"}


def wanted(*names: str, **options) -> Wanted:
    return Wanted(chosen_workloads(names), **{**TOY, **options})


@pytest.mark.slow
def test_a_run_gives_flat_rows_of_every_case_and_technique():
    kept = []
    result = run(wanted("blade-count", techniques=(STRIPS, "visibility-buffer"), sizes=((16, 9), (32, 18))),
                 keep=lambda now: kept.append((len(now.rows), now.machine["incomplete"])))  # fmt: skip
    assert list(result.json) == ["machine", "rows"]
    assert len(result.rows) == 5 * 2 * 2
    assert {(row["width"], row["height"]) for row in result.rows} == {(16, 9), (32, 18)}
    assert {row["technique"] for row in result.rows} == {STRIPS, "visibility-buffer"}
    assert kept[0] == (1, "stopped after 1 of 20 measurements")
    assert kept[-1] == (20, None)
    machine = result.machine
    assert machine["driver"].startswith("llvmpipe")
    assert machine["clock"] == "wall clock around finish(), as the CPU draws"
    assert machine["frames"] == 2
    assert not machine["skipped"]


@pytest.mark.slow
def test_a_preset_is_measured_as_it_ships_by_a_camera_that_stands_and_by_one_that_moves():
    result = run(wanted("presets", techniques=("visibility-buffer",)))
    still, moving = result.rows
    assert (still["case"], moving["case"]) == ("meadow, camera still", "meadow, camera moving")
    assert still["scene_hash"] == moving["scene_hash"]
    assert min(still["first_frame_s"], moving["first_frame_s"]) > 0.0


@pytest.mark.slow
def test_variants_are_measured_side_by_side():
    names = tuple(
        f"expanded-roots[storage={storage},extra_blades=1]" for storage in ("vertex-buffer", "texture-array")
    )
    result = run(wanted("tillman2013-extra-blades", techniques=(*names, "visibility-buffer"), sizes=((16, 9),)))
    assert not result.machine["skipped"]
    assert [row["technique"] for row in result.rows] == [
        name for name in (*names, "visibility-buffer") for _ in range(6)
    ]


def test_what_takes_long_is_said():
    slow = run(wanted("tillman2013-limit", scale="quick", techniques=("visibility-buffer",)))
    assert slow.machine["skipped"][0]["reason"] == "takes long: --scale full"


@pytest.mark.slow
@pytest.mark.usefixtures("coarse_far")
def test_a_technique_that_cannot_draw_a_case_is_skipped_with_its_reason():
    result = run(wanted("field-scale", techniques=("bezier-blades", STRIPS, "visibility-buffer")))
    assert {row["technique"] for row in result.rows} == {"visibility-buffer"}
    assert len(result.machine["skipped"]) == 6
    assert all("stored" in each["reason"] for each in result.machine["skipped"])
    assert result.machine["incomplete"] is None


LOST = (suite.DeviceLostError("the driver stopped drawing"), moderngl.Error("gone"), MemoryError())


@pytest.mark.parametrize("error", LOST, ids=lambda error: type(error).__name__)
def test_a_device_lost_midway_leaves_the_rows_so_far(error, monkeypatch):
    measure, calls = suite.measure, []

    def failing(*arguments):
        calls.append(arguments)
        if len(calls) == 3:
            raise error
        return measure(*arguments)

    monkeypatch.setattr(suite, "measure", failing)
    result = run(wanted("blade-count", techniques=(STRIPS,)))
    assert len(result.rows) == 2
    told = str(error) or "memory ran out"
    assert result.machine["incomplete"] == f"{told} after 2 of 5 measurements, in blade-count, {STRIPS}, 1M"


@pytest.mark.slow
def test_pictures_are_compared_with_a_clean_one():
    pytest.importorskip("flip_evaluator")
    result = run(wanted("habel2007-half-screen", quality=True, techniques=("visibility-buffer",)))
    rows = [row for row in result.rows if row["workload"] == "quality"]
    assert [row["case"] for row in rows] == ["meadow, 1 sample"]
    assert 0.0 < rows[0]["flip"] < 0.5
    assert list(result.pictures) == ["reference", "visibility-buffer, meadow, 1 sample"]


def test_flip_tells_equal_from_unlike():
    pytest.importorskip("flip_evaluator")
    import numpy as np

    grey = np.full((16, 16, 3), 128, np.uint8)
    assert flip_distance()(grey, grey) == 0.0
    assert flip_distance()(grey, 255 - 0 * grey) > 0.1


@pytest.mark.slow
def test_without_flip_pictures_are_kept_and_the_cure_told(monkeypatch):
    def missing():
        raise GreenswardError(f"FLIP distances need flip-evaluator: {quality.INSTALL}")

    monkeypatch.setattr(quality, "flip_distance", missing)
    result = run(wanted("habel2007-half-screen", quality=True, techniques=("visibility-buffer",)))
    assert result.rows[-1]["flip"] is None
    assert len(result.pictures) == 2
    assert quality.INSTALL in result.machine["skipped"][-1]["reason"]


def looking(height_m, up_m):
    """A path that looks up or down."""
    ends = [(x, height_m, 0.0) for x in (0.0, 1.0)]
    seen = [Camera(position_m=(x, y, z), target_m=(x, y + up_m, z - 1.0)) for x, y, z in ends]
    return CameraPath.recorded([(float(i), camera) for i, camera in enumerate(seen)])


@pytest.mark.slow
def test_the_camera_follows_a_path_and_the_rows_tell_which():
    def rows(path):
        result = run(wanted("habel2007-half-screen", techniques=("visibility-buffer", STRIPS), path=path))
        assert result.machine["camera_path"] == (path.digest if path else None)
        return result.rows

    sky, grass, loop = rows(looking(2.0, 1.0)), rows(looking(2.0, -1.0)), rows(None)
    assert sky[0]["blade_pixels"] == 0 < grass[0]["blade_pixels"]
    hashes = {row["scene_hash"] for row in (sky[0], grass[0], loop[0])}
    assert len(hashes) == 3
    assert sky[1]["frames"] == 2


def test_a_path_in_the_ground_is_skipped_with_its_reason():
    result = run(wanted("habel2007-half-screen", techniques=("visibility-buffer",), path=looking(-2.0, 1.0)))
    assert result.rows == []
    assert "must be above the ground" in result.machine["skipped"][0]["reason"]


def test_the_hash_follows_the_scene_and_its_files(tmp_path):
    assert scene_hash(load("meadow")) == scene_hash(load("meadow"))
    assert scene_hash(load("meadow")) != scene_hash(load("meadow", seed=5))
    oasis = load("jahrmann2013-oasis")
    copy = tmp_path / "jahrmann2013"
    copy.mkdir()
    for file in oasis.resolve("jahrmann2013").iterdir():
        copy.joinpath(file.name).write_bytes(file.read_bytes())
    moved = oasis.in_folder(tmp_path)
    assert scene_hash(moved) == scene_hash(oasis)
    copy.joinpath("oasis-density.png").write_bytes(b"another")
    assert scene_hash(moved) != scene_hash(oasis)


def test_there_is_no_commit_outside_of_a_repository(tmp_path):
    assert commit(tmp_path) is None
