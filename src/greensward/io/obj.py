"""Reading of OBJ (Wavefront) and of the colours in its materials."""

from array import array
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

from greensward.io.parts import Content, Floats, Indices, Material, Part, coloured
from greensward.io.polygons import triangulated
from greensward.io.rasters import decoded, read_rgba
from greensward.scene.errors import InputError
from greensward.scene.files import is_there, read_file
from greensward.scene.problems import short

_NONE = str(2**62)
"""Index of a corner that names none."""
_FREE_FORM = ("curv", "curv2", "surf", "cstype")
_OPTIONS = {"-blendu": 1, "-blendv": 1, "-cc": 1, "-mm": 2, "-texres": 1, "-bm": 1, "-imfchan": 1, "-type": 1}
_MOST_MATERIAL_BYTES = 64 * 2**20


def read_obj(path: Path, data: bytes, painted: bool) -> Content:
    """The faces of an OBJ file, cut into triangles; with its materials if they are to be `painted`.

    Raises `InputError` for what is not read or names nothing, and `ValueError` where it is damaged.
    """
    lines = _Lines(path, data)
    positions, colours = _vertices(lines.rows["v"])
    uv, normals = _numbers(lines.rows["vt"], 2), _numbers(lines.rows["vn"], 3)
    if not lines.sizes:
        return Content([])
    corners = _corners(path, lines)
    for column, (values, what) in enumerate(((positions, "vertex"), (uv, "texture coordinate"), (normals, "normal"))):
        wrong = corners[corners[:, column] >= len(values), column]
        if len(wrong):
            raise InputError(f"{path}: a face names {what} {wrong[0] + 1}, but there are {len(values)}")
    sizes = np.frombuffer(lines.sizes, np.int64)
    material = np.repeat(np.frombuffer(lines.materials, np.int64), sizes)
    key = corners[:, 0]
    counted = (corners[:, 1], len(uv)), (corners[:, 2], len(normals)), (material, len(lines.names))
    for numbers, count in counted:  # one number for what differs in any of them
        if count:
            _, key = np.unique(key * (count + 1) + numbers + 1, return_inverse=True)
    _, first, number = np.unique(key, return_index=True, return_inverse=True)
    used = np.column_stack([corners, material])[first]
    place, has_uv, has_normals = used[:, 0], used[:, 1] >= 0, used[:, 2] >= 0
    part = Part(
        positions[place],
        number.reshape(-1)[triangulated(path, positions, corners[:, 0], sizes)],
        normals[used[:, 2]] if has_normals.all() else None,
        None if colours is None else coloured(colours[place]),
        np.where(has_uv[:, None], uv[used[:, 1]], 0.0).astype(np.float32) if has_uv.any() else None,
        used[:, 3].astype(np.int64) if lines.libraries else None,
    )
    return Content([part], _materials(path, lines) if painted else [])


class _Lines:
    """The lines of an OBJ file by their kind."""

    def __init__(self, path: Path, data: bytes) -> None:
        self.rows: dict[str, list[str]] = {"v": [], "vt": [], "vn": []}
        self.corners: list[str] = []
        """Corners of faces as they are written: vertex, and texture coordinate and normal where they have one."""
        self.sizes, self.materials, self.before = array("q"), array("q"), array("q")
        """Corners and material of each face, and how many vertices, coordinates and normals came before it."""
        self.libraries: list[str] = []
        numbers: dict[str, int] = {}
        current = -1
        for line in _text(data).replace("\\\n", " ").split("\n"):
            key, _, rest = line.strip().replace("\t", " ").partition(" ")
            if key in self.rows:
                self.rows[key].append(rest)
            elif key == "f":
                corners = rest.partition("#")[0].split()
                self.corners += corners
                self.sizes.append(len(corners))
                self.materials.append(current)
                self.before.extend(map(len, self.rows.values()))
            elif key == "usemtl":
                name = rest.strip()
                current = numbers.setdefault(name, len(numbers))
            elif key == "mtllib":
                self.libraries.append(rest.strip())
            elif key in _FREE_FORM:
                raise InputError(f"{path}: holds {key}, a free-form curve or surface, which is not read; save faces")
        self.names = list(numbers)
        """Names of the materials that faces use."""


def _corners(path: Path, lines: _Lines) -> Indices:
    """Vertex, texture coordinate and normal of each corner, counted from 0, -1 for none: (n, 3)."""
    whole = [corner + "//"[corner.count("/") :] for corner in lines.corners]
    words = [word or _NONE for word in "/".join(whole).split("/")]
    said = np.array(words, np.int64).reshape(-1, 3)
    if (said == 0).any():
        corner = lines.corners[int(np.flatnonzero((said == 0).any(axis=1))[0])]
        raise InputError(f"{path}: a face names {corner}, and indices of OBJ count from 1")
    before = np.repeat(np.frombuffer(lines.before, np.int64).reshape(-1, 3), lines.sizes, axis=0)
    none = said == int(_NONE)
    corners: Indices = np.where(none, -1, np.where(said > 0, said - 1, before + said))
    if (lost := (corners < 0) & ~none).any() or none[:, 0].any():
        row = int(np.flatnonzero(lost.any(axis=1) | none[:, 0])[0])
        raise InputError(f"{path}: a face names vertex {lines.corners[row]}, but {before[row, 0]} came before it")
    return corners


def _text(data: bytes) -> str:
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _vertices(rows: list[str]) -> tuple[Floats, npt.NDArray[np.float64] | None]:
    """Positions (n, 3), and the colours behind them where every vertex has some."""
    widths = {len(row.split("#")[0].split()) for row in rows}
    table = _numbers(rows, 6 if widths and min(widths) >= 6 else 3)
    return table[:, :3], table[:, 3:] if table.shape[1] == 6 else None


def _numbers(rows: list[str], width: int) -> Floats:
    """The first numbers of each row, (n, width)."""
    return np.array([row.split("#")[0].split()[:width] for row in rows], np.float64).reshape(-1, width)


# Materials --------------------------------------------------------------------------------------------------


def _materials(path: Path, lines: _Lines) -> list[Material]:
    """The materials that faces use, in their order."""
    if not lines.libraries:
        return []
    known: dict[str, Material] = {}
    for library in lines.libraries:
        for name, table in _tables(_beside(path, library)):
            if name in lines.names and name not in known:
                known[name] = _material(path, table)
    missing = next((name for name in lines.names if name not in known), None)
    if missing is not None:
        named, libraries = (short(text, quoted=False) for text in (missing, ", ".join(lines.libraries)))
        raise InputError(f"{path}: no material {named} is in {libraries}; set the object's colour")
    return [known[name] for name in lines.names]


def _beside(path: Path, name: str) -> Path:
    """The file that another one names. Raises `InputError` where it is not there."""
    found = path.parent / name.replace("\\", "/")
    if not is_there(found):
        raise InputError(
            f"{path}: names {short(name, False)}, which is not there; add it, or set the object's colour"
        )
    return found


def _tables(path: Path) -> Iterator[tuple[str, dict[str, str]]]:
    """Names of a library's materials, and their lines by key."""
    data = read_file(path, _MOST_MATERIAL_BYTES, "a library of materials")
    table: dict[str, str] | None = None
    name = ""
    for line in _text(data).split("\n"):
        key, _, rest = line.strip().replace("\t", " ").partition(" ")
        if key == "newmtl":
            if table is not None:
                yield name, table
            name, table = rest.strip(), {}
        elif table is not None and key and not key.startswith("#"):
            table[key.lower()] = rest.strip()
    if table is not None:
        yield name, table


def _material(path: Path, table: dict[str, str]) -> Material:
    """Diffuse colour and picture, and what cuts it out."""
    numbers = table.get("kd", "1 1 1").split()
    if numbers[0] in ("spectral", "xyz"):
        raise InputError(f"{path}: its Kd {numbers[0]} is not read; write three numbers, or set the object's colour")
    red, green, blue = decoded(np.clip(np.array((numbers * 3)[:3], np.float64), 0.0, 1.0)).tolist()
    picture, clamps = _picture(path, table.get("map_kd"))
    mask, _ = _picture(path, table.get("map_d"))
    if mask is not None:
        alpha = mask[..., 3] if mask[..., 3].min() < 255 else mask[..., 0]
        if picture is None:
            picture = np.full((*alpha.shape, 4), 255, np.uint8)
        if alpha.shape != picture.shape[:2]:
            raise InputError(f"{path}: map_d must have the size of map_Kd; scale it, or set the object's colour")
        picture[..., 3] = alpha
    cutoff = 0.5 if picture is not None and picture[..., 3].min() < 255 else 0.0
    wrap = ("clamp", "clamp") if clamps else ("repeat", "repeat")
    return Material((red, green, blue, 1.0), picture, cutoff, wrap)  # type: ignore[arg-type]


def _picture(path: Path, said: str | None) -> tuple[npt.NDArray[np.uint8] | None, bool]:
    """The picture that a line names, and whether it ends at its edges."""
    if not said:
        return None, False
    words, clamps = said.split(), False
    while words and words[0] in (*_OPTIONS, "-clamp", "-o", "-s", "-t"):
        if words[0] in ("-o", "-s", "-t"):
            raise InputError(f"{path}: the option {words[0]} of a picture is not read; move the texture coordinates")
        clamps |= words[:2] == ["-clamp", "on"]
        words = words[1 + _OPTIONS.get(words[0], 1) :]
    return read_rgba(_beside(path, " ".join(words))).copy(), clamps
