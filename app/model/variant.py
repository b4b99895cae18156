"""Variants: several devices that share one description and differ in defaults and limits.

A description leaves a default open where it depends on the variant. ``as_variant`` closes it, so that whoever works on
one device (a twin, an EDS, a comparison with the defaults) need not know that there are others.
"""

from __future__ import annotations

from dataclasses import replace

from app.errors import UsageError
from app.model.description import Description, Entry, Match


def as_variant(description: Description, variant: str) -> Description:
    """The description with the defaults and limits of ``variant`` in force. Raises UsageError where there is none."""
    if variant not in description.variants:
        raise UsageError(reason=f"{description.id} has no variant '{variant}' ({', '.join(description.variants)})")
    entries = {address: _entry_of(entry, variant) for address, entry in description.entries.items()}
    detail = description.variant_details.get(variant)
    name = description.name if detail is None else detail.name
    match = description.match if detail is None else detail.match
    return replace(description, entries=entries, name=name, match=match)


def as_identified(description: Description, device_name: str | None, product_code: int | None) -> Description:
    """The description of the variant that a device says it is; as it stands where that is not clear."""
    variant = variant_of(description, device_name, product_code)
    return description if variant is None else as_variant(description, variant)


def variant_of(description: Description, device_name: str | None, product_code: int | None) -> str | None:
    """The only variant that a device which says so of itself can be; None where that is not clear."""
    found = [one.id for one in description.variant_details.values() if _fits(one.match, device_name, product_code)]
    return found[0] if len(found) == 1 else None


def _fits(match: Match, device_name: str | None, product_code: int | None) -> bool:
    """What the device does not say contradicts nothing, but one of both has to speak for it."""
    by_name = None if match.device_name is None or not device_name else match.device_name in device_name
    by_code = None if match.product_code is None or product_code is None else match.product_code == product_code
    said = [one for one in (by_name, by_code) if one is not None]
    return bool(said) and all(said)


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
