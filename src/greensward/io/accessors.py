"""Numbers of a glTF file: buffers, views of them, accessors of every kind, and Draco's compression."""

import base64
import binascii
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import numpy as np
import numpy.typing as npt

from greensward.io.parts import MOST_TRIANGLES
from greensward.scene.errors import InputError
from greensward.scene.files import is_there, read_file
from greensward.scene.problems import short

_COMPONENTS = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_MOST_BYTES = 4 * 2**30
_DRACO = "KHR_draco_mesh_compression"

Values = npt.NDArray[Any]
Table = dict[str, Any]


class Accessors:
    """Accessors of one file by their number."""

    def __init__(self, path: Path, tree: Table, binary: bytes) -> None:
        self._path, self._tree, self._binary = path, tree, binary
        self._buffers: dict[int, bytes] = {}

    def values(self, number: int) -> Values:
        """The numbers of an accessor as the file holds them, (count, width), sparse ones put in."""
        said = self._tree["accessors"][number]
        dtype, width, count = np.dtype("<" + _COMPONENTS[said["componentType"]]), _WIDTHS[said["type"]], said["count"]
        if not 0 <= count <= 3 * MOST_TRIANGLES:
            raise ValueError(f"accessor {number} has {count} rows")
        if "bufferView" in said:
            found = self._rows(said["bufferView"], said.get("byteOffset", 0), dtype, width, count)
        else:
            found = np.zeros((count, width), dtype)
        if sparse := said.get("sparse"):
            found = found.copy()
            where, put = sparse["indices"], sparse["values"]
            kind = np.dtype("<" + _COMPONENTS[where["componentType"]])
            rows = self._rows(where["bufferView"], where.get("byteOffset", 0), kind, 1, sparse["count"])[:, 0]
            found[rows] = self._rows(put["bufferView"], put.get("byteOffset", 0), dtype, width, sparse["count"])
        return _normalized(found) if said.get("normalized") else found

    def floats(self, number: int) -> npt.NDArray[np.float64]:
        """The numbers of an accessor as float64, (count, width)."""
        return self.values(number).astype(np.float64)

    def of_primitive(self, primitive: Table) -> dict[str, Values]:
        """Attributes of a primitive by their name, and its `indices`, also where Draco has compressed them."""
        numbers = dict(primitive["attributes"])
        if "indices" in primitive:
            numbers["indices"] = primitive["indices"]
        packed = primitive.get("extensions", {}).get(_DRACO)
        if packed is None:
            return {name: self.values(number) for name, number in numbers.items()}
        return self._unpacked(packed, numbers)

    def bytes_of(self, view: int) -> bytes:
        """The bytes of a buffer view."""
        said = self._tree["bufferViews"][view]
        extensions = self._tree["buffers"][said["buffer"]].get("extensions", {})
        if extensions.get("EXT_meshopt_compression", {}).get("fallback"):
            raise InputError(
                f"{self._path}: needs the glTF extension EXT_meshopt_compression, which is not read; "
                f"convert it: gltf-transform copy {self._path.name} plain.glb"
            )
        start, length = said.get("byteOffset", 0), said["byteLength"]
        data = self._buffer(said["buffer"])
        if start < 0 or length < 0 or start + length > len(data):
            raise ValueError(f"buffer view {view} ends behind its buffer")
        return data[start : start + length]

    def _rows(self, view: int, offset: int, dtype: np.dtype[Any], width: int, count: int) -> Values:
        """Rows of numbers in a buffer view, (count, width)."""
        data = self.bytes_of(view)
        row = width * dtype.itemsize
        stride = self._tree["bufferViews"][view].get("byteStride", row)
        if count and (offset < 0 or stride < row or offset + stride * (count - 1) + row > len(data)):
            raise ValueError(f"buffer view {view} has too few bytes for {count} rows")
        return np.ndarray((count, width), dtype, data, offset, (stride, dtype.itemsize))

    def _buffer(self, number: int) -> bytes:
        if number not in self._buffers:
            self._buffers[number] = self._loaded(number, self._tree["buffers"][number])
        return self._buffers[number]

    def _loaded(self, number: int, said: Table) -> bytes:
        uri = said.get("uri")
        own = b"" if number else self._binary
        data = own if uri is None else bytes_at(self._path, uri)
        if len(data) < said["byteLength"]:
            name = "its own bytes" if uri is None else uri if len(uri) < 100 else "a buffer"
            raise InputError(f"{self._path}: {name} must have {said['byteLength']:,} bytes (got {len(data):,})")
        return data

    def _unpacked(self, packed: Table, numbers: dict[str, int]) -> dict[str, Values]:
        """Attributes and indices that Draco has compressed."""
        try:
            import DracoPy
        except ImportError:
            raise InputError(
                f"{self._path}: its {_DRACO} is read by DracoPy, which is not installed: "
                f'pip install "greensward[mesh]", or gltf-transform copy {self._path.name} plain.glb'
            ) from None
        mesh = DracoPy.decode(self.bytes_of(packed["bufferView"]))
        found: dict[str, Values] = {"indices": np.asarray(mesh.faces, np.int64).ravel()}
        for name, unique in packed["attributes"].items():
            values = np.asarray(mesh.get_attribute_by_unique_id(unique)["data"])
            values = values.reshape(len(mesh.points), -1)
            said = self._tree["accessors"][numbers[name]]
            if said.get("normalized") and values.dtype.kind in "iu":
                values = _normalized(values.astype(_COMPONENTS[said["componentType"]]))
            found[name] = values
        return {name: self.values(number) for name, number in numbers.items() if name not in found} | found


def bytes_at(path: Path, uri: str) -> bytes:
    """The bytes that an address in a glTF file stands for: in the file itself, or in a file beside it.

    Raises `InputError` where they are not there.
    """
    if uri.startswith("data:"):
        head, _, body = uri.partition(",")
        try:
            if head.endswith(";base64"):
                return base64.b64decode(body, validate=True)
            return unquote(body, "latin-1").encode("latin-1")
        except binascii.Error:
            raise InputError(f"{path}: holds base64 text that is damaged") from None
    if urlsplit(uri).scheme:
        raise InputError(f"{path}: names {short(uri, False)}, and only files of this machine are read; download it")
    name = unquote(uri)
    found = path.parent / name
    if not is_there(found):
        raise InputError(f"{path}: names {short(name, False)}, which is not there; put it beside")
    try:
        return read_file(found, _MOST_BYTES, "a buffer")
    except InputError as error:
        raise InputError(f"{path}: names {error}") from None


def _normalized(values: Values) -> Values:
    """Integers as the parts of 1 that they stand for (glTF 2.0, section 3.6.2.2)."""
    if values.dtype.kind == "f":
        return values
    return np.maximum(values.astype(np.float64) / np.iinfo(values.dtype).max, -1.0)
