"""Make the plan of a restore: every object accounted for, the writes in a safe order, what it needs, what forbids it.

Pure: it works on what is known of the station, and the machine follows the plan to the letter. A rollback is a plan
too, from what is there to what was there before.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from app.model.address import Address
from app.model.datatypes import Raw
from app.model.description import RestoreClass
from app.model.restore.order import order
from app.model.restore.plan import Need, Plan, PlanRow, Step, StepKind, Treatment
from app.model.restore.rows import breaks_saving, rows_of
from app.model.restore.walk import MODE
from app.model.restore.wanted import DeviceState, PlanOptions, Values
from app.model.rules.all_rules import ALL
from app.model.rules.check import broken_in, check_station
from app.model.rules.rule import Finding, Rule, Severity, Verdict
from app.model.saving import Category, saves_for
from app.model.station import Place, StationValues, station_slug

_AFTER_RESTART: Final[Mapping[str, Mapping[Address, int]]] = {"oat-pmc": {Address(0x60FB, 3): 0x0001}}
"""Bits that the device looks at only when it starts, by description: autostart (manual 5.4.1.8).

Of all other objects the manuals do not say when a new value takes effect. A restart settles it, and proves what was
saved.
"""

ALL_OF_IT: Final = PlanOptions()
"""Everything that may go to any machine of this kind."""


def make_plan(
    station: StationValues,
    wanted: Mapping[str, Values],
    options: PlanOptions = ALL_OF_IT,
    states: Mapping[str, DeviceState] | None = None,
    rules: Sequence[Rule] = ALL,
) -> Plan:
    """Plan the way from the station as it is (RAM of all its devices) to the values wanted, by device slug.

    Devices without wanted values stay as they are, and count in all rules. A device that is wanted but is not in the
    station is left out: that the right devices are there is checked elsewhere. ``states``: what the devices do now.
    """
    devices = [one for one in station.devices if one.slug in wanted]
    rows = tuple(row for one in devices for row in rows_of(one, wanted[one.slug], options))
    writes = [row for row in rows if row.treatment is Treatment.WRITE]
    steps, unordered = order(station, writes, rules, options, states or {})
    findings = tuple(check_station(_after(station, writes), rules))
    after_restart = tuple(row.place for row in writes if _acts_at_start(station, row))
    last = _last_steps(station, steps, options)
    late = [step for step in steps if _too_early(station, step, last)]
    saved = max((at for at, step in enumerate(last, 1) if step.kind is StepKind.SAVE), default=0)
    return Plan(
        station=station_slug(devices[0].slug) if devices else "",
        rows=rows,
        steps=(*(step for step in steps if step not in late), *last[:saved], *late, *last[saved:]),
        needs=_needs(steps),
        restarts=tuple(dict.fromkeys(place.slug for place in after_restart)),
        findings=findings,
        blockers=_blockers(findings, check_station(station, rules), options),
        unordered=unordered,
        after_restart=after_restart,
        new_address=tuple(row.place for row in writes if _is_network(station, row)),
    )


def plan_hash(plan: Plan) -> str:
    """SHA-256 of what the plan does, in hexadecimal: what a person reviewed is what runs.

    It covers all steps, what each write replaces, and why other objects are not restored; not the present values of
    objects that are not written, for process values never stand still.
    """
    done = [row for row in plan.rows if row.treatment is not Treatment.SKIP]
    content = {
        "station": plan.station,
        "values": [[*_place(row.place), row.treatment.value, _text(row.now), _text(row.wanted)] for row in done],
        "skipped": [[*_place(row.place), row.why.value] for row in plan.rows if row.why is not None],
        "steps": [_step(one) for one in plan.steps],
        "unordered": [_place(place) for place in plan.unordered],
        "blockers": [[one.rule_id, [_place(place) for place in one.places]] for one in plan.blockers],
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def _after(station: StationValues, writes: Iterable[PlanRow]) -> StationValues:
    """The station as the rows make it."""
    values = {one.slug: dict(one.values) for one in station.devices}
    for row in writes:
        if row.wanted is not None:
            values[row.place.slug][row.place.address] = row.wanted
    return StationValues(tuple(replace(one, values=values[one.slug]) for one in station.devices))


def _last_steps(station: StationValues, steps: Sequence[Step], options: PlanOptions) -> list[Step]:
    """A person confirms what stands in RAM; then it is made permanent and proven, device by device."""
    written = list(dict.fromkeys(step.device for step in steps if step.kind is StepKind.WRITE))
    saved = written if options.save is None else sorted(options.save)
    last = [Step(StepKind.CONFIRM, "")] if options.confirm and (written or saved) else []
    last += [
        Step(StepKind.SAVE, slug, category=one) for slug in saved for one in _categories(station, slug, steps, options)
    ]
    last += [Step(StepKind.RESTART, slug) for slug in saved if options.restart]
    return last + [Step(StepKind.PROVE, slug) for slug in dict.fromkeys((*written, *saved))]


def _too_early(station: StationValues, step: Step, last: Iterable[Step]) -> bool:
    """True for a write after which its device takes no save any more, where it is to be saved: on a way back only."""
    device = station.device(step.device)
    if step.kind is not StepKind.WRITE or step.place is None or step.raw is None or device is None:
        return False
    saves = any(one.kind is StepKind.SAVE and one.device == step.device for one in last)
    return saves and breaks_saving(device.description, step.place.address, step.raw)


def _categories(station: StationValues, slug: str, steps: Sequence[Step], options: PlanOptions) -> tuple[Category, ...]:
    """What is saved of a device: each category of what is written."""
    if options.save is not None:
        return options.categories.get(slug, (None,))
    device = station.device(slug)
    places = [step.place for step in steps if step.place is not None and step.device == slug]
    kept = () if device is None else saves_for(device.description, (place.address for place in places))
    return kept or (None,)


def _needs(steps: Iterable[Step]) -> dict[str, tuple[Need, ...]]:
    """A change of the mode of operation needs the axis disabled, so that nothing moves by it (manual 5.9.1)."""
    slugs = {step.device for step in steps if step.place is not None and step.place.address == MODE}
    return dict.fromkeys(sorted(slugs), (Need.AXIS_DISABLED, Need.HOMING_MODE))


def _acts_at_start(station: StationValues, row: PlanRow) -> bool:
    device = station.device(row.place.slug)
    if device is None:
        return False
    if _is_network(station, row):
        return True
    mask = _AFTER_RESTART.get(device.description.id, {}).get(row.place.address, 0)
    return isinstance(row.now, int) and isinstance(row.wanted, int) and bool((row.now ^ row.wanted) & mask)


def _is_network(station: StationValues, row: PlanRow) -> bool:
    device = station.device(row.place.slug)
    return device is not None and device.description.entry(row.place.address).restore is RestoreClass.NETWORK


def _blockers(findings: Iterable[Finding], before: Iterable[Finding], options: PlanOptions) -> tuple[Finding, ...]:
    """Errors in the station as it will be.

    One that stands there already is let pass only where an expert accepts that very rule; a new one never is. On the
    way back nothing blocks: what was there before may come back.
    """
    if options.returning:
        return ()
    broken = broken_in(before)
    accepted = options.accepted if options.expert else frozenset()
    return tuple(
        one
        for one in findings
        if one.severity is Severity.ERROR
        and one.verdict is Verdict.BROKEN
        and not (one.rule_id in accepted and (one.rule_id, one.places) in broken)
    )


def _step(step: Step) -> list[Any]:
    part = [] if step.category is None else [step.category]
    return [step.kind.value, step.device, _place(step.place), _text(step.raw), *part]


def _place(place: Place | None) -> list[str]:
    return [] if place is None else [place.slug, str(place.address)]


def _text(raw: Raw | None) -> Any:
    return {"hex": raw.hex()} if isinstance(raw, bytes) else raw
