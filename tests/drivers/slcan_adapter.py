"""A serial adapter on a bus of one bit rate: the other end of a pty, as the firmware of slcan adapters behaves."""

from __future__ import annotations

import os
import select
import threading
import time
import tty
from contextlib import suppress
from pathlib import Path
from typing import Final

RATES: Final = {
    b"S0": 10_000,
    b"S1": 20_000,
    b"S2": 50_000,
    b"S3": 100_000,
    b"S4": 125_000,
    b"S5": 250_000,
    b"S6": 500_000,
    b"S7": 750_000,
    b"S8": 1_000_000,
    b"S9": 83_300,
}
HEARTBEAT: Final = b"t70B17F\r"
LATENCY_S: Final = 0.02
"""Of USB, for what is under way already."""


class SlcanOnBus:
    """While it is open at ``bus_rate`` it hands over a heartbeat every ``period_s``; at other bit rates nothing.

    ``left_open``: somebody else opened it at the right bit rate and never closed it; what it held then comes late.
    """

    def __init__(self, link: Path, bus_rate: int, period_s: float = 0.01, left_open: bool = False) -> None:
        self.opened: list[tuple[int, bytes]] = []
        """Bit rate and command of every opening, one after the other."""
        self.sent: list[bytes] = []
        """Lines that put a frame on the bus."""
        self._bus_rate = bus_rate
        self._period_s = period_s
        self._rate = bus_rate if left_open else 0
        self._is_open = self._holds_old = left_open
        self._next_at = time.monotonic()
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        link.symlink_to(os.ttyname(self._slave))
        self._stop_rx, self._stop_tx = os.pipe()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    @property
    def tried(self) -> list[int]:
        """Bit rates in the order of their first opening."""
        return list(dict.fromkeys(rate for rate, _ in self.opened))

    def close(self) -> None:
        os.write(self._stop_tx, b"x")
        self._thread.join(5)
        for descriptor in (self._slave, self._master, self._stop_rx, self._stop_tx):
            os.close(descriptor)

    def _run(self) -> None:
        rest = b""
        while True:
            hears = self._is_open and self._rate == self._bus_rate
            wait_s = max(0.0, self._next_at - time.monotonic()) if hears else None
            ready = select.select([self._master, self._stop_rx], [], [], wait_s)[0]
            if self._stop_rx in ready:
                return
            if self._master in ready:
                *lines, rest = (rest + os.read(self._master, 4096)).split(b"\r")
                for line in lines:
                    self._obey(line)
            elif hears:
                self._next_at = time.monotonic() + self._period_s
                self._answer(HEARTBEAT)

    def _obey(self, line: bytes) -> None:
        if line in (b"O", b"L"):
            self.opened.append((self._rate, line))
            self._answer(b"\a" if self._is_open else b"\r")
            self._is_open = True
            self._next_at = time.monotonic() + self._period_s
            if self._holds_old:
                self._holds_old = False
                select.select([self._stop_rx], [], [], LATENCY_S)
                self._answer(3 * HEARTBEAT)
        elif line == b"C":
            self._is_open = False
            self._answer(b"\r")
        elif line in RATES:
            self._rate = RATES[line]
            self._answer(b"\r")
        elif line[:1] in (b"t", b"T", b"r", b"R"):
            self.sent.append(line)

    def _answer(self, data: bytes) -> None:
        with suppress(BlockingIOError):  # nobody reads
            os.write(self._master, data)
