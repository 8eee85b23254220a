"""Textures repeated without visible tiling (ground/soil.glsl; Heitz & Neyret 2018, hexagons after Mikkelsen 2022)."""

import numpy as np
import pytest

from greensward.ground.ground_gpu import GROUND_BLOCK
from greensward.scene.ground import MOST_TILES
from oracles.hashing import hashes, unit
from shader_calls import shader_call

_PER_M = 0.37
_SKEW = np.array([[1.0, -1.0 / np.sqrt(3.0)], [0.0, 2.0 / np.sqrt(3.0)]]) * 1.7


def _call(device, body: str, output: str, xz: np.ndarray, tile: int = -1, **ground) -> np.ndarray:
    mean = np.zeros((MOST_TILES, 4), np.float32)
    mean[2, 3] = 1.9
    values = {"soil_per_m": _PER_M, "tile_mean": mean, **ground}
    return shader_call(
        device,
        "ground/soil.glsl",
        f"int tile = {tile}; Hexagons h = hexagonsAt(tile, xz); result = {body};",
        {"xz": xz.astype(np.float32)},
        output,
        blocks={GROUND_BLOCK: values},
    )


@pytest.mark.parametrize(("tile", "per_m"), [(-1, _PER_M), (2, 1.9)])
def test_hexagons_and_weights_are_those_around_a_place(device, tile, per_m):
    """Three neighbours of a lattice whose weighted mean is the place itself."""
    xz = np.random.default_rng(1).uniform(-20.0, 20.0, (400, 2))
    weight = _call(device, "h.weight", "vec3", xz, tile)
    lattice = np.stack([_call(device, f"vec2(h.{name})", "vec2", xz, tile) for name in "abc"], 1)
    assert weight.min() > -1e-4
    assert np.abs(weight.sum(1) - 1.0).max() < 1e-4
    assert np.abs((weight[..., None] * lattice).sum(1) - per_m * xz @ _SKEW.T).max() < 2e-4
    corners = lattice @ np.linalg.inv(_SKEW).T
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    assert edges == pytest.approx(1.0 / 1.7, abs=1e-6)


def test_the_copy_that_shows_most_is_that_of_the_heaviest_hexagon(device):
    xz = np.random.default_rng(2).uniform(-20.0, 20.0, (400, 2))
    weight = _call(device, "h.weight", "vec3", xz)
    lattice = np.stack([_call(device, f"vec2(h.{name})", "vec2", xz) for name in "abc"], 1).astype(int)
    place = _call(device, "likeliestCopy(tile, xz)", "vec2", xz)
    heaviest = lattice[np.arange(len(xz)), weight.argmax(1)]
    words = np.column_stack([heaviest.astype(np.int32).view(np.uint32), np.ones(len(xz), np.uint32)])
    assert np.abs(place - _PER_M * xz - unit(hashes(words))[:, :2]).max() < 1e-4
