"""The battery of an axis: its test, its charger by hand, and its change."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends

from app.errors import NotConnectedError
from app.model.roles import Role
from app.service.battery.desk import BatteryDesk
from app.service.battery.records import ChangeRecord, Noted
from app.web.deps import DEVICE, BenchOf, JournalOf, PersonOf, TargetOf, needs
from app.web.models import Nothing
from app.web.models.battery import (
    BatteryDoc,
    BatteryHistory,
    NeedDoc,
    NewBatteryRequest,
    OldBatteryRequest,
    RunningTestDoc,
)

router = APIRouter()
TECHNICIAN = needs(Role.TECHNICIAN)
BATTERY = DEVICE + "/battery"


def get_battery_desk(bench: BenchOf) -> BatteryDesk:
    """The desk of the connection. Raises NotConnectedError."""
    if bench.batteries is None:
        raise NotConnectedError
    return bench.batteries


BatteryDeskOf = Annotated[BatteryDesk, Depends(get_battery_desk)]


@router.get("/batteries/{turbine}/{station}/{device}")
async def battery_history(bench: BenchOf, turbine: str, station: str, device: str) -> BatteryHistory:
    """Tests and changes of a device's battery that were kept; it need not be connected."""
    archive, slug = bench.battery_archive, f"{turbine}/{station}/{device}"
    return BatteryHistory(tests=await archive.tests(slug), changes=await archive.changes(slug))


@router.get(BATTERY)
async def battery(desk: BatteryDeskOf, target: TargetOf) -> BatteryDoc:
    """What a test of the battery needs, and the test or change that is under way."""
    running = desk.running(target)
    return BatteryDoc(
        needs=[] if running is not None else [NeedDoc.of(need) for need in await desk.needs(target)],
        running=None if running is None else RunningTestDoc.of(running),
        noted=await desk.archive.noted(target.slug),
    )


@router.post(BATTERY + "/test", dependencies=[TECHNICIAN])
async def test_battery(desk: BatteryDeskOf, target: TargetOf, person: PersonOf, journal: JournalOf) -> RunningTestDoc:
    """Begin a test; answered once the drive has begun it, or would not. It goes on by itself, and a record is kept."""
    return RunningTestDoc.of(await desk.test(target, person.person, journal))


@router.post(BATTERY + "/test/cancel", dependencies=[TECHNICIAN])
async def cancel_battery_test(desk: BatteryDeskOf, target: TargetOf) -> Nothing:
    """Stop watching the test; the drive ends it by itself."""
    desk.cancel(target)
    return Nothing()


@router.post(BATTERY + "/charge", dependencies=[TECHNICIAN])
async def charge_battery(desk: BatteryDeskOf, target: TargetOf, journal: JournalOf) -> Nothing:
    """Start the charger by hand."""
    await desk.charge(target, journal)
    return Nothing()


@router.post(BATTERY + "/change", dependencies=[TECHNICIAN])
async def note_old_battery(
    desk: BatteryDeskOf, target: TargetOf, person: PersonOf, request: OldBatteryRequest
) -> Noted:
    """Begin a change: what the old battery was is noted. Nothing is written to the device."""
    return await desk.note_old(target, request.serials.strip(), person.person)


@router.post(BATTERY + "/change/give-up", dependencies=[TECHNICIAN])
async def give_up_battery_change(desk: BatteryDeskOf, target: TargetOf) -> Nothing:
    """The old battery stays; what was noted is forgotten."""
    await desk.give_up_change(target)
    return Nothing()


@router.post(BATTERY + "/change/done", dependencies=[TECHNICIAN])
async def battery_changed(
    desk: BatteryDeskOf, target: TargetOf, person: PersonOf, journal: JournalOf, request: NewBatteryRequest
) -> ChangeRecord:
    """The new battery is in: its charge counter (3050h) is set to 0 and saved, and a record is kept."""
    return await desk.changed(target, request.serials.strip(), request.remark.strip(), person.person, journal)
