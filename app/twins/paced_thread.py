"""Runs a simulation in real time, with the sockets that feed it, in one thread.

Paced by accumulated time: the thread sleeps until the simulation's next event is due and lets everything happen that is
due by then, so that an error of one sleep never adds to the next. One thread for the simulation and its sockets means
no lock, and no hand-over between threads, on the way of a message.
"""

from __future__ import annotations

import contextlib
import logging
import select
import socket
import threading
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Final, Protocol, Self

_LOG: Final = logging.getLogger(__name__)
_NS: Final = 1e9
_LEAD_NS: Final = 60_000
"""The last bit of the wait for a frame is spent polling: a sleep of the system ends about this much too late."""
_MAX_LAG_NS: Final = 500_000_000
_MAX_WAIT_NS: Final = 3_600_000_000_000


class Simulation(Protocol):
    """What the thread runs: a bus line with its nodes, or one device."""

    on_handler_error: Callable[[Exception], None] | None
    """Told of an exception of its own parts, which must not stop the rest."""

    @property
    def now_ns(self) -> int:
        """Time of the simulation."""

    @property
    def busy(self) -> bool:
        """The next event is wanted on time, to the microsecond."""

    def next_due_ns(self) -> int | None:
        """Time of the next event, None where nothing is due."""

    def run_until(self, t_ns: int) -> None:
        """Let everything happen that is due by then."""


class Readable(Protocol):
    """A socket, or something else with a descriptor that can be waited for."""

    def fileno(self) -> int:
        """The descriptor."""


class PacedThread:
    """The thread of one simulation. ``monotonic_ns`` is its clock; simulated time goes on from where it stands.

    Where the host stood still for longer than ``max_lag_ns``, that time is skipped instead of being made up for.

    Use it as a context manager, or ``start`` and ``stop`` it. Everything but ``start``, ``stop`` and ``call_soon``
    is to be called on the thread itself, or before it starts.
    """

    def __init__(
        self,
        simulation: Simulation,
        monotonic_ns: Callable[[], int] = time.monotonic_ns,
        *,
        max_lag_ns: int = _MAX_LAG_NS,
        name: str = "twin",
    ) -> None:
        self._simulation = simulation
        self._max_lag_ns = max_lag_ns
        self.monotonic_ns = monotonic_ns
        self.handler_errors = 0
        """Exceptions of its parts so far; each is logged, none stops it."""
        self.skipped_ns = 0
        """Time in all that was skipped because the host stood still."""
        self.offset_ns = 0
        """The clock's time less the simulation's; grows where time is skipped."""
        self._readers: dict[Readable, Callable[[], None]] = {}
        self._writers: dict[Readable, Callable[[], None]] = {}
        self._after: list[Callable[[], None]] = []
        self._soon: deque[Callable[[], None]] = deque()
        self._wake_rx, self._wake_tx = socket.socketpair()
        self._wake_rx.setblocking(False)
        self._wake_tx.setblocking(False)
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        simulation.on_handler_error = self._on_handler_error

    # -- from any thread -----------------------------------------------------------

    def start(self) -> None:
        """Start. What is scheduled already happens relative to now."""
        self._readers[self._wake_rx] = self._drain_wake
        self.offset_ns = self.monotonic_ns() - self._simulation.now_ns
        self._thread.start()

    def stop(self, timeout_s: float = 5.0) -> None:
        """End the thread. Raises TimeoutError where it does not end in time."""
        self._stopping = True
        self._wake()
        if self._thread.ident is not None:
            self._thread.join(timeout_s)
            if self._thread.is_alive():
                raise TimeoutError(f"the line's thread did not end within {timeout_s} s")
        self._wake_rx.close()
        self._wake_tx.close()

    def call_soon(self, function: Callable[[], None]) -> None:
        """Have ``function`` called on the thread, at once."""
        self._soon.append(function)
        self._wake()

    def is_alive(self) -> bool:
        """Whether the thread runs."""
        return self._thread.is_alive()

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_exc: object) -> None:
        self.stop()

    # -- on the thread ---------------------------------------------------------------

    def now_ns(self) -> int:
        """The simulated time as it should be now."""
        return self.monotonic_ns() - self.offset_ns

    def catch_up(self) -> None:
        """Let the simulation come to the present: what is done to it next is done now, not at its last step."""
        self._step()

    def on_readable(self, sock: Readable, function: Callable[[], None] | None) -> None:
        """Call ``function`` whenever ``sock`` is readable; None ends that."""
        self._set(self._readers, sock, function)

    def on_writable(self, sock: Readable, function: Callable[[], None] | None) -> None:
        """Call ``function`` whenever ``sock`` is writable; None ends that."""
        self._set(self._writers, sock, function)

    def after_step(self, function: Callable[[], None]) -> None:
        """Call ``function`` after every step, before the thread sleeps."""
        self._after.append(function)

    def forget(self, function: Callable[[], None]) -> None:
        """End what ``after_step`` began."""
        self._after.remove(function)

    # -- inside ------------------------------------------------------------------------

    @staticmethod
    def _set(table: dict[Readable, Callable[[], None]], sock: Readable, function: Callable[[], None] | None) -> None:
        if function is None:
            table.pop(sock, None)
        else:
            table[sock] = function

    def _run(self) -> None:
        _ask_for_precise_sleep()
        while not self._stopping:
            self._step()
            for function in self._after:
                self._guarded(function)
            readable, writable, _ = select.select(self._readers, self._writers, (), self._wait_s())
            for sock in writable:
                self._guarded(self._writers.get(sock))
            for sock in readable:
                self._guarded(self._readers.get(sock))
            while self._soon:
                self._guarded(self._soon.popleft())

    def _step(self) -> None:
        now_ns = self.now_ns()
        due_ns = self._simulation.next_due_ns()
        if due_ns is not None and now_ns - due_ns > self._max_lag_ns:
            lag_ns = now_ns - due_ns
            self.offset_ns += lag_ns
            self.skipped_ns += lag_ns
            _LOG.warning("the simulation stood still for %.3f s; that time is skipped", lag_ns / _NS)
            now_ns = due_ns
        self._simulation.run_until(now_ns)

    def _wait_s(self) -> float | None:
        if self._soon:
            return 0.0
        due_ns = self._simulation.next_due_ns()
        if due_ns is None:
            return None
        wait_ns = min(due_ns - self.now_ns(), _MAX_WAIT_NS)
        if self._simulation.busy:
            wait_ns -= _LEAD_NS
        return max(wait_ns, 0) / _NS

    def _guarded(self, function: Callable[[], None] | None) -> None:
        if function is None:
            return
        try:
            function()
        except Exception as error:  # noqa: BLE001 - nothing that is served here may stop the simulation
            self._on_handler_error(error)

    def _on_handler_error(self, error: Exception) -> None:
        self.handler_errors += 1
        _LOG.error("a part of the simulation failed", exc_info=error)

    def _wake(self) -> None:
        # A full pipe means that the thread is about to wake anyway; a closed one, that it has ended.
        with contextlib.suppress(OSError):
            self._wake_tx.send(b"\0")

    def _drain_wake(self) -> None:
        with contextlib.suppress(BlockingIOError):
            self._wake_rx.recv(4096)


def _ask_for_precise_sleep() -> None:
    """On Linux, have this thread's sleeps end without the usual 50 µs of slack; elsewhere polling makes up for it."""
    slack = Path(f"/proc/{threading.get_native_id()}/timerslack_ns")
    with contextlib.suppress(OSError):
        slack.write_text("1", encoding="ascii")
