"""A record of a restore as long as a real one: both devices of a station, every treatment, nasty texts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from app.model.description import Entry
from app.model.description_file import load_builtin
from app.model.restore.plan import Need, StepKind, Treatment, Why
from app.model.rules.rule import Severity, Verdict
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

REASON = (
    'Umrichter getauscht: `#import "x"` *fett* <script>alert(1)</script> $x^2$ \\u{41} // ]]> --> & é 中 \u202e\x07'
)
PMM, PMC = "wtg-07/blade-2/pmm", "wtg-07/blade-2/pmc"


def record() -> RestoreRecord:
    """Everything filled."""
    rows = tuple(_rows())
    return RestoreRecord(
        id="019a9d2e-0000-7000-8000-000000000001",
        station="wtg-07/blade-2",
        outcome=Outcome.NEW,
        person="anna",
        reason=REASON,
        work_order="WO-4711",
        started="2026-11-22T10:00:00.000Z",
        confirmed="2026-11-22T10:00:20.000Z",
        confirmed_by="berta",
        ended="2026-11-22T10:00:31.500Z",
        plan_hash="ab" * 32,
        tool="0.1.0",
        simulated=True,
        devices=(_device(PMM, "oat-pmm", 10), _device(PMC, "oat-pmc", 11)),
        rows=rows,
        steps=tuple(_steps(rows)),
        findings=(
            FindingRecord("oat.dc_link_ladder", Severity.WARNING, Verdict.BROKEN, (PlaceRecord(PMM, "30FA:03"),)),
            FindingRecord("no.such.rule", Severity.NOTE, Verdict.NOT_CHECKED, (), {"missing": "6079"}),
        ),
        checks=(CheckRecord("no.such.check", True), CheckRecord("no.{such", False, {"a": "b"}, "chef")),
        events=(EventRecord("2026-11-22T10:00:00.000Z", "record.title", "anna"),),
    )


def failed() -> RestoreRecord:
    """One that ended half way, of real devices."""
    done = record()
    device = replace(done.devices[0], simulated=False, same_unit=False, restored=None, after=None, undo=None)
    step = StepRecord(StepKind.SAVE, PMM, done.ended, StepOutcome.FAILED, note="no answer within 5 s")
    return replace(
        done,
        outcome=Outcome.INCOMPLETE,
        simulated=False,
        devices=(device,),
        steps=(step,),
        note="cable",
        confirmed=None,
    )


def _device(slug: str, kind: str, node: int) -> DeviceRecord:
    return DeviceRecord(
        slug=slug,
        description_id=kind,
        description_version="1.09",
        node=node,
        identity={"device_type": 0x192, "device_name": "HUBSIDE TWIN", "software": "1.0", "vendor_id": 0x1F},
        nameplate="SN 12/345",
        same_unit=True,
        before=SetReference("01" * 32),
        restored=SetReference("02" * 32, "r", slug, "2025-11-22T10:00:00Z", "carl", "as delivered", "WO-1"),
        after=SetReference("03" * 32),
        undo=SetReference("01" * 32),
        needs=(Need.AXIS_DISABLED,),
        restarted=True,
        simulated=True,
    )


def _rows() -> Iterator[RowRecord]:
    for slug, kind in ((PMM, "oat-pmm"), (PMC, "oat-pmc")):
        description = load_builtin(kind)
        saved = [entry for entry in description.entries.values() if entry.saved]
        for number, entry in enumerate(saved[:45]):
            yield _row(slug, entry, number)


def _row(slug: str, entry: Entry, number: int) -> RowRecord:
    was, wanted = Value(number, str(number)), Value(number + 1, f"{number + 1}")
    address, unit = entry.address.short, entry.quantity.unit
    if number % 3 == 0:
        return RowRecord(slug, address, entry.title, unit, Treatment.EQUAL, was, was, was)
    if number % 3 == 1:
        why = list(Why)[number % len(Why)]
        return RowRecord(slug, address, entry.title, unit, Treatment.SKIP, was, wanted, was, why, {"limit": "5"})
    return RowRecord(
        slug, address, entry.title, unit, Treatment.WRITE, was, wanted, wanted, verified=True, saved=True, proven=True
    )


def _steps(rows: tuple[RowRecord, ...]) -> Iterator[StepRecord]:
    for row in rows:
        if row.treatment is Treatment.WRITE:
            yield StepRecord(
                StepKind.WRITE, row.device, "2026-11-22T10:00:01.000Z", StepOutcome.DONE, row.address, row.wanted
            )
    yield StepRecord(StepKind.CONFIRM, PMM, "2026-11-22T10:00:20.000Z", StepOutcome.DONE)
    yield StepRecord(StepKind.SAVE, PMM, "2026-11-22T10:00:22.000Z", StepOutcome.DONE)
    yield StepRecord(StepKind.PROVE, PMM, "2026-11-22T10:00:30.000Z", StepOutcome.UNKNOWN, note="cut")
