"""The transport against a server that says what it is told to: strict matching, ends, cancelling, and the fast lane."""

from __future__ import annotations

import asyncio
import socket
import struct
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.drivers import modbus_link
from app.drivers.modbus_config import ModbusPeer
from app.drivers.modbus_link import MAX_UNANSWERED, InterruptedRequest, ModbusLink
from app.errors import BusLostError, BusOpenError, NoAnswerError, ProtocolError
from app.model.address import Address
from app.wire.frame import Adu, Direction, Frame
from app.wire.modbus.adu import Message, decode_adu
from app.wire.modbus.answers import AbortAnswer, Answer, ExceptionAnswer, ObjectRead, ObjectWritten
from app.wire.modbus.decoder import ModbusDecoder
from app.wire.modbus.functions import Function, Phase
from app.wire.modbus.requests import ReadDictionary, ReadObject, Request, WriteObject
from app.wire.records import ValueSeen
from tests.drivers.modbus_rig import turns_of_the_loop
from tests.drivers.modbus_server import Server, reply, serving
from tests.drivers.wire import stamper

READ, WRITE = ReadObject(Address(0x6041), 2), WriteObject(Address(0x6040), b"\6\0")
VALUE = ObjectRead(Address(0x6041), b"\x40\x06")
STOP = WriteObject(Address(0x6040), b"\2\0")
PATIENCE_S = 10.0
"""A wait that must end by something else than its time-out."""


class Held:
    """A server's handler that answers nothing by itself: the test does, by ``say``."""

    def __init__(self) -> None:
        self.arrived: asyncio.Queue[Message] = asyncio.Queue()
        self.writer: asyncio.StreamWriter | None = None

    async def __call__(self, message: Message, writer: asyncio.StreamWriter) -> None:
        self.writer = writer
        self.arrived.put_nowait(message)

    async def next(self) -> Message:
        return await asyncio.wait_for(self.arrived.get(), PATIENCE_S)

    def say(self, data: bytes) -> None:
        assert self.writer is not None
        self.writer.write(data)


class Side:
    """The link under test, what it tapped, and by what it was lost."""

    def __init__(self, server: Server, held: Held, unit: int = 0) -> None:
        self.server = server
        self.held = held
        self.frames: list[Frame] = []
        self.lost: list[BusLostError | ProtocolError] = []
        peer = server.peer._replace(unit=unit)
        self.link = ModbusLink(peer, "modbus0", stamper(), self.frames.append, self.lost.append)

    def ask(self, request: Request, timeout_s: float = PATIENCE_S, urgent: bool = False) -> asyncio.Task[Answer]:
        return asyncio.create_task(self.link.request(request, timeout_s, urgent))

    async def asked(
        self, request: Request, urgent: bool = False, timeout_s: float = PATIENCE_S
    ) -> tuple[asyncio.Task[Answer], Message]:
        """A request that has reached the server."""
        task = self.ask(request, timeout_s, urgent)
        return task, await self.held.next()


@asynccontextmanager
async def linked(unit: int = 0) -> AsyncIterator[Side]:
    held = Held()
    async with serving(held) as server:
        side = Side(server, held, unit)
        await side.link.open(PATIENCE_S)
        try:
            yield side
        finally:
            await side.link.close()


async def test_an_answer_and_what_was_tapped() -> None:
    async with linked(unit=3) as side:
        task, message = await side.asked(READ)
        assert (message.unit, message.pdu) == (3, READ.pdu())
        side.held.say(reply(message, VALUE))
        assert await task == VALUE
        assert [frame.direction for frame in side.frames] == [Direction.TX, Direction.RX]
        assert side.frames[0].t_ns < side.frames[1].t_ns
        assert all(frame.bus == "modbus0" for frame in side.frames)
        decoder = ModbusDecoder("modbus0", {side.server.peer.server: 1})
        records = decoder.feed_all(side.frames)
        assert [record.data for record in records if isinstance(record, ValueSeen)] == [VALUE.data]


async def test_transactions_are_never_zero_and_never_twice_in_a_row() -> None:
    async with linked() as side:
        side.link._transaction = 0xFFFE
        numbers = []
        for _ in range(4):
            task, message = await side.asked(READ)
            numbers.append(message.transaction)
            side.held.say(reply(message, VALUE))
            await task
        assert numbers == [0xFFFF, 1, 2, 3]


async def test_a_transaction_whose_answer_may_still_come_is_not_used_again() -> None:
    async with linked() as side:
        with pytest.raises(NoAnswerError):
            await side.link.request(READ, 0.02)
        assert (await side.held.next()).transaction == 1
        side.link._transaction = 0xFFFF
        task, message = await side.asked(READ)
        assert message.transaction == 2
        side.held.say(reply(message, VALUE))
        await task


async def test_answers_split_and_joined_anywhere() -> None:
    async with linked() as side:
        for cut in range(1, 20):
            task, message = await side.asked(READ)
            data = reply(message, VALUE)
            side.held.say(data[:cut])
            await asyncio.sleep(0)
            side.held.say(data[cut:])
            assert await task == VALUE


async def test_one_at_a_time() -> None:
    async with linked() as side:
        first, message = await side.asked(READ)
        second = side.ask(WRITE)
        await turns_of_the_loop()
        assert len(side.frames) == 1  # the second is not sent meanwhile, however long it takes
        side.held.say(reply(message, VALUE))
        await first
        message = await side.held.next()
        side.held.say(reply(message, ObjectWritten(WRITE.address)))
        assert await second == ObjectWritten(WRITE.address)


def changed(**fields: Any) -> Callable[[Message], bytes]:
    def change(message: Message) -> bytes:
        return message._replace(**fields).encode()

    return change


def raw(text: str) -> Callable[[Message], bytes]:
    return lambda message: message.transaction.to_bytes(2, "big") + bytes.fromhex(text)


VIOLATIONS: dict[str, Callable[[Message], bytes]] = {
    "transaction 0, which some clients take for any": changed(transaction=0, pdu=VALUE.pdu()),
    "another transaction": lambda message: message._replace(
        transaction=message.transaction + 1, pdu=VALUE.pdu()
    ).encode(),
    "another unit": changed(unit=1, pdu=VALUE.pdu()),
    "another function": changed(pdu=bytes.fromhex("03 02 0640")),
    "another object": changed(pdu=ObjectRead(Address(0x6042), b"\0\0").pdu()),
    "a write's answer": changed(pdu=ObjectWritten(READ.address).pdu()),
    "more bytes than asked for": changed(pdu=ObjectRead(READ.address, b"\0\0\0").pdu()),
    "an exception of another function": changed(pdu=ExceptionAnswer(3, 1).pdu()),
    "the request itself": lambda message: message.encode(),
    "protocol 1": raw("0001 0002 00 2B"),
    "length 0": raw("0000 0000"),
    "length 65535": raw("0000 FFFF"),
    "a PDU that ends early": raw("0000 0004 00 2B 0D 00"),
    "an abort without a code": raw("0000 0003 00 AB FF"),
}


@pytest.mark.parametrize("violation", VIOLATIONS.values(), ids=VIOLATIONS)
@pytest.mark.parametrize("joined", [False, True])
async def test_a_violation_fails_the_request_at_once_and_ends_the_connection(
    violation: Callable[[Message], bytes], joined: bool
) -> None:
    """``joined``: a right answer follows in the same segment, and comes too late."""
    async with linked() as side:
        task, message = await side.asked(READ)
        side.held.say(violation(message) + (reply(message, VALUE) if joined else b""))
        with pytest.raises(ProtocolError):
            await asyncio.wait_for(task, PATIENCE_S / 2)
        assert not side.link.is_open
        assert len(side.lost) == 1
        with pytest.raises(ProtocolError):
            await side.link.request(READ, PATIENCE_S)
        assert len(side.server.requests) == 1


async def test_an_answer_that_nobody_asked_for_ends_the_connection() -> None:
    async with linked() as side:
        task, message = await side.asked(READ)
        side.held.say(reply(message, VALUE))
        await task
        side.held.say(reply(message, VALUE))
        while side.link.is_open:  # noqa: ASYNC110  nothing tells but the link itself
            await asyncio.sleep(0.001)
        assert isinstance(side.lost[0], ProtocolError)


async def test_a_disconnect_fails_the_request_at_once() -> None:
    async with linked() as side:
        task, _ = await side.asked(WRITE)
        waiting = side.ask(READ)
        await asyncio.sleep(0)
        side.server.drop()
        for each in (task, waiting):
            with pytest.raises(BusLostError):
                await asyncio.wait_for(each, PATIENCE_S / 2)
        assert len(side.server.requests) == 1


async def test_an_end_within_a_message_is_a_violation() -> None:
    async with linked() as side:
        task, message = await side.asked(READ)
        side.held.say(reply(message, VALUE)[:9])
        assert side.held.writer is not None
        side.held.writer.close()
        with pytest.raises(ProtocolError):
            await task


async def test_closing_fails_what_is_open_and_what_waits() -> None:
    async with linked() as side:
        task, _ = await side.asked(READ)
        waiting = side.ask(READ)
        await asyncio.sleep(0)
        await side.link.close()
        for each in (task, waiting):
            with pytest.raises(BusLostError):
                await each
        assert side.lost == []


async def test_nobody_listens() -> None:
    async with linked() as side:
        await side.server.stop()
        other = Side(side.server, side.held)
        with pytest.raises(BusOpenError):
            await other.link.open(PATIENCE_S)
        with pytest.raises(BusLostError):
            await other.link.request(READ, PATIENCE_S)
        await side.server.start()


@asynccontextmanager
async def unread() -> AsyncIterator[tuple[ModbusLink, socket.socket]]:
    """A link to a device that reads nothing by itself and soon takes no more, and the device's end of it."""
    with socket.socket() as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
        listening.bind(("127.0.0.1", 0))
        listening.listen()
        peer = ModbusPeer(1, "127.0.0.1", listening.getsockname()[1])
        link = ModbusLink(peer, "modbus0", stamper(), lambda frame: None, lambda error: None)
        await link.open(PATIENCE_S)
        device, _ = listening.accept()
        with device:
            device.settimeout(PATIENCE_S)
            try:
                yield link, device
            finally:
                await link.close()


@pytest.mark.parametrize("given_up", [False, True])
async def test_what_a_dead_connection_still_holds_never_arrives(given_up: bool) -> None:
    """A GO that the device has not taken must not be taken after a STOP on the next connection."""
    async with unread() as (link, device):
        for _ in range(40):
            with pytest.raises(NoAnswerError):
                await link.request(WriteObject(Address(0x1008), bytes(240)), 0.001)
        go = asyncio.create_task(link.request(WRITE, 0.01 if given_up else PATIENCE_S))
        if given_up:
            with pytest.raises(NoAnswerError):
                await go
        else:
            await turns_of_the_loop()
        await link.close()
        await asyncio.gather(go, return_exceptions=True)
        received = b""
        with pytest.raises(ConnectionResetError):
            while data := device.recv(4096):
                received += data
        assert received
        assert WRITE.pdu() not in received


async def test_a_connection_that_owes_nothing_is_closed_in_order() -> None:
    async with unread() as (link, device):
        await link.close()
        assert device.recv(100) == b""


# -- what is given up ---------------------------------------------------------------


async def test_a_time_out_repeats_nothing_and_the_late_answer_is_no_ones() -> None:
    async with linked() as side:
        with pytest.raises(NoAnswerError):
            await side.link.request(READ, 0.02)
        late = await side.held.next()
        task, message = await side.asked(ReadObject(Address(0x6041), 2))
        side.held.say(reply(late, ObjectRead(READ.address, b"\xff\xff")) + reply(message, VALUE))
        assert await task == VALUE
        assert (side.link.late, len(side.server.requests)) == (1, 2)
        assert side.link.is_open


async def test_a_cancelled_request_leaves_its_answer_to_nobody() -> None:
    async with linked() as side:
        task, late = await side.asked(READ)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        task, message = await side.asked(READ)
        side.held.say(reply(late, ObjectRead(READ.address, b"\xff\xff")))
        side.held.say(reply(message, VALUE))
        assert await task == VALUE
        assert side.link.late == 1


async def test_who_is_cancelled_while_waiting_is_not_sent_and_blocks_nobody() -> None:
    async with linked() as side:
        first, message = await side.asked(READ)
        waiting = [side.ask(WRITE) for _ in range(3)]
        await asyncio.sleep(0)
        waiting[0].cancel()
        waiting[2].cancel()
        side.held.say(reply(message, VALUE))
        await first
        message = await side.held.next()
        side.held.say(reply(message, ObjectWritten(WRITE.address)))
        assert await waiting[1] == ObjectWritten(WRITE.address)
        assert len(side.server.requests) == 2


async def test_cancelling_at_every_moment_breaks_nothing() -> None:
    """Cancelled in turn after every number of turns of the event loop, then a request must go well."""
    async with linked() as side:

        async def answer_all() -> None:
            while True:
                message = await side.held.arrived.get()
                side.held.say(reply(message, VALUE))

        answering = asyncio.create_task(answer_all())
        for turns in range(30):
            task = side.ask(READ)
            for _ in range(turns):
                await asyncio.sleep(0)
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)
            assert await side.link.request(READ, PATIENCE_S) == VALUE
        answering.cancel()


async def test_a_wrong_late_answer_is_a_violation_too() -> None:
    async with linked() as side:
        with pytest.raises(NoAnswerError):
            await side.link.request(READ, 0.02)
        late = await side.held.next()
        task, _ = await side.asked(READ)
        side.held.say(reply(late, ObjectWritten(READ.address)))
        with pytest.raises(ProtocolError):
            await task


async def test_a_device_that_answers_nothing_at_all_is_not_there() -> None:
    async with linked() as side:
        for _ in range(MAX_UNANSWERED + 1):
            with pytest.raises(NoAnswerError):
                await side.link.request(READ, 0.001)
        with pytest.raises(BusLostError):
            await side.link.request(READ, PATIENCE_S)
        assert len(side.lost) == 1


async def test_a_device_that_leaves_some_unanswered_is_still_there() -> None:
    async with linked() as side:
        for _ in range(2 * MAX_UNANSWERED):
            given_up, _ = await side.asked(READ)
            given_up.cancel()
            task, message = await side.asked(READ)
            side.held.say(reply(message, VALUE))
            assert await task == VALUE
        assert side.lost == []


async def test_of_those_given_up_the_earliest_are_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(modbus_link, "MAX_REMEMBERED", 2)
    async with linked() as side:
        messages = []
        for _ in range(3):
            task, message = await side.asked(READ)
            task.cancel()
            messages.append(message)
        side.held.say(reply(messages[1], VALUE) + reply(messages[2], VALUE))
        task, message = await side.asked(READ)
        side.held.say(reply(message, VALUE))
        assert await task == VALUE
        assert side.link.late == 2
        task, _ = await side.asked(READ)
        side.held.say(reply(messages[0], VALUE))
        with pytest.raises(ProtocolError):
            await task


async def test_a_late_answer_says_nothing_of_what_was_given_up_after_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(modbus_link, "MAX_UNANSWERED", 3)
    async with linked() as side:
        messages = []
        for _ in range(3):
            task, message = await side.asked(READ)
            task.cancel()
            messages.append(message)
        side.held.say(reply(messages[1], VALUE))
        while not side.link.late:  # noqa: ASYNC110  nothing tells but the link itself
            await asyncio.sleep(0.001)
        for _ in range(2):
            task, _ = await side.asked(READ)
            task.cancel()
        await turns_of_the_loop()
        assert side.lost == []  # three are unanswered since
        task, _ = await side.asked(READ)
        task.cancel()
        await turns_of_the_loop()
        assert len(side.lost) == 1


@settings(deadline=None, max_examples=40)
@given(st.lists(st.sampled_from(("answered", "timed out", "cancelled", "late ones only")), min_size=1, max_size=12))
def test_every_answer_goes_to_its_own_request(plan: list[str]) -> None:
    """The server says with each answer which transaction it is of; the late ones come first, as it answers in order."""
    asyncio.run(_follow(plan))


async def _follow(plan: list[str]) -> None:
    owed: list[Message] = []
    async with linked() as side:

        def answer(messages: list[Message]) -> None:
            for message in messages:
                own = ObjectRead(READ.address, message.transaction.to_bytes(2, "little"))
                side.held.say(reply(message, own))

        for step in (*plan, "answered"):
            task, message = await side.asked(READ, timeout_s=0.01 if step == "timed out" else PATIENCE_S)
            if step == "answered":
                answer([*owed, message])
                owed.clear()
                got = await task
                assert isinstance(got, ObjectRead)
                assert int.from_bytes(got.data, "little") == message.transaction
                continue
            if step == "late ones only":
                answer(owed)
                owed.clear()
            if step != "timed out":
                task.cancel()
            with pytest.raises((asyncio.CancelledError, NoAnswerError)):
                await task
            owed.append(message)
        assert side.link.is_open
        assert len(side.server.requests) == len(plan) + 1


# -- the fast lane -------------------------------------------------------------------


async def test_what_is_urgent_overtakes_all_that_waits() -> None:
    async with linked() as side:
        first, message = await side.asked(READ)
        waiting = [side.ask(READ) for _ in range(5)]
        await asyncio.sleep(0)
        stop = side.ask(STOP, urgent=True)
        await asyncio.sleep(0)
        side.held.say(reply(message, VALUE))
        await first
        message = await side.held.next()
        assert message.pdu == STOP.pdu()
        side.held.say(reply(message, ObjectWritten(STOP.address)))
        await stop
        for each in waiting:
            side.held.say(reply(await side.held.next(), VALUE))
            assert await each == VALUE


async def test_what_is_urgent_waits_for_no_answer_for_long() -> None:
    async with linked() as side:
        slow, late = await side.asked(READ)
        stop, message = await side.asked(STOP, urgent=True)
        assert message.pdu == STOP.pdu()
        with pytest.raises(InterruptedRequest):
            await slow
        side.held.say(reply(late, VALUE) + reply(message, ObjectWritten(STOP.address)))
        assert await stop == ObjectWritten(STOP.address)
        assert side.link.late == 1


async def test_two_urgent_ones_keep_their_order(monkeypatch: pytest.MonkeyPatch) -> None:
    """An urgent one is not interrupted by another, even without a grace."""
    monkeypatch.setattr(modbus_link, "URGENT_GRACE_S", 0.0)
    async with linked() as side:
        first, message = await side.asked(STOP, urgent=True)
        second = side.ask(WRITE, urgent=True)
        await turns_of_the_loop()
        side.held.say(reply(message, ObjectWritten(STOP.address)))
        await first
        message = await side.held.next()
        side.held.say(reply(message, ObjectWritten(WRITE.address)))
        assert await second == ObjectWritten(WRITE.address)


async def test_an_urgent_one_that_is_cancelled_lets_the_others_go_on() -> None:
    async with linked() as side:
        first, message = await side.asked(READ)
        stop = side.ask(STOP, urgent=True)
        await asyncio.sleep(0)
        stop.cancel()
        await asyncio.gather(stop, return_exceptions=True)
        side.held.say(reply(message, VALUE))
        assert await first == VALUE
        assert not side.link.wanted_urgently


# -- refusals -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("request_", "answer"),
    [
        (READ, AbortAnswer(0x06020000)),
        (READ, ExceptionAnswer(43, 1)),
        (ReadDictionary(Phase.START), AbortAnswer(0x08000024)),
        (ReadDictionary(Phase.START), AbortAnswer(0x08000024, Function.READ_DICTIONARY)),
        (ReadDictionary(Phase.START), ExceptionAnswer(101, 1)),
    ],
)
async def test_refusals_are_answers(request_: Request, answer: Answer) -> None:
    async with linked() as side:
        task, message = await side.asked(request_)
        side.held.say(reply(message, answer))
        assert await task == answer
        assert side.link.is_open


async def test_every_adu_is_tapped_whole() -> None:
    async with linked() as side:
        task, message = await side.asked(READ)
        bad = struct.pack(">HHHB", message.transaction, 0, 4, 0) + b"\x2b\x0d\x00"
        side.held.say(bad)
        with pytest.raises(ProtocolError):
            await task
        sent, received = (frame.payload for frame in side.frames)
        assert isinstance(sent, Adu)
        assert isinstance(received, Adu)
        assert decode_adu(sent.data) == message
        assert received.data == bad
        assert (sent.link, received.link) == (
            f"{received.link.partition('>')[2]}>{side.server.peer.server}",
            f"{side.server.peer.server}>{sent.link.partition('>')[0]}",
        )
