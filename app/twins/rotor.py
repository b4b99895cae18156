"""Rotor and wind of a twin turbine: a plain model, good for a picture and for nothing else.

Wind: a mean with slow changes of the first order (Ornstein-Uhlenbeck process), from a seed. Rotor: its speed tends,
with one time constant, to the speed at which a tip-speed ratio that depends on the pitch angles alone is reached. There
is no generator, no loads, no controller; a rated speed bounds it as a generator would.

No clock is read: ``step`` moves on by ``dt_s``. SI units but for degrees.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, pi, sqrt
from random import Random
from typing import Final

from app.wire.twin_environment import TwinEnvironment

ROTOR_RADIUS_M: Final = 35.0
"""Of a turbine of the 2 MW class (typical)."""
RATED_RPM: Final = 18.0
"""Of such a rotor (typical)."""
_RPM: Final = 30 / pi
"""rad/s to rpm."""
_TIP_SPEED_RATIOS: Final = ((-10.0, 7.5), (0.0, 7.5), (10.0, 6.0), (25.0, 3.0), (45.0, 1.2), (70.0, 0.35), (90.0, 0.10))
"""Pitch angle in degrees, and tip-speed ratio at which the rotor idles (estimates by shape of usual curves)."""


@dataclass(frozen=True, slots=True)
class RotorConstants:
    """Of the plain model; all are estimates."""

    mean_wind_mps: float = 7.5
    wind_spread_mps: float = 1.1
    wind_time_s: float = 12.0
    direction_spread_deg: float = 6.0
    direction_time_s: float = 30.0
    rotor_time_s: float = 6.0
    """How slowly the rotor follows."""


class Rotor:
    """State of rotor and wind. Two rotors of one ``seed`` that take the same steps do the same."""

    def __init__(self, seed: int, constants: RotorConstants | None = None) -> None:
        self.constants = RotorConstants() if constants is None else constants
        self._random = Random(seed)
        self.wind_mps = self.constants.mean_wind_mps
        self.wind_deg = 0.0
        """Where the wind comes from, from the nacelle's direction, positive clockwise seen from above."""
        self.azimuth_deg = 0.0
        self.speed_rpm = 0.0

    @property
    def environment(self) -> TwinEnvironment:
        """What the twin tells."""
        return TwinEnvironment(self.azimuth_deg, self.speed_rpm, self.wind_mps, self.wind_deg)

    def step(self, dt_s: float, pitch_deg: Sequence[float]) -> None:
        """Move on by ``dt_s`` with the blades at these angles."""
        constants = self.constants
        wind = self._drift(
            self.wind_mps - constants.mean_wind_mps, dt_s, constants.wind_time_s, constants.wind_spread_mps
        )
        self.wind_mps = max(0.0, constants.mean_wind_mps + wind)
        self.wind_deg = self._drift(self.wind_deg, dt_s, constants.direction_time_s, constants.direction_spread_deg)
        goal_rpm = min(RATED_RPM, idle_rpm(self.wind_mps, pitch_deg))
        self.speed_rpm += (goal_rpm - self.speed_rpm) * (1 - exp(-dt_s / constants.rotor_time_s))
        self.azimuth_deg = (self.azimuth_deg + self.speed_rpm * 6.0 * dt_s) % 360.0

    def _drift(self, off: float, dt_s: float, time_s: float, spread: float) -> float:
        """The exact step of an Ornstein-Uhlenbeck process around 0, whatever ``dt_s`` is."""
        kept = exp(-dt_s / time_s)
        return off * kept + spread * sqrt(1 - kept * kept) * self._random.gauss(0.0, 1.0)


def idle_rpm(wind_mps: float, pitch_deg: Sequence[float]) -> float:
    """The speed to which a rotor without load tends; each blade counts for its share."""
    ratio = sum(_tip_speed_ratio(angle) for angle in pitch_deg) / len(pitch_deg)
    return ratio * wind_mps / ROTOR_RADIUS_M * _RPM


def _tip_speed_ratio(angle_deg: float) -> float:
    """Between the points of the table in straight lines, and as at its ends beyond them."""
    angles = [angle for angle, _ in _TIP_SPEED_RATIOS]
    right = bisect_right(angles, angle_deg)
    if right in (0, len(angles)):
        return _TIP_SPEED_RATIOS[min(right, len(angles) - 1)][1]
    (low, low_ratio), (high, high_ratio) = _TIP_SPEED_RATIOS[right - 1 : right + 1]
    return low_ratio + (high_ratio - low_ratio) * (angle_deg - low) / (high - low)
