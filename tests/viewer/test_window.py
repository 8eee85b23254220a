"""A window for real, on an X server without a screen; and what is said where none can open."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("imgui_bundle", reason="the extra viewer is not installed", exc_type=ImportError)
pytest.importorskip("glfw", reason="the extra viewer is not installed", exc_type=ImportError)

TESTS = Path(__file__).parents[1]


def _python(code: str, folder: Path, **env: str | None) -> subprocess.CompletedProcess[str]:
    wanted = {**os.environ, "PYTHONPATH": os.pathsep.join([str(TESTS), *sys.path]), **env}
    return subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        env={name: value for name, value in wanted.items() if value is not None},
        capture_output=True,
        text=True,
        timeout=300,
    )


DRIVEN = """
import time
from PIL import Image
import greensward as gs
from driving import Driver
from greensward.viewer import input as c
from greensward.viewer.session import Session
from greensward.viewer.window import Window

scene = gs.Scene(sowing=gs.Sowing(density_per_m2=40, reach_m=20), shadows=gs.Shadows(size_px=64, cascades=1))
window = Window("test", (960, 600))
d = Driver(window.contexts, Session("field", scene), window.size)
assert window.take() is not None
d.ready()
d.frames(6, c.Key("w"))
assert d.session.controller.position_ws[2] < 8.0
for number in "123":
    d.key("_" + number)
    frames = 0
    while d.viewer.viewports[0].busy:
        d.frames(1)
        frames += 1
    assert frames > 1, "the window stood still while the field was sown"
    d.frames(2)
    assert d.viewer.viewports[0].problems == (), d.viewer.viewports[0].problems
    assert d.viewer.viewports[0].renderer.technique_name == d.session.scene.technique.name
renderer = d.viewer.viewports[0].renderer
d.session.set_hour(9.0)
d.frames(12)
assert d.viewer.viewports[0].renderer is renderer
d.session.tool = "mow"
d.drag((200, 500), (320, 420))
d.ready()
d.key("c")
d.ready()
d.frames(8)
Image.fromarray(d.picture()).save("split.png")
d.key("c")
assert d.session.save(__import__("pathlib").Path("saved.toml"))
assert gs.load("saved.toml") == d.session.scene
d.resize((500, 300))
d.frames(3)
window.show("done")
assert window.ctx.error == "GL_NO_ERROR"
d.release()
window.close()
print("driven")
"""


@pytest.mark.slow
def test_a_window_is_driven_from_start_to_end(display, tmp_path):
    done = _python(DRIVEN, tmp_path, DISPLAY=display)
    assert done.stdout.strip() == "driven", done.stderr
    picture = np.asarray(Image.open(tmp_path / "split.png")).astype(int)
    left, right = picture[60:450, 10:280], picture[60:450, 320:590]
    assert left.std() > 10
    assert right.std() > 10


LOOP = """
import sys
from greensward.viewer import input as c, window
from greensward.viewer.session import Session

taken = window.Window.take
count = 0
def take(self, wait_s=0.0):
    global count
    count += 1
    events = taken(self, wait_s)
    return [*events, c.Key("w")] if count == 5 else [*events, c.CloseRequest()] if count == 30 else events
window.Window.take = take
window.run(Session("yan2024-random"), (320, 240))
print("left after", count)
"""


@pytest.mark.slow
def test_the_loop_runs_until_the_window_closes(display, tmp_path):
    done = _python(LOOP, tmp_path, DISPLAY=display)
    assert done.stdout.strip() == "left after 30", done.stderr


LOST = """
import os, signal
from greensward.cli import main
from greensward.viewer import application, window

drawn = application.Application.frame
count = 0
def frame(self, *args, **kwargs):
    global count
    count += 1
    if count == 3:
        self.viewer.session.change(("seed",), 7)
        {deed}
    assert count < 99
    drawn(self, *args, **kwargs)
application.Application.frame = frame
main(["view", "yan2024-random", "--size", "320x240"])
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "deed",
    [
        "raise RuntimeError('device lost')",
        "os.kill(os.getpid(), signal.SIGTERM)",
        "[signal.raise_signal(2) for _ in range(2)]",
    ],
)
def test_what_ends_it_loses_nothing(display, tmp_path, deed):
    done = _python(LOST.format(deed=deed), tmp_path, DISPLAY=display)
    assert "Traceback" not in done.stderr
    assert "yan2024-random-rescued-001.toml" in done.stderr
    assert done.returncode != 0
    assert "seed = 7" in (tmp_path / "yan2024-random-rescued-001.toml").read_text()


VIEW = 'from greensward.cli import main; main(["view", "yan2024-random"])'


@pytest.mark.slow
def test_an_old_opengl_is_reported(display, tmp_path):
    done = _python(VIEW, tmp_path, DISPLAY=display, MESA_GL_VERSION_OVERRIDE="3.3", LIBGL_ALWAYS_SOFTWARE="1")
    assert done.returncode == 1
    assert "OpenGL 4.3" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="about X and Wayland")
def test_without_a_display_it_says_what_to_do(tmp_path):
    done = _python(VIEW, tmp_path, DISPLAY=None, WAYLAND_DISPLAY=None)
    assert done.returncode == 1
    assert "there is no display" in done.stderr
    assert done.stderr.count("\n") == 1


def test_without_the_extra_it_says_what_to_install(tmp_path):
    code = f'import sys; sys.modules["imgui_bundle"] = None; sys.modules["glfw"] = None; {VIEW}'
    done = _python(code, tmp_path)
    assert done.returncode == 1
    assert 'pip install "greensward[viewer]"' in done.stderr
    assert done.stderr.count("\n") == 1


def test_an_invalid_scene_is_reported_before_a_window_opens(tmp_path):
    done = _python('from greensward.cli import main; main(["view", "meadwo"])', tmp_path, DISPLAY=None)
    assert done.returncode == 2
    assert "did you mean meadow" in done.stderr
