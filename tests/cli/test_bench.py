"""`greensward bench`: what it prints, writes and refuses."""

import json

import pytest

from greensward.cli import main


@pytest.fixture
def bench(monkeypatch, capsys, tmp_path):
    """Runs the command in a folder of its own: exit code, standard output, standard error."""
    monkeypatch.chdir(tmp_path)

    def run(*args):
        with pytest.raises(SystemExit) as left:
            main(["bench", *args])
        told = capsys.readouterr()
        return left.value.code or 0, told.out, told.err

    return run


TOY = ("--scale", "toy", "--frames", "2", "--no-quality", "--device", "cpu")


def test_the_workloads_are_listed(bench):
    code, out, err = bench("--list")
    assert (code, err) == (0, "")
    assert "blade-count (quick): " in out
    assert "9,144,576 roots" in out


def test_a_run_writes_json_and_report(bench, tmp_path):
    asked = (
        "habel2007-half-screen",
        "--techniques",
        "visibility-buffer,expanded-roots[extra_blades=2,fade=0.5]",
        *TOY,
    )
    code, out, err = bench(*asked, "--json", "a.json", "--report", "told/here")
    assert code == 0
    assert out == "told/here: habel2007-half-screen.webp, report.html, report.md\n"
    assert err == ""
    kept = json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))
    assert list(kept) == ["machine", "rows"]
    assert kept["machine"]["incomplete"] is None
    assert [row["technique"] for row in kept["rows"]] == [
        "visibility-buffer",
        "expanded-roots[extra_blades=2,fade=0.5]",
    ]

    code, out, err = bench("--from", "a.json")
    assert (code, err) == (0, "")
    assert "## habel2007-half-screen" in out
    assert bench("--from", "a.json", "--from", "a.json", "--report", "again", "--json", "b.json")[0] == 0
    assert json.loads((tmp_path / "b.json").read_text(encoding="utf-8"))["rows"] == kept["rows"]
    code, out, err = bench("--compare", "a.json", "a.json")
    assert (code, err) == (0, "")
    assert "too few frames" in out


def test_what_was_not_measured_is_said(bench):
    quick = ("--frames", "2", "--no-quality", "--device", "cpu", "--sizes", "16x9")
    code, _, err = bench("tillman2013-limit", "--techniques", "visibility-buffer", *quick)
    assert code == 0
    assert err == "Not measured: tillman2013-limit, visibility-buffer, 9,144,576 roots: takes long: --scale full\n"


def test_settings_of_a_variant_are_checked(bench):
    code, _, err = bench("blade-count", "--techniques", "expanded-roots[storage=disk]", *TOY)
    assert code == 2
    assert "--techniques: expanded-roots: storage: must be one of vertex-buffer, texture-array" in err


@pytest.mark.slow
def test_without_files_the_tables_are_printed(bench):
    code, out, _ = bench("blade-count", "--techniques", "instanced-strips", "--sizes", "16x9", *TOY)
    assert code == 0
    assert "| 1M | instanced-strips | 16×9 |" in out


def test_a_lost_device_is_an_honest_partial_report(bench, monkeypatch, tmp_path):
    from greensward.bench import suite

    def lost(*_):
        raise suite.DeviceLostError("the driver stopped drawing (GL_CONTEXT_LOST)")

    monkeypatch.setattr(suite, "measure", lost)
    asked = ("habel2007-half-screen", "--techniques", "visibility-buffer", *TOY)
    code, _, err = bench(*asked, "--json", "a.json", "--report", "told")
    assert code == 1
    assert err.startswith("Incomplete: the driver stopped drawing (GL_CONTEXT_LOST) after 0 of 1 measurements")
    assert "Incomplete: " in (tmp_path / "told" / "report.md").read_text(encoding="utf-8")
    assert json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))["machine"]["incomplete"]


@pytest.mark.parametrize(
    ("args", "told"),
    [
        (("nothing",), "workload: must be one of"),
        (("--techniques", "strips"), "--techniques: must be one of"),
        (("--camera-path", "walk.toml"), "walk.toml: no such file"),
        (("--frames", "0"), "must be a whole number from 1"),
        (("--sizes", "640x360,0x0"), "must be WIDTHxHEIGHT"),
        (("--protocol", "slow"), "must be one of quick, thesis"),
        (("--scale", "huge"), "must be one of quick, full, toy"),
        (("--json", "a.txt"), "must end in one of .json"),
        (("--json", "nowhere/a.json"), "there is no folder nowhere"),
        (("--compare", "a.json", "b.json"), "a.json: no such file"),
        (("--from", "a.json"), "a.json: no such file"),
        (("blade-count", "--from", "a.json"), "leave out what to measure"),
        (("--compare", "a.json", "b.json", "--from", "a.json"), "must stand alone"),
        (("--from", "a.json", "--report", "told"), "a.json: no such file"),
        (("nothing", "--report", "told"), "workload: must be one of"),
        (("--device", "77"), "device: must be"),
    ],
    ids=str,
)
def test_bad_usage_is_one_sentence_and_nothing_is_written(bench, tmp_path, args, told):
    code, out, err = bench(*args)
    assert code == 2
    assert out == ""
    assert told in err
    assert "Traceback" not in err
    assert list(tmp_path.iterdir()) == []
