"""SDO client of a master on a simulated line: reads and writes of up to four bytes, one after the other for each node.

Only expedited transfers (CiA 301, 7.2.4.2.2): a turbine controller needs no others. What is not answered in time or is
refused ends without a value; whoever asked decides what to do.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from app.model.address import Address
from app.twins.ports import Alarm, Line, Port
from app.wire import sdo
from app.wire.frame import Can

TIMEOUT_NS: Final = 500_000_000
_ABORT: Final = 0x80
_FRAME_BYTES: Final = 8
_MAX_BYTES: Final = 4

Done = Callable[[bytes | None], None]
"""Takes what was read, empty bytes for a write that was acknowledged, None where it failed."""


@dataclass(frozen=True, slots=True)
class Transfer:
    """A read (``data`` None) or a write of 1 to 4 bytes."""

    address: Address
    data: bytes | None
    done: Done

    @property
    def request(self) -> bytes:
        """Its first and only frame."""
        if self.data is None:
            return sdo.upload_request(self.address)
        return sdo.download_request(self.address, self.data)


class SdoClient:
    """Transfers with all nodes of a line, sent through ``port``; ``response`` takes the answers that come in."""

    def __init__(self, line: Line, port: Port, timeout_ns: int = TIMEOUT_NS) -> None:
        self._line = line
        self._port = port
        self._timeout_ns = timeout_ns
        self._waiting: dict[int, deque[Transfer]] = {}
        self._running: dict[int, Transfer] = {}
        self._alarms: dict[int, Alarm] = {}

    def idle(self, node: int) -> bool:
        """No transfer with ``node`` runs or waits."""
        return node not in self._running

    def read(self, node: int, address: Address, done: Done) -> None:
        """Read an object of up to four bytes."""
        self._queue(node, Transfer(address, None, done))

    def write(self, node: int, address: Address, data: bytes, done: Done) -> None:
        """Write an object. Raises ValueError where ``data`` has not 1 to 4 bytes."""
        if not 0 < len(data) <= _MAX_BYTES:
            raise ValueError(f"{len(data)} bytes for {address}")
        self._queue(node, Transfer(address, data, done))

    def drop(self, node: int) -> None:
        """Forget all transfers with ``node``; nobody is told."""
        self._waiting.pop(node, None)
        self._running.pop(node, None)
        self._alarm(node).clear()

    def response(self, can: Can) -> None:
        """A frame of an SDO server came. What answers no request of ours is somebody else's."""
        node = can.can_id - sdo.RESPONSE_BASE
        transfer = self._running.get(node)
        if transfer is None or can.remote or len(can.data) != _FRAME_BYTES:
            return
        frame = sdo.multiplexed(can.data)
        if frame.address != transfer.address:
            return
        if can.data[0] == _ABORT:
            self._end(node, None)
        elif transfer.data is None and frame.command == sdo.Command.SCS_UPLOAD:
            self._end(node, sdo.expedited_data(frame))
        elif transfer.data is not None and frame.command == sdo.Command.SCS_DOWNLOAD:
            self._end(node, b"")

    def _queue(self, node: int, transfer: Transfer) -> None:
        if node in self._running:
            self._waiting.setdefault(node, deque()).append(transfer)
        else:
            self._start(node, transfer)

    def _start(self, node: int, transfer: Transfer) -> None:
        self._running[node] = transfer
        self._port.send(Can(sdo.REQUEST_BASE + node, transfer.request))
        self._alarm(node).set(self._line.now_ns + self._timeout_ns, lambda _t_ns: self._late(node))

    def _late(self, node: int) -> None:
        self._port.send(Can(sdo.REQUEST_BASE + node, sdo.abort(self._running[node].address, sdo.Abort.TIMED_OUT)))
        self._end(node, None)

    def _end(self, node: int, data: bytes | None) -> None:
        transfer = self._running.pop(node)
        self._alarm(node).clear()
        waiting = self._waiting.get(node)
        if waiting:
            self._start(node, waiting.popleft())
        transfer.done(data)

    def _alarm(self, node: int) -> Alarm:
        return self._alarms.setdefault(node, Alarm(self._line))
