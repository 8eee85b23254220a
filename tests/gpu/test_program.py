"""Includes and the line map: an error names the file and line that a person wrote."""

import pytest

from greensward.gpu.program import ShaderError, Source, assemble, build, build_compute, locate

_NESTED = {
    "outer": '// one\n#include "middle"\n#include "inner"\nfloat outer() { return middle(); }',
    "middle": '#include "inner"\nfloat middle() { return inner(); }',
    "inner": "float inner() { return 1.0; }",
}


def test_each_include_is_inlined_once_where_it_is_first_needed():
    source = assemble("outer", {"LEVEL": 3, "FAST": "true"}, _NESTED)
    lines = source.text.splitlines()
    assert lines[:3] == ["#version 430 core", "#define LEVEL 3", "#define FAST true"]
    assert lines[3:] == [
        "// one",
        _NESTED["inner"],
        "float middle() { return inner(); }",
        "float outer() { return middle(); }",
    ]
    assert source.origin[3:] == (("outer", 1), ("inner", 1), ("middle", 2), ("outer", 4))
    assert len(source.origin) == len(lines)


def test_files_that_include_each_other_end():
    loop = {"a": '#include "b"\nint a;', "b": '#include "a"\nint b;'}
    assert assemble("a", {}, loop).text.splitlines()[1:] == ["int b;", "int a;"]


def test_package_files_and_blocks_are_found():
    source = assemble("sowing/sow.comp")
    files = {file for file, _ in source.origin}
    assert {"sowing/sow.comp", "sowing/sward.glsl", "shaders/hash.glsl", "block/Sward", "block/Ground"} <= files
    assert source.text.count("uvec3 hash3(") == 1


def test_missing_include_names_it():
    with pytest.raises((FileNotFoundError, KeyError), match="nowhere"):
        assemble("a", {}, {"a": '#include "nowhere.glsl"'})


@pytest.mark.parametrize("broken", ["inner", "middle", "outer"])
def test_a_real_error_names_file_and_line(ctx, broken):
    files = dict(_NESTED)
    files[broken] = "\n\n" + files[broken] + "\nfloat oops() { return nothing_of_this_name; }"
    files["outer"] += "\nlayout(local_size_x = 1) in;\nvoid main() {}"
    line = files[broken].splitlines().index("float oops() { return nothing_of_this_name; }") + 1
    with pytest.raises(ShaderError) as caught:
        build_compute(ctx, "outer", {"SOME": 1}, files)
    assert f"{broken}:{line}:" in str(caught.value)
    assert "nothing_of_this_name" in str(caught.value)


def test_a_stage_that_does_not_compile_names_its_file(ctx, monkeypatch):
    from greensward.gpu import program

    vertex = "shaders/screen.vert"
    monkeypatch.setattr(
        program, "_read", lambda path: ("", "", "void main() { wrong; }" if path == vertex else "void main() {}")
    )
    with pytest.raises(ShaderError, match=rf"{vertex}:3:"):
        build(ctx, vertex, "passes/post/blit.frag")


@pytest.mark.parametrize(
    "position",
    ["0:4(12): error: ", "0(4) : error C1008: ", "ERROR: 0:4: ", "0:4(12) : warning: "],
    ids=["mesa", "nvidia", "others", "mesa with a blank"],
)
def test_positions_of_every_driver(position):
    sources = {
        "vertex_shader": Source("", (("a.vert", 0), ("a.vert", 1), ("a.vert", 2), ("a.vert", 3))),
        "fragment_shader": Source("", (("b.frag", 0), ("b.frag", 1), ("c.glsl", 7), ("c.glsl", 8))),
    }
    said = locate(f"GLSL Compiler failed\n\nfragment_shader\n===\n{position}undefined x", sources)
    assert "c.glsl:8:" in said
    assert "undefined x" in said
    assert "a.vert:3:" in locate(f"vertex_shader\n{position}undefined x", sources)


def test_several_messages_and_lines_out_of_range():
    sources = {"compute_shader": Source("", (("x.comp", 0), ("x.comp", 1)))}
    assert (
        locate("0:1(1): a\n0:2(3): b\n0:99(1): c\nat 12:30", sources)
        == "x.comp:0: a\nx.comp:1: b\n0:99(1): c\nat 12:30"
    )
