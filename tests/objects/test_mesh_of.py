"""Surfaces of objects in their own space: closed, outward, on their base, as large as the scene says."""

from pathlib import Path

import numpy as np
import pytest

from greensward.io.meshes import TriMesh
from greensward.objects.meshes import mesh_of
from greensward.scene import Box, Capsule, Cylinder, InputError, Mesh, Sphere

_HERE = {"position_m": (3.0, 1.0, 2.0), "yaw_deg": 30.0, "roll_deg": 20.0}
_SOLIDS = {
    "box": (Box(kind="box", size_m=(1, 2, 3), **_HERE), (1, 2, 3), 22.0, 6.0),
    "ball": (Sphere(kind="sphere", size_m=(2, 2, 2), **_HERE), (2, 2, 2), 4 * np.pi, 4 / 3 * np.pi),
    "ellipsoid": (Sphere(kind="sphere", size_m=(2, 3, 1), **_HERE), (2, 3, 1), 12.25, np.pi),
    "cylinder": (Cylinder(kind="cylinder", size_m=(2, 3, 2), **_HERE), (2, 3, 2), 8 * np.pi, 3 * np.pi),
    "capsule": (Capsule(kind="capsule", radius_m=0.5, length_m=3, **_HERE), (1, 3, 1), 3 * np.pi, np.pi * 2 / 3),
    "short capsule": (Capsule(kind="capsule", radius_m=0.5, length_m=1, **_HERE), (1, 1, 1), np.pi, np.pi / 6),
}
_SPOT = Path(__file__).parents[3] / "shared" / "data" / "spot.obj"


def _flat(mesh: TriMesh) -> np.ndarray:
    a, b, c = (mesh.positions[mesh.triangles[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    return cross / np.linalg.norm(cross, axis=1, keepdims=True)


@pytest.mark.parametrize("name", _SOLIDS)
def test_solids_have_their_size_and_stand_on_their_base(name):
    thing, size, area, volume = _SOLIDS[name]
    mesh = mesh_of(thing, Path)
    np.testing.assert_allclose(mesh.bounds, [[-size[0] / 2, 0, -size[2] / 2], [size[0] / 2, size[1], size[2] / 2]])
    assert mesh.areas.min() > 0
    assert mesh.areas.sum() == pytest.approx(area, rel=0.004)
    a, b, c = (mesh.positions[mesh.triangles[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(volume, rel=0.003)


@pytest.mark.parametrize("name", _SOLIDS)
def test_solids_are_closed_and_turned_outward(name):
    mesh = mesh_of(_SOLIDS[name][0], Path)
    _, place = np.unique(np.round(mesh.positions, 9), axis=0, return_inverse=True)
    triangles = place.reshape(-1)[mesh.triangles]
    edges = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    there, back = ({(int(a), int(b)) for a, b in each} for each in (edges, edges[:, ::-1]))
    assert there == back
    assert len(there) == len(edges)
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0)
    assert np.einsum("mj,mij->mi", _flat(mesh), mesh.normals[mesh.triangles]).min() > 0.99
    assert mesh.uv is not None
    assert mesh.uv.min() == 0
    assert mesh.uv.max() == 1


def test_normals_of_an_ellipsoid():
    mesh = mesh_of(_SOLIDS["ellipsoid"][0], Path)
    gradient = (mesh.positions - [0, 1.5, 0]) / np.array([2, 3, 1]) ** 2
    np.testing.assert_allclose(mesh.normals, gradient / np.linalg.norm(gradient, axis=1, keepdims=True), atol=1e-9)


def test_a_mesh_is_scaled_and_put_on_its_lowest_point(tmp_path):
    pytest.importorskip("trimesh")
    (tmp_path / "a.obj").write_text("v 1 5 1\nv 3 5 1\nv 1 9 2\nf 1 2 3\n")
    mesh = mesh_of(Mesh(kind="mesh", file="a.obj", scale=0.5, **_HERE), tmp_path.joinpath)
    np.testing.assert_allclose(mesh.bounds, [[-0.5, 0, -0.25], [0.5, 2, 0.25]])
    with pytest.raises(InputError, match=r"b\.obj: no such file"):
        mesh_of(Mesh(kind="mesh", file="b.obj", **_HERE), tmp_path.joinpath)


@pytest.mark.skipif(not _SPOT.exists(), reason="the shared data is not there")
def test_a_cow():
    pytest.importorskip("trimesh")
    mesh = mesh_of(Mesh(kind="mesh", file=str(_SPOT), scale=2.0, **_HERE), Path)
    assert len(mesh.triangles) == 5856
    assert mesh.areas.sum() == pytest.approx(4 * 5.7095, rel=1e-4)
    assert mesh.bounds[0, 1] == 0
    assert np.einsum("mj,mij->mi", _flat(mesh), mesh.normals[mesh.triangles]).min() > 0.7


@pytest.mark.parametrize(
    ("file", "up", "size"), [("zup.obj", "z", (4, 1, 2)), ("zup.obj", "y", (4, 2, 1)), ("plain.glb", "y", (4, 1, 2))]
)
def test_the_axis_of_a_file_that_is_up(file, up, size):
    folder = Path(__file__).parents[1] / "io" / "meshes"
    mesh = mesh_of(Mesh(position_m=(0, 0, 0), file=file, up=up, scale=0.5), lambda name: folder / name)
    x, y, z = (0.5 * edge for edge in size)
    np.testing.assert_allclose(mesh.bounds, [[-x / 2, 0, -z / 2], [x / 2, y, z / 2]], atol=1e-6)
    assert (np.einsum("mj,mj->m", _flat(mesh), mesh.positions[mesh.triangles].mean(axis=1) - [0, y / 2, 0]) > 0).all()
    assert np.einsum("mj,mij->mi", _flat(mesh), mesh.normals[mesh.triangles]).min() > 0.99
