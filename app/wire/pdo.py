"""Byte codec of PDOs (CiA 301, 7.2.2). Pure; what configures them is in ``app.model.pdo``.

The first mapped entry is in the lowest bits of the frame; every entry is least significant byte first.
"""

from __future__ import annotations

from collections.abc import Mapping as MappingOf
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from app.model.address import Address
from app.model.pdo.objects import COB_EXTENDED as COB_EXTENDED
from app.model.pdo.objects import COB_INVALID as COB_INVALID
from app.model.pdo.objects import COB_NO_RTR as COB_NO_RTR
from app.model.pdo.objects import MAX_DUMMY_INDEX as MAX_DUMMY_INDEX
from app.model.pdo.objects import PDO_COUNT as PDO_COUNT
from app.model.pdo.objects import RPDO_COMMUNICATION as RPDO_COMMUNICATION
from app.model.pdo.objects import RPDO_MAPPING as RPDO_MAPPING
from app.model.pdo.objects import TPDO_COMMUNICATION as TPDO_COMMUNICATION
from app.model.pdo.objects import TPDO_MAPPING as TPDO_MAPPING
from app.model.pdo.objects import PdoParameters as PdoParameters
from app.model.pdo.objects import mapping_entry as mapping_entry
from app.model.pdo.objects import parse_mapping_entry as parse_mapping_entry


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
