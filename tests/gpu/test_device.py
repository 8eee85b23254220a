"""Devices: what is asked of a context once, who shares one, and what is told where a driver lacks something."""

import ctypes
import threading
from dataclasses import fields, replace
from types import SimpleNamespace
from typing import Any

import moderngl
import numpy as np
import pytest

from greensward.gpu import device as device_module
from greensward.gpu.adapters import open_context
from greensward.gpu.device import Device, Features
from greensward.gpu.kernels import Kernel
from greensward.renderer import Renderer
from greensward.scene.errors import GreenswardError, InputError
from small_scenes import small_scene


def test_limits_are_those_of_the_driver(device: Device) -> None:
    info, limits = device.ctx.info, device.limits
    assert limits.storage_block_bytes == info["GL_MAX_SHADER_STORAGE_BLOCK_SIZE"] >= 1 << 24
    assert limits.texture_px == info["GL_MAX_TEXTURE_SIZE"] >= limits.picture_px >= 8192
    assert limits.storage_blocks.keys() == {
        "vertex", "tess_control", "tess_evaluation", "geometry", "fragment", "compute",
    }  # fmt: skip
    assert limits.storage_blocks["compute"] == info["GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS"] >= 8
    assert device.best_stage == ("fragment" if device.software else "compute")


@pytest.mark.parametrize(
    ("extensions", "features"),
    [
        (set(), Features(False, False, False)),
        ({"GL_ARB_clip_control"}, Features(True, False, False)),
        ({"GL_NV_gpu_shader5"}, Features(False, False, False)),
        ({"GL_NV_gpu_shader5", "GL_NV_shader_atomic_int64"}, Features(False, False, True)),
    ],
)
def test_features_are_found_by_extension(
    monkeypatch: pytest.MonkeyPatch, ctx: moderngl.Context, extensions: set[str], features: Features
) -> None:
    found = SimpleNamespace(version_code=ctx.version_code, info=ctx.info, mglo=ctx.mglo, extensions=extensions)
    monkeypatch.setattr(device_module, "is_software", lambda _: True)
    assert Device(ctx=found).features == features  # type: ignore[arg-type]
    assert {field.name for field in fields(Features)} == {"clip_control", "timer_queries", "wide_atomics"}


def test_an_old_context_is_refused() -> None:
    old: Any = SimpleNamespace(version_code=420)
    with pytest.raises(InputError, match=r"^ctx: must be OpenGL 4\.3 or newer \(got 4\.2\)$"):
        Device(ctx=old)


@pytest.mark.parametrize("adapter", ["no such", "99"])
def test_a_device_that_is_not_there_is_refused(adapter: str) -> None:
    with pytest.raises(InputError, match=f'^device: must be .*got "{adapter}"'):
        Device(adapter)


# Who shares one ---------------------------------------------------------------------------------------------


def test_a_context_has_one_device_for_each_way_of_its_state(ctx: moderngl.Context) -> None:
    assert Device.of(ctx) is Device.of(ctx)
    assert Device.of(ctx, preserve_state=False) is Device.of(ctx, preserve_state=False) is not Device.of(ctx)
    assert Device.of(ctx).preserves_state
    assert not Device.of(ctx, preserve_state=False).preserves_state
    assert not Device.of(ctx).headless


@pytest.mark.usefixtures("ctx")
def test_renderers_of_a_thread_share_a_device() -> None:
    shared = Device.shared()
    assert shared is Device.shared() is Device.shared("auto")
    assert shared.headless
    assert not shared.preserves_state
    found: list[Device] = []

    def draw_elsewhere() -> None:
        with Renderer(small_scene(), size=(16, 9)) as drawn:
            drawn.render()
            found.append(drawn.device)
        found[0].release()

    thread = threading.Thread(target=draw_elsewhere)
    thread.start()
    thread.join()
    assert found[0] is not shared
    with Renderer(small_scene(), size=(16, 9)) as drawn:
        assert drawn.device is shared
        drawn.render()
    compiled = shared.programs.compiled + shared.programs.loaded
    with Renderer(small_scene(), size=(16, 9)) as drawn:
        drawn.render()
    assert shared.programs.compiled + shared.programs.loaded == compiled, "nothing compiled twice"


@pytest.mark.usefixtures("ctx")
def test_the_variable_tells_which_is_shared(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []

    class Fake:
        def __init__(self, adapter: str) -> None:
            made.append(adapter)

        def make_current(self) -> None:
            pass

    monkeypatch.setattr(device_module, "_SHARED", {})
    for variable, adapter in (("3", "auto"), ("3", "cpu"), ("", "auto"), ("3", "auto")):
        monkeypatch.setenv("GREENSWARD_DEVICE", variable)
        Device.shared.__func__(Fake, adapter)  # type: ignore[attr-defined]
    assert made == ["3", "cpu", "auto"]


@pytest.mark.usefixtures("ctx")
def test_a_headless_device_is_made_current_for_each_use() -> None:
    one, two = Device(), Device()
    buffers = []
    for each, text in ((one, b"one!"), (two, b"two!")):
        with each.use():
            buffers.append(each.ctx.buffer(text))
    for each, buffer, text in ((one, buffers[0], b"one!"), (two, buffers[1], b"two!")):
        with each.use():
            assert buffer.read() == text
            buffer.release()
    for each in (one, two):
        each.release()


# State ------------------------------------------------------------------------------------------------------

_COPY = """
layout(local_size_x = 1) in;
uniform sampler2D picture;
layout(std430) buffer Result { float result; };
void main() { result = texelFetch(picture, ivec2(0), 0).r; }
"""


def test_textures_are_bound_again_after_a_use_inside_another(device: Device) -> None:
    """The inner one's bindings are undone when it ends."""
    pictures = [device.ctx.texture((1, 1), 1, np.float32(value).tobytes(), dtype="f4") for value in (1.0, 2.0)]
    for picture in pictures:
        picture.filter = moderngl.NEAREST, moderngl.NEAREST
    kernel = Kernel(device, "copy", generated={"copy": _COPY})
    result = device.ctx.buffer(reserve=4)
    seen = []

    def look(picture: moderngl.Texture) -> None:
        kernel.run(1, picture=picture, Result=result)
        seen.append(float(np.frombuffer(result.read(), "f4")[0]))

    with device.use():
        look(pictures[0])
        with device.use():
            look(pictures[1])
        look(pictures[1])
        look(pictures[0])
    assert seen == [1.0, 2.0, 2.0, 1.0]
    for each in (*pictures, kernel, result):
        each.release()


@pytest.mark.usefixtures("ctx")
def test_a_shared_device_that_was_released_is_made_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(device_module, "_SHARED", {})
    first = Device.shared()
    first.release()
    second = Device.shared()
    assert second is not first
    with Renderer(small_scene(), size=(16, 9), device=second) as drawn:
        assert drawn.render().image.shape == (9, 16, 3)
    second.release()


@pytest.mark.usefixtures("ctx")
def test_a_headless_device_binds_nothing_of_ours_between_uses() -> None:
    """moderngl binds what was bound again after it made a framebuffer, and OpenGL refuses one that is gone."""
    mine = Device()
    for size in ((8, 8), (4, 4)):
        with mine.use():
            target = mine.ctx.simple_framebuffer(size)
            target.use()
            target.release()
    assert mine.ctx.error == "GL_NO_ERROR"
    mine.release()


def test_a_host_that_sets_all_its_state_keeps_what_was_left(ctx: moderngl.Context) -> None:
    careless = Device.of(ctx, preserve_state=False)
    with careless.use():
        assert careless.state.snapshot()["depth_test"] == (0,)
        ctx.enable_only(moderngl.DEPTH_TEST)
    assert careless.state.snapshot()["depth_test"] == (1,)
    ctx.enable_only(moderngl.NOTHING)


def test_a_framebuffer_is_bound_again_unless_it_is_gone(ctx: moderngl.Context, device: Device) -> None:
    one, two = ctx.simple_framebuffer((4, 4)), ctx.simple_framebuffer((4, 4))
    one.use()
    two.use()
    device.bind_again(one)
    assert ctx.fbo is one
    one.release()
    two.use()
    device.bind_again(one)
    assert ctx.fbo.glo == 0
    two.release()


# Functions --------------------------------------------------------------------------------------------------


def test_functions_that_moderngl_lacks_can_be_called(device: Device) -> None:
    value = ctypes.c_int()
    get = device.function("glGetIntegerv", None, ctypes.c_uint, ctypes.c_void_p)
    get(0x821B, ctypes.addressof(value))  # GL_MAJOR_VERSION
    assert value.value == device.ctx.version_code // 100
    assert device.function("glGetIntegerv", None, ctypes.c_uint, ctypes.c_void_p) is get
    assert device.function("glGetIntegerv", None, ctypes.c_uint, ctypes.POINTER(ctypes.c_int)) is not get


def test_a_function_that_the_driver_lacks_is_named(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    loader = SimpleNamespace(load_opengl_function=lambda _name: 0)
    monkeypatch.setattr(device, "ctx", SimpleNamespace(mglo=SimpleNamespace(_context=loader)))
    with pytest.raises(GreenswardError, match="lacks glNothing"):
        device.function("glNothing", None)


def test_too_few_storage_blocks_are_told_in_one_sentence(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    few = {**device.limits.storage_blocks, "vertex": 0}
    monkeypatch.setattr(device, "limits", replace(device.limits, storage_blocks=few))
    monkeypatch.setattr(device, "name", "Old GPU")
    with pytest.raises(GreenswardError) as error:
        Renderer(small_scene(technique={"name": "tessellated-quads"}), size=(16, 9), ctx=device.ctx)
    assert str(error.value) == (
        "Old GPU offers 0 storage blocks in vertex shaders and techniques/tessellated_quads/blade.frag needs 4: "
        "update the graphics driver, or draw on the CPU with GREENSWARD_DEVICE=cpu"
    )


def test_a_device_of_ones_own_context_lives_as_long_as_it() -> None:
    ctx = open_context()
    with Renderer(small_scene(), size=(16, 9), device=Device.of(ctx)) as drawn:
        assert drawn.render().image.shape == (9, 16, 3)
    Device.of(ctx).release()
    assert ctx.error == "GL_NO_ERROR", "the context is the host's"
    ctx.release()
