"""The data link layer of the master: one request on the line, one answer to it, and everything that is seen tapped.

Before a request all that has come is drained: an answer that came twice, or late, would else be taken for that of the
next request, and for ever one late. After it only one answer counts. One that is there sooner than the wire can carry
request and answer is none. A request without an answer is repeated as it was, with the same frame count bit, so a
slave that had taken it answers once more and does nothing.

Only one master may be on the line: a token, or a request of somebody else, ends everything.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Final, NamedTuple

from app.drivers.profibus_config import wire_s
from app.drivers.profibus_line import NOTHING, Line
from app.errors import ForeignMasterError
from app.wire.frame import Direction
from app.wire.profibus import dp
from app.wire.profibus.control import Request
from app.wire.profibus.fdl import ShortAck, Telegram, Token, decode
from app.wire.profibus.splitter import Found, Piece, Splitter

Tap = Callable[[Direction, bytes, float], None]
"""Gets what crossed the line, one telegram or what belongs to none, and how many seconds ago it ended."""
Accept = Callable[[Telegram | ShortAck], bool]
PATIENCE_S: Final = 0.03
"""More than an adapter on USB (16 ms) and a busy machine add to the time of the wire."""
STATION_DELAY_BITS: Final = 800
"""The longest that a slave may think (max TSDR at 12 Mbit/s; less at all others)."""
_SLOW_DELAY_BITS: Final = 60
_SLOW: Final = 187500
_EARLY: Final = 0.9
"""Rates may differ by less than 1 %, clocks of the host by more; an answer of before is a whole telegram early."""
_QUIET_BITS: Final = 44
"""TSYN, 33 bits, and the character whose end would be seen."""
_BABBLE_S: Final = 1.0
"""A line on which something comes for so long without a pause is not ours."""
_TOKENS: Final = 2
"""A token has no check sum: within ``_TOKENS_S`` so many make a master. Where nothing was sent yet, one does."""
_TOKENS_S: Final = 1.0


class Reply(NamedTuple):
    """An answer and its bytes."""

    telegram: Telegram | ShortAck
    data: bytes


class Counters:
    """What the line has shown since it was opened."""

    def __init__(self) -> None:
        self.asked = 0
        self.repeated = 0
        """Requests that were sent once more."""
        self.unanswered = 0
        """Requests that had no answer in the end."""
        self.early = 0
        """Answers that came sooner than the wire could carry them."""
        self.stray = 0
        """Telegrams that nobody had asked for."""
        self.damaged = 0
        """Pieces that are no telegram, and bytes with a wrong parity."""


class ProfibusPort:
    """The line with our address ``master`` on it. One thread uses it. Raises LineError of the line everywhere."""

    def __init__(self, line: Line, bus: str, baud: int, master: int, tap: Tap) -> None:
        self.line = line
        self.bus = bus
        self.baud = baud
        self.master = master
        self.counters = Counters()
        self.last_input_s: float | None = None
        """When a right answer to us came last, on the line's clock."""
        self._tap = tap
        self._splitter = Splitter()
        self._tokens_s: list[float] = []

    # -- before anything is sent ---------------------------------------------------------------

    def listen(self, duration_s: float) -> None:
        """Hear whether the line is ours. Raises ForeignMasterError where anybody speaks, at whatever rate."""
        end_s = self.line.now_s() + duration_s
        while (left_s := end_s - self.line.now_s()) > 0:
            received = self.line.receive(left_s)
            for piece in self._splitter.feed(received.data):
                self._tap(Direction.RX, piece.data, 0.0)
                self._require_ours(piece, 1)
            if received.data or received.broken:
                self._require_quiet(end_s)

    def _require_quiet(self, end_s: float) -> None:
        """Something came. It is heard out, so that it is told who it was. Raises ForeignMasterError."""
        end_s = max(end_s, self.line.now_s() + wire_s(64, self.baud) + PATIENCE_S)
        while (left_s := end_s - self.line.now_s()) > 0:
            for piece in self._splitter.feed(self.line.receive(left_s).data):
                self._tap(Direction.RX, piece.data, 0.0)
                self._require_ours(piece, 1)
        raise ForeignMasterError(bus=self.bus, reason_key="profibus.foreign.noise", master=None)

    # -- requests ----------------------------------------------------------------------------------

    def tell(self, telegram: Telegram) -> None:
        """Send what is not answered, and let it pass."""
        data = telegram.encode()
        self._drain()
        self.line.send(data)
        self.pause(wire_s(len(data), self.baud))
        self._tap(Direction.TX, data, 0.0)

    def pause(self, duration_s: float) -> None:
        """Let time pass; what comes meanwhile is drained before the next request."""
        end_s = self.line.now_s() + duration_s
        while (left_s := end_s - self.line.now_s()) > 0:
            self._stray(self._splitter.feed(self._received(left_s)))

    def ask(self, telegram: Telegram, reply_size: int, accept: Accept, repeats: int) -> Reply | None:
        """The answer to ``telegram``, None where there is none after ``repeats`` more attempts.

        ``reply_size`` bytes are awaited at most; ``accept`` says whether an answer of the station makes sense.
        """
        self.counters.asked += 1
        data = telegram.encode()
        for attempt in range(repeats + 1):
            self.counters.repeated += attempt > 0
            found = self._attempt(telegram, data, reply_size, accept)
            if found is not None:
                self.last_input_s = self.line.now_s()
                return found
        self.counters.unanswered += 1
        return None

    def slot_s(self, request_size: int, reply_size: int) -> float:
        """How long one attempt may take."""
        delay_bits = _SLOW_DELAY_BITS if self.baud <= _SLOW else STATION_DELAY_BITS
        return wire_s(request_size + reply_size, self.baud) + delay_bits / self.baud + PATIENCE_S

    def _attempt(self, telegram: Telegram, data: bytes, reply_size: int, accept: Accept) -> Reply | None:
        self._drain()
        sent_s = self.line.now_s()
        self.line.send(data)
        on_wire_s = wire_s(len(data), self.baud)
        request = _Sent(data, sent_s + on_wire_s, self)
        end_s = sent_s + self.slot_s(len(data), reply_size)
        reply, spoilt = None, False
        while reply is None:
            left_s = end_s - self.line.now_s()
            received = self.line.receive(max(0.0, left_s))
            arrived_s = self.line.now_s()
            if left_s <= 0 and received == NOTHING:
                break  # not before a last look: where the host stood still the answer is there
            self.counters.damaged += received.broken
            spoilt = spoilt or received.broken > 0
            for piece in self._splitter.feed(received.data):
                if piece.data == data:
                    continue  # an adapter that hears itself
                early_s = sent_s + _EARLY * wire_s(len(data) + len(piece.data), self.baud)
                if arrived_s < early_s:
                    self.counters.early += isinstance(piece, Found)
                    self._stray((piece,))
                    continue
                request.tell(arrived_s)
                answer = None if spoilt or reply is not None else _answer(telegram, piece, accept)
                if answer is None:
                    self._stray((piece,))
                else:
                    reply = Reply(answer, piece.data)
                    self._tap(Direction.RX, piece.data, 0.0)
        request.tell(self.line.now_s())
        return reply

    # -- what nobody asked for ----------------------------------------------------------------------

    def _drain(self) -> None:
        """Whatever is there belongs to nothing that is asked from now on, and neither does its end.

        Before a request the line is idle for TSYN: an answer that comes twice follows itself sooner than that. Raises
        ForeignMasterError where it never is.
        """
        begun_s = self.line.now_s()
        while data := self._received(_QUIET_BITS / self.baud):
            self._stray(self._splitter.feed(data))
            if self.line.now_s() - begun_s > _BABBLE_S:
                raise ForeignMasterError(bus=self.bus, reason_key="profibus.foreign.noise", master=None)
        self._stray(self._splitter.silence())

    def _received(self, timeout_s: float) -> bytes:
        received = self.line.receive(timeout_s)
        self.counters.damaged += received.broken
        return received.data

    def _stray(self, pieces: Iterable[Piece]) -> None:
        for piece in pieces:
            self._tap(Direction.RX, piece.data, 0.0)
            if isinstance(piece, Found):
                self.counters.stray += 1
                self._require_ours(piece, _TOKENS)
            else:
                self.counters.damaged += 1

    def _require_ours(self, piece: Piece, tokens: int) -> None:
        """Raises ForeignMasterError where ``piece`` is what only another master sends."""
        if not isinstance(piece, Found):
            return
        decoded = decode(piece.data)
        if isinstance(decoded, Token):
            now_s = self.line.now_s()
            self._tokens_s = [t_s for t_s in self._tokens_s if now_s - t_s < _TOKENS_S] + [now_s]
            if len(self._tokens_s) >= tokens:
                raise ForeignMasterError(bus=self.bus, reason_key="profibus.foreign.token", master=decoded.source)
        elif isinstance(decoded, Telegram) and isinstance(decoded.control, Request):
            raise ForeignMasterError(bus=self.bus, reason_key="profibus.foreign.request", master=decoded.source)


def _answer(request: Telegram, piece: Piece, accept: Accept) -> Telegram | ShortAck | None:
    """What ``piece`` is where it answers ``request``."""
    decoded = decode(piece.data) if isinstance(piece, Found) else None
    if isinstance(decoded, Telegram | ShortAck) and dp.belongs(request, decoded) and accept(decoded):
        return decoded
    return None


class _Sent:
    """A request on its way: it is told once it is whole on the wire, so after all that came before that."""

    def __init__(self, data: bytes, ended_s: float, port: ProfibusPort) -> None:
        self._data = data
        self._ended_s = ended_s
        self._port = port
        self._told = False

    def tell(self, now_s: float) -> None:
        """Tell it, once."""
        if not self._told:
            self._told = True
            self._port._tap(Direction.TX, self._data, max(0.0, now_s - self._ended_s))
