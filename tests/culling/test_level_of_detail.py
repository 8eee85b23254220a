"""Level of detail shortens blades with distance: `lodFade` of culling/level_of_detail.glsl."""

from collections.abc import Mapping

import numpy as np
import pytest

from greensward.gpu.view import VIEW_BLOCK
from greensward.sowing.species import SWARD_BLOCK
from oracles import culling
from shader_calls import shader_call

_FULL, _REACH = 5.0, 40.0


def _fade(
    device,
    rank: np.ndarray,
    distance: np.ndarray,
    density: float = 1.0,
    name: str = "fade",
    defines: Mapping[str, object] = {},
) -> np.ndarray:
    body = (
        "Blade b; b.chance = packUnorm2x16(vec2(sqrt(rank), 0.0));"
        f" float fade = lodFade(b, d), area = lodArea(d, view.density); result = {name};"
    )
    return shader_call(
        device,
        "culling/level_of_detail.glsl",
        body,
        {"rank": rank.astype(np.float32), "d": distance.astype(np.float32)},
        "float",
        blocks={
            SWARD_BLOCK: {"full_density_m": _FULL, "reach_m": _REACH, "blades_m": _REACH},
            VIEW_BLOCK: {"density": density},
        },
        defines=defines,
    )


def _grid() -> tuple[np.ndarray, np.ndarray]:
    rank, distance = np.meshgrid((np.arange(50) + 0.5) / 50, np.linspace(0.1, 45, 450), indexing="ij")
    return rank.ravel(), distance.ravel()


@pytest.mark.parametrize("density", [1.0, 0.5])
def test_every_blade_is_full_grown_near_the_camera(device, density):
    rank, distance = _grid()
    fade = _fade(device, rank, distance, density)
    near = distance < 0.85 * _FULL
    assert (fade[near & (rank < density - 0.01)] == 1.0).all()
    assert (fade[rank > density + 0.01] == 0.0).all()


@pytest.mark.parametrize("density", [1.0, 0.5])
def test_no_blade_is_drawn_that_was_not_kept(device, density):
    """Sowing and culling leave out what ranks above the kept share."""
    rank, distance = _grid()
    kept = np.minimum(1.0, (_FULL / distance) ** 2) * density
    fade = _fade(device, rank, distance, density)
    assert (fade[rank > kept * 1.001] == 0.0).all()
    assert (fade[distance >= _REACH] == 0.0).all()
    assert (fade[(rank < 0.79 * kept) & (distance < 0.8 * _REACH)] == 1.0).all()


def test_blades_shrink_steadily_with_distance(device):
    rank, distance = _grid()
    fade = _fade(device, rank, distance).reshape(50, -1)
    assert (np.diff(fade, axis=1) <= 1e-6).all()
    assert np.abs(np.diff(fade[:20], axis=1)).max() < 0.25, "one step of ten centimetres makes it pop"


@pytest.mark.parametrize("density", [1.0, 0.3])
def test_area_that_is_there_is_that_of_all_blades_by_their_fade(device, density):
    distance = np.linspace(0.1, 0.8 * _REACH, 300)
    area = _fade(device, np.zeros(300), distance, density, "area")
    assert np.abs(area / culling.area_there(distance, _FULL, _REACH, density) - 1).max() < 1e-3
    assert np.allclose(area[distance < 0.85 * _FULL], density)


def test_a_view_without_blades_has_none(device):
    rank, distance = _grid()
    assert (_fade(device, np.append(rank, 0.0), np.append(distance, 0.0), 0.0) == 0.0).all()


@pytest.mark.parametrize("density", [1.0, 0.3])
def test_against_the_oracle(device, density):
    rank, distance = _grid()
    expected = culling.presence(rank, distance, _FULL, _REACH, density)
    away_from_steps = np.abs(rank - density) > 1e-4  # ranks are stored in 16 bits
    assert np.abs(_fade(device, rank, distance, density) - expected)[away_from_steps].max() < 2e-3


@pytest.mark.parametrize("density", [1.0, 0.5])
def test_all_distances_are_alike_without_the_test(device, density):
    rank, distance = _grid()
    every = {"ALL_DISTANCES": 1}
    fade, area = (_fade(device, rank, distance, density, name, every) for name in ("fade", "area"))
    assert (fade == ((rank <= density) & (distance < _REACH))).all()
    assert np.allclose(area, density)
