"""What surrounds the axes of a twin turbine: rotor and wind act on them and are told on the line ten times a second."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from app.twins.canopen_device import MS, SECOND
from app.twins.plant import AxisPlant
from app.twins.ports import Alarm, Line
from app.twins.rotor import Rotor
from app.twins.wind import EXTREME_GUST_S
from app.wire.frame import Can
from app.wire.twin_environment import CAN_ID, pack_environment

PERIOD_NS: Final = 100 * MS
"""One frame of some 150 bits: 0.3 % of 500 kbit/s."""


class Surroundings:
    """A rotor that turns with the pitch of its ``axes``, and its place on the line. Receives nothing.

    The axes are evenly spread over the turn, in their order, clockwise seen from upwind as the rotor turns.
    """

    def __init__(self, line: Line, rotor: Rotor, axes: Sequence[AxisPlant]) -> None:
        self.rotor = rotor
        self._axes = axes
        self._port = line.attach(_ignore)
        self._port.accept(())
        self._alarm = Alarm(line)
        self._last_ns = 0

    @property
    def mean_wind_mps(self) -> float:
        """Mean of the wind at the hub; gusts and slow changes come on top."""
        return self.rotor.wind.mean_mps

    @mean_wind_mps.setter
    def mean_wind_mps(self, mean_mps: float) -> None:
        self.rotor.wind.set_mean(mean_mps)

    def set_wind(self, mean_mps: float, over_s: float = 0.0) -> None:
        """Let the mean wind go to ``mean_mps`` within ``over_s``. Raises ValueError where it is no wind."""
        self.rotor.wind.set_mean(mean_mps, over_s)

    def gust(self, peak_mps: float, rise_s: float = 3.0, hold_s: float = 2.0, fall_s: float = 5.0) -> None:
        """A gust from now on. Raises ValueError where it has no time or no size."""
        self.rotor.wind.gust(peak_mps, rise_s, hold_s, fall_s)

    def extreme_gust(self, peak_mps: float, duration_s: float = EXTREME_GUST_S) -> None:
        """The extreme operating gust of IEC 61400-1. Raises ValueError where it has no time or no size."""
        self.rotor.wind.extreme_gust(peak_mps, duration_s)

    def start(self, t_ns: int) -> None:
        """Time begins to pass at ``t_ns`` (line time)."""
        self._last_ns = t_ns
        self._act()
        self._alarm.set(t_ns + PERIOD_NS, self._tick)

    def stop(self) -> None:
        """Send no more."""
        self._alarm.clear()
        self._port.clear()

    def _tick(self, t_ns: int) -> None:
        self._alarm.set(t_ns + PERIOD_NS, self._tick)
        self.rotor.step((t_ns - self._last_ns) / SECOND, [axis.angle_deg for axis in self._axes])
        self._last_ns = t_ns
        self._act()
        self._port.send(Can(CAN_ID, pack_environment(self.rotor.environment), extended=True))

    def _act(self) -> None:
        """Give every axis its azimuth and the wind."""
        wind_mps = self.rotor.wind_mps
        for place, axis in enumerate(self._axes):
            axis.azimuth_deg = (self.rotor.azimuth_deg + place * 360.0 / len(self._axes)) % 360.0
            axis.wind_mps = wind_mps


def _ignore(_can: Can, _t_ns: int) -> None:
    """Nothing on the bus is for it."""
