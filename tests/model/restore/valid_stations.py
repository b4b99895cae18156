"""Full sets of PMM and PMC that break no rule that is an error or stepwise, and no limit: drawn at random."""

from __future__ import annotations

import random
from decimal import Decimal
from typing import Final

from app.errors import RefusedError
from app.model.address import Address, parse_address
from app.model.checks import Allow, check_write, limits_of
from app.model.datatypes import Raw
from app.model.description import Description, Entry, RestoreClass
from app.model.rules.all_rules import ALL
from app.model.rules.check import check_station
from app.model.rules.dc_link import LADDER
from app.model.rules.rule import Rule, Severity, Verdict
from app.model.station import DeviceValues, Place, StationValues
from tests.model.rules.stations import place, station

_TRIES: Final = 20
_MODE_SHOWN: Final = Address(0x6061)
_NO_DEFAULT: Final = 1000
"""Stands where the manual prints no default, as for the profile of the EFC."""
_AXIS: Final = 1
"""Profile position."""


def restorable(description: Description) -> list[Entry]:
    """What a restore may write, be it for experts or to the same machine only."""
    return [entry for entry in description if entry.restore is not RestoreClass.NEVER and not entry.counts]


def valid_station(rng: random.Random) -> StationValues:
    """A station that differs from the delivered one in most objects, and is as sound."""
    values = {one.slug: dict(one.values) for one in station(pmc={"6061": _AXIS}).devices}
    full = StationValues(tuple(DeviceValues(one.slug, one.description, values[one.slug]) for one in station().devices))
    for device in full.devices:
        for entry in restorable(device.description):
            values[device.slug].setdefault(entry.address, _NO_DEFAULT)
    assert not faults(full), "the delivered station is sound"
    for change in (_draw_ladder(rng, full), *_draw_objects(rng, full)):
        was = {where: values[where.slug][where.address] for where in change}
        for where, raw in change.items():
            values[where.slug][where.address] = raw
        if faults(full, {where.address for where in change}):
            for where, raw in was.items():
                values[where.slug][where.address] = raw
    return StationValues(tuple(DeviceValues(one.slug, one.description, dict(one.values)) for one in full.devices))


def faults(full: StationValues, touched: set[Address] | None = None) -> list[object]:
    """All that makes a station unsound: broken rules and values out of limits; only near ``touched`` where given."""
    rules = [rule for rule in ALL if touched is None or _looks_at(rule, touched)]
    broken = [
        one
        for one in check_station(full, rules)
        if one.verdict is Verdict.BROKEN and (one.severity is Severity.ERROR or _stepwise(one.rule_id))
    ]
    return [*broken, *outside(full)]


def outside(full: StationValues) -> list[Place]:
    """Restorable objects that the device would not take as they are."""
    found = []
    for device in full.devices:
        for entry in restorable(device.description):
            limits = (entry.minimum, entry.maximum)
            if limits != (None, None) and not _fits(device, entry, device.values[entry.address]):
                found.append(Place(device.slug, entry.address))
    return found


def _fits(device: DeviceValues, entry: Entry, raw: Raw) -> bool:
    values = {**device.values, _MODE_SHOWN: 6}
    try:
        check_write(device.description, entry, raw, values.get, allow=Allow.FACTORY)
    except RefusedError:
        return False
    return True


def _looks_at(rule: Rule, touched: set[Address]) -> bool:
    return any(parse_address(text) in touched for texts in rule.objects.values() for text in texts)


def _stepwise(rule_id: str) -> bool:
    return next(rule for rule in ALL if rule.id == rule_id).stepwise


Change = dict[Place, Raw]


def _draw_ladder(rng: random.Random, full: StationValues) -> Change:
    """New voltages for all nine rungs at once, in their order."""
    for _ in range(_TRIES):
        volts = sorted(rng.sample(range(20, 1000), len(LADDER)))
        change: Change = {place(of.description_id, of.address): v for of, v in zip(LADDER, volts, strict=True)}
        trial = full
        for where, raw in change.items():
            trial = trial.with_value(where, raw)
        if not faults(trial):
            return change
    return {}


def _draw_objects(rng: random.Random, full: StationValues) -> list[Change]:
    """A new value for every object, each a change of its own, in any order."""
    places = [(one, entry) for one in full.devices for entry in restorable(one.description)]
    rng.shuffle(places)
    return [{Place(one.slug, entry.address): _draw(rng, one, entry)} for one, entry in places]


def _draw(rng: random.Random, device: DeviceValues, entry: Entry) -> Raw:
    """A value within type, limits and enumeration, near the present one or anywhere."""
    if entry.enumeration is not None and device.description.enumerations[entry.enumeration].exclusive:
        return rng.choice(device.description.enumerations[entry.enumeration].values).value
    low, high = limits_of(entry, device.values.get)
    now = device.values[entry.address]
    assert isinstance(now, int) and low is not None and high is not None, entry.title
    if entry.bits is not None:
        return now ^ 1 << rng.randrange(entry.type.bits or 8)
    if rng.random() < 0.7:
        spread = max(abs(now) // 2, 5)
        low, high = max(low, Decimal(now - spread)), min(high, Decimal(now + spread))
    return rng.randint(int(low), int(high)) if low <= high else now
