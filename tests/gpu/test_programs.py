"""The pool hands programs out again; binaries outlive a process, and nothing that is wrong with their files shows."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import moderngl
import numpy as np
import pytest

from greensward.gpu import programs
from greensward.gpu.device import Device
from greensward.gpu.kernels import BindingError, Draw, Kernel, Mesh
from greensward.gpu.layouts import BlockBuffer, block
from greensward.gpu.programs import CACHE_VARIABLE, ProgramPool, cache_folder
from greensward.gpu.shader_source import ShaderError

_TEXT = """
layout(local_size_x = 1) in;
uniform float one;
uniform mat4 many[2];
layout(std430) buffer Result { float result; };
void main() { result = one + many[1][2][3]; }
"""


def _kernel(device: Device, text: str = _TEXT) -> Kernel:
    return Kernel(device, "sum", generated={"sum": text})


def _result(kernel: Kernel, **values: object) -> float:
    buffer = kernel.device.ctx.buffer(reserve=4)
    kernel.run(1, Result=buffer, **values)
    (value,) = np.frombuffer(buffer.read(), "f4")
    buffer.release()
    return float(value)


# The pool ---------------------------------------------------------------------------------------------------


def test_kernels_of_one_text_share_a_program_and_keep_their_own_uniforms(device):
    pool = device.programs
    one = _kernel(device)
    made, reused = pool.compiled + pool.loaded, pool.reused
    two = _kernel(device)
    assert (pool.compiled + pool.loaded, pool.reused) == (made, reused + 1)
    assert one._program is two._program
    none = np.zeros((2, 4, 4))
    one.set(one=1.0, many=none)
    two.set(one=2.0, many=none)
    assert (_result(one), _result(two), _result(one)) == (1.0, 2.0, 1.0)
    two.set(one=3.0)
    assert (_result(one), _result(two)) == (1.0, 3.0)
    assert (_result(one, one=4.0), _result(two), _result(one)) == (4.0, 3.0, 4.0)
    one.release()
    three = _kernel(device)
    with pytest.raises(BindingError, match="many, one is not set"):
        _result(three)
    assert (_result(three, one=5.0, many=none), _result(two)) == (5.0, 3.0)
    three.release()
    two.release()


def test_a_uniform_keeps_the_value_that_an_array_had_when_it_was_set(device):
    one, two = _kernel(device), _kernel(device)
    many = np.zeros((2, 4, 4))
    many[1, 3, 2] = 7.0
    one.set(one=0.0, many=many)
    many[:] = 1.0
    assert (_result(one), _result(two, one=1.0, many=many), _result(one)) == (7.0, 2.0, 7.0)
    one.release()
    two.release()


def test_a_program_stays_for_its_last_user(device, monkeypatch):
    monkeypatch.setattr(programs, "_MOST_IDLE", 0)
    one, two = _kernel(device), _kernel(device)
    gl = one._program.gl
    one.release()
    one.release()
    device.programs.release()
    assert _result(two, one=2.0, many=np.zeros((2, 4, 4))) == 2.0
    two.release()
    assert isinstance(gl.mglo, moderngl.InvalidObject)


def test_another_text_another_define_or_another_stage_is_another_program(device):
    seen = []
    for defines in ({}, {"TWICE": 1}):
        kernel = Kernel(device, "sum", defines, generated={"sum": _TEXT})
        seen.append(kernel._program.key)
        kernel.release()
    stages = "shaders/screen.vert", "a.frag"
    for colour in ("1.0", "0.0"):
        draw = Draw(device, *stages, generated={"a.frag": f"out vec4 c;\nvoid main() {{ c = vec4({colour}); }}"})
        seen.append(draw._program.key)
        draw.release()
    assert len(set(seen)) == 4


def test_no_more_stay_idle_than_that(device, monkeypatch):
    pool = ProgramPool(device.ctx, device.function)
    monkeypatch.setattr(device, "programs", pool)
    monkeypatch.setattr(programs, "_MOST_IDLE", 3)
    kernels = [_kernel(device, f"const int NUMBER = {i};\n{_TEXT}") for i in range(5)]
    made = [each._program.gl for each in kernels]
    for each in kernels:
        each.release()
    gone = [isinstance(gl.mglo, moderngl.InvalidObject) for gl in made]
    assert gone == [True, True, False, False, False], "the oldest go first"
    pool.release()
    assert all(isinstance(gl.mglo, moderngl.InvalidObject) for gl in made)


# Binaries ---------------------------------------------------------------------------------------------------

_ALL = block("AllKinds", ("scale", "vec4"))
_RICH = """
#include "layout/AllKinds"
layout(local_size_x = 1) in;
uniform sampler2D picture;
uniform usampler2DArray numbers;
uniform float weights[3];
uniform ivec2 at;
layout(rgba8) writeonly uniform image2D target;
layout(std430) buffer Result { float result; };
void main() {
    result = allkinds.scale.y * texelFetch(picture, at, 0).r + weights[2] + float(texelFetch(numbers, ivec3(0), 0).r);
    imageStore(target, ivec2(0), vec4(1.0));
}
"""


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, device: Device) -> Iterator[Callable[[], ProgramPool]]:
    """Gives the device new pools, as another process has, that keep binaries in one folder."""
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "cache"))
    pools = []

    def pool() -> ProgramPool:
        pools.append(ProgramPool(device.ctx, device.function))
        monkeypatch.setattr(device, "programs", pools[-1])
        return pools[-1]

    if not pool().keeps_binaries:
        pytest.skip("this driver gives no binaries")
    yield pool
    for each in pools:
        each.release()


def _files(tmp_path: Path) -> list[Path]:
    return [path for path in (tmp_path / "cache").rglob("*") if path.is_file()]


def test_a_binary_is_loaded_instead_of_compiled(device, cache, tmp_path):
    for loaded in (0, 1):
        pool = cache()
        kernel = _kernel(device)
        assert (pool.compiled, pool.loaded) == (1 - loaded, loaded)
        assert _result(kernel, one=2.0, many=np.zeros((2, 4, 4))) == 2.0
        kernel.release()
    assert len(_files(tmp_path)) == 1


def test_a_loaded_program_knows_all_that_the_compiled_one_did(device, cache):
    scale = BlockBuffer(device.ctx, _ALL)
    scale.set(scale=(0.0, 10.0, 0.0, 0.0))
    picture = device.ctx.texture((2, 1), 1, np.array([0.5, 0.25], "f4").tobytes(), dtype="f4")
    picture.filter = moderngl.NEAREST, moderngl.NEAREST
    numbers = device.ctx.texture_array((1, 1, 1), 1, np.uint32(100).tobytes(), dtype="u4")
    numbers.filter = moderngl.NEAREST, moderngl.NEAREST
    target = device.ctx.texture((1, 1), 4)
    results = []
    for _ in range(2):
        pool = cache()
        kernel = Kernel(device, "rich", bindings={"AllKinds": scale}, generated={"rich": _RICH})
        values = {"picture": picture, "numbers": numbers, "target": target, "weights": (0, 0, 3), "at": (1, 0)}
        results.append((_result(kernel, **values), target.read(), kernel.group))
        kernel.release()
    assert (pool.compiled, pool.loaded) == (0, 1)
    assert results[0] == results[1] == (105.5, b"\xff" * 4, (1, 1, 1))
    for each in (scale, picture, numbers, target):
        each.release()


def test_a_loaded_draw_draws(device, cache):
    corners = device.ctx.buffer(np.array([[-1, -1], [3, -1], [-1, 3]], "f4").tobytes())
    generated = {
        "a.vert": "in vec2 corner;\nin float unused;\nvoid main() { gl_Position = vec4(corner, 0.0, 1.0); }",
        "a.frag": "uniform vec4 paint;\nout vec4 colour;\nvoid main() { colour = paint; }",
    }
    target = device.ctx.simple_framebuffer((1, 1))
    for loaded in (0, 1):
        pool = cache()
        meshes = (Mesh(((corners, "2f4", "corner"),)),)
        draw = Draw(device, "a.vert", "a.frag", meshes=meshes, generated=generated)
        assert pool.loaded == loaded
        target.clear()
        target.use()
        draw.run(moderngl.TRIANGLES, paint=(0.0, 1.0, 0.0, 1.0))
        assert target.read(components=4) == b"\x00\xff\x00\xff"
        draw.release()
    for each in (corners, target):
        each.release()


_DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda _: b"",
    "shortened": lambda content: content[: len(content) // 2],
    "a byte less": lambda content: content[:-1],
    "a bit turned": lambda content: content[:-5] + bytes([content[-5] ^ 1]) + content[-4:],
    "of something else": lambda content: b"\x89PNG" + content,
    "only its name": lambda _: programs._MAGIC,
    "no JSON": lambda _: programs._MAGIC + programs.hashlib.sha256(b"\0" * 12).digest() + b"\0" * 12,
}


@pytest.mark.parametrize("damage", _DAMAGES)
def test_a_damaged_file_is_compiled_and_written_anew(device, cache, tmp_path, damage):
    cache()
    _kernel(device).release()
    (file,) = _files(tmp_path)
    whole = file.read_bytes()
    file.write_bytes(_DAMAGES[damage](whole))
    for compiled in (1, 0):
        pool = cache()
        kernel = _kernel(device)
        assert pool.compiled == compiled
        assert _result(kernel, one=2.0, many=np.zeros((2, 4, 4))) == 2.0
        kernel.release()
    assert device.ctx.error == "GL_NO_ERROR"


def test_a_binary_that_the_driver_refuses_is_compiled(device, cache, tmp_path):
    """Sound by its digest, but of another build of the driver."""
    cache()
    _kernel(device).release()
    (file,) = _files(tmp_path)
    content = file.read_bytes()
    head = len(programs._MAGIC)
    payload = bytearray(content[head + 32 :])
    size = int.from_bytes(payload[4:8], "little")
    payload[8 + size :] = bytes(len(payload) - 8 - size)
    file.write_bytes(programs._MAGIC + programs.hashlib.sha256(payload).digest() + payload)
    pool = cache()
    kernel = _kernel(device)
    assert (pool.compiled, pool.loaded) == (1, 0)
    assert _result(kernel, one=2.0, many=np.zeros((2, 4, 4))) == 2.0
    assert device.ctx.error == "GL_NO_ERROR"
    kernel.release()


def test_binaries_of_another_driver_are_not_looked_at(device, cache, tmp_path, monkeypatch):
    cache()
    _kernel(device).release()
    monkeypatch.setitem(device.ctx.info, "GL_VERSION", "another")
    pool = cache()
    _kernel(device).release()
    assert (pool.compiled, pool.loaded) == (1, 0)
    assert len(_files(tmp_path)) == 2


def test_a_full_disk_is_silent_and_leaves_nothing(device, cache, tmp_path, monkeypatch):
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    pool = cache()
    _kernel(device).release()
    assert pool.compiled == 1
    assert _files(tmp_path) == []


@pytest.mark.parametrize("place", ["a file", "below a file"])
def test_a_folder_that_cannot_be_written_is_silent(device, cache, tmp_path, monkeypatch, place):
    """Also for root, whom permissions do not stop."""
    (tmp_path / "file").write_text("")
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "file" / ("" if place == "a file" else "more")))
    pool = cache()
    _kernel(device).release()
    assert pool.compiled == 1


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="permissions stop no administrator")
def test_a_read_only_folder_is_silent(device, cache, tmp_path):
    (tmp_path / "cache").mkdir(mode=0o500)
    pool = cache()
    _kernel(device).release()
    assert pool.compiled == 1


def test_the_oldest_files_go(device, cache, tmp_path, monkeypatch):
    monkeypatch.setattr(programs, "_MOST_FILES", 2)
    cache()
    for i in range(4):
        _kernel(device, f"const int NUMBER = {i};\n{_TEXT}").release()
        for age, file in enumerate(sorted(_files(tmp_path), key=lambda each: each.stat().st_mtime_ns, reverse=True)):
            os.utime(file, (1e9 - age, 1e9 - age))
    pool = cache()
    for i in (3, 2, 1):
        _kernel(device, f"const int NUMBER = {i};\n{_TEXT}").release()
    assert (pool.loaded, pool.compiled) == (2, 1)


def test_a_text_with_an_error_is_told_whatever_is_in_the_cache(device, cache):
    for _ in range(2):
        cache()
        with pytest.raises(ShaderError, match="sum:2"):
            _kernel(device, "layout(local_size_x = 1) in;\nvoid main() { wrong; }")


@pytest.mark.parametrize("said", ["off", "OFF", "0", "no"])
def test_no_binaries_are_kept_where_none_are_wanted(device, cache, tmp_path, monkeypatch, said):
    monkeypatch.setenv(CACHE_VARIABLE, said)
    for _ in range(2):
        pool = cache()
        _kernel(device).release()
        assert (pool.compiled, pool.keeps_binaries) == (1, False)
    assert _files(tmp_path) == []


_ELSEWHERE = """
from greensward.gpu.device import Device
from greensward.gpu.kernels import Kernel
device = Device.shared()
for i in range(6):
    text = f"layout(local_size_x = {i + 1}) in; layout(std430) buffer R {{ float r; }}; void main() {{ r = 1.0; }}"
    Kernel(device, "a", generated={"a": text}).release()
print(device.programs.compiled, device.programs.loaded, device.ctx.error)
"""


@pytest.mark.slow
@pytest.mark.usefixtures("cache")
def test_processes_beside_each_other_and_after_each_other(tmp_path):
    def start() -> subprocess.Popen[str]:
        return subprocess.Popen([sys.executable, "-c", _ELSEWHERE], stdout=subprocess.PIPE, text=True, env=os.environ)

    for at_once in (2, 1):
        running = [start() for _ in range(at_once)]
        answers = [each.communicate()[0].split() for each in running]
        assert all(each.returncode == 0 for each in running)
        assert all(int(compiled) + int(loaded) == 6 and error == "GL_NO_ERROR" for compiled, loaded, error in answers)
    assert answers == [["0", "6", "GL_NO_ERROR"]]
    assert len(_files(tmp_path)) == 6, "nothing half-written is left"


@pytest.mark.parametrize(
    ("platform", "variables", "folder"),
    [
        ("linux", {}, "home/.cache/greensward/programs"),
        ("linux", {"XDG_CACHE_HOME": "xdg"}, "xdg/greensward/programs"),
        ("win32", {}, "home/AppData/Local/greensward/Cache/programs"),
        ("win32", {"LOCALAPPDATA": "local"}, "local/greensward/Cache/programs"),
        ("linux", {CACHE_VARIABLE: "mine"}, "mine"),
    ],
)
def test_the_folder_is_where_the_platform_has_it(monkeypatch, platform, variables, folder):
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA", CACHE_VARIABLE):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.setattr(Path, "home", lambda: Path("home"))
    assert cache_folder() == Path(folder)


def test_someone_without_a_home_keeps_none(monkeypatch):
    def homeless() -> Path:
        raise RuntimeError

    monkeypatch.delenv(CACHE_VARIABLE, raising=False)
    monkeypatch.setattr(Path, "home", homeless)
    assert cache_folder() is None
