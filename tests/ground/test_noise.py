"""Simplex noise as NumPy makes it; its GLSL twin is tested in tests/shaders."""

import numpy as np
import pytest

from greensward.ground.noise import octaves, simplex

_P = np.random.default_rng(1).uniform(-500, 500, (2, 200_000))


def test_range_and_mean():
    noise = simplex(*_P)
    assert np.abs(noise).max() <= 1.6
    assert np.abs(noise).max() > 0.8
    assert abs(noise.mean()) < 0.01
    assert 0.3 < noise.std() < 0.6


def test_continuous_with_a_bounded_slope():
    step = 1e-4
    noise = simplex(*_P)
    for dx, dy in ((step, 0), (0, step)):
        assert np.abs(simplex(_P[0] + dx, _P[1] + dy) - noise).max() < 12 * step


def test_zero_at_the_corners_of_its_grid():
    i, j = np.meshgrid(np.arange(-6, 6), np.arange(-6, 6))
    g = (3 - np.sqrt(3)) / 6
    assert np.abs(simplex(i - (i + j) * g, j - (i + j) * g, 9)).max() < 1e-9


def test_no_direction_is_preferred():
    noise = simplex(*_P)
    steps = [
        simplex(_P[0] + 0.2 * np.cos(a), _P[1] + 0.2 * np.sin(a)) - noise
        for a in np.linspace(0, np.pi, 6, endpoint=False)
    ]
    spread = [step.std() for step in steps]
    assert max(spread) < 1.15 * min(spread)


def test_seeds_are_unrelated():
    a, b = simplex(*_P, 1), simplex(*_P, 2)
    assert abs(np.corrcoef(a, b)[0, 1]) < 0.02


def test_one_octave_is_plain_noise_and_weights_add_up_to_one():
    assert np.array_equal(octaves(*_P, 4, 1, 0.5, 2.0), simplex(*_P, 4))
    assert np.array_equal(octaves(*_P, 4, 5, 0.0, 2.0), simplex(*_P, 4))
    assert np.abs(octaves(*_P, 4, 6, 0.9, 2.1)).max() <= 1.6


@pytest.mark.parametrize("shape", [(), (3,), (2, 1, 4)])
def test_shapes_broadcast(shape):
    assert simplex(np.zeros(shape), 0.5).shape == shape
    assert octaves(np.zeros(shape), 0.5, 1, 2, 0.5, 2.0).shape == shape
