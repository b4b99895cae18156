"""Acts at the n-th SDO that crosses the line, at an instant of it: asked for, executed, or answered."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import Final

from app.twins.line import Interference, Port
from app.wire.frame import Can
from app.wire.sdo import REQUEST_BASE, RESPONSE_BASE
from tests.restore_cuts.station import MS, NODES, Station

LATE_NS: Final = 20 * MS
TOO_LATE_NS: Final = 400 * MS
"""After every time-out of the tool, while it does something else."""
SLOW_NS: Final = 60 * MS
_WRITTEN: Final = 0x60
"""First byte of the acknowledge of a write (CiA 301, 7.2.4.3.3)."""
_REQUESTS: Final = frozenset(REQUEST_BASE + node for node in NODES.values())
_RESPONSES: Final = frozenset(RESPONSE_BASE + node for node in NODES.values())


class Manner(Enum):
    """How the devices answer, and at which instant of an SDO the cut comes.

    ``PLAIN``: at once; after the answer was handed over. ``SLOW``: the memory takes long; after the request arrived, so
    that a save is cut in its midst. ``LATE``: acknowledges of writes come late; after it was executed, its answer
    still on its way for longer than the tool waits.
    """

    PLAIN = "plain"
    SLOW = "slow EEPROM"
    LATE = "late acknowledges"


class Trigger(Interference):
    """Counts SDOs; at the ``at``-th ``act`` is called on the line's thread. None counts only."""

    def __init__(self, station: Station, manner: Manner, at: int | None, act: Callable[[], None]) -> None:
        self.count = 0
        self._station = station
        self._manner = manner
        self._at = at
        self._act = act

    def __enter__(self) -> Trigger:
        self._station.do(self._begin)
        return self

    def __exit__(self, *_exc: object) -> None:
        self._station.do(self._end)

    def takes(self, port: Port, can: Can, ready_ns: int) -> bool:
        """An answer is about to be sent: what was asked for is done."""
        if can.can_id not in _RESPONSES:
            return False
        struck = self._step()
        if not struck and can.data[0] != _WRITTEN:
            return False
        port.put(can, ready_ns + (TOO_LATE_NS if struck else LATE_NS))
        return True

    def _begin(self) -> None:
        for device in self._station.devices.values():
            device.memory.slow_ns = SLOW_NS if self._manner is Manner.SLOW else None
        if self._manner is Manner.LATE:
            self._station.line.inject(self)
        else:
            self._station.line.tap(self._seen)

    def _end(self) -> None:
        for device in self._station.devices.values():
            device.memory.slow_ns = None
        self._station.line.withdraw(self)
        self._station.line.untap(self._seen)

    def _seen(self, _start_ns: int, _end_ns: int, can: Can) -> None:
        if can.can_id in (_REQUESTS if self._manner is Manner.SLOW else _RESPONSES):
            self._step()

    def _step(self) -> bool:
        """Acted upon once all that is due on the line, and what its clients are told of it, is done."""
        self.count += 1
        if self.count != self._at:
            return False
        self._station.thread.call_soon(self._act)
        return True
