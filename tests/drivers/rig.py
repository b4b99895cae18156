"""The SDO client on a simulated CAN line with a clock that is turned by hand: CAN's time, no waiting."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import repeat
from typing import Any

from app.drivers.sdo_client import SdoClient
from app.model.address import Address
from app.model.description import Description
from app.model.description_file import load_builtin
from app.twins.line import CanLine
from app.twins.object_store import ObjectStore
from app.twins.sdo_server import SdoServer
from app.wire import sdo
from app.wire.frame import Can, Direction, Frame

MS = 1_000_000
S = 1_000_000_000
PMC = load_builtin("oat-pmc")
WINDOW = Address(0x6065)
"""Following error window: UNSIGNED32, rw."""
TIMEOUT_6066 = Address(0x6066)
"""Following error time-out: UNSIGNED16, rw."""
POSITION = Address(0x6064)
"""Position actual value: INTEGER32, read-only."""
NAME = Address(0x1008)


class LinePort:
    """The client's place on the line."""

    def __init__(self, line: CanLine) -> None:
        self._line = line
        self.listeners: list[Callable[[list[Frame]], None]] = []
        self._port = line.attach(self._on_frame)
        self.sent: list[Can] = []

    def send(self, can: Can) -> None:
        self.sent.append(can)
        self._port.send(can)

    def call_at(self, at_ns: int, callback: Callable[[], None]) -> None:
        self._line.call_at(at_ns, lambda _t_ns: callback())

    def _on_frame(self, can: Can, t_ns: int) -> None:
        for listener in self.listeners:
            listener([Frame(t_ns, "can0", Direction.RX, can)])


class ServedNode:
    """A device that answers SDO in order, each answer ``delays_ns`` after the one before it at the earliest."""

    def __init__(self, line: CanLine, node: int, description: Description, delays_ns: Iterator[int] | None) -> None:
        self.node = node
        self.store = ObjectStore(description, node)
        self.store.at(NAME).raw = "a device with a long name"
        self.written: list[tuple[Address, int]] = []
        self._line = line
        self._delays_ns = repeat(MS) if delays_ns is None else delays_ns
        self._free_ns = 0
        self._port = line.attach(self._on_frame, [sdo.REQUEST_BASE + node])
        self._server = SdoServer(self.store, line, self._reply)

    def watch_writes(self, address: Address) -> None:
        """Note every value that is written to ``address``."""
        cell = self.store.at(address)
        cell.effect = lambda raw: self.written.append((address, int(raw)))

    def boot(self) -> None:
        """Forget all that was asked, and say so (CiA 301, 7.3.2.2.3)."""
        self._port.clear()
        self._server.reset()
        self._port.send(Can(0x700 + self.node, b"\0"))

    def _on_frame(self, can: Can, t_ns: int) -> None:
        """A slow device works when its turn comes, and answers then; an abort costs it nothing."""
        aborted = can.data[0] >> 5 == sdo.Command.ABORT
        self._free_ns = max(self._free_ns, t_ns) + (0 if aborted else next(self._delays_ns))
        self._line.call_at(self._free_ns, lambda now_ns: self._server.request(can.data, now_ns))

    def _reply(self, data: bytes, _t_ns: int) -> None:
        self._port.send(Can(sdo.RESPONSE_BASE + self.node, data))


class Outcome:
    """Where a job's result arrives."""

    def __init__(self) -> None:
        self.result: Any = None
        self.error: Exception | None = None
        self.calls = 0

    def __call__(self, result: Any, error: Exception | None) -> None:
        self.result, self.error = result, error
        self.calls += 1

    @property
    def done(self) -> bool:
        return self.calls > 0


class Rig:
    """A line, a client, and devices that are added."""

    def __init__(self) -> None:
        self.line = CanLine(500_000)
        self.port = LinePort(self.line)
        self.client = SdoClient(self.port, lambda: self.line.now_ns)
        self.port.listeners.append(self.client.on_frames)

    def node(self, node: int = 11, delays_ns: Iterator[int] | None = None) -> ServedNode:
        return ServedNode(self.line, node, PMC, delays_ns)

    def run(self, duration_ns: int) -> None:
        self.line.run_until(self.line.now_ns + duration_ns)

    def run_until(self, condition: Callable[[], bool], limit_ns: int = 60 * S) -> None:
        """Let time pass until ``condition`` holds."""
        end_ns = self.line.now_ns + limit_ns
        while not condition():
            if self.line.now_ns >= end_ns:
                raise AssertionError("the condition never came true")
            self.run(MS // 10)


def u32(value: int) -> bytes:
    return value.to_bytes(4, "little")


def u16(value: int) -> bytes:
    return value.to_bytes(2, "little")
