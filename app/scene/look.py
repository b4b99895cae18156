"""How a blade looks, by the state of its axis."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Final

Rgb = tuple[int, int, int]


class BladeState(Enum):
    """What is told by the colour of a blade."""

    UNKNOWN = "unknown"
    """No position was ever seen."""
    STALE = "stale"
    """The position is an old one."""
    IDLE = "idle"
    """The drive is not enabled."""
    ENABLED = "enabled"
    WARNING = "warning"
    FAULT = "fault"

    @property
    def rgb(self) -> Rgb:
        """Red, green, blue; the legend of the page shows the same."""
        return _LOOKS[self].rgb

    @property
    def opacity(self) -> float:
        """Below 1 where what is shown is not the present."""
        return _LOOKS[self].opacity


@dataclass(frozen=True, slots=True)
class _Look:
    rgb: Rgb
    opacity: float = 1.0


_LOOKS: Final = {
    BladeState.UNKNOWN: _Look((110, 118, 126), 0.22),
    BladeState.STALE: _Look((110, 118, 126), 0.40),
    BladeState.IDLE: _Look((214, 220, 226)),
    BladeState.ENABLED: _Look((92, 172, 255)),
    BladeState.WARNING: _Look((245, 166, 35)),
    BladeState.FAULT: _Look((232, 72, 60)),
}


@dataclass(frozen=True, slots=True)
class BladePose:
    """What is shown of one blade. ``angle_deg`` None: none was ever seen; ``demand_deg`` None: nothing is demanded."""

    angle_deg: float | None
    state: BladeState
    demand_deg: float | None = None

    @property
    def shows_demand(self) -> bool:
        """The blade is not yet where it should be: its ghost is worth showing."""
        if self.demand_deg is None or self.angle_deg is None or self.state is BladeState.STALE:
            return False
        return abs(self.demand_deg - self.angle_deg) >= DEMAND_REACHED_DEG


DEMAND_REACHED_DEG: Final = 0.3
"""Closer than this, blade and ghost would be one."""


@dataclass(frozen=True, slots=True)
class ShaftPose:
    """What is shown of an axis without a blade. ``shaft_deg`` None: no angle was ever seen.

    ``motor_deg`` is the angle of the motor before the gear, None where the gear is not known. ``turns``: 1 positive,
    -1 negative, 0 where it stands or nobody knows.
    """

    shaft_deg: float | None
    motor_deg: float | None
    state: BladeState
    turns: int = 0


@dataclass(frozen=True, slots=True)
class CylinderPose:
    """What is shown of one hydraulic cylinder; places of its rod are shares of the stroke, 0 is in.

    ``extension`` None: nobody tells it. ``setpoint`` is where it should be, ``limits`` where it may be, None where
    nothing of the kind is in force.
    """

    extension: float | None
    state: BladeState
    setpoint: float | None = None
    limits: tuple[float, float] | None = None

    @property
    def shows_setpoint(self) -> bool:
        """The rod is not yet where it should be: its ghost is worth showing."""
        if self.setpoint is None or self.extension is None or self.state is BladeState.STALE:
            return False
        return abs(self.setpoint - self.extension) >= SETPOINT_REACHED


SETPOINT_REACHED: Final = 0.004
"""Of the stroke. Closer than this, rod and ghost would be one."""


@dataclass(frozen=True, slots=True)
class ActuatorPose:
    """What is shown of the one or two cylinders that turn one blade. ``angle_deg`` None: it was never seen.

    ``coupled``: both turn it, so that one that nobody tells of stands where the blade has it.
    """

    cylinders: tuple[CylinderPose, ...]
    angle_deg: float | None
    state: BladeState
    coupled: bool = False


@dataclass(frozen=True, slots=True)
class RotorPose:
    """Rotor and wind. None: not known; a rotor of unknown azimuth stands with blade 1 upwards.

    ``wind_deg`` is where the wind comes from, off the nacelle's direction, positive from the right looking upwind.
    """

    azimuth_deg: float | None = None
    wind_mps: float | None = None
    wind_deg: float | None = None


UNKNOWN_BLADE: Final = BladePose(None, BladeState.UNKNOWN)
UNKNOWN_ROTOR: Final = RotorPose()
