"""How a rule reads a station: it asks for the objects that it needs, and what is not known makes it "not checked"."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Final

from app.model.address import Address, parse_address
from app.model.rules.rule import Detail, Finding, Rule, Severity, Verdict
from app.model.station import Place, StationValues

PMM: Final = "oat-pmm"
PMC: Final = "oat-pmc"


@dataclass(frozen=True, slots=True)
class Object:
    """An object of a kind of device, wherever one is fitted."""

    description_id: str
    address: str


def pmm(address: str) -> Object:
    """An object of the PMM."""
    return Object(PMM, address)


def pmc(address: str) -> Object:
    """An object of the PMC."""
    return Object(PMC, address)


@dataclass(frozen=True, slots=True)
class Found:
    """One thing that is wrong: the objects to mark, first the one to mend, and what fills the text's placeholders."""

    objects: tuple[Object, ...]
    details: Mapping[str, Detail] = field(default_factory=dict)


@cache
def _address(text: str) -> Address:
    """Rules ask for the same few hundred addresses over and over."""
    return parse_address(text)


class Look:
    """Numbers of one station. What was asked for and is not known is kept in ``missing``."""

    def __init__(self, station: StationValues) -> None:
        self._station = station
        self.missing: dict[Object, None] = {}

    def __call__(self, *objects: Object) -> tuple[int, ...]:
        """The raw values, in this order. Raises NotKnownError where any is missing; all of these are noted."""
        found = [self.maybe(one) for one in objects]
        known = tuple(raw for raw in found if raw is not None)
        if len(known) < len(objects):
            raise NotKnownError
        return known

    def maybe(self, one: Object) -> int | None:
        """The raw value, or None; then it is noted as missing."""
        device = self._station.of_kind(one.description_id)
        raw = None if device is None else device.number(_address(one.address))
        if raw is None:
            self.lacks(one)
        return raw

    def lacks(self, one: Object) -> None:
        """Note that nothing can be said of the object, also where it holds a number that says nothing."""
        self.missing[one] = None

    def place(self, one: Object) -> Place | None:
        """Where the object stands, None where no such device is there."""
        device = self._station.of_kind(one.description_id)
        return None if device is None else Place(device.slug, _address(one.address))

    def places(self, objects: Iterable[Object]) -> tuple[Place, ...]:
        """Where the objects stand, of those devices that are there."""
        return tuple(place for place in map(self.place, objects) if place is not None)

    def told(self, one: Object) -> str:
        """A missing object in words: its address, or its device where that is not there at all."""
        if self._station.of_kind(one.description_id) is None:
            return device_name(one)
        return _address(one.address).short

    def holds_default(self, one: Object) -> bool:
        """True where the object holds the default of its description: what is wrong was never set."""
        device, address = self._station.of_kind(one.description_id), _address(one.address)
        entry = None if device is None else device.description.entries.get(address)
        if device is None or entry is None or entry.default is None:
            return False
        return device.values.get(address) == entry.default


def device_name(one: Object) -> str:
    """Short name of the object's device: OAT PMM."""
    return one.description_id.replace("-", " ").upper()


class NotKnownError(Exception):
    """Ends a judgement for want of a value. It never leaves this package."""


Judge = Callable[[Look], Iterator[Found]]


def make_rule(
    rule_id: str,
    section: str,
    severity: Severity,
    objects: tuple[Object, ...],
    judge: Judge,
    *,
    stepwise: bool = False,
) -> Rule:
    """A rule that judges by ``judge``; ``objects`` are all that it may look at."""
    by_kind: dict[str, tuple[str, ...]] = {}
    for one in objects:
        by_kind[one.description_id] = (*by_kind.get(one.description_id, ()), one.address)

    def check(station: StationValues) -> tuple[Finding, ...]:
        return tuple(_findings(station, rule_id, severity, judge))

    return Rule(rule_id, section, severity, stepwise, by_kind, check)


def _findings(station: StationValues, rule_id: str, severity: Severity, judge: Judge) -> Iterator[Finding]:
    look = Look(station)
    try:
        for found in judge(look):
            yield Finding(rule_id, severity, Verdict.BROKEN, look.places(found.objects), _details(look, found))
    except NotKnownError:
        pass  # what is missing was noted, and is told below
    if look.missing:
        names = ", ".join(dict.fromkeys(look.told(one) for one in look.missing))
        yield Finding(rule_id, severity, Verdict.NOT_CHECKED, look.places(look.missing), {"missing": names})


def _details(look: Look, found: Found) -> Mapping[str, Detail]:
    """Those of the text, and ``at_default`` where the object to mend stands as delivered by the manual."""
    first = found.objects[0]
    if not look.holds_default(first):
        return found.details
    return {**found.details, "at_default": _address(first.address).short}
