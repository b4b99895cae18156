"""Sets as a device would give them: every readable object at its default, and a few values of every kind."""

from __future__ import annotations

from app.model.address import Address
from app.model.datatypes import Raw
from app.model.description import Description
from app.model.description_file import load_builtin
from app.model.set_head import Taking
from app.model.sets import Origin, ParameterSet, identity_of

ORIGIN = Origin(
    "wtg-07", "wtg-07/blade-1/pmc", 12, "2026-03-04T14:03:21Z", "Jörg; #1", "50 % = zu viel", "hubside 0.1.0", "WO-7"
)
DESCRIPTIONS = {name: load_builtin(name) for name in ("oat-pmm", "oat-pmc")}


def whole_set(name: str, origin: Origin = ORIGIN) -> ParameterSet:
    """Complete but for what has no default; texts and numbers that a file must not spoil."""
    description = DESCRIPTIONS[name]
    values: dict[Address, Raw] = {
        entry.address: default_of(description, entry.address)
        for entry in description
        if entry.access.readable and entry.default is not None
    }
    values[Address(0x1008)] = '  Ä "quoted"; =1+1 #2\n'
    values[Address(0x1009)] = ""
    unread = {entry.address: "abort 08000022h" for entry in description if entry.address not in values}
    empty = tuple(unread)[:1]
    for address in empty:
        del unread[address]
    return ParameterSet(name, description.version, identity_of(values, "SN 12"), origin, values, unread, empty)


def default_of(description: Description, address: Address) -> Raw:
    """The default, the node's number put in."""
    entry = description.entries[address]
    assert entry.default is not None
    return entry.default + ORIGIN.node if entry.node_id and isinstance(entry.default, int) else entry.default


def taking(**changes: object) -> Taking:
    """Values of a file that says nothing of itself go to this device."""
    given = {"descriptions": DESCRIPTIONS, "origin": ORIGIN, **changes}
    return Taking(**given)  # type: ignore[arg-type]
