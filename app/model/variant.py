"""Variants: several devices that share one description and differ in defaults and limits.

A description leaves a default open where it depends on the variant. ``as_variant`` closes it, so that whoever works on
one device (a twin, an EDS, a comparison with the defaults) need not know that there are others.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from app.errors import UsageError
from app.model.address import Address
from app.model.datatypes import Raw
from app.model.description import Description, Entry, Lookup

_PRODUCT_CODE: Final = Address(0x1018, 2)
_DEVICE_NAME: Final = Address(0x1008)


def as_variant(description: Description, variant: str) -> Description:
    """The description with the defaults and limits of ``variant`` in force. Raises UsageError where there is none."""
    if variant not in description.variants:
        raise UsageError(reason=f"{description.id} has no variant '{variant}' ({', '.join(description.variants)})")
    entries = {address: _entry_of(entry, variant) for address, entry in description.entries.items()}
    detail = description.variant_details.get(variant)
    name = description.name if detail is None else detail.name
    match = description.match if detail is None else detail.match
    return replace(description, entries=entries, name=name, match=match)


def default_of(entry: Entry, variant: str | None) -> Raw | None:
    """The entry's default in a variant; of none, what all have in common; None where it is not known."""
    own = entry.variants.get(variant) if variant is not None else None
    return entry.default if own is None or own.default is None else own.default


def variant_of(description: Description, lookup: Lookup) -> str | None:
    """Which variant a device is, by its product code (1018h/2), else by its name (1008h); None where neither tells."""
    code, name = lookup(_PRODUCT_CODE), lookup(_DEVICE_NAME)
    details = description.variant_details.values()
    for one in details:
        if code is not None and one.match.product_code == code:
            return one.id
    if not isinstance(name, str):
        return None
    return next((one.id for one in details if one.match.device_name and one.match.device_name in name), None)


def _entry_of(entry: Entry, variant: str) -> Entry:
    own = entry.variants.get(variant)
    if own is None:
        return entry
    return replace(
        entry,
        default=entry.default if own.default is None else own.default,
        minimum=entry.minimum if own.minimum is None else own.minimum,
        maximum=entry.maximum if own.maximum is None else own.maximum,
    )
