"""The three forms of a value: ``raw`` (as the object holds it), ``scaled`` (number with a unit), ``shown`` (text).

Depends on nothing but the description and on other objects of the device through ``lookup``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from ipaddress import AddressValueError, IPv4Address

from app.errors import ValueTypeError
from app.model.address import Address
from app.model.datatypes import DataType, Raw
from app.model.description import Description, Entry, LimitRef, Lookup, Quantity

_NUMBER = re.compile(r"^([-+]?[0-9]+(?:[.,][0-9]+)?)\s*((?![eE][-+]?[0-9])[^0-9].*)?$")
MAX_TEXT = 1000
_IPV4_MOST = (1 << 32) - 1
_HEX = re.compile(r"^(?:0x([0-9A-Fa-f]+)|([0-9A-Fa-f]+)h)$")


@dataclass(frozen=True, slots=True)
class Scaled:
    """A number with its unit."""

    number: Decimal
    unit: str


def quantity_of(entry: Entry, lookup: Lookup) -> Quantity:
    """Unit and factor in force. Where they depend on objects that are not known, those of the defaults."""
    rule = entry.quantity_rule
    if rule is None:
        return entry.quantity
    source = lookup(rule.address)
    if rule.shaft is None:
        return rule.choices.get(source, entry.quantity) if isinstance(source, int) else entry.quantity
    shaft = lookup(rule.shaft)
    if not isinstance(source, int) or not isinstance(shaft, int) or source == 0 or shaft == 0:
        return entry.quantity
    return Quantity(entry.quantity.unit, Decimal(360) * shaft / source)


def to_scaled(entry: Entry, raw: Raw, lookup: Lookup) -> Scaled | None:
    """Raw to number and unit; None for texts and bytes."""
    if isinstance(raw, str | bytes):
        return None
    quantity = quantity_of(entry, lookup)
    return Scaled(Decimal(str(raw)) * quantity.scale, quantity.unit)


def show(entry: Entry, raw: Raw, lookup: Lookup) -> str:
    """Text of a value, without unit: decimals as the scale has them, hexadecimal where the manual uses it.

    An address of the internet is four numbers, 192.168.2.20.
    """
    if isinstance(raw, str):
        return raw
    if isinstance(raw, bytes):
        return raw.hex(" ")
    if entry.ipv4 and isinstance(raw, int) and 0 <= raw <= _IPV4_MOST:
        return str(IPv4Address(raw))
    if (entry.hexadecimal or entry.bits is not None) and isinstance(raw, int) and entry.type.size:
        return f"{raw & (1 << 8 * entry.type.size) - 1:0{2 * entry.type.size}X}h"
    quantity = quantity_of(entry, lookup)
    if quantity.scale == 1:
        return str(raw)
    number = Decimal(str(raw)) * quantity.scale
    exponent = quantity.scale.normalize().as_tuple().exponent
    decimals = min(max(0, -exponent), 6) if isinstance(exponent, int) else 0
    return f"{number:.{decimals}f}"


def parse(description: Description, entry: Entry, text: str, lookup: Lookup) -> Raw:
    """Read what a person typed: ``49.5``, ``49,5 °C``, ``0x1F``, ``1Fh``, ``raw:495`` or the name of an enumeration.

    An address of the internet is four numbers, ``192.168.2.20``. Hexadecimal and ``raw:`` are raw values, other numbers
    are scaled. Raises ValueTypeError where the text does not fit the type, where the unit is another one, or where the
    number lies between two raw values.
    """
    text = text.strip()
    if len(text) > MAX_TEXT:
        raise _misfit(entry, text[:20] + "…", f"more than {MAX_TEXT} characters")
    if entry.type in (DataType.VISIBLE_STRING, DataType.UNICODE_STRING):
        return text
    if not entry.type.is_integer and entry.type.bits is None:
        return _octets(entry, text)
    for reader in (_ipv4, _raw_number, _named):
        raw = reader(description, entry, text)
        if raw is not None:
            return raw
    return _scaled_number(entry, text, lookup)


def _octets(entry: Entry, text: str) -> bytes:
    try:
        return bytes.fromhex(text)
    except ValueError as error:
        raise _misfit(entry, text, "hexadecimal bytes are expected") from error


def _raw_number(_description: Description, entry: Entry, text: str) -> int | None:
    if text.lower().startswith("raw:"):
        try:
            return int(text[4:], 0)
        except ValueError as error:
            raise _misfit(entry, text, "no integer after 'raw:'") from error
    match = _HEX.match(text)
    if not match:
        return None
    number = int(match[1] or match[2], 16)
    bits = entry.type.bits
    # A hexadecimal number is a bit pattern: FFFFh of an INTEGER16 is -1.
    if entry.type.is_signed and bits is not None and number >> bits - 1 == 1:
        number -= 1 << bits
    return number


def _ipv4(_description: Description, entry: Entry, text: str) -> int | None:
    """Four numbers with points between; whatever has a point is meant so."""
    if not entry.ipv4 or "." not in text:
        return None
    try:
        return int(IPv4Address(text))
    except AddressValueError as error:
        raise _misfit(entry, text, "an address such as 192.168.2.20 is expected") from error


def _named(description: Description, entry: Entry, text: str) -> int | None:
    if entry.enumeration is None:
        return None
    values = description.enumerations[entry.enumeration].values
    return next((value.value for value in values if value.name == text.lower()), None)


def _scaled_number(entry: Entry, text: str, lookup: Lookup) -> Raw:
    match = _NUMBER.match(text)
    if not match:
        raise _misfit(entry, text, "no number")
    quantity = quantity_of(entry, lookup)
    unit = (match[2] or "").strip()
    if unit and unit != quantity.unit:
        raise _misfit(entry, text, f"the unit is {quantity.unit or 'none'}")
    try:
        number = Decimal(match[1].replace(",", ".")) / quantity.scale
    except InvalidOperation as error:
        raise _misfit(entry, text, "no number") from error
    if not entry.type.is_integer:
        return float(number)
    nearest = int(number.to_integral_value())
    if abs(number - nearest) > Decimal("1e-9"):
        raise _misfit(entry, text, f"the resolution is {quantity.scale} {quantity.unit}".rstrip())
    return nearest


def _misfit(entry: Entry, text: str, reason: str) -> ValueTypeError:
    return ValueTypeError(
        address=entry.address.short, name=entry.title, type=entry.type.name, value=text, reason=reason
    )


def depends_on(entry: Entry) -> Iterator[Address]:
    """Addresses of the objects that unit, limits, tables and preconditions of ``entry`` rest on."""
    if entry.quantity_rule is not None:
        yield entry.quantity_rule.address
        if entry.quantity_rule.shaft is not None:
            yield entry.quantity_rule.shaft
    for limit in (entry.minimum, entry.maximum):
        if isinstance(limit, LimitRef):
            yield limit.address
    for rule in (entry.limits_rule, entry.enumeration_rule, entry.bits_rule):
        if rule is not None:
            yield rule.address
    for condition in entry.requires:
        yield condition.address
