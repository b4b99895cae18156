"""What the PMM and the PMC of a blade tell each other over the bus (manual, 3.3.1.3, 4.6.1.7 and 4.8).

OPEN: the manual says that the axis position, the motor temperature and the manual function go "over CAN", and prints
neither frames nor times. Taken: a frame of 8 bytes each 100 ms, its identifier 680h + node of the sender (free in the
predefined connection set of CiA 301), little-endian, from the boot-up on and in no stopped node, for a stopped node is
to be silent. Those of six units take 1.5 % of a bus of 500 kbit/s.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntFlag
from struct import Struct
from typing import Final, Generic, TypeVar

from app.twins.canopen_device import MS, SECOND, CanopenDevice, Power
from app.twins.ports import Alarm
from app.wire.frame import Can
from app.wire.nmt import NmtState

BASE: Final = 0x680
"""Identifier of a link frame, without the node."""
PERIOD_NS: Final = 100 * MS
TIMEOUT_NS: Final = SECOND
"""OPEN when the link counts as broken. Longer than a restart takes, so that one unit may be restarted alone."""
_AXIS: Final = Struct("<ihBx")
_SUPPLY: Final = Struct("<BB6x")
_INT16: Final = (-(1 << 15), (1 << 15) - 1)
_INT32: Final = (-(1 << 31), (1 << 31) - 1)


class AxisFlag(IntFlag):
    """What a PMC says of itself."""

    NONE = 0
    POSITION_VALID = 1 << 0
    """The encoder that shows the position is in order."""
    MOVES = 1 << 1
    FAULT = 1 << 2


class SupplyFlag(IntFlag):
    """What a PMM says of itself."""

    NONE = 0
    FAULT = 1 << 0
    MAINS_FAILED = 1 << 1


@dataclass(frozen=True, slots=True)
class AxisReport:
    """From the PMC: actual position in 0.01 degrees, motor temperature in 0.1 degrees Celsius."""

    position_cdeg: int = 0
    motor_tenths_c: int = 0
    flags: AxisFlag = AxisFlag.NONE

    def to_bytes(self) -> bytes:
        """The frame's 8 bytes; a number beyond its field is held at the field's limit."""
        return _AXIS.pack(_held(self.position_cdeg, _INT32), _held(self.motor_tenths_c, _INT16), self.flags)

    @classmethod
    def from_bytes(cls, data: bytes) -> AxisReport:
        """Raises ValueError where it is no such frame."""
        if len(data) != _AXIS.size:
            raise ValueError(f"a link frame has {_AXIS.size} bytes, not {len(data)}")
        position_cdeg, motor_tenths_c, flags = _AXIS.unpack(data)
        return cls(position_cdeg, motor_tenths_c, AxisFlag(flags & 0b111))


@dataclass(frozen=True, slots=True)
class SupplyReport:
    """From the PMM: the manual function (5042h)."""

    manual: int = 0
    flags: SupplyFlag = SupplyFlag.NONE

    def to_bytes(self) -> bytes:
        """The frame's 8 bytes."""
        return _SUPPLY.pack(self.manual & 0xFF, self.flags)

    @classmethod
    def from_bytes(cls, data: bytes) -> SupplyReport:
        """Raises ValueError where it is no such frame."""
        if len(data) != _SUPPLY.size:
            raise ValueError(f"a link frame has {_SUPPLY.size} bytes, not {len(data)}")
        manual, flags = _SUPPLY.unpack(data)
        return cls(manual, SupplyFlag(flags & 0b11))


HeardT = TypeVar("HeardT", AxisReport, SupplyReport)
"""What a unit hears of the other one."""


class UnitLink(Generic[HeardT]):
    """One unit's end of the link. ``report`` gives what it sends, ``parse`` reads what the other unit sent.

    ``changed`` is told when the link breaks (True) and when it is back (False). It is watched from the first frame on;
    a unit that was stopped does not hear and does not watch.
    """

    def __init__(
        self,
        device: CanopenDevice,
        peer: int,
        report: Callable[[], AxisReport | SupplyReport],
        parse: Callable[[bytes], HeardT],
        changed: Callable[[bool], None],
    ) -> None:
        self._device = device
        self._report = report
        self._parse: Callable[[bytes], HeardT] = parse
        self._changed = changed
        self._alarm = Alarm(device.line)
        self._data: HeardT | None = None
        self._heard_ns = 0
        self.broken = False
        device.listen(BASE + peer, self._on_frame)

    @property
    def data(self) -> HeardT | None:
        """What the other unit said last; None where it is not known: not heard yet, or the link is broken."""
        return self._data

    def start(self, t_ns: int) -> None:
        """Begin to send, after the boot-up message, which has the higher identifier."""
        self._alarm.set(t_ns + PERIOD_NS, self._tick)

    def stop(self) -> None:
        """Fall silent and forget, for a restart."""
        self._alarm.clear()
        self._data = None
        self.broken = False

    def _tick(self, t_ns: int) -> None:
        self._alarm.set(t_ns + PERIOD_NS, self._tick)
        self._device.send(Can(BASE + self._device.node_id, self._report().to_bytes()))
        if self._device.power is not Power.ON or self._device.state is NmtState.STOPPED:
            self._data = None
        elif self._data is not None and t_ns - self._heard_ns >= TIMEOUT_NS:
            self._data = None
            self.broken = True
            self._changed(True)

    def _on_frame(self, can: Can, t_ns: int) -> None:
        if can.remote:
            return
        try:
            self._data = self._parse(can.data)
        except ValueError:
            return  # not of this maker
        self._heard_ns = t_ns
        if self.broken:
            self.broken = False
            self._changed(False)


def _held(number: int, span: tuple[int, int]) -> int:
    return min(max(number, span[0]), span[1])
