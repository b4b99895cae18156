"""A fleet beside its golden set as a report: devices by rank, turbines, parameters; as CSV and as JSON."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from app.model.description import Entry
from app.model.sets import iso_time
from app.service.compare.export import harmless
from app.service.compare.fleet import Fleet, Mark, Member


@dataclass(frozen=True, slots=True)
class Standing:
    """One device: rank 1 differs most. ``unit`` counts what differs and may; ``by_group`` only what must not."""

    rank: int
    member: Member
    different: int
    missing: int
    unit: int
    by_group: Mapping[str, int]

    @property
    def turbine(self) -> str:
        """Of which it is a part."""
        return self.member.device.partition("/")[0]

    @property
    def equal(self) -> bool:
        """True where nothing is missing, and nothing differs that must not."""
        return not self.different and not self.missing


@dataclass(frozen=True, slots=True)
class TurbineCount:
    """What the devices of one turbine come to; ``unlike`` of them are not as the golden set."""

    turbine: str
    devices: int
    unlike: int
    different: int
    missing: int


@dataclass(frozen=True, slots=True)
class ParameterCount:
    """At how many devices one parameter differs, is missing, or differs as it may."""

    entry: Entry
    different: int
    missing: int
    unit: int


@dataclass(frozen=True, slots=True)
class Report:
    """Devices and turbines by rank, parameters with the most differences first; those that are equal too."""

    fleet: Fleet
    standings: tuple[Standing, ...]
    turbines: tuple[TurbineCount, ...]
    parameters: tuple[ParameterCount, ...]

    @property
    def equal(self) -> int:
        """Devices that are as the golden set."""
        return sum(one.equal for one in self.standings)


def report_of(fleet: Fleet) -> Report:
    """The report of a comparison."""
    standings = _standings(fleet)
    return Report(fleet, standings, _turbines(standings), _parameters(fleet))


def _standings(fleet: Fleet) -> tuple[Standing, ...]:
    different, missing, unit = (fleet.count(mark) for mark in (Mark.DIFFERENT, Mark.MISSING, Mark.UNIT))
    groups = fleet.by_group.tolist()
    return tuple(
        Standing(
            rank,
            fleet.members[row],
            different[row],
            missing[row],
            unit[row],
            dict(zip(fleet.groups, groups[row], strict=True)),
        )
        for rank, row in enumerate(fleet.ranking(), 1)
    )


def _turbines(standings: Sequence[Standing]) -> tuple[TurbineCount, ...]:
    by_name = groupby(sorted(standings, key=lambda one: one.turbine), key=lambda one: one.turbine)
    found = [_turbine(name, list(some)) for name, some in by_name]
    return tuple(sorted(found, key=lambda one: (-one.different, -one.missing, one.turbine)))


def _turbine(name: str, devices: Sequence[Standing]) -> TurbineCount:
    return TurbineCount(
        name,
        len(devices),
        sum(not one.equal for one in devices),
        sum(one.different for one in devices),
        sum(one.missing for one in devices),
    )


def _parameters(fleet: Fleet) -> tuple[ParameterCount, ...]:
    counts = [fleet.per_entry(mark) for mark in (Mark.DIFFERENT, Mark.MISSING, Mark.UNIT)]
    found = [ParameterCount(entry, *each) for entry, *each in zip(fleet.entries, *counts, strict=True)]
    return tuple(sorted(found, key=lambda one: (-one.different, -one.missing, -one.unit, one.entry.address[:2])))


def fleet_csv(reports: Sequence[Report]) -> str:
    """A row a device, by rank; golden sets of several kinds of devices one after another."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    groups = list(dict.fromkeys(group for one in reports for group in one.fleet.groups))
    fixed = ("golden", "rank", "turbine", "device", "time", "set", "different", "missing", "unit")
    writer.writerow((*fixed, *groups))
    for report in reports:
        for one in report.standings:
            member = one.member
            texts = (str(report.fleet.golden.spec), one.turbine, member.device, iso_time(member.t_ns), member.record)
            golden, turbine, device, time, record = map(harmless, texts)
            counts = (one.different, one.missing, one.unit)
            writer.writerow(
                (golden, one.rank, turbine, device, time, record, *counts, *(one.by_group.get(name) for name in groups))
            )
    return out.getvalue()


def fleet_json(report: Report) -> dict[str, Any]:
    """All of it for machines."""
    fleet, golden = report.fleet, report.fleet.golden
    return {
        "golden": {
            "spec": str(golden.spec),
            "device": golden.column.slug,
            "record": golden.record,
            "hash": golden.hash,
            "t_ns": golden.t_ns,
            "description": f"{golden.column.description.id} {golden.column.version}",
        },
        "total": len(report.standings),
        "equal": report.equal,
        "devices": [
            {
                "rank": one.rank,
                "turbine": one.turbine,
                "device": one.member.device,
                "record": one.member.record,
                "t_ns": one.member.t_ns,
                "different": one.different,
                "missing": one.missing,
                "unit": one.unit,
                "by_group": dict(one.by_group),
            }
            for one in report.standings
        ],
        "turbines": [{name: getattr(one, name) for name in one.__slots__} for one in report.turbines],
        "parameters": [
            {
                "address": one.entry.address.short,
                "name": one.entry.title,
                "different": one.different,
                "missing": one.missing,
                "unit": one.unit,
            }
            for one in report.parameters
            if one.different or one.missing or one.unit
        ],
        "foreign": [
            {"device": one.device, "record": one.record, "t_ns": one.t_ns, "description_version": one.version}
            for one in fleet.foreign
        ],
    }
