"""Rotor of a twin turbine: a plain model of one mass, good for a picture and to close the loop of a controller.

Every blade gives the torque of a line that falls with the speed, from a stalled torque down to none at the tip-speed
ratio at which a rotor with this pitch idles. So the torque is linear in the speed, and a step is exact. What the
generator takes is commanded from outside; where nobody does, a rated speed bounds the rotor as a generator would.

No clock is read: ``step`` moves on by ``dt_s``. SI units but for degrees.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, log, pi
from typing import Final

from app.twins.wind import Wind, WindConstants
from app.wire.twin_environment import TwinEnvironment

ROTOR_RADIUS_M: Final = 35.0
"""Of a turbine of the 2 MW class (typical)."""
RATED_RPM: Final = 18.0
"""Of such a rotor (typical)."""
RPM: Final = 30 / pi
"""rad/s to rpm."""
_AIR_KGPM3: Final = 1.225
"""Air at sea level, 15 degrees (ISO 2533)."""
_TORQUE_NM: Final = 0.5 * _AIR_KGPM3 * pi * ROTOR_RADIUS_M**3
"""Torque at a torque coefficient of 1 and 1 m/s."""
_STALLED: Final = 0.117
"""Torque coefficient at standstill. At half the idle ratio of 15 it gives a power coefficient of 0.44 (typical)."""
_MOST_SLOPE: Final = 0.04
"""Torque coefficient over tip-speed ratio that a blade near feather keeps: it brakes a rated rotor within some 10 s."""
_IDLE_RATIOS: Final = (
    (-10.0, 15.0), (0.0, 15.0), (5.0, 9.8), (10.0, 6.8), (15.0, 5.2), (20.0, 4.1), (25.0, 3.3), (45.0, 1.2),
    (70.0, 0.35), (90.0, 0.10),
)  # fmt: skip
"""Pitch angle in degrees, and tip-speed ratio at which the rotor idles (estimates by shape of usual curves)."""


@dataclass(frozen=True, slots=True)
class RotorConstants:
    """Of the plain model; all are estimates."""

    inertia_kgm2: float = 5e6
    """Rotor and, on its side of the gear, generator (typical of the class)."""
    friction_nms: float = 5e3
    """Of the bearings; small, so that a rotor without wind comes to rest."""


class Rotor:
    """State of rotor and wind. Two rotors of one ``seed`` that take the same steps do the same."""

    def __init__(
        self, seed: int, constants: RotorConstants | None = None, wind_constants: WindConstants | None = None
    ) -> None:
        self.constants = RotorConstants() if constants is None else constants
        self.wind = Wind(seed, wind_constants)
        self.azimuth_deg = 0.0
        """Of blade 1: 0 upwards, rising clockwise seen from upwind."""
        self.speed_rpm = 0.0
        self.generator_nm: float | None = None
        """Torque that the generator takes at the rotor; None: nobody controls it, the rated speed bounds the rotor."""

    @property
    def wind_mps(self) -> float:
        """At the hub."""
        return self.wind.speed_mps

    @property
    def environment(self) -> TwinEnvironment:
        """What the twin tells."""
        return TwinEnvironment(self.azimuth_deg, self.speed_rpm, self.wind.speed_mps, self.wind.direction_deg)

    def settle(self, pitch_deg: Sequence[float]) -> None:
        """Turn as if the blades had stood at these angles for long, with a generator that bounds the speed."""
        start_nm, slope_nms = torque_line(self.wind.speed_mps, pitch_deg, self.constants.friction_nms)
        self.speed_rpm = min(start_nm / slope_nms * RPM, RATED_RPM)

    def step(self, dt_s: float, pitch_deg: Sequence[float]) -> None:
        """Move on by ``dt_s`` with the blades at these angles."""
        self.wind.step(dt_s)
        start_nm, slope_nms = torque_line(self.wind.speed_mps, pitch_deg, self.constants.friction_nms)
        taken_nm = self.generator_nm or 0.0
        goal_rpm = max(0.0, (start_nm - taken_nm) / slope_nms) * RPM
        if self.generator_nm is None:
            goal_rpm = min(goal_rpm, RATED_RPM)
        self.speed_rpm += (goal_rpm - self.speed_rpm) * (1 - exp(-dt_s * slope_nms / self.constants.inertia_kgm2))
        self.azimuth_deg = (self.azimuth_deg + self.speed_rpm * 6.0 * dt_s) % 360.0


def torque_line(wind_mps: float, pitch_deg: Sequence[float], friction_nms: float) -> tuple[float, float]:
    """Torque of the wind at standstill in Nm, and by how much it falls per rad/s; each blade counts for its share."""
    start_nm, slope_nms = 0.0, friction_nms
    for angle_deg in pitch_deg:
        ratio = _idle_ratio(angle_deg)
        stalled_nm = _TORQUE_NM / len(pitch_deg) * min(_STALLED, _MOST_SLOPE * ratio) * wind_mps
        start_nm += stalled_nm * wind_mps
        slope_nms += stalled_nm * ROTOR_RADIUS_M / ratio
    return start_nm, slope_nms


def idle_rpm(wind_mps: float, pitch_deg: Sequence[float], friction_nms: float = 0.0) -> float:
    """The speed to which a rotor without load tends."""
    start_nm, slope_nms = torque_line(wind_mps, pitch_deg, friction_nms)
    return start_nm / slope_nms * RPM if slope_nms else 0.0


def _idle_ratio(angle_deg: float) -> float:
    """Between the points of the table in straight lines of its logarithm, and as at its ends beyond them."""
    angles = [angle for angle, _ in _IDLE_RATIOS]
    right = bisect_right(angles, angle_deg)
    if right in (0, len(angles)):
        return _IDLE_RATIOS[min(right, len(angles) - 1)][1]
    (low, low_ratio), (high, high_ratio) = _IDLE_RATIOS[right - 1 : right + 1]
    return low_ratio * exp(log(high_ratio / low_ratio) * (angle_deg - low) / (high - low))
