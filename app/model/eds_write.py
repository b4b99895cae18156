"""Writes a description as an electronic data sheet (EDS, CiA 306), or as a DCF: an EDS with one device's values.

An EDS can say less than a description: no units, no bit names, no limits that depend on other objects, and no access
``r(w)``. The latter becomes ``rw`` with a comment, since every reader knows ``rw`` and none knows more.

The text depends on the description alone, so that a generated file can be compared with its source: the dates are
those of the device's manual, never of the clock. It is pure ASCII, because readers decode it by the locale of their
machine, and its lines end with CR LF: CiA 306 follows the INI files of Windows, some configuration tools insist on it,
and readers in text mode accept both.
"""

from __future__ import annotations

import re
import struct
import textwrap
import unicodedata
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Final

from app.errors import UsageError
from app.model.address import Address, Addressing
from app.model.datatypes import DataType, Raw
from app.model.description import Access, Bus, Description, Entry, Kind
from app.model.description_file import BUILTIN, builtin_folder, load_builtin

MANDATORY: Final = (0x1000, 0x1001, 0x1018)
"""What every CANopen device has (CiA 301): device type, error register, identity."""
_FIRST_OBJECT: Final = 0x1000
_MANUFACTURER: Final = range(0x2000, 0x6000)
_RPDO: Final = range(0x1400, 0x1600)
_TPDO: Final = range(0x1800, 0x1A00)
_OBJECT_CODE: Final = {Kind.VAR: 7, Kind.ARRAY: 8, Kind.RECORD: 9}
_OBJECT_CODE_DOMAIN: Final = 2
_BIT_RATES_KBIT: Final = (10, 20, 50, 125, 250, 500, 800, 1000)
_BIT_RATE_KBIT: Final = 500
_FLOAT_BITS: Final = {DataType.REAL32: ">f", DataType.REAL64: ">d"}
_DATE: Final = re.compile(r"\b(\d\d)\.(\d\d)\.(\d{4})\b")
_NAME_LENGTH: Final = 241
"""Longest ParameterName of CiA 306."""


@dataclass(frozen=True, slots=True)
class Configured:
    """What makes a DCF of an EDS: the node as it is configured.

    ``values`` are the texts of ParameterValue (``value_text``); ``serial`` 0 is unknown; ``bit_rate_kbit`` of the bus.
    """

    node: int
    name: str
    network: str
    serial: int
    values: Mapping[Address, str]
    comments: tuple[str, ...] = ()
    bit_rate_kbit: int = _BIT_RATE_KBIT


def to_eds(description: Description, file_name: str | None = None, configured: Configured | None = None) -> str:
    """The EDS of ``description``, or with ``configured`` the DCF; ``file_name`` is what the file says of itself.

    Raises UsageError where the device has no object dictionary (IND and PNU).
    """
    if description.addressing is not Addressing.OD:
        raise UsageError(reason=f"{description.id} has no object dictionary, so there is no EDS of it")
    name = file_name or eds_name(description.id)
    lines = chain(
        _file_info(description, name, configured is not None),
        _device_info(description),
        _commissioning() if configured is None else _commissioned(configured),
        _dummy_usage(),
        _comments(description, () if configured is None else configured.comments),
        _objects(description, {} if configured is None else configured.values),
    )
    return "".join(f"{line}\r\n" for line in lines)


def eds_name(description_id: str) -> str:
    """File name of the EDS of a description: ``oat-pmm`` -> ``oat_pmm.eds``."""
    return f"{description_id.replace('-', '_')}.eds"


def write_all(folder: Path) -> list[Path]:
    """Write the EDS of each of our CANopen devices into ``folder``; the paths written."""
    folder.mkdir(parents=True, exist_ok=True)
    return [_write(load_builtin(name), folder) for name in builtin_canopen()]


def builtin_canopen() -> list[str]:
    """Ids of our own descriptions whose devices speak CANopen."""
    present = [name for name, file in BUILTIN.items() if (builtin_folder() / file).is_file()]
    return [name for name in present if load_builtin(name).bus is Bus.CANOPEN]


def _write(description: Description, folder: Path) -> Path:
    path = folder / eds_name(description.id)
    path.write_bytes(to_eds(description, path.name).encode("ascii"))
    return path


def _file_info(description: Description, name: str, is_dcf: bool) -> Iterator[str]:
    version, revision = _version(description.version)
    yield "[FileInfo]"
    yield f"FileName={name}"
    if is_dcf:
        yield f"LastEDS={eds_name(description.id)}"
    yield f"FileVersion={version}"
    yield f"FileRevision={revision}"
    yield "EDSVersion=4.0"
    yield f"Description={_ascii(description.name)}, description {_ascii(description.version)}"
    if match := _DATE.search(description.manual):
        day, month, year = match.groups()
        for what in ("Creation", "Modification"):
            yield f"{what}Time=12:00AM"
            yield f"{what}Date={month}-{day}-{year}"
    yield "CreatedBy=Hubside"
    yield "ModifiedBy=Hubside"
    yield ""


def _version(text: str) -> tuple[int, int]:
    """Major and minor number, each an UNSIGNED8 in an EDS."""
    numbers = [min(int(number), 255) for number in re.findall(r"\d+", text)[:2]]
    major, minor, *_ = [*numbers, 0, 0]
    return major, minor


def _device_info(description: Description) -> Iterator[str]:
    identity = {entry.address.minor: entry.default for entry in description if entry.address.major == 0x1018}
    match = description.match
    yield "[DeviceInfo]"
    yield f"VendorName={_ascii(description.vendor)}"
    yield f"VendorNumber={_number(identity.get(1) or match.vendor_id or 0)}"
    yield f"ProductName={_ascii(description.name)}"
    yield f"ProductNumber={_number(identity.get(2) or match.product_code or 0)}"
    yield f"RevisionNumber={_number(identity.get(3) or 0)}"
    yield "OrderCode="
    for rate in _BIT_RATES_KBIT:
        yield f"BaudRate_{rate}={int(description.bus is Bus.CANOPEN and rate == _BIT_RATE_KBIT)}"
    yield "SimpleBootUpMaster=0"
    yield "SimpleBootUpSlave=1"
    yield "Granularity=8"
    yield "DynamicChannelsSupported=0"
    yield "GroupMessaging=0"
    yield f"NrOfRXPDO={_count(description, _RPDO)}"
    yield f"NrOfTXPDO={_count(description, _TPDO)}"
    yield "LSS_Supported=0"
    yield "CompactPDO=0"
    yield ""


def _count(description: Description, indices: range) -> int:
    return sum(description.has_index(index) for index in indices)


def _commissioning() -> Iterator[str]:
    """A node's number to start from.

    It belongs into a DCF, and an EDS may do without; but checkers that work out ``$NODEID`` stop where none is given.
    """
    yield "[DeviceComissioning]"
    yield "; an example only: the number of the real node takes its place"
    yield "NodeID=1"
    yield ""


def _commissioned(configured: Configured) -> Iterator[str]:
    """The node as it is; the section is spelt as in CiA 306."""
    yield "[DeviceComissioning]"
    yield f"NodeID={configured.node}"
    yield f"NodeName={_name(configured.name)}"
    yield f"Baudrate={configured.bit_rate_kbit}"
    yield "NetNumber=1"
    yield f"NetworkName={_name(configured.network)}"
    yield "CANopenManager=0"
    yield f"LSS_SerialNumber={configured.serial}"
    yield ""


def _dummy_usage() -> Iterator[str]:
    """No data type may stand in a PDO as a gap."""
    yield "[DummyUsage]"
    for data_type in range(1, 8):
        yield f"Dummy{data_type:04X}=0"
    yield ""


def _comments(description: Description, more: tuple[str, ...]) -> Iterator[str]:
    lines = [
        f"Generated by Hubside from the description {description.id} {description.version}.",
        f"Facts from: {description.manual}",
    ]
    restricted = [entry.address.short for entry in description if entry.access is Access.FACTORY]
    if restricted:
        lines.append("These objects are r(w), written by the maker only; an EDS can only call them rw:")
        lines += textwrap.wrap(" ".join(restricted), 100)
    yield "[Comments]"
    yield f"Lines={len(lines) + len(more)}"
    for number, line in enumerate((*map(_ascii, lines), *more), 1):
        yield f"Line{number}={line}"
    yield ""


def _objects(description: Description, values: Mapping[Address, str]) -> Iterator[str]:
    objects = {index: entries for index, entries in description.objects() if index >= _FIRST_OBJECT}
    lists = {
        "MandatoryObjects": [index for index in objects if index in MANDATORY],
        "OptionalObjects": [index for index in objects if index not in MANDATORY and index not in _MANUFACTURER],
        "ManufacturerObjects": [index for index in objects if index in _MANUFACTURER],
    }
    for name, indices in lists.items():
        yield f"[{name}]"
        yield f"SupportedObjects={len(indices)}"
        for number, index in enumerate(indices, 1):
            yield f"{number}=0x{index:04X}"
        yield ""
        for index in indices:
            yield from _object(index, objects[index], values)


def _object(index: int, entries: list[Entry], values: Mapping[Address, str]) -> Iterator[str]:
    first = entries[0]
    if first.kind is Kind.VAR:
        yield from _entry(f"{index:04X}", first.object_name, first, values.get(first.address))
        return
    yield f"[{index:04X}]"
    yield f"ParameterName={_name(first.object_name)}"
    yield f"ObjectType=0x{_OBJECT_CODE[first.kind]:X}"
    yield f"SubNumber={len(entries)}"
    yield ""
    for entry in entries:
        yield from _entry(f"{index:04X}sub{entry.address.minor:X}", entry.name, entry, values.get(entry.address))


def _entry(section: str, name: str, entry: Entry, value: str | None) -> Iterator[str]:
    code = _OBJECT_CODE_DOMAIN if entry.type is DataType.DOMAIN else _OBJECT_CODE[Kind.VAR]
    yield f"[{section}]"
    yield f"ParameterName={_name(name)}"
    yield f"ObjectType=0x{code:X}"
    yield f"DataType=0x{entry.type.value:04X}"
    if entry.access is Access.FACTORY:
        yield "; r(w): written by the maker only"
        yield "AccessType=rw"
    else:
        yield f"AccessType={entry.access.value}"
    yield from _limits(entry)
    default = _default(entry)
    if default is not None:
        yield f"DefaultValue={default}"
    yield f"PDOMapping={int(entry.pdo)}"
    if value is not None:
        yield f"ParameterValue={value}"
    yield ""


def _limits(entry: Entry) -> Iterator[str]:
    """Limits that are plain integers, unless an allowed value lies outside: readers refuse such an object."""
    allowed = [raw for raw in (entry.default, *entry.also) if isinstance(raw, int)]
    for key, limit in (("LowLimit", entry.minimum), ("HighLimit", entry.maximum)):
        if not isinstance(limit, int) or not entry.type.is_integer:
            continue
        outside = [raw for raw in allowed if (raw < limit if key == "LowLimit" else raw > limit)]
        if outside:
            yield f"; {key} {limit} is left out: {outside[0]} is allowed"
        else:
            yield f"{key}={limit}"


def _default(entry: Entry) -> str | None:
    """Text of the default: decimal, or hexadecimal where the manual shows it so; None where there is none.

    A REAL is the pattern of its bits, in hexadecimal; a text that an INI file cannot hold is left out.
    """
    raw = entry.default
    if raw is None:
        return None
    if entry.node_id and isinstance(raw, int):
        return f"$NODEID+0x{raw:X}"
    return value_text(entry, raw)


def value_text(entry: Entry, raw: Raw) -> str | None:
    """A raw value of the entry's type as an EDS writes it; None for a text that an INI file cannot hold."""
    if isinstance(raw, bytes):
        return raw.hex().upper()
    if isinstance(raw, str):
        whole = raw.isascii() and raw.isprintable() and raw == raw.strip() and not re.search(r"\s[;#]|^[;#]", raw)
        return raw if whole and raw else None
    if pattern := _FLOAT_BITS.get(entry.type):
        return f"0x{struct.pack(pattern, raw).hex().upper()}"
    return _number(raw) if entry.hexadecimal else f"{raw:d}"


def _number(raw: Raw) -> str:
    return f"0x{raw:X}" if isinstance(raw, int) and raw >= 0 else str(raw)


def _name(text: str) -> str:
    return _ascii(text)[:_NAME_LENGTH]


def _ascii(text: str) -> str:
    """The text on one line without accents; what has no ASCII form becomes a question mark.

    A blank before ``;`` or ``#`` would begin a comment for many readers, so these two are replaced.
    """
    plain = unicodedata.normalize("NFKD", text.replace("ß", "ss").replace("°", " deg "))
    without_accents = "".join(char for char in plain if not unicodedata.combining(char))
    ascii_text = without_accents.encode("ascii", "replace").decode("ascii")
    return " ".join(ascii_text.replace(";", ",").replace("#", "no.").split())
