"""Elevation in: pictures, arrays, GeoTIFF, ESRI grids, SRTM and RAW; with their extent where they tell it."""

import math
import os
import re
import zipfile
from difflib import get_close_matches
from pathlib import Path
from typing import IO, Literal

import numpy as np
import numpy.typing as npt
from PIL import Image

from greensward.io import georaster
from greensward.io.arrays import npy_header, read_npy
from greensward.io.rasters import check_shape, decoding, is_whole, loaded, opened_picture, tiff_tag
from greensward.io.samples import Array, Samples
from greensward.scene.errors import InputError
from greensward.scene.files import check_memory, open_file

ByteOrder = Literal["little", "big"]
_RAW = (".raw", ".r16")
_HGT_VOID = -32768
_GEO_TAGS = (33550, 33922, 34264, 34735, 42112, 42113)  # of GeoTIFF, and of GDAL
_PLAIN_COMPRESSIONS = {1, 2, 5, 7, 8, 32773, 32946}
_TIFF = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_WORLD_FILES = (".tfw", ".tifw", ".wld")
"""Endings of files beside a TIFF that say where it lies."""
_NOT_READ = {
    b"v/1\x01": ("OpenEXR", "oiiotool {0} -o heights.tif"),
    b"\x89HDF": ("HDF5 or netCDF", "gdal_translate {0} heights.tif"),
    b"CDF\x01": ("netCDF", "gdal_translate {0} heights.tif"),
    b"CDF\x02": ("netCDF", "gdal_translate {0} heights.tif"),
    b"LASF": ("a LAS point cloud", "pdal translate {0} heights.tif"),
    b"DSBB": ("a Surfer grid", "gdal_translate {0} heights.tif"),
    b"DSRB": ("a Surfer grid", "gdal_translate {0} heights.tif"),
    b"GRIB": ("GRIB", "gdal_translate {0} heights.tif"),
    b"\0\0\0\x0c": ("JPEG 2000", "gdal_translate {0} heights.tif"),
    b"\xff\x4f\xff\x51": ("JPEG 2000", "gdal_translate {0} heights.tif"),
}
_NOT_NUMBERS = {
    "c": "complex numbers",
    "O": "Python objects",
    "U": "text",
    "S": "text",
    "V": "a table of named columns",
}


def read_heights(
    path: Path,
    key: str | None = None,
    height_m: tuple[float, float] | None = None,
    height_scale: float = 1.0,
    no_data: float | None = None,
    band: int | None = None,
    byte_order: ByteOrder | None = None,
) -> npt.NDArray[np.float32]:
    """Heights in metres, float32 of shape (rows, columns), row 0 at the north.

    Reads grey pictures, the array of an `.npy` file or the one named `key` of an `.npz` file, `band` of what GDAL
    reads, SRTM's `.hgt`, and RAW of 16 bits in `byte_order`. `height_m` is what black and white mean in a picture
    of whole numbers, or the lowest and highest value of measured ones; without it, the former spans 0 to 10 m and
    the latter is in metres, after the scale, offset and unit that the file declares. Values that are NaN, infinite,
    masked, transparent or equal to `no_data` are filled smoothly from around them.

    Raises `InputError` for a file that cannot be read or makes no ground.
    """
    return _samples(path, key, band, byte_order).heights(path, height_m, height_scale, no_data)


def extent_m(path: Path) -> tuple[float, float] | None:
    """Distance from the first sample to the last along x and z, in metres, by the file's own reference, if any.

    Raises `InputError` where it has a reference that does not tell.
    """
    if path.suffix.lower() == ".hgt":
        corner = re.match(r"([NS])(\d\d)([EW])(\d{3})", path.name.upper())
        if not corner:
            raise InputError(f"{path}: must be named by its corner, such as N46E007.hgt, or set ground.size_m")
        south = int(corner[2]) * (1 if corner[1] == "N" else -1)
        west = int(corner[4]) * (1 if corner[3] == "E" else -1)
        return georaster.degrees_in_metres(path, 1.0, 1.0, south + 0.5, west + 0.5)
    with open_file(path) as stream:
        located = _is_for_gdal(path, stream)
    return georaster.extent_m(path) if located else None


def _samples(path: Path, key: str | None, band: int | None, byte_order: ByteOrder | None) -> Samples:
    """Values of the file, and what it says of them."""
    ending = path.suffix.lower()
    with open_file(path) as stream:
        magic = stream.read(6)
        stream.seek(0)
        zipped, for_gdal = magic.startswith(b"PK\x03\x04"), _is_for_gdal(path, stream)
        for name, value, applies, holds in (
            ("key", key, zipped, "only an .npz file holds named arrays"),
            ("byte_order", byte_order, ending in _RAW, "only a RAW file has to be told"),
            ("band", None if band == 1 else band, for_gdal, "it is read as one picture or array"),
        ):
            if value is not None and not applies:
                raise InputError(f"{path}: has no {name} {value}; {holds}")
        if found := next((each for start, each in _NOT_READ.items() if magic.startswith(start)), None):
            raise InputError(f"{path}: is {found[0]}, which is not read; convert it: {found[1].format(path.name)}")
        if zipped:
            return Samples(_npz_array(path, stream, key))
        if magic == b"\x93NUMPY":
            return Samples(_npy_array(path, stream, os.fstat(stream.fileno()).st_size))
        if ending == ".hgt":
            return _hgt(path, stream)
        if ending in _RAW:
            return _raw(path, stream, byte_order)
        if for_gdal:
            return georaster.read_samples(path, band)
        return _grey(path, stream)


# Pictures ---------------------------------------------------------------------------------------------------


def _is_for_gdal(path: Path, stream: IO[bytes]) -> bool:
    """Return whether the file is one that Pillow does not read, or not exactly, and GDAL does."""
    head = stream.read(32)
    stream.seek(0)
    if head.startswith(b"\x89PNG"):
        return len(head) > 25 and head[24] == 16 and head[25] != 0  # colours, or alpha, of 16 bits
    if head[:4] in _TIFF and any(path.with_suffix(ending).exists() for ending in _WORLD_FILES):
        return True
    if head[:4] not in _TIFF:
        return path.suffix.lower() in georaster.ENDINGS or head[:5].lower() == b"ncols"
    try:
        with opened_picture(path, stream) as picture:
            return not _is_plain(picture)
    except InputError:
        return True
    finally:
        stream.seek(0)


def _is_plain(picture: Image.Image) -> bool:
    """Return whether a TIFF has nothing that Pillow would not tell: it is a picture, not measured values."""
    deep = picture.mode in ("I", "F") or picture.mode.startswith("I;16")
    kinds, bits = set(tiff_tag(picture, 339)) or {1}, max(tiff_tag(picture, 258), default=1)
    exact = (is_whole(picture) and bits <= 8) or (
        deep and {(k, bits) for k in kinds} <= {(1, 16), (2, 16), (2, 32), (3, 32)}
    )
    return (
        exact
        and 0 not in tiff_tag(picture, 279) + tiff_tag(picture, 325)
        and not any(tiff_tag(picture, tag) for tag in _GEO_TAGS)
        and set(tiff_tag(picture, 259)) <= _PLAIN_COMPRESSIONS
        and getattr(picture, "n_frames", 1) == 1
    )


def _grey(path: Path, stream: IO[bytes]) -> Samples:
    """The values of a grey picture; signed, 32-bit and floating-point ones are measured."""
    with opened_picture(path, stream) as opened:
        picture = loaded(opened)
        if picture.mode.startswith("I;16") or (picture.mode == "I" and opened.format == "PNG"):
            values = np.asarray(picture)
            return Samples(values, 65535.0, values != picture.info.get("transparency", -1))
        if picture.mode in ("I", "F"):
            return Samples(np.asarray(picture))
        if picture.mode in ("1", "L") and "transparency" not in picture.info:
            return Samples(np.asarray(picture.convert("L")), 255.0)
        rgba = np.asarray(picture.convert("RGBA"))
        if (rgba[..., :3] != rgba[..., :1]).any():
            raise InputError(f"{path}: must be a grey picture, but it has colours; save it as 16-bit grey")
        return Samples(rgba[..., 0], 255.0, rgba[..., 3] > 0)


# Bare numbers -----------------------------------------------------------------------------------------------


def _hgt(path: Path, stream: IO[bytes]) -> Samples:
    """Elevation of the Shuttle Radar Topography Mission: metres, big-endian, north first."""
    count = path.stat().st_size / 2
    rows, columns = (3601, 1801) if count == 3601 * 1801 else (math.isqrt(int(count)),) * 2
    if rows * columns != count:
        raise InputError(f"{path}: must be square or 3601 × 1801, of 16 bits (got {path.stat().st_size:,} bytes)")
    check_shape(path, (rows, columns))
    values = np.frombuffer(stream.read(), ">i2").reshape(rows, columns)
    return Samples(values, None, values != _HGT_VOID)


def _raw(path: Path, stream: IO[bytes], byte_order: ByteOrder | None) -> Samples:
    """A square of 16-bit values without a header, as Unity and other engines write."""
    side = math.isqrt(path.stat().st_size // 2)
    if 2 * side * side != path.stat().st_size:
        raise InputError(
            f"{path}: a RAW file must be square and of 16 bits (got {path.stat().st_size:,} bytes); "
            "save other sizes as a 16-bit PNG"
        )
    if byte_order is None:
        raise InputError(
            f"{path}: a RAW file does not tell the order of its bytes; set ground.byte_order, "
            '"little" as most programs write it or "big"'
        )
    check_shape(path, (side, side))
    return Samples(
        np.frombuffer(stream.read(), "<u2" if byte_order == "little" else ">u2").reshape(side, side), 65535.0
    )


# Arrays -----------------------------------------------------------------------------------------------------


def _npy_array(path: Path, stream: IO[bytes], size: int) -> Array:
    """The array of an `.npy` stream of that many bytes; its header is judged before its data is read."""
    with decoding(path, "an array of NumPy"):
        header = npy_header(stream)
        if header is None:
            raise InputError(f"{path}: must hold plain numbers (got {_NOT_NUMBERS['V']})")
        shape, dtype = header
        if dtype.kind not in "biuf":
            kind = _NOT_NUMBERS.get(dtype.kind)
            raise InputError(f"{path}: must hold plain numbers (got {kind or f'the type {dtype}'})")
        check_shape(path, shape)
        check_memory(path, 3 * math.prod(shape) * dtype.itemsize, "cut out a part")
        stream.seek(0)
        return read_npy(stream, size)


def _npz_array(path: Path, stream: IO[bytes], key: str | None) -> Array:
    with decoding(path, "an .npz file"), zipfile.ZipFile(stream) as archive:
        keys = [name.removesuffix(".npy") for name in archive.namelist() if name.endswith(".npy")]
        listed = ", ".join(keys[:12]) + ", …" * (len(keys) > 12)
        if not keys:
            raise InputError(f"{path}: holds no array")
        if key is None and len(keys) > 1:
            raise InputError(f"{path}: holds several arrays; choose one with key: {listed}")
        if key is not None and key not in keys:
            near = "".join(f"; did you mean {name}?" for name in get_close_matches(key, keys, 1))
            raise InputError(f"{path}: has no array {key}; it holds {listed}{near}")
        # Seeking back inside a member reads it again from its start, which the header's size makes cheap.
        member = archive.getinfo(f"{key or keys[0]}.npy")
        with archive.open(member) as opened:
            return _npy_array(path, opened, member.file_size)
