"""What a device really has, against what its description says: asked before anything that is inferred is trusted."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Final, NamedTuple

from app.model.address import Address
from app.model.description import Description, Kind
from app.wire.modbus.image import MAX_ENTRIES, RX_MAPPING, TX_MAPPING
from app.wire.pdo import MAX_DUMMY_INDEX, parse_mapping_entry

STORE, LOAD = 0x1010, 0x1011
_COMMANDS: Final = frozenset({STORE, LOAD})
_COUNTED: Final = frozenset({0x1003, RX_MAPPING, TX_MAPPING})
"""Sub-index 0 says how many are in use, not how many there are."""


class Deviation(Enum):
    """How the device differs."""

    MISSING = "missing"
    """It did not give a described object."""
    EXTRA = "extra"
    """It gives an object that is not described."""
    SUBS = "subs"
    """Sub-index 0 counts otherwise."""
    SIZE = "size"
    """The object has another number of bytes than its type."""
    NOT_READY = "not_ready"
    """A category of 1010h or 1011h that the description saves or restores reads another value than 1."""
    MAPPING = "mapping"
    """An entry of 3502h or 3602h in use maps no described object, or another number of bits than its type has."""


class Finding(NamedTuple):
    """One difference. ``expected`` and ``found`` count sub-indices, bytes or bits, or are a value; None is nothing."""

    address: Address
    deviation: Deviation
    expected: int | None
    found: int | None


def compare(description: Description, dictionary: Mapping[Address, bytes]) -> tuple[Finding, ...]:
    """Every difference between a description and the whole dictionary of a device (FC 101), by address.

    ``dictionary`` holds what the device gave; what cannot be read is not expected in it.
    """
    found = [
        *_subs(description, dictionary),
        *_commands(description, dictionary),
        *_objects(description, dictionary),
        *_mappings(description, dictionary),
        *_extra(description, dictionary),
    ]
    return tuple(sorted(found, key=lambda finding: (finding.address[:2], finding.deviation.value)))


def _subs(description: Description, dictionary: Mapping[Address, bytes]) -> list[Finding]:
    findings = []
    for index, entries in description.objects():
        count = dictionary.get(Address(index, 0))
        if count is None or entries[0].kind is Kind.VAR or index in _COUNTED:
            continue
        expected, number = max(entry.address.minor for entry in entries), int.from_bytes(count, "little")
        if number != expected:
            findings.append(Finding(Address(index, 0), Deviation.SUBS, expected, number))
    return findings


def _commands(description: Description, dictionary: Mapping[Address, bytes]) -> list[Finding]:
    findings = []
    for command in (*description.save, *description.load):
        data = dictionary.get(command.address)
        value = None if data is None else int.from_bytes(data, "little")
        if command.address.major in _COMMANDS and value != 1:
            findings.append(Finding(command.address, Deviation.NOT_READY, 1, value))
    return findings


def _mappings(description: Description, dictionary: Mapping[Address, bytes]) -> list[Finding]:
    findings = []
    for index in (RX_MAPPING, TX_MAPPING):
        count = int.from_bytes(dictionary.get(Address(index, 0), b""), "little")
        for sub in range(1, min(count, MAX_ENTRIES) + 1):
            place = Address(index, sub)
            address, bits = parse_mapping_entry(int.from_bytes(dictionary.get(place, b""), "little"))
            entry = description.entries.get(address)
            expected = None if entry is None else entry.type.bits
            if address.major > MAX_DUMMY_INDEX and bits != expected:
                findings.append(Finding(place, Deviation.MAPPING, expected, bits))
    return findings


def _objects(description: Description, dictionary: Mapping[Address, bytes]) -> list[Finding]:
    findings = []
    for entry in description:
        data, size = dictionary.get(entry.address), entry.type.size
        if not entry.access.readable or entry.address.major in (*_COMMANDS, 0x1003):
            continue
        if data is None:
            findings.append(Finding(entry.address, Deviation.MISSING, size, None))
        elif size is not None and len(data) != size:
            findings.append(Finding(entry.address, Deviation.SIZE, size, len(data)))
    return findings


def _extra(description: Description, dictionary: Mapping[Address, bytes]) -> list[Finding]:
    """What is below 1000h are data types, no parameters."""
    unknown = [address for address in dictionary if address.major >= 0x1000 and address not in description.entries]
    return [Finding(address, Deviation.EXTRA, None, len(dictionary[address])) for address in unknown]
