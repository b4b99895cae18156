"""Rules over stations: the connected ones with what is pending, and sets, those of one station judged together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from app.model.address import Address
from app.model.datatypes import Raw
from app.model.description import Description
from app.model.rules.check import check_station
from app.model.rules.rule import Finding, Severity, Verdict
from app.model.sets import ParameterSet
from app.model.station import DeviceValues, StationValues, station_of, station_slug
from app.service.compare.known import ram_of
from app.service.devices import Target

Pending = Mapping[str, Mapping[Address, Raw]]
"""Changes that are not written yet, by device."""


@dataclass(frozen=True, slots=True)
class Judged:
    """What the rules say of one station. ``devices``: the slugs that were looked at."""

    station: str
    devices: tuple[str, ...]
    findings: tuple[Finding, ...]

    def broken(self, severity: Severity) -> int:
        """How many findings of that weight are broken rules."""
        return sum(one.verdict is Verdict.BROKEN and one.severity is severity for one in self.findings)

    @property
    def unchecked(self) -> int:
        """How many rules could not be judged."""
        return sum(one.verdict is Verdict.NOT_CHECKED for one in self.findings)


def check_live(targets: Iterable[Target], pending: Pending, station: str | None = None) -> list[Judged]:
    """The stations of the connected turbine, or one of them, as they will be once what is pending was written.

    What is not known of a device's RAM now, or was not seen since frames were lost, counts as not known.
    """
    return judge(
        DeviceValues(target.slug, target.description, {**ram_of(target)[0], **pending.get(target.slug, {})})
        for target in targets
        if station in (None, station_slug(target.slug))
    )


def check_sets(sets: Iterable[tuple[ParameterSet, Description]]) -> list[Judged]:
    """Sets with what describes them; those of one station are judged together."""
    return judge(station_of(sets).devices)


def judge(devices: Iterable[DeviceValues]) -> list[Judged]:
    """Devices by their stations. Of one that comes twice the first counts."""
    stations: dict[str, dict[str, DeviceValues]] = {}
    for one in devices:
        stations.setdefault(station_slug(one.slug), {}).setdefault(one.slug, one)
    return [
        Judged(slug, tuple(found), tuple(check_station(StationValues(tuple(found.values())))))
        for slug, found in stations.items()
    ]
