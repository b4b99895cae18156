"""Byte codec of emergency messages (CiA 301, 7.2.7): 8 bytes on 80h + node. Pure."""

from __future__ import annotations

import struct
from typing import Final, NamedTuple

EMCY_BASE: Final = 0x080
NO_ERROR: Final = 0x0000
_EMCY: Final = struct.Struct("<HB5s")

ERROR_CLASSES: Final = (
    0x0000, 0x1000, 0x2000, 0x2100, 0x2200, 0x2300, 0x3000, 0x3100, 0x3200, 0x3300, 0x4000, 0x4100, 0x4200, 0x5000,
    0x6000, 0x6100, 0x6200, 0x6300, 0x7000, 0x8000, 0x8100, 0x8110, 0x8120, 0x8130, 0x8140, 0x8150, 0x8200, 0x8210,
    0x8220, 0x8230, 0x8240, 0x8250, 0x9000, 0xF000, 0xFF00,
)  # fmt: skip
"""Error codes and classes of table 26; the last 8 bits of a class are free for the profile or the maker."""
_CLASSES: Final = frozenset(ERROR_CLASSES)


class Emcy(NamedTuple):
    """Error code, error register (1001h) and 5 bytes of the maker."""

    code: int
    register: int
    data: bytes


def emcy(code: int, register: int, data: bytes = b"") -> bytes:
    """8 bytes of an emergency message; ``data`` is filled up with zeros. Raises ValueError where it exceeds 5 bytes."""
    if len(data) > 5:
        raise ValueError(f"{len(data)} bytes of the maker, not 5")
    return _EMCY.pack(code, register, data)


def parse_emcy(data: bytes) -> Emcy:
    """Read an emergency message. Raises ValueError on a wrong length."""
    if len(data) != 8:
        raise ValueError(f"{data.hex()} is no emergency message")
    return Emcy(*_EMCY.unpack(data))


def emcy_text_key(code: int) -> str:
    """Text key of the code, else of the narrowest class that holds it, else ``emcy.unknown``."""
    for mask in (0xFFFF, 0xFF00, 0xF000):
        if code & mask in _CLASSES and not (mask == 0xF000 and code < 0x1000):
            return f"emcy.{code & mask:04x}"
    return "emcy.unknown"
