"""Physics of one pitch axis: blade, gear with play, motor, brake, limit switches and encoders. SI units.

No protocol and no clock: ``advance`` runs cycles of 1 ms. The equations are those of ``axis_kernel``; here stand what
the axis is made of, what loads the blade, what may be wrong with it, and names for the numbers of the kernel.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import cos, exp, pi, radians, sin, sqrt
from typing import Final

from app.twins import axis_kernel as k
from app.twins.plant_kernel import SIZE, Run, run_plain

GEAR_RATIO: Final = 183 * 111 / 12
"""Motor revolutions per blade revolution: gear 183, tooth rim 111, bevel 12 (manual, 5.5, pitch system example)."""
ENCODER_INCREMENTS: Final = 1024
"""Increments per revolution of the motor encoder and of the blade encoder (manual, 5.5 and 5.6, examples)."""
BLADE_ENCODER_GEAR: Final = 111 / 15
"""Revolutions of the blade encoder per blade revolution: tooth rim 111, bevel 15 (manual, 5.6, stated gear)."""
BLADE_INCREMENTS_PER_RAD: Final = BLADE_ENCODER_GEAR * ENCODER_INCREMENTS / (2 * pi * GEAR_RATIO)
"""Counts of the blade encoder for one radian of the motor shaft."""
_SHAFT_RAD_PER_DEG: Final = pi / 180 * GEAR_RATIO
_SWITCH_PLAY_DEG: Final = 0.05
_GRAVITY_MPS2: Final = 9.81


@dataclass(frozen=True, slots=True)
class AxisConstants:
    """What the axis is made of. Torques and inertias of the motor shaft, unless a name says otherwise."""

    blade_inertia_kgm2: float = 3000.0
    """About the pitch axis; order of magnitude of a 40 m blade of the 2 MW class (estimate)."""
    motor_inertia_kgm2: float = 0.03
    """Rotor, brake and gear input of a 9 kW asynchronous motor (typical catalogue value)."""
    rated_torque_nm: float = 29.8
    """9.1 kW at 2920 rpm: 400 V, 17 A, cos phi 0.89 (manual, 6410h and 6076h), efficiency 0.87 (estimate)."""
    rated_current_a: float = 21.4
    """Amplitude of the current that makes torque: 17 A x sqrt 2 x cos phi 0.89 (manual, 6076h and 6410h)."""
    winding_loss_w: float = 900.0
    """Copper losses at rated current (9.1 kW motor, efficiency class of its time; estimate)."""
    inductance_h: float = 0.008
    """Leakage of the winding: 6 ms behind its resistance (typical of such a motor)."""
    stage_w: float = 10.0
    stage_v: float = 8.0
    """Losses of the output stage, at rest and for each ampere: 2 % of rated power (typical of IGBT)."""
    coulomb_torque_nm: float = 2.5
    """Dry friction of blade bearing and gear (estimate)."""
    motor_friction_share: float = 0.4
    """Of it, what is on the motor's side of the play (estimate)."""
    viscous_nms: float = 0.01
    """Torque per rad/s (estimate)."""
    play_deg: float = 0.04
    """Between pinion and tooth rim, as an angle of the blade (estimate: 0.5 mm on a rim of 1.5 m)."""
    mesh_hz: float = 25.0
    """Frequency of the blade against the gear's stiffness (estimate)."""
    mesh_damping: float = 0.15
    """Of that oscillation, as a share of critical damping (estimate)."""
    brake_torque_nm: float = 60.0
    """Holding brake, twice the rated torque (usual sizing)."""
    blade_moment_kgm: float = 600.0
    """Mass times the distance of its centre from the pitch axis: 6 t, 0.1 m (estimate)."""
    wind_nm_per_m2s2: float = 40.0
    """Moment about the pitch axis per square of the wind speed, towards feather (estimate)."""
    low_stop_deg: float = -5.0
    high_stop_deg: float = 100.0
    """Mechanical end stops, beyond the limit switches (estimate)."""

    @property
    def blade_kgm2(self) -> float:
        """The blade's inertia at the motor shaft."""
        return self.blade_inertia_kgm2 / GEAR_RATIO**2

    @property
    def inertia_kgm2(self) -> float:
        """All that moves, at the motor shaft."""
        return self.motor_inertia_kgm2 + self.blade_kgm2

    @property
    def torque_nm_per_a(self) -> float:
        """Torque constant, for the amplitude of the current."""
        return self.rated_torque_nm / self.rated_current_a

    @property
    def resistance_ohm(self) -> float:
        """Of a phase: the copper losses of three phases are 3/2 R i^2."""
        return self.winding_loss_w / (1.5 * self.rated_current_a**2)

    @property
    def mesh_nm_per_rad(self) -> float:
        """Stiffness of the gear at the motor shaft."""
        return self.blade_kgm2 * (2 * pi * self.mesh_hz) ** 2

    @property
    def mesh_nms(self) -> float:
        """Damping of the gear."""
        return 2 * self.mesh_damping * sqrt(self.mesh_nm_per_rad * self.blade_kgm2)


SWITCH_0_DEG: Final = -0.5
"""The 0 degree switch; just beyond, so that a blade may work at 0 degrees (position not printed, estimate)."""
SWITCH_90_DEG: Final = 89.9
"""The 90 degree switch; closes within the position window of a drive to 90.00 degrees (estimate)."""
SWITCH_95_DEG: Final = 95.0
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
    """State of one axis. ``..._zero_deg``: blade angles at which the encoders count 0 (how they were fitted).

    ``run`` moves it on, together with the supply that shares its lists ``s`` and ``p``.
    """

    def __init__(
        self,
        angle_deg: float,
        constants: AxisConstants | None = None,
        encoder_zero_deg: float = 0.0,
        blade_encoder_zero_deg: float = 0.0,
        run: Run = run_plain,
    ) -> None:
        self.constants = AxisConstants() if constants is None else constants
        self.s = [0.0] * SIZE
        self.p = [0.0] * SIZE
        self.run = run
        self.brake_lifted = False
        """As the drive commands it."""
        self.load_torque_nm = 0.0
        """At the motor shaft, on top of all else; positive drives towards larger angles."""
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
        self._encoder_zero_deg = encoder_zero_deg
        self._blade_encoder_zero_deg = blade_encoder_zero_deg
        self._blade_encoder_held_deg = angle_deg
        self._write_constants()
        self.place(angle_deg)

    # -- what is ------------------------------------------------------------------------

    @property
    def angle_deg(self) -> float:
        """Blade angle."""
        return self.s[k.BLADE_RAD] / _SHAFT_RAD_PER_DEG

    @property
    def speed_rad_s(self) -> float:
        """Speed of the motor shaft."""
        return self.s[k.MOTOR_RAD_S]

    @property
    def torque_nm(self) -> float:
        """Torque of the motor."""
        return self.s[k.CURRENT_A] * self.constants.torque_nm_per_a

    @property
    def at_0(self) -> bool:
        """The 0 degree switch is actuated."""
        return self.s[k.AT_0] != 0.0

    @property
    def at_90(self) -> bool:
        """The 90 degree switch is actuated."""
        return self.s[k.AT_90] != 0.0

    @property
    def at_95(self) -> bool:
        """The 95 degree switch is actuated."""
        return self.s[k.AT_95] != 0.0

    @property
    def encoder_increments(self) -> float:
        """Count of the motor encoder, interpolated (sine-cosine)."""
        zero_rad = self._encoder_zero_deg * _SHAFT_RAD_PER_DEG
        return (self.s[k.ENCODER_RAD] - zero_rad) / (2 * pi) * ENCODER_INCREMENTS

    @property
    def blade_encoder_increments(self) -> float:
        """Count of the blade encoder; one that has failed stands still."""
        turns = (self._blade_encoder_deg() - self._blade_encoder_zero_deg) / 360
        return turns * BLADE_ENCODER_GEAR * ENCODER_INCREMENTS

    @property
    def encoder_zero_increments(self) -> float:
        """What the motor encoder counts at a blade angle of 0."""
        return -radians(self._encoder_zero_deg) * GEAR_RATIO / (2 * pi) * ENCODER_INCREMENTS

    @property
    def blade_encoder_zero_increments(self) -> float:
        """What the blade encoder counts at a blade angle of 0, slipped as it is."""
        turns = (self.blade_encoder_slip_deg - self._blade_encoder_zero_deg) / 360
        return turns * BLADE_ENCODER_GEAR * ENCODER_INCREMENTS

    @property
    def at_rest(self) -> bool:
        """Nothing moves, and nothing will by itself."""
        return self._rests_under(self.load_nm)

    def _rests_under(self, load_nm: float) -> bool:
        return self.s[k.MOTOR_RAD_S] == 0.0 == self.s[k.BLADE_RAD_S] and self._holds(load_nm)

    def _holds(self, load_nm: float) -> bool:
        return abs(load_nm) <= self._motor_friction_nm + self._blade_friction_nm

    @property
    def load_nm(self) -> float:
        """Load at the motor shaft from weight, wind and what else was put on it.

        The weight pulls at a centre of mass beside the pitch axis, most where the blade points sideways; the wind
        pushes the blade towards feather, most where it faces the wind.
        """
        constants = self.constants
        pitch = radians(self.angle_deg)
        weight_nm = constants.blade_moment_kgm * _GRAVITY_MPS2 * sin(radians(self.azimuth_deg)) * cos(pitch)
        wind_nm = constants.wind_nm_per_m2s2 * self.wind_mps * self.wind_mps * cos(pitch)
        return (weight_nm + wind_nm + self.extra_load_nm) / GEAR_RATIO + self.load_torque_nm

    # -- motion ---------------------------------------------------------------------------

    def place(self, angle_deg: float) -> None:
        """Put the blade at an angle, at rest."""
        s = self.s
        s[k.MOTOR_RAD] = s[k.BLADE_RAD] = s[k.ENCODER_RAD] = angle_deg * _SHAFT_RAD_PER_DEG
        s[k.MOTOR_RAD_S] = s[k.BLADE_RAD_S] = s[k.ENCODER_RAD_S] = s[k.SPEED_FILTERED] = 0.0
        k.look_at_switches(s, self.p)

    def advance(self, cycles: int) -> int:
        """Run up to so many cycles; gives how many: it stops after one that brought an event (``events``)."""
        s, p = self.s, self.p
        s[k.EVENT] = 0.0
        load_nm = p[k.LOAD_NM] = self.load_nm
        p[k.MOTOR_FRICTION_NM] = self._motor_friction_nm
        p[k.ENCODER_COUNTS] = 0.0 if self.encoder_fault is EncoderFault.SINE_COSINE else 1.0
        p[k.AWAKE] = 0.0 if not p[k.ENERGISED] and s[k.CURRENT_A] == 0.0 and self._rests_under(load_nm) else 1.0
        if not self.blade_encoder_failed:
            self._blade_encoder_held_deg = self.angle_deg + self.blade_encoder_slip_deg
        if not p[k.AWAKE]:
            s[k.MOTOR_DC_W] = 0.0
        return self.run(s, p, cycles)

    @property
    def events(self) -> int:
        """What ended the latest ``advance``: a sum of the kernel's events."""
        return int(self.s[k.EVENT])

    def _blade_encoder_deg(self) -> float:
        if self.blade_encoder_failed:
            return self._blade_encoder_held_deg
        return self.angle_deg + self.blade_encoder_slip_deg

    @property
    def _motor_friction_nm(self) -> float:
        constants = self.constants
        engaged = not self.brake_lifted
        if self.brake_stuck is not BrakeFault.NONE:
            engaged = self.brake_stuck is BrakeFault.ENGAGED
        brake_nm = constants.brake_torque_nm if engaged else 0.0
        return constants.coulomb_torque_nm * constants.motor_friction_share + brake_nm

    @property
    def _blade_friction_nm(self) -> float:
        return self.constants.coulomb_torque_nm * (1 - self.constants.motor_friction_share)

    def _write_constants(self) -> None:
        constants, p = self.constants, self.p
        p[k.MOTOR_KGM2] = constants.motor_inertia_kgm2
        p[k.BLADE_KGM2] = constants.blade_kgm2
        p[k.MOTOR_FRICTION_NM] = self._motor_friction_nm
        p[k.BLADE_FRICTION_NM] = self._blade_friction_nm
        p[k.VISCOUS_NMS] = constants.viscous_nms
        p[k.MESH_NM_PER_RAD] = constants.mesh_nm_per_rad
        p[k.MESH_NMS] = constants.mesh_nms
        p[k.PLAY_RAD] = constants.play_deg * _SHAFT_RAD_PER_DEG
        p[k.TORQUE_NM_PER_A] = constants.torque_nm_per_a
        p[k.RESISTANCE_OHM] = constants.resistance_ohm
        p[k.INDUCTANCE_H] = constants.inductance_h
        p[k.DECAY] = exp(-constants.resistance_ohm / constants.inductance_h * k.CYCLE_S)
        p[k.STAGE_W] = constants.stage_w
        p[k.STAGE_V] = constants.stage_v
        p[k.LOW_STOP_RAD] = constants.low_stop_deg * _SHAFT_RAD_PER_DEG
        p[k.HIGH_STOP_RAD] = constants.high_stop_deg * _SHAFT_RAD_PER_DEG
        p[k.CLOSES_0_RAD] = SWITCH_0_DEG * _SHAFT_RAD_PER_DEG
        p[k.CLOSES_90_RAD] = SWITCH_90_DEG * _SHAFT_RAD_PER_DEG
        p[k.CLOSES_95_RAD] = SWITCH_95_DEG * _SHAFT_RAD_PER_DEG
        p[k.SWITCH_PLAY_RAD] = _SWITCH_PLAY_DEG * _SHAFT_RAD_PER_DEG
        p[k.ENCODER_COUNTS] = 1.0
