"""Stations made for the tests: every object at the default of its description, but for those that are given."""

from __future__ import annotations

from typing import Final

from app.model.address import parse_address
from app.model.datatypes import Raw
from app.model.description_file import load_builtin
from app.model.rules.look import PMC, PMM
from app.model.station import DeviceValues, Place, StationValues
from app.twins.turbine import commissioned

STATION: Final = "wtg-07/blade-2"
SLUGS: Final = {PMM: f"{STATION}/pmm", PMC: f"{STATION}/pmc"}

Changes = dict[str, Raw | None]

HEALTHY_PMM: Final[Changes] = {"3062": 400, "30E3": 1440, "3204:03": 0x0008}
HEALTHY_PMC: Final[Changes] = {
    **{str(address): raw for address, raw in commissioned(80.0, 80.0).items()},
    "607D:02": 9500,
    "6007": 2,
    "6865": 50,
    "6866": 100,
}
"""What a station needs beyond its defaults for no rule to have anything to say."""


def device(kind: str, changes: Changes | None = None, slug: str | None = None) -> DeviceValues:
    """A device of that description; None takes a value away."""
    description = load_builtin(kind)
    values: dict[str, Raw | None] = {str(e.address): e.default for e in description} | (changes or {})
    unknown = set(values) - {str(address) for address in description.entries}
    assert not unknown, f"{kind} has no {unknown}"
    held = {parse_address(text): raw for text, raw in values.items() if raw is not None}
    return DeviceValues(slug or SLUGS[kind], description, held)


def station(pmm: Changes | None = None, pmc: Changes | None = None) -> StationValues:
    """PMM and PMC of one blade, all else at its default."""
    return StationValues((device(PMM, _full(pmm)), device(PMC, _full(pmc))))


def healthy(pmm: Changes | None = None, pmc: Changes | None = None) -> StationValues:
    """PMM and PMC of one blade as they should be, but for the changes."""
    return station({**_full(HEALTHY_PMM), **_full(pmm)}, {**_full(HEALTHY_PMC), **_full(pmc)})


def place(kind: str, address: str) -> Place:
    """Where an object stands in a station that was made here."""
    return Place(SLUGS[kind], parse_address(address))


def _full(changes: Changes | None) -> Changes:
    return {str(parse_address(text)): raw for text, raw in (changes or {}).items()}
