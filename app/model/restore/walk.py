"""The station on its way through a plan: which write harms nothing now, and the writes done so far."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from decimal import Decimal
from typing import Final

from app.errors import RefusedError
from app.model.address import Address, parse_address
from app.model.checks import check_write, limits_of
from app.model.datatypes import Raw
from app.model.description import Condition, Description, Entry, LimitRef
from app.model.restore.plan import PlanRow, Step, StepKind
from app.model.restore.rows import allowed
from app.model.restore.wanted import PlanOptions
from app.model.rules.check import broken_stepwise
from app.model.rules.rule import Rule
from app.model.station import DeviceValues, Place, StationValues

MODE: Final = Address(0x6060)
MODE_SHOWN: Final = Address(0x6061)
"""Mode of operation, as demanded and as displayed (manual 5.9.1)."""

Broken = frozenset[tuple[str, tuple[Place, ...]]]
"""Ids of rules with the objects at which they are broken."""


class Walk:
    """Values of all devices, changed step by step. It works on copies: the station given stays as it is."""

    def __init__(
        self, station: StationValues, rows: Sequence[PlanRow], rules: Sequence[Rule], options: PlanOptions
    ) -> None:
        self.steps: list[Step] = []
        self._values = {one.slug: dict(one.values) for one in station.devices}
        devices = (DeviceValues(one.slug, one.description, self._values[one.slug]) for one in station.devices)
        self._station = StationValues(tuple(devices))
        self._devices = {one.slug: one for one in self._station.devices}
        self._options = options
        self._rules = _rules_by_place(self._station, [rule for rule in rules if rule.stepwise])
        self._resting = {one.slug: _resting_on(one) for one in self._station.devices}
        self._broken = self._all_broken()
        self._outside = set(self._all_outside())
        if options.returning:
            self._tolerate_end(rows)

    def entry(self, place: Place) -> Entry:
        """The description of a row's object."""
        return self._devices[place.slug].description.entry(place.address)

    def mode_needed(self, place: Place) -> int | None:
        """The mode of operation that a write needs and that is not shown now."""
        needed = _mode_condition(self.entry(place))
        if needed is None or self._values[place.slug].get(MODE_SHOWN) in needed.values:
            return None
        return needed.values[0]

    def gates_of(self, place: Place) -> Iterator[tuple[Place, int]]:
        """The parameters that must hold a value while this one is written, and that value; as the count of a mapping.

        The outer ones first, as the description names them.
        """
        description = self._devices[place.slug].description
        for condition in self.entry(place).requires:
            gate = description.entries.get(condition.address)
            if condition.writing or gate is None or gate.address == MODE_SHOWN:
                continue
            if gate.is_parameter and gate.access.writable:
                yield Place(place.slug, gate.address), condition.values[0]

    def description(self, slug: str) -> Description:
        """That of a device."""
        return self._devices[slug].description

    def values(self, slug: str) -> Mapping[Address, Raw]:
        """What a device holds now."""
        return self._values[slug]

    def value(self, place: Place) -> Raw | None:
        """What the object holds now."""
        return self._values[place.slug].get(place.address)

    def set_gate(self, place: Place, raw: Raw) -> None:
        """A step that writes a gate only so that others can be written, or puts it back."""
        self._put_with_effects(place, raw)
        self.steps.append(Step(StepKind.AUXILIARY, place.slug, place, raw))

    def take_back_gate(self, place: Place, before: Raw) -> None:
        """Forgets the last step, which wrote a gate that held ``before``."""
        self._put(place, before)
        self.steps.pop()

    def shown_mode(self, slug: str) -> Raw | None:
        """What the mode of operation display shows."""
        return self._values[slug].get(MODE_SHOWN)

    def set_mode(self, slug: str, mode: int) -> None:
        """A step that changes the mode of operation and waits until the device shows it."""
        self._values[slug][MODE_SHOWN] = mode
        self.steps.append(Step(StepKind.AUXILIARY, slug, Place(slug, MODE), mode, until=Place(slug, MODE_SHOWN)))

    def forget_mode(self, slug: str, before: Raw | None) -> None:
        """Takes back the last step, which changed the mode of operation from ``before``."""
        if before is None:
            del self._values[slug][MODE_SHOWN]
        else:
            self._values[slug][MODE_SHOWN] = before
        self.steps.pop()

    def write(self, row: PlanRow) -> None:
        """A step that writes a row."""
        self._put_with_effects(row.place, row.wanted)
        self.steps.append(Step(StepKind.WRITE, row.place.slug, row.place, row.wanted))

    def take_back(self, row: PlanRow) -> None:
        """Forgets the last step, which wrote this row."""
        self._put(row.place, row.now)
        self.steps.pop()

    def effects(self, place: Place, raw: Raw) -> dict[Address, Raw]:
        """What the device itself puts into other objects with a write."""
        return {one.address: one.raw for one in self.entry(place).effects if raw in one.writing}

    def takes(self, place: Place, raw: Raw, instead: Mapping[Address, Raw | None]) -> bool:
        """True where the device would take ``raw`` while it holds ``instead`` in these objects; no rule is asked."""
        values, entry = self._values[place.slug], self.entry(place)

        def lookup(address: Address) -> Raw | None:
            return instead[address] if address in instead else values.get(address)

        try:
            check_write(self.description(place.slug), entry, raw, lookup, allow=allowed(entry, self._options))
        except RefusedError:
            return False
        return True

    def can_write(self, row: PlanRow) -> bool:
        """True where the device would take the row now, and neither a stepwise rule nor a limit is broken by it."""
        place, values, wanted = row.place, self._values[row.place.slug], row.wanted
        entry, description = self.entry(place), self._devices[place.slug].description
        if wanted is None or self.mode_needed(place) is not None:
            return False
        try:
            check_write(description, entry, wanted, values.get, allow=allowed(entry, self._options))
        except RefusedError:
            return False
        was = values[place.address]
        values[place.address] = wanted
        harm = self._harms(place)
        values[place.address] = was
        return not harm

    def ties(self, place: Place) -> Iterator[Place]:
        """Objects that a stepwise rule, a limit or a precondition ties to this one."""
        entry = self.entry(place)
        for address in (*_limits_from(entry), *(condition.address for condition in entry.requires)):
            yield Place(place.slug, address)
        for rule in self._rules.get(place, ()):
            yield from places_of(self._station, rule)

    def _harms(self, place: Place) -> bool:
        """True where a rule or a limit that rests on this object is broken, and was not at the beginning."""
        resting = self._resting[place.slug].get(place.address, ())
        if any(one not in self._outside for one in self._outside_of(place.slug, resting)):
            return True
        rules = self._rules.get(place)
        return rules is not None and not broken_stepwise(self._station, rules) <= self._broken

    def _all_broken(self) -> Broken:
        distinct = {rule.id: rule for rules in self._rules.values() for rule in rules}
        return broken_stepwise(self._station, distinct.values())

    def _all_outside(self) -> Iterator[Place]:
        for slug, by_address in self._resting.items():
            for resting in by_address.values():
                yield from self._outside_of(slug, resting)

    def _outside_of(self, slug: str, entries: Iterable[Entry]) -> Iterator[Place]:
        """Those of the objects that lie outside of limits that other objects set."""
        values = self._values[slug]
        for entry in entries:
            raw = values.get(entry.address)
            if not isinstance(raw, int | float) or raw in entry.also:
                continue
            low, high = limits_of(entry, values.get)
            number = Decimal(str(raw))
            if (low is not None and number < low) or (high is not None and number > high):
                yield Place(slug, entry.address)

    def _tolerate_end(self, rows: Sequence[PlanRow]) -> None:
        """What is broken in the wanted station stood so in the devices: it may come back."""
        for row in rows:
            self._put(row.place, row.wanted)
        self._broken |= self._all_broken()
        self._outside |= set(self._all_outside())
        for row in rows:
            self._put(row.place, row.now)

    def _put_with_effects(self, place: Place, raw: Raw | None) -> None:
        self._put(place, raw)
        if raw is not None:
            self._values[place.slug].update(self.effects(place, raw))

    def _put(self, place: Place, raw: Raw | None) -> None:
        assert raw is not None  # a row that is written has a present and a wanted value
        self._values[place.slug][place.address] = raw


def _rules_by_place(station: StationValues, rules: Sequence[Rule]) -> dict[Place, tuple[Rule, ...]]:
    """The rules that look at an object."""
    found: dict[Place, tuple[Rule, ...]] = {}
    for rule in rules:
        for place in places_of(station, rule):
            found[place] = (*found.get(place, ()), rule)
    return found


def places_of(station: StationValues, rule: Rule) -> Iterator[Place]:
    """The objects that a rule looks at, in the devices that are there."""
    for device in station.devices:
        for address in rule.objects.get(device.description.id, ()):
            yield Place(device.slug, parse_address(address))


def _resting_on(device: DeviceValues) -> dict[Address, tuple[Entry, ...]]:
    """The objects whose limits another object sets, by that other one."""
    found: dict[Address, tuple[Entry, ...]] = {}
    for entry in device.description:
        for address in _limits_from(entry):
            found[address] = (*found.get(address, ()), entry)
    return found


def _limits_from(entry: Entry) -> tuple[Address, ...]:
    """The objects that set its limits."""
    return tuple(limit.address for limit in (entry.minimum, entry.maximum) if isinstance(limit, LimitRef))


def _mode_condition(entry: Entry) -> Condition | None:
    return next((condition for condition in entry.requires if condition.address == MODE_SHOWN), None)
