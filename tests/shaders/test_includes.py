"""Each file of GLSL includes what it uses: it compiles by itself. Only sowing/each.glsl is the end of a shader."""

from pathlib import Path

import pytest

import greensward.renderer
from greensward.gpu.kernels import Draw, Kernel

_ROOT = Path(greensward.renderer.__file__).parent
_FILES = sorted(path.relative_to(_ROOT).as_posix() for path in _ROOT.rglob("*.glsl"))
_DEFINES = {
    "RINGS": 2,
    "SIDE": 32,
    "WORDS": 32,
    "TARGETS": 2,
    "PATCHES": 1,
    "FADING": 0.1,
    "COARSER": 2,
    "ALONG": "1, 0",
    "LINE": 4,
    "BLOCK": 4,
}
_GENERATED = {
    "culling/width": '#include "techniques/blades/width.glsl"',
    "culling/base_depth": '#include "culling/gbuffer_depth.glsl"',
    "empty.frag": "void main() {}",
}
_STAGES = {
    "shaders/emit.glsl": "frag",
    "passes/water/surface.glsl": "frag",
    "techniques/tessellated_quads/patch.glsl": "vert",
}


@pytest.mark.parametrize("file", [file for file in _FILES if file != "sowing/each.glsl"])
def test_a_file_compiles_by_itself(device, file):
    stage = _STAGES.get(file, "comp")
    size = "layout(local_size_x = 1) in;\n" if stage == "comp" else ""
    place = "gl_Position = vec4(0.0);" if stage == "vert" else ""
    generated = {**_GENERATED, f"a.{stage}": f'{size}#include "{file}"\nvoid main() {{ {place} }}'}
    if stage == "comp":
        made = Kernel(device, "a.comp", _DEFINES, generated=generated)
    else:
        paths = ("a.vert", "empty.frag") if stage == "vert" else ("shaders/screen.vert", "a.frag")
        made = Draw(device, *paths, defines=_DEFINES, generated=generated)
    made.release()
