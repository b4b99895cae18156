"""The whole dictionary by FC 101: how it ends, begins anew, makes room for STOP, and what it says of a device."""

from __future__ import annotations

import asyncio

import pytest

import app.drivers.modbus
from app.drivers.contract import Written
from app.drivers.modbus import BULK
from app.drivers.modbus_backup import MAX_TIMEOUTS, read_dictionary
from app.drivers.modbus_verify import Deviation, Finding, compare
from app.errors import BusLostError, HubsideError, ModbusExceptionError, NoAnswerError, ProtocolError, SdoAbortError
from app.model.address import Address
from app.wire.modbus.adu import Message
from app.wire.modbus.answers import AbortAnswer, Answer, ExceptionAnswer, FramesRead
from app.wire.modbus.frames import ObjectFrame
from app.wire.modbus.functions import Phase
from app.wire.modbus.requests import ReadDictionary, ReadObject, WriteObject, decode_request
from app.wire.sdo import Abort
from tests.drivers.modbus_rig import CONTROLWORD, POSITION, SAVE_TUNING, STOP, WINDOW, Bad, small
from tests.drivers.modbus_server import PD4E, Dictionary, reply


async def test_a_backup_has_every_object_and_holds_the_connection() -> None:
    bad = Bad()
    async with small(bad) as (driver, _):
        backup, reading = asyncio.create_task(driver.backup(1)), asyncio.create_task(driver.read(1, WINDOW))
        assert await backup == bad.dictionary.objects
        await reading
        assert [type(request) for request in bad.seen] == [ReadDictionary] * bad.count(ReadDictionary) + [ReadObject]
        assert bad.seen[0] == ReadDictionary(Phase.START)
        assert all(request == ReadDictionary(Phase.CONTINUE) for request in bad.seen[1:-1])


class Ending(Bad):
    """Answers the third message of FC 101 with ``end``; what comes after that is "no data available"."""

    def __init__(self, end: Answer | None) -> None:
        super().__init__()
        self.end = end

    async def instead(self, message: Message, request: object) -> bytes | None:
        if not isinstance(request, ReadDictionary) or self.count(ReadDictionary) < 3 or self.end is None:
            return b"" if self.end is None and self.count(ReadDictionary) == 3 else None
        end = self.end if self.count(ReadDictionary) == 3 else AbortAnswer(Abort.NO_DATA)
        return reply(message, end)


FIRST = ObjectFrame(Address(0x1000), bytes(4))
HIGH, HIGHER = ObjectFrame(Address(0xF000), b""), ObjectFrame(Address(0xF001), b"")


@pytest.mark.parametrize(
    ("end", "error"),
    [
        (AbortAnswer(Abort.DEVICE_STATE), SdoAbortError),
        (AbortAnswer(0xFFFF1004), SdoAbortError),
        (ExceptionAnswer(101, 4), ModbusExceptionError),
        (FramesRead(Phase.CONTINUE, (FIRST,)), ProtocolError),
        (FramesRead(Phase.CONTINUE, (HIGHER, HIGH)), ProtocolError),
        (FramesRead(Phase.CONTINUE, (HIGH, HIGH)), ProtocolError),
        (FramesRead(Phase.CONTINUE, ()), ProtocolError),
        (FramesRead(Phase.START, (HIGH,)), ProtocolError),
    ],
)
async def test_only_no_data_available_ends_a_backup(end: Answer, error: type[HubsideError]) -> None:
    async with small(Ending(end)) as (driver, _):
        with pytest.raises(error):
            await driver.backup(1)


async def test_a_backup_that_has_no_data_from_the_begin_fails() -> None:
    class Empty(Bad):
        async def instead(self, message: Message, request: object) -> bytes | None:
            return reply(message, AbortAnswer(Abort.NO_DATA))

    async with small(Empty()) as (driver, _):
        with pytest.raises(SdoAbortError):
            await driver.backup(1)


async def test_a_backup_begins_anew_after_a_time_out() -> None:
    ending = Ending(None)
    async with small(ending) as (driver, _):
        assert await read_dictionary(driver._device(1), timeout_s=1.0) == ending.dictionary.objects
        starts = [number for number, request in enumerate(ending.seen) if request == ReadDictionary(Phase.START)]
        assert starts == [0, 3]


async def test_a_backup_of_a_device_that_falls_silent_fails() -> None:
    class Dumb(Bad):
        async def instead(self, message: Message, request: object) -> bytes | None:
            return b""

    dumb = Dumb()
    async with small(dumb) as (driver, _):
        with pytest.raises(NoAnswerError):
            await read_dictionary(driver._device(1), timeout_s=0.02)
        assert dumb.seen == [ReadDictionary(Phase.START)] * MAX_TIMEOUTS


async def test_a_long_list_is_read_in_bulk_and_the_rest_one_by_one() -> None:
    bad = Bad()
    described = [entry.address for entry in PD4E if entry.access.readable]
    wanted = [*described[: BULK - 1], Address(0x2FFF)]
    async with small(bad) as (driver, _):
        results = await driver.read_many(1, wanted)
        assert list(results) == wanted
        assert isinstance(results.pop(Address(0x2FFF)), SdoAbortError)
        assert results == {address: bad.dictionary.objects[address] for address in wanted[:-1]}
        assert bad.count(ReadDictionary) > 1
        assert {each.address for each in bad.seen if isinstance(each, ReadObject)} == {Address(0x2FFF)}


async def test_a_device_without_fc_101_is_read_one_by_one() -> None:
    class Without(Bad):
        async def instead(self, message: Message, request: object) -> bytes | None:
            return reply(message, ExceptionAnswer(101, 1)) if isinstance(request, ReadDictionary) else None

    bad = Without()
    wanted = [entry.address for entry in PD4E if entry.access.readable][:BULK]
    async with small(bad) as (driver, _):
        for _ in range(2):
            assert await driver.read_many(1, wanted) == {address: bad.dictionary.objects[address] for address in wanted}
        assert bad.count(ReadDictionary) == 1  # it is remembered


async def test_a_device_that_answers_fc_101_with_nonsense_is_read_one_by_one_on_a_new_connection() -> None:
    class Nonsense(Bad):
        async def instead(self, message: Message, request: object) -> bytes | None:
            nonsense = message._replace(pdu=message.pdu + b"\7")
            return nonsense.encode() if isinstance(request, ReadDictionary) else None

    bad = Nonsense()
    wanted = [entry.address for entry in PD4E if entry.access.readable][:BULK]
    async with small(bad) as (driver, server):
        for _ in range(2):
            assert await driver.read_many(1, wanted) == {address: bad.dictionary.objects[address] for address in wanted}
        assert (bad.count(ReadDictionary), server.connections) == (1, 2)
        await driver.close()
        await driver.connect()
        await driver.read_many(1, wanted)
        assert bad.count(ReadDictionary) == 2  # it may be another device by now


async def test_a_device_that_is_busy_is_asked_for_its_dictionary_again() -> None:
    class BusyOnce(Bad):
        async def instead(self, message: Message, request: object) -> bytes | None:
            return reply(message, AbortAnswer(Abort.DEVICE_STATE)) if self.seen == [request] else None

    bad = BusyOnce()
    wanted = [entry.address for entry in PD4E if entry.access.readable][:BULK]
    async with small(bad) as (driver, _):
        for _ in range(2):
            assert await driver.read_many(1, wanted) == {address: bad.dictionary.objects[address] for address in wanted}
        assert bad.count(ReadDictionary) > 2


async def test_a_backup_makes_room_for_a_stop_and_begins_anew() -> None:
    stops: list[asyncio.Task[Written]] = []

    class Stopping(Bad):
        async def instead(self, message: Message, request: object) -> bytes | None:
            if isinstance(request, ReadDictionary) and self.count(ReadDictionary) == 3:
                stops.append(asyncio.create_task(driver.write(1, CONTROLWORD, STOP, urgent=True)))
                await asyncio.sleep(0)
            return None

    stopping = Stopping()
    async with small(stopping) as (driver, _):
        found = await driver.backup(1)
        assert await stops[0] is Written.ACKNOWLEDGED
        assert found == stopping.dictionary.objects
        kinds = [request for request in stopping.seen if isinstance(request, ReadDictionary | WriteObject)]
        assert [type(request) for request in kinds[:5]] == [
            ReadDictionary, ReadDictionary, ReadDictionary, WriteObject, ReadDictionary,
        ]  # fmt: skip
        assert kinds[4] == ReadDictionary(Phase.START)


class EndsEarly(Bad):
    """Says that there is no more data after ``messages`` messages of FC 101."""

    def __init__(self, messages: int) -> None:
        super().__init__()
        self.messages = messages

    async def instead(self, message: Message, request: object) -> bytes | None:
        if not isinstance(request, ReadDictionary):
            return None
        given = sum(one == ReadDictionary(Phase.CONTINUE) for one in self.seen)
        return reply(message, AbortAnswer(Abort.NO_DATA)) if given >= self.messages else None


async def test_a_backup_that_ends_before_the_last_described_object_is_not_taken_for_the_whole() -> None:
    early = EndsEarly(messages=2)
    async with small(early) as (driver, _):
        with pytest.raises(ProtocolError, match="ended early") as caught:
            await driver.backup(1)
        assert caught.value.details["ended_early"] is True


async def test_what_a_sweep_that_ended_early_left_out_is_read_one_by_one() -> None:
    early = EndsEarly(messages=2)
    wanted = [entry.address for entry in PD4E if entry.access.readable]
    async with small(early) as (driver, _):
        assert await driver.read_many(1, wanted) == {address: early.dictionary.objects[address] for address in wanted}
        sweeps = early.count(ReadDictionary)
        await driver.read_many(1, wanted)
        assert early.count(ReadDictionary) == sweeps  # it is remembered


async def test_a_backup_may_end_before_objects_that_the_device_does_not_have() -> None:
    dictionary = Dictionary()
    for address in [one for one in dictionary.objects if one.major > 0x6000]:
        del dictionary.objects[address]
    async with small(Bad(dictionary)) as (driver, _):
        assert await driver.backup(1) == dictionary.objects


class HangsUp(Bad):
    """Ends the connection where it is asked by FC 101, and gives nobody another one where ``for_good``."""

    async def __call__(self, message: Message, writer: asyncio.StreamWriter) -> None:
        if isinstance(decode_request(message.pdu), ReadDictionary):
            self.seen.append(decode_request(message.pdu))
            writer.transport.abort()
            self.hung_up()
            return
        await super().__call__(message, writer)

    def hung_up(self) -> None:
        """Called then."""


async def test_a_device_that_hangs_up_on_fc_101_is_read_one_by_one_on_a_new_connection() -> None:
    bad = HangsUp()
    wanted = [entry.address for entry in PD4E if entry.access.readable][:BULK]
    async with small(bad) as (driver, server):
        for _ in range(2):
            assert await driver.read_many(1, wanted) == {address: bad.dictionary.objects[address] for address in wanted}
        assert (bad.count(ReadDictionary), server.connections) == (1, 2)


async def test_a_device_that_hangs_up_for_good_ends_a_long_list_by_a_clear_error(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(app.drivers.modbus, "_RETURN_S", 0.2)
    bad = HangsUp()
    wanted = [entry.address for entry in PD4E if entry.access.readable][:BULK]
    async with small(bad) as (driver, server):
        listening = server._server
        assert listening is not None
        monkeypatch.setattr(bad, "hung_up", listening.close)
        with pytest.raises(BusLostError, match="FC 101") as caught:
            await driver.read_many(1, wanted)
        assert caught.value.details["node"] == 1


# -- what the device really has ------------------------------------------------------------


async def test_a_device_as_described_has_no_deviation() -> None:
    values = {command.address: 1 for command in (*PD4E.save, *PD4E.load)}
    async with small(Bad(Dictionary(values=values))) as (driver, _):
        assert [each for each in await driver.verify(1) if each.deviation is not Deviation.SUBS] == []


def test_every_deviation_is_found() -> None:
    as_described = Dictionary(values={c.address: 1 for c in (*PD4E.save, *PD4E.load)}).objects
    before = set(compare(PD4E, as_described))
    device = dict(as_described)
    device[Address(0x1010, 0)] = b"\x02"
    device[SAVE_TUNING] = bytes(4)
    device[WINDOW] = b"\0\0"
    device[Address(0x5000, 1)] = b"\7"
    device[Address(0x0021, 1)] = b"\7\0"  # a data type
    device[Address(0x3502, 1)] = (0x60400020).to_bytes(4, "little")
    device[Address(0x3602, 2)] = (0x50000108).to_bytes(4, "little")
    del device[POSITION]
    assert set(compare(PD4E, device)) - before == {
        Finding(Address(0x1010, 0), Deviation.SUBS, 13, 2),
        Finding(SAVE_TUNING, Deviation.NOT_READY, 1, 0),
        Finding(WINDOW, Deviation.SIZE, 4, 2),
        Finding(Address(0x5000, 1), Deviation.EXTRA, None, 1),
        Finding(POSITION, Deviation.MISSING, 4, None),
        Finding(Address(0x3502, 1), Deviation.MAPPING, 16, 32),
        Finding(Address(0x3602, 2), Deviation.MAPPING, None, 8),
    }
