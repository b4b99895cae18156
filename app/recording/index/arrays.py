"""Arrays as packed bytes, and raw values as arrays."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import zstandard

from app.model.datatypes import DataType
from app.recording.columns import Samples
from app.recording.index.content import Numbers, Times

_HEAD: Final = struct.Struct("<4sI")
_FLOATS: Final = {DataType.REAL32: "<f4", DataType.REAL64: "<f8"}
_LEVEL: Final = 1


def pack_arrays(*arrays: npt.NDArray[Any]) -> bytes:
    """Arrays of one dimension, integers in the narrowest type that holds them."""
    parts = []
    for array in arrays:
        narrow = np.ascontiguousarray(_narrow(array))
        parts.append(_HEAD.pack(narrow.dtype.str.encode().ljust(4), len(narrow)) + narrow.tobytes())
    return zstandard.ZstdCompressor(level=_LEVEL, write_checksum=True).compress(b"".join(parts))


def unpack_arrays(packed: bytes) -> list[npt.NDArray[Any]]:
    """What ``pack_arrays`` got, in narrow types. Raises ``zstandard.ZstdError`` or ValueError on damaged bytes."""
    data, at, arrays = zstandard.ZstdDecompressor().decompress(packed), 0, []
    while at < len(data):
        name, count = _HEAD.unpack_from(data, at)
        dtype = np.dtype(name.decode().strip())
        at += _HEAD.size
        arrays.append(np.frombuffer(data, dtype, count, at))
        at += count * dtype.itemsize
    return arrays


def _narrow(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    if array.dtype.kind not in "iu" or not len(array):
        return array
    low, high = int(array.min()), int(array.max())
    kinds = ("u1", "u2", "u4", "u8") if low >= 0 else ("i1", "i2", "i4", "i8")
    for kind in kinds:
        limits = np.iinfo(kind)
        if limits.min <= low and high <= limits.max:
            return array.astype("<" + kind)
    return array


def numbers_of(data_type: DataType | None) -> str | None:
    """The type of array that holds raw numbers of a type, or None where its values are none.

    An object that nobody describes is taken as an unsigned number.
    """
    if data_type is None or data_type is DataType.UNSIGNED64:
        return "<u8"
    if data_type in _FLOATS:
        return "<f8"
    return "<i8" if data_type.is_integer else None


def numbers_of_samples(data_type: DataType | None, found: Samples) -> tuple[Times, Numbers]:
    """Times and raw numbers of values read by columns: those that ``to_numbers`` takes for numbers."""
    size = None if data_type is None else data_type.size
    good = (found.size > 0) & (found.size <= 8) if size is None else found.size == size
    numbers = found.raw[good].astype(numbers_of(data_type))
    return finite(found.t_ns[good], numbers)


def finite(times: Times, numbers: Numbers) -> tuple[Times, Numbers]:
    """Without what is no number: it has no place in a plot."""
    if numbers.dtype.kind != "f":
        return times, numbers
    good = np.isfinite(numbers)
    return times[good], numbers[good]


def to_numbers(data_type: DataType | None, values: Sequence[bytes]) -> tuple[Numbers, npt.NDArray[np.bool_]]:
    """Raw numbers of values of a numeric type, and which of ``values`` they are: one of another length is none."""
    size = None if data_type is None else data_type.size
    lengths = np.fromiter(map(len, values), np.int64, len(values))
    good = (lengths > 0) & (lengths <= 8) if size is None else lengths == size
    if not good.all():
        values = [value for value, whole in zip(values, good.tolist(), strict=True) if whole]
        lengths = lengths[good]
    if data_type in _FLOATS:
        numbers = np.frombuffer(b"".join(values), _FLOATS[data_type]).astype(np.float64)
        return numbers, good
    signed = data_type is not None and data_type.is_signed
    return _integers(values, lengths, signed, wide=data_type in (None, DataType.UNSIGNED64)), good


def _integers(values: Sequence[bytes], lengths: npt.NDArray[np.int64], signed: bool, wide: bool) -> Numbers:
    if len(values) and (lengths == lengths[0]).all() and int(lengths[0]) in (1, 2, 4, 8):
        raw = np.frombuffer(b"".join(values), f"<{'i' if signed else 'u'}{lengths[0]}")
        return raw.astype(np.uint64) if wide else raw.astype(np.int64)
    whole = [int.from_bytes(value, "little", signed=signed) for value in values]
    return np.array(whole, np.uint64) if wide else np.array(whole, np.int64)
