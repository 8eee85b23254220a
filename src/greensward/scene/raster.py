"""Arrays that a scene holds in place of files. Only methods of theirs are used: scenes need no NumPy."""

import hashlib
from typing import Any, Protocol

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema


class Array(Protocol):
    """An array of NumPy."""

    @property
    def __array_interface__(self) -> dict[str, Any]: ...


class Raster:
    """Array of numbers in a scene: a copy that nobody changes, equal to another where type, shape and values are."""

    __slots__ = ("_digest", "values")

    def __init__(self, values: Any) -> None:
        if values.dtype.kind not in "biuf":
            raise ValueError(f"must be an array of plain numbers (got the type {values.dtype})")
        if hasattr(values, "filled"):  # a masked array, such as rasterio reads: what it hides is not measured
            values = values.astype("f8" if values.dtype.itemsize > 4 else "f4").filled(float("nan"))
        self.values = values.copy()
        """The array, of NumPy; read-only."""
        self.values.setflags(write=False)
        about = f"{values.dtype.str} {values.shape}".encode()
        self._digest = hashlib.sha256(about + self.values.tobytes()).digest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Raster) and self._digest == other._digest

    def __hash__(self) -> int:
        return hash(self._digest)

    def __repr__(self) -> str:
        return f"an array of {' × '.join(map(str, self.values.shape))} {self.values.dtype}"

    def __reduce__(self) -> tuple[type["Raster"], tuple[Any]]:
        return Raster, (self.values,)

    def __copy__(self) -> "Raster":
        return self

    def __deepcopy__(self, _: object) -> "Raster":
        return self

    @classmethod
    def __get_pydantic_core_schema__(cls, _source: Any, _handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(
            _heights_in, serialization=core_schema.plain_serializer_function_ser_schema(lambda raster: raster)
        )


def _raster_in(value: Any) -> Raster | None:
    """The raster of an array, None for what is no array."""
    if isinstance(value, Raster):
        return value
    return Raster(value) if hasattr(value, "__array_interface__") and hasattr(value, "setflags") else None


def _heights_in(value: Any) -> Raster:
    """The raster of a two-dimensional array. Raises `ValueError` for anything else."""
    raster = _raster_in(value)
    if raster is None:
        raise ValueError("must be an array of NumPy, which only Python can give; name a file instead")
    if raster.values.ndim != 2:
        raise ValueError(f"must have 2 dimensions, rows and columns (got {raster.values.ndim})")
    return raster


def picture_in(value: Any) -> Raster | None:
    """The raster of an array that holds grey values or colours; None for what is no array.

    Values go from 0 to 255, or as floats to 1. Raises `ValueError` for another array.
    """
    raster = _raster_in(value)
    if raster is None:
        return None
    values = raster.values
    if values.ndim not in (2, 3) or (values.ndim == 3 and values.shape[2] not in (1, 3, 4)) or not values.size:
        raise ValueError(f"must have the shape (rows, columns) or (rows, columns, 3 or 4) (got {raster})")
    if values.dtype.kind != "b" and values.dtype.str[1:] != "u1":
        if values.dtype.kind != "f":
            raise ValueError(f"must hold floats from 0 to 1, or uint8 (got {values.dtype})")
        if not (values.min() >= 0.0 and values.max() <= 1.0):
            raise ValueError(f"must hold floats from 0 to 1, or uint8 (got {values.min():g} to {values.max():g})")
    return raster
