"""The Modbus TCP driver: the contract against a twin, its objects and writes, STOP, and its configuration."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import pytest

from app.drivers.contract import Driver, LinkState, Written
from app.drivers.modbus import ModbusDriver
from app.drivers.modbus_config import ModbusConfig, ModbusPeer, parse_modbus
from app.drivers.modbus_verify import Deviation
from app.drivers.table import driver_class
from app.errors import (
    BusLostError,
    BusOpenError,
    HubsideError,
    ModbusExceptionError,
    OvertakenError,
    RefusedError,
    SdoAbortError,
    UnverifiedError,
    UsageError,
)
from app.model.address import Address
from app.model.description import Bus, Verify
from app.model.texts import error_text, load_texts
from app.wire.frame import Frame
from app.wire.modbus.adu import Message
from app.wire.modbus.answers import AbortAnswer, Answer, ExceptionAnswer, ObjectRead, ObjectWritten
from app.wire.modbus.decoder import ModbusDecoder
from app.wire.modbus.image import WordOrder
from app.wire.modbus.requests import ReadObject, WriteObject
from app.wire.records import RestartSeen
from app.wire.sdo import Abort
from tests.drivers.contract_suite import Bench, DriverContract
from tests.drivers.modbus_rig import (
    CONTROLWORD,
    ERROR_HISTORY,
    FOUR,
    GO,
    MOMENT,
    PATIENCE_S,
    POSITION,
    STATUSWORD,
    STOP,
    WINDOW,
    Bad,
    becomes,
    connected,
    no_answer,
    small,
    twin,
)
from tests.drivers.modbus_server import PD4E, reply, serving
from tests.drivers.wire import stamper


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


@pytest.mark.parametrize("first", [Abort.LENGTH_TOO_HIGH, Abort.LENGTH_TOO_LOW])
@pytest.mark.parametrize("later", [Abort.LENGTH, Abort.LENGTH_TOO_HIGH, Abort.LENGTH_TOO_LOW])
async def test_the_search_for_a_size_ends_whatever_the_device_says(first: Abort, later: Abort) -> None:
    class Fickle(Bad):
        async def instead(self, message: Message, request: object) -> bytes | None:
            return reply(message, AbortAnswer(first if len(self.seen) == 1 else later))

    fickle = Fickle()
    async with small(fickle) as (driver, _):
        async with asyncio.timeout(PATIENCE_S):
            with pytest.raises(SdoAbortError):
                await driver.read(1, WINDOW)
        assert len(fickle.seen) <= 13


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
        assert caught.value.details["reason_key"] == "unverified.unknown"


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


async def test_a_write_that_is_answered_with_nonsense_is_unknown() -> None:
    class Nonsense(Bad):
        async def instead(self, message: Message, request: object) -> bytes | None:
            if isinstance(request, WriteObject):
                return reply(message, ObjectWritten(POSITION))
            return None

    nonsense = Nonsense()
    async with small(nonsense) as (driver, _):
        with pytest.raises(BusLostError) as caught:
            await driver.write(1, WINDOW, FOUR, timeout_s=PATIENCE_S)
        assert "outcome unknown" in caught.value.details["reason"]
        assert "is no answer to" in caught.value.details["reason"]
        await becomes(driver, LinkState.CONNECTED)
        assert nonsense.count(WriteObject) == 1


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


# -- opening, closing and renewing at the same time -----------------------------------------


async def test_opened_twice_at_once_there_is_one_connection() -> None:
    bad = Bad()
    async with serving(bad) as server:
        driver = ModbusDriver(ModbusConfig((server.peer,)), stamper(), descriptions=(PD4E,))
        await asyncio.gather(driver.connect(), driver.connect(), driver.scan())
        assert await driver.read(1, WINDOW) == bad.dictionary.objects[WINDOW]
        assert server.connections == 1
        await driver.close()


async def test_what_is_closed_while_it_opens_stays_closed() -> None:
    async with serving(Bad()) as server:
        driver = ModbusDriver(ModbusConfig((server.peer,)), stamper(), descriptions=(PD4E,))
        connecting = asyncio.create_task(driver.connect())
        while not driver._device(1)._opening.locked():  # noqa: ASYNC110  nothing tells that it has begun
            await asyncio.sleep(0)
        await driver.close()
        with pytest.raises(BusLostError):
            await connecting
        assert driver.status.state is LinkState.CLOSED
        async with asyncio.timeout(PATIENCE_S):
            while server.connections == 0 or server.open_connections:  # noqa: ASYNC110  the server has no event for it
                await asyncio.sleep(0.001)


async def test_a_renewal_that_is_cancelled_ends_in_a_connection_that_is_one() -> None:
    bad = Bad()
    async with small(bad) as (driver, server):
        device = driver._device(1)
        renewing = asyncio.create_task(device.renew())
        await asyncio.sleep(0)
        renewing.cancel()
        await asyncio.gather(renewing, return_exceptions=True)
        assert renewing.cancelled()
        assert await becomes(driver, LinkState.CONNECTED) is LinkState.CONNECTED
        assert await driver.read(1, WINDOW) == bad.dictionary.objects[WINDOW]
        assert server.connections == 2


async def test_the_end_of_an_earlier_connection_is_not_that_of_the_present_one() -> None:
    bad = Bad()
    async with small(bad) as (driver, server):
        device = driver._device(1)
        earlier = device.link
        await device.renew()
        await becomes(driver, LinkState.CONNECTED)
        earlier._on_lost(BusLostError(bus="modbus0", reason="late news"))
        assert device.state is LinkState.CONNECTED
        assert await driver.read(1, WINDOW) == bad.dictionary.objects[WINDOW]
        assert server.connections == 2


# -- STOP ------------------------------------------------------------------------------


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
