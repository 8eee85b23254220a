"""Full-screen passes, written once as a GLSL function of the pixel and run in a fragment or a compute shader."""

from collections.abc import Mapping, Sequence
from typing import Any

import moderngl

from greensward.gpu.device import IMAGES_WRITTEN, Device, Stage
from greensward.gpu.kernels import Draw, Kernel, Resource

_IMAGE_FORMATS = {"f1": "rgba8", "f2": "rgba16f", "f4": "rgba32f"}


class FullScreenPass:
    """Runs `bool shade(ivec2 pixel, out vec4 result[TARGETS])` of a shader file for every pixel of its targets.

    Where it returns false the targets keep what they hold. Targets have four components of the given dtypes.
    """

    def __init__(
        self,
        device: Device,
        path: str,
        target_dtypes: Sequence[str],
        *,
        stage: Stage | None = None,
        defines: Mapping[str, object] = {},
        bindings: Mapping[str, Resource] = {},
    ) -> None:
        self._ctx = device.ctx
        self.stage = stage or device.best_stage
        self._framebuffers: list[tuple[tuple[moderngl.Texture, ...], moderngl.Framebuffer]] = []
        self._names = [f"target{i}" for i in range(len(target_dtypes))]
        defines = {**defines, "TARGETS": len(target_dtypes)}
        main = _compute_main(path, target_dtypes) if self.stage == "compute" else _fragment_main(path, target_dtypes)
        self.shader: Kernel | Draw
        """Takes the uniforms."""
        if self.stage == "compute":
            self.shader = Kernel(device, "full_screen.comp", defines, bindings, generated={"full_screen.comp": main})
        else:
            stages = "shaders/screen.vert", "full_screen.frag"
            generated = {"full_screen.frag": main}
            self.shader = Draw(device, *stages, defines=defines, bindings=bindings, generated=generated)
        self.shader.path = path

    def run(self, *targets: moderngl.Texture, **values: Any) -> None:
        """Shade every pixel of the targets, which are of one size, with these uniforms and resources by name."""
        if isinstance(self.shader, Kernel):
            self.shader.run_over(targets[0].size, **dict(zip(self._names, targets, strict=True)), **values)
            self._ctx.memory_barrier(IMAGES_WRITTEN)
            return
        self._framebuffer(targets).use()
        self._ctx.enable_only(moderngl.NOTHING)
        self.shader.run(moderngl.TRIANGLES, 3, **values)

    def _framebuffer(self, targets: tuple[moderngl.Texture, ...]) -> moderngl.Framebuffer:
        for textures, framebuffer in self._framebuffers:
            if textures == targets:
                return framebuffer
        framebuffer = self._ctx.framebuffer(list(targets))
        held = [(targets, framebuffer)]
        for textures, old in self._framebuffers:
            # what a released texture held stays in memory while a framebuffer has it, and its name may come again
            if any(isinstance(texture.mglo, moderngl.InvalidObject) for texture in textures):
                old.release()
            else:
                held.append((textures, old))
        self._framebuffers = held
        return framebuffer

    def release(self) -> None:
        """Free program and framebuffers."""
        for _, framebuffer in self._framebuffers:
            framebuffer.release()
        self.shader.release()


def _compute_main(path: str, dtypes: Sequence[str]) -> str:
    images = "".join(
        f"layout({_IMAGE_FORMATS[dtype]}) writeonly uniform image2D target{i};\n" for i, dtype in enumerate(dtypes)
    )
    stores = "".join(f"    imageStore(target{i}, pixel, result[{i}]);\n" for i in range(len(dtypes)))
    return (
        f'#include "{path}"\n'
        "layout(local_size_x = 8, local_size_y = 8) in;\n"
        f"{images}"
        "void main() {\n"
        "    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);\n"
        "    if (any(greaterThanEqual(pixel, imageSize(target0)))) return;\n"
        "    vec4 result[TARGETS];\n"
        "    if (!shade(pixel, result)) return;\n"
        f"{stores}"
        "}\n"
    )


def _fragment_main(path: str, dtypes: Sequence[str]) -> str:
    outputs = "".join(f"layout(location = {i}) out vec4 target{i};\n" for i in range(len(dtypes)))
    stores = "".join(f"    target{i} = result[{i}];\n" for i in range(len(dtypes)))
    return (
        f'#include "{path}"\n'
        f"{outputs}"
        "void main() {\n"
        "    vec4 result[TARGETS];\n"
        "    if (!shade(ivec2(gl_FragCoord.xy), result)) discard;\n"
        f"{stores}"
        "}\n"
    )
