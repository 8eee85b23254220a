"""Outlines and segments of Bézier blades against the spec's formulas."""

import numpy as np
import pytest

from greensward.scene.grass import SHAPES
from greensward.techniques.blades.leaf import LEAF_BLOCK
from oracles import bezier, shapes
from shader_calls import cut, shader_call

_SHAPES = "techniques/blades/outlines.glsl"


def _grid() -> dict[str, np.ndarray]:
    u, v, width_px = np.meshgrid(
        np.linspace(0, 1, 11), np.linspace(0, 1, 21), [0.2, 1.0, 1.5, 2.0, 2.9, 3.0, 8.0], indexing="ij"
    )
    return {name: a.ravel().astype(np.float32) for name, a in (("u", u), ("v", v), ("px", width_px))}


def _outline(device, shape: str, grid: dict[str, np.ndarray]) -> np.ndarray:
    return shader_call(device, _SHAPES, f"shapeParameter({SHAPES.index(shape)}, u, v, px)", grid, "float")


@pytest.mark.parametrize("shape", [shape for shape in SHAPES if shape != "dandelion"])
def test_outline(device, shape):
    grid = _grid()
    expected = shapes.parameter(shape, *(grid[name].astype(np.float64) for name in ("u", "v", "px")))
    assert np.abs(_outline(device, shape, grid) - expected).max() < 1e-6


@pytest.mark.parametrize("shape", SHAPES)
def test_outline_keeps_its_order_within_the_width(device, shape):
    grid = _grid()
    across = _outline(device, shape, grid).reshape(11, 21, 7)
    beyond = 0.0101 if shape == "dandelion" else 1e-6  # its widest lobes reach a hundredth of the width out
    assert across.min() >= -beyond
    assert across.max() <= 1 + beyond
    assert (np.diff(across, axis=0) > -1e-6).all()


@pytest.mark.parametrize("shape", [s for s in SHAPES if s not in ("quad", "minimum-width")])
def test_blade_comes_to_a_point(device, shape):
    grid = {"u": np.linspace(0, 1, 5, dtype="f4"), "v": np.ones(5, "f4"), "px": np.full(5, 9.0, "f4")}
    assert np.ptp(_outline(device, shape, grid)) < 1e-6


def test_dandelion_has_three_pairs_of_lobes(device):
    """Reading chosen for the spec's words "lobes by |sin|·|cos| of the level"."""
    v = np.linspace(0, 1, 601, dtype="f4")
    wide = [
        _outline(device, "dandelion", {"u": np.full_like(v, u), "v": v, "px": np.full_like(v, 9)}) for u in (0.0, 1.0)
    ]
    width = wide[1] - wide[0]
    assert np.abs(wide[0] + wide[1] - 1).max() < 1e-6
    peaks = np.flatnonzero((width[1:-1] > width[:-2]) & (width[1:-1] >= width[2:])) + 1
    assert len(peaks) == 3
    assert width[peaks].max() == width[peaks[len(peaks) // 2 :]].max()


@pytest.mark.parametrize("shape", SHAPES)
def test_fold(device, shape):
    grid = _grid()
    got = shader_call(device, _SHAPES, f"shapeFold({SHAPES.index(shape)}, u, v)", grid, "float")
    assert np.abs(got - shapes.fold(shape, grid["u"], grid["v"])).max() < 1e-6


@pytest.mark.parametrize("error_px", [0.1, 0.3, 2.0])
def test_segments_keep_the_curve_and_are_no_more_than_needed(device, error_px):
    random = np.random.default_rng(8)
    count, pixel = 60, 0.004
    v0 = np.zeros((count, 3), np.float32)
    v1 = random.uniform(-0.3, 0.3, (count, 3)).astype(np.float32)
    v2 = random.uniform(-0.5, 0.5, (count, 3)).astype(np.float32)
    got = shader_call(
        device,
        "layout/Leaf",
        f"segments(v0, v1, v2, 0.0, {pixel}, 0.0)",
        {"v0": v0, "v1": v1, "v2": v2},
        "float",
        blocks={LEAF_BLOCK: {"error_px": error_px, "max_level": 64.0}},
        source=cut("techniques/blades/leaf.glsl", "segments"),
    )
    assert len(np.unique(got)) > 3
    for a, b, c, n in zip(*(v.astype(np.float64) for v in (v0, v1, v2)), got.astype(int), strict=True):
        assert bezier.farthest_from_chords(a, b, c, n) <= error_px * pixel * 1.001
        if n > 2:  # the bound is tight for equal steps up to the curve's own parameter speed
            bend = np.linalg.norm(a - 2 * b + c) / (4 * (n - 1) ** 2)
            assert bend > error_px * pixel


@pytest.mark.parametrize(("shape", "most", "expected"), [(0, 1, 1), (0, 7, 7), (6, 4, 18), (6, 40, 40)])
def test_segments_stay_within_limits(device, shape, most, expected):
    """A bent blade over thousands of pixels; a dandelion's lobes need their eighteen."""
    points = {name: np.array([p], "f4") for name, p in (("a", [0, 0, 0]), ("b", [0, 9, 0]), ("c", [9, 9, 0]))}
    got = shader_call(
        device,
        "layout/Leaf",
        f"segments(a, b, c, 0.1, 0.0001, {shape}.0)",
        points,
        "float",
        blocks={LEAF_BLOCK: {"error_px": 0.3, "max_level": float(most)}},
        source=cut("techniques/blades/leaf.glsl", "segments"),
    )
    assert got[0] == expected
