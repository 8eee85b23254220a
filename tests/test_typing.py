"""Public models type-check in an editor, without a plugin: in mypy and in pyright, which most editors run."""

import json
import os
import re
import runpy
import subprocess
import sys
import types
from pathlib import Path

import pytest

import greensward as gs

pytestmark = pytest.mark.slow
TYPING = Path(__file__).parent / "typing"
CLIENT, MISTAKES = TYPING / "client.py", TYPING / "mistakes.py"
ROOT = Path(__file__).parents[1]


def mypy(folder: Path) -> set[tuple[str, int]]:
    """The file and the line of everything that mypy finds."""
    pytest.importorskip("mypy")
    options = ["--strict", "--config-file=", f"--cache-dir={folder}", "--follow-imports=silent", "--no-error-summary"]
    command = [sys.executable, "-m", "mypy", *options, CLIENT.name, MISTAKES.name]
    environment = os.environ | {"MYPYPATH": str(ROOT / "src")}
    found = subprocess.run(command, cwd=TYPING, capture_output=True, text=True, env=environment)
    assert not found.stderr
    return {(line[1], int(line[2])) for line in re.finditer(r"^(.+):(\d+): error:", found.stdout, re.MULTILINE)}


def pyright(folder: Path) -> set[tuple[str, int]]:
    """The same of pyright, with what its strict mode calls errors."""
    pytest.importorskip("basedpyright")
    config = {"typeCheckingMode": "strict", "include": [str(TYPING)], "extraPaths": [str(ROOT / "src")]}
    (folder / "pyrightconfig.json").write_text(json.dumps(config), encoding="utf-8")
    command = [sys.executable, "-m", "basedpyright", "--project", str(folder), "--pythonpath", sys.executable]
    found = subprocess.run([*command, "--outputjson"], capture_output=True, text=True)
    diagnostics = json.loads(found.stdout)["generalDiagnostics"]
    return {
        (Path(each["file"]).name, each["range"]["start"]["line"] + 1)
        for each in diagnostics
        if each["severity"] == "error"
    }


@pytest.mark.parametrize("checker", [mypy, pyright])
def test_mistakes_are_found_and_nothing_else(checker, tmp_path):
    lines = MISTAKES.read_text(encoding="utf-8").splitlines()
    marked = {(MISTAKES.name, number) for number, line in enumerate(lines, 1) if line.endswith("# error")}
    assert checker(tmp_path) == marked


def test_what_type_checks_is_valid_at_run_time():
    client = runpy.run_path(str(CLIENT))
    assert len(client["SCENE"].object) == 5
    assert client["SCENE"].ground.texture == "soil.png"
    assert client["heights"](gs.Camera(position_m=[0, 1, 8]), client["PAINTED"]) == (1.0, (gs.Grass(),))


def test_the_client_uses_every_public_name():
    text = CLIENT.read_text(encoding="utf-8")
    groups = [name for name in gs.__all__ if isinstance(getattr(gs, name), types.ModuleType)]
    names = {f"gs.{name}" for name in gs.__all__ if name not in groups}
    names |= {f"{group}.{name}" for group in groups for name in getattr(gs, group).__all__}
    assert not {name for name in names if not re.search(rf"\b{re.escape(name)}\b", text)}
