"""Addresses of parameters: index and sub-index (CiA 301) or IND and PNU (PROFIBUS PKW)."""

from __future__ import annotations

import re
from enum import Enum
from functools import lru_cache
from typing import NamedTuple

from app.errors import UsageError

_OD = re.compile(r"^(?:0x)?([0-9A-Fa-f]{4})h?(?:[:./]([0-9A-Fa-f]{1,2})h?)?$")
_PKW = re.compile(r"^([0-9]{1,3})/([0-9]{1,3})$")


class Addressing(Enum):
    """How a device numbers its parameters."""

    OD = "od"
    PKW = "pkw"

    # Enum's own is written in Python, and addresses are looked up with every value that crosses a bus.
    __hash__ = object.__hash__


class Address(NamedTuple):
    """One parameter: ``major`` is the index (or IND), ``minor`` the sub-index (or PNU)."""

    major: int
    minor: int = 0
    addressing: Addressing = Addressing.OD

    def __str__(self) -> str:
        if self.addressing is Addressing.PKW:
            return f"{self.major}/{self.minor}"
        return f"{self.major:04X}:{self.minor:02X}"

    @property
    def short(self) -> str:
        """Text without the sub-index where it is 0: ``6065`` or ``3110:01``."""
        if self.addressing is Addressing.OD and self.minor == 0:
            return f"{self.major:04X}"
        return str(self)


def is_decimal(text: str) -> bool:
    """True for plain decimal digits, few enough for any number that we read."""
    return text.isascii() and text.isdecimal() and len(text) <= 12


@lru_cache(maxsize=8192)
def parse_address(text: str) -> Address:
    """Read ``6065``, ``3110:01`` (hexadecimal) or ``12/221`` (decimal IND/PNU).

    Raises UsageError on anything else.
    """
    text = text.strip()
    if match := _PKW.match(text):
        ind, pnu = int(match[1]), int(match[2])
        if ind <= 255 and pnu <= 255:
            return Address(ind, pnu, Addressing.PKW)
    elif match := _OD.match(text):
        return Address(int(match[1], 16), int(match[2] or "0", 16))
    raise UsageError(reason=f"'{text}' is no address (examples: 6065, 3110:01, 12/221)")
