"""Meshes in: every format, joined and with normals; and every way in which a file may be wrong."""

import base64
import json
import os
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from greensward.cli.check import _read
from greensward.io import meshes
from greensward.io.meshes import ENDINGS, read_mesh
from greensward.scene.errors import InputError, SceneError
from greensward.scene.load import load

trimesh = pytest.importorskip("trimesh")

KEPT = Path(__file__).parent / "meshes"
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


def written(path, text):
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def exported(folder, shape, ending, **options):
    path = folder / f"shape{ending}"
    if ending == ".gltf":
        for name, data in shape.export(file_type="gltf").items():
            written(folder / name, data)
        return folder / "model.gltf"
    shape.export(path, **options)
    return path


def refused(path, painted=False):
    with pytest.raises(InputError) as caught:
        read_mesh(path, painted)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{path.parent if painted else path}")
    return line.removeprefix(f"{path}: ")


@pytest.fixture(autouse=True)
def _silent(recwarn, capfd):
    """Nothing is printed, logged to the screen or warned of, whatever the file."""
    yield
    assert not recwarn.list
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_ball_of_every_format(tmp_path, ending):
    ball = trimesh.creation.icosphere(subdivisions=3)
    if ending != ".stl":  # it cannot hold any
        ball.visual.vertex_colors = np.random.default_rng(0).integers(0, 255, (len(ball.vertices), 4))
    mesh = read_mesh(exported(tmp_path, ball, ending))
    assert mesh.positions.dtype == mesh.normals.dtype == np.float64
    assert mesh.triangles.dtype == np.int64
    assert len(mesh.triangles) == len(ball.faces)
    assert mesh.areas.sum() == pytest.approx(ball.area, rel=1e-5)
    np.testing.assert_allclose(mesh.bounds, ball.bounds, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-9)
    np.testing.assert_allclose(mesh.normals, mesh.positions, atol=0.01)  # smooth, and outward
    if ending == ".stl":
        assert mesh.colours is None
    else:
        assert mesh.colours is not None
        assert mesh.colours.dtype == np.float32
        np.testing.assert_allclose(
            mesh.colours[:, :3].mean(axis=0), ball.visual.vertex_colors[:, :3].mean(axis=0) / 255, atol=0.003
        )


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_box_keeps_its_edges(tmp_path, ending):
    mesh = read_mesh(exported(tmp_path, trimesh.creation.box((1, 2, 3)), ending))
    corners = mesh.positions[mesh.triangles]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    if ending in (".obj", ".stl"):  # into the others trimesh writes normals of its own
        np.testing.assert_allclose(mesh.normals[mesh.triangles], np.repeat(flat[:, None], 3, 1), atol=1e-9)
    assert mesh.areas.sum() == pytest.approx(22)
    assert (np.einsum("ij,ij->i", flat, corners.mean(axis=1)) > 0).all()


def test_normals_of_the_file_are_kept(tmp_path):
    path = written(tmp_path / "a.obj", TRIANGLE + "vn 0 3 4\nf 1//1 2//1 3//1\n")
    np.testing.assert_allclose(read_mesh(path).normals, [[0, 0.6, 0.8]] * 3)


@pytest.mark.parametrize("normal", ["0 0 0", "nan 0 1"])
def test_normals_without_direction_are_computed(tmp_path, normal):
    path = written(tmp_path / "a.obj", TRIANGLE + f"vn {normal}\nf 1//1 2//1 3//1\n")
    np.testing.assert_allclose(read_mesh(path).normals, [[0, 0, 1]] * 3)


def test_texture_coordinates_rise_from_the_bottom_in_every_format(tmp_path):
    obj = written(tmp_path / "a.obj", TRIANGLE + "vt 0 0.25\nvt 1 0.25\nvt 0 1\nf 1/1 2/2 3/3\n")
    expected = {(0, 0): (0, 0.25), (1, 0): (1, 0.25), (0, 1): (0, 1)}
    paths = [obj]
    shape = trimesh.load_mesh(obj, process=False)
    paths += [exported(tmp_path, shape, ending) for ending in (".glb", ".gltf")]
    for path in paths:
        mesh = read_mesh(path)
        assert mesh.uv is not None
        assert mesh.uv.dtype == np.float32
        for place, uv in zip(mesh.positions, mesh.uv, strict=True):
            assert tuple(uv) == pytest.approx(expected[tuple(place[:2])])


def test_parts_are_joined_where_the_scene_places_them(tmp_path):
    scene = trimesh.Scene()
    box = trimesh.creation.box((1, 1, 1))
    box.visual.vertex_colors = [255, 0, 0, 255]
    mirrored = np.diag([-2.0, 2.0, 2.0, 1.0])
    mirrored[:3, 3] = 10, 0, 0
    scene.add_geometry(box)
    scene.add_geometry(trimesh.creation.icosphere(radius=1), transform=mirrored)
    mesh = read_mesh(exported(tmp_path, scene, ".glb"))
    np.testing.assert_allclose(mesh.bounds, [[-0.5, -2, -2], [12, 2, 2]], atol=0.02)
    ball = mesh.positions[:, 0] > 5
    outward = (mesh.positions[ball] - [10, 0, 0]) / 2
    np.testing.assert_allclose(mesh.normals[ball], outward, atol=0.02)
    corners = mesh.positions[mesh.triangles]
    volume = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert volume == pytest.approx(1 + trimesh.creation.icosphere(radius=1).volume * 8, rel=1e-4)
    assert mesh.colours is not None
    np.testing.assert_allclose(mesh.colours[~ball][0], [1, 0, 0, 1])
    np.testing.assert_allclose(mesh.colours[ball][0][3], 1)


def test_colours_beside_texture_coordinates(tmp_path):
    text = "v 0 0 0 1 0 0\nv 1 0 0 0.5 0 0\nv 0 1 0 0 0 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"
    mesh = read_mesh(written(tmp_path / "a.obj", text))
    assert mesh.uv is not None
    assert mesh.colours is not None
    np.testing.assert_allclose(mesh.colours[:, 0], [1, 0.5, 0], atol=0.01)


def test_what_has_no_area_is_left_out(tmp_path):
    more = "v 9 9 9\nv 2 0 0\nf 1 2 3\nf 1 2 2\nf 1 2 5\n"
    mesh = read_mesh(written(tmp_path / "a.obj", TRIANGLE + more))
    assert len(mesh.triangles) == 1
    assert len(mesh.positions) == 3
    assert np.isfinite(mesh.normals).all()


def test_a_fan_of_three_at_one_edge_is_fine(tmp_path):
    text = TRIANGLE + "v 0 0 1\nv 0 0 -1\nf 1 2 3\nf 1 2 4\nf 1 2 5\n"
    mesh = read_mesh(written(tmp_path / "a.obj", text))
    assert len(mesh.triangles) == 3
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1)


def test_quads_are_cut(tmp_path):
    text = TRIANGLE + "v 1 1 0\nf 1 2 4 3\n"
    assert read_mesh(written(tmp_path / "a.obj", text)).areas.sum() == pytest.approx(1)


@pytest.mark.parametrize(
    ("names", "told"),
    [
        ("mtllib gone.mtl\nusemtl gone\n", "names gone.mtl, which is not there; add it, or set the object's colour"),
        ("mtllib here.mtl\nusemtl a\n", "names gone.png, which is not there; add it, or set the object's colour"),
        ("mtllib here.mtl\nusemtl b\n", "no material b is in here.mtl; set the object's colour"),
    ],
)
def test_missing_materials_and_pictures_are_missed_only_where_they_are_drawn(tmp_path, names, told):
    written(tmp_path / "here.mtl", "newmtl c\nnewmtl a\nmap_Kd gone.png\n")
    path = written(tmp_path / "a.obj", names + TRIANGLE + "f 1 2 3\n")
    assert len(read_mesh(path).triangles) == 1
    assert refused(path, painted=True).endswith(told)


def test_a_missing_picture_of_gltf_is_missed_only_where_it_is_drawn(tmp_path):
    path = exported(tmp_path, trimesh.creation.box(), ".gltf")
    tree = json.loads(path.read_text())
    tree["images"], tree["textures"] = [{"uri": "gone.png"}], [{"source": 0}]
    tree["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    tree["meshes"][0]["primitives"][0]["material"] = 0
    written(path, json.dumps(tree))
    assert len(read_mesh(path).triangles) == 12
    assert refused(path, painted=True).startswith("names gone.png, which is not there; put it beside, or set")


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("content", [b"", b"\0" * 5, b"\xff\xfe garbage \x00" * 40, b"<html>not here</html>"])
def test_what_is_no_mesh(tmp_path, ending, content):
    message = refused(written(tmp_path / f"a{ending}", content))
    assert "is empty (0 bytes)" in message if not content else "not a mesh" in message or "no triangles" in message


@pytest.mark.parametrize("ending", [".glb", ".gltf", ".ply", ".stl"])
@pytest.mark.parametrize("part", [0.02, 0.3, 0.6, 0.97])
def test_cut_short(tmp_path, ending, part):
    path = exported(tmp_path, trimesh.creation.icosphere(subdivisions=2), ending)
    data = path.read_bytes()
    message = refused(written(path, data[: int(part * len(data))]))
    assert "cut short" in message or "no triangles" in message


def test_a_gltf_without_its_bytes(tmp_path):
    path = exported(tmp_path, trimesh.creation.box(), ".gltf")
    buffer = next(tmp_path.glob("*.bin"))
    buffer.write_bytes(buffer.read_bytes()[:-1])
    assert refused(path).startswith(f"{buffer.name} must have ")
    buffer.unlink()
    assert refused(path) == f"names {buffer.name}, which is not there; put it beside"


@pytest.mark.parametrize("text", ["f 1 2 9\n", "f 1 2 -9\n", "f 1/1 2/1 9/1\n", "f 1 x 3\n", "", "l 1 2\n"])
def test_faces_that_name_nothing(tmp_path, text):
    message = refused(written(tmp_path / "a.obj", TRIANGLE + text))
    assert "damaged" in message or "no triangles" in message or "vertex" in message


def test_an_index_out_of_range(tmp_path):
    header = "ply\nformat ascii 1.0\nelement vertex 3\n" + "".join(f"property float {axis}\n" for axis in "xyz")
    header += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    path = written(tmp_path / "a.ply", header + "0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n")
    assert refused(path) == "a triangle names vertex 7, but there are 3, counted from 0"


@pytest.mark.parametrize("bad", ["nan", "inf", "-inf"])
def test_vertices_that_are_not_numbers(tmp_path, bad):
    path = written(tmp_path / "a.obj", f"v 0 0 0\nv {bad} 0 0\nv 0 1 0\nf 1 2 3\n")
    assert "NaN or infinite" in refused(path)


def test_vertices_too_far(tmp_path):
    path = written(tmp_path / "a.obj", "v 0 0 0\nv 1e300 0 0\nv 0 1 0\nf 1 2 3\n")
    assert refused(path) == "coordinates must lie within ±1e+09 (got 1e+300); scale it down"


@pytest.mark.parametrize("text", ["v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n"])
def test_no_area_at_all(tmp_path, text):
    assert refused(written(tmp_path / "a.obj", text)).startswith("holds no surface")


def test_points_alone_are_no_mesh(tmp_path):
    assert refused(written(tmp_path / "a.obj", TRIANGLE)) == "holds no triangles"


def test_too_many_triangles(tmp_path, monkeypatch):
    monkeypatch.setattr(meshes, "MOST_TRIANGLES", 1_000_000)
    path = exported(tmp_path, trimesh.creation.box(), ".stl")
    data = path.read_bytes()
    many = np.frombuffer(data[84:], np.uint8).reshape(12, 50)[np.arange(1_000_100) % 12]
    written(path, data[:80] + np.uint32(len(many)).tobytes() + many.tobytes())
    assert refused(path) == "must hold at most 1 million triangles (got 1.0 million); simplify it"


def test_names_folders_and_nothing(tmp_path):
    assert refused(tmp_path / "a.fbx") == (
        "a mesh's name must end in one of .glb, .gltf, .obj, .ply, .stl (got .fbx)"
    )
    assert refused(tmp_path / "a").endswith("(it has none)")
    assert refused(tmp_path / "gone.obj") == "no such file"
    (tmp_path / "folder.obj").mkdir()
    assert refused(tmp_path / "folder.obj") == "is a folder, not a file"


def test_endings_in_capitals(tmp_path):
    assert len(read_mesh(written(tmp_path / "A.OBJ", TRIANGLE + "f 1 2 3\n")).triangles) == 1


@pytest.mark.parametrize(("module", "file"), [("mapbox_earcut", "concave.obj"), ("DracoPy", "draco_and_plain.glb")])
def test_without_the_extra(monkeypatch, module, file):
    monkeypatch.setitem(sys.modules, module, None)
    assert 'pip install "greensward[mesh]"' in refused(KEPT / file)
    assert len(read_mesh(KEPT / "plain.glb").triangles) == 12


def test_check_reads_meshes_as_meshes_and_their_maps_as_pictures(tmp_path):
    written(tmp_path / "good.obj", TRIANGLE + "vt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n")
    written(tmp_path / "bad.obj", TRIANGLE)
    things = [("good.obj", "good.obj"), ("bad.obj", "gone.png")]
    text = "".join(
        f'[[object]]\nkind = "mesh"\nposition_m = [0, 0, 0]\nfile = "{file}"\ngrass.density_map = "{picture}"\n'
        for file, picture in things
    )
    with pytest.raises(SceneError) as caught:
        load(written(tmp_path / "a.toml", text), read_file=_read)
    first, second, third = sorted(caught.value.problems)
    assert "object[0].grass.density_map: " in first
    assert "is not a picture" in first
    assert "object[1].file: " in second
    assert second.endswith("bad.obj: holds no triangles")
    assert "object[1].grass.density_map: no such file" in third


@pytest.mark.parametrize(
    ("grass", "told"),
    [
        ('density_map = "gone.png"', "has no texture coordinates"),
        ('density_from = "colours"', "has no vertex colours"),
    ],
)
def test_check_tells_what_a_mesh_lacks_for_its_grass(tmp_path, grass, told):
    written(tmp_path / "plain.obj", TRIANGLE + "f 1 2 3\n")
    text = f'[[object]]\nkind = "mesh"\nposition_m = [0, 0, 0]\nfile = "plain.obj"\ngrass.{grass}\n'
    with pytest.raises(SceneError) as caught:
        load(written(tmp_path / "a.toml", text), read_file=_read)
    assert any("object[0].file: " in problem and told in problem for problem in caught.value.problems)


def test_a_file_that_changes_is_read_anew(tmp_path):
    path = written(tmp_path / "a.obj", TRIANGLE + "f 1 2 3\n")
    first = read_mesh(path)
    assert read_mesh(path) is first
    written(path, TRIANGLE + "f 1 2 3\nf 3 2 1\n")
    assert len(read_mesh(path).triangles) == 2


# Files of other programs ------------------------------------------------------------------------------------

SLAB = [[0, 0, 0], [4, 1, 2]]


@pytest.mark.parametrize(
    ("file", "triangles", "area", "bounds"),
    [
        ("plain.glb", 12, 28, SLAB),
        ("percent.gltf", 12, 28, SLAB),
        ("quant_i2_normalized.glb", 12, 28, SLAB),
        ("sparse.glb", 12, 28, SLAB),
        ("uv_u1.glb", 12, 28, SLAB),
        ("fan_and_triangles.glb", 8, 24, SLAB),
        ("gpu_instances.glb", 36, 84, [[0, 0, 0], [24, 1, 2]]),
        ("draco_and_plain.glb", 24, 56, [[0, 0, 0], [14, 1, 2]]),
        ("i_neg_whole.obj", 12, 28, SLAB),
        ("i_tab_v.obj", 12, 28, SLAB),
        ("i_latin1.obj", 12, 28, SLAB),
        ("zup.obj", 12, 28, [[0, -2, 0], [4, 0, 1]]),
        ("concave.obj", 4, 3, [[0, 0, -2], [2, 0, 0]]),
        ("le_mixed.ply", 12, 28, SLAB),
        ("edges.ply", 12, 28, SLAB),
        ("tex-http.ply", 1, 0.5, [[0, 0, 0], [1, 1, 0]]),
        ("binary_tail.stl", 12, 28, SLAB),
        ("bad.stl", 1, 0.5, [[0, 0, 0], [1, 1, 0]]),
    ],
)
def test_every_kind_of_file_is_read_as_it_is_meant(file, triangles, area, bounds):
    mesh = read_mesh(KEPT / file, painted=True)
    assert len(mesh.triangles) == triangles
    assert mesh.areas.sum() == pytest.approx(area, rel=1e-3)
    np.testing.assert_allclose(mesh.bounds, bounds, atol=1e-3)
    if file == "uv_u1.glb":
        assert mesh.uv is not None
        assert (mesh.uv.min(), mesh.uv.max()) == (0, 1)


@pytest.mark.parametrize(
    ("file", "told"),
    [
        ("missing_bin.gltf", "names gone.bin, which is not there; put it beside"),
        ("zero_index.obj", "a face names 0, and indices of OBJ count from 1"),
        ("uri-fifo.gltf", "names fifo, which is not there; put it beside"),
    ],
)
def test_what_cannot_be_read_is_named(file, told):
    assert refused(KEPT / file) == told


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_beside_a_gltf_is_not_waited_for(tmp_path):
    path = written(tmp_path / "a.gltf", (KEPT / "uri-fifo.gltf").read_bytes())
    os.mkfifo(tmp_path / "fifo")
    with pytest.raises(InputError, match="fifo: is not a file"):
        read_mesh(path)


def gltf(path, positions, attributes=(), primitive=(), **tree):
    """A glTF file of float attributes, its bytes in itself."""
    arrays = {"POSITION": np.asarray(positions, np.float32), **dict(attributes)}
    data, views, accessors = b"", [], []
    for values in arrays.values():
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": values.nbytes})
        kind = {"float32": 5126, "uint8": 5121, "uint16": 5123}[values.dtype.name]
        shape = f"VEC{values.shape[1]}" if values.ndim == 2 else f"MAT{values.shape[1]}"
        accessors.append(
            {"bufferView": len(views) - 1, "componentType": kind, "count": len(values), "type": shape}
            | ({"normalized": True} if values.dtype.kind == "u" and len(views) == 2 else {})
        )
        data += values.tobytes() + b"\0" * (-values.nbytes % 4)
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    drawn = {"attributes": {name: i for i, name in enumerate(arrays) if name.isupper()}, **dict(primitive)}
    tree = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(data), "uri": uri}],
        "bufferViews": views,
        "accessors": accessors,
        "meshes": [{"primitives": [drawn]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
    } | tree
    return written(path, json.dumps(tree))


CORNER = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    ("name", "cure"),
    [
        ("EXT_meshopt_compression", "gltf-transform copy a.gltf plain.glb"),
        ("KHR_texture_basisu", "gltf-transform ktxdecompress a.gltf plain.glb"),
        ("ACME_hair", "export a.gltf without it"),
    ],
)
def test_an_extension_that_a_gltf_needs_is_read_or_named(tmp_path, name, cure):
    path = gltf(tmp_path / "a.gltf", CORNER, extensionsRequired=["KHR_texture_transform", name])
    assert refused(path) == f"needs the glTF extension {name}, which is not read; convert it: {cure}"


def test_a_strip_alternates(tmp_path):
    mesh = read_mesh(gltf(tmp_path / "a.gltf", [*CORNER, [1, 1, 0]], primitive={"mode": 5}))
    assert mesh.areas.sum() == 1
    np.testing.assert_allclose(mesh.normals, [[0, 0, 1]] * 4)


@pytest.mark.parametrize(
    ("nodes", "told"),
    [
        ([{"children": [1]}, {"children": [0], "mesh": 0}], "must be there once; its nodes are no trees"),
        ([{"children": [7]}], "must be there once; its nodes are no trees"),
        ([{"mesh": 0}] * 20_001, "must have at most 20,000 nodes (got 20,001); join them: gltf-transform join"),
    ],
)
def test_nodes_that_are_no_trees_or_too_many(tmp_path, nodes, told):
    assert told in refused(gltf(tmp_path / "a.gltf", CORNER, nodes=nodes))


def test_morph_targets_and_skins_take_their_rest_pose(tmp_path):
    moved = np.array([[0, 0, 2]] * 3, np.float32)
    shaped = gltf(
        tmp_path / "a.gltf",
        CORNER,
        {"target": moved},
        {"targets": [{"POSITION": 1}]},
        nodes=[{"mesh": 0, "weights": [0.5]}],
    )
    assert read_mesh(shaped).bounds[:, 2].tolist() == [1, 1]
    joints, weights = np.zeros((3, 4), np.uint16), np.array([[0.25, 0.75, 0, 0]] * 3, np.float32)
    joints[:, 1] = 1
    skinned = gltf(
        tmp_path / "b.gltf",
        CORNER,
        {"unused": moved, "JOINTS_0": joints, "WEIGHTS_0": weights},
        nodes=[
            {"mesh": 0, "skin": 0, "translation": [9, 9, 9]},
            {"translation": [0, 0, 4], "children": [2]},
            {"translation": [0, 0, 4]},
        ],
        skins=[{"joints": [1, 2]}],
        scenes=[{"nodes": [0, 1]}],
    )
    np.testing.assert_allclose(read_mesh(skinned).bounds, [[0, 0, 7], [1, 1, 7]])


def test_materials_of_gltf(tmp_path):
    Image.new("RGBA", (4, 2), (255, 0, 0, 255)).save(tmp_path / "a b.png")
    uv = np.array([[0, 0], [255, 0], [0, 255]], np.uint8)
    transform = {"offset": [0.5, 0.25], "scale": [2, 1], "rotation": np.pi / 2}
    path = gltf(
        tmp_path / "a.gltf",
        CORNER,
        {"TEXCOORD_0": uv},
        {"material": 1},
        materials=[
            {},
            {
                "alphaMode": "MASK",
                "alphaCutoff": 0.3,
                "pbrMetallicRoughness": {
                    "baseColorFactor": [0.5, 1, 1, 1],
                    "baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": transform}},
                },
            },
        ],
        textures=[{"source": 0, "sampler": 0}],
        samplers=[{"wrapS": 33071}],
        images=[{"uri": "a%20b.png"}],
    )
    mesh = read_mesh(path, painted=True)
    assert read_mesh(path).materials == ()
    assert mesh.material is not None
    assert mesh.material.tolist() == [1, 1, 1]
    painted = mesh.materials[1]
    assert (painted.colour, painted.cutoff, painted.wrap) == ((0.5, 1, 1, 1), 0.3, ("clamp", "repeat"))
    assert painted.picture is not None
    assert painted.picture.shape == (2, 4, 4)
    # a quarter turn counter-clockwise where v runs down: (u, v) becomes (v, -u)
    np.testing.assert_allclose(mesh.uv, [[0.5, 0.75], [0.5, 2.75], [1.5, 0.75]], atol=1e-6)


def test_materials_of_obj(tmp_path):
    Image.new("RGB", (2, 2), (0, 255, 0)).save(tmp_path / "green leaf.png")
    Image.fromarray(np.array([[0, 255], [255, 255]], np.uint8)).save(tmp_path / "mask.png")
    library = "newmtl plain\nKd 0.5 0.5 0.5\nnewmtl leaf\nmap_Kd -clamp on -bm 1 green leaf.png\nmap_d mask.png\n"
    written(tmp_path / "a.mtl", library)
    faces = "usemtl leaf\nf 1/1 2/2 3/3\nusemtl plain\nf 3/3 2/2 1/1\n"
    path = written(tmp_path / "a.obj", "mtllib a.mtl\n" + TRIANGLE + "vt 0 0\nvt 1 0\nvt 0 1\n" + faces)
    mesh = read_mesh(path, painted=True)
    assert mesh.material is not None
    assert mesh.material[mesh.triangles].tolist() == [[0] * 3, [1] * 3]
    leaf, plain = mesh.materials
    assert plain.colour[0] == pytest.approx(0.214, abs=1e-3)
    assert leaf.picture is not None
    assert leaf.picture[..., 3].tolist() == [[0, 255], [255, 255]]
    assert (leaf.cutoff, leaf.wrap) == (0.5, ("clamp", "clamp"))
    written(tmp_path / "a.mtl", library.replace("-bm 1", "-s 2 2 2"))
    assert "the option -s of a picture is not read" in refused(path, painted=True)


@pytest.mark.parametrize("order", ["little", "big"])
def test_ply_of_either_order_with_lists_of_any_length_and_more_columns(tmp_path, order):
    mark = "<" if order == "little" else ">"
    header = f"ply\nformat binary_{order}_endian 1.0\nelement vertex 4\n"
    header += "".join(f"property double {axis}\n" for axis in "xyz") + "property uchar red\nproperty uchar green\n"
    header += "property uchar blue\nelement face 2\nproperty list uchar int vertex_index\n"
    header += "property short flags\nend_header\n"
    data = b"".join(np.array(at, f"{mark}f8").tobytes() + bytes([255, 0, 51]) for at in [*CORNER, [1, 1, 0]])
    for face in ([0, 1, 3, 2], [2, 1, 0]):
        data += bytes([len(face)]) + np.array(face, f"{mark}i4").tobytes() + np.array(7, f"{mark}i2").tobytes()
    mesh = read_mesh(written(tmp_path / "a.ply", header.encode() + data))
    assert mesh.areas.sum() == 1.5
    assert mesh.colours is not None
    np.testing.assert_allclose(mesh.colours[0], [1, 0, 0.2, 1])


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_damaged_files_are_read_or_refused_in_a_sentence(tmp_path, data):
    kept = data.draw(st.sampled_from(sorted(path for path in KEPT.iterdir() if path.is_file())))
    content = bytearray(kept.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = written(tmp_path / f"a{kept.suffix}", bytes(content[: data.draw(st.integers(1, len(content)))]))
    told = ""
    try:
        mesh = read_mesh(path, painted=True)
        assert np.isfinite(mesh.positions).all()
        assert np.isfinite(mesh.normals).all()
    except InputError as error:
        told = str(error)
    assert "\n" not in told


def test_corners_of_obj_may_lack_texture_coordinates(tmp_path):
    path = written(tmp_path / "a.obj", TRIANGLE + "vt 0.5 0.25\nf 1/1 2/1 3/1\nf 3 2 1\n")
    mesh = read_mesh(path)
    assert mesh.uv is not None
    assert sorted(map(tuple, mesh.uv.tolist())) == [(0, 0)] * 3 + [(0.5, 0.25)] * 3
