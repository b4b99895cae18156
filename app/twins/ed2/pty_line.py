"""Slaves of one segment on a pseudo terminal, in the time that their baud rate takes.

A pty passes on bytes at once, knows no parity and no baud rate: the time of the wire is kept here. A request counts as
heard when its last bit could have come, and an answer is written as its characters become whole, in pieces of a
millisecond at least, so that a reader gets it in parts as it would from a port.
"""

from __future__ import annotations

import contextlib
import logging
import os
import termios
import tty
from collections import deque
from collections.abc import Callable, Sequence
from typing import Final, Protocol

from app.twins.ed2.dp_line import Fault, to_bytes, to_symbols
from app.twins.ed2.segment import Segment, Spoken
from app.twins.paced_thread import PacedThread

_LOG: Final = logging.getLogger(__name__)
_READ_BYTES: Final = 4096
_MS: Final = 1_000_000
_SLACK_NS: Final = 10 * _MS
"""How much later than on a wire the rest of a telegram may come: the host writes when it finds the time."""


class Device(Protocol):
    """What lives behind a slave."""

    def run_until(self, t_ns: int) -> None:
        """Let time pass."""

    def next_due_ns(self) -> int:
        """When it wants to live on."""


class PtyLine:
    """The line as a simulation that ``PacedThread`` runs. ``path`` is what a master opens."""

    def __init__(self, segment: Segment, devices: Sequence[Device]) -> None:
        self.segment = segment
        self.now_ns = 0
        self.on_handler_error: Callable[[Exception], None] | None = None
        self.fault: Fault | None = None
        """What happens to each answer. A pty has no parity: whatever is flipped arrives as a byte."""
        self._devices = list(devices)
        self._master, self._slave = os.openpty()
        # The slave's side stays open here: without it a closing master would hang the line up for ever.
        tty.setraw(self._slave, termios.TCSANOW)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        self._thread: PacedThread | None = None
        self._free_ns = 0
        self._heard: deque[tuple[int, int, bytes]] = deque()
        """What is on its way to the slaves: from when to when, and the bytes."""
        self._spoken: deque[Spoken] = deque()
        self._sent = 0
        """Bytes of the first of them that were written."""

    def add(self, device: Device) -> None:
        """Let something else live by the time of the line."""
        self._devices.append(device)

    # -- any thread --------------------------------------------------------------------------

    def serve(self, thread: PacedThread) -> None:
        """Read from the terminal, on the thread that runs this line."""
        self._thread = thread
        thread.on_readable(self, self._read)

    def close(self) -> None:
        """Give the terminal back; the thread must have ended."""
        for handle in (self._master, self._slave):
            with contextlib.suppress(OSError):
                os.close(handle)

    def fileno(self) -> int:
        """What to wait for."""
        return self._master

    # -- simulation --------------------------------------------------------------------------

    @property
    def busy(self) -> bool:
        """An answer is on its way: it is wanted on time."""
        return bool(self._heard or self._spoken)

    def next_due_ns(self) -> int:
        """The next thing to happen."""
        due_ns = min(device.next_due_ns() for device in self._devices)
        if self._heard:
            due_ns = min(due_ns, self._heard[0][1])
        if self._spoken:
            due_ns = min(due_ns, self._piece_ns())
        return max(due_ns, self.now_ns)

    def run_until(self, t_ns: int) -> None:
        """Let time pass."""
        while self._heard and self._heard[0][1] <= t_ns:
            start_ns, end_ns, data = self._heard.popleft()
            self._live(end_ns)
            self._spoken += self._suffer(self.segment.hear(start_ns, end_ns, data))
        self._live(t_ns)
        self._write()

    def _live(self, t_ns: int) -> None:
        self.now_ns = max(t_ns, self.now_ns)
        for device in self._devices:
            device.run_until(self.now_ns)
        self.segment.run_until(self.now_ns)

    # -- bytes -------------------------------------------------------------------------------

    def _read(self) -> None:
        try:
            data = os.read(self._master, _READ_BYTES)
        except (BlockingIOError, OSError):
            return
        if self._thread is not None:
            self._thread.catch_up()
        if self._spoken:
            # Who speaks does not listen any more: the rest of an answer to what was asked before is never heard.
            self._spoken.clear()
            self._sent = 0
        late = self.now_ns - self._free_ns
        goes_on = late <= 0 or (late <= _SLACK_NS and self.segment.in_telegram)
        start_ns = self._free_ns if goes_on else self.now_ns
        end_ns = max(start_ns, self.now_ns) + self.segment.wire_ns(len(data))
        self._free_ns = end_ns
        self._heard.append((start_ns, end_ns, data))

    def _suffer(self, answers: list[Spoken]) -> list[Spoken]:
        """What the line makes of answers."""
        if self.fault is None:
            return answers
        arriving = []
        for answer in answers:
            start_ns = answer.start_ns
            for part in self.fault(to_symbols(answer.data)):
                if part:
                    arriving.append(Spoken(start_ns, to_bytes(part)))
                start_ns += self.segment.wire_ns(len(part))
        return arriving

    def _piece_ns(self) -> int:
        """When the next piece of the answer is whole."""
        first = self._spoken[0]
        left = len(first.data) - self._sent
        step = max(1, min(left, _MS // max(self.segment.wire_ns(1), 1)))
        return first.start_ns + self.segment.wire_ns(self._sent + step)

    def _write(self) -> None:
        while self._spoken and self._piece_ns() <= self.now_ns:
            first = self._spoken[0]
            there = min((self.now_ns - first.start_ns) // max(self.segment.wire_ns(1), 1), len(first.data))
            piece = first.data[self._sent : there]
            try:
                self._sent += os.write(self._master, piece)
            except BlockingIOError:
                _LOG.warning("nobody reads from %s: an answer is lost", self.path)
                self._sent = len(first.data)
            if self._sent >= len(first.data):
                self._spoken.popleft()
                self._sent = 0
