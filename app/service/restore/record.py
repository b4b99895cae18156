"""The record of a restore, made of what the store kept of it: never of what anybody remembers."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any, Final

from app import __version__
from app.drivers.contract import TWIN_NAME
from app.model.address import Address, parse_address
from app.model.datatypes import Raw
from app.model.description import Description, Lookup
from app.model.restore.plan import Need, StepKind, Treatment, Why
from app.model.rules.rule import Severity, Verdict
from app.model.sets import ParameterSet, iso_time
from app.model.texts import load_texts
from app.model.values import quantity_of, show
from app.service.records.restore_record import (
    CheckRecord,
    DeviceRecord,
    EventRecord,
    FindingRecord,
    Outcome,
    PlaceRecord,
    RestoreRecord,
    RowRecord,
    SetReference,
    StepOutcome,
    StepRecord,
    Value,
)
from app.service.restore.details import reference
from app.service.restore.log import Kept, raw_of
from app.service.restore.order import Cause, Objection
from app.store.restore_rows import Direction, RestoreState, StepRow, StepState
from app.wire.stored import covers

_OUTCOMES: Final = {
    RestoreState.DONE: Outcome.NEW,
    RestoreState.ROLLED_BACK: Outcome.OLD,
    RestoreState.GIVEN_UP: Outcome.GIVEN_UP,
}
_STEPS: Final = {
    StepState.DONE: StepOutcome.DONE,
    StepState.FAILED: StepOutcome.FAILED,
    StepState.UNKNOWN: StepOutcome.UNKNOWN,
    StepState.INTENDED: StepOutcome.UNKNOWN,
}
CHECKS: Final = (
    Objection.OTHER_DEVICE_TYPE,
    Objection.DESCRIPTION,
    Objection.FIRMWARE,
    Objection.IDENTITY,
    Objection.DRIVE_ENABLED,
    Objection.DRIVE_MOVING,
    Objection.SUPPLY,
    Objection.BATTERY,
    Objection.OTHER_MASTER,
    Objection.NOT_RECORDING,
    Objection.OTHER_BLADES,
    Objection.RESTORE_OPEN,
    Objection.RULES,
)
"""What was looked at before the first write; the restore would not have begun had one of them spoken against it."""


def outcome_of(state: RestoreState) -> Outcome:
    """What a record says of a restore in ``state``."""
    return _OUTCOMES.get(state, Outcome.INCOMPLETE)


class RecordOf:
    """Makes the record of one restore. ``after``: what was read at the end, by slug; ``descriptions`` by slug."""

    def __init__(
        self,
        kept: Kept,
        descriptions: Mapping[str, Description],
        after: Mapping[str, ParameterSet],
        after_records: Mapping[str, str],
    ) -> None:
        self._kept = kept
        self._details = kept.details
        self._outcome = kept.outcome
        self._descriptions = descriptions
        self._after = after
        self._after_records = after_records

    def make(self) -> RestoreRecord:
        """The record."""
        row, outcome = self._kept.row, self._outcome
        confirmed = outcome.get("confirmed_ns")
        devices = tuple(self._device(one) for one in self._details["devices"])
        return RestoreRecord(
            id=row.id,
            station=row.station,
            outcome=outcome_of(row.state),
            person=row.person,
            reason=row.reason,
            work_order=row.work_order,
            started=iso_time(row.started_ns),
            confirmed=None if confirmed is None else iso_time(confirmed),
            confirmed_by=outcome.get("confirmed_by", ""),
            ended="" if row.ended_ns is None else iso_time(row.ended_ns),
            plan_hash=self._details["plan_hash"],
            tool=f"hubside {__version__}",
            simulated=any(one.simulated for one in devices),
            devices=devices,
            rows=tuple(self._rows()),
            steps=tuple(self._step(one) for one in self._kept.steps),
            findings=tuple(_finding(one) for one in self._details["findings"]),
            checks=tuple(self._checks()),
            events=tuple(_event(one) for one in outcome.get("events", ())),
            note=self._note(),
        )

    def _device(self, one: Mapping[str, Any]) -> DeviceRecord:
        slug, identity = one["slug"], dict(one["identity"])
        after = self._after.get(slug)
        nameplate = identity.pop("nameplate", None)
        before = SetReference(**one["before"])
        return DeviceRecord(
            slug=slug,
            description_id=one["description"][0],
            description_version=one["description"][1],
            node=one["node"],
            identity={name: value for name, value in identity.items() if value is not None},
            nameplate=nameplate,
            same_unit=one["same_unit"],
            before=before,
            restored=None if one["set"] is None else SetReference(**one["set"]),
            after=None if after is None else SetReference(**reference(after, self._after_records.get(slug, ""))),
            undo=before,
            needs=tuple(Need(need) for need in self._details["needs"].get(slug, ())),
            restarted=slug in self._done(StepKind.RESTART),
            simulated=str(identity.get("device_name") or "").startswith(TWIN_NAME),
        )

    # -- rows --------------------------------------------------------------------------

    def _rows(self) -> Iterator[RowRecord]:
        saved, restarted = self._done(StepKind.SAVE), self._done(StepKind.RESTART)
        writes = {(device, address) for device, address in self._details["writes"]}
        reached = self._kept.row.state in (RestoreState.DONE, RestoreState.ROLLED_BACK)
        unproven = {(device, str(parse_address(address))) for device, address in self._outcome.get("unproven", ())}
        for one in self._kept.values:
            write = (one.device, one.address) in writes
            proven = reached and one.device in saved & restarted and (one.device, one.address) not in unproven
            yield self._row(
                one.device,
                one.address,
                Treatment.WRITE if write else Treatment.EQUAL,
                raw_of(one.before),
                raw_of(one.wanted),
                verified=reached,
                saved=proven or (reached and one.device in saved and self._is_saved(one.device, one.address)),
                proven=proven,
            )
        for one in self._details["skipped"]:
            was, wanted = (_raw(one[name]) for name in ("now", "wanted"))
            yield self._row(
                one["device"],
                one["address"],
                Treatment.SKIP,
                was,
                wanted,
                why=Why(one["why"]),
                details=one["details"],
            )

    def _row(
        self, device: str, address: str, treatment: Treatment, was: Raw | None, wanted: Raw | None, **known: Any
    ) -> RowRecord:
        at = parse_address(address)
        after = self._after.get(device)
        lookup = self._lookup(device)
        entry = self._descriptions[device].entries.get(at)

        def value(raw: Raw | None) -> Value | None:
            return None if raw is None else Value(raw, str(raw) if entry is None else show(entry, raw, lookup))

        return RowRecord(
            device=device,
            address=at.short,
            name="" if entry is None else entry.title,
            unit="" if entry is None else quantity_of(entry, lookup).unit,
            treatment=treatment,
            was=value(was),
            wanted=value(wanted),
            now=value(None if after is None else after.values.get(at)),
            **known,
        )

    def _lookup(self, device: str) -> Lookup:
        """What units rest on: as it is at the end, else as it was wanted."""
        after = self._after.get(device)
        if after is not None:
            return after.values.get
        known: dict[Address, Raw] = {
            place.address: wanted for place, (_, wanted) in self._kept.goals.items() if place.slug == device
        }
        return known.get

    def _done(self, kind: StepKind) -> frozenset[str]:
        """Devices that were saved, or restarted, on the way that reached the end."""
        back = self._kept.row.state is RestoreState.ROLLED_BACK
        return frozenset(
            step.device
            for step in self._kept.steps
            if step.kind == kind.value and step.state is StepState.DONE and (step.direction is Direction.BACK) == back
        )

    def _is_saved(self, device: str, address: str) -> bool:
        """Where a device is saved by categories: whether that of the object was."""
        commands = [
            parse_address(step.address)
            for step in self._kept.steps
            if step.kind == StepKind.SAVE.value and step.device == device and step.address is not None
        ]
        at = parse_address(address)
        return not commands or any(covers(self._descriptions[device], command, at) for command in commands)

    # -- the rest ----------------------------------------------------------------------

    def _step(self, step: StepRow) -> StepRecord:
        error = json.loads(step.details).get("error")
        value = None
        if step.raw is not None and step.address is not None:
            entry = self._descriptions[step.device].entry(parse_address(step.address))
            value = Value(raw_of(step.raw), show(entry, raw_of(step.raw), self._lookup(step.device)))
        return StepRecord(
            kind=StepKind(step.kind),
            device=step.device,
            time=iso_time(step.begun_ns),
            outcome=_STEPS[step.state],
            address="" if step.address is None else parse_address(step.address).short,
            value=value,
            note="" if error is None else load_texts("en")(error["text_key"], **error["details"]),
        )

    def _checks(self) -> Iterator[CheckRecord]:
        by = self._kept.row.person if self._details["others_confirmed"] else ""
        for one in CHECKS:
            answered = by if one is Objection.OTHER_BLADES else ""
            yield CheckRecord(f"restore.check.{one.value}", not answered, {}, answered)

    def _note(self) -> str:
        cause = self._outcome.get("cause")
        if cause is None or self._kept.row.state is RestoreState.DONE:
            return ""
        return load_texts("en")(Cause(cause).text_key, **(self._outcome.get("cause_details") or {}))


def _finding(one: Mapping[str, Any]) -> FindingRecord:
    places = tuple(PlaceRecord(device, parse_address(address).short) for device, address in one["places"])
    return FindingRecord(one["rule"], Severity(one["severity"]), Verdict(one["verdict"]), places, one["details"])


def _event(one: Mapping[str, Any]) -> EventRecord:
    return EventRecord(iso_time(one["t_ns"]), one["text_key"], one["person"], one["details"])


def _raw(value: Any) -> Raw | None:
    return bytes.fromhex(value["hex"]) if isinstance(value, dict) else value
