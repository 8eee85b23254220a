"""`greensward study`."""

import contextlib
import csv
import json
import os
import signal
import subprocess
import sys
import urllib.request

import pytest

pytest.importorskip("sqlalchemy")

_STUDY = """
title = "T"
consent = "C"
size = [64, 64]
[[picture]]
name = "hill"
scene = "small.toml"
samples = 1
[[question]]
name = "good"
kind = "score"
text = "Is it?"
show = ["hill"]
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "study.toml").write_text(_STUDY)
    (tmp_path / "small.toml").write_text("[sowing]\ndensity_per_m2 = 5\nreach_m = 10\n[shadows]\nenabled = false\n")
    return tmp_path


def _run(*arguments, cwd):
    command = [sys.executable, "-m", "greensward.cli", "study", *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True)


@contextlib.contextmanager
def _started(command):
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def _refused(*arguments, cwd):
    ended = _run(*arguments, cwd=cwd)
    assert ended.returncode == 2, ended
    assert "Traceback" not in ended.stderr
    return ended.stderr


def test_a_new_study_is_drawn_served_and_reported(folder):
    drawn = _run("render", folder, cwd=folder)
    assert drawn.stdout.endswith("drew 1 of 1 pictures\n"), drawn
    assert _run("render", folder, cwd=folder).stdout.endswith("drew 0 of 1 pictures\n")
    command = [sys.executable, "-m", "greensward.cli", "study", "serve", str(folder), "--port", "0"]
    with _started(command) as server:
        line = server.stdout.readline()
        assert line.endswith(" shows the study; Ctrl+C ends it\n"), server.stderr.read()
        with urllib.request.urlopen(line.split()[0]) as page:
            assert b"<h1>T</h1>" in page.read()
        busy = _refused("serve", folder, "--port", line.split()[0].rpartition(":")[2], cwd=folder)
        assert "choose another --port or --host" in busy
        server.send_signal(signal.SIGINT)
        said = server.communicate(timeout=20)[1]
    assert (said, server.returncode) == ("", 130)
    reported = _run("report", folder, cwd=folder)
    assert reported.stdout == f"{folder / 'report' / 'report.html'}: 0 people, 0 answers\n", reported
    exported = _run("export", folder, "-o", folder / "a.csv", cwd=folder)
    assert exported.stdout == f"{folder / 'a.csv'}: 0 answers of 0 people\n", exported
    assert (folder / "a.csv").read_text().startswith("person,")


def test_a_study_begins_from_a_template_or_a_shipped_one(tmp_path):
    for like in ((), ("--like", "tillman2013-first")):
        name = f"s{len(like)}"
        assert _run("new", name, *like, cwd=tmp_path).stdout.startswith(f"Wrote {name}{os.sep}study.toml. Change it")
    listed = _run("list", cwd=tmp_path).stdout
    assert "tillman2013-second: Rendering grass in computer graphics (17 questions)" in listed


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (
            ("render", "tilman"),
            "no such folder, and no study has this name; those that come along are tillman2013-first",
        ),
        (("new", ".", "--like", "x"), "must be one of tillman2013-first, tillman2013-second (got x)"),
        (("new", "."), "is not empty; name a folder that is new or empty"),
        (("serve", ".", "--database", "mysql://x"), "--database: must be an address such as postgresql"),
        (("export", ".", "-o", "a.xls"), "a.xls"),
        (("serve", ".", "--export-static", "out"), "--export-static and --endpoint are given together"),
        (("serve", ".", "--export-static", "out", "--endpoint", "ftp://x"), "must be an address such as https"),
        (("serve", ".", "--export-static", ".", "--endpoint", "https://x.org/a"), ".: is not empty; name a folder"),
        (("import", ".", "none.jsonl"), "none.jsonl: no such file"),
        (("import", ".", "small.toml"), "small.toml: line 1: the message is not one of a page"),
    ],
)
def test_what_is_wrong_is_said_in_a_sentence(folder, arguments, problem):
    assert problem in _refused(*arguments, cwd=folder)


def test_problems_of_the_study_name_its_file_and_key(folder):
    (folder / "study.toml").write_text(_STUDY.replace('kind = "score"', 'kind = "scores"'))
    assert f"{folder / 'study.toml'}: question[0].kind: must be one of choice, score" in _refused(
        "render", folder, cwd=folder
    )
    (folder / "study.toml").write_text(_STUDY.replace("samples = 1", "set = { 'sky.cloud' = 1 }"))
    said = _refused("render", folder, cwd=folder)
    assert f"{folder / 'study.toml'}: picture[0].set: sky.cloud: unknown key; did you mean clouds?" in said


def test_pages_are_exported_and_their_answers_imported(folder):
    said = _run("serve", folder, "--export-static", "out", "--endpoint", "https://x.org/answers", cwd=folder).stdout
    assert "index.html: 7 files; their answers go to https://x.org/answers\n" in said
    page = (folder / "out" / "index.html").read_text()
    assert "connect-src 'self' https://x.org; form-action 'none'" in page
    assert "hill" not in page  # what a picture shows is not told
    data = json.loads(page.partition('id="data">')[2].partition("</script>")[0])
    message = {"plan": data["plan"], "code": "ABCD-EFGH-JKMN-PQRS", "seed": 1, "language": "en"}
    at = "2026-05-01T10:00:00.000Z"
    sent = {"begun": at, "sent": at, "answers": {"good.0": {"values": ["4"], "other": "", "seconds": 2.5, "at": at}}}
    bad = {"good.0": {"values": ["9"], "at": at}}
    lines = [json.dumps(message | sent), "", json.dumps(message | sent | {"answers": bad})]
    (folder / "sent.jsonl").write_text("\n".join(lines))
    problem = "sent.jsonl: line 3: the message has an answer that is not offered: good.0"
    assert problem in _refused("import", folder, "sent.jsonl", cwd=folder)
    assert not (folder / "answers.db").exists()
    (folder / "sent.jsonl").write_text("\n".join(lines[:1] * 2))
    assert _run("import", folder, "sent.jsonl", cwd=folder).stdout == f"{folder}: new answers: 1; people in all: 1\n"
    _run("export", folder, "-o", "a.csv", cwd=folder)
    rows = list(csv.DictReader((folder / "a.csv").read_text(encoding="utf-8-sig").splitlines()))
    assert [(row["value"], row["begun"], row["at"]) for row in rows] == [
        ("4", *["2026-05-01T10:00:00.000+00:00"] * 2)
    ]
