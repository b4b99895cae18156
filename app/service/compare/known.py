"""What is known of a device without reading it: its RAM, its non-volatile memory, its defaults."""

from __future__ import annotations

from typing import Final

from app.model.address import Address
from app.model.datatypes import Raw
from app.model.description import Description
from app.service.backup import readable
from app.service.devices import Target, decode
from app.service.office.visits import NOT_READ, STALE

STORED_UNKNOWN: Final = "not known"
"""What stands in non-volatile memory was never seen."""

Known = tuple[dict[Address, Raw], dict[Address, str]]
"""Values, and why others are not known."""


def ram_of(target: Target) -> Known:
    """What is known of a device's RAM now."""
    views = target.live.values(target.device.bus, target.node)
    values: dict[Address, Raw] = {}
    unread: dict[Address, str] = {}
    for address in readable(target.description):
        view = views.get(address)
        if view is None or view.reading is None:
            unread[address] = NOT_READ
        elif view.stale:
            unread[address] = STALE
        else:
            values[address] = decode(target.entry(address), view.reading.data)
    return values, unread


def stored_of(target: Target) -> Known:
    """What is known of a device's non-volatile memory; objects that are not saved are in neither part."""
    views = target.live.values(target.device.bus, target.node)
    values: dict[Address, Raw] = {}
    unread: dict[Address, str] = {}
    for entry in target.description:
        if entry.saved and entry.access.readable:
            view = views.get(entry.address)
            if view is None or view.stored is None:
                unread[entry.address] = STORED_UNKNOWN
            else:
                values[entry.address] = decode(entry, view.stored.data)
    return values, unread


def defaults_of(description: Description, node: int) -> dict[Address, Raw]:
    """The defaults of a description for a device with the number ``node``; objects without one are not in it."""
    values: dict[Address, Raw] = {}
    for entry in description:
        if entry.default is not None:
            shift = node if entry.node_id else 0
            values[entry.address] = entry.default + shift if isinstance(entry.default, int) else entry.default
    return values
