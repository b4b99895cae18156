"""Data types of CiA 301 (section 7.1) and their bytes: little-endian on CAN and Modbus, raw value in Python."""

from __future__ import annotations

import struct
from enum import Enum
from typing import Final

Raw = int | float | str | bytes
"""A raw value: an integer, a float (REAL), a text (VISIBLE_STRING) or bytes (OCTET_STRING, DOMAIN)."""


class DataType(Enum):
    """The CiA 301 data types that the descriptions use; the value is the type's object index."""

    BOOLEAN = 0x0001
    INTEGER8 = 0x0002
    INTEGER16 = 0x0003
    INTEGER32 = 0x0004
    UNSIGNED8 = 0x0005
    UNSIGNED16 = 0x0006
    UNSIGNED32 = 0x0007
    REAL32 = 0x0008
    VISIBLE_STRING = 0x0009
    OCTET_STRING = 0x000A
    UNICODE_STRING = 0x000B
    TIME_OF_DAY = 0x000C
    TIME_DIFFERENCE = 0x000D
    DOMAIN = 0x000F
    INTEGER24 = 0x0010
    REAL64 = 0x0011
    INTEGER40 = 0x0012
    INTEGER48 = 0x0013
    INTEGER56 = 0x0014
    INTEGER64 = 0x0015
    UNSIGNED24 = 0x0016
    UNSIGNED40 = 0x0018
    UNSIGNED48 = 0x0019
    UNSIGNED56 = 0x001A
    UNSIGNED64 = 0x001B

    is_integer: bool
    """True for BOOLEAN, INTEGERn and UNSIGNEDn."""
    is_signed: bool
    """True for INTEGERn."""
    bits: int | None
    """Width on the wire and in a PDO mapping, in bits; None where the length varies."""
    size: int | None
    """Length of an SDO transfer in bytes; None where it varies."""
    range: tuple[int, int] | None
    """Smallest and largest raw value of an integer type, else None."""

    def __init__(self, _index: int) -> None:
        # Found out once: encoding and decoding ask for these at every frame.
        name, digits = self._name_.rstrip("0123456789"), self._name_.lstrip("ABCDEFGHIJKLMNOPQRSTUVWXYZ_")
        self.is_signed = name == "INTEGER"
        self.is_integer = name in ("INTEGER", "UNSIGNED", "BOOLEAN")
        self.bits = int(digits) if digits else {"BOOLEAN": 1, "TIME_OF_DAY": 48, "TIME_DIFFERENCE": 48}.get(name)
        self.size = None if self.bits is None else (self.bits + 7) // 8
        self.range = None
        if self.is_integer and self.bits is not None:
            half = 1 << self.bits - 1
            self.range = (-half, half - 1) if self.is_signed else (0, 2 * half - 1)


_FLOAT: Final = {DataType.REAL32: "<f", DataType.REAL64: "<d"}


def encode_raw(data_type: DataType, raw: Raw) -> bytes:
    """Bytes of ``raw`` on the wire, least significant byte first.

    Raises ValueError where the value does not fit the type.
    """
    if data_type.is_integer:
        if isinstance(raw, bool) or not isinstance(raw, int):
            raise ValueError(f"{raw!r} is no integer")
        size = data_type.size
        limits = data_type.range
        assert size is not None and limits is not None  # an integer type has both
        if not limits[0] <= raw <= limits[1]:
            raise ValueError(f"{raw} is outside {limits[0]}..{limits[1]}")
        return raw.to_bytes(size, "little", signed=data_type.is_signed)
    if data_type in _FLOAT:
        if not isinstance(raw, int | float):
            raise ValueError(f"{raw!r} is no number")
        return struct.pack(_FLOAT[data_type], raw)
    if data_type is DataType.UNICODE_STRING and isinstance(raw, str):
        return raw.encode("utf-16-le")
    if data_type is DataType.VISIBLE_STRING and isinstance(raw, str):
        return raw.encode("ascii")
    if isinstance(raw, bytes):
        return raw
    raise ValueError(f"{raw!r} does not fit {data_type.name}")


def decode_raw(data_type: DataType, data: bytes) -> Raw:
    """Raw value of ``data`` as it came over the wire.

    Raises ValueError where the length is not the type's. A string is cut at its first NUL;
    bytes that are not ASCII become U+FFFD, so that nothing is lost silently.
    """
    size = data_type.size
    if size is not None and len(data) != size:
        raise ValueError(f"{data_type.name} has {size} bytes, not {len(data)}")
    if data_type.is_integer:
        return int.from_bytes(data, "little", signed=data_type.is_signed)
    if data_type in _FLOAT:
        return float(struct.unpack(_FLOAT[data_type], data)[0])
    if data_type is DataType.VISIBLE_STRING:
        return data.split(b"\0", 1)[0].decode("ascii", "replace")
    if data_type is DataType.UNICODE_STRING:
        return data.decode("utf-16-le", "replace").split("\0", 1)[0]
    return data
