"""Compute kernels and draws. Their buffers, textures, images, blocks and uniforms are bound by the shader's names."""

import ctypes
import re
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import moderngl
import numpy as np

from greensward.gpu.buffers import BufferRange
from greensward.gpu.device import Device
from greensward.gpu.layouts import BlockBuffer, WrittenBlock
from greensward.gpu.limits import MOST_IMAGES, MOST_STORAGE_BLOCKS, MOST_TEXTURES, MOST_UNIFORM_BLOCKS
from greensward.gpu.programs import is_image, is_opaque
from greensward.gpu.shader_source import Source, assemble
from greensward.scene.errors import GreenswardError

Resource = moderngl.Buffer | BufferRange | moderngl.Texture | moderngl.TextureArray | BlockBuffer | WrittenBlock
Bindings = dict[str, Resource]
"""Resources that many shaders read, by the name that all of them give it; looked up at each run."""

_STAGES = {
    "vert": "vertex_shader",
    "tesc": "tess_control_shader",
    "tese": "tess_evaluation_shader",
    "geom": "geometry_shader",
    "frag": "fragment_shader",
}
_DECLARED = re.compile(r"\buniform\s+\w+\s+([^;{]+);|\b(?:buffer|uniform)\s+(\w+)\s*\{")
_LOCAL_SIZE = re.compile(r"local_size_([xyz])\s*=\s*(\d+)")
_WIDEST = 32768
_MOST_GROUPS = 65535


class BindingError(GreenswardError):
    """A name that a shader does not know, or one that it needs and was not given."""


def grid(groups: int) -> tuple[int, int]:
    """Columns and rows of at least so many workgroups, numbered by rows: drivers allow 65,535 a side."""
    columns = min(groups, _WIDEST)
    return columns, -(-groups // max(columns, 1))


class _Bound:
    """A program of the pool and how to bind what it names, in dense slots."""

    def __init__(
        self, device: Device, path: str, sources: Mapping[str, Source], bindings: Mapping[str, Resource]
    ) -> None:
        self.device = device
        self.path = path
        self._bindings = bindings
        self._program = device.programs.take(sources)
        self._uniforms: dict[str, _Uniform] = {}
        self._values: dict[str, bytes] = {}
        self._resources: dict[str, Callable[[Any], None]] = {}
        self._declared: set[str] | None = None
        storage = units = images = blocks = 0
        # moderngl writes no uniforms of integer images
        assign = device.function("glProgramUniform1i", None, ctypes.c_uint, ctypes.c_int, ctypes.c_int)
        for name, member in self._program.members.items():
            if isinstance(member, moderngl.StorageBlock):
                member.binding = storage
                self._resources[name] = _storage(storage)
                storage += 1
            elif isinstance(member, moderngl.UniformBlock):
                member.binding = blocks
                self._resources[name.removesuffix("Block")] = _block(blocks)
                blocks += 1
            elif isinstance(member, moderngl.Uniform):
                if not is_opaque(member):
                    self._uniforms[name] = _Uniform(member)
                elif is_image(member):
                    assign(self._program.gl.glo, member.location, images)
                    self._resources[name] = _image(images)
                    images += 1
                else:
                    assign(self._program.gl.glo, member.location, units)
                    self._resources[name] = _texture(device, units)
                    units += 1
        try:
            self._refuse(storage, blocks, units, images)
        except BaseException:
            device.programs.give(self._program)
            raise

    def _refuse(self, *used: int) -> None:
        for kind, count, most in zip(
            ("storage blocks", "uniform blocks", "textures", "images"),
            used,
            (MOST_STORAGE_BLOCKS, MOST_UNIFORM_BLOCKS, MOST_TEXTURES, MOST_IMAGES),
            strict=True,
        ):
            if count > most:
                raise BindingError(f"{self.path}: must use at most {most} {kind} (got {count})")
        for stage, needed in zip(self._stages(), self._program.storage_blocks, strict=True):
            offered = self.device.limits.storage_blocks[stage]
            if needed > offered:
                raise GreenswardError(
                    f"{self.device.name} offers {offered} storage blocks in {stage} shaders and {self.path} needs "
                    f"{needed}: update the graphics driver, or draw on the CPU with GREENSWARD_DEVICE=cpu"
                )

    def _stages(self) -> Sequence[str]:
        raise NotImplementedError

    def __contains__(self, name: str) -> bool:
        """Return whether the compiled program uses a name."""
        return name in self._uniforms or name in self._resources

    def set(self, **uniforms: Any) -> None:
        """Set uniforms that stay until they are set again. A matrix is given as NumPy writes it, rows first."""
        for name, value in uniforms.items():
            if name in self._uniforms:
                self._set(name, value)
            else:
                self._refuse_unknown(name)

    def _set(self, name: str, value: Any) -> None:
        uniform = self._uniforms[name]
        data = uniform.pack(value)
        if data != self._values.get(name):
            self._values[name] = data
            if self._program.uniforms_of is self:
                uniform.write(data)

    def _bind(self, values: Mapping[str, Any]) -> None:
        uniforms, resources = self._uniforms, self._resources
        for name, value in values.items():
            if name in uniforms:
                self._set(name, value)
            elif name not in resources:
                self._refuse_unknown(name)
        if self._program.uniforms_of is not self:
            for name, data in self._values.items():
                uniforms[name].write(data)
            self._program.uniforms_of = self
        bindings = self._bindings
        for name, bind in resources.items():
            resource = values.get(name)
            if resource is None:
                resource = bindings.get(name)
                if resource is None:
                    raise BindingError(f"{self.path}: {name} is not bound")
            bind(resource)
        if len(self._values) < len(uniforms):
            raise BindingError(f"{self.path}: {', '.join(sorted(uniforms.keys() - self._values))} is not set")

    def _refuse_unknown(self, name: str) -> None:
        """Let names pass that the text declares and the compiler dropped."""
        if self._declared is None:
            self._declared = set()
            for text in self._program.texts:
                for names, block in _DECLARED.findall(text):
                    self._declared.add(block.removesuffix("Block"))
                    self._declared.update(each.split("[")[0].strip() for each in names.split(","))
        if name not in self._declared:
            raise BindingError(f"{self.path}: declares no {name}")

    def release(self) -> None:
        """Give the program back to the pool; once."""
        vars(self).pop("_gl", None)
        program = vars(self).pop("_program", None)
        if program is not None:
            self.device.programs.give(program)


@lru_cache(maxsize=512)
def _group(text: str) -> tuple[int, ...]:
    sizes = dict(_LOCAL_SIZE.findall(text))
    return tuple(int(sizes.get(axis, 1)) for axis in "xyz")


class Kernel(_Bound):
    """A compute shader.

    `bindings` are resources that it may read besides those that a run names. `generated` holds texts of includes that
    exist only in memory, by path.
    """

    def __init__(
        self,
        device: Device,
        path: str,
        defines: Mapping[str, object] = {},
        bindings: Mapping[str, Resource] = {},
        *,
        generated: Mapping[str, str] = {},
        extensions: Sequence[str] = (),
    ) -> None:
        source = assemble(path, defines, generated, extensions)
        super().__init__(device, path, {"compute_shader": source}, bindings)
        self.group = _group(source.text)
        """Invocations of a workgroup along x, y and z."""
        self._gl: Any = self._program.gl

    def _stages(self) -> Sequence[str]:
        return ("compute",)

    def run(self, groups: int | tuple[int, ...], /, **values: Any) -> None:
        """Run so many workgroups with these uniforms and resources, by name."""
        self._bind(values)
        shape = (groups,) if isinstance(groups, int) else groups
        assert max(shape) <= _MOST_GROUPS, f"{self.path}: {shape} workgroups"
        self._gl.run(*shape)

    def run_over(self, invocations: int | tuple[int, ...], /, **values: Any) -> None:
        """Run at least so many invocations along each axis."""
        shape = (invocations,) if isinstance(invocations, int) else invocations
        self.run(tuple(-(-count // size) for count, size in zip(shape, self.group, strict=False)), **values)

    def run_indirect(self, arguments: moderngl.Buffer, offset: int, /, **values: Any) -> None:
        """Run as many workgroups as a buffer holds at a byte offset."""
        self._bind(values)
        self._gl.run_indirect(arguments, offset)


@dataclass(frozen=True)
class Mesh:
    """Vertex buffers of a draw, as (buffer, format, names …) for moderngl, and triangle indices."""

    content: tuple[tuple[Any, ...], ...] = ()
    indices: moderngl.Buffer | None = None


class Draw(_Bound):
    """A program of raster stages, by the suffix of their files, and the meshes that it draws; by default none."""

    def __init__(
        self,
        device: Device,
        *paths: str,
        defines: Mapping[str, object] = {},
        bindings: Mapping[str, Resource] = {},
        meshes: Sequence[Mesh] = (Mesh(),),
        generated: Mapping[str, str] = {},
        extensions: Sequence[str] = (),
    ) -> None:
        self._stage_names = [_STAGES[path.rsplit(".", 1)[1]] for path in paths]
        sources = {
            stage: assemble(path, defines, generated, extensions)
            for stage, path in zip(self._stage_names, paths, strict=True)
        }
        super().__init__(device, paths[-1], sources, bindings)
        program: Any = self._program.gl
        self._arrays = [
            device.ctx.vertex_array(program, [_present(program, *each) for each in mesh.content], mesh.indices)
            for mesh in meshes
        ]

    def _stages(self) -> Sequence[str]:
        return [name.removesuffix("_shader") for name in self._stage_names]

    def run(self, mode: int, vertices: int = -1, instances: int = 1, mesh: int = 0, /, **values: Any) -> None:
        """Draw with these uniforms and resources, by name; -1 vertices are all of the mesh."""
        self._bind(values)
        self._arrays[mesh].render(mode, vertices=vertices, instances=instances)

    def run_indirect(
        self, mode: int, commands: moderngl.Buffer, first: int, count: int = 1, mesh: int = 0, /, **values: Any
    ) -> None:
        """Draw by so many draw commands from this number on; moderngl reads records of 20 bytes."""
        self._bind(values)
        self._arrays[mesh].render_indirect(commands, mode, count, first)

    def release(self) -> None:
        """Free the arrays and give the program back to the pool."""
        for array in self._arrays:
            array.release()
        self._arrays.clear()
        super().release()


def _present(program: moderngl.Program, buffer: moderngl.Buffer, formats: str, *names: str) -> tuple[Any, ...]:
    """Describe a vertex buffer to moderngl, with attributes that the compiler dropped skipped as padding."""
    parts, rate = formats.removesuffix("/i").split(), " /i" if formats.endswith("/i") else ""
    layout = [part if name in program else f"{int(part[:-2]) * 4}x" for part, name in zip(parts, names, strict=True)]
    return (buffer, " ".join(layout) + rate, *(name for name in names if name in program))


def _storage(slot: int) -> Callable[[Any], None]:
    def bind(resource: moderngl.Buffer | BufferRange) -> None:
        if isinstance(resource, BufferRange):
            resource.buffer.bind_to_storage_buffer(slot, resource.offset, resource.size)
        else:
            resource.bind_to_storage_buffer(slot)

    return bind


def _block(slot: int) -> Callable[[BlockBuffer | WrittenBlock], None]:
    def bind(resource: BlockBuffer | WrittenBlock) -> None:
        resource.uploaded().bind_to_uniform_block(slot)

    return bind


def _image(unit: int) -> Callable[[moderngl.Texture], None]:
    def bind(resource: moderngl.Texture) -> None:
        resource.bind_to_image(unit, read=True, write=True)

    return bind


def _texture(device: Device, unit: int) -> Callable[[Any], None]:
    def bind(resource: moderngl.Texture) -> None:
        if device.units[unit] is not resource:
            resource.use(unit)
            device.units[unit] = resource

    return bind


class _Uniform:
    """A uniform of a program: the bytes of a value, and their way into the program."""

    def __init__(self, uniform: Any) -> None:
        self._array_length, self._matrix, self._dimension = uniform.array_length, uniform.matrix, uniform.dimension
        self._context = uniform.ctx
        self._place = (
            uniform.program_obj,
            uniform.location,
            uniform.gl_type,
            uniform.array_length,
            uniform.element_size,
        )
        self._pack = struct.Struct(uniform.fmt).pack
        self._dtype = {"f": np.float32, "i": np.int32, "I": np.uint32}[uniform.fmt[-1]]
        self.pack: Callable[[Any], bytes]
        """Bytes of a value as the program holds them."""
        if uniform.array_length > 1 or uniform.matrix:
            self.pack = self._pack_array
        else:
            self.pack = self._pack_number if uniform.dimension == 1 else self._pack_vector

    def write(self, data: bytes) -> None:
        self._context._write_uniform(*self._place, data)

    def _pack_array(self, value: Any) -> bytes:
        array = np.asarray(value, self._dtype)
        array = np.swapaxes(array, -1, -2) if self._matrix else array
        single = array.ndim == (2 if self._matrix else 0)
        return (array if single else array[: self._array_length]).tobytes()

    # an array of one, or trimmed to one by the compiler, looks like none

    def _pack_number(self, value: Any) -> bytes:
        return self._pack(value[0] if hasattr(value, "__len__") else value)

    def _pack_vector(self, value: Any) -> bytes:
        return self._pack(*(value[0] if hasattr(value[0], "__len__") else value))
