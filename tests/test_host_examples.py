"""The examples for hosts run in real windows, which change their size; and a host's data set draws what it says."""

import ctypes
import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import greensward as gs

EXAMPLES = Path(__file__).parents[1] / "examples" / "hosts"
SIZE = 320, 180
# how each window gets another size after its first frame
RESIZED = {
    "glfw": ("glfw", "import glfw; glfw.set_window_size(glfw.get_current_context(), 320, 180)"),
    "moderngl_window": ("moderngl_window", "import moderngl_window; moderngl_window.window().size = 320, 180"),
    "pyglet": ("pyglet", "import pyglet; next(iter(pyglet.app.windows)).set_size(320, 180)"),
    "pygame": (
        "pygame",
        "import pygame; pygame.display.set_mode((320, 180), pygame.display.get_surface().get_flags())",
    ),
    "pyside6": (
        "PySide6",
        "from PySide6 import QtCore, QtWidgets; "
        "QtCore.QTimer.singleShot(0, lambda: QtWidgets.QApplication.topLevelWidgets()[0].resize(320, 180))",
    ),
    "pyvista": (
        "pyvista",
        "import pyvista as pv; update = pv.Plotter.update; "
        "pv.Plotter.update = lambda p, **o: (setattr(p, 'window_size', (320, 180)), update(p, **o))",
    ),
    "panda3d": (
        "panda3d.core",
        "from panda3d.core import WindowProperties; base.win.requestProperties(WindowProperties(size=(320, 180)))",
    ),
}
CHATTER = re.compile(
    r"""\S+\ \S+\ -\ moderngl_window\S*\ -\ INFO\ .*
    | Known\ pipe\ types:|\ +glxGraphicsPipe|\(\d+\ aux\ display\ modules\ not\ yet\ loaded\.\)
    | Xlib:\ +extension\ "XFree86-DGA"\ missing.*
    | :device\(error\):.*inotify.*|:device\(error\):.*/dev/input.*
    | QStandardPaths:\ .*|qt\.qpa\.\S+:\ .*""",
    re.VERBOSE,
)
DRIVEN = """
import runpy, sys
import greensward as gs
drawn = gs.Renderer.draw_eyes
def draw_eyes(self, *eyes, **how):
    gs.Renderer.draw_eyes = drawn
    drawn(self, *eyes, **how)
    {resize}
gs.Renderer.draw_eyes = draw_eyes
sys.argv = ["", "--size", "96x60", "--frames", "4", "-o", sys.argv[1]]
runpy.run_path({path!r}, run_name="__main__")
"""


def python(display: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(EXAMPLES), *sys.path])
    return subprocess.run(
        [sys.executable, *arguments],
        env={**os.environ, "PYTHONPATH": path, "DISPLAY": display, "QT_QPA_PLATFORM": "xcb"},
        capture_output=True,
        text=True,
        timeout=300,
    )


def test_every_example_is_tested():
    programs = {path.stem for path in EXAMPLES.glob("*.py")}
    assert programs == {f"in_{host}" for host in RESIZED} | {"shared", "dataset"}


def skip_without_what_qt_loads() -> None:
    try:
        for name in ("libxcb-cursor.so.0", "libxcb-icccm.so.4", "libxcb-keysyms.so.1", "libxkbcommon-x11.so.0"):
            ctypes.CDLL(name)
    except OSError as error:
        pytest.skip(f"{error}: docs/hosts.md lists what PySide6 needs")


def has_brick(picture: np.ndarray) -> np.ndarray:
    red, green, blue = np.moveaxis(picture, -1, 0)
    return (red > 1.8 * green) & (red > 1.8 * blue) & (red > 45)


@pytest.mark.slow
@pytest.mark.parametrize("host", RESIZED)
def test_grass_stands_before_and_behind_what_the_host_draws(display, tmp_path, host):
    package, resize = RESIZED[host]
    pytest.importorskip(package, reason="the extra hosts is not installed", exc_type=ImportError)
    if host == "pyside6":
        skip_without_what_qt_loads()
    code = DRIVEN.format(resize=resize, path=str(EXAMPLES / f"in_{host}.py"))
    done = python(display, "-c", code, str(tmp_path / "seen.png"))
    assert done.returncode == 0, done.stderr
    assert [line for line in done.stderr.splitlines() if line and not CHATTER.fullmatch(line)] == []
    with Image.open(tmp_path / "seen.png") as image:
        assert image.size == SIZE
        picture = np.asarray(image.convert("RGB")).astype(float)
    halves = (picture[:, :160], picture[:, 160:]) if host == "moderngl_window" else (picture,)
    for half in halves:
        sky, meadow = half[:40], half[120:]
        assert (sky[..., 2] >= sky[..., 0] - 2).mean() > 0.8  # clouds are white
        assert sky[..., 2].mean() > sky[..., 0].mean() + 10
        assert 150 < sky.mean() < 240
        red, green, blue = meadow.mean(axis=(0, 1))
        assert green > red > blue + 15
        assert meadow[..., 1].std() > 15
        brick = has_brick(half)
        rows, columns = (np.flatnonzero(brick.sum(axis=axis) > 6) for axis in (1, 0))
        top, bottom = rows[0], rows[-1]
        assert 60 < top < 85
        assert 100 < bottom < 145
        assert abs(columns.mean() - half.shape[1] / 2) < 15
        inside = brick[:, columns[0] + 4 : columns[-1] - 3]
        assert inside[(3 * top + bottom) // 4 + 1 : (top + bottom) // 2].mean() > 0.85  # above the grass
        assert 0.05 < inside[bottom - 8 : bottom + 1].mean() < 0.9  # blades before it hide its foot


@pytest.mark.slow
def test_items_of_a_data_set_are_the_same_in_every_process(monkeypatch, tmp_path):
    out = tmp_path / "sheet.png"
    done = python(
        "", str(EXAMPLES / "dataset.py"), "--size", "64x36", "--items", "3", "--workers", "1", "-o", str(out)
    )
    assert (done.returncode, done.stderr) == (0, "")
    monkeypatch.syspath_prepend(str(EXAMPLES))
    names = runpy.run_path(str(EXAMPLES / "dataset.py"))
    items = names["Meadows"](names["meadow"](), 3, (64, 36))
    with Image.open(out) as image:
        sheet = np.asarray(image)
    for item in (2, 0, 1):
        picture, classes, depth = items[item]
        assert (picture.shape, picture.dtype) == ((3, 36, 64), np.float32)
        assert (classes.shape, classes.dtype) == ((36, 64), np.int64)
        assert (depth.shape, depth.dtype) == ((36, 64), np.float32)
        shown = sheet[:, 64 * item : 64 * item + 64]
        assert np.array_equal(shown[:36], np.round(255 * picture.transpose(1, 2, 0)))
        assert np.array_equal(shown[36:, :, 0] == 255, classes == gs.SurfaceClass.GRASS)
        assert 0.2 < (classes == gs.SurfaceClass.GRASS).mean() < 0.9
    # a loader counts the items, ends where they end, and sends the data set to its workers
    assert len(items) == 3
    with pytest.raises(IndexError):
        items[3]
    assert items.__getstate__()["renderer"] is None
    items.renderer.release()
