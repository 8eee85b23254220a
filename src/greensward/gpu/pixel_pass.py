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

_VERTEX = """#version 430 core
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }
"""
_IMAGE_FORMATS = {("f1", 4): "rgba8", ("f2", 4): "rgba16f", ("f4", 4): "rgba32f", ("f4", 1): "r32f"}


def best_shell(ctx: moderngl.Context) -> Shell:
    """The faster shell on this kind of driver."""
    return "fragment" if is_software(ctx) else "compute"


class PixelPass:
    """Runs `vec4 shade(ivec2 pixel)` of a shader file for every pixel of a target texture."""

    def __init__(
        self,
        ctx: moderngl.Context,
        path: str,
        target_dtype: str,
        *,
        components: int = 4,
        shell: Shell | None = None,
        defines: Mapping[str, object] = {},  # noqa: B006
    ) -> None:
        self._ctx = ctx
        self.shell = shell or best_shell(ctx)
        self._framebuffers: dict[int, moderngl.Framebuffer] = {}
        if self.shell == "compute":
            layout = _IMAGE_FORMATS[target_dtype, components]
            main = (
                f'#include "{path}"\n'
                "layout(local_size_x = 8, local_size_y = 8) in;\n"
                f"layout({layout}, binding = 0) writeonly uniform image2D target;\n"
                "void main() {\n"
                "    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);\n"
                "    if (any(greaterThanEqual(pixel, imageSize(target)))) return;\n"
                "    imageStore(target, pixel, shade(pixel));\n"
                "}\n"
            )
            self._compute = build_compute(ctx, "pixel_pass", defines, {"pixel_pass": main})
        else:
            main = (
                f'#include "{path}"\n'
                "layout(location = 0) out vec4 target;\n"
                "void main() { target = shade(ivec2(gl_FragCoord.xy)); }\n"
            )
            source = assemble("pixel_pass", defines, {"pixel_pass": main})
            try:
                self._program = ctx.program(vertex_shader=_VERTEX, fragment_shader=source.text)
            except moderngl.Error as error:
                raise ShaderError(locate(str(error), {"fragment_shader": source})) from None
            self._triangle = ctx.vertex_array(self._program, [])

    def run(self, target: moderngl.Texture, uniforms: Sequence[tuple[str, object]] = ()) -> None:
        """Shade every pixel of the target."""
        program = self._compute if self.shell == "compute" else self._program
        for name, value in uniforms:
            if name in program:
                program[name] = value
        if self.shell == "compute":
            target.bind_to_image(0, read=False, write=True)
            self._compute.run(-(-target.width // 8), -(-target.height // 8))
            self._ctx.memory_barrier(
                moderngl.TEXTURE_FETCH_BARRIER_BIT
                | moderngl.SHADER_IMAGE_ACCESS_BARRIER_BIT
                | moderngl.FRAMEBUFFER_BARRIER_BIT
                | 0x100  # GL_TEXTURE_UPDATE_BARRIER_BIT: read-back
            )
            return
        framebuffer = self._framebuffers.get(target.glo)
        if framebuffer is None:
            framebuffer = self._framebuffers[target.glo] = self._ctx.framebuffer([target])
        framebuffer.use()
        self._ctx.enable_only(moderngl.NOTHING)
        self._triangle.render(moderngl.TRIANGLES, vertices=3)

    def release(self) -> None:
        """Free program and framebuffers."""
        for framebuffer in self._framebuffers.values():
            framebuffer.release()
        if self.shell == "compute":
            self._compute.release()
        else:
            self._triangle.release()
            self._program.release()
