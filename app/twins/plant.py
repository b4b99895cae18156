"""Physics of one pitch axis: blade, gear, motor shaft, brake, limit switches and encoders. SI units.

No protocol and no clock: ``step`` moves it on by ``dt_s``. A plain model: rigid, one moving mass, friction, and a load
torque that is given from outside.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import copysign, degrees, pi, radians
from typing import Final

GEAR_RATIO: Final = 183 * 111 / 12
"""Motor revolutions per blade revolution: gear 183, tooth rim 111, bevel 12 (manual, 5.5, pitch system example)."""
ENCODER_INCREMENTS: Final = 1024
"""Increments per revolution of the motor encoder and of the blade encoder (manual, 5.5 and 5.6, examples)."""
BLADE_ENCODER_GEAR: Final = 111 / 15
"""Revolutions of the blade encoder per blade revolution: tooth rim 111, bevel 15 (manual, 5.6, stated gear)."""


@dataclass(frozen=True, slots=True)
class AxisConstants:
    """What the axis is made of. Torques and inertias of the motor shaft, unless a name says otherwise."""

    blade_inertia_kgm2: float = 3000.0
    """About the pitch axis; order of magnitude of a 40 m blade of the 2 MW class (estimate)."""
    motor_inertia_kgm2: float = 0.03
    """Rotor, brake and gear input of a 9 kW asynchronous motor (typical catalogue value)."""
    rated_torque_nm: float = 29.8
    """9.1 kW at 2920 rpm: 400 V, 17 A, cos phi 0.89 (manual, 6410h and 6076h), efficiency 0.87 (estimate)."""
    coulomb_torque_nm: float = 2.5
    """Blade bearing and gear, seen by the motor (estimate)."""
    viscous_nms: float = 0.01
    """Torque per rad/s (estimate)."""
    brake_torque_nm: float = 60.0
    """Holding brake, twice the rated torque (usual sizing)."""
    winding_loss_w: float = 900.0
    """Copper losses at rated current (9.1 kW motor, efficiency class of its time; estimate)."""
    low_stop_deg: float = -5.0
    high_stop_deg: float = 100.0
    """Mechanical end stops, beyond the limit switches (estimate)."""

    @property
    def inertia_kgm2(self) -> float:
        """All that moves, at the motor shaft."""
        return self.motor_inertia_kgm2 + self.blade_inertia_kgm2 / GEAR_RATIO**2


@dataclass(frozen=True, slots=True)
class Switch:
    """A limit switch: closed from ``closes_deg`` on (above, or below where ``below``), with some play."""

    closes_deg: float
    below: bool = False
    play_deg: float = 0.05

    def closed(self, angle_deg: float, was: bool) -> bool:
        """Whether it is actuated at this angle."""
        play_deg = self.play_deg if was else 0.0
        if self.below:
            return angle_deg <= self.closes_deg + play_deg
        return angle_deg >= self.closes_deg - play_deg


SWITCH_0: Final = Switch(-0.5, below=True)
"""The 0 degree switch; just beyond, so that a blade may work at 0 degrees (position not printed, estimate)."""
SWITCH_90: Final = Switch(89.9)
"""The 90 degree switch; closes within the position window of a drive to 90.00 degrees (estimate)."""
SWITCH_95: Final = Switch(95.0)
"""The 95 degree switch, by its name."""


class BrakeFault(Enum):
    """What may be wrong with the holding brake."""

    NONE = "none"
    ENGAGED = "stays engaged"
    LIFTED = "stays lifted"


class EncoderFault(Enum):
    """What may be wrong with the motor encoder."""

    NONE = "none"
    SINE_COSINE = "sine and cosine lost"
    """The count stands still."""
    DATA_CHANNEL = "data channel lost"
    """The count goes on, the serial channel is silent."""


class AxisPlant:
    """State of one axis. ``..._zero_deg``: blade angles at which the encoders count 0 (how they were fitted)."""

    def __init__(
        self,
        angle_deg: float,
        constants: AxisConstants | None = None,
        encoder_zero_deg: float = 0.0,
        blade_encoder_zero_deg: float = 0.0,
    ) -> None:
        self.constants = AxisConstants() if constants is None else constants
        self.brake_lifted = False
        self.load_torque_nm = 0.0
        """From blade weight and wind, at the motor shaft; positive drives towards larger angles."""
        self.azimuth_deg = 0.0
        """Of this blade; 0: it points up."""
        self.wind_mps = 0.0
        self.extra_load_nm = 0.0
        """About the pitch axis of the blade, on top of weight and wind."""
        self.brake_stuck = BrakeFault.NONE
        self.encoder_fault = EncoderFault.NONE
        self.blade_encoder_failed = False
        self.blade_encoder_slip_deg = 0.0
        """How far the blade encoder has slipped on its shaft, as an angle of the blade."""
        self.at_0 = self.at_90 = self.at_95 = False
        self.shaft_rad = 0.0
        self.speed_rad_s = 0.0
        self.power_w = 0.0
        """Electrical power that the motor takes; negative: it feeds back."""
        self._encoder_zero_deg = encoder_zero_deg
        self._blade_encoder_zero_deg = blade_encoder_zero_deg
        self._inertia_kgm2 = self.constants.inertia_kgm2
        self.place(angle_deg)

    @property
    def angle_deg(self) -> float:
        """Blade angle."""
        return degrees(self.shaft_rad) / GEAR_RATIO

    @property
    def encoder_increments(self) -> float:
        """Count of the motor encoder, interpolated (sine-cosine)."""
        zero_rad = radians(self._encoder_zero_deg) * GEAR_RATIO
        return (self.shaft_rad - zero_rad) / (2 * pi) * ENCODER_INCREMENTS

    @property
    def blade_encoder_increments(self) -> float:
        """Count of the blade encoder."""
        turns = (self.angle_deg - self._blade_encoder_zero_deg) / 360
        return turns * BLADE_ENCODER_GEAR * ENCODER_INCREMENTS

    def place(self, angle_deg: float) -> None:
        """Put the blade at an angle, at rest."""
        self.shaft_rad = radians(angle_deg) * GEAR_RATIO
        self.speed_rad_s = 0.0
        self._look_at_switches()

    @property
    def slips(self) -> bool:
        """The load is more than friction and brake hold."""
        return abs(self.load_torque_nm) > self._hold_nm

    @property
    def _hold_nm(self) -> float:
        constants = self.constants
        return constants.coulomb_torque_nm + (0.0 if self.brake_lifted else constants.brake_torque_nm)

    def rest(self) -> None:
        """Stand: what little speed is left is held by friction, and no power is taken."""
        self.speed_rad_s = self.power_w = 0.0

    def step(self, dt_s: float, torque_nm: float) -> None:
        """Move on by ``dt_s`` under a motor torque."""
        constants = self.constants
        drive_nm = torque_nm + self.load_torque_nm - constants.viscous_nms * self.speed_rad_s
        speed = self.speed_rad_s + drive_nm / self._inertia_kgm2 * dt_s
        friction = self._hold_nm / self._inertia_kgm2 * dt_s
        # Dry friction brings to rest, and never beyond.
        speed = 0.0 if abs(speed) <= friction else speed - copysign(friction, speed)
        self.shaft_rad += speed * dt_s
        self.speed_rad_s = speed
        share = torque_nm / constants.rated_torque_nm
        self.power_w = torque_nm * speed + constants.winding_loss_w * share * share
        self._stop_at_ends()
        self._look_at_switches()

    def _stop_at_ends(self) -> None:
        angle_deg = self.angle_deg
        low_deg, high_deg = self.constants.low_stop_deg, self.constants.high_stop_deg
        if angle_deg < low_deg or angle_deg > high_deg:
            self.shaft_rad = radians(min(max(angle_deg, low_deg), high_deg)) * GEAR_RATIO
            self.speed_rad_s = 0.0

    def _look_at_switches(self) -> None:
        angle_deg = self.angle_deg
        self.at_0 = SWITCH_0.closed(angle_deg, self.at_0)
        self.at_90 = SWITCH_90.closed(angle_deg, self.at_90)
        self.at_95 = SWITCH_95.closed(angle_deg, self.at_95)
