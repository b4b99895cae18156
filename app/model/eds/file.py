"""An EDS or DCF as a whole: its head, its lists of objects, its entries."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from app.errors import DescriptionError
from app.model.address import Address, Addressing
from app.model.datatypes import Raw
from app.model.description import (
    LOAD_SIGNATURE,
    SAVE_SIGNATURE,
    Access,
    Bus,
    Description,
    Entry,
    Match,
    SaveCommand,
)
from app.model.eds.ini import EdsWarning, Ini, Warnings, decode, parse, shorten
from app.model.eds.numbers import parse_int
from app.model.eds.objects import AREAS, ObjectReader, area_of
from app.model.eds.sections import Sections

LARGEST_FILE: Final = 32 * 1024 * 1024
"""Bytes; the largest data sheets in the field have about two million."""

_STORE: Final = 0x1010
_RESTORE: Final = 0x1011
_CATEGORIES: Final = {1: None, 2: "communication", 3: "application"}
"""Sub-indices of 1010h and 1011h (CiA 301, 7.5.2.13); those above are the maker's."""


@dataclass(frozen=True, slots=True)
class LoadedEds:
    """What a file says, and where it is not as the standard has it.

    ``values`` are the parameter values of a DCF (ParameterValue, not the defaults), ``node_id`` the node's number
    of the caller or else of the file.
    """

    description: Description
    warnings: list[EdsWarning]
    values: Mapping[Address, Raw]
    node_id: int | None


def load_eds(path: Path, node_id: int | None = None) -> LoadedEds:
    """Read the EDS or DCF at ``path``.

    Raises DescriptionError where the file cannot be read, is too large or describes no object at all; everything else
    is a warning. ``node_id`` is put into values that depend on it; without it that of the file is taken.
    """
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise DescriptionError(file=str(path), line=0, reason=f"is larger than {LARGEST_FILE >> 20} MiB")
        data = path.read_bytes()
    except (OSError, ValueError) as error:
        raise DescriptionError(file=str(path), line=0, reason=f"cannot be read: {error}") from error
    return read_eds(data, path.name, node_id)


def read_eds(data: bytes, file_name: str, node_id: int | None = None) -> LoadedEds:
    """Read an EDS or DCF from its bytes, as ``load_eds`` does; ``file_name`` gives the description its id."""
    warnings = Warnings()
    ini = parse(decode(data, warnings), warnings)
    sections = Sections.of(ini, warnings)
    if not sections.indices():
        raise DescriptionError(file=file_name, line=0, reason="describes no object, so it is no EDS or DCF")
    node_id = _node_id(ini, warnings) if node_id is None else node_id
    reader = ObjectReader(ini, sections, warnings, node_id)
    reader.read_all()
    description = _description(ini, file_name, reader.entries, warnings)
    return LoadedEds(description, warnings.by_line(), reader.values, node_id)


def _node_id(ini: Ini, warnings: Warnings) -> int | None:
    """The node's number in a DCF. CiA 306 spells the section with one m; some tools do not."""
    section = ini.get("DeviceComissioning") or ini.get("DeviceCommissioning")
    value = section.get("NodeID") if section else None
    if value is None:
        return None
    number = _number(value.text)
    if number is None or not 1 <= number <= 127:
        warnings.add(value.line, "node_id", text=value.text)
        return None
    return number


def _description(ini: Ini, file_name: str, entries: dict[Address, Entry], warnings: Warnings) -> Description:
    info, device = ini.section("FileInfo"), ini.section("DeviceInfo")
    for name in ("FileInfo", "DeviceInfo"):
        if ini.get(name) is None:
            warnings.add(0, "section_missing", section=name)
    product = shorten(device.text("ProductName"), 200)
    stem = re.split(r"[\\/]", file_name)[-1].rpartition(".")[0] or file_name
    areas = {area_of(address.major) for address in entries}
    return Description(
        id=_slug(stem) or _slug(product) or "eds",
        version=f"{_number(info.text('FileVersion')) or 0}.{_number(info.text('FileRevision')) or 0}",
        name=product or shorten(stem, 200),
        vendor=shorten(device.text("VendorName"), 200),
        bus=Bus.CANOPEN,
        addressing=Addressing.OD,
        manual=file_name,
        match=_match(ini, entries),
        entries=entries,
        groups=tuple(area.group for area in AREAS if area in areas),
        bit_tables={},
        enumerations={},
        errors={},
        save=_commands(entries, _STORE, SAVE_SIGNATURE),
        load=_commands(entries, _RESTORE, LOAD_SIGNATURE),
    )


def _slug(text: str) -> str:
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode("ascii")
    return re.sub(r"[^a-z0-9]+", "-", plain.lower()).strip("-")[:64].strip("-")


def _match(ini: Ini, entries: Mapping[Address, Entry]) -> Match:
    """Identity from the objects' defaults, else from the head. Zero stands for unknown there."""
    device = ini.section("DeviceInfo")

    def default(index: int, sub: int) -> Raw | None:
        entry = entries.get(Address(index, sub))
        return entry.default if entry else None

    def number(raw: Raw | None, key: str) -> int | None:
        return (raw if isinstance(raw, int) else 0) or _number(device.text(key)) or None

    vendor = number(default(0x1018, 1), "VendorNumber")
    product = number(default(0x1018, 2), "ProductNumber")
    device_type, name = default(0x1000, 0), default(0x1008, 0)
    return Match(
        device_type=device_type if isinstance(device_type, int) else None,
        # Vendor and product say more than a name, which makers like to change.
        device_name=name if isinstance(name, str) and name and not (vendor and product) else None,
        vendor_id=vendor,
        product_code=product,
    )


def _commands(entries: Mapping[Address, Entry], index: int, signature: int) -> tuple[SaveCommand, ...]:
    """Save or restore commands the device has, by the sub-indices of CiA 301."""
    return tuple(
        SaveCommand(address, signature, _CATEGORIES.get(address.minor, f"manufacturer_{address.minor}"))
        for address, entry in entries.items()
        if address.major == index and address.minor > 0 and entry.access in (Access.RW, Access.WO)
    )


def _number(text: str) -> int | None:
    """The number in ``text``, or None: heads are full of texts where numbers should be."""
    try:
        return parse_int(text)
    except ValueError:
        return None
