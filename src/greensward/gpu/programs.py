"""Pool of linked programs by their text, and the driver's binaries of them, kept between processes."""

import ctypes
import hashlib
import json
import os
import re
import struct
import sys
import tempfile
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

import moderngl

from greensward.gpu.shader_source import ShaderError, Source, locate
from greensward.interrupts import held_back

CACHE_VARIABLE = "GREENSWARD_PROGRAM_CACHE"
"""Variable of the environment: `off` keeps no binaries, a path keeps them there instead of in the user's cache."""
_MOST_IDLE, _MOST_FILES = 256, 512
_LINK_STATUS, _BINARY_LENGTH, _BINARY_FORMATS = 0x8B82, 0x8741, 0x87FE
_MAGIC = b"greensward program 1\n"
_BUFFER = re.compile(r"\bbuffer\s+(\w+)")
_COMPUTE_STUB = "#version 430 core\nlayout(local_size_x = 1) in;\nvoid main() {}\n"
_VERTEX_STUB = "#version 430 core\nvoid main() { gl_Position = vec4(0.0); }\n"
_FRAGMENT_STUB = "#version 430 core\nvoid main() {}\n"
_SAMPLERS = ((0x8B5D, 0x8B64), (0x8DC0, 0x8DC5), (0x8DC9, 0x8DD8), (0x900C, 0x900F), (0x9108, 0x910D))
_IMAGES = (0x904C, 0x906C)
GlProgram = moderngl.Program | moderngl.ComputeShader
Loader = Callable[..., Callable[..., Any]]


class Program:
    """A linked program, which all kernels and draws of its text share."""

    def __init__(self, gl: GlProgram, key: str, texts: tuple[str, ...]) -> None:
        self.gl = gl
        self.key = key
        self.texts = texts
        self.users = 0
        """Number of kernels and draws that have it."""
        self.uniforms_of: object = None
        """The kernel or draw whose values its uniforms hold."""

    @cached_property
    def storage_blocks(self) -> tuple[int, ...]:
        """Number of storage blocks that each stage uses of those that its text declares."""
        used = {name for name, member in self.members.items() if isinstance(member, moderngl.StorageBlock)}
        return tuple(len(used & set(_BUFFER.findall(text))) for text in self.texts)

    @property
    def members(self) -> dict[str, Any]:
        """Uniforms, blocks and attributes by name, as moderngl reflects them."""
        return _members(self.gl)


def is_opaque(uniform: Any) -> bool:
    """Return whether a uniform is a sampler or an image, by its OpenGL type."""
    return is_image(uniform) or any(low <= uniform.gl_type <= high for low, high in _SAMPLERS)


def is_image(uniform: Any) -> bool:
    """Return whether a uniform is an image, by its OpenGL type."""
    low, high = _IMAGES
    return bool(low <= uniform.gl_type <= high)


class ProgramPool:
    """Programs of one context by their text; those without users stay for whoever asks for their text next."""

    def __init__(self, ctx: moderngl.Context, function: Loader) -> None:
        self._ctx = ctx
        self._programs: OrderedDict[str, Program] = OrderedDict()
        self._binaries = Binaries.of(ctx, function)
        self.compiled = self.loaded = self.reused = 0
        """Programs compiled from text, loaded as binaries, and those that a further user shares."""
        self.seconds = 0.0
        """Wall-clock time that all of these took."""

    @property
    def keeps_binaries(self) -> bool:
        """The driver's binaries are kept between processes."""
        return self._binaries is not None

    def take(self, sources: Mapping[str, Source]) -> Program:
        """Return the program of stages, by moderngl's names of them; it is linked for its first user.

        Raises `ShaderError` where the driver refuses the text.
        """
        started = time.perf_counter()
        try:
            return self._take(sources)
        finally:
            self.seconds += time.perf_counter() - started

    def _take(self, sources: Mapping[str, Source]) -> Program:
        digest = hashlib.sha256()
        for stage, source in sources.items():
            digest.update(f"{stage}\n{source.text}\0".encode())
        key = digest.hexdigest()
        program = self._programs.get(key)
        if program is None:
            program = self._programs[key] = Program(
                self._link(key, sources), key, tuple(source.text for source in sources.values())
            )
        else:
            self.reused += 1
        program.users += 1
        return program

    def _link(self, key: str, sources: Mapping[str, Source]) -> GlProgram:
        # a program that is half made cannot be freed
        with held_back():
            gl = self._binaries.load(key, tuple(sources)) if self._binaries else None
            if gl is not None:
                self.loaded += 1
                return gl
            gl = self._compile(sources)
            self.compiled += 1
            if self._binaries:
                self._binaries.save(key, gl)
            return gl

    def _compile(self, sources: Mapping[str, Source]) -> GlProgram:
        texts: dict[str, Any] = {stage: source.text for stage, source in sources.items()}
        try:
            if "compute_shader" in texts:
                return self._ctx.compute_shader(texts["compute_shader"])
            return self._ctx.program(**texts)
        except moderngl.Error as error:
            raise ShaderError(locate(str(error), sources)) from None

    def give(self, program: Program) -> None:
        """Take a program back from one of its users."""
        program.users -= 1
        program.uniforms_of = None
        self._programs.move_to_end(program.key)
        idle = [each for each in self._programs.values() if not each.users]
        self._free(idle[: max(len(idle) - _MOST_IDLE, 0)])

    def release(self) -> None:
        """Free the programs without users."""
        self._free([each for each in self._programs.values() if not each.users])

    def _free(self, programs: list[Program]) -> None:
        for program in programs:
            del self._programs[program.key]
            program.gl.release()


class Binaries:
    """Files of program binaries of one driver.

    A file is a digest and what it is of, so that damage shows; it is written aside and renamed, so that
    processes beside each other see whole files. Whatever goes wrong with files is silent: text is compiled instead.
    """

    def __init__(self, ctx: moderngl.Context, function: Loader, folder: Path) -> None:
        unsigned, pointer = ctypes.c_uint, ctypes.c_void_p
        self._ctx, self._folder = ctx, folder
        self._get = function("glGetProgramiv", None, unsigned, unsigned, pointer)
        self._read = function("glGetProgramBinary", None, unsigned, ctypes.c_int, pointer, pointer, pointer)
        self._write = function("glProgramBinary", None, unsigned, unsigned, ctypes.c_char_p, ctypes.c_int)

    @classmethod
    def of(cls, ctx: moderngl.Context, function: Loader) -> "Binaries | None":
        """Open the folder of this context's driver; None where it gives no binaries or the variable says `off`."""
        folder = cache_folder()
        if folder is None or not hasattr(_internals(), "make_uniform"):
            return None
        formats = ctypes.c_int()
        function("glGetIntegerv", None, ctypes.c_uint, ctypes.c_void_p)(_BINARY_FORMATS, ctypes.byref(formats))
        if not formats.value:
            return None
        names = (ctx.info[name] for name in ("GL_VENDOR", "GL_RENDERER", "GL_VERSION"))
        driver = hashlib.sha256("\n".join((*names, version("moderngl"))).encode()).hexdigest()[:16]
        return cls(ctx, function, folder / driver)

    def load(self, key: str, stages: tuple[str, ...]) -> GlProgram | None:
        """Link a program from its binary; None where there is none that this driver takes."""
        try:
            content = (self._folder / key).read_bytes()
            if not content.startswith(_MAGIC):
                return None
            digest, payload = content[len(_MAGIC) : len(_MAGIC) + 32], content[len(_MAGIC) + 32 :]
            if hashlib.sha256(payload).digest() != digest:
                return None
            kind, size = struct.unpack_from("<II", payload)
            reflected, binary = json.loads(payload[8 : 8 + size]), payload[8 + size :]
        except (OSError, ValueError, struct.error):
            return None
        if "compute_shader" in stages:
            gl: GlProgram = self._ctx.compute_shader(_COMPUTE_STUB)
        else:
            gl = self._ctx.program(_VERTEX_STUB, _FRAGMENT_STUB)
        self._write(gl.glo, kind, binary, len(binary))
        linked = ctypes.c_int()
        self._get(gl.glo, _LINK_STATUS, ctypes.byref(linked))
        if not linked.value:
            _ = self._ctx.error  # of a binary of another build of the driver
            gl.release()
            return None
        _reflect(gl, reflected)
        return gl

    def save(self, key: str, gl: GlProgram) -> None:
        """Write a program's binary to its file."""
        length = ctypes.c_int()
        self._get(gl.glo, _BINARY_LENGTH, ctypes.byref(length))
        if length.value <= 0:
            return
        data, kind = ctypes.create_string_buffer(length.value), ctypes.c_uint()
        self._read(gl.glo, length.value, ctypes.byref(length), ctypes.byref(kind), data)
        reflected = json.dumps(_reflection(gl)).encode()
        payload = struct.pack("<II", kind.value, len(reflected)) + reflected + data.raw[: length.value]
        with suppress(OSError):
            self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            handle, aside = tempfile.mkstemp(dir=self._folder, prefix=".new-")
            try:
                with os.fdopen(handle, "wb") as file:
                    file.write(_MAGIC + hashlib.sha256(payload).digest() + payload)
                Path(aside).replace(self._folder / key)
            except BaseException:
                with suppress(OSError):
                    Path(aside).unlink()
                raise
            self._forget_oldest()

    def _forget_oldest(self) -> None:
        found = sorted(self._folder.iterdir(), key=lambda file: file.stat().st_mtime)
        for file in found[: max(len(found) - _MOST_FILES, 0)]:
            file.unlink(missing_ok=True)


def cache_folder() -> Path | None:
    """Folder of program binaries by the platform's convention; None where GREENSWARD_PROGRAM_CACHE is `off`."""
    wanted = os.environ.get(CACHE_VARIABLE, "")
    if wanted.lower() in ("off", "0", "no"):
        return None
    if wanted:
        return Path(wanted)
    try:
        home = Path.home()
    except RuntimeError:
        return None
    if sys.platform == "win32":
        root = os.environ.get("LOCALAPPDATA")
        return (Path(root) if root else home / "AppData" / "Local") / "greensward" / "Cache" / "programs"
    root = os.environ.get("XDG_CACHE_HOME")
    return (Path(root) if root else home / ".cache") / "greensward" / "programs"


# moderngl reflects a program when it compiles it, and cannot take a binary. So a small program of the same kind is
# compiled, the binary put in its place, and its reflection replaced by that of the first compilation.


def _internals() -> Any:
    try:
        import _moderngl  # type: ignore[import-untyped]
    except ImportError:
        return None
    return _moderngl


def _members(gl: GlProgram) -> dict[str, Any]:
    program: Any = gl
    members: dict[str, Any] = program._members
    return members


def _reflection(gl: GlProgram) -> dict[str, Any]:
    found: dict[str, Any] = {"uniforms": [], "blocks": [], "storage": [], "attributes": []}
    for name, member in _members(gl).items():
        kind = type(member)
        if kind is moderngl.Uniform:
            found["uniforms"].append([name, member.gl_type, member.location, member.array_length])
        elif kind is moderngl.UniformBlock:
            found["blocks"].append([name, member.index, member.size])
        elif kind is moderngl.StorageBlock:
            found["storage"].append([name, member.index])
        elif kind is moderngl.Attribute:
            found["attributes"].append([name, member.gl_type, member.location, member.array_length])
    return found


def _reflect(gl: GlProgram, found: Mapping[str, Any]) -> None:
    make, ctx, glo = _internals(), gl.ctx.mglo, gl.glo
    members = {
        **{n: make.make_attribute(n, kind, glo, at, size) for n, kind, at, size in found["attributes"]},
        **{n: make.make_uniform(n, kind, glo, at, size, ctx) for n, kind, at, size in found["uniforms"]},
        **{n: make.make_uniform_block(n, glo, index, size, ctx) for n, index, size in found["blocks"]},
        **{n: make.make_storage_block(n, glo, index, ctx) for n, index in found["storage"]},
    }
    target: Any = gl
    target._members = members
    if isinstance(gl, moderngl.Program):
        attributes = [members[name] for name, *_ in found["attributes"]]
        target._attribute_locations = {each.name: each.location for each in attributes}
        target._attribute_types = {each.location: each for each in attributes}
