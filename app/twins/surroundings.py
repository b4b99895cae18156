"""Sends what surrounds the axes of a twin turbine: rotor and wind, ten times a second."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from app.twins.canopen_device import MS, SECOND
from app.twins.plant import AxisPlant
from app.twins.ports import Alarm, Line
from app.twins.rotor import Rotor
from app.wire.frame import Can
from app.wire.twin_environment import CAN_ID, pack_environment

PERIOD_NS: Final = 100 * MS
"""One frame of some 150 bits: 0.3 % of 500 kbit/s."""


class Surroundings:
    """A rotor that turns with the pitch of its ``axes``, and its place on the line. Receives nothing."""

    def __init__(self, line: Line, rotor: Rotor, axes: Sequence[AxisPlant]) -> None:
        self.rotor = rotor
        self._axes = axes
        self._port = line.attach(_ignore)
        self._port.accept(())
        self._alarm = Alarm(line)
        self._last_ns = 0

    def start(self, t_ns: int) -> None:
        """Time begins to pass at ``t_ns`` (line time)."""
        self._last_ns = t_ns
        self._alarm.set(t_ns + PERIOD_NS, self._tick)

    def stop(self) -> None:
        """Send no more."""
        self._alarm.clear()
        self._port.clear()

    def _tick(self, t_ns: int) -> None:
        self._alarm.set(t_ns + PERIOD_NS, self._tick)
        self.rotor.step((t_ns - self._last_ns) / SECOND, [axis.angle_deg for axis in self._axes])
        self._last_ns = t_ns
        self._port.send(Can(CAN_ID, pack_environment(self.rotor.environment), extended=True))


def _ignore(_can: Can, _t_ns: int) -> None:
    """Nothing on the bus is for it."""
