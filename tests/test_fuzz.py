"""Damaged and hostile input at random: a small part of what `scripts/fuzz.py` tries."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="it watches processes as Linux tells"),
]


@pytest.mark.parametrize(("kind", "count"), [("scenes", 5), ("files", 60), ("commands", 14), ("kills", 2)])
def test_whatever_comes_is_taken_or_refused_in_a_sentence(kind: str, count: int, tmp_path: Path) -> None:
    results = tmp_path / "fuzz.json"
    ended = subprocess.run(
        [sys.executable, ROOT / "scripts" / "fuzz.py", f"--{kind}", str(count), "-o", results],
        env={**os.environ, "PYTHONPATH": str(ROOT / "src")},
        capture_output=True,
        text=True,
    )
    found = json.loads(results.read_text(encoding="utf-8")) if results.exists() else {"counts": {}}
    assert sum(found["counts"].get(kind, {}).values()) == count, ended.stderr
    assert ended.returncode == 0, ended.stdout


def test_a_case_can_be_run_again_alone() -> None:
    said = [
        subprocess.run(
            [sys.executable, ROOT / "scripts" / "fuzz.py", "--only", "files:5", "--seed", "2"],
            env={**os.environ, "PYTHONPATH": str(ROOT / "src")},
            capture_output=True,
            text=True,
            check=True,
        ).stdout.partition('"read_s"')[0]
        for _ in range(2)
    ]
    assert said[0]
    assert said[0] == said[1]
