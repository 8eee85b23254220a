"""Spheres that fill objects: inside, near all of the surface, few where few do, always the same."""

from pathlib import Path

import numpy as np
import pytest

from greensward.io.meshes import TriMesh
from greensward.objects.meshes import mesh_of
from greensward.objects.packing import packed
from greensward.scene import Box, Capsule, Cylinder, Mesh, Sphere

_HERE = {"position_m": (0.0, 0.0, 0.0)}
_SPOT = Path(__file__).parents[3] / "shared" / "data" / "spot.obj"
_THINGS = {
    "box": Box(kind="box", **_HERE),
    "plank": Box(kind="box", size_m=(2, 0.12, 0.02), **_HERE),
    "ellipsoid": Sphere(kind="sphere", size_m=(2, 3, 1), **_HERE),
    "cylinder": Cylinder(kind="cylinder", size_m=(2, 3, 2), **_HERE),
    "capsule": Capsule(kind="capsule", radius_m=0.5, length_m=3, **_HERE),
    "cow": Mesh(kind="mesh", file=str(_SPOT), **_HERE),
}


def _distances(mesh: TriMesh, spheres: np.ndarray) -> np.ndarray:
    """From points of the surface to the spheres, as parts of the size: negative inside one; (points,)."""
    random = np.random.default_rng(7)
    at = random.choice(len(mesh.areas), 20_000, p=mesh.areas / mesh.areas.sum())
    points = np.einsum("nk,nkj->nj", random.dirichlet((1, 1, 1), 20_000), mesh.positions[mesh.triangles[at]])
    away = np.linalg.norm(points[:, None] - spheres[:, :3], axis=2) - spheres[:, 3]
    return away.min(axis=1) / np.ptp(mesh.bounds, axis=0).max()


@pytest.mark.slow
@pytest.mark.parametrize("name", _THINGS)
def test_fills_without_sticking_out(name):
    if name == "cow":
        pytest.importorskip("trimesh")
        if not _SPOT.exists():
            pytest.skip("the shared data is not there")
    mesh = mesh_of(_THINGS[name], Path)
    spheres = packed(mesh)
    assert spheres.dtype == np.float64
    assert spheres.shape[1] == 4
    assert 1 <= len(spheres) <= 64
    away = _distances(mesh, spheres)
    assert away.min() > -0.02, "sticks out"
    assert np.quantile(away, 0.95) < 0.07
    assert np.maximum(away, 0).mean() < 0.03
    np.testing.assert_array_equal(packed(mesh), spheres)


def test_a_ball_is_one_sphere():
    mesh = mesh_of(Sphere(kind="sphere", size_m=(2, 2, 2), **_HERE), Path)
    (sphere,) = packed(mesh)
    np.testing.assert_allclose(sphere, [0, 1, 0, 1], atol=0.02)


def test_a_capsule_takes_few():
    spheres = packed(mesh_of(_THINGS["capsule"], Path))
    assert len(spheres) < 20
    np.testing.assert_allclose(spheres[:, 3], 0.5, atol=0.02)
    np.testing.assert_allclose(spheres[:, [0, 2]], 0, atol=0.03)


@pytest.mark.parametrize("most", [1, 5])
def test_no_more_than_asked_for(most):
    assert len(packed(mesh_of(_THINGS["box"], Path), most)) == most


def test_inside_out_is_filled_all_the_same():
    mesh = mesh_of(_THINGS["cylinder"], Path)
    turned = TriMesh(mesh.positions, mesh.triangles[:, ::-1], -mesh.normals)
    away = _distances(turned, packed(turned))
    assert away.min() > -0.02
    assert np.quantile(away, 0.95) < 0.07


def test_a_sheet_has_no_inside():
    sheet = TriMesh(
        np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]]),
        np.array([[0, 2, 1], [0, 3, 2]]),
        np.tile([0.0, 1.0, 0.0], (4, 1)),
    )
    assert packed(sheet).shape == (0, 4)
