"""One CAN bus of the tool: the receive thread that owns the adapter, and all that may be done from outside.

The thread receives in batches, stamps (the last frame with now, those before it by their distance on the adapter's
clock), and hands each batch to the listeners: ours and received frames in one order,
our own tapped where they are sent. Engines that react on the bus live on this thread (``call_soon``, ``call_at``,
``send`` from a listener), so that an answer is followed by the next request without a change of threads. A listener
that raises is logged and counted, the others are served. When the adapter is lost the thread goes on: timers fire,
``send`` raises BusLostError, and the adapter is opened again, tried every quarter of a second.

There is no queue for sending: ``send`` hands the frame to the adapter before it returns, so nothing of ours is ahead of
an urgent frame but what the adapter holds.
"""

from __future__ import annotations

import logging
import select
import socket
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from enum import Enum
from heapq import heappop, heappush
from itertools import count
from typing import Final, NamedTuple

from app.drivers.can_config import CanConfig
from app.drivers.can_link import CanLink, LinkBusyError, LinkError
from app.drivers.can_open import open_link
from app.drivers.socketcand import Received
from app.errors import BusLostError, BusOpenError, RefusedError
from app.wire.frame import Can, Direction, Frame, Stamper

_LOG: Final = logging.getLogger(__name__)

RETRY_S: Final = 0.25
"""Time between two attempts to open a lost adapter again."""
_OPEN_TIMEOUT_S: Final = 1.0
_POLL_S: Final = 0.002
"""Longest wait where the adapter cannot be waited for together with our wake-up."""
_MAX_AGE_NS: Final = 100_000_000
"""Frames of one batch that lie further apart by the adapter's clock: the clock was set."""
_LOGGED_ERRORS: Final = 20
"""Exceptions of listeners that are logged in full; after that every thousandth."""

FramesListener = Callable[[list[Frame]], None]
"""Called on the receive thread with frames in the order of their time; the list is shared and must not be changed."""


class PortState(Enum):
    """``CLOSED``: not opened, or closed by us. ``CONNECTED``. ``LOST``: gone, and tried again."""

    CLOSED = "closed"
    CONNECTED = "connected"
    LOST = "lost"


class PortStatus(NamedTuple):
    """State of the port since ``t_ns``.

    ``lost_since_ns``: begin of the gap, in LOST, and in the CONNECTED that ends it. ``dropped``: frames that the system
    lost because they were not read in time, since the port was opened; a growing count is a status of its own.
    """

    state: PortState
    t_ns: int
    reason: str = ""
    lost_since_ns: int | None = None
    dropped: int = 0


StatusListener = Callable[[PortStatus], None]
"""Called on the receive thread."""


class PortStats(NamedTuple):
    """Counts since the port was opened."""

    received: int
    sent: int
    dropped: int
    listener_errors: int
    reconnects: int


class Timer:
    """A call that is due at a time; ``cancel`` makes it void, from any thread."""

    __slots__ = ("callback",)

    def __init__(self, callback: Callable[[], None]) -> None:
        self.callback: Callable[[], None] | None = callback

    def cancel(self) -> None:
        """Make it void."""
        self.callback = None


class CanPort:
    """A bus. ``bus`` names it in frames, ``stamper`` gives their times, ``monotonic_ns`` is the clock of timers."""

    def __init__(
        self,
        config: CanConfig,
        bus: str,
        stamper: Stamper,
        on_frames: FramesListener | None = None,
        on_status: StatusListener | None = None,
        monotonic_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self.bus = bus
        self.gather_s = 0.0
        """After a batch, let frames gather for this long before the next is read: less load at high rates, paid for
        with as much latency. Calls, timers and our own frames do not wait. To be left at 0 while an engine reacts."""
        self._config = config
        self._stamper = stamper
        self._monotonic_ns = monotonic_ns
        self._listeners: tuple[FramesListener, ...] = () if on_frames is None else (on_frames,)
        self._status_listeners: tuple[StatusListener, ...] = () if on_status is None else (on_status,)
        self._status = PortStatus(PortState.CLOSED, stamper())
        self._received = self._sent = self._listener_errors = self._reconnects = 0
        self._dropped = self._link_dropped = 0
        self._tx_lock = threading.Lock()
        """Guards the link in use, the reopened one, and the tapped frames; held while a frame is stamped and sent."""
        self._link: CanLink | None = None
        self._reopened: CanLink | None = None
        self._reopened_as = config
        self._tapped: list[Frame] = []
        self._soon: deque[Callable[[], None]] = deque()
        self._timers: list[tuple[int, int, Timer]] = []
        self._seq = count()
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None
        self._thread_id = 0
        self._opener: threading.Thread | None = None
        self._wake_rx: socket.socket | None = None
        self._wake_tx: socket.socket | None = None

    # -- life ----------------------------------------------------------------------------

    def open(self, timeout_s: float = 3.0) -> None:
        """Open the adapter and start the thread; once in the life of a port. Raises BusOpenError."""
        if self._thread is not None or self._stopping.is_set():
            raise BusOpenError(bus=self.bus, reason="the port has been opened before")
        try:
            self._link = open_link(self._config, timeout_s)
        except LinkError as error:
            raise BusOpenError(bus=self.bus, reason=str(error)) from error
        self._wake_rx, self._wake_tx = socket.socketpair()
        self._wake_rx.setblocking(False)
        self._wake_tx.setblocking(False)
        self._status = PortStatus(PortState.CONNECTED, self._stamper())
        self._soon.appendleft(self._connected)
        self._thread = threading.Thread(target=self._run, name=f"can-{self.bus}", daemon=True)
        self._thread.start()

    def close(self, timeout_s: float = 5.0) -> None:
        """End the thread and close the adapter; not from the receive thread. Raises TimeoutError."""
        self._stopping.set()
        self._wake()
        deadline = time.monotonic() + timeout_s
        _join(self._thread, deadline)
        _join(self._opener, deadline)
        self._take_reopened()
        for sock in (self._wake_rx, self._wake_tx):
            if sock is not None:
                sock.close()

    def __enter__(self) -> CanPort:
        if self._thread is None:
            self.open()
        return self

    def __exit__(self, *_exc: object) -> None:
        self.close()

    # -- from any thread -------------------------------------------------------------------

    @property
    def config(self) -> CanConfig:
        """The connection."""
        return self._config

    @property
    def status(self) -> PortStatus:
        """The present state."""
        return self._status

    @property
    def stats(self) -> PortStats:
        """Counts so far."""
        return PortStats(self._received, self._sent, self._dropped, self._listener_errors, self._reconnects)

    def add_listener(self, listener: FramesListener, first: bool = False) -> None:
        """Hand every batch to ``listener`` from now on, before all others if ``first``."""
        self._listeners = (listener, *self._listeners) if first else (*self._listeners, listener)

    def remove_listener(self, listener: FramesListener) -> None:
        """End that."""
        self._listeners = tuple(each for each in self._listeners if each != listener)

    def add_status_listener(self, listener: StatusListener) -> None:
        """Tell ``listener`` of every change of status from now on."""
        self._status_listeners = (*self._status_listeners, listener)

    def send(self, can: Can) -> None:
        """Hand ``can`` to the adapter now; it reaches the listeners as a TX frame.

        Raises BusLostError where the adapter is gone or takes nothing, RefusedError where the port is listen-only.
        """
        if self._config.listen_only:
            raise RefusedError(device=self.bus, address="", reason="the connection is listen-only")
        with self._tx_lock:
            link = self._link
            if link is None:
                raise BusLostError(bus=self.bus, reason=self._status.reason or self._status.state.value)
            # The time is taken before the frame is handed over: its answer must never seem older than it is.
            frame = Frame(self._stamper(), self.bus, Direction.TX, can)
            try:
                link.send(can)
            except LinkBusyError as error:
                raise BusLostError(bus=self.bus, reason=f"the adapter takes no further frame: {error}") from error
            except LinkError as error:
                reason = str(error)
                self.call_soon(lambda: self._lose(link, reason))
                raise BusLostError(bus=self.bus, reason=reason) from error
            self._tapped.append(frame)
            self._sent += 1
            wake = len(self._tapped) == 1
        if wake and threading.get_ident() != self._thread_id:
            self._wake()

    def call_soon(self, function: Callable[[], None]) -> None:
        """Call ``function`` on the receive thread, at once."""
        self._soon.append(function)
        if threading.get_ident() != self._thread_id:
            self._wake()

    def call_at(self, at_ns: int, callback: Callable[[], None]) -> Timer:
        """Call ``callback`` on the receive thread at ``at_ns`` of the monotonic clock."""
        timer = Timer(callback)
        if threading.get_ident() == self._thread_id:
            heappush(self._timers, (at_ns, next(self._seq), timer))
        else:
            self.call_soon(lambda: heappush(self._timers, (at_ns, next(self._seq), timer)))
        return timer

    def call_later(self, delay_s: float, callback: Callable[[], None]) -> Timer:
        """Call ``callback`` on the receive thread in ``delay_s``."""
        return self.call_at(self._monotonic_ns() + int(delay_s * 1e9), callback)

    def set_listen_only(self, listen_only: bool) -> None:
        """Send nothing from now on, or send again; an adapter with a silent mode is opened anew, with a gap."""
        self._config = self._config.listening(listen_only)
        if self._config.has_silent_mode:
            self.call_soon(lambda: self._lose(self._link, "opened anew, listen-only changed"))

    # -- the receive thread ------------------------------------------------------------------

    def _run(self) -> None:
        self._thread_id = threading.get_ident()
        while not self._stopping.is_set():
            if self._reopened is not None:
                self._adopt()
            self._run_due()
            link, received, failure = self._link, [], None
            try:
                received = self._receive(link, self._wait_s())
            except LinkError as error:
                failure = str(error)
            self._hand_over(received)
            if failure is not None:
                self._lose(link, failure)
            elif link is not None and link.dropped != self._link_dropped:
                self._note_dropped(link)
            if received and self.gather_s > 0:
                due_s = self._wait_s()
                self._wait(None, self.gather_s if due_s is None else min(self.gather_s, due_s))
        self._shut()

    def _receive(self, link: CanLink | None, wait_s: float | None) -> list[Received]:
        fileno = None if link is None else link.fileno()
        if link is not None and fileno is None:
            return link.recv_many(_POLL_S if wait_s is None else min(wait_s, _POLL_S))
        return link.recv_many(0) if self._wait(fileno, wait_s) and link is not None else []

    def _wait(self, fileno: int | None, wait_s: float | None) -> bool:
        """Wait until ``fileno`` is readable (True), we are woken, or ``wait_s`` is over. Raises LinkError."""
        wake = self._wake_rx
        try:
            ready = select.select([each for each in (wake, fileno) if each is not None], (), (), wait_s)[0]
        except (OSError, ValueError) as error:
            raise LinkError(str(error)) from error
        if wake is not None and wake in ready:
            with suppress(BlockingIOError):
                wake.recv(4096)
        return fileno in ready

    def _wait_s(self) -> float | None:
        if self._soon or self._tapped or self._reopened is not None:
            return 0.0
        if not self._timers:
            return None
        return min(max(self._timers[0][0] - self._monotonic_ns(), 0) / 1e9, 3600.0)

    def _run_due(self) -> None:
        for _ in range(len(self._soon)):
            self._guarded(self._soon.popleft())
        timers = self._timers
        if timers:
            now_ns = self._monotonic_ns()
            while timers and timers[0][0] <= now_ns:
                callback = heappop(timers)[2].callback
                if callback is not None:
                    self._guarded(callback)

    def _hand_over(self, received: list[Received]) -> None:
        if not received and not self._tapped:
            return
        bus, direction = self.bus, Direction.RX
        with self._tx_lock:
            # Under the lock, so that no frame is sent with a time before those of this batch and comes in the next.
            frames, self._tapped = self._tapped, []
            if received:
                alone = len(received) == 1
                stamps = (self._stamper(),) if alone else self._stamper.take_aged(_ages_ns(received))
                frames += [
                    Frame(t_ns, bus, direction, can, adapter_ns)
                    for t_ns, (can, adapter_ns) in zip(stamps, received, strict=True)
                ]
        self._received += len(received)
        for listener in self._listeners:
            self._guarded(listener, frames)

    def _guarded(self, function: Callable[..., None], *args: object) -> None:
        try:
            function(*args)
        except Exception:  # noqa: BLE001 - whatever a listener raises, the bus is served on
            self._listener_errors += 1
            if self._listener_errors <= _LOGGED_ERRORS or self._listener_errors % 1000 == 0:
                _LOG.exception("%s: a listener failed (%d so far)", self.bus, self._listener_errors)

    # -- lost and found ------------------------------------------------------------------------

    def _tell(self, status: PortStatus) -> None:
        self._status = status
        for listener in self._status_listeners:
            self._guarded(listener, status)

    def _lose(self, link: CanLink | None, reason: str) -> None:
        if link is None or link is not self._link:
            return
        with self._tx_lock:
            self._link = None
        self._hand_over([])
        t_ns = self._stamper()
        _LOG.warning("%s: lost: %s", self.bus, reason)
        self._tell(PortStatus(PortState.LOST, t_ns, reason, t_ns, self._dropped))
        link.close()
        self._start_opener()

    def _start_opener(self) -> None:
        self._opener = threading.Thread(target=self._open_again, name=f"can-open-{self.bus}", daemon=True)
        self._opener.start()

    def _open_again(self) -> None:
        """Runs in a thread of its own: drivers may take their time to open, and timers go on meanwhile."""
        said = ""
        while not self._stopping.is_set():
            config = self._config
            try:
                link = open_link(config, _OPEN_TIMEOUT_S)
            except LinkError as error:
                if str(error) != said:
                    said = str(error)
                    _LOG.info("%s: not yet back: %s", self.bus, said)
                self._stopping.wait(RETRY_S)
                continue
            with self._tx_lock:
                self._reopened, self._reopened_as = link, config
            self._wake()
            return

    def _adopt(self) -> None:
        if self._reopened_as.listen_only != self._config.listen_only and self._config.has_silent_mode:
            # Changed while it was being opened.
            self._take_reopened()
            self._start_opener()
            return
        with self._tx_lock:
            self._link, self._reopened = self._reopened, None
        self._link_dropped = 0
        self._reconnects += 1
        since_ns = self._status.lost_since_ns
        self._status = PortStatus(PortState.CONNECTED, self._stamper(), "", since_ns, self._dropped)
        self._connected()

    def _connected(self) -> None:
        _LOG.info("%s: connected", self.bus)
        self._tell(self._status)
        if self._link is not None:
            # What came while the adapter was opened is in its buffers, and nothing wakes us for it.
            try:
                self._hand_over(self._link.recv_many(0))
            except LinkError as error:
                self._lose(self._link, str(error))

    def _note_dropped(self, link: CanLink) -> None:
        self._dropped += link.dropped - self._link_dropped
        self._link_dropped = link.dropped
        status = self._status
        self._tell(PortStatus(status.state, self._stamper(), "frames dropped", None, self._dropped))

    def _take_reopened(self) -> None:
        with self._tx_lock:
            link, self._reopened = self._reopened, None
        if link is not None:
            link.close()

    def _shut(self) -> None:
        self._hand_over([])
        with self._tx_lock:
            link, self._link = self._link, None
        self._tell(PortStatus(PortState.CLOSED, self._stamper(), "", None, self._dropped))
        if link is not None:
            link.close()

    def _wake(self) -> None:
        # A full pipe means that the thread is about to wake anyway; a closed one, that it has ended.
        if self._wake_tx is not None:
            with suppress(OSError):
                self._wake_tx.send(b"\0")


def _ages_ns(received: list[Received]) -> list[int]:
    """How long before the last frame of a batch each came, by the adapter's clock; 0 where that does not tell.

    The last one came just now: so frames that were read late, or together, keep the distances they had on the bus.
    """
    last_ns = received[-1][1]
    if last_ns is None:
        return [0] * len(received)
    ages_ns = [0 if t_ns is None else last_ns - t_ns for _, t_ns in received]
    return ages_ns if all(0 <= age_ns <= _MAX_AGE_NS for age_ns in ages_ns) else [0] * len(received)


def _join(thread: threading.Thread | None, deadline: float) -> None:
    if thread is not None:
        thread.join(max(0.0, deadline - time.monotonic()))
        if thread.is_alive():
            raise TimeoutError(f"{thread.name} did not end in time")
