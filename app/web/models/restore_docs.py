"""Plans and restores as the page gets them."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any, Final, Literal

from app.model.address import Address, parse_address
from app.model.datatypes import Raw
from app.model.description import Description
from app.model.description_file import BUILTIN, load_builtin
from app.model.restore.plan import PlanRow, Step, StepKind
from app.model.rules.check import BrokenAt, broken_in, check_station, mended
from app.model.rules.rule import Finding
from app.model.station import Place, StationValues
from app.model.values import quantity_of, show
from app.service.restore.desk import Desk
from app.service.restore.log import Kept, raw_of
from app.service.restore.order import Cause
from app.service.restore.prepare import Prepared
from app.service.restore.transaction import Transaction
from app.service.views import raw_to_json
from app.store.restore_rows import Direction, RestoreRow, RestoreState, StepRow
from app.web.models import Failure
from app.web.models.restore import (
    EndName,
    RestoreDoc,
    RestoreFinding,
    RestoreHead,
    RestorePlace,
    RestorePlanDoc,
    RestorePlanRow,
    RestorePlanStep,
    RestoreRefusal,
    RestoreSource,
    RestoreStepDoc,
    RestoreValue,
    WayName,
)

ValueState = Literal["equal", "waiting", "intended", "done", "failed", "unknown"]
Descriptions = Callable[[str], Description | None]
"""The description of a device, by its slug."""
_WRITES: Final = (StepKind.WRITE.value, StepKind.AUXILIARY.value)
_ENDS: Final[Mapping[RestoreState, EndName]] = {
    RestoreState.DONE: "new",
    RestoreState.ROLLED_BACK: "old",
    RestoreState.INCOMPLETE: "incomplete",
    RestoreState.GIVEN_UP: "given-up",
}


# -- plans ---------------------------------------------------------------------------


def plan_doc(prepared: Prepared) -> RestorePlanDoc:
    """A plan with what speaks against it."""
    plan, station = prepared.plan, prepared.found.station
    before = check_station(station)
    broken = broken_in(before)
    return RestorePlanDoc(
        station=prepared.order.station,
        hash=prepared.hash,
        refusals=[
            RestoreRefusal(
                code=one.objection.value, text_key=one.objection.text_key, device=one.device, details=dict(one.details)
            )
            for one in prepared.refusals
        ],
        sources=_sources(prepared),
        rows=[_row(row, station) for row in plan.rows],
        steps=[_step(step, station) for step in plan.steps],
        needs={slug: [need.value for need in needs] for slug, needs in plan.needs.items()},
        by_hand=list(prepared.by_hand),
        restarts=list(plan.restarts),
        findings=[_finding(one, broken) for one in plan.findings],
        blockers=[_finding(one, broken) for one in plan.blockers],
        mended=[_finding(one, broken) for one in mended(before, plan.findings)],
        unordered=[_place(one) for one in plan.unordered],
    )


def _sources(prepared: Prepared) -> list[RestoreSource]:
    return [
        RestoreSource(
            device=slug,
            record=given.record,
            hash=given.parameters.hash,
            from_device=given.parameters.origin.device,
            time=given.parameters.origin.time,
            person=given.parameters.origin.person,
            same_unit=prepared.same_unit[slug],
        )
        for slug, given in prepared.order.given.items()
    ]


def _row(row: PlanRow, station: StationValues) -> RestorePlanRow:
    device = station.device(row.place.slug)
    entry = None if device is None else device.description.entries.get(row.place.address)
    lookup = (lambda _address: None) if device is None else device.values.get
    shown = [
        None if raw is None else str(raw) if entry is None else show(entry, raw, lookup)
        for raw in (row.now, row.wanted)
    ]
    return RestorePlanRow(
        device=row.place.slug,
        address=row.place.address.short,
        name="" if entry is None else entry.title,
        group="" if entry is None else entry.group,
        restore_class=None if entry is None else entry.restore.value,
        save_category=None if entry is None else entry.save_category,
        unit="" if entry is None else quantity_of(entry, lookup).unit,
        treatment=row.treatment.value,
        why=None if row.why is None else row.why.value,
        why_key=None if row.why is None else f"restore.why.{row.why.value}",
        details=dict(row.details),
        now_raw=_raw(row.now),
        wanted_raw=_raw(row.wanted),
        now_shown=shown[0],
        wanted_shown=shown[1],
    )


def _step(step: Step, station: StationValues) -> RestorePlanStep:
    device = station.device(step.device)
    entry = None if device is None or step.place is None else device.description.entries.get(step.place.address)
    shown = None
    if device is not None and entry is not None and step.raw is not None:
        shown = show(entry, step.raw, device.values.get)
    return RestorePlanStep(
        kind=step.kind.value,
        device=step.device,
        category=step.category,
        address=None if step.place is None else step.place.address.short,
        name=None if entry is None else entry.title,
        shown=shown,
    )


def _finding(finding: Finding, before: frozenset[BrokenAt]) -> RestoreFinding:
    return RestoreFinding(
        rule=finding.rule_id,
        severity=finding.severity.value,
        verdict=finding.verdict.value,
        is_new=bool(broken_in([finding]) - before),
        places=[_place(place) for place in finding.places],
        details=dict(finding.details),
    )


def _place(place: Place) -> RestorePlace:
    return RestorePlace(device=place.slug, address=place.address.short)


def _raw(raw: Raw | None) -> Any:
    return None if raw is None else raw_to_json(raw)


# -- restores ------------------------------------------------------------------------


def head_doc(row: RestoreRow) -> RestoreHead:
    """A restore in short."""
    return RestoreHead(**_head(row, json.loads(row.outcome)))


def _head(row: RestoreRow, outcome: Mapping[str, Any]) -> dict[str, Any]:
    cause = outcome.get("cause")
    return {
        "id": row.id,
        "turbine": row.turbine,
        "station": row.station,
        "state": row.state.value,
        "end": _ENDS.get(row.state),
        "person": row.person,
        "reason": row.reason,
        "work_order": row.work_order,
        "started_ns": row.started_ns,
        "ended_ns": row.ended_ns,
        "cause_key": None if cause is None else Cause(cause).text_key,
    }


def restore_doc(kept: Kept, desk: Desk, descriptions: Descriptions) -> RestoreDoc:
    """A restore as it stands now."""
    details, outcome = kept.details, kept.outcome
    transaction = desk.at_work(kept.row.id)
    return RestoreDoc(
        **_head(kept.row, outcome),
        running=transaction is not None,
        left_s=None if transaction is None else transaction.left_s,
        switching=None if transaction is None else transaction.switching,
        switch_left_s=None if transaction is None else transaction.switch_left_s,
        confirm_s=details["confirm_s"],
        confirmed_by=outcome.get("confirmed_by"),
        proven=bool(outcome.get("proven")),
        restart=details["restart"],
        done=0 if transaction is None else transaction.done,
        total=0 if transaction is None else transaction.total,
        blocks=not kept.row.state.ended,
        can=_can(kept.row.state, transaction),
        cause_device=outcome.get("device"),
        cause_details=outcome.get("cause_details", {}),
        error=_failure(outcome.get("error"), ""),
        values=_values(kept, descriptions),
        steps=[_step_doc(step, kept, descriptions) for step in kept.steps],
        undo={one["slug"]: one["before"]["record"] for one in details["devices"] if one["before"]["record"]},
    )


def _can(state: RestoreState, transaction: Transaction | None) -> list[WayName]:
    if transaction is None:
        return ["resume", "roll-back", "give-up"] if state is RestoreState.INCOMPLETE else []
    if state is RestoreState.AWAITING_CONFIRMATION:
        return ["confirm", "roll-back"]
    if transaction.switching is not None and state is not RestoreState.ROLLING_BACK:
        return ["unproven", "roll-back"]
    if transaction.switching is not None:
        return ["unproven"]
    on_its_way = not state.ended and state not in (RestoreState.ROLLING_BACK, RestoreState.INCOMPLETE)
    return ["roll-back"] if on_its_way else []


def _values(kept: Kept, descriptions: Descriptions) -> list[RestoreValue]:
    last = {(step.device, step.address): step for step in kept.steps if step.kind in _WRITES}
    found = []
    for value in kept.values:
        step = last.get((value.device, value.address))
        before, wanted = raw_of(value.before), raw_of(value.wanted)
        unit, name, shown = _words(kept, descriptions, value.device, value.address)
        found.append(
            RestoreValue(
                device=value.device,
                address=parse_address(value.address).short,
                name=name,
                save_category=_save_category(descriptions, value.device, value.address),
                unit=unit,
                before_raw=_raw(before),
                wanted_raw=_raw(wanted),
                before_shown=shown(before),
                wanted_shown=shown(wanted),
                state=_value_state(before == wanted, step),
                written=None if step is None else "before" if step.direction is Direction.BACK else "wanted",
            )
        )
    return found


def _value_state(equal: bool, step: StepRow | None) -> ValueState:
    if step is None:
        return "equal" if equal else "waiting"
    return step.state.value


def _step_doc(step: StepRow, kept: Kept, descriptions: Descriptions) -> RestoreStepDoc:
    shown = None
    if step.address is not None and step.raw is not None:
        shown = _words(kept, descriptions, step.device, step.address)[2](raw_of(step.raw))
    return RestoreStepDoc(
        n=step.n,
        category=_category(step, descriptions),
        direction=step.direction.value,
        kind=StepKind(step.kind).value,
        device=step.device,
        address=None if step.address is None else parse_address(step.address).short,
        shown=shown,
        state=step.state.value,
        begun_ns=step.begun_ns,
        ended_ns=step.ended_ns,
        error=_failure(json.loads(step.details).get("error"), step.address or ""),
    )


def _category(step: StepRow, descriptions: Descriptions) -> str | None:
    """What a save keeps; None for all, and for other steps."""
    description = descriptions(step.device)
    if step.kind != StepKind.SAVE.value or step.address is None or description is None:
        return None
    entry = parse_address(step.address)
    return next((one.category for one in description.save if one.address == entry), None)


def _save_category(descriptions: Descriptions, device: str, address: str) -> str | None:
    description = descriptions(device)
    entry = None if description is None else description.entries.get(parse_address(address))
    return None if entry is None else entry.save_category


def _words(kept: Kept, descriptions: Descriptions, device: str, address: str) -> tuple[str, str, Callable[[Raw], str]]:
    """Unit, name and how a value is shown."""
    at: Address = parse_address(address)
    description = descriptions(device)
    entry = None if description is None else description.entries.get(at)
    if entry is None:
        return "", "", str
    known = {place.address: pair[1] for place, pair in kept.goals.items() if place.slug == device}
    return quantity_of(entry, known.get).unit, entry.title, lambda raw: show(entry, raw, known.get)


def _failure(kept: Mapping[str, Any] | None, address: str) -> Failure | None:
    if kept is None:
        return None
    return Failure(address=address, code=kept["code"], text_key=kept["text_key"], details=kept["details"])


def descriptions_of(kept: Kept, connected: Mapping[str, Description]) -> Descriptions:
    """The descriptions of the restore's devices: of those that are connected, else those that come with the program."""
    kinds = {one["slug"]: one["description"][0] for one in kept.details["devices"]}

    def find(slug: str) -> Description | None:
        kind = kinds.get(slug, "")
        return connected.get(slug) or (load_builtin(kind) if kind in BUILTIN else None)

    return find
