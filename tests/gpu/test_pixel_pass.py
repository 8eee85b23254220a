"""A full-screen pass gives the same picture in either shell."""

import moderngl
import numpy as np
import pytest

from greensward.gpu import program
from greensward.gpu.context import is_software
from greensward.gpu.pixel_pass import PixelPass, best_shell
from greensward.gpu.program import ShaderError
from small_scenes import BREEZE, NOISE, small_scene

_SHELLS = ("fragment", "compute")


@pytest.fixture
def written(monkeypatch):
    """Puts a shader file's text in place of the package's files."""
    real = program._read

    def write(name: str, text: str) -> str:
        monkeypatch.setattr(program, "_read", lambda path: tuple(text.splitlines()) if path == name else real(path))
        return name

    return write


def _read(texture: moderngl.Texture, dtype: str) -> np.ndarray:
    return np.frombuffer(texture.read(), dtype).reshape(texture.height, texture.width, -1)


@pytest.mark.parametrize("size", [(1, 1), (7, 9), (8, 8), (33, 17)])
@pytest.mark.parametrize("shell", _SHELLS)
def test_every_pixel_is_shaded_at_its_place(ctx, written, shell, size):
    path = written(
        "where.glsl",
        "bool shade(ivec2 pixel, out vec4 result[TARGETS]) { result[0] = vec4(pixel, 0.25, 1.0); return true; }",
    )
    each = PixelPass(ctx, path, ["f4"], shell=shell)
    target = ctx.texture(size, 4, dtype="f4")
    each.run(target)
    got = _read(target, "f4")
    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    assert np.array_equal(got[..., 0], x)
    assert np.array_equal(got[..., 1], y)
    assert (got[..., 2:] == [0.25, 1.0]).all()
    target.release()
    each.release()


@pytest.mark.parametrize("shell", _SHELLS)
def test_several_targets_and_pixels_that_are_left_alone(ctx, written, shell):
    path = written(
        "some.glsl",
        "bool shade(ivec2 pixel, out vec4 result[TARGETS]) {\n"
        "    result[0] = vec4(1.0); result[1] = vec4(LEVEL);\n    return (pixel.x & 1) == 0;\n}",
    )
    each = PixelPass(ctx, path, ["f1", "f4"], shell=shell, defines={"LEVEL": 2.5})
    colour, value = ctx.texture((6, 4), 4, bytes([9] * 96)), ctx.texture((6, 4), 4, np.full(96, 7, "f4"), dtype="f4")
    each.run(colour, value)
    assert (_read(colour, "u1")[:, ::2] == 255).all()
    assert (_read(colour, "u1")[:, 1::2] == 9).all()
    assert (_read(value, "f4")[:, ::2] == 2.5).all()
    assert (_read(value, "f4")[:, 1::2] == 7).all()
    for part in (colour, value, each):
        part.release()


@pytest.mark.parametrize("shell", _SHELLS)
def test_a_new_target_with_an_old_name_is_drawn_into(ctx, shell):
    """OpenGL gives the names of deleted textures away again."""
    each = PixelPass(ctx, "passes/post/encode.glsl", ["f1"], shell=shell)
    source = ctx.texture((64, 64), 4, np.full((64, 64, 4), 0.5, "f4").tobytes(), dtype="f4")
    for size in ((16, 16), (32, 8), (16, 16)):
        target = ctx.texture(size, 4, dtype="f1")
        target._glo = 77  # Mesa waits long before it reuses a name, NVIDIA does not
        source.use(10)
        each.run(target)
        assert (np.abs(_read(target, "u1")[..., :3].astype(int) - 188) <= 1).all()
        target.release()
    source.release()
    each.release()


@pytest.mark.parametrize("shell", _SHELLS)
def test_an_error_names_the_shader_file(ctx, written, shell):
    path = written("bad.glsl", "// fine\nbool shade(ivec2 pixel, out vec4 result[TARGETS]) { return unheard_of; }")
    with pytest.raises(ShaderError, match=r"bad\.glsl:2:"):
        PixelPass(ctx, path, ["f4"], shell=shell)


def test_software_drivers_draw_fragments_and_gpus_compute(ctx):
    assert best_shell(ctx) == ("fragment" if is_software(ctx) else "compute")


@pytest.mark.parametrize("samples", [1, 3])
def test_a_frame_is_the_same_in_both_shells(renderer, samples):
    """Ground, lighting, sky, tone and encoding together."""
    scene = small_scene(
        technique={"name": "bezier-blades"},  # whose ground is of triangles in both
        ground=NOISE,
        wind=[BREEZE],
        sky={"clouds": 0.5},
        camera={"target_m": [0.0, 1.0, -3.0]},
    )
    frames = [renderer(scene, shell=shell, samples=samples).render(1.0).image for shell in _SHELLS]
    difference = np.abs(frames[0].astype(int) - frames[1])
    assert difference.max() <= 1
    assert frames[0].std() > 10
