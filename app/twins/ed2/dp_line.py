"""An RS-485 line in one process, with a clock that only its owner moves: one master, and the slaves of a segment.

What travels are symbols of nine bits: eight of data, and even parity above them. So a bit error is what it is on a real
line: one in a character shows in its parity, two do not. A fault is a function from one transmission to those that
arrive instead of it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from heapq import heappop, heappush
from math import floor, inf, log, log1p
from random import Random
from typing import Final

from app.twins.ed2.dp_slave import DpSlave
from app.twins.ed2.segment import Segment

Symbols = tuple[int, ...]
Fault = Callable[[Symbols], Sequence[Symbols]]
"""What arrives of one transmission: nothing, itself, or others, one after another."""
_PARITY: Final = 0x100
_BITS: Final = 9


def to_symbols(data: bytes) -> Symbols:
    """Characters with even parity."""
    return tuple(byte | (byte.bit_count() & 1) * _PARITY for byte in data)


def parity_holds(symbol: int) -> bool:
    """True where the parity of a character is right."""
    return symbol.bit_count() & 1 == 0


def to_bytes(symbols: Iterable[int]) -> bytes:
    """The data, whatever the parity says: a receiver that checks it looks at ``parity_holds`` before."""
    return bytes(symbol & 0xFF for symbol in symbols)


class DpLine:
    """The line. The master sends, lets time pass, and takes what has arrived; slaves answer by themselves."""

    def __init__(self, slaves: Iterable[DpSlave], baud: int, *, start_ns: int = 0) -> None:
        self.segment = Segment(slaves, baud)
        self.now_ns = start_ns
        self.fault: Fault | None = None
        """What happens to each transmission, of the master and of slaves alike."""
        self.on_time: Callable[[int], None] = lambda _t_ns: None
        """Called whenever time has passed: devices behind the slaves live by it."""
        self._idle_ns = start_ns
        """From when on the line is free."""
        self._coming: deque[tuple[int, int]] = deque()
        """What is on its way to the master: when each symbol is whole, and the symbol."""
        self._going: list[tuple[int, int, int, Symbols]] = []
        self._number = 0

    @property
    def baud(self) -> int:
        """Bits a second."""
        return self.segment.baud

    @property
    def busy_until_ns(self) -> int:
        """When what is on the line will have passed."""
        return self._idle_ns

    def send(self, symbols: Sequence[int]) -> int:
        """The master transmits, as soon as the line is free; gives when its last bit will have left, ns."""
        start_ns = end_ns = max(self.now_ns, self._idle_ns)
        for part in self._suffer(tuple(symbols)):
            end_ns = start_ns + self.segment.wire_ns(len(part))
            self._number += 1
            heappush(self._going, (end_ns, self._number, start_ns, part))
            start_ns = end_ns
        self._idle_ns = max(end_ns, start_ns, self.now_ns + self.segment.wire_ns(len(symbols)))
        return self._idle_ns

    def receive(self) -> Symbols:
        """What has arrived at the master and was not taken yet."""
        arrived = []
        while self._coming and self._coming[0][0] <= self.now_ns:
            arrived.append(self._coming.popleft()[1])
        return tuple(arrived)

    def next_due_ns(self) -> int | None:
        """When something will happen by itself: a symbol arrives, a slave has heard a telegram, a watchdog bites."""
        due = [slave.due_ns() for slave in self.segment.slaves]
        times = [t_ns for t_ns in due if t_ns is not None]
        times += [self._coming[0][0]] if self._coming else []
        times += [self._going[0][0]] if self._going else []
        return max(min(times), self.now_ns) if times else None

    def run_until(self, t_ns: int) -> None:
        """Let time pass."""
        while self._going and self._going[0][0] <= t_ns:
            end_ns, _, start_ns, symbols = heappop(self._going)
            self._pass(end_ns)
            self._heard(start_ns, end_ns, symbols)
        self._pass(max(t_ns, self.now_ns))

    def _pass(self, t_ns: int) -> None:
        self.now_ns = t_ns
        self.segment.run_until(t_ns)
        self.on_time(t_ns)

    def _heard(self, start_ns: int, end_ns: int, symbols: Symbols) -> None:
        """Slaves drop what has a wrong parity, and wait for silence: nothing of it can be a telegram."""
        if not all(map(parity_holds, symbols)):
            self.segment.silent()
            return
        for answer in self.segment.hear(start_ns, end_ns, to_bytes(symbols)):
            at_ns = max(answer.start_ns, self._idle_ns)
            for part in self._suffer(to_symbols(answer.data)):
                for symbol in part:
                    at_ns += self.segment.wire_ns(1)
                    self._coming.append((at_ns, symbol))
            self._idle_ns = max(self._idle_ns, at_ns, answer.start_ns + self.segment.wire_ns(len(answer.data)))

    def _suffer(self, symbols: Symbols) -> Sequence[Symbols]:
        return (symbols,) if self.fault is None else self.fault(symbols)


class LineNoise:
    """A fault by chance, the same with every run: shares of bits that flip, and of transmissions that go wrong."""

    def __init__(
        self, seed: int, *, bit_errors: float = 0.0, lost: float = 0.0, doubled: float = 0.0, truncated: float = 0.0
    ) -> None:
        self._random = Random(seed)
        self._bit_errors = bit_errors
        self._lost = lost
        self._doubled = doubled
        self._truncated = truncated
        self._passed_over = self._gap()
        """Bits that arrive as they are before the next one flips."""
        self.counts = {"bit_errors": 0, "lost": 0, "doubled": 0, "truncated": 0}
        """What it has done so far; ``bit_errors`` counts bits."""

    def __call__(self, symbols: Symbols) -> Sequence[Symbols]:
        """What arrives."""
        if self._happens("lost", self._lost):
            return ()
        if self._happens("truncated", self._truncated):
            symbols = symbols[: self._random.randrange(len(symbols))]
        symbols = self._flipped(symbols)
        return (symbols, symbols) if self._happens("doubled", self._doubled) else (symbols,)

    def _happens(self, what: str, share: float) -> bool:
        happens = share > 0.0 and self._random.random() < share
        self.counts[what] += happens
        return happens

    def _flipped(self, symbols: Symbols) -> Symbols:
        """Bits flip one by one: what is drawn is how many are passed over until the next one does."""
        bits = _BITS * len(symbols)
        if self._passed_over >= bits:
            self._passed_over -= bits
            return symbols
        told = list(symbols)
        while self._passed_over < bits:
            place, bit = divmod(int(self._passed_over), _BITS)
            told[place] ^= 1 << bit
            self.counts["bit_errors"] += 1
            self._passed_over += 1 + self._gap()
        self._passed_over -= bits
        return tuple(told)

    def _gap(self) -> float:
        """Bits until the next one that flips."""
        if self._bit_errors <= 0.0:
            return inf
        return 0.0 if self._bit_errors >= 1.0 else floor(log(1.0 - self._random.random()) / log1p(-self._bit_errors))
