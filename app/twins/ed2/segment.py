"""Slaves on one segment: bytes of the line in, answers out, with the time that all of it takes at the baud rate.

A character has 11 bits: start, eight of data, even parity, stop. Nothing here reads a clock.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, NamedTuple

from app.twins.ed2.dp_slave import DpSlave
from app.wire.profibus.fdl import Telegram, decode
from app.wire.profibus.splitter import Found, Splitter

BITS: Final = 11
"""Of a character."""
SILENCE_BITS: Final = 33
"""Idle for so long, no telegram goes on (TSYN)."""
_SECOND: Final = 1_000_000_000
BAUD_RATES: Final = (9_600, 19_200, 45_450, 93_750, 187_500, 500_000, 1_500_000, 3_000_000, 6_000_000, 12_000_000)
"""Manual, 3.2.1."""


class Spoken(NamedTuple):
    """An answer and when its first bit leaves, ns."""

    start_ns: int
    data: bytes


class Segment:
    """All slaves of one line."""

    def __init__(self, slaves: Iterable[DpSlave], baud: int) -> None:
        self.slaves = tuple(slaves)
        self.baud = baud
        self._splitter = Splitter()
        self._quiet_since_ns = 0

    def bits_ns(self, bits: int) -> int:
        """How long so many bits take."""
        return bits * _SECOND // self.baud

    def wire_ns(self, characters: int) -> int:
        """How long so many characters take."""
        return self.bits_ns(BITS * characters)

    def run_until(self, t_ns: int) -> None:
        """Let watchdogs look."""
        for slave in self.slaves:
            slave.run_until(t_ns)

    @property
    def in_telegram(self) -> bool:
        """A telegram has begun and is not whole."""
        return self._splitter.pending > 0

    def silent(self) -> None:
        """The line was idle long enough: what is not whole never will be."""
        for _ in self._splitter.silence():
            pass

    def hear(self, start_ns: int, end_ns: int, data: bytes) -> list[Spoken]:
        """Bytes that were on the line from ``start_ns`` to ``end_ns``; gives what is answered, in its order."""
        if start_ns - self._quiet_since_ns >= self.bits_ns(SILENCE_BITS):
            self.silent()
        self._quiet_since_ns = end_ns
        answers: list[Spoken] = []
        for piece in self._splitter.feed(data):
            if isinstance(piece, Found):
                telegram = decode(piece.data)
                if isinstance(telegram, Telegram):
                    self._answer(end_ns, telegram, answers)
        return answers

    def _answer(self, end_ns: int, telegram: Telegram, answers: list[Spoken]) -> None:
        for slave in self.slaves:
            data = slave.hear(end_ns, telegram)
            if data is not None:
                after_ns = end_ns if not answers else answers[-1].start_ns + self.wire_ns(len(answers[-1].data))
                answers.append(Spoken(after_ns + self.bits_ns(slave.min_tsdr), data))
