"""Process data: registers where the device's own mapping says, in the order of words that it shows."""

from __future__ import annotations

import asyncio

import pytest

from app.drivers.contract import LinkState, Written
from app.errors import ModbusExceptionError, OvertakenError, PdoChangedError, RefusedError
from app.model.address import Address
from app.wire.modbus.adu import Message
from app.wire.modbus.answers import ExceptionAnswer
from app.wire.modbus.image import WordOrder
from app.wire.modbus.requests import ReadObject, ReadRegisters, ReadWriteRegisters
from tests.drivers.modbus_rig import (
    CONTROLWORD,
    GO,
    POSITION,
    READY_TO_SWITCH_ON,
    STATUSWORD,
    STOP,
    TARGET,
    VALUES,
    WINDOW,
    Bad,
    becomes,
    mapped,
    small,
)
from tests.drivers.modbus_server import Dictionary, reply


@pytest.mark.parametrize("order", WordOrder)
async def test_process_data_stand_where_the_device_says_in_the_order_that_it_shows(order: WordOrder) -> None:
    bad = mapped(order)
    async with small(bad) as (driver, _):
        process = driver.process_data(1)
        found = await process.exchange(VALUES)
        assert found[POSITION] == (0x00010203).to_bytes(4, "little")
        assert found[STATUSWORD] == READY_TO_SWITCH_ON.to_bytes(2, "little")
        assert {address: bad.dictionary.objects[address] for address in VALUES} == VALUES
        cyclic = [request for request in bad.seen if isinstance(request, ReadWriteRegisters)]
        assert [(each.start, each.quantity, each.write_start, len(each.registers)) for each in cyclic] == [
            (5000, 4, 6000, 4)
        ]
        before = len(bad.seen)
        assert await process.exchange() == found
        assert [type(request) for request in bad.seen[before:]] == [ReadRegisters]


async def test_until_the_order_is_known_long_values_are_read_as_objects_and_never_written() -> None:
    bad = mapped(position=0)
    async with small(bad) as (driver, _):
        process = driver.process_data(1)
        assert (await process.images()).sent.order is None
        bad.dictionary.objects[POSITION] = (0x00010203).to_bytes(4, "little")
        assert (await process.exchange())[POSITION] == (0x00010203).to_bytes(4, "little")
        with pytest.raises(RefusedError):
            await process.exchange({TARGET: (5).to_bytes(4, "little")})
        assert bad.count(ReadWriteRegisters) == 0
        await process.exchange({CONTROLWORD: b"\x06\0"})
        assert bad.dictionary.objects[CONTROLWORD] == b"\x06\0"


@pytest.mark.parametrize("order", WordOrder)
async def test_an_axis_at_zero_shows_the_order_by_what_it_takes(order: WordOrder) -> None:
    bad = mapped(order, position=0)
    bad.dictionary.objects[TARGET] = (0x00010203).to_bytes(4, "little")
    async with small(bad) as (driver, _):
        assert (await driver.process_data(1).images()).sent.order is order


async def test_a_device_that_does_not_give_what_it_takes_shows_no_order_by_it() -> None:
    class Refusing(Bad):
        async def instead(self, message: Message, request: object) -> bytes | None:
            if isinstance(request, ReadRegisters) and request.start >= 6000:
                return reply(message, ExceptionAnswer(3, 2))
            return None

    async with small(Refusing(mapped(position=0).dictionary)) as (driver, _):
        assert (await driver.process_data(1).images()).sent.order is None
        assert await driver.process_data(1).exchange()


@pytest.mark.parametrize(
    "values",
    [
        {CONTROLWORD: b"\6\0", TARGET: bytes(4)},
        {WINDOW: bytes(4)},
        {CONTROLWORD: b"\6"},
    ],
)
async def test_no_register_is_written_that_nobody_named(values: dict[Address, bytes]) -> None:
    bad = mapped()
    async with small(bad) as (driver, _):
        with pytest.raises(RefusedError):
            await driver.process_data(1).exchange(values)
        assert bad.count(ReadWriteRegisters) == 0


async def test_a_changed_mapping_is_read_anew() -> None:
    bad = mapped()
    async with small(bad) as (driver, server):
        process = driver.process_data(1)
        await process.exchange()
        await driver.write(1, Address(0x3602, 0), b"\0")
        await driver.write(1, Address(0x3602, 1), (0x60640020).to_bytes(4, "little"))
        await driver.write(1, Address(0x3602, 0), b"\1")
        assert set(await process.exchange()) == {POSITION}
        bad.dictionary.objects[Address(0x3602, 1)] = (0x60410010).to_bytes(4, "little")  # by somebody else, then
        server.drop()
        await becomes(driver, LinkState.LOST)
        await becomes(driver, LinkState.CONNECTED)
        assert set(await process.exchange()) == {STATUSWORD}


COUNT_TAKEN, COUNT_GIVEN = Address(0x3502, 0), Address(0x3602, 0)


async def test_a_mapping_that_is_changed_while_it_is_read_is_read_again() -> None:
    writing: list[asyncio.Task[Written]] = []

    class Changing(Bad):
        async def instead(self, message: Message, request: object) -> bytes | None:
            if isinstance(request, ReadObject) and request.address == COUNT_GIVEN and not writing:
                writing.append(asyncio.create_task(driver.write(1, COUNT_TAKEN, b"\1")))
                await asyncio.sleep(0)
            return None

    changing = Changing(mapped().dictionary)
    async with small(changing) as (driver, _):
        images = await driver.process_data(1).images()
        assert await writing[0] is Written.ACKNOWLEDGED
        assert set(images.received.places) == {CONTROLWORD}


class Slow(Bad):
    """Answers the reading of an object that is in no mapping as soon as it is released."""

    def __init__(self) -> None:
        super().__init__(mapped().dictionary)
        self.release = asyncio.Event()

    async def instead(self, message: Message, request: object) -> bytes | None:
        if isinstance(request, ReadObject) and request.address == WINDOW:
            await self.release.wait()
        return None


async def test_registers_are_not_written_by_a_mapping_that_was_changed_before_them() -> None:
    slow = Slow()
    async with small(slow) as (driver, _):
        process = driver.process_data(1)
        await process.images()
        reading = asyncio.create_task(driver.read(1, WINDOW))
        await asyncio.sleep(0)
        exchanging = asyncio.create_task(process.exchange(VALUES))
        await asyncio.sleep(0)
        changing = asyncio.create_task(driver.write(1, COUNT_TAKEN, b"\1"))
        await asyncio.sleep(0)
        with pytest.raises(PdoChangedError):
            await process.exchange(VALUES)
        slow.release.set()
        await asyncio.gather(reading, changing)
        with pytest.raises(PdoChangedError):
            await exchanging
        assert slow.count(ReadWriteRegisters) == 0
        await process.exchange({CONTROLWORD: b"\6\0"})
        assert slow.dictionary.objects[CONTROLWORD] == b"\6\0"


async def test_registers_are_not_written_right_after_the_write_that_changes_what_they_mean() -> None:
    slow = Slow()
    async with small(slow) as (driver, _):
        process = driver.process_data(1)
        await process.images()
        reading = asyncio.create_task(driver.read(1, WINDOW))
        await asyncio.sleep(0)
        changing = asyncio.create_task(driver.write(1, COUNT_TAKEN, b"\1"))
        exchanging = asyncio.create_task(process.exchange(VALUES))
        await asyncio.sleep(0)
        slow.release.set()
        await asyncio.gather(reading, changing)
        with pytest.raises(PdoChangedError):
            await exchanging
        assert slow.count(ReadWriteRegisters) == 0


async def test_registers_that_were_read_by_a_changed_mapping_are_read_again() -> None:
    slow = Slow()
    async with small(slow) as (driver, _):
        process = driver.process_data(1)
        assert set(await process.exchange()) > {STATUSWORD}
        reading = asyncio.create_task(driver.read(1, WINDOW))
        await asyncio.sleep(0)
        exchanging = asyncio.create_task(process.exchange())
        await asyncio.sleep(0)
        changing = asyncio.create_task(driver.write(1, COUNT_GIVEN, b"\1", urgent=True))
        await asyncio.sleep(0)
        slow.release.set()
        await asyncio.gather(reading, changing)
        assert set(await exchanging) == {STATUSWORD}


async def test_process_data_never_take_a_stop_back() -> None:
    bad = mapped()
    async with small(bad) as (driver, _):
        process = driver.process_data(1)
        known = {CONTROLWORD: driver.commanded(1, CONTROLWORD)}
        await process.exchange({CONTROLWORD: GO}, known=known)
        await driver.write(1, CONTROLWORD, STOP, urgent=True)
        with pytest.raises(OvertakenError):
            await process.exchange({CONTROLWORD: GO}, known=known)
        assert bad.dictionary.objects[CONTROLWORD] == STOP


async def test_refused_registers_are_an_error() -> None:
    class Refusing(Bad):
        async def instead(self, message: Message, request: object) -> bytes | None:
            return reply(message, ExceptionAnswer(23, 3)) if isinstance(request, ReadWriteRegisters) else None

    refusing = Refusing(mapped().dictionary)
    async with small(refusing) as (driver, _):
        with pytest.raises(ModbusExceptionError) as caught:
            await driver.process_data(1).exchange(VALUES)
        assert caught.value.details["exception"] == 3


@pytest.mark.parametrize("entries", [{}, {Address(0x3602, 1): 0x60410004}])
async def test_a_mapping_that_has_no_place_is_refused(entries: dict[Address, int]) -> None:
    count = {Address(0x3602, 0): len(entries)}
    bad = Bad(Dictionary(values={**count, **entries}))
    async with small(bad) as (driver, _):
        with pytest.raises(RefusedError):
            await driver.process_data(1).exchange()
        assert bad.count(ReadRegisters) == 0
