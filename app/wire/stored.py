"""Which values a save command makes non-volatile (CiA 301, 7.5.2.13 and 7.5.2.14)."""

from __future__ import annotations

from typing import Final

from app.model.address import Address
from app.model.description import Description

COMMUNICATION: Final = range(0x1000, 0x2000)
"""Indices that the reset of the communication sets anew, and that category 2 saves."""
_CATEGORIES: Final = {1: range(0x0001, 0x10000), 2: COMMUNICATION, 3: range(0x6000, 0xA000)}


def covers(description: Description | None, command: Address, address: Address) -> bool:
    """True where writing 'save' (or 'load') to ``command`` saves (or sets back) ``address``.

    By the description where it knows the command: saved entries of its category, and those without one. Else by the
    categories of the standard: 1 all, 2 communication, 3 application; of the categories of a maker nothing is assumed.
    """
    if description is not None:
        entry = description.entries.get(address)
        if entry is not None and not entry.saved:
            return False
        known = [c for c in (*description.save, *description.load) if c.address == command]
        if known:
            return entry is not None and any(
                c.category is None or entry.save_category in (None, c.category) for c in known
            )
    return address.major in _CATEGORIES.get(command.minor, ())
