"""Faults on the wire: what happens to frames, nodes that fall off the bus, and strangers on it.

Every kind is a class; made at line time, it acts until ``end``. All that is random comes from the ``Random`` that it is
given, one draw for each frame that it looks at, so that the same frames meet the same fate.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from random import Random
from typing import Final

from app.model.address import Address
from app.twins.canopen_device import CanopenDevice
from app.twins.line import CanLine, Interference, Port
from app.twins.line_client import Answer, LineClient
from app.twins.ports import Alarm
from app.wire.can_bits import frame_bits
from app.wire.frame import Can

Values = Mapping[str, float]
BUS_OFF_BITS: Final = 128 * 11
"""Recessive bits that a controller must see before it returns from bus off (ISO 11898-1, 12.1.4.4)."""
_MS: Final = 1_000_000
_SECOND: Final = 1_000_000_000
_NMT_ROUNDS: Final = 10
"""A second master repeats its NMT command every so many rounds."""


class FrameFault(Interference):
    """Something happens to a share of the base frames in a range of identifiers, of one ``port`` or of all.

    After ``count`` frames (0: no end) it has ended by itself, and ``finished`` is called once nothing is held back.
    """

    def __init__(
        self, line: CanLine, values: Values, random: Random, port: object | None, finished: Callable[[], None]
    ) -> None:
        self.line = line
        self.random = random
        self._port = port
        self._share = values["percent"] / 100.0
        self._left: int | None = int(values["count"]) or None
        self._identifiers = range(int(values["first_id"]), int(values["last_id"]) + 1)
        self._finished = finished
        line.inject(self)

    def end(self) -> None:
        """Let frames be."""
        self.line.withdraw(self)

    def takes(self, port: Port, can: Can, ready_ns: int) -> bool:
        """Draw for the frame, if it is one of those."""
        if can.extended or can.can_id not in self._identifiers or (self._port is not None and port is not self._port):
            return False
        if self._left == 0 or self.random.random() >= self._share:
            return False
        self.act(port, can, ready_ns)
        if self._left is not None:
            self._left -= 1
        self.finish()
        return True

    def finish(self) -> None:
        """It has ended, if all frames that it was ordered for are dealt with."""
        if self._left == 0 and not self.holds_back():
            self._finished()

    def holds_back(self) -> bool:
        """Whether a frame waits in it."""
        return False

    def act(self, port: Port, can: Can, ready_ns: int) -> None:
        """What happens; here: the frame is lost."""


class FramesLost(FrameFault):
    """Frames never reach the bus."""


class FramesDelayed(FrameFault):
    """Frames are ready later, by a time between ``delay_ms`` and ``delay_ms + spread_ms``."""

    def __init__(
        self, line: CanLine, values: Values, random: Random, port: object | None, finished: Callable[[], None]
    ) -> None:
        super().__init__(line, values, random, port, finished)
        self._least_ns = round(values["delay_ms"] * _MS)
        self._spread_ns = round(values["spread_ms"] * _MS)

    def act(self, port: Port, can: Can, ready_ns: int) -> None:
        """Queue it for later."""
        port.put(can, ready_ns + self._least_ns + (self.random.randrange(self._spread_ns) if self._spread_ns else 0))


class FramesDoubled(FrameFault):
    """Frames are sent twice, one behind the other."""

    def act(self, port: Port, can: Can, ready_ns: int) -> None:
        """Queue it twice."""
        port.put(can, ready_ns)
        port.put(can, ready_ns)


@dataclass(slots=True, eq=False)
class _Held:
    """A frame that is held back; ``behind`` is the frame that must go first, once it is known."""

    port: Port
    can: Can
    epoch: int
    behind: Can | None = None


class FramesReordered(FrameFault):
    """Frames come behind the next frame of the same sender, or ``hold_ms`` late where it sends none."""

    def __init__(
        self, line: CanLine, values: Values, random: Random, port: object | None, finished: Callable[[], None]
    ) -> None:
        super().__init__(line, values, random, port, finished)
        self._hold_ns = round(values["hold_ms"] * _MS)
        self._held: list[_Held] = []
        line.tap(self._on_line)

    def takes(self, port: Port, can: Can, ready_ns: int) -> bool:
        """A frame that another one waits for goes its way; else draw."""
        for held in self._held:
            if held.port is port and held.behind is None:
                held.behind = can
                port.put(can, ready_ns)
                return True
        return super().takes(port, can, ready_ns)

    def act(self, port: Port, can: Can, ready_ns: int) -> None:
        """Hold it back."""
        held = _Held(port, can, port.epoch)
        self._held.append(held)
        self.line.call_at(ready_ns + self._hold_ns, lambda _t_ns: self._release(held))

    def holds_back(self) -> bool:
        """Whether a frame waits for another one."""
        return bool(self._held)

    def ended(self) -> None:
        """What is held back goes now."""
        self.line.untap(self._on_line)
        waiting, self._held = self._held, []
        for held in waiting:
            self._put(held)

    def _on_line(self, _start_ns: int, _end_ns: int, can: Can) -> None:
        for held in tuple(self._held):
            if held.behind is can:
                self._release(held)

    def _release(self, held: _Held) -> None:
        if held in self._held:
            self._held.remove(held)
            self._put(held)
            self.finish()

    @staticmethod
    def _put(held: _Held) -> None:
        if held.epoch == held.port.epoch:  # else its sender was reset meanwhile, and has forgotten it
            held.port.put(held.can)


class NodeGone:
    """A node without its plug: what it sends is lost, it hears nothing, and it goes on working."""

    def __init__(self, device: CanopenDevice) -> None:
        self._device = device
        device.port.cut()

    def end(self) -> None:
        """The plug is in again."""
        self._device.port.join()


class BusOff:
    """A node whose controller is bus off. It returns no sooner than the standard allows."""

    def __init__(self, line: CanLine, device: CanopenDevice) -> None:
        self._line = line
        self._device = device
        self._soonest_ns = line.now_ns + BUS_OFF_BITS * _SECOND // line.bitrate
        device.bus_off()

    def end(self) -> None:
        """Recover."""
        if self._line.now_ns >= self._soonest_ns:
            self._device.bus_back()
        else:
            self._line.call_at(self._soonest_ns, lambda _t_ns: self._device.bus_back())


class Babbler:
    """A foreign node that loads the bus with frames of one identifier and of random data."""

    def __init__(self, line: CanLine, values: Values, random: Random) -> None:
        self._line = line
        self._random = random
        self._can_id = int(values["can_id"])
        self._share = values["load_percent"] / 100.0
        self._port = line.attach(_ignore)
        self._port.accept(())
        self._alarm = Alarm(line)
        self._send(line.now_ns)

    def end(self) -> None:
        """Be silent."""
        self._alarm.clear()
        self._port.detach()

    def _send(self, t_ns: int) -> None:
        """One frame, and the next one when its share of the time is over; none more where one still waits."""
        can = Can(self._can_id, self._random.randbytes(8))
        if not self._port.pending:
            self._port.send(can)
        self._alarm.set(t_ns + int(frame_bits(can) * _SECOND / (self._line.bitrate * self._share)), self._send)


class SecondMaster:
    """A foreign client: reads an object and writes it, ``raw`` and what it found first in turn; may send NMT.

    Its rounds come ``interval_ms`` apart, up to a tenth more.
    """

    def __init__(self, line: CanLine, node: int, values: Values, random: Random) -> None:
        self._line = line
        self._node = node
        self._random = random
        self._address = Address(int(values["index"]), int(values["sub"]))
        self._raw = int(values["raw"])
        self._command = int(values["nmt"])
        self._interval_ns = round(values["interval_ms"] * _MS)
        self._client = LineClient(line)
        self._alarm = Alarm(line)
        self._found: bytes | None = None
        self._rounds = 0
        self._round(line.now_ns)

    def end(self) -> None:
        """Leave the bus."""
        self._alarm.clear()
        self._client.close()

    def _round(self, t_ns: int) -> None:
        if self._command and self._rounds % _NMT_ROUNDS == 0:
            self._client.nmt(self._command, self._node)
        self._client.read(self._node, self._address, self._write)
        self._rounds += 1
        self._alarm.set(t_ns + self._interval_ns + self._random.randrange(self._interval_ns // 10), self._round)

    def _write(self, answer: Answer) -> None:
        if answer.abort is not None or not 0 < len(answer.data) <= 4:
            return
        if self._found is None:
            self._found = answer.data
        size = len(answer.data)
        mine = (self._raw & (1 << 8 * size) - 1).to_bytes(size, "little")
        self._client.write(self._node, self._address, self._found if answer.data == mine else mine)


def _ignore(_can: Can, _t_ns: int) -> None:
    """A babbler listens to nobody."""
