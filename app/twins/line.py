"""A simulated CAN line that keeps CAN's time (ISO 11898-1).

A frame takes its bit time, stuff bits included. Whenever the line gets free, the frame with the lowest identifier among
all that are ready goes next. Every node receives every frame but its own, at the end of its end of frame; the line is
free again after the intermission of 3 bits.

The line is pure: time is what ``run_until`` is given, so that tests and bulk simulations drive it deterministically.
``app.twins.line_thread`` runs it in real time. All calls belong to one thread.

Simplified: no acknowledge is needed (one node alone may send), two nodes that send one identifier at a time do not
collide (the one that asked first goes first), and no error frames arise.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from heapq import heappop, heappush
from itertools import count
from typing import Final

from app.wire.can_bits import frame_bits
from app.wire.frame import Can

Handler = Callable[[Can, int], None]
"""Called with a frame and the end of its end of frame in ns."""
Tap = Callable[[int, int, Can], None]
"""Called with start of frame and end of end of frame in ns, and the frame."""
TimerCallback = Callable[[int], None]
"""Called with the time for which it was asked, in ns."""
FaultAction = Callable[[Can], Iterable[tuple[int, Can]]]
"""What becomes of a frame: any number of (delay_ns, frame)."""

INTERMISSION_BITS: Final = 3
MIN_BITRATE: Final = 10_000
MAX_BITRATE: Final = 1_000_000
"""Slowest and fastest bit rate that CiA 301 knows, in bit/s."""
_NS: Final = 1_000_000_000
_NEVER: Final = 1 << 63


class TxOrder(Enum):
    """How a node's frames wait among themselves.

    ``BY_IDENTIFIER``: a controller with mailboxes enough: all that are ready arbitrate, frames of one identifier keep
    the order in which they were sent. ``FIFO``: one queue, only its head arbitrates, as behind most PC adapters.
    """

    BY_IDENTIFIER = "by_identifier"
    FIFO = "fifo"


class Interference(ABC):
    """Something that happens to frames when they are sent; those that the line makes of them are exempt."""

    @abstractmethod
    def takes(self, port: Port, can: Can, ready_ns: int) -> bool:
        """Look at a frame that ``port`` sends, ready at ``ready_ns``.

        True: the frame is dealt with, and what is to become of it was given to ``Port.put``.
        """

    def ended(self) -> None:  # noqa: B027 - most have nothing to undo
        """It was taken from the line: let go of what is held back."""


@dataclass(eq=False)
class Fault(Interference):
    """Something that happens to the next ``times`` frames sent for which ``matches`` holds (None: to all of them)."""

    matches: Callable[[Can], bool]
    action: FaultAction
    times: int | None = 1

    def takes(self, port: Port, can: Can, ready_ns: int) -> bool:
        """Do the action, once less from now on."""
        if self.times == 0 or not self.matches(can):
            return False
        if self.times is not None:
            self.times -= 1
            if self.times == 0:
                port.line.withdraw(self)
        for delay_ns, other in self.action(can):
            port.put(other, ready_ns + delay_ns)
        return True


def drop(_can: Can) -> Sequence[tuple[int, Can]]:
    """Fault action: the frame never reaches the line."""
    return ()


def delay(delay_ns: int) -> FaultAction:
    """Fault action: the frame is ready ``delay_ns`` later; frames behind it may overtake."""
    return lambda can: ((delay_ns, can),)


def duplicate(times: int = 2) -> FaultAction:
    """Fault action: the frame is sent ``times`` times."""
    return lambda can: ((0, can),) * times


class _Pending:
    """A frame that waits for the line."""

    __slots__ = ("can", "epoch", "key", "port", "ready_ns", "seq", "tx_bits")

    def __init__(self, port: Port, can: Can, ready_ns: int, seq: int, tx_bits: int) -> None:
        self.port = port
        self.can = can
        self.ready_ns = ready_ns
        self.seq = seq
        self.tx_bits = tx_bits
        self.key = arbitration_key(can)
        self.epoch = port.epoch


class Port:
    """A node's place on the line. Made by ``CanLine.attach``."""

    __slots__ = ("_cuts", "_queue", "attached", "epoch", "handler", "identifiers", "line", "live", "order", "pending")

    def __init__(self, line: CanLine, handler: Handler, identifiers: frozenset[int] | None, order: TxOrder) -> None:
        self.line = line
        self._queue: deque[_Pending] = deque()
        self._cuts = 0
        self.handler = handler
        self.identifiers = identifiers
        self.order = order
        self.attached = True
        self.live = True
        """Whether it sends and hears: attached, and not cut off."""
        self.epoch = 0
        self.pending = 0
        """Frames that wait for the line."""

    def send(self, can: Can, not_before_ns: int = 0) -> None:
        """Queue ``can``; it is ready for arbitration at ``not_before_ns`` (line time), at once where that is past.

        Raises ValueError where the frame cannot exist on a classic CAN bus.
        """
        self.line._send(self, can, not_before_ns)

    def put(self, can: Can, not_before_ns: int = 0) -> None:
        """Queue ``can`` as ``send`` does, whatever interferes: nothing happens to it on its way."""
        if self.live:
            self.line._queue(self, can, not_before_ns)

    def accept(self, identifiers: Iterable[int] | None) -> None:
        """Set the acceptance filter: base identifiers only, extended frames fail it; None accepts every frame."""
        self.identifiers = None if identifiers is None else frozenset(identifiers)
        self.line._receivers.clear()

    def cut(self) -> None:
        """Cut the node off: what waits is lost, and so is all that it sends; it hears nothing. Cuts add up.

        A frame on the line ends normally.
        """
        self._cuts += 1
        self._connect()
        self.clear()

    def join(self) -> None:
        """End one cut."""
        self._cuts -= 1
        self._connect()

    def _connect(self) -> None:
        self.live = self.attached and self._cuts == 0
        self.line._receivers.clear()

    def clear(self) -> None:
        """Forget all frames that wait, as a controller does that is reset. A frame on the line ends normally."""
        self.epoch += 1
        self.pending = 0
        self._queue.clear()

    def detach(self) -> None:
        """Leave the line."""
        self.clear()
        self.live = False
        self.line._detach(self)

    def enqueue(self, entry: _Pending) -> _Pending | None:
        """Take ``entry`` in; gives what may join arbitration now, if anything."""
        self.pending += 1
        if self.order is TxOrder.BY_IDENTIFIER:
            return entry
        self._queue.append(entry)
        return entry if len(self._queue) == 1 else None

    def sent(self) -> _Pending | None:
        """A frame of this port won; gives the next head of its queue, if any."""
        self.pending -= 1
        if self.order is TxOrder.BY_IDENTIFIER:
            return None
        self._queue.popleft()
        return self._queue[0] if self._queue else None


def arbitration_key(can: Can) -> int:
    """The bits of the arbitration field in the order of the wire; the lower key wins (ISO 11898-1, 10.4.2)."""
    if can.extended:
        return can.can_id >> 18 << 21 | 0b11 << 19 | (can.can_id & 0x3FFFF) << 1 | can.remote
    return can.can_id << 21 | can.remote << 20


class CanLine:
    """The line. ``bitrate`` in bit/s, ``start_ns`` is the time at which it begins.

    Raises ValueError where the bit rate is not from ``MIN_BITRATE`` to ``MAX_BITRATE``.
    """

    def __init__(self, bitrate: int, start_ns: int = 0) -> None:
        if not MIN_BITRATE <= bitrate <= MAX_BITRATE:
            raise ValueError(f"bit rate {bitrate} is outside {MIN_BITRATE} to {MAX_BITRATE} bit/s")
        self.bitrate = bitrate
        self.now_ns = start_ns
        self.frames = 0
        """Frames carried so far."""
        self.busy_ns = 0
        """Time for which the line was not free so far, intermissions included."""
        self.on_handler_error: Callable[[Exception], None] | None = None
        """Takes what a handler, tap or timer raises; where None, it goes to the caller of ``run_until``."""
        self._free_ns = start_ns
        self._flight: _Pending | None = None
        self._flight_start_ns = self._flight_end_ns = start_ns
        self._seq = count()
        self._waiting: list[tuple[int, int, _Pending]] = []
        self._ready: list[tuple[int, int, _Pending]] = []
        self._ready_since_ns = _NEVER
        self._timers: list[tuple[int, int, TimerCallback]] = []
        self._ports: list[Port] = []
        self._receivers: dict[int, tuple[Port, ...]] = {}
        self._taps: list[Tap] = []
        self._interferences: list[Interference] = []

    # -- for nodes -------------------------------------------------------------

    def attach(
        self,
        handler: Handler,
        identifiers: Iterable[int] | None = None,
        order: TxOrder = TxOrder.BY_IDENTIFIER,
    ) -> Port:
        """Attach a node: ``handler(can, t_ns)`` is called for every frame of others that passes ``identifiers``."""
        port = Port(self, handler, None if identifiers is None else frozenset(identifiers), order)
        self._ports.append(port)
        self._receivers.clear()
        return port

    def call_at(self, t_ns: int, callback: TimerCallback) -> None:
        """Call ``callback(t_ns)`` when the line gets to ``t_ns``; at its next step where that is past."""
        heappush(self._timers, (max(t_ns, self.now_ns), next(self._seq), callback))

    @property
    def nodes(self) -> int:
        """How many nodes are attached."""
        return len(self._ports)

    @property
    def busy(self) -> bool:
        """Whether a frame is on the line or waits for it."""
        return self._flight is not None or bool(self._ready) or bool(self._waiting)

    # -- for tests and tools -----------------------------------------------------

    def tap(self, tap: Tap) -> None:
        """Have ``tap`` called for every frame, before the nodes receive it."""
        self._taps = [*self._taps, tap]  # a new list: one may be ringing

    def untap(self, tap: Tap) -> None:
        """End what ``tap`` began."""
        self._taps = [one for one in self._taps if one != tap]

    def inject(self, fault: Interference) -> None:
        """Have ``fault`` happen to frames sent from now on; the first that takes a frame acts."""
        self._interferences.append(fault)

    def withdraw(self, fault: Interference) -> None:
        """End ``fault``, where it has not ended."""
        if fault in self._interferences:
            self._interferences.remove(fault)
            fault.ended()

    def clear_faults(self) -> None:
        """End all faults."""
        for fault in tuple(self._interferences):
            self.withdraw(fault)

    # -- time --------------------------------------------------------------------

    def run_until(self, t_ns: int) -> None:
        """Let all happen that is due up to and including ``t_ns``.

        At one instant frames are received first, then timers fire, then nodes arbitrate.
        """
        while True:
            flight = self._flight
            bus_ns = self._arbitration_ns() if flight is None else self._flight_end_ns
            if self._timers and (self._timers[0][0] < bus_ns or (flight is None and self._timers[0][0] == bus_ns)):
                if self._timers[0][0] > t_ns:
                    break
                self.now_ns, _, callback = heappop(self._timers)
                self._guarded(callback, self.now_ns)
            elif bus_ns > t_ns:
                break
            else:
                self.now_ns = bus_ns
                if flight is None:
                    self._arbitrate(bus_ns)
                else:
                    self._deliver(flight)
        self.now_ns = max(self.now_ns, t_ns)

    def next_due_ns(self) -> int | None:
        """When ``run_until`` should be called next so that nobody is served late; None where nothing is ahead.

        For frames that wait it is the end of the one that would win now: arbitration itself needs no call in time.
        """
        timer_ns = self._timers[0][0] if self._timers else _NEVER
        if self._flight is not None:
            return min(timer_ns, self._flight_end_ns)
        start_ns = self._arbitration_ns()
        if start_ns == _NEVER:
            return None if timer_ns == _NEVER else timer_ns
        entry = (self._ready or self._waiting)[0][2]
        return min(timer_ns, start_ns + self._duration_ns(entry.tx_bits - INTERMISSION_BITS))

    # -- inside ------------------------------------------------------------------

    def _duration_ns(self, bits: int) -> int:
        return bits * _NS // self.bitrate

    def _send(self, port: Port, can: Can, not_before_ns: int) -> None:
        if not port.live:
            return
        if self._interferences:
            ready_ns = max(not_before_ns, self.now_ns)
            for fault in tuple(self._interferences):
                if fault.takes(port, can, ready_ns):
                    return
        self._queue(port, can, not_before_ns)

    def _queue(self, port: Port, can: Can, ready_ns: int) -> None:
        tx_bits = frame_bits(can)
        entry = port.enqueue(_Pending(port, can, max(ready_ns, self.now_ns), next(self._seq), tx_bits))
        if entry is not None:
            self._compete(entry)

    def _compete(self, entry: _Pending) -> None:
        if entry.ready_ns <= self.now_ns:
            self._ready_since_ns = min(self._ready_since_ns, self.now_ns)
            heappush(self._ready, (entry.key, entry.seq, entry))
        else:
            heappush(self._waiting, (entry.ready_ns, entry.seq, entry))

    def _arbitration_ns(self) -> int:
        """When the next arbitration takes place; _NEVER where no frame waits."""
        wanted_ns = self._ready_since_ns
        if self._waiting and self._waiting[0][0] < wanted_ns:
            wanted_ns = self._waiting[0][0]
        return max(wanted_ns, self._free_ns)

    def _arbitrate(self, t_ns: int) -> None:
        waiting, ready = self._waiting, self._ready
        while waiting and waiting[0][0] <= t_ns:
            entry = heappop(waiting)[2]
            heappush(ready, (entry.key, entry.seq, entry))
        winner = None
        while ready and winner is None:
            entry = heappop(ready)[2]
            if entry.epoch == entry.port.epoch:
                winner = entry
        if winner is not None:
            self._start(winner, t_ns)
        self._ready_since_ns = t_ns if ready else _NEVER

    def _start(self, winner: _Pending, t_ns: int) -> None:
        self._flight = winner
        self._flight_start_ns = t_ns
        self._flight_end_ns = t_ns + self._duration_ns(winner.tx_bits - INTERMISSION_BITS)
        self._free_ns = t_ns + self._duration_ns(winner.tx_bits)
        self.busy_ns += self._free_ns - t_ns
        following = winner.port.sent()
        if following is not None:
            self._compete(following)

    def _deliver(self, flight: _Pending) -> None:
        self._flight = None
        self.frames += 1
        can, sender, t_ns = flight.can, flight.port, self.now_ns
        for tap in self._taps:
            self._guarded(tap, self._flight_start_ns, t_ns, can)
        receivers = None if can.extended else self._receivers.get(can.can_id)
        if receivers is None:
            receivers = self._find_receivers(can)
        for port in receivers:
            if port is not sender and port.live:
                self._guarded(port.handler, can, t_ns)

    def _find_receivers(self, can: Can) -> tuple[Port, ...]:
        if can.extended:
            return tuple(port for port in self._ports if port.live and port.identifiers is None)
        found = tuple(
            port for port in self._ports if port.live and (port.identifiers is None or can.can_id in port.identifiers)
        )
        self._receivers[can.can_id] = found
        return found

    def _guarded(self, function: Callable[..., None], *args: object) -> None:
        if self.on_handler_error is None:
            function(*args)
            return
        try:
            function(*args)
        except Exception as error:  # noqa: BLE001 - one node's defect must not stop the line for the others
            self.on_handler_error(error)

    def _detach(self, port: Port) -> None:
        if port.attached:
            port.attached = False
            self._ports.remove(port)
            self._receivers.clear()
