"""Pictures in; pictures and ground truth out."""

import contextlib
import logging
import os
import threading
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import IO, Any, TypeAlias

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageOps, UnidentifiedImageError

from greensward.scene.errors import GreenswardError, InputError
from greensward.scene.files import check_memory, open_file, written_aside
from greensward.scene.problems import short
from greensward.scene.raster import Raster

LARGEST_SIDE = 16384
PICTURES = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG", ".tif": "TIFF", ".tiff": "TIFF", ".webp": "WEBP"}
_GREY = ("1", "L", "LA", "La", "I", "I;16", "I;16L", "I;16B", "I;16N", "F")
_READ = ("PNG", "TIFF", "JPEG", "WEBP", "BMP")
_WHITE_IS_ZERO, _BITS, _COUNTS, _TILE_COUNTS, _INTERPRETATION, _SAMPLE_FORMAT = 0, 258, 279, 325, 262, 339  # of TIFF

Array: TypeAlias = npt.NDArray[Any]
_pillow_limit = threading.RLock()


def read_rgba(path: Path | Raster, coloured: bool = False) -> npt.NDArray[np.uint8]:
    """A picture as sRGB and alpha, uint8 of shape (rows, columns, 4), top row first.

    Grey is repeated into all colours, 16 bits become 8, and without alpha it is 255 throughout. What EXIF says of its
    turn is applied. An array of the scene is converted.
    Raises `InputError` for a file that cannot be read or is no picture, or with `coloured` for a grey one.
    """
    if isinstance(path, Raster):
        return _pixels_of(path)
    with open_file(path) as stream:
        return rgba_from(path, stream, coloured)


def _pixels_of(raster: Raster) -> npt.NDArray[np.uint8]:
    """sRGB and alpha, uint8 (rows, columns, 4), of an array of grey values or colours."""
    values = raster.values if raster.values.ndim == 3 else raster.values[..., None]
    if values.dtype != np.uint8:
        values = np.round(255.0 * values.astype(np.float64)).astype(np.uint8)
    pixels = np.full((*values.shape[:2], 4), 255, np.uint8)
    pixels[..., : max(values.shape[2], 3)] = values
    return pixels


def rgba_from(path: object, stream: IO[bytes], coloured: bool = False) -> npt.NDArray[np.uint8]:
    """The picture in a stream, as `read_rgba` has it; `path` is what errors call it."""
    with opened_picture(path, stream) as opened:
        if opened.mode not in ("F", "I") and not is_whole(opened):
            raise InputError(f"{path}: holds signed values or leaves blocks out; save it as a PNG of 8 bits")
        picture = loaded(opened)
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


def read_colours(path: Path | Raster) -> npt.NDArray[np.uint8]:
    """A picture as `read_rgba` has it; what is transparent has the colours of what is visible beside it."""
    return spread(read_rgba(path))


def spread(picture: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """The picture (rows, columns, 4) with hidden colours replaced, so that filtering and mipmaps never show them.

    Texels of alpha 0 take the mean of the visible ones in the smallest square of a pyramid that has any (push-pull).
    """
    hidden = picture[..., 3] == 0
    if not hidden.any() or hidden.all():
        return picture
    rows, columns = hidden.shape
    total = np.zeros((-(-rows // 2), -(-columns // 2), 4), np.float32)
    for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
        part = picture[i::2, j::2].astype(np.float32)
        total[: part.shape[0], : part.shape[1]] += np.concatenate([part[..., :3] * part[..., 3:], part[..., 3:]], -1)
    seen = total[..., 3:] > 0.0
    coarse = np.round(np.concatenate([total[..., :3] / np.where(seen, total[..., 3:], 1.0), 255.0 * seen], -1))
    behind = spread(coarse.astype(np.uint8))[..., :3].repeat(2, axis=0).repeat(2, axis=1)[:rows, :columns]
    result = picture.copy()
    np.copyto(result[..., :3], behind, where=hidden[..., None])
    return result


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


def write_picture_and_truth(path: Path, image: npt.NDArray[np.uint8], truth: Path, arrays: Mapping[str, Any]) -> None:
    """Write an image and the arrays of its ground truth, both or neither."""
    with written_aside(path) as picture, written_aside(truth) as archive:
        Image.fromarray(image).save(picture, PICTURES[path.suffix.lower()], quality=95)
        np.savez_compressed(archive, allow_pickle=False, **arrays)
        picture.flush()


def write_npz(path: Path, arrays: Mapping[str, Any]) -> None:
    """Write arrays, compressed, into an `.npz` file."""
    with written_aside(path) as stream:
        np.savez_compressed(stream, allow_pickle=False, **arrays)


# Decoding ---------------------------------------------------------------------------------------------------


@contextlib.contextmanager
def decoding(path: object, what: str) -> Iterator[None]:
    """Turn errors of a decoder into one sentence: decoders raise nearly anything on damaged data, warn and log."""
    try:
        with warnings.catch_warnings(), silence("PIL"):
            warnings.simplefilter("ignore")
            yield
    except InputError:
        raise
    except MemoryError:
        raise GreenswardError(f"{path}: needs more memory than there is") from None
    except Exception as error:
        # others tell of the decoder, not of the file
        words = error.strerror or str(error) if isinstance(error, OSError) else str(error)
        told = f" ({short(words, False)})" if words and isinstance(error, OSError | ValueError) else ""
        raise InputError(f"{path}: is cut short, damaged or not {what}{told}") from None


@contextlib.contextmanager
def silence(library: str) -> Iterator[None]:
    """Keep a library's log from the terminal."""
    log, nothing = logging.getLogger(library), logging.NullHandler()
    before, log.propagate = log.propagate, False
    log.addHandler(nothing)
    try:
        yield
    finally:
        log.removeHandler(nothing)
        log.propagate = before


def check_shape(path: object, shape: tuple[int, ...]) -> None:
    """Raise `InputError` unless there are two dimensions, of a size that we accept."""
    if len(shape) != 2:
        raise InputError(f"{path}: must have 2 dimensions, rows and columns (got {len(shape)})")
    if max(shape) > LARGEST_SIDE:
        raise InputError(
            f"{path}: must be at most {LARGEST_SIDE:,} on a side (got {shape[1]:,} × {shape[0]:,}); "
            "scale it down, or cut out a part"
        )


# Pictures ---------------------------------------------------------------------------------------------------


@contextlib.contextmanager
def opened_picture(path: object, stream: IO[bytes]) -> Iterator[Image.Image]:
    """The opened picture, of a size that we accept, to be `loaded`. Decoding errors inside become `InputError`."""
    kinds = "a picture of PNG, TIFF, JPEG, WebP or BMP"
    with decoding(path, kinds), _without_limit():
        try:
            picture = Image.open(stream, formats=_READ)
        except UnidentifiedImageError:
            raise InputError(f"{path}: is not {kinds}, or its beginning is damaged") from None
        check_shape(path, (picture.height, picture.width))
        check_memory(path, 10 * picture.height * picture.width, "scale it down, or cut out a part")
        with _silent_libtiff() if picture.format == "TIFF" else contextlib.nullcontext():
            yield picture


@contextlib.contextmanager
def _silent_libtiff() -> Iterator[None]:
    """Keep from the terminal what libtiff writes there itself, past Pillow and Python."""
    try:
        kept = os.dup(2)
    except OSError:  # there is no terminal
        yield
        return
    try:
        with Path(os.devnull).open("wb") as nothing:
            os.dup2(nothing.fileno(), 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)


@contextlib.contextmanager
def _without_limit() -> Iterator[None]:
    """Let Pillow open and load large pictures: its limit is below ours, and it does not tell their size."""
    with _pillow_limit:
        theirs, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
        try:
            yield
        finally:
            Image.MAX_IMAGE_PIXELS = theirs


def is_whole(picture: Image.Image) -> bool:
    """Return whether Pillow reads the values as they are meant: of a TIFF, without sign and no block left out."""
    return picture.format != "TIFF" or (
        set(tiff_tag(picture, _SAMPLE_FORMAT)) <= {1}
        and 0 not in tiff_tag(picture, _COUNTS) + tiff_tag(picture, _TILE_COUNTS)
        and max(tiff_tag(picture, _BITS), default=1) <= 16
    )


def tiff_tag(picture: Image.Image, tag: int) -> tuple[Any, ...]:
    """The values of a tag of a TIFF; none where it lacks it."""
    value = getattr(picture, "tag_v2", {}).get(tag, ())
    return value if isinstance(value, tuple) else (value,)


def loaded(picture: Image.Image) -> Image.Image:
    """The picture with its pixels, turned as EXIF says, white brightest."""
    picture.load()
    whole: Image.Image = ImageOps.exif_transpose(picture)
    if whole.mode.startswith("I;16") and tiff_tag(picture, _INTERPRETATION) == (_WHITE_IS_ZERO,):
        whole = Image.fromarray(65535 - np.asarray(whole).astype(np.uint16))
    return whole
