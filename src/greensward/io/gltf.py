"""Reading of glTF 2.0: what it places of triangles, with the colours of their materials.

Khronos Group, "glTF 2.0 Specification" (2021), and the extensions in `_READ`.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from greensward.io.accessors import Accessors
from greensward.io.gltf_materials import materials_of, texture_transform, uses_uv
from greensward.io.parts import MOST_TRIANGLES, Content, Floats, Indices, Part, coloured
from greensward.scene.errors import InputError
from greensward.scene.problems import short

_READ = (
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
)
_CURES = {
    "EXT_meshopt_compression": "gltf-transform copy {0} plain.glb",
    "KHR_meshopt_compression": "gltf-transform copy {0} plain.glb",
    "KHR_texture_basisu": "gltf-transform ktxdecompress {0} plain.glb",
    "KHR_materials_pbrSpecularGlossiness": "gltf-transform metalrough {0} plain.glb",
}
_MOST_NODES, _MOST_PARTS, _MOST_JSON_BYTES = 20_000, 50_000, 256 * 2**20
_TRIANGLES, _STRIP, _FAN = 4, 5, 6


def read_gltf(path: Path, data: bytes, painted: bool) -> Content:
    """The triangles that a glTF file places in its scene, in its rest pose; with its materials if `painted`.

    Raises `InputError` for what is not read, and nearly anything where the file is damaged.
    """
    tree, binary = _unpacked(path, data)
    for name in tree.get("extensionsRequired", []):
        if name not in _READ:
            cure = _CURES.get(name, "export {0} without it").format(path.name)
            raise InputError(
                f"{path}: needs the glTF extension {short(str(name), False)}, which is not read; convert it: {cure}"
            )
    reader = _Reader(path, tree, Accessors(path, tree, binary))
    parts: list[Part] = []
    corners = 0
    for node, matrix in _placed(path, tree):
        for part in reader.parts(node, matrix) if "mesh" in node else ():
            corners += len(part.positions)
            if corners > 3 * MOST_TRIANGLES:
                raise InputError(f"{path}: places over {3 * MOST_TRIANGLES // 10**6} million vertices; simplify it")
            if len(parts) == _MOST_PARTS:
                raise InputError(f"{path}: must have at most {_MOST_PARTS:,} primitives in all nodes; join them")
            parts.append(part)
    return Content(parts, materials_of(path, tree, reader.accessors) if painted else [])


def _unpacked(path: Path, data: bytes) -> tuple[dict[str, Any], bytes]:
    """The description, and the bytes behind it in a `.glb` file."""
    text, binary = data, b""
    if data[:4] == b"glTF":
        version, length, size = (int.from_bytes(data[k : k + 4], "little") for k in (4, 8, 12))
        if version != 2 or len(data) < length:
            raise InputError(f"{path}: is cut short, damaged or not a mesh of glTF 2.0 (version {version})")
        text, behind = data[20 : 20 + size], 20 + size
        if behind + 8 <= length:
            binary = data[behind + 8 : behind + 8 + int.from_bytes(data[behind : behind + 4], "little")]
    if len(text) > _MOST_JSON_BYTES:
        raise InputError(f"{path}: its description is larger than {_MOST_JSON_BYTES >> 20} MiB")
    tree = json.loads(text)
    if not isinstance(tree, dict) or not str(tree["asset"]["version"]).startswith("2."):
        raise InputError(f"{path}: must be glTF 2.0; convert it: gltf-transform copy needs 2.0, so export it again")
    return tree, binary


def _placed(path: Path, tree: dict[str, Any]) -> Iterator[tuple[dict[str, Any], Floats]]:
    """Every node of the scene with its matrix; without a scene, of all trees."""
    nodes = tree.get("nodes", [])
    if len(nodes) > _MOST_NODES:
        raise InputError(
            f"{path}: must have at most {_MOST_NODES:,} nodes (got {len(nodes):,}); "
            f"join them: gltf-transform join {path.name} joined.glb"
        )
    if scenes := tree.get("scenes"):
        roots = scenes[tree.get("scene", 0)].get("nodes", [])
    else:
        children = {child for node in nodes for child in node.get("children", [])}
        roots = [index for index in range(len(nodes)) if index not in children]
    waiting, seen = [(root, np.eye(4)) for root in roots], set()
    while waiting:
        index, above = waiting.pop()
        if index in seen or not 0 <= index < len(nodes):
            raise InputError(f"{path}: node {index} must be there once; its nodes are no trees")
        seen.add(index)
        matrix = above @ local_matrix(nodes[index])
        nodes[index]["_matrix"] = matrix
        waiting += [(child, matrix) for child in nodes[index].get("children", [])]
    for index in sorted(seen):
        yield nodes[index], nodes[index]["_matrix"]


def local_matrix(node: dict[str, Any]) -> Floats:
    """Matrix of a node within the one above it, (4, 4)."""
    if "matrix" in node:
        column_major: Floats = np.array(node["matrix"], np.float64).reshape(4, 4)
        return column_major.T
    one = np.zeros((1, 3))
    matrices: Floats = _matrices(
        one + node.get("translation", 0.0),
        np.array([node.get("rotation", [0, 0, 0, 1])], np.float64),
        one + node.get("scale", 1.0),
    )
    result: Floats = matrices[0]
    return result


def _matrices(moved: Floats, turned: Floats, scaled: Floats) -> Floats:
    """Matrices (n, 4, 4) that scale, turn by quaternions x, y, z, w, and move."""
    x, y, z, w = (turned / np.linalg.norm(turned, axis=1, keepdims=True)).T
    result = np.zeros((len(x), 4, 4))
    result[:, 0, :3] = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], -1)
    result[:, 1, :3] = np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], -1)
    result[:, 2, :3] = np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], -1)
    result[:, :3, :3] *= scaled[:, None, :]
    result[:, :3, 3], result[:, 3, 3] = moved, 1.0
    return result


class _Reader:
    """Parts of the meshes of one file."""

    def __init__(self, path: Path, tree: dict[str, Any], accessors: Accessors) -> None:
        self.path, self.tree, self.accessors = path, tree, accessors
        self._read: dict[tuple[int, int], Part | None] = {}

    def parts(self, node: dict[str, Any], matrix: Floats) -> Iterator[Part]:
        """The parts of a node's mesh, once for each place in which it has them."""
        mesh = self.tree["meshes"][node["mesh"]]
        weights = node.get("weights", mesh.get("weights", []))
        places = self._places(node, matrix)
        for number, primitive in enumerate(mesh["primitives"]):
            key = node["mesh"], number
            if key not in self._read:
                self._read[key] = self._part(primitive)
            part = self._read[key]
            if part is None:
                continue
            if weights and primitive.get("targets"):
                part = self._shaped(part, primitive, weights)
            if "skin" in node and "JOINTS_0" in primitive["attributes"]:
                yield self._posed(part, primitive, self.tree["skins"][node["skin"]])
                continue
            if len(places) * len(part.triangles) > MOST_TRIANGLES:
                raise InputError(
                    f"{self.path}: its instances have over {MOST_TRIANGLES // 10**6} million triangles; simplify it"
                )
            for place in places:
                yield _moved(part, place)

    def _places(self, node: dict[str, Any], matrix: Floats) -> list[Floats]:
        """The matrices of a node's instances (EXT_mesh_gpu_instancing)."""
        said = node.get("extensions", {}).get("EXT_mesh_gpu_instancing", {}).get("attributes", {})
        if not said:
            return [matrix]
        names = [name for name in ("TRANSLATION", "ROTATION", "SCALE") if name in said]
        read = {name: self.accessors.floats(said[name]) for name in names}
        count = max((len(values) for values in read.values()), default=1)
        every = _matrices(
            read.get("TRANSLATION", np.zeros((count, 3))),
            read.get("ROTATION", np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))),
            read.get("SCALE", np.ones((count, 3))),
        )
        return list(matrix @ every)

    def _part(self, primitive: dict[str, Any]) -> Part | None:
        """Triangles of one primitive; none of points and lines."""
        mode, attributes = primitive.get("mode", _TRIANGLES), primitive["attributes"]
        if mode not in (_TRIANGLES, _STRIP, _FAN) or "POSITION" not in attributes:
            return None
        read = self.accessors.of_primitive(primitive)
        positions = read["POSITION"].astype(np.float64)
        corners = read["indices"].astype(np.int64).ravel() if "indices" in read else np.arange(len(positions))
        number = primitive.get("material")
        material = self.tree["materials"][number] if number is not None else {}
        uv = read.get(f"TEXCOORD_{uses_uv(material)}", read.get("TEXCOORD_0"))
        if uv is not None:
            uv = texture_transform(material, uv.astype(np.float64)) * [1.0, -1.0] + [0.0, 1.0]
        return Part(
            positions,
            _triangles(corners, mode),
            read["NORMAL"].astype(np.float64) if "NORMAL" in read else None,
            coloured(read["COLOR_0"]) if "COLOR_0" in read else None,
            None if uv is None else uv.astype(np.float32),
            None if number is None else np.full(len(positions), number),
        )

    def _shaped(self, part: Part, primitive: dict[str, Any], weights: list[float]) -> Part:
        """The part with its morph targets applied."""
        positions = part.positions.copy()
        for weight, target in zip(weights, primitive["targets"], strict=False):
            if weight and "POSITION" in target:
                positions += weight * self.accessors.floats(target["POSITION"])
        return Part(positions, part.triangles, None, part.colours, part.uv, part.material)

    def _posed(self, part: Part, primitive: dict[str, Any], skin: dict[str, Any]) -> Part:
        """The part where the joints of its skin are."""
        joints = np.stack([self.tree["nodes"][joint].get("_matrix", np.eye(4)) for joint in skin["joints"]])
        if "inverseBindMatrices" in skin:
            joints = joints @ self.accessors.floats(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
        attributes = primitive["attributes"]
        blended = np.zeros((len(part.positions), 4, 4))
        for k in range(len([name for name in attributes if name.startswith("JOINTS_")])):
            which = self.accessors.values(attributes[f"JOINTS_{k}"])
            weights = self.accessors.floats(attributes[f"WEIGHTS_{k}"])
            for influence in range(which.shape[1]):
                blended += weights[:, influence, None, None] * joints[which[:, influence]]
        at = np.concatenate([part.positions, np.ones((len(part.positions), 1))], 1)
        positions = np.einsum("nij,nj->ni", blended, at)[:, :3]
        return Part(positions, part.triangles, None, part.colours, part.uv, part.material)


def _moved(part: Part, matrix: Floats) -> Part:
    return Part(part.positions, part.triangles, part.normals, part.colours, part.uv, part.material, matrix)


def _triangles(corners: Indices, mode: int) -> Indices:
    """Triangles (m, 3) of a list, strip or fan of corners."""
    if mode == _TRIANGLES:
        if len(corners) % 3:
            raise ValueError(f"{len(corners)} corners make no triangles")
        return corners.reshape(-1, 3)
    at = np.arange(max(len(corners) - 2, 0))
    if mode == _FAN:
        return corners[np.stack([np.zeros_like(at), at + 1, at + 2], -1)]
    return corners[np.stack([at, at + 1 + at % 2, at + 2 - at % 2], -1)]
