"""In which order a batch of changes is written that a person has reviewed: by the planner of a restore.

After every single write all stepwise rules and all limits hold that held before, as in a restore. Other than there no
mode of operation is changed for it: objects that wait for a state of the device, and those of which nobody knows what
they hold, are left in the order given, behind the others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from app.errors import RefusedError
from app.model.checks import Allow, check_write
from app.model.datatypes import Raw
from app.model.restore.order import order
from app.model.restore.plan import PlanRow, Treatment
from app.model.restore.rows import allowed
from app.model.restore.walk import places_of
from app.model.restore.wanted import PlanOptions
from app.model.rules.all_rules import ALL
from app.model.rules.check import broken_in, check_station
from app.model.rules.rule import Finding, Rule
from app.model.station import DeviceValues, Place, StationValues, station_slug


@dataclass(frozen=True, slots=True)
class Batch:
    """Places in the order in which they are written; ``unordered``: those for which there is none.

    ``broken``: what is wrong with the station once all of it is written and is not now, of the stepwise rules.
    """

    places: tuple[Place, ...]
    unordered: tuple[Place, ...] = ()
    broken: tuple[Finding, ...] = ()


def batch_order(
    devices: Sequence[DeviceValues],
    wanted: Mapping[Place, Raw],
    *,
    allow: Allow = Allow.NOTHING,
    accepted: bool = False,
    rules: Sequence[Rule] = ALL,
) -> Batch:
    """Order the writes, station by station in the order of their first ones.

    ``devices``: all of the turbine, with what is known of them. ``accepted``: a person accepts what is wrong in the
    end, so that it may be so on the way as well; what would be wrong on the way only still has no order.
    """
    options = PlanOptions(expert=Allow.FACTORY in allow, returning=accepted)
    batches = []
    for slug in dict.fromkeys(station_slug(place.slug) for place in wanted):
        station = StationValues(tuple(one for one in devices if station_slug(one.slug) == slug))
        own = {place: raw for place, raw in wanted.items() if station_slug(place.slug) == slug}
        batches.append(_of_station(station, own, options, rules))
    return Batch(
        places=tuple(place for one in batches for place in one.places),
        unordered=tuple(place for one in batches for place in one.unordered),
        broken=tuple(finding for one in batches for finding in one.broken),
    )


def looked_at(station: StationValues, wanted: Mapping[Place, Raw], rules: Sequence[Rule] = ALL) -> tuple[Place, ...]:
    """The objects on which the order of these writes rests: their own values, and all that stepwise rules look at."""
    found = dict.fromkeys(wanted)
    for rule in rules:
        places = tuple(places_of(station, rule)) if rule.stepwise else ()
        if any(place in wanted for place in places):
            found.update(dict.fromkeys(places))
    return tuple(found)


def _of_station(
    station: StationValues, wanted: Mapping[Place, Raw], options: PlanOptions, rules: Sequence[Rule]
) -> Batch:
    rows = [PlanRow(place, Treatment.WRITE, station.raw(place), raw) for place, raw in wanted.items()]
    planned = [row for row in rows if _can_be_planned(station, row, options)]
    steps, unordered = order(station, planned, rules, options, {})
    ordered = tuple(step.place for step in steps if step.place is not None)
    left = tuple(row.place for row in rows if row not in planned)
    return Batch((*ordered, *left), unordered, _broken(station, wanted, rules))


def _can_be_planned(station: StationValues, row: PlanRow, options: PlanOptions) -> bool:
    """False where another check than that of the order has to say what becomes of the row."""
    device = station.device(row.place.slug)
    entry = None if device is None else device.description.entries.get(row.place.address)
    if device is None or entry is None or row.now is None or row.wanted is None or entry.requires:
        return False
    try:
        check_write(device.description, entry, row.wanted, lambda _address: None, allow=allowed(entry, options))
    except RefusedError:
        return False
    return True


def _broken(station: StationValues, wanted: Mapping[Place, Raw], rules: Sequence[Rule]) -> tuple[Finding, ...]:
    stepwise = [rule for rule in rules if rule.stepwise]
    before, after = check_station(station, stepwise), check_station(_with(station, wanted), stepwise)
    new = broken_in(after) - broken_in(before)
    return tuple(one for one in after if (one.rule_id, one.places) in new)


def _with(station: StationValues, wanted: Mapping[Place, Raw]) -> StationValues:
    devices = []
    for one in station.devices:
        own = {place.address: raw for place, raw in wanted.items() if place.slug == one.slug}
        devices.append(replace(one, values={**one.values, **own}))
    return StationValues(tuple(devices))
