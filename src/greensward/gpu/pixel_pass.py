"""A full-screen pass written once, as a GLSL function of the pixel, run in a fragment or a compute shader.

A compute shader is an order of magnitude faster on GPUs with few raster units; on software drivers the
fragment shader is the faster one.
"""

from collections.abc import Mapping, Sequence
from typing import Literal

import moderngl

from greensward.gpu.context import is_software
from greensward.gpu.program import ShaderError, assemble, build_compute, locate

Shell = Literal["fragment", "compute"]

IMAGES_WRITTEN = (
    moderngl.TEXTURE_FETCH_BARRIER_BIT
    | moderngl.SHADER_IMAGE_ACCESS_BARRIER_BIT
    | moderngl.FRAMEBUFFER_BARRIER_BIT
    | moderngl.TEXTURE_UPDATE_BARRIER_BIT
)
"""The barrier after a compute shader wrote images that anything may read."""
_IMAGE_FORMATS = {"f1": "rgba8", "f2": "rgba16f", "f4": "rgba32f"}


def best_shell(ctx: moderngl.Context) -> Shell:
    """The faster shell on this kind of driver."""
    return "fragment" if is_software(ctx) else "compute"


def pixel_groups(size: tuple[int, int]) -> tuple[int, int]:
    """Columns and rows of a dispatch with an invocation for every pixel, in workgroups of 8 × 8."""
    return -(-size[0] // 8), -(-size[1] // 8)


class PixelPass:
    """Runs `bool shade(ivec2 pixel, out vec4 result[TARGETS])` of a shader file for every pixel of its targets.

    Where it returns false the targets keep what they hold. Targets have four components of the given dtypes.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        path: str,
        target_dtypes: Sequence[str],
        *,
        shell: Shell | None = None,
        defines: Mapping[str, object] = {},
    ) -> None:
        self._ctx = ctx
        self.shell = shell or best_shell(ctx)
        self._framebuffers: list[tuple[tuple[moderngl.Texture, ...], moderngl.Framebuffer]] = []
        targets = range(len(target_dtypes))
        defines = {**defines, "TARGETS": len(target_dtypes)}
        if self.shell == "compute":
            declare = "".join(
                f"layout({_IMAGE_FORMATS[dtype]}, binding = {i}) writeonly uniform image2D target{i};\n"
                for i, dtype in enumerate(target_dtypes)
            )
            store = "".join(f"    imageStore(target{i}, pixel, result[{i}]);\n" for i in targets)
            main = (
                f'#include "{path}"\n'
                "layout(local_size_x = 8, local_size_y = 8) in;\n"
                f"{declare}"
                "void main() {\n"
                "    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);\n"
                "    if (any(greaterThanEqual(pixel, imageSize(target0)))) return;\n"
                "    vec4 result[TARGETS];\n"
                "    if (!shade(pixel, result)) return;\n"
                f"{store}"
                "}\n"
            )
            self._compute = build_compute(ctx, "pixel_pass", defines, {"pixel_pass": main})
        else:
            declare = "".join(f"layout(location = {i}) out vec4 target{i};\n" for i in targets)
            store = "".join(f"    target{i} = result[{i}];\n" for i in targets)
            main = (
                f'#include "{path}"\n'
                f"{declare}"
                "void main() {\n"
                "    vec4 result[TARGETS];\n"
                "    if (!shade(ivec2(gl_FragCoord.xy), result)) discard;\n"
                f"{store}"
                "}\n"
            )
            source = assemble("pixel_pass", defines, {"pixel_pass": main})
            try:
                self._program = ctx.program(
                    vertex_shader=assemble("shaders/screen.vert").text, fragment_shader=source.text
                )
            except moderngl.Error as error:
                raise ShaderError(locate(str(error), {"fragment_shader": source})) from None
            self._triangle = ctx.vertex_array(self._program, [])

    @property
    def shader(self) -> moderngl.ComputeShader | moderngl.Program:
        """What takes its uniforms."""
        return self._compute if self.shell == "compute" else self._program

    def run(self, *targets: moderngl.Texture) -> None:
        """Shade every pixel of the targets, which are of one size."""
        if self.shell == "compute":
            for unit, target in enumerate(targets):
                target.bind_to_image(unit, read=False, write=True)
            self._compute.run(*pixel_groups(targets[0].size))
            self._ctx.memory_barrier(IMAGES_WRITTEN)
            return
        self._framebuffer(targets).use()
        self._ctx.enable_only(moderngl.NOTHING)
        self._triangle.render(moderngl.TRIANGLES, vertices=3)

    def _framebuffer(self, targets: tuple[moderngl.Texture, ...]) -> moderngl.Framebuffer:
        for textures, framebuffer in self._framebuffers:
            if textures == targets:
                return framebuffer
        framebuffer = self._ctx.framebuffer(list(targets))
        kept = [(targets, framebuffer)]
        for textures, old in self._framebuffers:
            # what a released texture held stays in memory while a framebuffer has it, and its name may come again
            if any(isinstance(texture.mglo, moderngl.InvalidObject) for texture in textures):
                old.release()
            else:
                kept.append((textures, old))
        self._framebuffers = kept
        return framebuffer

    def release(self) -> None:
        """Free program and framebuffers."""
        for _, framebuffer in self._framebuffers:
            framebuffer.release()
        if self.shell == "compute":
            self._compute.release()
        else:
            self._triangle.release()
            self._program.release()
