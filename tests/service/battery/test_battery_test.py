"""The battery test from its first command to its verdict, on real twins over a real wire (rules F12, C1, C3)."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from typing import Final

import pytest

from app.errors import BatteryArmedError, BatteryCommandError, BatteryConditionError
from app.model.address import Address
from app.service.battery import sequence as sequence_module
from app.service.battery.conditions import Condition
from app.service.battery.desk import BatteryDesk, Running
from app.service.battery.objects import CONTROLWORD, TEST_STATUS, TestStatus, read_number
from app.service.battery.records import TestRecord, Verdict
from app.service.connection import Connection
from app.service.devices import Target
from app.service.gate import Block, Blocks, Place
from app.service.journal import Kind
from app.service.motion.moves import jog
from app.store.store import Store
from app.twins.line import Fault, drop
from tests.e2e.test_interoperation import until
from tests.service.battery.rig import (
    COMMAND_TEST,
    NODE,
    PMC,
    PMM,
    asks,
    at_the_batteries,
    charged,
    in_plant,
    weakened,
    witness,
    writes,
)
from tests.service.conftest import Served
from tests.service.motion.rig import at_the_desk

pytestmark = [pytest.mark.alone, pytest.mark.timeout(120)]  # twins in real time

LONG_S: Final = 40.0
COURSE_S: Final = 9.0
"""The twins load the battery for ten seconds."""


@pytest.fixture
def store() -> Iterator[Store]:
    opened = Store.in_memory()
    yield opened
    opened.close()


async def ended(running: Running) -> TestRecord:
    async with asyncio.timeout(LONG_S):
        return await running.task


async def begin(desk: BatteryDesk, target: Target, connection: Connection) -> Running:
    return await desk.test(target, "tester", connection.journal)


async def held_back(desk: BatteryDesk, target: Target) -> set[Condition]:
    return {need.condition for need in await desk.needs(target) if need.holds_back}


async def word(connection: Connection, target: Target, address: Address = CONTROLWORD) -> int:
    return await read_number(connection.driver(target), target, address)


async def test_a_sound_battery_passes_and_its_record_is_kept(
    served: Served, connection: Connection, store: Store
) -> None:
    in_plant(served, charged(0.98))
    async with at_the_batteries(connection, store) as (desk, target):
        assert await held_back(desk, target) == set()
        running = await begin(desk, target, connection)
        with pytest.raises(BatteryConditionError):
            await begin(desk, target, connection)
        assert Condition.NO_TEST in await held_back(desk, target)
        record = await ended(running)
        assert record.verdict is Verdict.PASSED
        assert record.took_ms > COURSE_S * 1000
        assert len(record.course) > 20
        loaded = [one for one in record.course if (one.current_ma or 0) > 0]
        assert loaded, "the battery discharges while it is tested"
        assert record.lowest_v == min(one.lowest_v or 999 for one in record.course)
        assert 200 < (record.lowest_v or 0) < (record.before.off_load_v or 0)
        assert all(len(one.blocs_mv) == 6 for one in record.course)
        assert [one.t_ms for one in record.course] == sorted(one.t_ms for one in record.course)
        assert not await word(connection, target) & COMMAND_TEST, "the bit is 0 again"
        assert await word(connection, target, TEST_STATUS) == TestStatus.OK | TestStatus.FINISHED
        assert await desk.archive.tests(PMM) == [record]
        kinds = [entry.kind for entry in connection.journal.latest() if entry.device == PMM]
        assert kinds.count(Kind.BATTERY_TEST_BEGUN) == kinds.count(Kind.BATTERY_TEST_ENDED) == 1
        assert desk.running(target) is None


async def test_a_weak_battery_fails_with_its_lowest_voltage(
    served: Served, connection: Connection, store: Store
) -> None:
    in_plant(served, charged(0.98))
    in_plant(served, weakened)
    async with at_the_batteries(connection, store) as (desk, target):
        record = await ended(await begin(desk, target, connection))
        assert record.verdict is Verdict.FAILED
        assert record.took_ms < COURSE_S * 1000
        weakest = min(range(6), key=lambda place: min(one.blocs_mv[place] or 99_999 for one in record.course))
        assert weakest == 3, "the course tells which bloc it is"
        assert await word(connection, target, TEST_STATUS) & TestStatus.ERROR


async def test_a_discharged_battery_is_held_back_and_the_drive_is_asked_nothing(
    served: Served, connection: Connection, store: Store
) -> None:
    in_plant(served, charged(0.5))
    async with at_the_batteries(connection, store) as (desk, target):
        assert await held_back(desk, target) == {Condition.CHARGED}
        with pytest.raises(BatteryConditionError) as refused:
            await begin(desk, target, connection)
        assert refused.value.details["condition"] == "charged"
        with witness(served) as unit:
            assert unit.sdo[0x3005].raw == 0
            assert unit.sdo[0x3040].raw == 0
        assert await desk.archive.tests(PMM) == []


async def test_what_the_drive_itself_refuses_is_a_verdict(served: Served, connection: Connection, store: Store) -> None:
    in_plant(served, charged(0.85))
    async with at_the_batteries(connection, store) as (desk, target):
        record = await ended(await begin(desk, target, connection))
        assert (record.verdict, record.lowest_v) == (Verdict.REFUSED, None)
        assert await word(connection, target, TEST_STATUS) == TestStatus.IMPOSSIBLE


async def test_it_is_refused_while_the_blade_is_moved_from_here(
    served: Served, connection: Connection, store: Store
) -> None:
    in_plant(served, charged(0.98))
    async with at_the_desk(connection) as (motion, page):
        page.hold()
        await motion.prepare(PMC, page.fence)
        page.let_go()
        page.hold()
        moving = asyncio.create_task(jog(motion, PMC, page.fence, -3.0, connection.journal))
        await until(lambda: motion.running is not None and motion.running.turning)
        async with at_the_batteries(connection, store) as (desk, target):
            desk._motion = motion
            async with asyncio.timeout(10.0):
                while Condition.STANDS not in await held_back(desk, target):
                    pass
            assert await held_back(desk, target) == {Condition.STANDS, Condition.NOBODY_MOVES}
            with pytest.raises(BatteryConditionError):
                await begin(desk, target, connection)
        page.let_go()
        await moving


async def test_it_is_refused_while_a_restore_is_open(served: Served, connection: Connection, store: Store) -> None:
    in_plant(served, charged(0.98))
    async with at_the_batteries(connection, store) as (desk, target):
        identity = await target._identity(connection.driver(target))
        adapter = connection.turbine.buses[0].connection
        connection.gate.blocks = Blocks([Block("r-1", "wtg-07/blade-1", ((Place(adapter, NODE), identity),))])
        assert await held_back(desk, target) == {Condition.NO_RESTORE}
        with pytest.raises(BatteryConditionError):
            await begin(desk, target, connection)


async def test_who_cancels_leaves_the_bit_cleared_and_the_drive_to_its_end(
    served: Served, connection: Connection, store: Store
) -> None:
    in_plant(served, charged(0.98))
    async with at_the_batteries(connection, store) as (desk, target):
        running = await begin(desk, target, connection)
        desk.cancel(target)
        record = await ended(running)
        assert record.verdict is Verdict.UNWATCHED
        assert not await word(connection, target) & COMMAND_TEST
        assert Condition.NO_TEST in await held_back(desk, target), "the drive goes on by itself"
        async with asyncio.timeout(LONG_S):
            while await word(connection, target, TEST_STATUS) & TestStatus.ACTIVE:  # noqa: ASYNC110  a device tells no event
                await asyncio.sleep(0.1)
        assert await word(connection, target, TEST_STATUS) & TestStatus.OK


async def test_a_link_that_is_lost_for_a_moment_does_not_end_it(
    served: Served, connection: Connection, store: Store
) -> None:
    in_plant(served, charged(0.98))
    async with at_the_batteries(connection, store) as (desk, target):
        running = await begin(desk, target, connection)
        await until(lambda: len(running.sequence.course) > 3)
        served.cut()
        record = await ended(running)
        assert record.verdict is Verdict.PASSED


async def test_a_unit_that_is_silent_for_long_is_lost(
    served: Served, connection: Connection, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sequence_module, "LOST_S", 1.5)
    in_plant(served, charged(0.98))
    async with at_the_batteries(connection, store) as (desk, target):
        running = await begin(desk, target, connection)
        await until(lambda: len(running.sequence.course) > 3)
        fault = Fault(lambda can: can.can_id == 0x600 + NODE, drop, times=None)
        served.spoil(fault)
        record = await ended(running)
        assert record.verdict is Verdict.LOST
        assert len(record.course) > 3, "what was measured until then is kept"
        assert (record.lowest_v, record.after.charge_percent) == (None, None)


async def test_an_answer_that_is_lost_is_told_by_the_effect(
    served: Served, connection: Connection, store: Store
) -> None:
    in_plant(served, charged(0.98))
    async with at_the_batteries(connection, store) as (desk, target):
        named = answers_once(writes(CONTROLWORD))
        served.spoil(Fault(named, drop, times=1))
        record = await ended(await begin(desk, target, connection))
        assert record.verdict is Verdict.PASSED


def answers_once(asked: Callable[..., bool]) -> Callable[..., bool]:
    """The first answer after such a request."""
    seen = [False]

    def takes(can: object) -> bool:
        seen[0] = seen[0] or asked(can)
        return seen[0] and can.can_id == 0x580 + NODE  # type: ignore[attr-defined]

    return takes


async def test_a_command_that_never_comes_through_leaves_nothing_armed(
    served: Served, connection: Connection, store: Store
) -> None:
    in_plant(served, charged(0.98))
    async with at_the_batteries(connection, store) as (desk, target):
        served.spoil(Fault(writes(CONTROLWORD), drop, times=1))
        with pytest.raises(BatteryCommandError):
            await begin(desk, target, connection)
        with witness(served) as unit:
            assert (unit.sdo[0x3040].raw, unit.sdo[0x3005].raw) == (0, 0)


async def test_a_test_that_stayed_armed_goes_on_from_there(
    served: Served, connection: Connection, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The link is lost between both edges: what stays is told, and the next test begins with the second edge."""
    monkeypatch.setattr(sequence_module, "LOST_S", 1.0)
    in_plant(served, charged(0.98))
    async with at_the_batteries(connection, store) as (desk, target):
        armed = after(asks(CONTROLWORD), writes(CONTROLWORD))
        fault = Fault(armed, drop, times=None)
        served.spoil(fault)
        with pytest.raises(BatteryArmedError):
            await begin(desk, target, connection)
        served.thread.call_soon(lambda: served.line.withdraw(fault))
        with witness(served) as unit:
            assert (unit.sdo[0x3040].raw, unit.sdo[0x3005].raw) == (COMMAND_TEST, TestStatus.STARTED)
        record = await ended(await begin(desk, target, connection))
        assert record.verdict is Verdict.PASSED


def after(dropped: Callable[..., bool], once: Callable[..., bool]) -> Callable[..., bool]:
    """Every frame that ``dropped`` takes, once ``once`` has seen one."""
    seen = [False]

    def takes(can: object) -> bool:
        if seen[0]:
            return dropped(can)
        seen[0] = once(can)
        return False

    return takes
