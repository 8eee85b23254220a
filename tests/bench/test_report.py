"""What is made of a run: the file, the report, and the comparison."""

import copy
import json
import re
from pathlib import Path

import numpy as np
import pytest

from greensward.bench import plots, record
from greensward.bench.comparison import compare, drift, ratio
from greensward.bench.report import markdown_tables, write_report
from greensward.scene import GreenswardError, InputError


def row(**changes):
    return {
        "workload": "blade-count", "technique": "visibility-buffer", "case": "1M", "width": 640, "height": 360,
        "blades_considered": 9000, "blades_simulated": 0, "blades_drawn": 8000, "blade_pixels": 500,
        "vertices": None, "primitives": 40, "draw_calls": 5, "dispatches": 6, "frames": 61, "frame_ms_median": 2.0,
        "frame_ms_p25": 1.9, "frame_ms_p75": 2.1, "frame_ms_p95": 2.3, "frame_ms_min": 1.8, "frame_ms_max": 9.0,
        "cpu_ms_median": None, "floor_ms": 1.0, "over_floor": 2.0, "pass_ms": {"grass": 1.0}, "gpu_bytes": 2**21,
        "scene_hash": "ab", "published": "", **changes,
    }  # fmt: skip


@pytest.fixture
def kept():
    machine = {"format": record.FORMAT, "greensward": "0.1.0", "driver": "llvmpipe", "commit": "abc", "libraries": {}}
    rows = [row(), row(technique="bezier-blades", frame_ms_median=5.0, published="75 frames | second")]
    rows.append(row(workload="quality", case="meadow, 1 sample", flip=0.12, samples=1))
    skipped = [{"workload": "habel2007-half-screen", "technique": "vertex-buffer", "case": "", "reason": "<not yet>"}]
    return {"machine": {**machine, "skipped": skipped, "incomplete": None}, "rows": rows}


def test_what_is_written_is_read_again(kept, tmp_path):
    record.write(tmp_path / "a.json", kept)
    assert record.read(tmp_path / "a.json") == kept
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("{", "is no JSON"),
        ("[]", "holds no measurements"),
        (
            '{"machine": {"greensward": "9"}, "rows": []}',
            "is of format unknown, written by greensward 9, and must be of",
        ),
        ('{"machine": {"format": 99}, "rows": []}', "is of format 99"),
        ('{"machine": {"format": 1}, "rows": [{"workload": "x"}]}', r"rows\[0\]\.technique: is missing"),
        ('{"machine": {"format": 1}, "rows": [3]}', r"rows\[0\]: must be a table"),
    ],
)
def test_a_file_of_another_kind_or_version_is_refused(text, told, tmp_path):
    (tmp_path / "a.json").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=rf"a\.json: .*{told}"):
        record.read(tmp_path / "a.json")


@pytest.mark.slow
def test_the_page_stands_alone_and_the_markdown_has_its_pictures(kept, tmp_path):
    picture = np.full((9, 16, 3), 90, np.uint8)
    pictures = {"reference": picture, "visibility-buffer, meadow, 1 sample": picture}
    files = write_report(tmp_path, kept, pictures)
    assert {path.name for path in files} == {path.name for path in tmp_path.iterdir()}
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert page.count("data:image/") == 4
    assert not re.search(r'(src|href)="(?!data:)', page)
    assert "&lt;not yet&gt;" in page
    text = (tmp_path / "report.md").read_text(encoding="utf-8")
    linked = re.findall(r"\]\(([^)]+)\)", text)
    assert len(linked) == 4
    assert all((tmp_path / name).is_file() for name in linked)
    assert "75 frames \\| second" in text
    assert "0.1200" in text


def test_what_is_missing_stands_in_the_report(kept, tmp_path, monkeypatch):
    kept["machine"]["incomplete"] = "the driver stopped drawing after 2 of 5 measurements"

    def without(_):
        raise GreenswardError("plots need matplotlib")

    monkeypatch.setattr("greensward.bench.report.plots", without)
    write_report(tmp_path, kept, {})
    for name in ("report.html", "report.md"):
        text = (tmp_path / name).read_text(encoding="utf-8")
        assert "Incomplete: the driver stopped drawing after 2 of 5 measurements." in text
        assert "plots need matplotlib" in text
        assert "vertex-buffer" in text


@pytest.mark.slow
def test_plots_are_named_after_their_workloads(kept):
    made = plots.plots(kept)
    assert set(made) == {"blade-count.webp", "cost-quality.webp"}
    assert all(data[8:12] == b"WEBP" for data in made.values())


def test_tables_are_regular(kept):
    for block in re.findall(r"(?:^\|.*\n)+", markdown_tables(kept), re.MULTILINE):
        assert len({len(re.findall(r"(?<!\\)\|", line)) for line in block.splitlines()}) == 1


def test_the_first_frame_is_told_where_it_is_known(kept):
    assert "first, s" not in markdown_tables(kept)
    kept["rows"][0]["first_frame_s"] = 1.256
    text = markdown_tables(kept)
    assert "| 1.26 |" in text
    assert text.count("first, s") == 1


def test_no_frames_is_an_empty_report(kept, tmp_path):
    kept["rows"] = []
    assert [path.name for path in write_report(tmp_path, kept, {})] == ["report.html", "report.md"]


def test_ratios_are_noise_where_the_runs_overlap():
    near = row(frame_ms_median=2.05, frame_ms_p25=1.95, frame_ms_p75=2.2)
    assert ratio(row(), near).verdict == "noise"
    slow = row(frame_ms_median=3.0, frame_ms_p25=2.9, frame_ms_p75=3.1)
    told = ratio(row(), slow)
    assert told.verdict == "slower"
    assert told.low < told.middle == 1.5 < told.high
    assert ratio(slow, row()).verdict == "faster"
    assert ratio(row(frames=2), slow).verdict == "too few frames"
    assert ratio(row(), slow, drifted=1.6).verdict == "noise"


def test_the_floor_tells_how_far_the_machine_drifts():
    assert drift([(row(), row(floor_ms=1.25))]) == pytest.approx(1.25)
    assert drift([(row(), row(floor_ms=0.8))]) == pytest.approx(1.25)
    assert drift([(row(), row(floor_ms=5.0, blades_drawn=1))]) == 1.0


def test_a_comparison_tells_ratios_and_what_only_one_has(kept):
    other = copy.deepcopy(kept)
    other["rows"][0] |= {"frame_ms_median": 4.0, "frame_ms_p25": 3.9, "frame_ms_p75": 4.1, "scene_hash": "cd"}
    other["machine"] |= {"driver": "another", "incomplete": "stopped after 1 of 3 measurements"}
    del other["rows"][1]
    text = compare(kept, other, (Path("a.json"), Path("b.json")))
    assert "| 2.000 | 4.000 | 2.000 | 1.857–2.158 | slower; another scene |" in text
    assert "The machines differ" in text
    assert "Only in a.json: 1 (blade-count, bezier-blades, 1M)" in text
    assert "INCOMPLETE: stopped after 1 of 3" in text
    empty = compare(kept, {**kept, "rows": []}, (Path("a.json"), Path("b.json")))
    assert "no measurement in common" in empty


def test_a_folder_that_cannot_hold_a_report_is_refused(tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(InputError, match="cannot hold the report"):
        record.check_folder(tmp_path / "file")
    record.check_folder(tmp_path / "new" / "folder")
    assert list((tmp_path / "new" / "folder").iterdir()) == []


def test_records_are_plain_json(kept):
    assert json.loads(json.dumps(kept)) == kept


def test_runs_of_one_machine_are_merged(kept):
    later = copy.deepcopy(kept)
    later["rows"] = [row(frame_ms_median=1.0), row(case="10M")]
    later["machine"] |= {"skipped": [], "incomplete": "stopped after 2 of 9 measurements"}
    merged = record.merged({Path("a.json"): kept, Path("b.json"): later})
    assert [each["case"] for each in merged["rows"]] == ["1M", "1M", "meadow, 1 sample", "10M"]
    assert merged["rows"][0]["frame_ms_median"] == 1.0
    assert merged["machine"]["skipped"] == kept["machine"]["skipped"]
    assert merged["machine"]["incomplete"] == "stopped after 2 of 9 measurements"
    later["machine"]["driver"] = "another"
    with pytest.raises(InputError, match=r"--from: the files must be of one driver \(got another, llvmpipe\)"):
        record.merged({Path("a.json"): kept, Path("b.json"): later})


def test_a_report_made_again_shows_the_pictures_it_had(kept, tmp_path):
    picture = np.full((9, 16, 3), 90, np.uint8)
    write_report(tmp_path, kept, {"reference": picture, "visibility-buffer, meadow, 1 sample": picture})
    before = (tmp_path / "report.md").read_text(encoding="utf-8")
    write_report(tmp_path, kept, None)
    assert (tmp_path / "report.md").read_text(encoding="utf-8") == before


def test_pictures_of_variants_have_plain_names():
    from greensward.bench.report import _file, _worth_showing

    name = "expanded-roots[storage=texture-array,extra_blades=2]"
    captions = [f"{name}, meadow, {count} samples" for count in (4, 16)] + ["visibility-buffer, meadow, 4 samples"]
    assert list(_worth_showing(dict.fromkeys(captions))) == captions[1:]
    assert _file(captions[0]) == "expanded-roots-storage-texture-array-extra_blades-2"
    assert _file(captions[2]) == "visibility-buffer"
