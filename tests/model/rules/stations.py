"""Stations made for the tests: every object at the default of its description, but for those that are given."""

from __future__ import annotations

from typing import Final

from app.model.address import parse_address
from app.model.datatypes import Raw
from app.model.description_file import load_builtin
from app.model.rules.look import PMC, PMM
from app.model.station import DeviceValues, Place, StationValues

STATION: Final = "wtg-07/blade-2"
SLUGS: Final = {PMM: f"{STATION}/pmm", PMC: f"{STATION}/pmc"}

Changes = dict[str, Raw | None]


def device(kind: str, changes: Changes | None = None, slug: str | None = None) -> DeviceValues:
    """A device of that description; None takes a value away."""
    description = load_builtin(kind)
    values = {entry.address: entry.default for entry in description if entry.default is not None}
    made = DeviceValues(slug or SLUGS[kind], description, values)
    for text, raw in (changes or {}).items():
        address = parse_address(text)
        assert address in description.entries, f"{kind} has no {text}"
        if raw is None:
            made = DeviceValues(made.slug, description, {a: r for a, r in made.values.items() if a != address})
        else:
            made = made.with_value(address, raw)
    return made


def station(pmm: Changes | None = None, pmc: Changes | None = None) -> StationValues:
    """PMM and PMC of one blade."""
    return StationValues((device(PMM, pmm), device(PMC, pmc)))


def place(kind: str, address: str) -> Place:
    """Where an object stands in a station that was made here."""
    return Place(SLUGS[kind], parse_address(address))
