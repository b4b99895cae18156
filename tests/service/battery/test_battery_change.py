"""A battery is changed: the old one noted, its counter at 0, saved, a record kept; canopen's client looks on."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from dataclasses import replace

import pytest

from app.errors import BatteryCounterError, BatteryNotNotedError, BatteryUnsavedError, RefusedError
from app.model.address import Address
from app.service.battery.objects import CHARGED_TOTAL, CHARGER_STATUS, CONTROLWORD, read_number
from app.service.connection import Connection
from app.service.gate import Block, Blocks, Place
from app.service.journal import Kind
from app.store.store import Store
from app.twins.line import Fault, drop
from tests.e2e.test_interoperation import until
from tests.service.battery.rig import NODE, PMM, asks, at_the_batteries, charged, in_plant, witness, writes
from tests.service.conftest import Served

pytestmark = pytest.mark.timeout(60)

SAVE = Address(0x1010, 3)
COUNTED_MAH = 4321


@pytest.fixture
def store() -> Iterator[Store]:
    opened = Store.in_memory()
    yield opened
    opened.close()


@pytest.fixture
async def counted(served: Served, connection: Connection) -> Served:
    """The unit of blade 1, up, with a battery that was charged before."""
    target = connection.target(PMM)
    await read_number(connection.driver(target), target, CHARGED_TOTAL)
    in_plant(served, charged(0.98))
    with witness(served) as unit:
        unit.sdo[0x3050].raw = COUNTED_MAH
    await until(lambda: Kind.FOREIGN_WRITTEN in [entry.kind for entry in connection.journal.latest()])
    return served


def counter(served: Served) -> int:
    with witness(served) as unit:
        return int(unit.sdo[0x3050].raw)


async def test_the_counter_begins_at_0_and_the_record_tells_the_old_battery(
    counted: Served, connection: Connection, store: Store
) -> None:
    async with at_the_batteries(connection, store) as (desk, target):
        with pytest.raises(BatteryNotNotedError):
            await desk.changed(target, "new", "", "tester", connection.journal)
        noted = await desk.note_old(target, "old 1-6", "first")
        assert noted.figures.charged_mah == COUNTED_MAH
        assert await desk.archive.noted(PMM) == noted
        assert counter(counted) == COUNTED_MAH, "noting writes nothing"
        record = await desk.changed(target, "new 1-6", "leads renewed", "second", connection.journal)
        assert counter(counted) == record.counter_mah == 0
        assert (record.old, record.serials, record.remark, record.person) == (
            noted,
            "new 1-6",
            "leads renewed",
            "second",
        )
        assert await desk.archive.changes(PMM) == [record]
        assert await desk.archive.noted(PMM) is None
        kinds = [entry.kind for entry in connection.journal.latest() if entry.device == PMM]
        assert kinds[-3:] == [Kind.WRITTEN, Kind.SAVED, Kind.BATTERY_CHANGED]


async def test_an_unanswered_write_tells_what_the_counter_reads(
    counted: Served, connection: Connection, store: Store
) -> None:
    async with at_the_batteries(connection, store) as (desk, target):
        await desk.note_old(target, "old", "tester")
        counted.spoil(Fault(writes(CHARGED_TOTAL), drop, times=None))
        with pytest.raises(BatteryCounterError) as failed:
            await desk.changed(target, "new", "", "tester", connection.journal)
        assert failed.value.details["counter"] == COUNTED_MAH
        assert await desk.archive.changes(PMM) == []
        assert await desk.archive.noted(PMM) is not None, "the change is still under way"


async def test_a_counter_that_nobody_can_read_is_not_known(
    counted: Served, connection: Connection, store: Store
) -> None:
    async with at_the_batteries(connection, store) as (desk, target):
        await desk.note_old(target, "old", "tester")
        seen = [False]

        def from_the_write_on(can: object) -> bool:
            seen[0] = seen[0] or writes(CHARGED_TOTAL)(can)  # type: ignore[arg-type]
            return seen[0] and asks(CHARGED_TOTAL)(can)  # type: ignore[arg-type]

        counted.spoil(Fault(from_the_write_on, drop, times=None))
        with pytest.raises(BatteryCounterError) as failed:
            await desk.changed(target, "new", "", "tester", connection.journal)
        assert failed.value.details["counter"] == "–"


async def test_a_save_that_is_not_acknowledged_is_told_apart(
    counted: Served, connection: Connection, store: Store
) -> None:
    async with at_the_batteries(connection, store) as (desk, target):
        await desk.note_old(target, "old", "tester")
        description = target.description
        quick = replace(description, save=tuple(replace(one, timeout_s=0.3) for one in description.save))
        counted.spoil(Fault(writes(SAVE), drop, times=None))
        with pytest.raises(BatteryUnsavedError):
            await desk.changed(replace(target, description=quick), "new", "", "tester", connection.journal)
        assert counter(counted) == 0
        assert await desk.archive.changes(PMM) == [], "it is repeated, and recorded then"


async def test_an_open_restore_keeps_the_counter(counted: Served, connection: Connection, store: Store) -> None:
    async with at_the_batteries(connection, store) as (desk, target):
        await desk.note_old(target, "old", "tester")
        identity = await target._identity(connection.driver(target))
        adapter = connection.turbine.buses[0].connection
        connection.gate.blocks = Blocks([Block("r-1", "wtg-07/blade-1", ((Place(adapter, NODE), identity),))])
        with pytest.raises(RefusedError):
            await desk.changed(target, "new", "", "tester", connection.journal)
        assert counter(counted) == COUNTED_MAH


async def test_a_change_that_is_given_up_forgets_the_note(
    counted: Served, connection: Connection, store: Store
) -> None:
    async with at_the_batteries(connection, store) as (desk, target):
        await desk.note_old(target, "old", "tester")
        await desk.give_up_change(target)
        assert await desk.archive.noted(PMM) is None
        assert counter(counted) == COUNTED_MAH


async def test_the_charger_starts_by_hand_and_its_bit_falls_again(
    counted: Served, connection: Connection, store: Store
) -> None:
    async with at_the_batteries(connection, store) as (desk, target):
        driver = connection.driver(target)
        async with asyncio.timeout(10.0):
            while await read_number(driver, target, CHARGER_STATUS) & 2:  # noqa: ASYNC110  the device has no event for it
                await asyncio.sleep(0.1)
        await desk.charge(target, connection.journal)
        assert await read_number(driver, target, CHARGER_STATUS) & 2
        assert await read_number(driver, target, CONTROLWORD) == 0
