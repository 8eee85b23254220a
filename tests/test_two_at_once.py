"""Two processes that write into one folder and share one cache: each file is whole."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from greensward.io.checkpoints import read_checkpoint

_SMALL = ("--size", "64x36", "--set", "sowing.density_per_m2=20", "--set", "sowing.reach_m=30")


def _beside_each_other(folder: Path, *commands: tuple[str, ...]) -> list[subprocess.CompletedProcess[str]]:
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(sys.path),
        "GREENSWARD_PROGRAM_CACHE": str(folder / "programs"),
    }
    running = [
        subprocess.Popen(
            [sys.executable, "-m", "greensward.cli", *command],
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for command in commands
    ]
    return [
        subprocess.CompletedProcess(process.args, process.returncode, *texts)
        for process in running
        for texts in [process.communicate(timeout=200)]
    ]


@pytest.mark.slow
def test_a_sequence_and_a_checkpoint_of_two_processes_are_whole(tmp_path):
    command = ("animate", "jahrmann2017-balls", "-o", "f/", "--seconds", "0.2", "--checkpoint", "c.npz", *_SMALL)
    alone = _beside_each_other(tmp_path, command)
    assert [each.returncode for each in alone] == [0], alone[0].stderr
    expected = {path.name: path.read_bytes() for path in (tmp_path / "f").iterdir()}
    state = read_checkpoint(tmp_path / "c.npz").state
    for path in (tmp_path / "f").iterdir():
        path.unlink()
    (tmp_path / "c.npz").unlink()
    both = _beside_each_other(tmp_path, command, command)
    assert [each.returncode for each in both] == [0, 0], [each.stderr for each in both]
    assert {path.name: path.read_bytes() for path in (tmp_path / "f").iterdir()} == expected
    again = read_checkpoint(tmp_path / "c.npz").state
    assert all(np.array_equal(again[name], value) for name, value in state.items())
    assert {path.name for path in tmp_path.iterdir()} == {"f", "c.npz", "programs"}
    assert not list((tmp_path / "programs").rglob(".new-*"))


@pytest.mark.slow
def test_a_picture_of_two_processes_is_that_of_one(tmp_path):
    commands = [("render", "meadow", "-o", "a.png", "--seed", seed, "--aov", "depth", *_SMALL) for seed in "12"]
    found = []
    for command in commands:
        assert _beside_each_other(tmp_path, command)[0].returncode == 0
        found.append((tmp_path / "a.png").read_bytes())
    assert [each.returncode for each in _beside_each_other(tmp_path, *commands)] == [0, 0]
    assert (tmp_path / "a.png").read_bytes() in found
    assert Image.open(tmp_path / "a.png").size == (64, 36)
    assert {path.name for path in tmp_path.iterdir()} == {"a.png", "a.npz", "programs"}
