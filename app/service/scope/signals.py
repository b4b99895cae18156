"""What a scope shows: a whole object of a device, or one bit of it, as it crosses the wire."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Final, NamedTuple

from app.errors import ScopeSettingsError, UsageError
from app.model.address import Address, parse_address
from app.model.datatypes import DataType, Raw, decode_raw
from app.model.description import Entry
from app.model.values import quantity_of
from app.service.devices import Target

MAX_SIGNALS: Final = 16
_NAME: Final = re.compile(r"([^/]+/[^/]+/[^/]+)/([0-9A-Fa-f]{4}(?::[0-9A-Fa-f]{2})?)(?:\.([0-9]{1,2}))?")
_FLOATS: Final = (DataType.REAL32, DataType.REAL64)


class Place(NamedTuple):
    """Where an object's values appear."""

    bus: str
    node: int
    address: Address


@dataclass(frozen=True, slots=True)
class Signal:
    """One signal. ``bit`` None: the whole object. ``scaled = raw x scale``, in ``unit``.

    ``title`` is the object's name; ``bit_key`` the text key of the bit's, where the description names it.
    """

    name: str
    device: str
    place: Place
    bit: int | None
    type: DataType
    title: str
    bit_key: str | None
    unit: str
    scale: Decimal

    @property
    def code(self) -> str:
        """Of the array that holds its raw values exactly (module ``array``)."""
        if self.bit is not None:
            return "B"
        return "d" if self.type in _FLOATS else "Q" if self.type is DataType.UNSIGNED64 else "q"


def resolve(names: Sequence[str], find: Callable[[str], Target]) -> tuple[Signal, ...]:
    """The signals ``<device>/<address>`` or ``<device>/<address>.<bit>``, each once.

    ``find`` gives the device of a slug, or raises UsageError. Raises ScopeSettingsError.
    """
    if not names:
        raise ScopeSettingsError(field="signals", reason_key="scope.flaw.none")
    if len(names) > MAX_SIGNALS:
        raise ScopeSettingsError(field="signals", reason_key="scope.flaw.many", limit=MAX_SIGNALS)
    signals = tuple({one.name: one for one in (resolve_one(name, find) for name in names)}.values())
    return signals


def resolve_one(name: str, find: Callable[[str], Target]) -> Signal:
    """The signal of that name. Raises ScopeSettingsError."""
    match = _NAME.fullmatch(name)
    if match is None:
        raise ScopeSettingsError(field=name, reason_key="scope.flaw.name")
    slug, address, bit = match[1], parse_address(match[2]), None if match[3] is None else int(match[3])
    try:
        target = find(slug)
    except UsageError as error:
        raise ScopeSettingsError(field=name, reason_key="scope.flaw.device") from error
    entry = target.description.entries.get(address)
    if entry is None or not is_number(entry):
        raise ScopeSettingsError(field=name, reason_key="scope.flaw.object")
    place = Place(target.device.bus, target.node, address)
    if bit is None:
        quantity = quantity_of(entry, target.lookup)
        return Signal(
            f"{slug}/{address.short}", slug, place, None, entry.type, entry.title, None, quantity.unit, quantity.scale
        )
    if not entry.type.is_integer or entry.type.bits is None or bit >= entry.type.bits:
        raise ScopeSettingsError(field=name, reason_key="scope.flaw.bit")
    table = None if entry.bits is None else target.description.bit_tables[entry.bits]
    named = next((one for one in table.bits if one.bit == bit), None) if table else None
    key = None if named is None else named.text_key
    full = f"{slug}/{address.short}.{bit}"
    return Signal(full, slug, place, bit, entry.type, entry.title, key, "", Decimal(1))


def is_number(entry: Entry) -> bool:
    """True for objects that can be drawn."""
    return entry.access.readable and (entry.type.is_integer or entry.type in _FLOATS)


def number_of(data_type: DataType, data: bytes) -> int | float | None:
    """The raw number of what crossed the wire; None where its length is not the type's, or a float is no number."""
    try:
        raw: Raw = decode_raw(data_type, data)
    except ValueError:
        return None
    return raw if isinstance(raw, int) or (isinstance(raw, float) and raw - raw == 0) else None
