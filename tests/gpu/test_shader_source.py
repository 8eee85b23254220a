"""Includes and the line map: an error names the file and line that a person wrote."""

import numpy as np
import pytest

from greensward.gpu import shader_source
from greensward.gpu.kernels import Draw, Kernel
from greensward.gpu.shader_source import ShaderError, Source, assemble, locate

_NESTED = {
    "outer": '// one\n#include "middle"\n#include "inner"\nfloat outer() { return middle(); }',
    "middle": '#include "inner"\nfloat middle() { return inner(); }',
    "inner": "float inner() { return 1.0; }",
}


def _compiled(device, text, **generated):
    """Run a compute shader of this text and a main; return the `result` that it writes."""
    main = f"{text}\nlayout(local_size_x = 1) in;\nlayout(std430) buffer Result {{ float result; }};\n"
    kernel = Kernel(device, "main", generated={**generated, "main": main + "void main() { result = VALUE; }"})
    result = device.ctx.buffer(reserve=4)
    kernel.run(1, Result=result)
    (value,) = np.frombuffer(result.read(), "f4")
    for each in (kernel, result):
        each.release()
    return value


def test_each_include_is_inlined_once_where_it_is_first_needed():
    source = assemble("outer", {"LEVEL": 3, "FAST": "true"}, _NESTED, ["GL_NV_gpu_shader5"])
    lines = source.text.splitlines()
    assert lines[:2] == ["#version 430 core", "#extension GL_NV_gpu_shader5 : require"]
    assert lines[2:4] == ["#define LEVEL 3", "#define FAST true"]
    code = [(line, source.origin(k)) for k, line in enumerate(lines, start=1) if not line.startswith("#")]
    assert code == [
        ("// one", ("outer", 1)),
        (_NESTED["inner"], ("inner", 1)),
        ("float middle() { return inner(); }", ("middle", 2)),
        ("float outer() { return middle(); }", ("outer", 4)),
    ]


def test_files_that_include_each_other_end():
    loop = {"a": '#include "b"\nint a;', "b": '#include "a"\nint b;'}
    assert [line for line in assemble("a", {}, loop).text.splitlines() if line[0] != "#"] == ["int b;", "int a;"]


_VALUE = "const float VALUE = 2.0;"


@pytest.mark.parametrize(
    "text",
    [
        '#ifdef NEVER\n#include "value"\n#endif\n#include "value"',
        '#ifndef NEVER\n#include "value"\n#endif\n#include "value"',
        '#if 0\n#include "value"\n#else\n#include "value"\n#endif',
        '#if 1\n#include "value"\n#elif 1\n#include "value"\n#endif\n#include "value"',
        '#if 0\n#include "outer"\n#endif\n#if 1\n#include "value"\n#endif\n#include "outer"',
        '#if 1\n# if 0\n#include "value"\n# endif\n#include "value"\n#endif',
    ],
    ids=["dead before", "live before", "dead, else", "live, elif", "by another file", "nested"],
)
def test_a_dead_include_hides_no_live_one(device, text):
    assert _compiled(device, text, value=_VALUE, outer='#include "value"\n') == 2.0


def test_package_files_and_layouts_are_found():
    source = assemble("sowing/sow.comp")
    files = {file for file, _, _ in source.runs}
    assert {"sowing/sow.comp", "sowing/sward.glsl", "shaders/hash.glsl", "layout/Sward", "layout/Ground"} <= files
    assert source.text.count("uvec3 hash3(") == 1


def test_missing_include_names_it():
    with pytest.raises((FileNotFoundError, KeyError), match="nowhere"):
        assemble("a", {}, {"a": '#include "nowhere.glsl"'})


@pytest.mark.parametrize("broken", ["inner", "middle", "outer"])
def test_a_real_error_names_file_and_line(device, broken):
    files = dict(_NESTED)
    files[broken] = "\n\n" + files[broken] + "\nfloat oops() { return nothing_of_this_name; }"
    files["outer"] += "\nlayout(local_size_x = 1) in;\nvoid main() {}"
    line = files[broken].splitlines().index("float oops() { return nothing_of_this_name; }") + 1
    with pytest.raises(ShaderError) as caught:
        Kernel(device, "outer", {"SOME": 1}, generated=files)
    assert f"{broken}:{line}:" in str(caught.value)
    assert "nothing_of_this_name" in str(caught.value)


def test_files_are_read_again_when_they_were_forgotten(monkeypatch, tmp_path):
    monkeypatch.setattr(shader_source, "files", lambda _: tmp_path)
    file = tmp_path / "one.glsl"
    for text in ("int a;", "int b;"):
        file.write_text(text)
        shader_source.forget_files()
        assert assemble("one.glsl").text.splitlines()[1:] == [text]
    monkeypatch.undo()
    shader_source.forget_files()


def test_a_stage_that_does_not_compile_names_its_file(device, monkeypatch):
    vertex = "shaders/screen.vert"
    texts = {vertex: ("", "", "void main() { wrong; }"), "passes/post/blit.frag": ("void main() {}",)}
    shader_source.forget_files()
    monkeypatch.setattr(shader_source, "read_lines", texts.__getitem__)
    with pytest.raises(ShaderError, match=rf"{vertex}:3:"):
        Draw(device, vertex, "passes/post/blit.frag")
    monkeypatch.undo()
    shader_source.forget_files()


@pytest.mark.parametrize(
    "position",
    ["0:4(12): error: ", "0(4) : error C1008: ", "ERROR: 0:4: ", "0:4(12) : warning: "],
    ids=["mesa", "nvidia", "others", "mesa with a blank"],
)
def test_positions_of_every_driver(position):
    sources = {
        "vertex_shader": Source("", (("a.vert", 0, 4),)),
        "fragment_shader": Source("", (("b.frag", 0, 2), ("c.glsl", 7, 2))),
    }
    said = locate(f"GLSL Compiler failed\n\nfragment_shader\n===\n{position}undefined x", sources)
    assert "c.glsl:8:" in said
    assert "undefined x" in said
    assert "a.vert:3:" in locate(f"vertex_shader\n{position}undefined x", sources)


def test_several_messages_and_lines_out_of_range():
    sources = {"compute_shader": Source("", (("x.comp", 0, 2),))}
    assert (
        locate("0:1(1): a\n0:2(3): b\n0:99(1): c\nat 12:30", sources)
        == "x.comp:0: a\nx.comp:1: b\n0:99(1): c\nat 12:30"
    )
