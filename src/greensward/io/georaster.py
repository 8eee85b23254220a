"""Elevation that GDAL reads, through rasterio: GeoTIFF of every sample type, ESRI grids, DTED and more."""

import contextlib
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from greensward.io.rasters import check_shape, decoding, silence
from greensward.io.samples import Samples
from greensward.scene.errors import InputError
from greensward.scene.files import open_file

# drivers that open no other file or address, by the beginning of the file or else by the ending of its name
_BEGINNINGS = {b"\x89PNG": "PNG", b"II": "GTiff", b"MM": "GTiff", b"EHFA": "HFA"}
ENDINGS = {
    ".tif": "GTiff",
    ".tiff": "GTiff",
    ".asc": "AAIGrid",
    ".dt0": "DTED",
    ".dt1": "DTED",
    ".dt2": "DTED",
    ".dem": "USGSDEM",
    ".img": "HFA",
}
_METRES = {
    "m": 1.0,
    "metre": 1.0,
    "meter": 1.0,
    "ft": 0.3048,
    "foot": 0.3048,
    "feet": 0.3048,
    "international foot": 0.3048,
    "us survey foot": 1200 / 3937,
    "us-ft": 1200 / 3937,
    "foot_us": 1200 / 3937,
    "ftus": 1200 / 3937,
    "dm": 0.1,
    "decimetre": 0.1,
    "cm": 0.01,
    "centimetre": 0.01,
    "mm": 0.001,
    "millimetre": 0.001,
    "km": 1000.0,
    "kilometre": 1000.0,
}
_MOST_LATITUDE_DEG = 2.0
"""Latitude that a ground may span whose degrees become metres by the scale at its middle: 2 % of width at 50°."""


def read_samples(path: Path, band: int | None) -> Samples:
    """The samples of one band, row 0 north and column 0 west, with what GDAL knows of them.

    Without `band` there is one, apart from alpha, or all are alike. Raises `InputError` for what makes no heights.
    """
    with _opened(path) as source:
        chosen = _band(path, source, band)
        values, known = source.read(chosen), source.read_masks(chosen) != 0
        for number, meaning in enumerate(source.colorinterp, 1):
            if meaning.name == "alpha":  # of which GDAL makes a mask for some types only
                known &= source.read(number) != 0
        scale, offset = source.scales[chosen - 1], source.offsets[chosen - 1]
        if values.dtype.kind == "c":
            raise InputError(f"{path}: must hold plain numbers (got complex numbers)")
        if not _is_located(source) and values.dtype in (np.uint8, np.uint16):
            white = float(np.iinfo(values.dtype).max)
            if source.tags(ns="IMAGE_STRUCTURE").get("MINISWHITE") == "YES":
                values = values.dtype.type(white) - values
            return Samples(values, white, known)
        metres = _metres_of(path, source.units[chosen - 1])
        rows, columns = _order(source)
        return Samples(values[::rows, ::columns], None, known[::rows, ::columns], scale * metres, offset * metres)


def extent_m(path: Path) -> tuple[float, float] | None:
    """Distance in metres from the first sample to the last, along x and z, by the file's own reference.

    None where it has none. Raises `InputError` where its cells are no rectangles in metres, or have no known unit.
    """
    with _opened(path) as source:
        if source.transform.is_identity:
            return None
        cells = abs(source.transform.a) * (source.width - 1), abs(source.transform.e) * (source.height - 1)
        if source.crs is None:
            raise InputError(
                f"{path}: its cells have no unit, as it names no reference system; "
                f"set ground.size_m, which is [{cells[0]:g}, {cells[1]:g}] if they are in metres"
            )
        if source.crs.is_geographic:
            degrees = np.degrees(source.crs.units_factor[1])
            middle = source.transform.f + 0.5 * source.height * source.transform.e
            east = source.transform.c + 0.5 * source.width * source.transform.a
            return degrees_in_metres(path, cells[0] * degrees, cells[1] * degrees, middle * degrees, east * degrees)
        wkt = source.crs.to_wkt()
        if not source.crs.is_projected or re.search(r'PROJECTION\["(Mercator|Popular)', wkt):
            raise InputError(
                f"{path}: distances in its reference system, {wkt.split(chr(34))[1]}, are not those on the ground; "
                f"convert it: gdalwarp -t_srs EPSG:CODE {path.name} metres.tif, with the code of a system in metres"
            )
        metres = source.crs.linear_units_factor[1]
        return cells[0] * metres, cells[1] * metres


def degrees_in_metres(
    path: Path, width: float, height: float, latitude: float, longitude: float
) -> tuple[float, float]:
    """Extent in metres of one in degrees, by the scale of WGS 84 at its middle.

    Series of the National Geospatial-Intelligence Agency, "Length of a degree of latitude and longitude".
    """
    if height > _MOST_LATITUDE_DEG or abs(latitude) > 80.0:
        zone = int((longitude + 180.0) // 6.0) % 60 + 1
        code = (32600 if latitude >= 0.0 else 32700) + zone
        raise InputError(
            f"{path}: its cells are in degrees, and over {height:.3g}° of latitude near {latitude:.3g}° they are "
            f"no rectangles; convert it: gdalwarp -t_srs EPSG:{code} {path.name} metres.tif"
        )
    phi = np.radians(latitude)
    north = 111132.92 - 559.82 * np.cos(2 * phi) + 1.175 * np.cos(4 * phi)
    east = 111412.84 * np.cos(phi) - 93.5 * np.cos(3 * phi) + 0.118 * np.cos(5 * phi)
    return float(width * east), float(height * north)


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """The open file, of a size and turn that we accept; nothing of GDAL's or rasterio's reaches the terminal."""
    try:
        import rasterio
    except ImportError:
        raise InputError(
            f'{path}: such elevation is read by rasterio, which is not installed: pip install "greensward[geo]"'
        ) from None
    with open_file(path) as stream:
        head = stream.read(4)
    driver = next((name for start, name in _BEGINNINGS.items() if head.startswith(start)), None)
    driver = driver or ENDINGS.get(path.suffix.lower(), "AAIGrid")
    what = f"elevation of GDAL's format {driver}"
    with decoding(path, what), _quiet(), rasterio.Env(), rasterio.open(path.absolute(), driver=driver) as it:
        check_shape(path, it.shape)
        if it.subdatasets:
            raise InputError(
                f"{path}: holds {len(it.subdatasets)} pictures; take one out: "
                f"gdal_translate GTIFF_DIR:1:{path.name} one.tif"
            )
        if it.transform.b or it.transform.d or it.gcps[0]:
            raise InputError(
                f"{path}: its rows do not run from west to east; turn it north up: gdalwarp {path.name} north.tif"
            )
        yield it


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep GDAL's messages from the terminal, also where rasterio's handler of them fails, which Python prints."""
    before = sys.unraisablehook, sys.excepthook
    sys.unraisablehook, sys.excepthook = (lambda _: None), (lambda *_: None)
    try:
        with silence("rasterio"):
            yield
    finally:
        sys.unraisablehook, sys.excepthook = before


def _band(path: Path, source: Any, band: int | None) -> int:
    """The number of the band that holds the heights."""
    names = [interpretation.name for interpretation in source.colorinterp]
    held = [number for number, name in enumerate(names, 1) if name != "alpha"]
    if band is not None and band not in held:
        raise InputError(f"{path}: has no band {band} of heights; it holds {', '.join(map(str, held)) or 'none'}")
    chosen = band or held[0]
    if names[chosen - 1] == "palette":
        raise InputError(
            f"{path}: band {chosen} has a colour table, so its values are colours or classes, not heights"
        )
    if band is None and len(held) > 1:
        first = source.read(chosen)
        if len(held) > 4 or not all(np.array_equal(source.read(number), first) for number in held[1:]):
            raise InputError(f"{path}: holds {len(held)} bands; choose one with band, from {held[0]} to {held[-1]}")
    return chosen


def _is_located(source: Any) -> bool:
    """Return whether values are measured ones: the file has a reference, or says something of its values."""
    about = {**source.tags(), **source.tags(1)}
    meant = (set(source.scales), set(source.offsets), set(source.units)) != ({1.0}, {0.0}, {None})
    placed = source.crs is not None or not source.transform.is_identity
    declared = source.nodata is not None or any(not name.startswith(("TIFFTAG_", "STATISTICS_")) for name in about)
    return source.driver != "PNG" and (placed or declared or meant)


def _order(source: Any) -> tuple[int, int]:
    """Steps along rows and columns that bring north up and west to the left."""
    if source.transform.is_identity:
        return 1, 1
    return (-1 if source.transform.e > 0 else 1), (-1 if source.transform.a < 0 else 1)


def _metres_of(path: Path, unit: str | None) -> float:
    if not unit:
        return 1.0
    name = unit.strip().lower()
    metres = _METRES.get(name) or _METRES.get(name.removesuffix("s"))
    if metres is None:
        raise InputError(
            f"{path}: its heights are in {unit!r}; convert them to metres, and say so: gdal_edit.py -units m"
        )
    return metres
