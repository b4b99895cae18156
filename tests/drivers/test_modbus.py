"""The Modbus TCP driver: the contract against a twin, and what it does where a device does what it should not."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from datetime import UTC, datetime, timedelta, timezone

import pytest

from app.drivers.contract import Driver, LinkState, Written
from app.drivers.modbus import BULK, ModbusDriver
from app.drivers.modbus_backup import MAX_TIMEOUTS, read_dictionary
from app.drivers.modbus_config import ModbusConfig, ModbusPeer, parse_modbus
from app.drivers.modbus_save import Stamp
from app.drivers.modbus_verify import Deviation, Finding, compare
from app.drivers.table import driver_class
from app.errors import (
    BusLostError,
    BusOpenError,
    HubsideError,
    ModbusExceptionError,
    NoAnswerError,
    OvertakenError,
    PreconditionError,
    ProtocolError,
    RefusedError,
    SdoAbortError,
    UnverifiedError,
    UsageError,
)
from app.model.address import Address
from app.model.description import Bus, Verify
from app.model.texts import error_text, load_texts
from app.twins.paced_thread import PacedThread
from app.twins.pd4e.device import BOOT_NS, Pd4e, Settings
from app.twins.pd4e.server import Pd4eServer
from app.wire.frame import Frame
from app.wire.modbus.adu import Message
from app.wire.modbus.answers import (
    AbortAnswer,
    Answer,
    ExceptionAnswer,
    FramesRead,
    ObjectRead,
    ObjectWritten,
)
from app.wire.modbus.decoder import ModbusDecoder
from app.wire.modbus.frames import ObjectFrame
from app.wire.modbus.functions import Phase
from app.wire.modbus.image import WordOrder
from app.wire.modbus.requests import (
    ReadDictionary,
    ReadObject,
    ReadRegisters,
    ReadWriteRegisters,
    WriteObject,
    decode_request,
)
from app.wire.records import RestartSeen
from app.wire.sdo import Abort
from tests.drivers.contract_suite import Bench, DriverContract
from tests.drivers.modbus_server import PD4E, Dictionary, Server, reply, serving
from tests.drivers.wire import stamper

CONTROLWORD, STATUSWORD, MODE = Address(0x6040), Address(0x6041), Address(0x6060)
UPTIME, WINDOW = Address(0x230F), Address(0x6065)
TARGET, POSITION = Address(0x607A), Address(0x6064)
ERROR_HISTORY = 0x1003
READY_TO_SWITCH_ON = 0x0231
PATIENCE_S = 10.0


@contextmanager
def twin(variant: str = "pd4-e591") -> Iterator[ModbusPeer]:
    """A twin in real time, that has booted."""
    device = Pd4e(PD4E, Settings(variant=variant))
    device.run_until(BOOT_NS)
    thread = PacedThread(device, time.monotonic_ns)
    with thread, Pd4eServer(thread, device, port=0) as server:
        yield ModbusPeer(1, "127.0.0.1", server.port)
    assert thread.handler_errors == 0


@asynccontextmanager
async def connected(*peers: ModbusPeer, now: datetime | None = None) -> AsyncIterator[ModbusDriver]:
    config = ModbusConfig(peers)
    if now is None:
        driver = ModbusDriver(config, stamper(), descriptions=(PD4E,))
    else:
        driver = ModbusDriver(config, stamper(), descriptions=(PD4E,), now=lambda: now)
    await driver.connect()
    try:
        yield driver
    finally:
        await driver.close()


async def no_answer(message: Message, writer: asyncio.StreamWriter) -> None:
    """A device that takes everything and says nothing."""


class TestContract(DriverContract):
    @pytest.fixture
    async def bench(self) -> AsyncIterator[Bench]:
        with twin() as peer:
            async with serving(no_answer) as silent, connected(peer, silent.peer._replace(node=2)) as driver:
                yield Bench(
                    driver=driver,
                    node=1,
                    absent_node=2,
                    readable=tuple(
                        entry.address
                        for entry in PD4E
                        if entry.access.readable and entry.address.major not in (ERROR_HISTORY, 0x230F)
                    )[:40],
                    writable=WINDOW,
                    first=(100).to_bytes(4, "little"),
                    second=(200).to_bytes(4, "little"),
                    read_only=POSITION,
                    read_only_data=bytes(4),
                    unknown=Address(0x2FFF),
                )


def test_the_table_knows_the_driver() -> None:
    assert driver_class(Bus.MODBUS_TCP) is ModbusDriver
    kept_to: Driver = ModbusDriver(parse_modbus("127.0.0.1:1502"), stamper())
    assert kept_to.status.state is LinkState.CLOSED


# -- a device as small as can be ------------------------------------------------------


class Bad:
    """A dictionary whose answers can be held back or changed: ``instead`` gives the bytes to send, None for its own."""

    def __init__(self, dictionary: Dictionary | None = None) -> None:
        self.dictionary = dictionary or Dictionary(values={STATUSWORD: READY_TO_SWITCH_ON})
        self.seen: list[object] = []

    async def __call__(self, message: Message, writer: asyncio.StreamWriter) -> None:
        request = decode_request(message.pdu)
        self.seen.append(request)
        data = await self.instead(message, request)
        writer.write(reply(message, self.dictionary.answer(message)) if data is None else data)

    async def instead(self, message: Message, request: object) -> bytes | None:
        return None

    def count(self, kind: type) -> int:
        return sum(isinstance(request, kind) for request in self.seen)


@asynccontextmanager
async def small(bad: Bad, now: datetime | None = None) -> AsyncIterator[tuple[ModbusDriver, Server]]:
    async with serving(bad) as server, connected(server.peer, now=now) as driver:
        yield driver, server


async def test_a_wrong_size_is_tried_otherwise() -> None:
    """A device of another firmware may have another type; a wrong count is refused by 06070012h (page 110)."""
    bad = Bad()
    bad.dictionary.objects[WINDOW] = b"\x07\x00"
    async with small(bad) as (driver, _):
        assert await driver.read(1, WINDOW) == b"\x07\x00"
        assert [each.size for each in bad.seen if isinstance(each, ReadObject)] == [4, 2]


@pytest.mark.parametrize("length", [1, 3, 4, 18, 100, 240, 241])
async def test_the_length_of_a_text_is_found(length: int) -> None:
    """A device that gives a text only where exactly its length is asked for."""
    text = bytes(range(length))

    class Strict(Bad):
        async def instead(self, message: Message, request: object) -> bytes | None:
            assert isinstance(request, ReadObject)
            if request.size == length:
                return reply(message, ObjectRead(request.address, text))
            code = Abort.LENGTH_TOO_HIGH if request.size > length else Abort.LENGTH_TOO_LOW
            return reply(message, AbortAnswer(code))

    strict = Strict()
    async with small(strict) as (driver, _):
        assert await driver.read(1, Address(0x1008)) == text
        assert len(strict.seen) <= 13


async def test_a_size_that_is_not_found_is_the_refusal_of_the_device() -> None:
    class Odd(Bad):
        async def instead(self, message: Message, request: object) -> bytes | None:
            return reply(message, AbortAnswer(Abort.LENGTH))

    odd = Odd()
    async with small(odd) as (driver, _):
        with pytest.raises(SdoAbortError) as caught:
            await driver.read(1, Address(0x1008))
        assert caught.value.abort_code == Abort.LENGTH
        assert len(odd.seen) == 5


async def test_a_refusal_names_the_object_and_the_state_of_the_device() -> None:
    async with small(Bad()) as (driver, _):
        with pytest.raises(SdoAbortError) as caught:
            await driver.write(1, POSITION, bytes(4))
        details = caught.value.details
        assert (details["abort_code"], details["address"]) == (Abort.READ_ONLY, str(POSITION))
        assert details["name"] == PD4E.entry(POSITION).title
        assert details["state_key"] == "axis_state.ready_to_switch_on"
        texts = load_texts("en")
        assert texts(details["state_key"]) != details["state_key"]
        assert "6064" in error_text(texts, caught.value)


async def test_an_exception_is_told_in_words() -> None:
    class Refusing(Bad):
        async def instead(self, message: Message, request: object) -> bytes | None:
            return reply(message, ExceptionAnswer(43, 4))

    async with small(Refusing()) as (driver, _):
        with pytest.raises(ModbusExceptionError) as caught:
            await driver.read(1, WINDOW)
        assert (caught.value.details["exception"], caught.value.details["function"]) == (4, 43)
        for language in ("en", "de"):
            assert "4)" in error_text(load_texts(language), caught.value)


# -- writes without a clear end ----------------------------------------------------------


class Silent(Bad):
    """Answers no write; ``late`` says what comes with the next answer instead, ``done`` whether it was carried out."""

    def __init__(self, late: Answer | None, done: bool) -> None:
        super().__init__()
        self.late = late
        self.done = done
        self._owed = b""

    async def instead(self, message: Message, request: object) -> bytes | None:
        if isinstance(request, WriteObject):
            if self.done:
                self.dictionary.answer(message)
            self._owed = b"" if self.late is None else reply(message, self.late)
            return b""
        owed, self._owed = self._owed, b""
        return owed + reply(message, self.dictionary.answer(message)) if owed else None


FOUR = (4).to_bytes(4, "little")


@pytest.mark.parametrize(
    ("late", "done", "wanted"),
    [
        (None, True, Written.READ_BACK),
        (None, False, UnverifiedError),
        (ObjectWritten(WINDOW), True, Written.ACKNOWLEDGED),
        (AbortAnswer(Abort.DEVICE_STATE), False, SdoAbortError),
    ],
)
async def test_a_write_without_an_answer_is_looked_at_and_never_repeated(
    late: Answer | None, done: bool, wanted: Written | type[HubsideError]
) -> None:
    silent = Silent(late, done)
    async with small(silent) as (driver, _):
        if isinstance(wanted, Written):
            assert await driver.write(1, WINDOW, FOUR, timeout_s=0.05) is wanted
        else:
            with pytest.raises(wanted):
                await driver.write(1, WINDOW, FOUR, timeout_s=0.05)
        assert silent.count(WriteObject) == 1


async def test_what_cannot_be_verified_by_reading_is_told_so() -> None:
    async with small(Silent(None, done=True)) as (driver, _):
        with pytest.raises(UnverifiedError) as caught:
            await driver.write(1, WINDOW, FOUR, timeout_s=0.05, verify=Verify.ACK)
        assert caught.value.details["reason"] == "outcome unknown"


async def test_a_write_whose_connection_ends_is_unknown_and_not_repeated() -> None:
    class Ending(Bad):
        async def instead(self, message: Message, request: object) -> bytes | None:
            if isinstance(request, WriteObject):
                server.drop()
                return b""
            return None

    ending = Ending()
    async with small(ending) as (driver, server):
        with pytest.raises(BusLostError) as caught:
            await driver.write(1, WINDOW, FOUR, timeout_s=PATIENCE_S)
        assert "outcome unknown" in caught.value.details["reason"]
        await becomes(driver, LinkState.CONNECTED)
        assert await driver.read(1, WINDOW) == ending.dictionary.objects[WINDOW]
        assert ending.count(WriteObject) == 1
        assert driver.status.reconnects == 1


async def test_a_lost_device_refuses_at_once_and_comes_back() -> None:
    bad = Bad()
    async with small(bad) as (driver, server):
        port = server.port
        await server.stop()
        assert await becomes(driver, LinkState.LOST) is LinkState.LOST
        with pytest.raises(BusLostError):
            await driver.read(1, WINDOW)
        await server.start(port)
        assert await becomes(driver, LinkState.CONNECTED) is LinkState.CONNECTED
        assert await driver.read(1, WINDOW) == bad.dictionary.objects[WINDOW]


async def becomes(driver: ModbusDriver, state: LinkState) -> LinkState:
    """Wait for the state of device 1; returns the driver's."""
    await driver._device(1).wait_for(state, PATIENCE_S)
    return driver.status.state


async def test_who_cannot_be_reached_at_all() -> None:
    async with serving(no_answer) as server:
        gone = server.peer
    driver = ModbusDriver(ModbusConfig((gone,)), stamper())
    with pytest.raises(BusOpenError):
        await driver.connect()
    assert await driver.scan() == []
    await driver.close()


async def test_what_fits_no_message_is_refused_and_not_sent() -> None:
    bad = Bad()
    async with small(bad) as (driver, _):
        with pytest.raises(RefusedError):
            await driver.write(1, Address(0x1008), bytes(242))
        assert bad.seen == []


async def test_connecting_again_keeps_the_connection() -> None:
    bad = Bad()
    async with small(bad) as (driver, server):
        await driver.connect()
        assert await driver.read(1, WINDOW) == bad.dictionary.objects[WINDOW]
        assert server.connections == 1


# -- STOP ------------------------------------------------------------------------------


STOP, GO = (2).to_bytes(2, "little"), (15).to_bytes(2, "little")


async def test_a_write_must_not_follow_a_stop_that_it_did_not_know_of() -> None:
    release = asyncio.Event()

    class Slow(Bad):
        async def instead(self, message: Message, request: object) -> bytes | None:
            if isinstance(request, ReadObject):
                await release.wait()
            return None

    slow = Slow()
    async with small(slow) as (driver, _):
        reading = asyncio.create_task(driver.read(1, WINDOW))
        await asyncio.sleep(0)
        known = driver.commanded(1, CONTROLWORD)
        going = asyncio.create_task(driver.write(1, CONTROLWORD, GO, known=known))
        await asyncio.sleep(0)
        stopping = asyncio.create_task(driver.write(1, CONTROLWORD, STOP, urgent=True))
        await asyncio.sleep(0)
        release.set()
        assert await stopping is Written.ACKNOWLEDGED
        with pytest.raises(OvertakenError):
            await going
        assert await reading == slow.dictionary.objects[WINDOW]
        assert [data for address, data in slow.dictionary.written if address == CONTROLWORD] == [STOP]
        assert driver.commanded(1, CONTROLWORD) == 1


async def test_a_stop_passes_a_write_that_has_no_answer_and_that_is_looked_at() -> None:
    """The device takes its time with the write, and answers in order: the STOP is sent meanwhile, executed after it."""
    release = asyncio.Event()

    class Slow(Bad):
        async def instead(self, message: Message, request: object) -> bytes | None:
            if isinstance(request, WriteObject) and request.address == WINDOW:
                await release.wait()
            return None

    slow = Slow()
    async with small(slow) as (driver, server):
        sent: list[Frame] = []
        driver.subscribe(sent.extend)
        writing = asyncio.create_task(driver.write(1, WINDOW, FOUR, timeout_s=PATIENCE_S))
        while not server.requests:  # noqa: ASYNC110  the server has no event for it
            await asyncio.sleep(0.001)
        stopping = asyncio.create_task(driver.write(1, CONTROLWORD, STOP, urgent=True))
        while len(sent) < 2:  # noqa: ASYNC110  what is sent calls no event
            await asyncio.sleep(0.001)
        release.set()
        assert await stopping is Written.ACKNOWLEDGED
        assert await writing is Written.ACKNOWLEDGED
        assert [address for address, _ in slow.dictionary.written] == [WINDOW, CONTROLWORD]


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


# -- FC 101 ----------------------------------------------------------------------------


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
    """Answers the third message of FC 101 with ``end``, else in its own way."""

    def __init__(self, end: Answer | None) -> None:
        super().__init__()
        self.end = end

    async def instead(self, message: Message, request: object) -> bytes | None:
        if isinstance(request, ReadDictionary) and self.count(ReadDictionary) == 3:
            return b"" if self.end is None else reply(message, self.end)
        return None


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
        assert await driver.read_many(1, wanted) == {address: bad.dictionary.objects[address] for address in wanted}


# -- saving ----------------------------------------------------------------------------

MOMENT = datetime(2026, 11, 23, 10, 30, 15, 250_000, timezone(timedelta(hours=1)))
SAVE_TUNING = Address(0x1010, 6)


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


# -- process data ------------------------------------------------------------------------


def mapped(order: WordOrder = WordOrder.HIGH_FIRST, position: int = 0x00010203) -> Bad:
    """Controlword, dummy, mode, target; statusword, dummy, mode, position: another mapping than the default one."""
    values = {STATUSWORD: READY_TO_SWITCH_ON, POSITION: position, Address(0x3502, 0): 4, Address(0x3602, 0): 4}
    received = (0x60400010, 0x00050008, 0x60600008, 0x607A0020)
    sent = (0x60410010, 0x00050008, 0x60610008, 0x60640020)
    entries = {Address(0x3502, sub): raw for sub, raw in enumerate(received, 1)}
    entries |= {Address(0x3602, sub): raw for sub, raw in enumerate(sent, 1)}
    return Bad(Dictionary(values={**values, **entries}, order=order))


VALUES = {CONTROLWORD: b"\x06\0", MODE: b"\1", TARGET: (0x00020001).to_bytes(4, "little")}


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


# -- against the twin -----------------------------------------------------------------------


async def test_the_whole_of_a_twin() -> None:
    """Backup, verification, process data, saving and restart; the passive decoder sees the same."""
    with twin("pd4-eb59") as peer:
        async with connected(peer, now=MOMENT) as driver:
            frames: list[Frame] = []
            driver.subscribe(frames.extend)
            found = (await driver.scan())[0]
            assert found.is_twin
            dictionary = await driver.backup(1)
            assert len(dictionary) > 500
            for address in (WINDOW, Address(0x1018, 1), Address(0x1008)):
                assert await driver.read(1, address) == dictionary[address]
            deviations = {each.deviation for each in await driver.verify(1)}
            assert Deviation.SIZE not in deviations
            assert (await driver.process_data(1).images()).sent.order is WordOrder.HIGH_FIRST  # by 6081h
            data = await driver.process_data(1).exchange()
            assert data[STATUSWORD] == await driver.read(1, STATUSWORD)
            await driver.write(1, Address(0x2030), (7).to_bytes(4, "little"))
            await driver.write(1, WINDOW, FOUR)
            stamp = await driver.save(1, "tuning")
            await driver.restart(1)
            assert await driver.read(1, Address(0x2030)) == (7).to_bytes(4, "little")
            assert await driver.read(1, WINDOW) == dictionary[WINDOW]
            assert await driver.bears(1, stamp)
    decoder = ModbusDecoder(driver.bus, driver.servers)
    assert [type(record) for record in decoder.feed_all(frames)].count(RestartSeen) == 1


# -- the configuration ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "peers"),
    [
        ("127.0.0.1", (ModbusPeer(1, "127.0.0.1", 502, 0),)),
        ("127.0.0.1:1502", (ModbusPeer(1, "127.0.0.1", 1502, 0),)),
        ("pitch-1:502/255=11, [::1]:1502", (ModbusPeer(11, "pitch-1", 502, 255), ModbusPeer(2, "::1", 1502, 0))),
    ],
)
def test_configurations(text: str, peers: tuple[ModbusPeer, ...]) -> None:
    config = parse_modbus(text)
    assert config.peers == peers
    assert parse_modbus(str(config)) == config


@pytest.mark.parametrize(
    "text", ["", ":502", "a:0", "a:65536", "a/256", "a=0", "a=248", "a b", "a,a", "a:1=1,a:2=1", "a:1>b", "a:x"]
)
def test_configurations_that_are_none(text: str) -> None:
    with pytest.raises(UsageError):
        parse_modbus(text)
