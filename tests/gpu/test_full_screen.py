"""A full-screen pass gives the same picture in either stage."""

import moderngl
import numpy as np
import pytest

from greensward.gpu import shader_source
from greensward.gpu.full_screen import FullScreenPass
from greensward.gpu.shader_source import ShaderError
from small_scenes import BREEZE, NOISE, small_scene

_STAGES = ("fragment", "compute")


@pytest.fixture
def written(monkeypatch):
    """Puts a shader file's text in place of the package's files."""
    real = shader_source.read_lines

    def write(name: str, text: str) -> str:
        monkeypatch.setattr(
            shader_source, "read_lines", lambda path: tuple(text.splitlines()) if path == name else real(path)
        )
        return name

    return write


def _read(texture: moderngl.Texture, dtype: str) -> np.ndarray:
    return np.frombuffer(texture.read(), dtype).reshape(texture.height, texture.width, -1)


@pytest.mark.parametrize("size", [(1, 1), (7, 9), (8, 8), (33, 17)])
@pytest.mark.parametrize("stage", _STAGES)
def test_every_pixel_is_shaded_at_its_place(device, written, stage, size):
    path = written(
        "where.glsl",
        "bool shade(ivec2 pixel, out vec4 result[TARGETS]) { result[0] = vec4(pixel, 0.25, 1.0); return true; }",
    )
    each = FullScreenPass(device, path, ["f4"], stage=stage)
    target = device.ctx.texture(size, 4, dtype="f4")
    each.run(target)
    got = _read(target, "f4")
    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    assert np.array_equal(got[..., 0], x)
    assert np.array_equal(got[..., 1], y)
    assert (got[..., 2:] == [0.25, 1.0]).all()
    target.release()
    each.release()


@pytest.mark.parametrize("stage", _STAGES)
def test_several_targets_and_pixels_that_are_left_alone(device, written, stage):
    path = written(
        "some.glsl",
        "bool shade(ivec2 pixel, out vec4 result[TARGETS]) {\n"
        "    result[0] = vec4(1.0); result[1] = vec4(LEVEL);\n    return (pixel.x & 1) == 0;\n}",
    )
    each = FullScreenPass(device, path, ["f1", "f4"], stage=stage, defines={"LEVEL": 2.5})
    colour, value = (
        device.ctx.texture((6, 4), 4, bytes([9] * 96)),
        device.ctx.texture((6, 4), 4, np.full(96, 7, "f4"), dtype="f4"),
    )
    each.run(colour, value)
    assert (_read(colour, "u1")[:, ::2] == 255).all()
    assert (_read(colour, "u1")[:, 1::2] == 9).all()
    assert (_read(value, "f4")[:, ::2] == 2.5).all()
    assert (_read(value, "f4")[:, 1::2] == 7).all()
    for part in (colour, value, each):
        part.release()


@pytest.mark.parametrize("stage", _STAGES)
def test_a_new_target_with_an_old_name_is_drawn_into(device, stage):
    """OpenGL gives the names of deleted textures away again."""
    each = FullScreenPass(device, "passes/post/encode.glsl", ["f1"], stage=stage)
    source = device.ctx.texture((64, 64), 4, np.full((64, 64, 4), 0.5, "f4").tobytes(), dtype="f4")
    for size in ((16, 16), (32, 8), (16, 16)):
        target = device.ctx.texture(size, 4, dtype="f1")
        target._glo = 77  # Mesa waits long before it reuses a name, NVIDIA does not
        each.run(target, picture=source)
        assert (np.abs(_read(target, "u1")[..., :3].astype(int) - 188) <= 1).all()
        target.release()
    source.release()
    each.release()


@pytest.mark.parametrize("stage", _STAGES)
def test_an_error_names_the_shader_file(device, written, stage):
    path = written("bad.glsl", "// fine\nbool shade(ivec2 pixel, out vec4 result[TARGETS]) { return unheard_of; }")
    with pytest.raises(ShaderError, match=r"bad\.glsl:2:"):
        FullScreenPass(device, path, ["f4"], stage=stage)


@pytest.mark.parametrize("samples", [1, 3])
def test_a_frame_is_the_same_in_both_stages(renderer, samples):
    """Ground, lighting, sky, tone and encoding together."""
    scene = small_scene(
        technique={"name": "bezier-blades"},  # whose ground is of triangles in both
        ground=NOISE,
        wind=[BREEZE],
        sky={"clouds": 0.5},
        camera={"target_m": [0.0, 1.0, -3.0]},
    )
    frames = [renderer(scene, stage=stage, samples=samples).render(1.0).image for stage in _STAGES]
    difference = np.abs(frames[0].astype(int) - frames[1])
    assert difference.max() <= 1
    assert frames[0].std() > 10
