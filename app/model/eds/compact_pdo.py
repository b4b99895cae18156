"""PDO parameters that an EDS does not spell out (CompactPDO of CiA 306, 4.4)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final, NamedTuple

from app.model.address import Address
from app.model.datatypes import DataType
from app.model.description import Access, Entry, Kind
from app.model.eds.ini import Section, Warnings
from app.model.eds.numbers import parse_int

_GROUP: Final = "area_communication"
_MOST_PDOS: Final = 512
_MOST_MAPPED: Final = 64
_PREDEFINED: Final = 4
"""PDOs whose identifiers come from the node's number (CiA 301, 7.3.5)."""
_PDO_OFF: Final = 0x8000_0000


class _Side(NamedTuple):
    """Receive or transmit PDOs: their objects and the identifier of the first."""

    name: str
    count_key: str
    parameters: int
    mapping: int
    first_cob_id: int


_SIDES: Final = (
    _Side("RPDO", "NrOfRXPDO", 0x1400, 0x1600, 0x200),
    _Side("TPDO", "NrOfTXPDO", 0x1800, 0x1A00, 0x180),
)
_PARAMETERS: Final = (
    ("COB-ID", DataType.UNSIGNED32),
    ("transmission type", DataType.UNSIGNED8),
    ("inhibit time", DataType.UNSIGNED16),
    ("reserved", DataType.UNSIGNED8),
    ("event timer", DataType.UNSIGNED16),
    ("SYNC start value", DataType.UNSIGNED8),
)
"""Sub-indices 1 to 6 of the communication parameters; bit n of CompactPDO stands for sub-index n + 1."""


def implicit_pdos(device: Section, known: Mapping[Address, Entry], warnings: Warnings) -> Iterator[Entry]:
    """Entries of the PDOs that ``DeviceInfo`` counts but no section describes."""
    mask = _number(device, "CompactPDO", warnings)
    if not mask:
        return
    for side in _SIDES:
        wanted = min(_number(device, side.count_key, warnings), _MOST_PDOS)
        described = {address.major for address in known}
        missing = wanted - sum(side.parameters + number in described for number in range(_MOST_PDOS))
        for number in range(_MOST_PDOS):
            if missing <= 0:
                break
            if side.parameters + number not in described:
                missing -= 1
                yield from _parameters(side, number, mask, device.line)
                if side.mapping + number not in described:
                    yield from _mapping(side, number, device.line)


def _parameters(side: _Side, number: int, mask: int, line: int) -> Iterator[Entry]:
    index, name = side.parameters + number, f"{side.name} communication parameter"
    subs = [sub for sub in range(1, len(_PARAMETERS) + 1) if mask >> sub - 1 & 1]
    yield _entry(Address(index, 0), "highest sub-index", name, DataType.UNSIGNED8, max(subs, default=0), line)
    for sub in subs:
        text, data_type = _PARAMETERS[sub - 1]
        entry = _entry(Address(index, sub), text, name, data_type, None, line)
        yield _with_cob_id(entry, side, number) if sub == 1 else entry


def _with_cob_id(entry: Entry, side: _Side, number: int) -> Entry:
    predefined = number < _PREDEFINED
    default = side.first_cob_id + 0x100 * number if predefined else _PDO_OFF
    return _entry(entry.address, entry.name, entry.object_name, entry.type, default, entry.line, predefined)


def _mapping(side: _Side, number: int, line: int) -> Iterator[Entry]:
    index, name = side.mapping + number, f"{side.name} mapping parameter"
    yield _entry(Address(index, 0), "number of mapped objects", name, DataType.UNSIGNED8, None, line)
    for sub in range(1, _MOST_MAPPED + 1):
        yield _entry(Address(index, sub), f"mapped object {sub}", name, DataType.UNSIGNED32, None, line)


def _entry(
    address: Address, name: str, of: str, data_type: DataType, default: int | None, line: int, node_id: bool = False
) -> Entry:
    is_count = address.minor == 0 and of.endswith("communication parameter")
    return Entry(
        address=address,
        name=name,
        object_name=of,
        kind=Kind.RECORD,
        type=data_type,
        access=Access.RO if is_count else Access.RW,
        pdo=False,
        default=default,
        saved=False,
        group=_GROUP,
        section="",
        inferred=True,
        node_id=node_id,
        line=line,
    )


def _number(section: Section, key: str, warnings: Warnings) -> int:
    value = section.get(key)
    if value is None:
        return 0
    try:
        return parse_int(value.text)
    except ValueError:
        warnings.add(value.line, "no_number", section=section.name, key=key, text=value.text)
        return 0
