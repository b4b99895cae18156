"""Byte codec of PDOs and of the objects that configure them (CiA 301, 7.2.2 and 7.5.2.33 ff). Pure.

The first mapped entry is in the lowest bits of the frame; every entry is least significant byte first.
"""

from __future__ import annotations

from collections.abc import Mapping as MappingOf
from dataclasses import dataclass
from functools import cached_property
from typing import Final, NamedTuple

from app.model.address import Address

RPDO_COMMUNICATION: Final = 0x1400
RPDO_MAPPING: Final = 0x1600
TPDO_COMMUNICATION: Final = 0x1800
TPDO_MAPPING: Final = 0x1A00
PDO_COUNT: Final = 512

COB_INVALID: Final = 0x80000000
COB_NO_RTR: Final = 0x40000000
COB_EXTENDED: Final = 0x20000000
MAX_DUMMY_INDEX: Final = 0x001F
"""Up to here an index in a mapping is a data type: bits that nobody reads (7.4.7)."""


class PdoParameters(NamedTuple):
    """Communication parameters (14xxh, 18xxh). ``cob_id`` is the raw UNSIGNED32 of sub-index 1.

    ``inhibit_100us`` is sub-index 3, ``event_ms`` sub-index 5, ``sync_start`` sub-index 6.
    """

    cob_id: int
    transmission_type: int = 255
    inhibit_100us: int = 0
    event_ms: int = 0
    sync_start: int = 0

    @property
    def valid(self) -> bool:
        """True where the PDO exists: bit 31 of the COB-ID is 0."""
        return not self.cob_id & COB_INVALID

    @property
    def rtr_allowed(self) -> bool:
        """True where a TPDO may be asked for by a remote frame: bit 30 is 0."""
        return not self.cob_id & COB_NO_RTR

    @property
    def extended(self) -> bool:
        """True where it has a 29-bit identifier."""
        return bool(self.cob_id & COB_EXTENDED)

    @property
    def can_id(self) -> int:
        """The CAN identifier."""
        return self.cob_id & (0x1FFFFFFF if self.extended else 0x7FF)


class Slot(NamedTuple):
    """Where an entry lies: bytes ``start`` to ``stop`` of a PDO."""

    address: Address
    start: int
    stop: int


@dataclass(frozen=True)
class Mapping:
    """What a PDO carries, in order: addresses with their widths in bits."""

    entries: tuple[tuple[Address, int], ...]

    @cached_property
    def bits(self) -> int:
        """Sum of the widths."""
        return sum(bits for _, bits in self.entries)

    @cached_property
    def size(self) -> int:
        """Bytes of the frame."""
        return (self.bits + 7) // 8

    @cached_property
    def slots(self) -> tuple[Slot, ...] | None:
        """Byte positions without the dummy entries; None where an entry is not on byte borders."""
        slots, position = [], 0
        for address, bits in self.entries:
            if position % 8 or bits % 8:
                return None
            if address.major > MAX_DUMMY_INDEX:
                slots.append(Slot(address, position // 8, (position + bits) // 8))
            position += bits
        return tuple(slots)


def mapping_entry(address: Address, bits: int) -> int:
    """The UNSIGNED32 of 16xxh and 1Axxh: index, sub-index, width. Raises ValueError where the width is not 1..64."""
    if not 1 <= bits <= 64:
        raise ValueError(f"{bits} bits cannot be mapped")
    return address.major << 16 | address.minor << 8 | bits


def parse_mapping_entry(raw: int) -> tuple[Address, int]:
    """Read an UNSIGNED32 of 16xxh or 1Axxh: the address and its width in bits."""
    return Address(raw >> 16 & 0xFFFF, raw >> 8 & 0xFF), raw & 0xFF


def pack(mapping: Mapping, values: MappingOf[Address, bytes]) -> bytes:
    """Data of a PDO; dummy entries are 0. Raises KeyError where a mapped address has no value."""
    number = position = 0
    for address, bits in mapping.entries:
        if address.major > MAX_DUMMY_INDEX:
            raw = int.from_bytes(values[address], "little") & (1 << bits) - 1
            number |= raw << position
        position += bits
    return number.to_bytes(mapping.size, "little")


def unpack(mapping: Mapping, data: bytes) -> list[tuple[Address, bytes]]:
    """Values of a PDO in the order of its mapping, without dummies. A width of no full bytes is filled up with zeros.

    Raises ValueError where ``data`` is shorter than the mapping; bytes beyond it are not looked at.
    """
    if len(data) < mapping.size:
        raise ValueError(f"{len(data)} bytes where {mapping.size} are mapped")
    if mapping.slots is not None:
        return [(address, data[start:stop]) for address, start, stop in mapping.slots]
    number, values = int.from_bytes(data, "little"), []
    for address, bits in mapping.entries:
        if address.major > MAX_DUMMY_INDEX:
            values.append((address, (number & (1 << bits) - 1).to_bytes((bits + 7) // 8, "little")))
        number >>= bits
    return values
