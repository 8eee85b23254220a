"""One device for all tests that draw, current and without an error around each; GREENSWARD_DEVICE chooses it."""

import ctypes
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from typing import Any

import hypothesis
import moderngl
import numpy as np
import numpy.typing as npt
import pytest

from greensward import renderer as renderers
from greensward import techniques
from greensward.gpu import programs
from greensward.gpu.adapters import open_context
from greensward.gpu.device import Device
from greensward.gpu.programs import CACHE_VARIABLE
from greensward.ground import HeightField
from greensward.ground.ground_gpu import GroundGpu
from greensward.io.meshes import TriMesh
from greensward.library import as_scene
from greensward.motion import colliders
from greensward.objects.packing import packed
from greensward.passes.sky import Sky
from greensward.renderer import Renderer
from greensward.scene import Scene
from greensward.sowing import Field
from small_scenes import COARSE_PX

os.environ.setdefault("GREENSWARD_DEVICE", "cpu")
# `--hypothesis-profile=thorough` tries more
for name, examples in (("quick", 60), ("thorough", 600)):
    hypothesis.settings.register_profile(
        name, max_examples=examples, deadline=None, suppress_health_check=list(hypothesis.HealthCheck)
    )
hypothesis.settings.load_profile("quick")
# the user's own is left alone; processes of one run share this
if CACHE_VARIABLE not in os.environ:
    _PROGRAMS = tempfile.TemporaryDirectory(prefix="greensward-tests-")
    os.environ[CACHE_VARIABLE] = _PROGRAMS.name
# tests ask for more kinds of programs than a user's session, and for the same ones again
programs._MOST_IDLE = 2048
_RUN = os.environ[CACHE_VARIABLE]
_forget_oldest = programs.Binaries._forget_oldest


def _forget_oldest_of_others(binaries: programs.Binaries) -> None:
    """All that a run compiles is kept for its other processes, and not counted after each; tests have folders too."""
    if str(binaries._folder.parent) != _RUN:
        _forget_oldest(binaries)


programs.Binaries._forget_oldest = _forget_oldest_of_others  # type: ignore[method-assign]
_SKIES: dict[object, tuple[bytes, bytes]] = {}
_fill_sky = Sky.fill


def _filled_sky(sky: Sky) -> None:
    """Fill the table as it was filled for the same light before: drawing it takes as long as a small picture."""
    block = sky._pass.shader._bindings["Light"]
    light: object = sky._pass.stage, block.uploaded().read()
    if light not in _SKIES:
        _fill_sky(sky)
        _SKIES[light] = sky._table.read(), sky._light.buffer.read()
        return
    table, summed = _SKIES[light]
    sky._table.write(table)
    sky._light.buffer.write(summed)


Sky.fill = _filled_sky  # type: ignore[method-assign]


_PACKED: dict[tuple[bytes, bytes, int], npt.NDArray[np.float64]] = {}


def _packed(mesh: TriMesh, most: int = 64) -> npt.NDArray[np.float64]:
    """Pack a mesh with balls once: the same mesh always gets the same ones."""
    key = mesh.positions.tobytes(), mesh.triangles.tobytes(), most
    if key not in _PACKED:
        _PACKED[key] = packed(mesh, most)
    return _PACKED[key]


colliders.packed = _packed  # type: ignore[attr-defined]


@pytest.fixture(scope="session")
def display() -> Iterator[str]:
    """The name of an X server of our own, without a screen."""
    if not shutil.which("Xvfb"):
        pytest.skip("Xvfb is not installed: sudo apt install xvfb")
    read, write = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x800x24", "-nolisten", "tcp", "-noreset"],
        pass_fds=[write],
        stderr=subprocess.DEVNULL,
    )
    os.close(write)
    with os.fdopen(read) as pipe:
        number = pipe.readline().strip()
    assert number, "Xvfb did not start"
    yield f":{number}"
    server.terminate()
    server.wait()


@pytest.fixture(scope="session")
def session_ctx() -> Iterator[moderngl.Context]:
    ctx = open_context()
    yield ctx
    ctx.release()


@pytest.fixture(scope="session")
def resting_place(session_ctx: moderngl.Context) -> moderngl.Framebuffer:
    """What is bound when a test starts; a headless context has no screen."""
    with session_ctx:
        return session_ctx.simple_framebuffer((1, 1))


@pytest.fixture
def ctx(session_ctx: moderngl.Context, resting_place: moderngl.Framebuffer) -> Iterator[moderngl.Context]:
    """The shared context; a test that leaves an OpenGL error behind fails."""
    with session_ctx:  # whoever released or left another context since left none current
        assert session_ctx.error == "GL_NO_ERROR"
        resting_place.use()  # what the test before left bound may be gone
        yield session_ctx
        assert session_ctx.error == "GL_NO_ERROR"


@pytest.fixture
def device(ctx: moderngl.Context) -> Device:
    """The device of the shared context, whose programs all tests share; its host has bound textures of its own."""
    device = Device.of(ctx)
    # a program that a test before left current may be deleted, and is gone for good once another is
    device.function("glUseProgram", None, ctypes.c_uint)(0)
    device.units[:] = [None] * len(device.units)
    return device


@pytest.fixture
def renderer(device: Device) -> Iterator[Callable[..., Renderer]]:
    """Makes renderers in the shared context, of small pictures, and releases them afterwards."""
    made: list[Renderer] = []

    def make(scene: Scene, **options: Any) -> Renderer:
        made.append(Renderer(scene, **{"size": (160, 90), "ctx": device.ctx, **options}))
        return made[-1]

    yield make
    for each in made:
        each.release()


@pytest.fixture
def sow(device: Device) -> Iterator[Callable[..., Field]]:
    """Sows a scene's field around a focus; without one, around a point on the ground below the origin."""
    made: list[Field | GroundGpu] = []

    def make(scene: Scene, focus: npt.ArrayLike = (0.0, 0.0, 0.0), slack_m: float = 0.0) -> Field:
        ground = GroundGpu(device, scene, HeightField.of(scene))
        field = Field(device, scene, ground)
        made.extend((field, ground))
        field.sow(focus, slack_m)
        return field

    yield make
    for each in made:
        each.release()


@pytest.fixture
def coarse_far(monkeypatch: pytest.MonkeyPatch) -> None:
    """Billboards beyond `sowing.traced_m` have few texels."""
    monkeypatch.setattr(techniques, "_FAR", techniques._FAR.model_copy(update={"texture_px": COARSE_PX}))


@pytest.fixture
def thin_fields(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every renderer draws a thin field: programs are tried in full, but not at their price."""

    class Thin(renderers.Renderer):
        def __init__(self, scene: Any, **options: Any) -> None:
            scene = as_scene(scene)
            sowing = scene.sowing.model_copy(update={"density_per_m2": 30.0, "reach_m": 25.0})
            thin = {"sowing": sowing, "shadows": scene.shadows.model_copy(update={"size_px": 64})}
            super().__init__(scene.model_copy(update=thin), **options)

    monkeypatch.setattr(renderers, "Renderer", Thin)
