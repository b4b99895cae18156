"""What may be written: access, type, limits and preconditions, decided before anything is sent."""

from __future__ import annotations

from decimal import Decimal
from enum import Flag, auto
from typing import Final

from app.errors import (
    AccessError,
    AddressChangeError,
    CommunicationError,
    LimitError,
    MotionError,
    PreconditionError,
    ValueTypeError,
)
from app.model.address import Addressing
from app.model.datatypes import Raw, encode_raw
from app.model.description import Access, Description, Entry, Limit, LimitRef, Lookup, RestoreClass
from app.model.values import quantity_of, show

STORE_PARAMETERS: Final = 0x1010
RESTORE_DEFAULTS: Final = 0x1011


class Allow(Flag):
    """What a write may do beyond ordinary parameters."""

    NOTHING = 0
    FACTORY = auto()
    """Write r(w) objects, which only the maker sets."""
    MOTION = auto()
    """Write objects that can set an axis in motion."""
    COMMUNICATION = auto()
    """Change PDOs (14xxh to 1Axxh), or write save and load commands as if they were values."""
    ADDRESS = auto()
    """Change at which address the device is found: a person has confirmed that the connection will be lost."""


def check_read(entry: Entry) -> None:
    """Raises AccessError where the object cannot be read."""
    if not entry.access.readable:
        raise AccessError(address=entry.address.short, name=entry.title, access=entry.access.value)


def check_write(
    description: Description,
    entry: Entry,
    raw: Raw,
    lookup: Lookup,
    *,
    allow: Allow = Allow.NOTHING,
    variant: str | None = None,
) -> bytes:
    """Check everything that can be known before a write; gives the bytes to send.

    ``lookup`` knows other objects of the device; a limit that rests on an unknown object is left to the device.
    ``allow`` says what is permitted beyond ordinary parameters. Raises AccessError, MotionError, CommunicationError,
    AddressChangeError, ValueTypeError, LimitError or PreconditionError.
    """
    if not (entry.access.writable or (Allow.FACTORY in allow and entry.access is Access.FACTORY)):
        raise AccessError(address=entry.address.short, name=entry.title, access=entry.access.value)
    if entry.motion and Allow.MOTION not in allow:
        raise MotionError(address=entry.address.short, name=entry.title)
    if _is_communication(description, entry) and Allow.COMMUNICATION not in allow:
        raise CommunicationError(address=entry.address.short, name=entry.title)
    if entry.restore is RestoreClass.NETWORK and Allow.ADDRESS not in allow:
        raise AddressChangeError(address=entry.address.short, name=entry.title, connected="–")
    data = _encode(entry, raw)
    if isinstance(raw, int | float):
        _check_limits(entry, raw, lookup, variant)
        _check_steps(entry, raw)
        _check_enumeration(description, entry, raw, lookup)
    for condition in entry.requires:
        found = lookup(condition.address) if condition.concerns(raw) else None
        if found is not None and found not in condition.values:
            raise PreconditionError(
                address=entry.address.short,
                name=entry.title,
                needs=f"{condition.address.short} = {' or '.join(map(str, condition.values))}",
                found=str(found),
            )
    return data


def _is_communication(description: Description, entry: Entry) -> bool:
    """PDO parameters and mappings of CiA 301, and the commands that save or load."""
    if entry.address in {command.address for command in (*description.save, *description.load)}:
        return True
    index = entry.address.major
    is_od = entry.address.addressing is Addressing.OD
    return is_od and (0x1400 <= index < 0x1C00 or index in (STORE_PARAMETERS, RESTORE_DEFAULTS))


def limits_of(entry: Entry, lookup: Lookup, variant: str | None = None) -> tuple[Decimal | None, Decimal | None]:
    """Raw limits in force, those of the data type included; None where there is none or it is not known."""
    own = entry.variants.get(variant) if variant is not None else None
    lowest, highest = _ruled(entry, lookup)
    low = _resolve(own.minimum if own and own.minimum is not None else lowest, lookup)
    high = _resolve(own.maximum if own and own.maximum is not None else highest, lookup)
    span = entry.type.range
    if span is not None:
        low = Decimal(span[0]) if low is None else max(low, Decimal(span[0]))
        high = Decimal(span[1]) if high is None else min(high, Decimal(span[1]))
    return low, high


def _ruled(entry: Entry, lookup: Lookup) -> tuple[Limit | None, Limit | None]:
    """The entry's limits, or those that its rule gives."""
    otherwise = (entry.minimum, entry.maximum)
    rule = entry.limits_rule
    found = None if rule is None else lookup(rule.address)
    return otherwise if rule is None or not isinstance(found, int) else rule.choices.get(found, otherwise)


def _resolve(limit: Limit | None, lookup: Lookup) -> Decimal | None:
    if isinstance(limit, LimitRef):
        found = lookup(limit.address)
        return Decimal(str(found)) * limit.factor if isinstance(found, int | float) else None
    return None if limit is None else Decimal(limit)


def _encode(entry: Entry, raw: Raw) -> bytes:
    span = entry.type.range
    if span is not None and isinstance(raw, int) and not isinstance(raw, bool) and not span[0] <= raw <= span[1]:
        raise _limit_error(entry, raw, Decimal(span[0]), Decimal(span[1]), lambda _address: None)
    try:
        return encode_raw(entry.type, raw)
    except ValueError as error:
        raise ValueTypeError(
            address=entry.address.short, name=entry.title, type=entry.type.name, value=str(raw), reason=str(error)
        ) from error


def _check_limits(entry: Entry, raw: int | float, lookup: Lookup, variant: str | None) -> None:
    if raw in entry.also:
        return
    low, high = limits_of(entry, lookup, variant)
    number = Decimal(str(raw))
    if (low is not None and number < low) or (high is not None and number > high):
        raise _limit_error(entry, raw, low, high, lookup)


def _limit_error(
    entry: Entry, raw: int | float, low: Decimal | None, high: Decimal | None, lookup: Lookup
) -> LimitError:
    def shown(number: Decimal | None) -> str:
        return "–" if number is None else show(entry, int(number) if entry.type.is_integer else float(number), lookup)

    return LimitError(
        address=entry.address.short,
        name=entry.title,
        value=show(entry, raw, lookup),
        minimum=shown(low),
        maximum=shown(high),
        unit=quantity_of(entry, lookup).unit,
    )


def _check_steps(entry: Entry, raw: int | float) -> None:
    if entry.only and raw not in entry.only:
        raise _misfit(entry, raw, f"not one of: {', '.join(map(str, entry.only))}")
    if entry.step > 1 and raw % entry.step:
        raise _misfit(entry, raw, f"no multiple of {entry.step}")


def _check_enumeration(description: Description, entry: Entry, raw: int | float, lookup: Lookup) -> None:
    enumeration = description.enumeration_of(entry, lookup)
    if enumeration is not None and enumeration.exclusive and all(value.value != raw for value in enumeration.values):
        names = ", ".join(f"{value.value} {value.name}" for value in enumeration.values)
        raise _misfit(entry, raw, f"not one of: {names}")


def _misfit(entry: Entry, raw: int | float, reason: str) -> ValueTypeError:
    return ValueTypeError(
        address=entry.address.short, name=entry.title, type=entry.type.name, value=str(raw), reason=reason
    )
