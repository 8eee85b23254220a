"""Height maps and pictures in; pictures and ground truth out, written aside and renamed into place."""

import contextlib
import os
import threading
import warnings
import zipfile
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import IO, Any, TypeAlias

import numpy as np
import numpy.typing as npt
from PIL import Image, UnidentifiedImageError

from greensward.scene.errors import GreenswardError, InputError

LARGEST_SIDE = 16384
LARGEST_HEIGHT_M = 100_000.0
PICTURES = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG", ".tif": "TIFF", ".tiff": "TIFF", ".webp": "WEBP"}
_GREY = ("1", "L", "LA", "La", "I", "I;16", "I;16L", "I;16B", "I;16N", "F")
_READ = ("PNG", "TIFF", "JPEG", "WEBP", "BMP")
_PICTURE_SPAN_M = (0.0, 10.0)
_GDAL_NO_DATA = 42113
_NOT_NUMBERS = {
    "c": "complex numbers",
    "O": "Python objects",
    "U": "text",
    "S": "text",
    "V": "a table of named columns",
}

Array: TypeAlias = npt.NDArray[Any]
Floats: TypeAlias = npt.NDArray[np.floating[Any]]
_pillow_limit = threading.Lock()


def read_heights(
    path: Path,
    key: str | None = None,
    height_m: tuple[float, float] | None = None,
    height_scale: float = 1.0,
    no_data: float | None = None,
) -> npt.NDArray[np.float32]:
    """Heights in metres, float32 of shape (rows, columns), row 0 first in the file.

    Reads grey PNG and TIFF pictures of 8, 16 or 32 bits, and the array of an `.npy` file or the one named
    `key` of an `.npz` file. `height_m` is what black and white mean in a picture of whole numbers, or the
    lowest and highest value of an array or of a picture of 32-bit, signed or floating-point values; without
    it, the former spans 0 to 10 m and the latter is in metres. Values that are NaN, infinite or equal to
    `no_data` (or to what a GeoTIFF declares as such) are filled smoothly from around them.

    Raises `InputError` for a file that cannot be read or makes no ground.
    """
    with open_file(path) as stream:
        magic = stream.read(6)
        stream.seek(0)
        full: float | None = None
        if magic.startswith(b"PK\x03\x04"):
            raw = _npz_array(path, stream, key)
        elif key is not None:
            raise InputError(f"{path}: has no key {key}; only an .npz file holds named arrays")
        elif magic == b"\x93NUMPY":
            raw = _npy_array(path, stream)
        else:
            raw, full, declared = _grey(path, stream)
            no_data = declared if no_data is None else no_data
    values, known = _measured(path, raw, no_data)
    # In place: the largest map takes a gigabyte.
    if full is not None or height_m is not None:
        low, high = (0.0, full) if full is not None else (float(values.min()), float(values.max()))
        bottom_m, top_m = height_m or _PICTURE_SPAN_M
        values -= low
        values *= (top_m - bottom_m) / ((high - low) or 1.0)
        values += bottom_m
    values *= height_scale
    lowest, highest = float(values.min()), float(values.max())
    if max(-lowest, highest) > LARGEST_HEIGHT_M:
        raise InputError(
            f"{path}: heights must lie within ±{LARGEST_HEIGHT_M:,.0f} m (got {lowest:g} to {highest:g} m); "
            "if one of these values means 'not measured', name it as no_data"
        )
    return _filled(values.astype(np.float32, copy=False), known)


def read_rgba(path: Path, coloured: bool = False) -> npt.NDArray[np.uint8]:
    """A picture as sRGB and alpha, uint8 of shape (rows, columns, 4), top row first.

    Grey is repeated into all colours, 16 bits become 8, and without alpha it is 255 throughout.
    Raises `InputError` for a file that cannot be read or is no picture, or with `coloured` for a grey one.
    """
    with open_file(path) as stream, _picture(path, stream) as picture:
        if coloured and picture.mode in _GREY:
            raise InputError(f"{path}: is a grey picture, and it needs red, green and blue; save it in colours")
        if picture.mode == "F":
            raise InputError(f"{path}: holds floating-point values; save it as a picture of 8 bits")
        if picture.mode.startswith("I"):
            values = np.asarray(picture).astype(np.int64)
            if values.min() < 0 or values.max() > 65535:
                raise InputError(f"{path}: holds 32-bit values; save it as a picture of 8 bits")
            picture = Image.fromarray(((values * 255 + 32767) // 65535).astype(np.uint8))
        return np.array(picture.convert("RGBA"))


def decoded(srgb: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Linear light in 0..1 of sRGB values in 0..1 (IEC 61966-2-1)."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def encoded(light: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """SRGB values in 0..1 of linear light in 0..1 (IEC 61966-2-1), the inverse of `decoded`."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 0.0031308) ** (1 / 2.4) - 0.055)


def write_picture(path: Path, image: npt.NDArray[np.uint8]) -> None:
    """Write an image, uint8 of shape (rows, columns, 3), in the format that the file's ending names."""
    with written_aside(path) as stream:
        Image.fromarray(image).save(stream, PICTURES[path.suffix.lower()], quality=95)


def write_npz(path: Path, arrays: Mapping[str, Any]) -> None:
    """Write arrays, compressed, into an `.npz` file."""
    with written_aside(path) as stream:
        np.savez_compressed(stream, allow_pickle=False, **arrays)


@contextlib.contextmanager
def written_aside(path: Path) -> Iterator[IO[bytes]]:
    """A stream whose bytes become the file `path` at the end, whole; on any error `path` stays as it was."""
    aside = path.parent / f".{os.getpid()}-{threading.get_ident()}.part"
    try:
        with aside.open("wb") as stream:
            yield stream
        aside.replace(path)
    except OSError as error:
        raise GreenswardError(f"{path}: cannot be written: {error.strerror or error}") from None
    except ValueError as error:
        raise GreenswardError(f"{path}: cannot be written: {error}") from None
    finally:
        with contextlib.suppress(OSError, ValueError):
            aside.unlink(missing_ok=True)


def check_writable(path: Path, endings: tuple[str, ...] = tuple(PICTURES)) -> None:
    """Raise `InputError` if a file cannot be written there, which is best known before hours of work."""
    if path.suffix.lower() not in endings:
        got = f"got {path.suffix}" if path.suffix else "it has none"
        raise InputError(f"{path}: the file's name must end in one of {', '.join(endings)} ({got})")
    folder = path.parent
    try:
        if path.is_dir():
            raise InputError(f"{path}: is a folder, and the output must be a file")
        if not folder.is_dir():
            raise InputError(f"{path}: there is no folder {folder}; make it first")
        trial = folder / f".{os.getpid()}-{threading.get_ident()}.part"
        trial.open("wb").close()
        trial.unlink()
        path.stat()
    except FileNotFoundError:
        return
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be written: {getattr(error, 'strerror', None) or error}") from None


# Files ------------------------------------------------------------------------------------------------------


def open_file(path: Path) -> IO[bytes]:
    """The file, which is there, is a file, and is not empty."""
    try:
        if path.is_dir():
            raise InputError(f"{path}: is a folder, not a file")
        if path.exists() and not path.is_file():
            raise InputError(f"{path}: is not a file")
        if path.stat().st_size == 0:
            raise InputError(f"{path}: is empty (0 bytes)")
        return path.open("rb")
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from None


@contextlib.contextmanager
def decoding(path: Path, what: str) -> Iterator[None]:
    """Turn errors of a decoder into one sentence: decoders raise nearly anything on damaged data, and warn."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except InputError:
        raise
    except MemoryError:
        raise GreenswardError(f"{path}: needs more memory than there is") from None
    except Exception as error:
        raise InputError(f"{path}: is cut short, damaged or not {what} ({error})") from None


def _check_shape(path: Path, shape: tuple[int, ...]) -> None:
    if len(shape) != 2:
        raise InputError(f"{path}: must have 2 dimensions, rows and columns (got {len(shape)})")
    if max(shape) > LARGEST_SIDE:
        raise InputError(
            f"{path}: must be at most {LARGEST_SIDE:,} on a side (got {shape[1]:,} × {shape[0]:,}); "
            "scale it down, or cut out a part"
        )


# Pictures ---------------------------------------------------------------------------------------------------


@contextlib.contextmanager
def _picture(path: Path, stream: IO[bytes]) -> Iterator[Image.Image]:
    """The opened picture, of a size that we accept. Decoding errors inside become `InputError`."""
    kinds = "a picture of PNG, TIFF, JPEG, WebP or BMP"
    with decoding(path, kinds):
        with _pillow_limit:
            # Pillow refuses large pictures by a limit below ours and without telling their size.
            theirs, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
            try:
                picture = Image.open(stream, formats=_READ)
            except UnidentifiedImageError:
                raise InputError(f"{path}: is not {kinds}, or its beginning is damaged") from None
            finally:
                Image.MAX_IMAGE_PIXELS = theirs
        _check_shape(path, (picture.height, picture.width))
        picture.load()
        yield picture


def _grey(path: Path, stream: IO[bytes]) -> tuple[Array, float | None, float | None]:
    """The values of a grey picture, the one that white has, and the one declared as not measured.

    White is None where values are signed, of 32 bits or floating: elevations in metres come so.
    """
    with _picture(path, stream) as picture:
        declared = None
        if picture.format == "TIFF":
            tag = getattr(picture, "tag_v2", {}).get(_GDAL_NO_DATA)
            with contextlib.suppress(TypeError, ValueError):
                declared = float(str(tag).strip("\0 "))
        if picture.mode.startswith("I;16") or (picture.mode == "I" and picture.format == "PNG"):
            return np.asarray(picture), 65535.0, declared
        if picture.mode in ("I", "F"):
            return np.asarray(picture), None, declared
        if picture.mode in ("L", "LA", "La", "1"):
            return np.asarray(picture.convert("L")), 255.0, declared
        rgb = np.asarray(picture.convert("RGB"))
        if (rgb != rgb[..., :1]).any():
            raise InputError(f"{path}: must be a grey picture, but it has colours; save it as 16-bit grey")
        return rgb[..., 0], 255.0, declared


# Arrays -----------------------------------------------------------------------------------------------------


def _npy_array(path: Path, stream: IO[bytes]) -> Array:
    """The array of an `.npy` stream; its header is judged before its data is read."""
    with decoding(path, "an array of NumPy"):
        version = np.lib.format.read_magic(stream)
        read_header = {
            (1, 0): np.lib.format.read_array_header_1_0,
            (2, 0): np.lib.format.read_array_header_2_0,
        }.get(version)
        if read_header is None:
            raise InputError(f"{path}: must hold plain numbers (got {_NOT_NUMBERS['V']})")
        shape, _, dtype = read_header(stream)
        if dtype.kind not in "biuf":
            kind = _NOT_NUMBERS.get(dtype.kind)
            raise InputError(f"{path}: must hold plain numbers (got {kind or f'the type {dtype}'})")
        _check_shape(path, shape)
        stream.seek(0)
        return np.asarray(np.lib.format.read_array(stream, allow_pickle=False))


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
        with archive.open(f"{key or keys[0]}.npy") as member:
            return _npy_array(path, member)


# Holes ------------------------------------------------------------------------------------------------------


def _measured(path: Path, raw: Array, no_data: float | None) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """A copy of the values as floating point, and which were measured; the others have a value of those."""
    if min(raw.shape) < 2:
        raise InputError(f"{path}: must be at least 2 × 2 (got {raw.shape[1]} × {raw.shape[0]})")
    values = raw.astype(np.result_type(raw.dtype, np.float32))
    known = np.isfinite(values)
    if no_data is not None:
        with np.errstate(over="ignore"):
            known &= values != values.dtype.type(no_data)
    share = 1.0 - np.count_nonzero(known) / known.size
    if share == 1.0:
        raise InputError(f"{path}: holds no height: every value is NaN, infinite or no_data")
    if share > 0.9:
        raise InputError(f"{path}: at most 90 % of its values may be missing (got {100 * share:.1f} %)")
    if share > 0:
        values[~known] = values[np.unravel_index(known.argmax(), known.shape)]
    return values, known


def _filled(values: npt.NDArray[np.float32], known: npt.NDArray[np.bool_]) -> npt.NDArray[np.float32]:
    """Fill holes from their surroundings by a pyramid (push-pull): halve until none is left, then refine, smoothing
    only inside the holes."""
    if known.all():
        return values
    rows, columns = values.shape
    padding = ((0, rows % 2), (0, columns % 2))
    blocks = ((rows + 1) // 2, 2, (columns + 1) // 2, 2)
    weight = np.pad(known, padding).reshape(blocks).sum(axis=(1, 3), dtype=np.float32)
    total = np.pad(np.where(known, values, 0), padding).reshape(blocks).sum(axis=(1, 3), dtype=np.float32)
    coarse = _filled(total / np.maximum(weight, 1), weight > 0)
    row, column = np.nonzero(~known)
    filled = values.copy()
    filled[row, column] = coarse[row // 2, column // 2]
    above, below = np.maximum(row - 1, 0), np.minimum(row + 1, rows - 1)
    left, right = np.maximum(column - 1, 0), np.minimum(column + 1, columns - 1)
    for _ in range(6):
        filled[row, column] = 0.25 * (
            filled[above, column] + filled[below, column] + filled[row, left] + filled[row, right]
        )
    return filled
