"""Reading of PLY, text and binary of either byte order."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from greensward.io.parts import MOST_TRIANGLES, Content, Part, coloured
from greensward.io.polygons import triangulated
from greensward.scene.errors import InputError

_TYPES = {
    name: code
    for names, code in (
        ("char int8", "i1"),
        ("uchar uint8", "u1"),
        ("short int16", "i2"),
        ("ushort uint16", "u2"),
        ("int int32", "i4"),
        ("uint uint32", "u4"),
        ("float float32", "f4"),
        ("double float64", "f8"),
    )
    for name in names.split()
}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_UV = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))

Column = npt.NDArray[Any]
Columns = dict[str, Column]


@dataclass
class _Element:
    """An element of the header: how many rows, and the types of its columns; of a list, of its count and items."""

    name: str
    count: int
    types: dict[str, tuple[str, ...]] = field(default_factory=dict)


@dataclass
class _Source:
    """Rows below the header: words of text, or bytes in an order."""

    order: str
    data: bytes
    words: list[bytes]
    at: int = 0

    def take(self, code: str, count: int) -> Column:
        """The next values of a type."""
        if not self.order:
            found = self.words[self.at : self.at + count]
            self.at += count
            if len(found) < count:
                raise ValueError("its text ends too early")
            return np.array(found).astype(np.float64).astype(code) if count else np.zeros(0, code)
        dtype = np.dtype(self.order + code)
        values = np.frombuffer(self.data, dtype, count, self.at)
        self.at += count * dtype.itemsize
        return values.astype(code)


def read_ply(path: Path, data: bytes) -> Content:
    """The faces of a PLY file, cut into triangles. Raises `InputError` or `ValueError` where it is damaged."""
    elements, source = _header(data)
    found = {element.name: _rows(source, element) for element in elements}
    if "tristrips" in found:
        raise InputError(f"{path}: holds triangle strips, which are not read; save it with faces")
    vertices, faces = found.get("vertex", {}), found.get("face", {})
    name = next((each for each in ("vertex_indices", "vertex_index") if each in faces), None)
    if name is None or not {"x", "y", "z"} <= vertices.keys():
        return Content([])
    positions = _table(vertices, "x", "y", "z")
    corners, sizes = faces[name].astype(np.int64), faces[f"{name}#"].astype(np.int64)
    if len(corners) and not (corners.min() >= 0 and corners.max() < len(positions)):
        wrong = int(corners.min() if corners.min() < 0 else corners.max())
        raise InputError(f"{path}: a triangle names vertex {wrong}, but there are {len(positions)}, counted from 0")
    uv = next((_table(vertices, *names) for names in _UV if set(names) <= vertices.keys()), None)
    colours = [each for each in ("red", "green", "blue", "alpha") if each in vertices]
    return Content(
        [
            Part(
                positions,
                corners[triangulated(path, positions, corners, sizes)],
                _table(vertices, "nx", "ny", "nz") if {"nx", "ny", "nz"} <= vertices.keys() else None,
                coloured(np.stack([vertices[each] for each in colours], -1)) if len(colours) >= 3 else None,
                None if uv is None else uv.astype(np.float32),
            )
        ]
    )


def _table(columns: Columns, *names: str) -> npt.NDArray[np.float64]:
    return np.stack([columns[name].astype(np.float64) for name in names], -1)


def _header(data: bytes) -> tuple[list[_Element], _Source]:
    end = data.find(b"end_header")
    start = data.find(b"\n", end) + 1
    if not data.startswith(b"ply") or end < 0 or not start:
        raise ValueError("it has no header of PLY")
    order, elements = "", []
    for line in data[:end].decode("latin-1").splitlines():
        match line.split():
            case ["format", form, *_]:
                order = _ORDERS[form]
            case ["element", name, count]:
                elements.append(_Element(name, int(count)))
            case ["property", "list", count_type, item_type, name]:
                elements[-1].types[name] = (_TYPES[count_type], _TYPES[item_type])
            case ["property", of_type, name]:
                elements[-1].types[name] = (_TYPES[of_type],)
    if any(not 0 <= each.count <= 3 * MOST_TRIANGLES for each in elements):
        raise ValueError("it declares more rows than a mesh can have")
    return elements, _Source(order, data, [] if order else data[start:].split(), start if order else 0)


def _rows(source: _Source, element: _Element) -> Columns:
    """The columns of an element; of a list its items, and `name#` their counts."""
    if all(len(types) == 1 for types in element.types.values()):
        return _scalars(source, element)
    alike = _alike(source, element)
    if alike is not None:
        return alike
    found: dict[str, list[Column]] = {name: [] for name in element.types}
    counts: dict[str, list[int]] = {f"{name}#": [] for name, types in element.types.items() if len(types) > 1}
    for _ in range(element.count):
        for name, types in element.types.items():
            count = 1
            if len(types) > 1:
                count = int(source.take(types[0], 1)[0])
                counts[f"{name}#"].append(count)
            found[name].append(source.take(types[-1], count))
    joined: Columns = {
        name: np.concatenate(values) if values else np.zeros(0, element.types[name][-1])
        for name, values in found.items()
    }
    return joined | {name: np.array(values, np.int64) for name, values in counts.items()}


def _scalars(source: _Source, element: _Element) -> Columns:
    if not source.order:
        width = len(element.types)
        table = source.take("f8", width * element.count).reshape(element.count, width)
        return {name: table[:, k].astype(code) for k, (name, (code,)) in enumerate(element.types.items())}
    dtype = np.dtype([(name, source.order + code) for name, (code,) in element.types.items()])
    table = np.frombuffer(source.data, dtype, element.count, source.at)
    source.at += dtype.itemsize * element.count
    return {name: table[name].astype(code) for name, (code,) in element.types.items()}


def _alike(source: _Source, element: _Element) -> Columns | None:
    """The columns of an element whose lists all have the length of its first; None where they do not."""
    if not element.count:
        return None
    start, lengths = source.at, {}
    for name, types in element.types.items():
        if len(types) > 1:
            lengths[name] = int(source.take(types[0], 1)[0])
        source.take(types[-1], lengths.get(name, 1))
    first, source.at = source.at - start, start
    if not source.order:
        words = source.words[start : start + first * element.count]
        if len(words) < first * element.count:
            return None
        table = np.array(words).astype(np.float64).reshape(element.count, first)
        columns: Columns = {}
        at = 0
        for name, types in element.types.items():
            if len(types) > 1:
                columns[f"{name}#"] = table[:, at].astype(np.int64)
                at += 1
            columns[name] = table[:, at : at + lengths.get(name, 1)].astype(types[-1]).ravel()
            at += lengths.get(name, 1)
    else:
        fields = []
        for name, types in element.types.items():
            if len(types) > 1:
                fields.append((f"{name}#", source.order + types[0], (1,)))
            fields.append((name, source.order + types[-1], (lengths.get(name, 1),)))
        dtype = np.dtype(fields)
        if start + dtype.itemsize * element.count > len(source.data):
            return None
        rows = np.frombuffer(source.data, dtype, element.count, start)
        columns = {name: rows[name].ravel().astype(rows[name].dtype.newbyteorder("=")) for name in dtype.names or ()}
        first = dtype.itemsize
    if any((columns[f"{name}#"] != length).any() for name, length in lengths.items()):
        return None
    source.at = start + first * element.count
    return columns
