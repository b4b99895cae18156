"""All rules over one station, and those that must hold after every single write of a restore."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final

from app.model.rules.all_rules import ALL
from app.model.rules.rule import Finding, Rule, Severity, Verdict
from app.model.station import Place, StationValues

BrokenAt = tuple[str, tuple[Place, ...]]
"""One thing that is broken, to compare two stations by: the rule and the objects that it marks."""
_SEVERITIES: Final = tuple(Severity)


def check_station(station: StationValues, rules: Iterable[Rule] = ALL) -> list[Finding]:
    """What the rules have to say: what is broken first, the gravest at the head. Nothing where all is well."""
    found = [finding for rule in rules for view in _views(station, rule) for finding in rule.check(view)]
    return sorted(found, key=lambda one: (one.verdict is not Verdict.BROKEN, _SEVERITIES.index(one.severity)))


def broken_in(findings: Iterable[Finding]) -> frozenset[BrokenAt]:
    """What is broken, without the findings that could not be judged."""
    return frozenset((one.rule_id, one.places) for one in findings if one.verdict is Verdict.BROKEN)


def mended(before: Iterable[Finding], after: Iterable[Finding]) -> list[Finding]:
    """Of ``before``, what is broken there and kept in ``after``; what cannot be judged there is not kept."""
    after = list(after)
    broken, unjudged = broken_in(after), {one.rule_id for one in after if one.verdict is Verdict.NOT_CHECKED}
    return [
        one
        for one in before
        if one.verdict is Verdict.BROKEN and (one.rule_id, one.places) not in broken and one.rule_id not in unjudged
    ]


def broken_stepwise(station: StationValues, rules: Iterable[Rule] = ALL) -> frozenset[BrokenAt]:
    """What is broken of the rules that hold after every write, to compare before and after one."""
    return broken_in(check_station(station, (rule for rule in rules if rule.stepwise)))


def _views(station: StationValues, rule: Rule) -> Iterator[StationValues]:
    """What the rule is to see: each device where it looks at one kind only, else the devices that belong together.

    Where a station holds several of a kind, nobody knows which of them is the partner: then it is none of them.
    """
    kinds = {kind: [one for one in station.devices if one.description.id == kind] for kind in rule.description_ids}
    if len(kinds) == 1:
        yield from (StationValues((one,)) for devices in kinds.values() for one in devices)
    elif any(kinds.values()):
        yield StationValues(tuple(devices[0] for devices in kinds.values() if len(devices) == 1))
