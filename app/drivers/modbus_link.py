"""The transport to one Modbus TCP device: one connection, one transaction at a time, nothing ever sent twice.

An answer counts only with the transaction, unit and function of the open request, and only where it fits what was asked
for. What no rule allows, or a disconnect, fails the open request at once and ends the connection.

A request that is given up (cancelled, timed out, interrupted) does not end the connection: what a drive does when it
breaks is not known. Its transaction is remembered instead, and not used again before its late answer has come, which is
recognised by it and never taken for that of another request. The server answers in order, so a write that follows is
executed after it.

A connection that ends while a request is unanswered is reset, not closed: what has not arrived yet is thrown away, as
it could follow a STOP on the next connection.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
import struct
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Final

from app.drivers.modbus_config import ModbusPeer
from app.drivers.turns import Turns
from app.errors import BusLostError, BusOpenError, NoAnswerError, ProtocolError
from app.wire.frame import Adu, Direction, Frame, Stamper
from app.wire.modbus.adu import AduSplitter, Message, decode_adu
from app.wire.modbus.answers import Answer, answers, decode_answer
from app.wire.modbus.fields import FormatError
from app.wire.modbus.requests import Request
from app.wire.modbus.transactions import ARROW

_LOG: Final = logging.getLogger(__name__)
URGENT_GRACE_S: Final = 0.02
"""So long an urgent request waits for the answer that is under way; then that transaction is given up."""
MAX_UNANSWERED: Final = 64
"""A device that leaves so many requests unanswered, one after another, is not there any more."""
MAX_REMEMBERED: Final = 1024
"""So many given up requests are remembered: an answer that comes later than these is one that nobody asked for."""
_UNSENT_BYTES: Final = 1 << 12
_READ_BYTES: Final = 1 << 16
_LINGER: Final = struct.Struct("hh" if sys.platform == "win32" else "ii")


class InterruptedRequest(Exception):  # noqa: N818 - it is no error: whoever asked goes on after the urgent request
    """The request was sent, then given up for an urgent one. A read may be asked again; a write has to be looked at."""


class Attempt:
    """One request on the wire, and what became of it; ``late`` is an answer that came after it was given up."""

    __slots__ = ("future", "late", "request", "urgent")

    def __init__(self, request: Request, urgent: bool, future: asyncio.Future[Answer]) -> None:
        self.request = request
        self.urgent = urgent
        self.future = future
        self.late: Answer | None = None


class ModbusLink:
    """The connection to ``peer``, once. ``tap`` gets every ADU with its time, sent and received.

    ``on_lost`` is called once, when the connection has ended otherwise than by ``close``, with what ended it.
    """

    def __init__(
        self, peer: ModbusPeer, bus: str, stamper: Stamper, tap: Callable[[Frame], None],
        on_lost: Callable[[BusLostError | ProtocolError], None],
    ) -> None:  # fmt: skip
        self.peer = peer
        self.late = 0
        """Answers that came after their request was given up."""
        self._bus = bus
        self._stamper = stamper
        self._tap = tap
        self._on_lost = on_lost
        self._turns = Turns(self._make_room)
        self._transaction = 0
        self._open: tuple[int, Attempt] | None = None
        self._given_up: dict[int, Attempt] = {}
        self._unanswered = 0
        """Given up since the last request that has an answer: of these nobody knows whether they have arrived."""
        self._streams: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None
        self._receiving: asyncio.Task[None] | None = None
        self._ended: BusLostError | ProtocolError | None = None
        self._names = ("", "")

    async def open(self, timeout_s: float) -> None:
        """Connect. Raises BusOpenError."""
        try:
            async with asyncio.timeout(timeout_s):
                self._streams = await asyncio.open_connection(self.peer.host, self.peer.port)
        except (OSError, TimeoutError) as error:
            reason = str(error) or f"no connection within {timeout_s} s"
            raise BusOpenError(bus=self._bus, reason=f"{self.peer.server}: {reason}") from error
        self._reset_at_end(True)
        host, port = self._streams[1].get_extra_info("sockname")[:2]
        local = f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
        self._names = (f"{local}{ARROW}{self.peer.server}", f"{self.peer.server}{ARROW}{local}")
        self._receiving = asyncio.create_task(self._receive(self._streams[0]))

    async def close(self, error: BusLostError | None = None) -> None:
        """End the connection; what is open fails with ``error``. Calling it again does nothing."""
        self._end(error or BusLostError(bus=self._bus, reason="closed"), tell=False)
        if self._receiving is not None:
            self._receiving.cancel()
            await asyncio.gather(self._receiving, return_exceptions=True)
        if self._streams is not None:
            with contextlib.suppress(OSError):
                await self._streams[1].wait_closed()

    @property
    def is_open(self) -> bool:
        """Whether requests can be sent."""
        return self._streams is not None and self._ended is None

    @asynccontextmanager
    async def turn(self, urgent: bool = False) -> AsyncIterator[None]:
        """Hold the connection for transactions of one's own, one after another: ``send`` and ``finish`` each.

        ``wanted_urgently`` says that somebody urgent waits meanwhile.
        """
        async with self._turns.taken(urgent):
            yield

    @property
    def wanted_urgently(self) -> bool:
        """Somebody urgent waits for the turn."""
        return self._turns.wanted_urgently

    async def finish(self, attempt: Attempt, timeout_s: float, what: str = "") -> Answer:
        """Wait for the answer to what was sent in this turn. ``what`` names it in errors.

        Raises NoAnswerError after ``timeout_s``, InterruptedRequest for an urgent one, BusLostError, ProtocolError.
        """
        try:
            async with asyncio.timeout(timeout_s):
                return await attempt.future
        except TimeoutError:
            raise NoAnswerError(node=self.peer.node, address=what, timeout_s=timeout_s) from None
        finally:
            self._give_up(attempt)

    async def request(self, request: Request, timeout_s: float, urgent: bool = False, what: str = "") -> Answer:
        """One transaction: wait for the turn, send, wait for the answer. Raises what ``finish`` raises."""
        async with self.turn(urgent):
            return await self.finish(self.send(request, urgent), timeout_s, what)

    # -- sending -----------------------------------------------------------------------

    def send(self, request: Request, urgent: bool = False) -> Attempt:
        """Put one request on the wire; only within ``turn``, and after the one before it has ended.

        Raises BusLostError, ProtocolError (what has ended the connection).
        """
        if self._streams is None:
            raise BusLostError(bus=self._bus, reason="not connected")
        if self._streams[1].transport.get_write_buffer_size() > _UNSENT_BYTES:
            self._end(BusLostError(bus=self._bus, reason=f"{self.peer.server} takes no more bytes"))
        if self._ended is not None:
            raise self._ended
        self._transaction = self._next_transaction()
        attempt = Attempt(request, urgent, asyncio.get_running_loop().create_future())
        attempt.future.add_done_callback(_retrieve)
        data = Message(self._transaction, self.peer.unit, request.pdu()).encode()
        self._open = (self._transaction, attempt)
        self._tap(Frame(self._stamper(), self._bus, Direction.TX, Adu(data, self._names[0])))
        self._streams[1].write(data)
        if self.wanted_urgently:
            self._make_room()
        return attempt

    def _next_transaction(self) -> int:
        """Never 0, which some servers answer with to anything, and none whose answer may still come."""
        number = self._transaction % 0xFFFF + 1
        while number in self._given_up:
            number = number % 0xFFFF + 1
        return number

    def _make_room(self) -> None:
        """Somebody urgent waits: what is under way has a short grace."""
        if self._open is not None and not self._open[1].urgent:
            asyncio.get_running_loop().call_later(URGENT_GRACE_S, self._interrupt, self._open[1])

    def _interrupt(self, attempt: Attempt) -> None:
        if self.wanted_urgently and not attempt.future.done():
            attempt.future.set_exception(InterruptedRequest())
            self._give_up(attempt)

    def _give_up(self, attempt: Attempt) -> None:
        """Nobody waits for the answer any more. Nothing where it has come."""
        if self._open is None or self._open[1] is not attempt:
            return
        self._given_up[self._open[0]] = attempt
        self._open = None
        attempt.future.cancel()
        if len(self._given_up) > MAX_REMEMBERED:
            del self._given_up[next(iter(self._given_up))]
        self._unanswered += 1
        if self._unanswered > MAX_UNANSWERED:
            self._end(BusLostError(bus=self._bus, reason=f"{MAX_UNANSWERED} requests were not answered"))

    # -- receiving ---------------------------------------------------------------------

    async def _receive(self, reader: asyncio.StreamReader) -> None:
        splitter = AduSplitter()
        try:
            while data := await reader.read(_READ_BYTES):
                for adu in splitter.feed(data):
                    self._tap(Frame(self._stamper(), self._bus, Direction.RX, Adu(adu, self._names[1])))
                    self._take(decode_adu(adu))
            splitter.end()
            self._end(BusLostError(bus=self._bus, reason=f"{self.peer.server} has ended the connection"))
        except OSError as error:
            self._end(BusLostError(bus=self._bus, reason=str(error) or type(error).__name__))
        except FormatError as error:
            self._violated(str(error))

    def _take(self, message: Message) -> None:
        """One ADU has come. Where no rule allows it, the connection ends, and with it the open request."""
        is_open = self._open is not None and self._open[0] == message.transaction
        attempt = self._open[1] if is_open and self._open else self._given_up.get(message.transaction)
        if attempt is None:
            self._violated(f"transaction {message.transaction} was not asked for")
            return
        answer = decode_answer(message.pdu)
        if message.unit != self.peer.unit or not answers(attempt.request, answer):
            asked = f"unit {self.peer.unit}, {type(attempt.request).__name__}"
            self._violated(f"unit {message.unit}, function {message.function} is no answer to: {asked}")
            return
        later = [] if is_open else list(self._given_up)
        self._unanswered = len(later) - 1 - later.index(message.transaction) if later else 0
        self._open = None if is_open else self._open
        self._given_up.pop(message.transaction, None)
        if attempt.future.done():
            self.late += 1
            attempt.late = answer
        else:
            attempt.future.set_result(answer)

    def _violated(self, reason: str) -> None:
        self._end(ProtocolError(bus=self._bus, node=self.peer.node, reason=f"{self.peer.server}: {reason}"))

    def _reset_at_end(self, reset: bool) -> None:
        """What the system has not sent yet is thrown away at the end of the connection, else it is still sent."""
        if self._streams is not None:
            linger = _LINGER.pack(int(reset), 0)
            with contextlib.suppress(OSError):  # it has ended already
                self._streams[1].get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)

    def _end(self, error: BusLostError | ProtocolError, tell: bool = True) -> None:
        """The connection is over, once and for all."""
        if self._ended is not None:
            return
        self._ended = error
        if self._streams is not None:
            if tell or self._open is not None or self._unanswered:
                self._streams[1].transport.abort()
            else:
                self._reset_at_end(False)
                self._streams[1].close()
        if self._open is not None and not self._open[1].future.done():
            self._open[1].future.set_exception(error)
        self._open = None
        if tell:
            _LOG.info("Modbus connection ended: %s", error)
            self._on_lost(error)


def _retrieve(future: asyncio.Future[Answer]) -> None:
    """Nobody may wait any more: an error that nobody takes is no news."""
    if not future.cancelled():
        future.exception()
