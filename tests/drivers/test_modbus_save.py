"""Saving by categories, and restarting: only at standstill, with a stamp, and known to have happened."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone

import pytest

from app.drivers.contract import Written
from app.drivers.modbus_save import SPEED, Stamp
from app.errors import NoAnswerError, PreconditionError, SdoAbortError, UnverifiedError, UsageError
from app.model.address import Address
from app.wire.modbus.adu import Message
from app.wire.modbus.answers import AbortAnswer, ObjectRead
from app.wire.modbus.requests import ReadObject, WriteObject
from app.wire.sdo import Abort
from tests.drivers.modbus_rig import (
    CONTROLWORD,
    FOUR,
    GO,
    MOMENT,
    PATIENCE_S,
    READY_TO_SWITCH_ON,
    SAVE_TUNING,
    STATUSWORD,
    STOP,
    TARGET,
    UPTIME,
    WINDOW,
    Bad,
    mapped,
    small,
    turns_of_the_loop,
)
from tests.drivers.modbus_server import PD4E, Dictionary, Server, reply


@pytest.mark.parametrize(
    ("moment", "stamp"),
    [
        (datetime(1984, 1, 1, tzinfo=UTC), Stamp(0, 0)),
        (datetime(2024, 1, 1, tzinfo=UTC), Stamp(14_610, 0)),
        (MOMENT, Stamp(15_667, ((9 * 60 + 30) * 60 + 15) * 1000 + 250)),
        (datetime(2026, 11, 23, 0, 30, tzinfo=timezone(timedelta(hours=1))), Stamp(15_666, (23 * 60 + 30) * 60_000)),
    ],
)
def test_stamps(moment: datetime, stamp: Stamp) -> None:
    assert Stamp.of(moment) == stamp


class Saving(Bad):
    """Says that it saves for ``polls`` readings of its entry; then it is ready again."""

    def __init__(self, polls: int, ready: int = 1, **values: int) -> None:
        speeds = {Address(0x6044): values.get("velocity", 0), Address(0x606C): values.get("speed", 0)}
        status = {STATUSWORD: values.get("status", READY_TO_SWITCH_ON)}
        super().__init__(Dictionary(values={**status, **speeds, SAVE_TUNING: ready}))
        self.polls = polls

    async def instead(self, message: Message, request: object) -> bytes | None:
        if isinstance(request, ReadObject) and request.address == SAVE_TUNING and self.saves:
            self.polls -= 1
            return reply(message, ObjectRead(SAVE_TUNING, b"save" if self.polls >= 0 else b"\1\0\0\0"))
        return None

    @property
    def saves(self) -> list[bytes]:
        return [data for address, data in self.dictionary.written if address == SAVE_TUNING]


async def test_a_save_bears_its_stamp_and_waits_until_it_has_ended() -> None:
    saving = Saving(polls=3)
    async with small(saving, now=MOMENT) as (driver, _):
        stamp = await driver.save(1, "tuning")
        assert stamp == Stamp.of(MOMENT)
        assert saving.polls == -1
        assert [address for address, _ in saving.dictionary.written] == [
            Address(0x1020, 1), Address(0x1020, 2), SAVE_TUNING,
        ]  # fmt: skip
        assert saving.saves == [b"save"]
        assert await driver.bears(1, stamp)
        assert not await driver.bears(1, stamp._replace(ms=0))


@pytest.mark.parametrize(
    ("saving", "address"),
    [
        (Saving(0, velocity=-3), "6044"),
        (Saving(0, speed=1), "606C"),
        (Saving(0, status=0x0637), "6041"),
        (Saving(0, status=0x0617), "6041"),
        (Saving(0, ready=0), SAVE_TUNING.short),
    ],
)
async def test_nothing_is_saved_while_the_axis_is_live_or_the_entry_is_not_ready(saving: Saving, address: str) -> None:
    async with small(saving) as (driver, _):
        with pytest.raises(PreconditionError) as caught:
            await driver.save(1, "tuning")
        assert caught.value.details["address"] == address
        assert saving.dictionary.written == []


async def test_an_axis_that_is_started_meanwhile_is_not_saved() -> None:
    class Starting(Saving):
        async def instead(self, message: Message, request: object) -> bytes | None:
            if isinstance(request, WriteObject) and request.address == Address(0x1020, 2):
                self.dictionary.objects[STATUSWORD] = (0x0637).to_bytes(2, "little")
            return await super().instead(message, request)

    starting = Starting(0)
    async with small(starting) as (driver, _):
        with pytest.raises(PreconditionError):
            await driver.save(1, "tuning")
        assert starting.saves == []


class AtLastLook(Saving):
    """``then`` is called while the last standstill is being read, right before the save order."""

    def __init__(self, then: Callable[[], None], polls: int = 0) -> None:
        super().__init__(polls)
        self.then = then
        self.looks = 0

    async def instead(self, message: Message, request: object) -> bytes | None:
        if isinstance(request, ReadObject) and request.address == SPEED:
            self.looks += 1
            if self.looks == 2:
                self.then()
                await turns_of_the_loop()
        return await super().instead(message, request)


async def test_a_write_that_waits_behind_the_last_look_at_the_standstill_starts_no_motor() -> None:
    going: list[asyncio.Task[Written]] = []

    def go() -> None:
        going.append(asyncio.create_task(driver.write(1, CONTROLWORD, GO)))

    saving = AtLastLook(go, polls=2)
    async with small(saving) as (driver, _):
        await driver.save(1, "tuning")
        with pytest.raises(PreconditionError) as caught:
            await going[0]
        assert caught.value.details["address"] == CONTROLWORD.short
        assert CONTROLWORD not in [address for address, _ in saving.dictionary.written]
        assert saving.saves == [b"save"]


async def test_a_stop_at_the_last_look_goes_before_the_save_and_the_look_is_taken_again() -> None:
    stopping: list[asyncio.Task[Written]] = []

    def stop() -> None:
        stopping.append(asyncio.create_task(driver.write(1, CONTROLWORD, STOP, urgent=True)))

    saving = AtLastLook(stop)
    async with small(saving) as (driver, _):
        await driver.save(1, "tuning")
        assert await stopping[0] is Written.ACKNOWLEDGED
        asked = [each.address for each in saving.seen if isinstance(each, ReadObject | WriteObject)]
        stopped = asked.index(CONTROLWORD)
        assert asked[stopped : stopped + 5] == [CONTROLWORD, STATUSWORD, Address(0x6044), SPEED, SAVE_TUNING]
        assert saving.saves == [b"save"]


async def test_until_the_save_has_ended_nothing_but_what_is_urgent_can_move_the_axis() -> None:
    class Held(Saving):
        def __init__(self) -> None:
            super().__init__(polls=1)
            self.polled, self.release = asyncio.Event(), asyncio.Event()
            for address, data in mapped().dictionary.objects.items():
                if address.major in (0x3502, 0x3602):
                    self.dictionary.objects[address] = data

        async def instead(self, message: Message, request: object) -> bytes | None:
            if isinstance(request, ReadObject) and request.address == SAVE_TUNING and self.saves:
                self.polled.set()
                self.polls = 0 if self.release.is_set() else 1
            return await super().instead(message, request)

    held = Held()
    async with small(held) as (driver, _):
        saving = asyncio.create_task(driver.save(1, "tuning"))
        await asyncio.wait_for(held.polled.wait(), PATIENCE_S)
        with pytest.raises(PreconditionError):
            await driver.write(1, TARGET, bytes(4))
        with pytest.raises(PreconditionError):
            await driver.process_data(1).exchange({CONTROLWORD: GO})
        assert await driver.process_data(1).exchange()
        assert await driver.write(1, WINDOW, FOUR) is Written.ACKNOWLEDGED
        assert await driver.write(1, CONTROLWORD, STOP, urgent=True) is Written.ACKNOWLEDGED
        held.release.set()
        await saving
        assert await driver.write(1, CONTROLWORD, GO) is Written.ACKNOWLEDGED
        assert [data for address, data in held.dictionary.written if address == CONTROLWORD] == [STOP, GO]


class Busy(Saving):
    """Once it was told to save, its entry is refused so often."""

    def __init__(self, refusals: int) -> None:
        super().__init__(0)
        self.refusals = refusals

    async def instead(self, message: Message, request: object) -> bytes | None:
        if isinstance(request, ReadObject) and request.address == SAVE_TUNING and self.saves:
            self.refusals -= 1
            if self.refusals >= 0:
                return reply(message, AbortAnswer(Abort.DEVICE_STATE))
        return await super().instead(message, request)


async def test_a_device_that_refuses_to_be_asked_while_it_saves_has_not_refused_the_save() -> None:
    busy = Busy(refusals=3)
    async with small(busy) as (driver, _):
        await driver.save(1, "tuning")
        assert busy.refusals == -1


async def test_a_save_whose_end_is_not_told_in_time_is_unverified() -> None:
    commands = tuple(replace(command, timeout_s=0.2) for command in PD4E.save)
    async with small(Busy(refusals=1000)) as (driver, _):
        driver.set_description(1, replace(PD4E, save=commands))
        with pytest.raises(UnverifiedError):
            await driver.save(1, "tuning")
        assert await driver.write(1, CONTROLWORD, GO) is Written.ACKNOWLEDGED


async def test_a_device_with_fewer_categories_is_not_told_to_save_one_that_it_has_not() -> None:
    saving = Saving(0)
    saving.dictionary.objects[Address(0x1010, 0)] = b"\5"
    async with small(saving) as (driver, _):
        with pytest.raises(PreconditionError):
            await driver.save(1, "tuning")
        with pytest.raises(UsageError):
            await driver.save(1, "no such category")
        assert saving.dictionary.written == []


# -- restarts ----------------------------------------------------------------------------


class Restarting(Bad):
    """A device that has run for a thousand seconds; ``way``: how it restarts when it is told to."""

    def __init__(self, way: str) -> None:
        super().__init__(Dictionary(values={UPTIME: 1000}))
        self.way = way
        self.server: Server | None = None

    async def instead(self, message: Message, request: object) -> bytes | None:
        if not isinstance(request, WriteObject) or request.data != b"boot":
            return None
        if self.way == "refuses":
            return reply(message, AbortAnswer(Abort.DEVICE_STATE))
        if self.way != "does nothing":
            self.dictionary.objects[UPTIME] = bytes(4)
        assert self.server is not None
        if self.way == "closes without a word":
            self.server.drop()
        return b"" if self.way in ("closes without a word", "says nothing") else None


@pytest.mark.parametrize("way", ["keeps the connection", "closes without a word", "says nothing"])
async def test_a_restart_is_known_by_the_uptime(way: str) -> None:
    restarting = Restarting(way)
    async with small(restarting) as (driver, server):
        restarting.server = server
        await driver.restart(1, timeout_s=PATIENCE_S)
        assert server.connections == 2
        assert restarting.count(WriteObject) == 1


async def test_a_device_that_does_not_restart_is_not_back() -> None:
    restarting = Restarting("does nothing")
    async with small(restarting) as (driver, server):
        restarting.server = server
        with pytest.raises(NoAnswerError):
            await driver.restart(1, timeout_s=2.0)


async def test_a_refused_restart_is_told_at_once() -> None:
    restarting = Restarting("refuses")
    async with small(restarting) as (driver, server):
        with pytest.raises(SdoAbortError):
            await driver.restart(1, timeout_s=PATIENCE_S)
        assert server.connections == 1
