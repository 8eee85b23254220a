"""`greensward info`: what it tells where drawing works, and where it does not."""

import json
import platform

import pytest
import typer

from greensward import __version__
from greensward.cli.info import info
from greensward.gpu import adapters
from greensward.gpu.adapters import INSTALL
from greensward.gpu.device import Device


def _run(as_json: bool, capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    with pytest.raises(typer.Exit) as left:
        info(as_json)
    told = capsys.readouterr()
    assert told.err == ""
    return left.value.exit_code, told.out


@pytest.fixture(autouse=True)
def _cpu(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GREENSWARD_DEVICE", "cpu")


def test_json_tells_the_driver_and_what_works(capsys: pytest.CaptureFixture[str]) -> None:
    code, text = _run(True, capsys)
    told = json.loads(text)
    assert code == 0
    assert (told["version"], told["python"]) == (__version__, platform.python_version())
    assert told["works"] is True
    assert told["problem"] is None
    assert told["driver"]["software"] is True
    assert told["driver"]["name"].startswith("llvmpipe")
    assert float(told["driver"]["opengl"]) >= 4.3
    assert told["libraries"]["moderngl"].startswith("5.")
    assert any(device["software"] for device in told["devices"])
    works = {feature["name"]: feature["works"] for feature in told["features"]}
    assert works["tessellation"]
    assert works["compute shaders"]
    assert not works["64-bit atomics"]
    assert works["program binaries kept between processes"] == Device.shared("cpu").programs.keeps_binaries
    assert all(feature["works"] or feature["fix"] for feature in told["features"])
    assert told["limits"]["texture size"] >= 16384
    assert all(value > 0 for value in told["limits"].values())


def test_text_names_the_driver_and_every_fix(capsys: pytest.CaptureFixture[str]) -> None:
    code, text = _run(False, capsys)
    assert code == 0
    assert text.startswith(f"greensward {__version__}, Python ")
    assert "drawing on llvmpipe" in text
    assert "no   a GPU: drawing is on the CPU" in text
    assert all(len(line) < 220 for line in text.splitlines())


@pytest.mark.parametrize("as_json", [True, False])
def test_where_nothing_can_be_drawn_it_tells_the_fix_and_fails(
    as_json: bool, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(adapters, "_EGL", "libEGL-that-is-missing.so.1")
    code, text = _run(as_json, capsys)
    assert code == 1
    assert INSTALL in text
    if as_json:
        told = json.loads(text)
        assert told["works"] is False
        assert told["driver"] is None
    else:
        assert "Nothing can be drawn here: " in text


def test_a_device_that_is_not_there_is_told_beside_those_that_are(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GREENSWARD_DEVICE", "77")
    code, text = _run(True, capsys)
    told = json.loads(text)
    assert code == 1
    assert told["devices"]
    assert 'got "77"' in told["problem"]
