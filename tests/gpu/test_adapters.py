"""Opening a context: which adapter is chosen, and what is said when there is none."""

import ctypes
import sys
from types import SimpleNamespace
from typing import Any

import moderngl
import pytest

import greensward.gpu.adapters
from greensward.gpu.adapters import INSTALL, Adapter, adapters, driver_name, is_software, open_context
from greensward.scene.errors import GreenswardError, InputError

CPU, GPU, OLD = Adapter(0, "software", True), Adapter(1, "NVIDIA", False), Adapter(2, "/dev/dri/card0", False)

SOFTWARE = pytest.mark.skipif(not any(each.software for each in adapters()), reason="no software driver here")


class FakeDrivers:
    """Stands in for moderngl.create_context: which device offers which version."""

    def __init__(self, versions: dict[int | None, int]) -> None:
        self.versions = versions
        self.tried: list[int | None] = []

    def __call__(self, require: int, device_index: int | None = None, **_: Any) -> Any:
        self.tried.append(device_index)
        offered = self.versions.get(device_index, 0)
        if offered < require:
            raise Exception("eglCreateContext failed (0x3009)")
        return SimpleNamespace(version_code=offered, device=device_index, release=lambda: None)


@pytest.fixture
def drivers(monkeypatch: pytest.MonkeyPatch) -> FakeDrivers:
    """A machine with a software driver, a GPU, and a GPU that is too old."""
    fake = FakeDrivers({0: 450, 1: 460, 2: 330})
    monkeypatch.setattr(moderngl, "create_context", fake)
    monkeypatch.setattr(greensward.gpu.adapters, "adapters", lambda: [CPU, GPU, OLD])
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("GREENSWARD_DEVICE", raising=False)
    return fake


@SOFTWARE
def test_a_real_context_is_told_apart() -> None:
    ctx = open_context("cpu")
    try:
        assert ctx.version_code >= 430
        assert is_software(ctx)
        assert driver_name(ctx).startswith("llvmpipe (LLVM ")
        assert any(each.software for each in adapters())
        assert ctx.error == "GL_NO_ERROR"
    finally:
        ctx.release()


@pytest.mark.parametrize(
    ("device", "variable", "opened"),
    [
        ("auto", None, 1),
        ("auto", "", 1),
        ("cpu", None, 0),
        ("0", None, 0),
        ("1", None, 1),
        ("auto", "cpu", 0),
        ("auto", "0", 0),
        ("1", "cpu", 1),
    ],
)
def test_a_gpu_is_preferred_unless_told_otherwise(
    drivers: FakeDrivers, monkeypatch: pytest.MonkeyPatch, device: str, variable: str | None, opened: int
) -> None:
    if variable is not None:
        monkeypatch.setenv("GREENSWARD_DEVICE", variable)
    assert open_context(device).device == opened  # type: ignore[attr-defined]
    assert drivers.tried == [opened]


def test_a_gpu_that_cannot_draw_is_passed_over(drivers: FakeDrivers) -> None:
    drivers.versions[1] = 0
    assert open_context().device == 0  # type: ignore[attr-defined]


@pytest.mark.parametrize("device", ["3", "-1", "gpu", "1.0"])
def test_a_device_that_is_not_there_is_refused_with_the_list(drivers: FakeDrivers, device: str) -> None:
    with pytest.raises(InputError) as error:
        open_context(device)
    assert str(error.value) == (
        'device: must be "auto", "cpu" or the index of one of 0 (software), 1 (NVIDIA), 2 (/dev/dri/card0) '
        f'(got "{device}")'
    )
    assert not drivers.tried


def test_cpu_without_a_software_driver_tells_how_to_get_one(
    drivers: FakeDrivers, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(greensward.gpu.adapters, "adapters", lambda: [GPU])
    with pytest.raises(InputError, match=INSTALL):
        open_context("cpu")
    assert not drivers.tried


def test_opengl_below_4_3_is_said_in_one_sentence(drivers: FakeDrivers) -> None:
    with pytest.raises(GreenswardError) as error:
        open_context("2")
    assert str(error.value) == (
        "device 2 (/dev/dri/card0) offers OpenGL 3.3 and greensward needs 4.3: update the graphics driver, "
        "or draw on the CPU with GREENSWARD_DEVICE=cpu"
    )
    drivers.versions = {0: 330}
    with pytest.raises(GreenswardError) as error:
        open_context("cpu")
    assert str(error.value) == (
        "device 0 (software) offers OpenGL 3.3 and greensward needs 4.3: update the graphics driver"
    )


def test_a_driver_that_does_not_start_tells_what_to_install(drivers: FakeDrivers) -> None:
    drivers.versions = {}
    with pytest.raises(GreenswardError, match=f"device 0 .* cannot be started .*: {INSTALL}$"):
        open_context("cpu")
    with pytest.raises(GreenswardError, match=r"device 1 .*or draw on the CPU with GREENSWARD_DEVICE=cpu$"):
        open_context()
    assert drivers.tried[-6:] == [1, 1, 2, 2, 0, 0]


def test_no_egl_library_tells_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(greensward.gpu.adapters, "_EGL", "libEGL-that-is-missing.so.1")
    with pytest.raises(GreenswardError, match=f"is missing; on Debian or Ubuntu: {INSTALL}$") as error:
        open_context()
    assert error.value.exit_code == 1


def test_no_driver_behind_the_library_tells_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    class Empty:
        def __init__(self, _name: str, _mode: int = 0) -> None:
            self.eglGetProcAddress = lambda _name: None

    monkeypatch.setattr(ctypes, "CDLL", Empty)
    with pytest.raises(GreenswardError, match=f"^no OpenGL driver is installed; .*: {INSTALL}$"):
        open_context()


def test_macos_is_told_at_start(drivers: FakeDrivers, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "darwin")
    with pytest.raises(GreenswardError, match=r"^macOS offers OpenGL 4\.1 at most and greensward needs 4\.3"):
        open_context()
    assert not drivers.tried


def test_windows_takes_its_one_driver(drivers: FakeDrivers, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "win32")
    drivers.versions[None] = 460
    assert open_context().version_code == 460
    with pytest.raises(InputError, match=r'must be "auto" on this system, which has one driver \(got "cpu"\)'):
        open_context("cpu")
    drivers.versions[None] = 110
    with pytest.raises(GreenswardError, match="install or update the graphics card's driver"):
        open_context()


@pytest.mark.parametrize(
    ("renderer", "name", "software"),
    [
        ("llvmpipe (LLVM 15.0.6, 256 bits)", "llvmpipe (LLVM 15.0.6, 256 bits)", True),
        ("NVIDIA H200/PCIe/SSE2", "NVIDIA H200", False),
        ("Mesa Intel(R) UHD Graphics 620 (KBL GT2)", "Intel UHD Graphics 620 (KBL GT2)", False),
        ("Google SwiftShader", "Google SwiftShader", True),
        ("zink Vulkan 1.3(llvmpipe (LLVM 19.1.7, 256 bits))", None, True),
        ("GDI Generic", "GDI Generic", True),
        ("Microsoft Basic Render Driver", "Microsoft Basic Render Driver", True),
    ],
)
def test_drivers_have_short_names(renderer: str, name: str | None, software: bool) -> None:
    ctx: Any = SimpleNamespace(info={"GL_RENDERER": renderer})
    assert driver_name(ctx) == (name or renderer)
    assert is_software(ctx) is software
