"""All rules over one station, and those that must hold after every single write of a restore."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final

from app.model.rules.all_rules import ALL
from app.model.rules.rule import Finding, Rule, Severity, Verdict
from app.model.station import Place, StationValues

_SEVERITIES: Final = tuple(Severity)


def check_station(station: StationValues, rules: Iterable[Rule] = ALL) -> list[Finding]:
    """What the rules have to say: what is broken first, the gravest at the head. Nothing where all is well."""
    found = [finding for rule in rules for view in _views(station, rule) for finding in rule.check(view)]
    return sorted(found, key=lambda one: (one.verdict is not Verdict.BROKEN, _SEVERITIES.index(one.severity)))


def broken_stepwise(station: StationValues, rules: Iterable[Rule] = ALL) -> frozenset[tuple[str, tuple[Place, ...]]]:
    """What is broken of the rules that hold after every write: rule and places, to compare before and after one."""
    findings = check_station(station, (rule for rule in rules if rule.stepwise))
    return frozenset((one.rule_id, one.places) for one in findings if one.verdict is Verdict.BROKEN)


def _views(station: StationValues, rule: Rule) -> Iterator[StationValues]:
    """What the rule is to see: each device where it looks at one kind only, else the devices that belong together.

    Where a station holds several of a kind, nobody knows which of them is the partner: then it is none of them.
    """
    kinds = {kind: [one for one in station.devices if one.description.id == kind] for kind in rule.description_ids}
    if len(kinds) == 1:
        yield from (StationValues((one,)) for devices in kinds.values() for one in devices)
    elif any(kinds.values()):
        yield StationValues(tuple(devices[0] for devices in kinds.values() if len(devices) == 1))
