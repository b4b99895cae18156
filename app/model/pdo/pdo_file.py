"""PDOs as a person writes them: a TOML file that names what is to change; all that it leaves out stays as it is.

::

    schema = 1

    [tpdo2]
    enabled = true
    cob_id = "$NODEID+0x280"         # as in EDS files (CiA 306), so that one file serves all blades; or 0x28B
    remote = false                   # may be asked for by a remote frame (bit 30 of the COB-ID is 0)
    extended = false                 # 29-bit identifier (bit 29)
    type = 255
    inhibit_ms = 10.0
    event_ms = 50
    sync_start = 0
    mapped = ["6064", "6041/16"]     # without a width: that of the object; 0005 to 0007 only fill bits
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, Final

from app.errors import UsageError
from app.model.address import parse_address
from app.model.datatypes import DataType
from app.model.description import Description
from app.model.pdo.objects import (
    COB_EXTENDED,
    COB_INVALID,
    COB_NO_RTR,
    MAX_DUMMY_INDEX,
    PdoParameters,
)
from app.model.pdo.setup import (
    MAX_MAPPED,
    SUB_EVENT,
    SUB_INHIBIT,
    SUB_SYNC_START,
    SUB_TYPE,
    Direction,
    Mapped,
    PdoId,
    PdoPlace,
    PdoSetup,
    PdoSetups,
)

SCHEMA: Final = 1
_NAME: Final = re.compile(r"(rpdo|tpdo)([1-9][0-9]{0,2})")
_OF_NODE: Final = re.compile(r"\$NODEID *\+ *(0[xX][0-9A-Fa-f]{1,8}|[0-9]{1,9})")
_FLAGS: Final = COB_INVALID | COB_NO_RTR | COB_EXTENDED
_KEYS: Final = frozenset(
    {"enabled", "cob_id", "remote", "extended", "type", "inhibit_ms", "event_ms", "sync_start", "mapped"}
)
_PER_MS: Final = 10
"""The inhibit time counts 100 us (CiA 301, 7.5.2.37)."""
_U8: Final = 0xFF
_U16: Final = 0xFFFF
_PREDEFINED: Final = {Direction.RECEIVE: 0x200, Direction.TRANSMIT: 0x180}
_PREDEFINED_PDOS: Final = 4


def read_pdo_file(
    text: str, file: str, description: Description, node: int, before: PdoSetups
) -> dict[PdoId, PdoSetup]:
    """The PDOs that the file names, as it wants them; ``before`` is how they are set up now.

    Whether a device can be set up so is for ``findings`` to say. Raises UsageError, which names the place in the file.
    """
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise UsageError(reason=f"{file}: {error}") from error
    if document.pop("schema", None) != SCHEMA:
        raise UsageError(reason=f"{file}: 'schema = {SCHEMA}' is missing")
    if not document:
        raise UsageError(reason=f"{file}: names no PDO; write a table like [tpdo2]")
    found = {}
    for name, table in document.items():
        match = _NAME.fullmatch(name)
        pdo = PdoId(Direction(match[1]), int(match[2])) if match else None
        if pdo is None or pdo not in before or not isinstance(table, dict):
            known = ", ".join(str(one).lower() for one in before)
            raise UsageError(reason=f"{file}: '{name}' is no PDO of the device; there are {known}")
        found[pdo] = _Table(f"{file}: [{name}]", table, description, node).setup(before[pdo])
    return found


class _Table:
    """One table of the file; ``where`` begins every complaint."""

    def __init__(self, where: str, table: Mapping[str, Any], description: Description, node: int) -> None:
        self._where = where
        self._table = table
        self._description = description
        self._node = node

    def setup(self, before: PdoSetup) -> PdoSetup:
        """The PDO with what the table changes. Raises UsageError."""
        for key in self._table:
            if key not in _KEYS:
                raise self._wrong(key, f"is none of {', '.join(sorted(_KEYS))}")
        old = before.parameters
        parameters = PdoParameters(
            self._cob_id(old.cob_id),
            self._number("type", old.transmission_type, _U8),
            self._inhibit(old.inhibit_100us),
            self._number("event_ms", old.event_ms, _U16),
            self._number("sync_start", old.sync_start, _U8),
        )
        mapped = before.mapped if "mapped" not in self._table else self._mapped()
        return replace(before, parameters=parameters, mapped=mapped)

    def _cob_id(self, old: int) -> int:
        flags = old & _FLAGS
        for key, bit, means_set in (
            ("enabled", COB_INVALID, False),
            ("remote", COB_NO_RTR, False),
            ("extended", COB_EXTENDED, True),
        ):
            value = self._table.get(key)
            if value is None:
                continue
            if not isinstance(value, bool):
                raise self._wrong(key, "is true or false")
            flags = flags | bit if value is means_set else flags & ~bit
        return flags | self._identifier(old & ~_FLAGS)

    def _identifier(self, old: int) -> int:
        value = self._table.get("cob_id")
        if isinstance(value, str) and (match := _OF_NODE.fullmatch(value.strip())):
            value = int(match[1], 0) + self._node
        if value is None:
            return old
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < COB_EXTENDED:
            raise self._wrong("cob_id", 'is an identifier (0x28B, or "$NODEID+0x280"); bits 29 to 31 have own keys')
        return value

    def _number(self, key: str, old: int, most: int) -> int:
        value = self._table.get(key, old)
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= most:
            raise self._wrong(key, f"is a whole number from 0 to {most}")
        return value

    def _inhibit(self, old: int) -> int:
        value = self._table.get("inhibit_ms")
        if value is None:
            return old
        most = _U16 / _PER_MS
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= most:
            raise self._wrong("inhibit_ms", f"is a number from 0 to {most}")
        units = round(value * _PER_MS)
        if abs(value * _PER_MS - units) > 1e-6:
            raise self._wrong("inhibit_ms", f"counts in steps of {1 / _PER_MS} ms")
        return units

    def _mapped(self) -> tuple[Mapped, ...]:
        value = self._table["mapped"]
        if not isinstance(value, list) or not all(isinstance(one, str) for one in value) or len(value) > MAX_MAPPED:
            raise self._wrong("mapped", f'is a list of at most {MAX_MAPPED} objects like "6064" or "6064/32"')
        return tuple(self._entry(one) for one in value)

    def _entry(self, text: str) -> Mapped:
        name, slash, width = text.partition("/")
        try:
            address = parse_address(name)
        except UsageError as error:
            raise self._wrong("mapped", f"has '{text}', which is no object") from error
        if not slash:
            bits = self._bits_of(text)
        elif width.isascii() and width.isdecimal() and 1 <= int(width[:4]) <= _U8:
            bits = int(width)
        else:
            raise self._wrong("mapped", f"has '{text}', whose width is no number of bits")
        return Mapped(address.major << 16 | address.minor << 8 | bits)

    def _bits_of(self, name: str) -> int:
        address = parse_address(name)
        entry = self._description.entries.get(address)
        bits = None if entry is None else entry.type.bits
        if address.major <= MAX_DUMMY_INDEX and address.minor == 0:
            bits = next((kind.bits for kind in DataType if kind.value == address.major), None)
        if bits is None:
            raise self._wrong("mapped", f"has '{name}', of which no width is known: write '{name}/32' or the like")
        return bits

    def _wrong(self, key: str, what: str) -> UsageError:
        return UsageError(reason=f"{self._where} '{key}' {what}")


def write_pdo_file(
    title: str, places: Iterable[PdoPlace], setups: PdoSetups, description: Description, node: int
) -> str:
    """A file that sets these PDOs up as they are; ``title`` is its first line."""
    lines = [f"# {title}", "# What is left out stays as it is.", f"schema = {SCHEMA}"]
    for place in places:
        setup = setups.get(place.id)
        if setup is not None:
            lines += ["", *_lines(place, setup, description, node)]
    return "\n".join(lines) + "\n"


def _lines(place: PdoPlace, setup: PdoSetup, description: Description, node: int) -> list[str]:
    parameters = setup.parameters
    lines = [f"[{str(place.id).lower()}]", f"enabled = {_flag(setup.enabled)}", f"cob_id = {_id_text(setup, node)}"]
    if place.id.direction is Direction.TRANSMIT:
        lines.append(f"remote = {_flag(parameters.rtr_allowed)}")
    if parameters.extended:
        lines.append("extended = true")
    for sub, key, value in (
        (SUB_TYPE, "type", str(parameters.transmission_type)),
        (SUB_INHIBIT, "inhibit_ms", f"{parameters.inhibit_100us / _PER_MS:g}"),
        (SUB_EVENT, "event_ms", str(parameters.event_ms)),
        (SUB_SYNC_START, "sync_start", str(parameters.sync_start)),
    ):
        if sub in place.subs:
            lines.append(f"{key} = {value}")
    lines.append("mapped = [")
    for one in setup.mapped:
        entry = description.entries.get(one.address)
        lines.append(f'  "{one.address.short}/{one.bits}",' + ("" if entry is None else f"  # {entry.title}"))
    return [*lines, "]"]


def _flag(on: bool) -> str:
    return "true" if on else "false"


def _id_text(setup: PdoSetup, node: int) -> str:
    can_id, number = setup.parameters.can_id, setup.id.number
    usual = _PREDEFINED[setup.id.direction] + 0x100 * (number - 1)
    if number <= _PREDEFINED_PDOS and can_id == usual + node and not setup.parameters.extended:
        return f'"$NODEID+0x{usual:X}"'
    return f"0x{can_id:X}"
